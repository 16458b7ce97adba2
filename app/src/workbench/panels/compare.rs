//! Two episodes on one clock: their scores, their maps and where their ways part.

use super::floor::{FloorMap, Line, Outlines};
use super::legend::{self, Bar};
use super::textures::{self, Textures};
use super::{NO_EPISODE, Panel, empty, heading, maps, words};
use crate::colors::{self, Colormap};
use crate::picture::{self, FloorPlan};
use crate::record::decision::SERIES;
use crate::workbench::command::{Command, MenuCommand};
use crate::workbench::derive::{Derived, MapKind};
use crate::workbench::model::{Model, Picked};
use crate::workbench::session::{Session, SessionId};
use nudge_core::plan::Action;
use re_viewer::external::egui::{self, ColorImage, ComboBox, Label, RichText, TextureHandle, Ui};
use std::sync::Arc;

/// Pixels along a cell of the difference map, so that there is room to hatch.
const FINE: usize = 4;
/// Where that would make more pixels along a side than this, there are fewer for a cell.
const LARGEST_PX: usize = 2048;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shown {
    Map(SessionId, usize, MapKind),
    Difference([(SessionId, usize); 2]),
}

/// What the panel remembers.
pub struct State {
    kind: MapKind,
    textures: Textures<Shown>,
    outlines: [Outlines; 2],
    last: [Option<Arc<Derived>>; 2],
}

impl Default for State {
    fn default() -> Self {
        Self {
            kind: MapKind::Semantics,
            textures: Textures::default(),
            outlines: Default::default(),
            last: Default::default(),
        }
    }
}

/// The first step at which two episodes do something else; counted from 1.
pub fn first_difference(a: &Session, b: &Session) -> Option<usize> {
    let mut pairs = a.record.steps.iter().zip(&b.record.steps);
    pairs.position(|(a, b)| a.action != b.action).map(|at| at + 1)
}

impl Panel for State {
    /// Draws the comparison.
    fn show(&mut self, ui: &mut Ui, model: &mut Model, ask: &mut Vec<Command>) {
        draw(self, ui, model, ask);
    }
}

fn draw(state: &mut State, ui: &mut Ui, model: &Model, ask: &mut Vec<Command>) {
    let Some(a) = model.session() else { return empty(ui, NO_EPISODE) };
    let b = model.other_session();
    header(ui, model, a, b, ask);
    let Some(b) = b else {
        let text = if model.sessions.len() < 2 {
            "Open or branch a second episode to compare with"
        } else {
            "Choose a second episode to compare with"
        };
        return empty(ui, text);
    };
    let run = MenuCommand::RunBoth;
    let button = ui.add_enabled(run.is_available(model), egui::Button::new(run.title()));
    if button
        .on_hover_text(run.tooltip())
        .on_disabled_hover_text("Both are busy or have used up their budgets")
        .clicked()
    {
        ask.push(Command::Menu(run));
    }
    egui::ScrollArea::vertical().id_salt("compare").auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        parting(ui, model, a, b, ask);
        ui.add_space(4.0);
        scores(ui, model, a, b);
        ui.add_space(6.0);
        floors(state, ui, model, a, b, ask);
    });
}

/// Which episodes they are.
fn header(ui: &mut Ui, model: &Model, a: &Session, b: Option<&Session>, ask: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new("A").strong());
        ui.add(Label::new(a.title()).truncate());
    });
    ui.horizontal(|ui| {
        let label = ui.label(RichText::new("B").strong());
        let mut chosen = b.map(|b| b.id);
        let before = chosen;
        let title = b.map_or("choose an episode".to_owned(), Session::title);
        let room = (ui.available_width() - 8.0).max(80.0);
        let combo = ComboBox::from_id_salt("compare with").selected_text(title).width(room).truncate();
        let combo = combo.show_ui(ui, |ui| {
            ui.selectable_value(&mut chosen, None, "none");
            for session in model.sessions.iter().filter(|session| session.id != a.id) {
                let title = format!("{} ({}/{})", session.title(), session.steps(), session.record.config.budget);
                ui.selectable_value(&mut chosen, Some(session.id), title);
            }
        });
        combo.response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::ComboBox, true, "Compare with"));
        combo.response.labelled_by(label.id).on_hover_text("The second episode; both follow one clock");
        if chosen != before {
            ask.push(Command::CompareWith(chosen));
        }
    });
}

/// Where the two part, in words, with a button to go there.
fn parting(ui: &mut Ui, model: &Model, a: &Session, b: &Session, ask: &mut Vec<Command>) {
    if a.record.scene != b.record.scene {
        ui.weak("A and B are episodes of different scenes");
    }
    if model.cursor > b.steps() {
        ui.weak(format!("B ends after step {}; its last state is shown", b.steps()));
    } else if model.cursor > a.steps() {
        ui.weak(format!("A ends after step {}; its last state is shown", a.steps()));
    }
    let Some(step) = first_difference(a, b) else {
        ui.label("The actions so far are the same");
        return;
    };
    let does = |session: &Session| {
        let record = session.record.steps.get(step - 1);
        record.map_or_else(String::new, |record| match record.action {
            Action::Look { view } => format!("looks from view {}", view.0),
            Action::Manipulate(manipulation) => {
                let kind = manipulation.kind();
                manipulation.describe().words.replacen(kind.name(), kind.plural(), 1)
            }
        })
    };
    ui.horizontal_wrapped(|ui| {
        ui.label(format!("First difference at step {step}: A {}, B {}", does(a), does(b)));
        let before = step - 1;
        let hint = "Goes to the state before the first step at which the actions differ";
        if ui.small_button(format!("Go to step {before}")).on_hover_text(hint).clicked() {
            ask.push(Command::GoTo(before));
        }
    });
}

fn scores(ui: &mut Ui, model: &Model, a: &Session, b: &Session) {
    let [a, b] = [a, b].map(|session| session.moment(model.cursor));
    heading(ui, format!("Scores after step {}", model.cursor), "Of the states that are shown");
    egui::Grid::new("compare scores").num_columns(4).striped(true).spacing([16.0, 3.0]).show(ui, |ui| {
        for title in ["", "A", "B", "A − B"] {
            ui.label(RichText::new(title).small().strong());
        }
        ui.end_row();
        for series in SERIES {
            let (a, b) = (a.score(series), b.score(series));
            if a.is_none() && b.is_none() {
                continue;
            }
            let between = a.zip(b).map(|(a, b)| a - b);
            ui.label(RichText::new(series.title).small()).on_hover_text(series.hint);
            for value in [a, b, between] {
                ui.label(words::figure(value.map_or_else(String::new, |value| words::significant(value, 3))));
            }
            ui.end_row();
        }
    });
}

fn floors(state: &mut State, ui: &mut Ui, model: &Model, a: &Session, b: &Session, ask: &mut Vec<Command>) {
    for (last, session) in state.last.iter_mut().zip([a, b]) {
        if let Some(derived) = model.derived_of(session.id, model.cursor.min(session.steps())) {
            *last = Some(derived.clone());
        }
        if last.as_ref().is_some_and(|last| last.of.0 != session.id) {
            *last = None;
        }
    }
    let [Some(of_a), Some(of_b)] = state.last.clone() else {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.weak("Painting the maps");
        });
        return;
    };
    ui.horizontal(|ui| {
        for kind in [MapKind::Semantics, MapKind::Certainty, MapKind::Entropy, MapKind::Error] {
            ui.selectable_value(&mut state.kind, kind, kind.title()).on_hover_text("Which map A and B show");
        }
    });
    let gap = 10.0;
    let columns = if ui.available_width() < 460.0 { 1 } else { 3 };
    let width = ((ui.available_width() - gap * (columns - 1) as f32) / columns as f32).floor().clamp(40.0, 460.0);
    let places = [Place::Of(0), Place::Of(1), Place::Difference];
    for row in places.chunks(columns) {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = gap;
            for place in row {
                ui.vertical(|ui| {
                    ui.set_width(width);
                    floor(state, ui, model, [a, b], [&of_a, &of_b], *place, ask);
                });
            }
        });
    }
    legend::swatches(ui, maps::class_entries(a));
}

#[derive(Clone, Copy)]
enum Place {
    Of(usize),
    Difference,
}

fn floor(
    state: &mut State,
    ui: &mut Ui,
    model: &Model,
    sessions: [&Session; 2],
    derived: [&Arc<Derived>; 2],
    place: Place,
    ask: &mut Vec<Command>,
) {
    let grid = derived[0].belief.grid;
    match place {
        Place::Of(which) => {
            let (session, derived, kind) = (sessions[which], derived[which], state.kind);
            let grid = derived.belief.grid;
            let letter = ["A", "B"][which];
            heading(ui, format!("{letter}: {}", kind.title().to_lowercase()), "");
            let key = Shown::Map(derived.of.0, derived.of.1, kind);
            let picture = state.textures.get(ui.ctx(), key, || {
                derived
                    .maps
                    .get(&kind)
                    .map_or_else(|| ColorImage::filled([1, 1], egui::Color32::GRAY), textures::of_rgb)
            });
            let outlines = state.outlines[which].of(&session.moment(derived.of.1).bodies);
            show_floor(ui, model, derived, Some(&picture), &outlines, letter, ask, |cell| {
                let (class, certainty) =
                    (picture::believed_class(&derived.belief, cell), derived.belief.likeliest(cell).1);
                let name =
                    class.map_or("unknown".to_owned(), |class| colors::class_title(&session.setup.catalog, class));
                format!(
                    "{}\n{name}, probability {}",
                    words::cell_place(&grid, grid.cell(cell)),
                    words::probability(certainty)
                )
            });
        }
        Place::Difference => {
            heading(
                ui,
                "A − B: certainty",
                "Difference of the likeliest class's probability, −1 to 1; hatched where the likeliest class differs",
            );
            if derived[0].belief.grid != derived[1].belief.grid {
                ui.weak("A and B have grids of different sizes: there is no difference to show");
                return;
            }
            let key = Shown::Difference(derived.map(|derived| derived.of));
            let picture = state.textures.get(ui.ctx(), key, || difference(derived));
            let outlines = state.outlines[0].of(&sessions[0].moment(derived[0].of.1).bodies);
            show_floor(ui, model, derived[0], Some(&picture), &outlines, "A − B", ask, |cell| {
                let of = derived.map(|derived| derived.belief.likeliest(cell).1);
                let differs = if class_differs(derived, cell) { "\nthe likeliest class differs" } else { "" };
                let place = words::cell_place(&grid, grid.cell(cell));
                format!("{place}\ncertainty {}{differs}", words::signed(f64::from(of[0] - of[1])))
            });
            let texts = Bar {
                name: "difference of certainty",
                ends: ["−1: B more certain".to_owned(), "+1: A".to_owned()],
                unit: "probability",
                hint: "Certainty of A minus that of B: difference of the likeliest class's probability",
            };
            legend::bar(ui, &texts, |t| Colormap::Diverging.rgb(t));
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "a map has that many parts")]
fn show_floor(
    ui: &mut Ui,
    model: &Model,
    derived: &Derived,
    picture: Option<&TextureHandle>,
    outlines: &[Line],
    name: &str,
    ask: &mut Vec<Command>,
    tell: impl FnOnce(usize) -> String,
) {
    let grid = &derived.belief.grid;
    let picked = maps::picked_cell(model.picked, grid);
    let name = format!("Floor map of {name}");
    let map = FloorMap { grid, picture, outlines, picked, apron_m: 0.0, name: &name };
    let drawn = map.show(ui, ui.available_width());
    drawn.tell(tell);
    if let Some(cell) = drawn.chosen {
        ask.push(Command::Pick(Some(Picked::Cell(cell))));
    }
}

fn class_differs(derived: [&Arc<Derived>; 2], cell: usize) -> bool {
    let [a, b] = derived.map(|derived| picture::believed_class(&derived.belief, cell));
    a != b
}

/// Certainty of A minus that of B, several pixels a cell, hatched where the likeliest classes differ.
fn difference(derived: [&Arc<Derived>; 2]) -> ColorImage {
    let grid = &derived[0].belief.grid;
    let plan = FloorPlan::of(grid);
    let [width, depth] = plan.size;
    let fine = FINE.min(LARGEST_PX / width.max(depth).max(1)).max(1);
    let cells: Vec<(colors::Rgb, bool)> = plan
        .cells()
        .map(|cell| {
            let [a, b] = derived.map(|derived| derived.belief.likeliest(cell).1);
            (Colormap::Diverging.of(a - b, [-1.0, 1.0]), class_differs(derived, cell))
        })
        .collect();
    let pixels = (0..fine * depth).flat_map(|row| (0..fine * width).map(move |column| [column, row]));
    let colour = |[column, row]: [usize; 2]| {
        let (rgb, differs) = cells[row / fine * width + column / fine];
        let stripe = differs && (column + row) % (2 * fine) < 2;
        legend::ink(if stripe { colors::mix(rgb, [0, 0, 0], 0.75) } else { rgb })
    };
    ColorImage::new([fine * width, fine * depth], pixels.map(colour).collect())
}
