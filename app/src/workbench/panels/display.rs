//! How the belief is drawn in three dimensions: what colour says, which voxels, and the legend.

use super::{legend, words};
use crate::colors::{self, Colormap, Rgb};
use crate::workbench::command::Command;
use crate::workbench::model::{ColourBy, EVERYWHERE_M, LayoutKind, Model};
use re_viewer::external::egui;

/// Draws the choices below the three-dimensional views. `drawn` is the number of voxels that are shown.
pub fn show(ui: &mut egui::Ui, model: &mut Model, drawn: usize, _ask: &mut Vec<Command>) {
    let size = model.session().map_or([0.80, 0.40, 0.40], |session| session.record.scene.shelf.size);
    let layout = model.kept.layout;
    let has_truth = model.session().is_none_or(|session| session.record.has_truth());
    let most = model
        .gain_source
        .as_ref()
        .map_or("largest".to_owned(), |source| format!("{} and more", words::significant(f64::from(source.top), 2)));
    let display = &mut model.kept.display;
    if layout.shows_gain() {
        ui.horizontal(|ui| {
            ui.label("gain per voxel");
            scale(ui, Colormap::Cividis, "gain", ["0", &most], "nats");
        });
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        ui.spacing_mut().interact_size.x = 30.0;
        ui.label("colour by");
        let combo = egui::ComboBox::from_id_salt("colour by").width(96.0).selected_text(display.colour_by.title());
        let shown = combo.show_ui(ui, |ui| {
            for kind in ColourBy::ALL {
                ui.selectable_value(&mut display.colour_by, kind, kind.title());
            }
        });
        shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::ComboBox, true, "Colour by"));
        shown.response.on_hover_text("What the colour of a voxel says");
        let banded = !matches!(display.colour_by, ColourBy::Error | ColourBy::Change);
        if banded {
            ui.label("probability");
            range(ui, &mut display.band, 0.0..=1.0, 0.01, "", "probability");
        }
        let count = egui::RichText::new(format!("{drawn} voxels")).weak();
        ui.add(egui::Label::new(count).extend())
            .on_hover_text("Voxels that are drawn: the surface of those in the chosen range of probability");
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        ui.spacing_mut().interact_size.x = 30.0;
        let [width, depth, height] = size;
        let axes = [
            ("x", [-0.5 * width, 0.5 * width], "x, from left to right"),
            ("y", [0.0, depth], "y, into the shelf"),
            ("z", [0.0, height], "z, height above the board"),
        ];
        for ((name, [low, high], what), slice) in axes.into_iter().zip(&mut display.slice_m) {
            let mut shown = slice.map(|m| m.clamp(low, high));
            ui.label(name).on_hover_text(what);
            range(ui, &mut shown, low..=high, 0.005, "", what);
            if shown != slice.map(|m| m.clamp(low, high)) {
                *slice = shown;
            }
        }
        ui.weak("m");
        let whole = display.slice_m == EVERYWHERE_M;
        let button = egui::Button::new("Whole shelf").small();
        if ui.add_enabled(!whole, button).on_hover_text("Show the whole belief again, no slice of it").clicked() {
            display.slice_m = EVERYWHERE_M;
        }
    });
    ui.horizontal_wrapped(|ui| {
        // A recording has no truth to show; that it has none, the episode says once.
        if has_truth {
            ui.checkbox(&mut display.truth, "truth").on_hover_text("The outlines of the true objects");
        }
        ui.checkbox(&mut display.views, "views").on_hover_text("The candidate views as frusta, coloured by gain");
        ui.checkbox(&mut display.pushes, "pushes").on_hover_text("The push candidates as arrows, coloured by value");
        if layout != LayoutKind::Compare {
            let hint = "The arm where the step left it, and the path of its tip";
            ui.checkbox(&mut display.robot, "arm").on_hover_text(hint);
        }
        ui.separator();
        key(ui, display.colour_by);
        // The views beside it that show a difference have a scale of their own.
        if matches!(layout, LayoutKind::Compare | LayoutKind::Push) {
            let (name, unit) = if layout == LayoutKind::Push {
                ("predicted minus now", "difference of probability")
            } else {
                ("A minus B", "probability, A − B")
            };
            scale(ui, Colormap::Diverging, name, ["−1", "+1"], unit);
        }
    });
}

/// Width of a colour scale, points.
const WIDTH: f32 = 210.0;

/// A colour scale of a fixed width.
fn scale(ui: &mut egui::Ui, map: Colormap, name: &str, ends: [&str; 2], unit: &str) {
    ui.scope(|ui| {
        ui.set_max_width(WIDTH);
        ui.allocate_ui(egui::vec2(WIDTH, 20.0), |ui| {
            let texts = legend::Bar { name, ends: ends.map(str::to_owned), unit, hint: "" };
            legend::bar(ui, &texts, move |t| map.rgb(t));
        });
    });
}

/// The legend of a colouring.
fn key(ui: &mut egui::Ui, by: ColourBy) {
    match by {
        ColourBy::Probability => scale(ui, Colormap::Viridis, "probability", ["0", "1"], "probability"),
        ColourBy::Entropy => scale(ui, Colormap::Magma, "entropy", ["0", "0.69"], "nats"),
        ColourBy::Change => scale(ui, Colormap::Diverging, "change", ["−1", "+1"], "change of probability"),
        ColourBy::Class => {
            ui.weak("class colours as in the maps");
        }
        ColourBy::Error => {
            let entries: [(Rgb, &str); 3] = [
                ([226, 228, 232], "correct"),
                (colors::MISSED_RGB, "missed"),
                (colors::HALLUCINATED_RGB, "hallucinated"),
            ];
            for (rgb, name) in entries {
                legend::swatch(ui, rgb, name);
            }
        }
    }
}

/// Two numbers that stay in order.
fn range(
    ui: &mut egui::Ui,
    [low, high]: &mut [f32; 2],
    within: std::ops::RangeInclusive<f32>,
    speed: f32,
    suffix: &str,
    what: &str,
) {
    for (value, end) in [(low, "Least"), (high, "Most")] {
        let drag = egui::DragValue::new(value).range(within.clone()).speed(speed).fixed_decimals(2).suffix(suffix);
        let name = format!("{end} {what}");
        let response = ui.add(drag);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::DragValue, true, &name));
        response.on_hover_text(format!("{name} of the voxels that are drawn; drag, or click to type"));
    }
}
