//! The largest changes of the step at the cursor, to be clicked.

use super::super::table::{self, Cell, Column, Row, Sort};
use super::super::{heading, words};
use crate::colors;
use crate::workbench::changes::{CHANGED, Change, LISTED};
use crate::workbench::command::Command;
use crate::workbench::model::{Model, Picked};
use crate::workbench::session::Session;
use nudge_core::grid::Grid;
use re_viewer::external::egui::Ui;

/// Which changes are listed, and in which order.
#[derive(Debug)]
pub struct State {
    cells: bool,
    sorts: [Sort; 2],
}

impl Default for State {
    fn default() -> Self {
        Self { cells: false, sorts: [Sort::as_given(); 2] }
    }
}

/// Draws the list.
pub fn show(state: &mut State, ui: &mut Ui, model: &Model, session: &Session, ask: &mut Vec<Command>) {
    let step = model.cursor.min(session.steps());
    let hint =
        format!("What the step changed by more than {CHANGED}, the {LISTED} largest first; click one to ask about it");
    heading(ui, format!("Largest changes of step {step}"), &hint);
    if step == 0 {
        ui.weak("No action led here: go to a later step");
        return;
    }
    ui.horizontal(|ui| {
        ui.selectable_value(&mut state.cells, false, "voxels").on_hover_text("By the probability of being occupied");
        ui.selectable_value(&mut state.cells, true, "floor cells").on_hover_text("By the probability of a class");
    });
    let moment = session.moment(step);
    let Some((_, largest)) = model.largest.as_ref().filter(|(of, _)| *of == (session.id, step, moment.is_whole)) else {
        ui.weak("Looking for them");
        return;
    };
    let changes = if state.cells { &largest.cells } else { &largest.voxels };
    if changes.is_empty() {
        ui.weak(format!("Nothing changed by more than {CHANGED}"));
        return;
    }
    let grid = *moment.belief.grid();
    let rows = changes.iter().enumerate().map(|(at, change)| row(at, change, &grid, session, model.picked)).collect();
    let (id, sort) = if state.cells { ("largest cells", 1) } else { ("largest voxels", 0) };
    let touched = table::show(ui, id, &columns(state.cells), rows, &mut state.sorts[sort], 180.0);
    if let Some(change) = touched.clicked.and_then(|at| changes.get(at)) {
        ask.push(Command::Pick(Some(change.of)));
    }
}

fn columns(cells: bool) -> Vec<Column> {
    let of = if cells { "Probability of the class" } else { "Probability of being occupied" };
    let mut columns = vec![
        Column { title: "Change", hint: "Of the probability, 0 to 1; how large it is decides the order", width: 48.0 },
        Column { title: "From", hint: of, width: 34.0 },
        Column { title: "To", hint: of, width: 34.0 },
    ];
    if cells {
        columns.push(Column { title: "Class", hint: "The class whose probability changed most", width: 84.0 });
    }
    columns.push(Column { title: "x, y, z m", hint: "Centre of the voxel or the floor cell", width: 104.0 });
    columns.push(Column { title: "Cause", hint: "What of the step changed it", width: 120.0 });
    columns
}

fn row(at: usize, change: &Change, grid: &Grid, session: &Session, picked: Option<Picked>) -> Row {
    let place = match change.of {
        Picked::Voxel(voxel) => words::voxel_place(grid, grid.voxel(voxel)),
        Picked::Cell(cell) => words::cell_place(grid, grid.cell(cell)),
    };
    let short: String = place.chars().filter(|c| !"xyzm".contains(*c)).collect::<String>().trim().to_owned();
    let [from, to] = change.from_to;
    let figure = |p: f32| Cell::Figure(f64::from(p), words::probability(p));
    let mut cells = vec![
        Cell::Figure(f64::from(change.change().abs()), words::signed(f64::from(change.change()))),
        figure(from),
        figure(to),
    ];
    let class = change.class.map(|class| colors::class_title(&session.setup.catalog, class));
    cells.extend(class.clone().map(Cell::Word));
    cells.extend([Cell::Word(short), Cell::Word(change.cause.clone())]);
    let subject = class.map_or_else(|| "voxel".to_owned(), |class| format!("floor cell, {class}"));
    let [from, to] = change.from_to.map(words::probability);
    Row {
        key: at,
        cells,
        chosen: false,
        selected: picked == Some(change.of),
        grey: false,
        name: format!("Change of {subject} at {place}: {from} → {to}"),
        hint: format!("{place}: {from} → {to}, {}", change.cause),
    }
}
