//! What every action promised, and what it then brought: a table whose rows lead to their steps, and marks what lowered the map.

use super::table::{self, Cell, Column, Row, Sort};
use super::words;
use crate::workbench::command::Command;
use crate::workbench::model::Model;
use nudge_core::episode::Delivered;
use re_viewer::external::egui::{CollapsingHeader, RichText, Ui};

/// Height of the table, points.
const HEIGHT: f32 = 190.0;

const COLUMNS: [Column; 6] = [
    Column { title: "Step", hint: "The step; click to go there", width: 34.0 },
    Column { title: "Action", hint: "A look, or something moved with the looks after it", width: 60.0 },
    Column { title: "Promised", hint: "What the planner promised of it, nats", width: 62.0 },
    Column { title: "Entropy", hint: "By how much the map's entropy fell, nats; below 0 it rose", width: 60.0 },
    Column { title: "mIoU", hint: "Change of the semantic mIoU", width: 50.0 },
    Column { title: "Found", hint: "Change of the number of objects found", width: 40.0 },
];

/// What the panel remembers.
pub struct State {
    sort: Sort,
}

impl Default for State {
    fn default() -> Self {
        Self { sort: Sort::as_given() }
    }
}

impl super::Panel for State {
    /// Draws the table, folded until somebody asks.
    fn show(&mut self, ui: &mut Ui, model: &mut Model, ask: &mut Vec<Command>) {
        let Some(session) = model.session().filter(|session| session.steps() > 0) else { return };
        let cursor = model.cursor;
        let header = CollapsingHeader::new(RichText::new("Promised and delivered").strong()).id_salt("promised");
        header.show(ui, |ui| {
            ui.label(
                RichText::new(
                    "A push or pick is credited with the looks after it, up to the next one. ▼: it lowered the map.",
                )
                .small()
                .weak(),
            );
            let rows = session.record.delivered().iter().map(|one| row(one, cursor)).collect();
            let touched = table::show(ui, "promised", &COLUMNS, rows, &mut self.sort, HEIGHT);
            if let Some(step) = touched.clicked {
                ask.push(Command::GoTo(step));
            }
        });
    }
}

fn row(one: &Delivered, cursor: usize) -> Row {
    let kind = if one.is_manipulation { "move" } else { "look" };
    let mark = if one.lowered() && one.is_manipulation { " ▼" } else { "" };
    let signed = |value: f64, digits: usize| {
        let text = format!("{value:+.digits$}").replace('-', "−");
        Cell::Figure(value, text)
    };
    let nothing = || Cell::Figure(f64::NAN, "–".to_owned());
    let last = if one.until > one.step { format!(" and the looks up to step {}", one.until) } else { String::new() };
    let promised =
        one.promised.map_or("nothing".to_owned(), |nats| format!("{} nats", words::significant(f64::from(nats), 3)));
    let fell = words::significant(one.entropy_nats, 3);
    Row {
        key: one.step,
        cells: vec![
            Cell::number(one.step),
            Cell::Word(format!("{kind}{mark}")),
            Cell::nats(one.promised),
            signed(one.entropy_nats, 0),
            one.judged.map_or_else(nothing, |gained| signed(gained.semantic_miou, 3)),
            one.judged.map_or_else(nothing, |gained| signed(gained.found as f64, 0)),
        ],
        chosen: one.is_manipulation,
        selected: one.step == cursor,
        grey: false,
        name: format!("Step {}: {kind} promised {promised}", one.step),
        hint: format!("Step {}{last}: promised {promised}; the map's entropy fell by {fell} nats", one.step),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::fixture;
    use crate::workbench::panels::Panel;
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    #[test]
    fn a_row_leads_to_its_step() {
        struct Stage(Model, Vec<Command>, State);
        let draw = |ui: &mut Ui, stage: &mut Stage| stage.2.show(ui, &mut stage.0, &mut stage.1);
        let stage = Stage(fixture::model(), Vec::new(), State::default());
        let mut harness = Harness::builder().with_size([420.0, 500.0]).build_ui_state(draw, stage);
        harness.run_steps(2);
        assert!(harness.query_all_by_label_contains("Step 2: look promised").next().is_none(), "folded at first");
        harness.get_by_label("Promised and delivered").click();
        harness.run_steps(20);
        harness.query_all_by_label_contains("Step 2: look promised").next().expect("a row").click();
        harness.run_steps(2);
        assert!(matches!(harness.state().1[..], [Command::GoTo(2)]), "{:?}", harness.state().1);
        let moved = harness.query_all_by_label_contains("move promised").count();
        let pushes = harness.state().0.sessions[0].record.delivered().iter().filter(|one| one.is_manipulation).count();
        assert_eq!((moved, pushes > 0), (pushes, true));
    }
}
