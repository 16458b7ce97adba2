//! What is chosen, how much is hidden, what is wrong, and what fills the rest.

use super::common::{colour, named};
use crate::colors;
use crate::workbench::author::{Author, Choose, Edit, name, normal_angle, rounded};
use nudge_core::scene::Object;
use re_viewer::external::egui::{self, DragValue, RichText};
use std::ops::RangeInclusive;

/// Hidden or broken objects that are listed.
const LISTED: usize = 24;

/// Draws the column.
pub(super) fn show(ui: &mut egui::Ui, author: &mut Author) {
    ui.add_space(6.0);
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        match author.only_selected() {
            Some(at) => object(ui, author, at),
            None => several(ui, author),
        }
        section(ui, "Hidden from all views");
        hidden(ui, author);
        section(ui, "Problems");
        problems(ui, author);
        section(ui, "Generate");
        generate(ui, author);
        section(ui, "Scene");
        scene(ui, author);
        ui.add_space(8.0);
    });
}

fn section(ui: &mut egui::Ui, title: &str) {
    ui.add_space(8.0);
    ui.separator();
    ui.strong(title);
    ui.add_space(2.0);
}

fn several(ui: &mut egui::Ui, author: &Author) {
    match author.selection().len() {
        0 => {
            ui.strong("Nothing chosen");
            ui.weak("Click an object to change it; drag it to move it, its handle to turn it.");
        }
        count => {
            ui.strong(format!("{count} objects chosen"));
            ui.weak("They move, turn, duplicate and go together.");
        }
    }
}

/// How a number of an object is shown and dragged.
struct Unit {
    /// What it is, with its range.
    hint: &'static str,
    speed: f64,
    decimals: usize,
    prefix: &'static str,
    suffix: &'static str,
    range: RangeInclusive<f32>,
}

const MILLIMETRES: Unit = Unit {
    hint: "Millimetres; drag, or click to type",
    speed: 1.0,
    decimals: 1,
    prefix: "",
    suffix: " mm",
    range: -5000.0..=5000.0,
};
const DEGREES: Unit = Unit {
    hint: "Degrees, −180 to 180, counter-clockwise seen from above",
    speed: 1.0,
    decimals: 1,
    prefix: "",
    suffix: "°",
    range: -360.0..=360.0,
};
/// Factors that leave an object an object.
const FACTOR: Unit = Unit {
    hint: "Factor, 0.05 to 20; 1 is the catalogue's size",
    speed: 0.005,
    decimals: 2,
    prefix: "×",
    suffix: "",
    range: 0.05..=20.0,
};

/// A number of the chosen object. Its step ends when the pointer or the keyboard lets go.
fn field(
    ui: &mut egui::Ui,
    author: &mut Author,
    label: &'static str,
    value: f32,
    unit: Unit,
    set: impl Fn(&mut Object, f32),
) {
    let mut changed = value;
    let drag = DragValue::new(&mut changed)
        .speed(unit.speed)
        .fixed_decimals(unit.decimals)
        .prefix(unit.prefix)
        .suffix(unit.suffix)
        .range(unit.range);
    let response = named(ui.add(drag), label).on_hover_text(unit.hint);
    if changed != value {
        author.change_selected(Edit::Field(label), |object| set(object, changed));
    }
    if response.drag_stopped() || response.lost_focus() {
        author.settle();
    }
}

fn object(ui: &mut egui::Ui, author: &mut Author, at: usize) {
    let Some(object) = author.scene().objects.get(at).cloned() else { return };
    let catalog = author.catalog().clone();
    ui.horizontal(|ui| {
        if let Some(class) = catalog.by_name(&object.class) {
            let (rect, _) = ui.allocate_exact_size(egui::Vec2::splat(14.0), egui::Sense::hover());
            ui.painter().rect_filled(rect, if class.shape.is_round() { 7.0 } else { 3.0 }, colour(class.color));
        }
        ui.strong(name(author.scene(), at));
    });
    ui.add_space(2.0);
    egui::Grid::new("author object").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
        ui.label("Class");
        let titled = |name: &str| name.replace('_', " ");
        let combo = egui::ComboBox::from_id_salt("author class").selected_text(titled(&object.class)).width(140.0);
        let mut wanted = object.class.clone();
        let combo = combo.show_ui(ui, |ui| {
            for class in &catalog.classes {
                ui.selectable_value(&mut wanted, class.name.clone(), colors::class_title(&catalog, class.id));
            }
        });
        named(combo.response, "Class").on_hover_text("Makes the object another class; a mesh of its own goes");
        if wanted != object.class {
            author.change_class(&wanted);
        }
        ui.end_row();

        for (axis, label) in ["x", "y"].into_iter().enumerate() {
            ui.label(label).on_hover_text(match axis {
                0 => "Middle of the footprint, to the right of the shelf's middle",
                _ => "Middle of the footprint, into the shelf from its front edge",
            });
            field(ui, author, label, 1000.0 * object.position[axis], MILLIMETRES, move |object, value| {
                object.position[axis] = rounded(value / 1000.0);
            });
            ui.end_row();
        }
        ui.label("Yaw").on_hover_text("Counter-clockwise seen from above");
        field(ui, author, "Yaw", object.yaw_deg, DEGREES, |object, value| object.yaw_deg = normal_angle(value));
        ui.end_row();

        ui.label("Scale").on_hover_text("Stretch along the object's own x, y and z");
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            for (axis, label) in ["Scale x", "Scale y", "Scale z"].into_iter().enumerate() {
                field(ui, author, label, object.scale[axis], FACTOR, move |object, value| {
                    // Hundredths: a file keeps them short.
                    object.scale[axis] = (f64::from(value) * 100.0).round() as f32 / 100.0;
                });
            }
        });
        ui.end_row();

        ui.label("Size");
        let size = catalog.by_name(&object.class).filter(|_| object.mesh.is_none()).map(|class| {
            let size = class.solid.bounds().size() * 1000.0;
            let [x, y, z] = object.scale;
            format!("{:.0} × {:.0} × {:.0} mm", size.x * x, size.y * y, size.z * z)
        });
        ui.weak(size.unwrap_or_else(|| "of its mesh".to_owned())).on_hover_text("Width, depth and height, unturned");
        ui.end_row();
        if let Some(mesh) = &object.mesh {
            ui.label("Mesh");
            ui.weak(mesh.as_str());
            ui.end_row();
        }
    });
}

fn hidden(ui: &mut egui::Ui, author: &mut Author) {
    let total = author.scene().objects.len();
    let hidden = author.hidden().clone();
    if total == 0 {
        ui.weak("No objects yet");
        return;
    }
    let Some(objects) = &hidden.objects else {
        ui.horizontal(|ui| {
            ui.weak("Counting");
            ui.spinner();
        });
        return;
    };
    ui.horizontal(|ui| {
        let text = RichText::new(format!("{} hidden of {total}", objects.len())).size(16.0);
        ui.label(if hidden.is_stale { text.weak() } else { text.strong() }).on_hover_text(
            "Objects of which none of the 300 views shows 25 pixels or more. High-occlusion scenes hide more than three.",
        );
        if hidden.is_stale {
            ui.spinner();
            ui.weak("updating");
        }
    });
    let (rect, _) = ui.allocate_exact_size(egui::vec2(ui.available_width(), 6.0), egui::Sense::hover());
    let painter = ui.painter();
    painter.rect_filled(rect, 3.0, ui.visuals().extreme_bg_color);
    painter.rect_stroke(rect, 3.0, ui.visuals().window_stroke(), egui::StrokeKind::Outside);
    if total > 0 && !objects.is_empty() {
        let mut filled = rect;
        filled.set_width(rect.width() * objects.len() as f32 / total as f32);
        painter.rect_filled(filled, 3.0, ui.visuals().selection.bg_fill);
    }
    ui.add_space(2.0);
    let listed: Vec<usize> = objects.iter().copied().take(LISTED).collect();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = egui::vec2(6.0, 2.0);
        for at in listed {
            chooser(ui, author, at, name(author.scene(), at));
        }
        if objects.len() > LISTED {
            ui.weak(format!("and {} more", objects.len() - LISTED));
        }
    });
}

/// A word that chooses an object.
fn chooser(ui: &mut egui::Ui, author: &mut Author, at: usize, text: String) {
    let link = ui.link(RichText::new(text).small()).on_hover_text("Choose it");
    if link.clicked() {
        author.choose(at, Choose::Only);
    }
}

fn problems(ui: &mut egui::Ui, author: &mut Author) {
    let plan = author.plan();
    let red = ui.visuals().error_fg_color;
    if let Some(error) = &plan.error {
        ui.colored_label(red, error);
        return;
    }
    let lines: Vec<(usize, String)> = plan
        .problems
        .iter()
        .flat_map(|(at, words)| words.iter().map(|words| (*at, format!("{} {words}", name(author.scene(), *at)))))
        .collect();
    if lines.is_empty() {
        ui.weak("None: nothing overlaps, nothing stands outside");
        return;
    }
    for (at, line) in lines.iter().take(LISTED) {
        let link = ui.add(egui::Link::new(RichText::new(format!("⚠ {line}")).color(red)));
        if named(link, line).on_hover_text("Choose it").clicked() {
            author.choose(*at, Choose::Only);
        }
    }
    if lines.len() > LISTED {
        ui.weak(format!("and {} more", lines.len() - LISTED));
    }
}

fn generate(ui: &mut egui::Ui, author: &mut Author) {
    egui::Grid::new("author generate").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
        ui.label("Fill").on_hover_text("Share of the floor that objects shall cover, those that are there included");
        let mut percent = 100.0 * author.fill.fill;
        let slider = egui::Slider::new(&mut percent, 5.0..=60.0).fixed_decimals(0).suffix(" %").text("of the floor");
        let fill = named(ui.add(slider), "Fill").on_hover_text("Share of the floor, 5 to 60 %");
        if fill.changed() {
            author.fill.fill = percent / 100.0;
        }
        ui.end_row();
        ui.label("Regularity").on_hover_text("0 places freely, 1 lines objects up behind each other");
        named(
            ui.add(egui::Slider::new(&mut author.fill.rho, 0.0..=1.0).fixed_decimals(1).text("lined up")),
            "Regularity",
        )
        .on_hover_text("0 to 1: ρ of the generator, --rho on the command line");
        ui.end_row();
        ui.label("Seed").on_hover_text("Of every random choice; one more after each use");
        named(ui.add(DragValue::new(&mut author.fill.seed).speed(0.1)), "Seed")
            .on_hover_text("Any whole number from 0");
        ui.end_row();
    });
    ui.horizontal(|ui| {
        if author.is_generating() {
            ui.spinner();
            if ui.button("Cancel").on_hover_text("Leave the scene as it is").clicked() {
                author.cancel_generating();
            }
        } else if ui
            .button("Generate")
            .on_hover_text("Fill the shelf around what stands there; undo takes it back")
            .clicked()
        {
            author.generate();
        }
    });
}

fn scene(ui: &mut egui::Ui, author: &mut Author) {
    egui::Grid::new("author scene").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
        ui.label("Name");
        let mut text = author.scene().name.clone();
        let response = named(ui.add(egui::TextEdit::singleline(&mut text).desired_width(f32::INFINITY)), "Scene name");
        if response.changed() {
            author.edit(Edit::Field("name"), |scene| scene.name = text);
        }
        if response.lost_focus() {
            author.settle();
        }
        ui.end_row();
        ui.label("About").on_hover_text("One line on what makes the scene what it is");
        let mut text = author.scene().description.clone();
        let edit = egui::TextEdit::multiline(&mut text).desired_rows(2).desired_width(f32::INFINITY);
        let response = named(ui.add(edit), "Description");
        if response.changed() {
            // One line: scene files have no line breaks in it.
            author.edit(Edit::Field("description"), |scene| scene.description = text.replace(['\n', '\r'], " "));
        }
        if response.lost_focus() {
            author.settle();
        }
        ui.end_row();
        ui.label("Shelf").on_hover_text("Width, depth and height of the interior, metres");
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            for (axis, label) in ["Shelf width", "Shelf depth", "Shelf height"].into_iter().enumerate() {
                let mut size = author.scene().shelf.size[axis];
                let drag = DragValue::new(&mut size).speed(0.005).fixed_decimals(2).range(0.1..=2.0).suffix(" m");
                let response = named(ui.add(drag), label).on_hover_text("Metres, 0.1 to 2");
                if size != author.scene().shelf.size[axis] {
                    author.edit(Edit::Field(label), |scene| scene.shelf.size[axis] = rounded(size));
                }
                if response.drag_stopped() || response.lost_focus() {
                    author.settle();
                }
            }
        });
        ui.end_row();
    });
}
