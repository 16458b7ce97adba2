//! The floor maps of the state at the cursor: semantics, certainty, entropy, truth and error.

use super::floor::{Drawn, FloorMap, Outlines};
use super::legend::{self, Bar};
use super::textures::{self, Textures};
use super::{NO_EPISODE, Panel, empty, heading, words};
use crate::colors::{self, Colormap, Rgb};
use crate::picture::{self, CellError};
use crate::workbench::command::Command;
use crate::workbench::derive::{Derived, MapKind};
use crate::workbench::model::{Model, Picked};
use crate::workbench::session::{Session, SessionId};
use nudge_core::belief::{beta_mean, dirichlet_entropy};
use nudge_core::grid::Grid;
use nudge_core::scene::{BACKGROUND, Catalog, ClassId};
use nudge_core::score::SCORED_HEIGHT_M;
use nudge_core::world::TruthMap;
use re_viewer::external::egui::{self, RichText, Slider, Ui};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What a map shows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shown {
    Map(MapKind),
    /// The probability of occupancy at one level.
    Slice(usize),
}

/// What the panel remembers.
#[derive(Default)]
pub struct State {
    /// What was drawn last; it stays until the next is made.
    last: Option<Arc<Derived>>,
    textures: Textures<(SessionId, usize, Shown)>,
    outlines: Outlines,
}

impl Panel for State {
    /// Draws the maps in two columns, in one where there is little room.
    fn show(&mut self, ui: &mut Ui, model: &mut Model, ask: &mut Vec<Command>) {
        model.slice_m = draw(self, ui, model, ask);
    }
}

fn draw(state: &mut State, ui: &mut Ui, model: &Model, ask: &mut Vec<Command>) -> Option<f32> {
    let Some(session) = model.session() else {
        empty(ui, NO_EPISODE);
        return model.slice_m;
    };
    if let Some(derived) = model.derived() {
        state.last = Some(derived.clone());
    }
    let Some(derived) = state.last.clone().filter(|last| last.of.0 == session.id) else {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.weak("Painting the maps");
        });
        return model.slice_m;
    };
    let mut slice_m = model.slice_m;
    slice_m = controls(ui, &derived.belief.grid, slice_m, derived.of.1, model.cursor.min(session.steps()));
    let level = slice_m.map(|height| level_at(&derived.belief.grid, height));
    let first = level.map_or(Shown::Map(MapKind::Semantics), Shown::Slice);
    // The semantics stand first anyway.
    let kinds = MapKind::ALL[1..].iter().filter(|kind| derived.maps.contains_key(kind)).map(|kind| Shown::Map(*kind));
    let shown: Vec<Shown> = std::iter::once(first).chain(kinds).collect();
    let gap = 10.0;
    let columns = if ui.available_width() < 300.0 { 1 } else { 2 };
    let width = ((ui.available_width() - gap * (columns - 1) as f32) / columns as f32).floor().max(40.0);
    // The legend of the classes takes the place after the last map.
    let places: Vec<Option<Shown>> = shown.into_iter().map(Some).chain([None]).collect();
    for row in places.chunks(columns) {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = gap;
            for place in row {
                ui.vertical(|ui| {
                    ui.set_width(width);
                    ui.spacing_mut().item_spacing.y = 3.0;
                    match place {
                        Some(shown) => map(state, ui, model, session, &derived, *shown, ask),
                        None => {
                            classes(ui, session);
                            super::untold(ui, &session.record);
                        }
                    }
                });
            }
        });
        ui.add_space(6.0);
    }
    slice_m
}

/// The choice of a slice, and what the maps are of.
fn controls(ui: &mut Ui, grid: &Grid, slice_m: Option<f32>, drawn: usize, cursor: usize) -> Option<f32> {
    let [width, depth, height] = grid.size_m();
    let mut chosen = slice_m;
    ui.horizontal(|ui| {
        let mut on = chosen.is_some();
        let hint = "Shows the probability of occupancy at one height in place of the semantics";
        if ui.checkbox(&mut on, "Slice").on_hover_text(hint).changed() {
            chosen = on.then(|| (0.06_f32).min(height));
        }
        if let Some(at) = &mut chosen {
            *at = if at.is_finite() { at.clamp(0.0, height) } else { 0.0 };
            let slider =
                Slider::new(at, 0.0..=height).custom_formatter(|m, _| format!("{m:.3} m")).text("Slice height");
            ui.add(slider).on_hover_text(format!("Height above the board, 0 to {height:.2} m"));
        } else if drawn != cursor {
            ui.spinner();
            ui.weak(format!("Painting step {cursor}"));
        } else {
            ui.add(egui::Label::new(RichText::new("Seen from above, front edge at the bottom").weak()).truncate())
                .on_hover_text(format!("{width:.2} × {depth:.2} m in cells of {:.0} mm", grid.voxel_m * 1e3));
        }
    });
    ui.add_space(2.0);
    chosen
}

/// The level that holds a height above the board.
fn level_at(grid: &Grid, height_m: f32) -> usize {
    ((height_m / grid.voxel_m) as usize).min(grid.dims[2].saturating_sub(1))
}

fn map(
    state: &mut State,
    ui: &mut Ui,
    model: &Model,
    session: &Session,
    derived: &Arc<Derived>,
    shown: Shown,
    ask: &mut Vec<Command>,
) {
    let grid = derived.belief.grid;
    let moment = session.moment(derived.of.1);
    let (title, hint) = title(shown, &grid);
    heading(ui, title.as_str(), hint);
    let picture = state.textures.get(ui.ctx(), (derived.of.0, derived.of.1, shown), || match shown {
        Shown::Map(kind) => derived.maps.get(&kind).map_or_else(|| unknown(&grid), textures::of_rgb),
        Shown::Slice(level) => textures::of_rgb(&picture::paint(&grid, |cell| {
            Colormap::Viridis.rgb(derived.belief.probability(grid.column(cell).start + level))
        })),
    });
    let outlines = state.outlines.of(&moment.bodies);
    let drawn: Drawn = FloorMap {
        grid: &grid,
        picture: Some(&picture),
        outlines: &outlines,
        picked: picked_cell(model.picked, &grid),
        apron_m: 0.0,
        name: &format!("Map of {}", title.to_lowercase()),
    }
    .show(ui, ui.available_width());
    drawn.tell(|cell| {
        format!(
            "{}\n{}",
            words::cell_place(&grid, grid.cell(cell)),
            value(derived, moment.truth.as_deref(), session, shown, cell)
        )
    });
    if let Some(cell) = drawn.chosen {
        ask.push(Command::Pick(Some(Picked::Cell(cell))));
    }
    map_legend(ui, shown, &grid, session.record.config.planner.certain);
}

fn unknown(grid: &Grid) -> egui::ColorImage {
    egui::ColorImage::filled([grid.dims[0], grid.dims[1]], legend::ink(colors::UNKNOWN_RGB))
}

fn title(shown: Shown, grid: &Grid) -> (String, &'static str) {
    match shown {
        Shown::Slice(level) => (
            format!("Occupancy at {:.3} m", (level as f32 + 0.5) * grid.voxel_m),
            "Probability that a voxel is occupied, p = a_occ / (a_occ + a_free), 0 to 1",
        ),
        Shown::Map(kind) => (
            kind.title().to_owned(),
            match kind {
                MapKind::Semantics => "The likeliest class of every floor cell, paler where it is less certain",
                MapKind::Certainty => "Probability of the likeliest class, max p, 1/15 to 1",
                MapKind::Entropy => {
                    "Entropy of the column's voxels below 0.27 m and of its class, nats: Σ H(p); the sum over all cells \
                     is the map's entropy"
                }
                MapKind::Truth => "The class of what really stands there",
                MapKind::Error => "How the likeliest class compares with what really stands there",
            },
        ),
    }
}

/// `certain` is the probability above which a cell counts as known.
fn map_legend(ui: &mut Ui, shown: Shown, grid: &Grid, certain: f32) {
    let bar = |ui: &mut Ui, map: Colormap, name: &str, high: String, unit: &str, hint: &str| {
        legend::bar(ui, &Bar { name, ends: ["0".to_owned(), high], unit, hint }, |t| map.rgb(t));
    };
    match shown {
        Shown::Slice(_) => {
            bar(ui, Colormap::Viridis, "occupancy", "1".into(), "probability", "Probability that the voxel is occupied")
        }
        Shown::Map(MapKind::Certainty) => {
            let hint = format!("A cell above the threshold {certain} counts as certain");
            bar(ui, Colormap::Viridis, "certainty", "1".into(), "probability", &hint);
        }
        Shown::Map(MapKind::Entropy) => {
            let high = picture::entropy_range(grid)[1];
            let hint = "0 where everything is certain; the maximum, where nothing is known, is ln 2 for every voxel below 0.27 m and ln 15 for the class";
            bar(ui, Colormap::Magma, "entropy", words::significant(f64::from(high), 3), "nats", hint);
        }
        Shown::Map(MapKind::Error) => {
            legend::swatches(ui, CellError::ALL.map(|error| (error.rgb(), error.title().to_owned())));
        }
        Shown::Map(MapKind::Semantics | MapKind::Truth) => {
            let hint = "The colours are named under Classes";
            ui.label(RichText::new("colours: see Classes").small().weak()).on_hover_text(hint);
        }
    }
}

/// The classes that the scene has, with their colours.
fn classes(ui: &mut Ui, session: &Session) {
    heading(ui, "Classes", "The classes of this scene; every class has one colour everywhere");
    legend::swatches(ui, class_entries(session));
}

/// Colours and names of the classes in a scene, of background, and of what is unknown. Where nobody knows what stands there, all
/// classes are named.
pub fn class_entries(session: &Session) -> Vec<(Rgb, String)> {
    let catalog = &session.setup.catalog;
    let objects = session.record.scene.objects.iter();
    let told = objects.filter_map(|object| catalog.by_name(&object.class).map(|class| class.id));
    let all = catalog.classes.iter().map(|class| class.id).filter(|_| !session.record.has_truth());
    let present: BTreeSet<ClassId> = told.chain(all).chain([BACKGROUND]).collect();
    let named = |class: ClassId| (colors::of_class(catalog, class), colors::class_title(catalog, class));
    let unknown = (colors::UNKNOWN_RGB, "unknown".to_owned());
    present.into_iter().map(named).chain([unknown]).collect()
}

/// What a map shows of a cell, in words.
fn value(derived: &Derived, truth: Option<&TruthMap>, session: &Session, shown: Shown, cell: usize) -> String {
    let (belief, catalog) = (&derived.belief, &session.setup.catalog);
    let true_label = truth.and_then(|truth| truth.labels.get(cell));
    let true_class = || true_label.map_or_else(String::new, |label| class_name(catalog, ClassId(*label)));
    match shown {
        Shown::Slice(level) => {
            let a = belief.occupancy[belief.grid.column(cell).start + level];
            format!("occupied with probability {}", words::probability(beta_mean(a)))
        }
        Shown::Map(MapKind::Semantics | MapKind::Certainty) => {
            let certainty = belief.likeliest(cell).1;
            match picture::believed_class(belief, cell) {
                Some(class) => {
                    format!("{}, probability {}", class_name(catalog, class), words::probability(certainty))
                }
                None => format!("unknown, no class above {}", words::probability(certainty)),
            }
        }
        Shown::Map(MapKind::Entropy) => {
            let levels = belief.grid.levels_below(SCORED_HEIGHT_M);
            let column = &belief.occupancy[belief.grid.column(cell)][..levels];
            let (class, all) =
                (dirichlet_entropy(&belief.semantics[cell]), picture::column_entropy(column, &belief.semantics[cell]));
            format!("{}, of which the class {}", words::nats(all), words::nats(class))
        }
        Shown::Map(MapKind::Truth) => true_class(),
        Shown::Map(MapKind::Error) => {
            let Some(truth) = truth.filter(|truth| cell < truth.labels.len()) else { return String::new() };
            let believed =
                picture::believed_class(belief, cell).map_or("unknown".to_owned(), |class| class_name(catalog, class));
            let error = picture::cell_error(belief, truth, cell).title();
            format!("{error}: believed {believed}, really {}", true_class())
        }
    }
}

fn class_name(catalog: &Catalog, class: ClassId) -> String {
    colors::class_title(catalog, class)
}

/// The floor cell of what was picked, if the grid has it.
pub fn picked_cell(picked: Option<Picked>, grid: &Grid) -> Option<usize> {
    let cell = match picked? {
        Picked::Cell(cell) => cell,
        Picked::Voxel(voxel) => voxel / grid.dims[2],
    };
    (cell < grid.cell_count()).then_some(cell)
}
