//! Why a voxel or a floor cell is believed to be what it is: its numbers, their history, and what changed them.

mod largest;

use super::causes;
use super::facts::{self, fact};
use super::maps::picked_cell;
use super::spark::{self, Spark};
use super::{NO_EPISODE, Panel, empty, heading, legend, words};
use crate::colors::{self, Colormap};
use crate::picture;
use crate::workbench::command::Command;
use crate::workbench::model::{Model, Picked};
use crate::workbench::session::{Moment, Session};
use nudge_core::belief::{bernoulli_entropy, beta_mean, beta_variance, dirichlet_entropy, dirichlet_vacuity};
use nudge_core::episode::NO_TRUTH;
use nudge_core::grid::Grid;
use nudge_core::scene::ClassId;
use nudge_core::score::SCORED_HEIGHT_M;
use re_viewer::external::egui::{
    self, Align, Align2, Button, Label, Layout, Pos2, Rect, RichText, Sense, Stroke, StrokeKind, Tooltip, Ui,
    WidgetInfo, WidgetType, pos2, vec2,
};

/// What the vacuity of a Dirichlet is.
const UNKNOWN_SHARE: &str =
    "Vacuity of the Dirichlet, 15 / Σ a for its 15 classes: 1 without evidence, towards 0 with more of it";

/// What the panel remembers.
#[derive(Default)]
pub struct State {
    largest: largest::State,
}

impl Panel for State {
    /// Draws the numbers, the history and the causes of what was picked, and the largest changes of the step.
    fn show(&mut self, ui: &mut Ui, model: &mut Model, ask: &mut Vec<Command>) {
        draw(self, ui, model, ask);
    }
}

fn draw(state: &mut State, ui: &mut Ui, model: &Model, ask: &mut Vec<Command>) {
    let Some(session) = model.session() else { return empty(ui, NO_EPISODE) };
    let moment = session.moment(model.cursor);
    let grid = *moment.belief.grid();
    let Some((picked, cell)) = model.picked.and_then(|picked| Some((picked, picked_cell(Some(picked), &grid)?))) else {
        empty(ui, "Click a voxel or a floor cell to see why it is believed to be what it is");
        return largest::show(&mut state.largest, ui, model, session, ask);
    };
    let about = About { session, moment, grid, cursor: model.cursor.min(session.steps()), picked, cell };
    egui::ScrollArea::vertical().id_salt("why").auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        about.title(ui, ask);
        about.numbers(ui);
        ui.add_space(4.0);
        about.history(ui, ask);
        ui.add_space(4.0);
        about.causes(ui, ask);
        ui.add_space(4.0);
        ui.horizontal_top(|ui| {
            let left = (0.36 * ui.available_width()).clamp(90.0, 170.0);
            ui.vertical(|ui| {
                ui.set_width(left);
                about.profile(ui, ask);
            });
            ui.add_space(8.0);
            ui.vertical(|ui| {
                ui.set_width(ui.available_width());
                about.classes(ui);
            });
        });
        ui.add_space(8.0);
        largest::show(&mut state.largest, ui, model, session, ask);
    });
}

/// What a person asks about, and when.
struct About<'a> {
    session: &'a Session,
    moment: &'a Moment,
    grid: Grid,
    cursor: usize,
    picked: Picked,
    cell: usize,
}

impl About<'_> {
    fn title(&self, ui: &mut Ui, ask: &mut Vec<Command>) {
        ui.horizontal(|ui| match self.picked {
            Picked::Voxel(voxel) => {
                let place = words::voxel_place(&self.grid, self.grid.voxel(voxel));
                heading(ui, format!("Voxel at {place}"), "Centre of the voxel; z is the height above the board");
                if ui.small_button("Its floor cell").on_hover_text("Shows the whole column above the floor").clicked() {
                    ask.push(Command::Pick(Some(Picked::Cell(self.cell))));
                }
            }
            Picked::Cell(cell) => {
                let place = words::cell_place(&self.grid, self.grid.cell(cell));
                heading(ui, format!("Floor cell at {place}"), "Centre of the cell; click a bar below for one voxel");
            }
        });
    }

    /// The voxel that was picked.
    fn voxel(&self) -> Option<usize> {
        match self.picked {
            Picked::Voxel(voxel) => Some(voxel),
            Picked::Cell(_) => None,
        }
    }

    fn numbers(&self, ui: &mut Ui) {
        let number = |value: f32| words::significant(f64::from(value), 3);
        let facts = if let Some(voxel) = self.voxel() {
            let a = self.moment.belief.voxel(voxel);
            let p = beta_mean(a);
            let beta = format!("{}, {}", number(a[0]), number(a[1]));
            vec![
                fact("occupied", words::probability(p), "Mean of the Beta, a_occ / (a_occ + a_free), 0 to 1"),
                fact("Beta", beta, "Parameters a_occ and a_free, both 1 at the start"),
                fact(
                    "variance",
                    number(beta_variance(a)),
                    "Of the Beta, what is not known about p: 1/12 at the start, less with evidence",
                ),
                fact("entropy", words::nats(bernoulli_entropy(p)), "H(p), 0 to ln 2 = 0.693 nats"),
                fact("truth", self.really(voxel), "What is really there"),
            ]
        } else {
            let a = self.moment.belief.cell(self.cell);
            let all = picture::column_entropy(&self.column(self.moment), &a);
            let class = dirichlet_entropy(&a);
            let evidence = number(a.iter().sum::<f32>());
            vec![
                fact("entropy", words::nats(all), "Of the column's voxels below 0.27 m and the class together, nats"),
                fact("of the class", words::nats(class), "H of the class probabilities, 0 to ln 15 = 2.71 nats"),
                fact("unknown share", number(dirichlet_vacuity(&a)), UNKNOWN_SHARE),
                fact("evidence", evidence, "Σ a, the sum of the Dirichlet's parameters, 15 at the start"),
                fact("truth", self.true_class(), "The class of the tallest object above the cell"),
            ]
        };
        facts::show(ui, "why numbers", 2, &facts);
    }

    /// What is really in a voxel.
    fn really(&self, voxel: usize) -> &'static str {
        match self.moment.truth.as_ref().and_then(|truth| truth.occupancy.get(voxel)) {
            Some(1) => "occupied",
            Some(_) => "free",
            None => NO_TRUTH,
        }
    }

    /// The voxels of the column in the scored volume.
    fn column(&self, moment: &Moment) -> Vec<[f32; 2]> {
        let levels = self.grid.levels_below(SCORED_HEIGHT_M);
        let first = self.grid.column(self.cell).start;
        (first..first + levels).map(|voxel| moment.belief.voxel(voxel)).collect()
    }

    fn true_class(&self) -> String {
        let label = self.moment.truth.as_ref().and_then(|truth| truth.labels.get(self.cell));
        label.map_or(NO_TRUTH.to_owned(), |label| colors::class_title(&self.session.setup.catalog, ClassId(*label)))
    }

    fn history(&self, ui: &mut Ui, ask: &mut Vec<Command>) {
        heading(ui, "Over the steps", "Click a step to go there");
        let of = |value: &dyn Fn(&Moment) -> f32| -> Vec<f32> {
            self.session.moments.iter().map(|moment| value(moment)).collect()
        };
        let blue = legend::line_ink(ui, [86, 156, 214]);
        let green = legend::line_ink(ui, [98, 196, 140]);
        let pink = legend::line_ink(ui, [220, 110, 170]);
        let mut line = |name: &str, values: &[f32], range: [f32; 2], colour, write: &dyn Fn(f32) -> String| {
            let spark = Spark { name, values, range, cursor: self.cursor, colour, write };
            if let Some(step) = spark.show(ui, 34.0) {
                ask.push(Command::GoTo(step));
            }
        };
        if let Some(voxel) = self.voxel() {
            let p = of(&|moment| beta_mean(moment.belief.voxel(voxel)));
            line("occupied", &p, [0.0, 1.0], blue, &words::probability);
            let entropy = of(&|moment| bernoulli_entropy(beta_mean(moment.belief.voxel(voxel))));
            line("entropy", &entropy, [0.0, std::f32::consts::LN_2], pink, &words::nats);
        } else {
            let certainty = of(&|moment| causes::certainty(moment, self.cell));
            line("certainty", &certainty, [0.0, 1.0], green, &words::probability);
            let entropy = of(&|moment| picture::column_entropy(&self.column(moment), &moment.belief.cell(self.cell)));
            line("entropy", &entropy, picture::entropy_range(&self.grid), pink, &words::nats);
        }
    }

    fn causes(&self, ui: &mut Ui, ask: &mut Vec<Command>) {
        heading(
            ui,
            "What changed it",
            "Looks and pushes that saw it, swept it or changed it by more than 0.02; click one to go to its step",
        );
        let changes = causes::of(self.session, self.picked);
        if changes.is_empty() {
            ui.weak(if self.session.steps() == 0 {
                "Nothing yet: no action was taken"
            } else {
                "No look or push has changed it"
            });
        }
        for change in changes {
            let text = format!("step {}, {}: {}", change.step, change.action, change.causes.join(", "));
            ui.horizontal(|ui| {
                let [from, to] = change.from_to.map(words::probability);
                let numbers = format!("{from} → {to}");
                let ink = ui.visuals().weak_text_color();
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    ui.add(Label::new(words::figure(numbers).color(ink)).selectable(false));
                    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                        let row = Button::selectable(change.step == self.cursor, RichText::new(&text).small()).wrap();
                        if ui.add(row).on_hover_text("Goes to this step").clicked() {
                            ask.push(Command::GoTo(change.step));
                        }
                    });
                });
            });
        }
    }

    /// The probabilities up the column, the truth beside them.
    fn profile(&self, ui: &mut Ui, ask: &mut Vec<Command>) {
        heading(ui, "Column", "Probability of occupancy at every height; click a level for its voxel");
        let levels = self.grid.dims[2];
        let first = self.grid.column(self.cell).start;
        let height = 15.0 * (ui.text_style_height(&egui::TextStyle::Small) + 6.0);
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click());
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Image, true, "Probability of occupancy up the column"));
        let plot = Rect::from_min_max(rect.min + vec2(30.0, 0.0), rect.max - vec2(14.0, 14.0));
        let each = plot.height() / levels.max(1) as f32;
        let level_at = |at: Pos2| (((plot.bottom() - at.y) / each.max(1e-3)) as usize).min(levels.saturating_sub(1));
        let over = response.hover_pos().filter(|at| plot.expand(4.0).contains(*at)).map(level_at);
        if ui.is_rect_visible(rect) {
            let painter = ui.painter_at(rect);
            painter.rect_filled(plot, 0.0, ui.visuals().extreme_bg_color);
            for level in 0..levels {
                let p = beta_mean(self.moment.belief.voxel(first + level));
                let bottom = plot.bottom() - level as f32 * each;
                let share = if p.is_finite() { p.clamp(0.0, 1.0) } else { 0.0 };
                let bar = Rect::from_min_max(
                    pos2(plot.left(), bottom - each),
                    pos2(plot.left() + share * plot.width(), bottom),
                );
                painter.rect_filled(bar, 0.0, legend::ink(Colormap::Viridis.rgb(p)));
                if self.moment.truth.as_ref().is_some_and(|truth| truth.occupancy.get(first + level) == Some(&1)) {
                    let mark =
                        Rect::from_min_max(pos2(plot.right() + 3.0, bottom - each), pos2(plot.right() + 8.0, bottom));
                    painter.rect_filled(mark, 0.0, ui.visuals().strong_text_color());
                }
                let asked = self.voxel() == Some(first + level);
                if asked || over == Some(level) {
                    let row = Rect::from_min_max(pos2(plot.left(), bottom - each), pos2(plot.right(), bottom));
                    let ink = ui.visuals().strong_text_color().gamma_multiply(if asked { 1.0 } else { 0.6 });
                    painter.rect_stroke(row.expand(1.0), 0.0, Stroke::new(1.5, ink), StrokeKind::Outside);
                }
            }
            let (font, ink) = (legend::small(ui), ui.visuals().text_color());
            let top_m = self.grid.size_m()[2];
            for tenth in 0..=(10.0 * top_m) as usize {
                let y = plot.bottom() - tenth as f32 / (10.0 * top_m) * plot.height();
                let at = if tenth == 0 { Align2::RIGHT_BOTTOM } else { Align2::RIGHT_CENTER };
                painter.text(pos2(plot.left() - 4.0, y), at, format!("{:.1}", tenth as f32 / 10.0), font.clone(), ink);
            }
            let (y, weak) = (rect.bottom(), ui.visuals().weak_text_color());
            painter.text(pos2(rect.left(), y), Align2::LEFT_BOTTOM, "m", font.clone(), weak);
            painter.text(pos2(plot.left(), y), Align2::LEFT_BOTTOM, "0", font.clone(), ink);
            painter.text(pos2(plot.right(), y), Align2::RIGHT_BOTTOM, "1", font, ink);
        }
        if let Some([_, up]) = super::arrow_keys(ui, &response) {
            let now = self.voxel().map_or(0, |voxel| voxel - first) as i32;
            let level = (now + up).clamp(0, levels as i32 - 1) as usize;
            ask.push(Command::Pick(Some(Picked::Voxel(first + level))));
        }
        if let Some(level) = over {
            let voxel = first + level;
            let truth = self.really(voxel);
            let p = words::probability(beta_mean(self.moment.belief.voxel(voxel)));
            let z = self.grid.center(self.grid.voxel(voxel)).z;
            let really = if self.moment.truth.is_some() { format!(", really {truth}") } else { String::new() };
            let text = format!("z {z:.3} m: occupied {p}{really}");
            Tooltip::for_widget(&response).at_pointer().gap(12.0).show(|ui| ui.label(text));
            if response.clicked() {
                ask.push(Command::Pick(Some(Picked::Voxel(voxel))));
            }
        }
        let hint = "Voxels whose centre is inside an object";
        if self.moment.truth.is_some() {
            ui.label(RichText::new("black or white mark: really occupied").small().weak()).on_hover_text(hint);
        }
    }

    fn classes(&self, ui: &mut Ui) {
        heading(ui, "Class of the floor cell", "Class probabilities a_k / Σ a of the cell's Dirichlet, 0 to 1");
        let (a, catalog) = (self.moment.belief.cell(self.cell), &self.session.setup.catalog);
        let sum: f32 = a.iter().sum();
        let labels = self.moment.truth.as_ref().map(|truth| &truth.labels);
        let truth = labels.and_then(|labels| labels.get(self.cell)).map(|label| ClassId(*label));
        for (k, a) in a.iter().enumerate() {
            let class = ClassId(k as u8);
            let name = colors::class_title(catalog, class);
            let p = a / sum;
            let bar = spark::Bar {
                name: if truth == Some(class) { format!("{name} (true)") } else { name },
                share: p,
                value: words::probability(p),
                colour: legend::ink(colors::of_class(catalog, class)),
                strong: truth == Some(class),
            };
            spark::bar(ui, &bar, 112.0, 30.0)
                .on_hover_text(format!("Dirichlet parameter {}", words::significant(f64::from(*a), 3)));
        }
        let unknown = words::probability(dirichlet_vacuity(&self.moment.belief.cell(self.cell)));
        let truth = if labels.is_some() { format!("; truth: {}", self.true_class()) } else { String::new() };
        ui.label(RichText::new(format!("unknown share {unknown}{truth}")).small()).on_hover_text(UNKNOWN_SHARE);
    }
}
