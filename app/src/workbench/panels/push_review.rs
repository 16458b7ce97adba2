//! What a push was predicted to do, and what it did.

use super::facts::{self, fact};
use super::{heading, words};
use crate::record::decision::length;
use crate::workbench::session::{Moment, SessionId};
use nudge_core::belief::Prediction;
use nudge_core::episode::EpisodeRecord;
use nudge_core::grid::Grid;
use nudge_core::plan::Action;
use re_viewer::external::egui::Ui;

/// A floor cell whose predicted probability of change is above this is predicted to change.
const CHANGES: f32 = 0.5;

/// Prediction and truth of a push, counted in floor cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Review {
    /// The episode and the number of actions with the push.
    pub of: (SessionId, usize),
    /// Cells that were predicted to change; `None` if nothing was predicted.
    pub predicted: Option<usize>,
    /// Cells in which something really changed; `None` without a truth.
    pub changed: Option<usize>,
    /// Cells that were predicted to change and did; `None` without a truth.
    pub both: Option<usize>,
    /// How surprising what happened is, all floor cells together, nats; `None` if nothing was predicted.
    pub surprise_nats: Option<f32>,
}

impl Review {
    /// Compares the truth before and after a push with what was predicted.
    pub fn of(id: SessionId, before: &Moment, after: &Moment) -> Self {
        let grid = after.belief.grid();
        let prediction = after.outcome.as_ref().and_then(|outcome| outcome.prediction.as_ref());
        let changed =
            before.truth.as_ref().zip(after.truth.as_ref()).map(|(before, after)| before.changed_cells(after));
        let predicted = prediction.map(|prediction| predicted_cells(grid, prediction));
        let count = |cells: &[bool]| cells.iter().filter(|cell| **cell).count();
        let both = changed.as_ref().map(|changed| {
            let marked = |predicted: &Vec<bool>| predicted.iter().zip(changed).filter(|(a, b)| **a && **b).count();
            predicted.as_ref().map_or(0, marked)
        });
        let surprise = prediction.zip(changed.as_ref()).map(|(prediction, changed)| prediction.surprise(grid, changed));
        let surprise_nats = surprise.map(|surprise| surprise.iter().sum());
        let predicted = predicted.as_deref().map(count);
        Self { of: (id, after.step), predicted, changed: changed.as_deref().map(count), both, surprise_nats }
    }

    /// Share of the cells predicted to change that did.
    fn precision(&self) -> Option<f32> {
        let predicted = self.predicted.filter(|predicted| *predicted > 0)?;
        Some(self.both? as f32 / predicted as f32)
    }

    /// Share of the cells that changed which were predicted to.
    fn recall(&self) -> Option<f32> {
        let changed = self.changed.filter(|changed| *changed > 0 && self.predicted.is_some())?;
        Some(self.both? as f32 / changed as f32)
    }
}

fn predicted_cells(grid: &Grid, prediction: &Prediction) -> Vec<bool> {
    let mut changes = vec![false; grid.cell_count()];
    for (cell, change) in prediction.window.cells(grid).zip(&prediction.change) {
        changes[cell] = *change > CHANGES;
    }
    changes
}

/// Draws what the push that led to `moment` did.
pub fn show(ui: &mut Ui, review: &Review, record: &EpisodeRecord, moment: &Moment) {
    let Some(outcome) = moment.outcome.as_ref() else { return };
    let Some(pushed) = outcome.manipulated.as_ref() else { return };
    let Action::Manipulate(done) = &outcome.record.action else { return };
    let title = format!("What the {} of step {} did", done.kind().name(), moment.step);
    heading(ui, title, "The prediction beside what really happened in the simulated shelf");
    let moved = pushed.displacement_m.iter().filter(|m| **m > 0.002).count();
    let total: f32 = pushed.displacement_m.iter().filter(|m| m.is_finite()).sum();
    let share = |share: Option<f32>| share.map_or("n/a".to_owned(), words::percent);
    let dropped = if outcome.record.dropped().is_empty() {
        "nothing".to_owned()
    } else {
        outcome.record.dropped().join(", ").replace('_', " ")
    };
    let number = |number: Option<usize>| number.map_or("n/a".to_owned(), |number| number.to_string());
    let predicted = review.predicted.map_or("n/a".to_owned(), |cells| cells.to_string());
    let facts = [
        fact(
            "objects moved",
            format!("{moved} of {}", record.scene.objects.len()),
            "Objects that moved by more than 2 mm",
        ),
        fact("displacement", format!("{:.0} mm", total * 1e3), "Of all objects together"),
        match pushed.grip {
            Some(grip) => fact("grip", grip.end.to_string(), "How holding the object ended"),
            None => fact(
                "tool went",
                length(&outcome.record).unwrap_or_default(),
                "How far the tip moved in contact, of the length that was planned",
            ),
        },
        fact("blocked", if pushed.stalled { "yes" } else { "no" }, "Whether the arm met too much force and stopped"),
        fact("dropped", dropped, "Objects that left the board"),
        fact("cells changed", number(review.changed), "Floor cells in whose column something really changed"),
        fact("predicted to change", predicted, "Floor cells with a predicted probability of change above 0.5"),
        fact("of these, changed", number(review.both), "Cells that were predicted to change and did"),
        fact("precision", share(review.precision()), "Share of the cells predicted to change that did"),
        fact("recall", share(review.recall()), "Share of the cells that changed which were predicted to"),
        fact(
            "surprise",
            review.surprise_nats.map_or("n/a".to_owned(), words::nats),
            "−ln of the probability given to what happened, all floor cells together",
        ),
    ];
    // What only somebody who knows the truth can say.
    let told = |name: &str| ["tool went", "grip", "blocked", "predicted to change"].contains(&name);
    let facts: Vec<_> = facts.into_iter().filter(|fact| record.has_truth() || told(fact.name)).collect();
    facts::show(ui, "push review", 2, &facts);
    super::untold(ui, record);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::grid::Window;
    use nudge_core::scene::CLASS_COUNT;
    use nudge_core::world::TruthMap;

    #[test]
    fn precision_and_recall_of_a_hand_made_push() {
        let grid = Grid::for_shelf([0.04, 0.02, 0.02], 0.01);
        let before = TruthMap {
            dims: grid.dims,
            occupancy: vec![0; grid.voxel_count()],
            labels: vec![14; grid.cell_count()],
            objects: vec![u16::MAX; grid.cell_count()],
        };
        let mut after = before.clone();
        after.labels[0] = 3;
        // Only a voxel up in the column of cell 5 differs.
        after.occupancy[grid.column(5).end - 1] = 1;
        let changed = before.changed_cells(&after);
        assert_eq!(changed, [true, false, false, false, false, true, false, false]);
        let window = Window { x: [0, 2], y: [0, 2] };
        let prediction = Prediction {
            window,
            occupancy: vec![[1.0; 2]; 4 * grid.dims[2]],
            semantics: vec![[1.0; CLASS_COUNT]; 4],
            change: vec![0.9, 0.6, 0.5, f32::NAN],
        };
        let predicted = predicted_cells(&grid, &prediction);
        assert_eq!(predicted, [true, true, false, false, false, false, false, false]);
        let surprise = prediction.surprise(&grid, &changed);
        // Changed and expected to; not changed but rather expected to; half; unknown; outside: one that changed, and others.
        let expected = [0.1_f32, 0.92, 0.69, 0.69, 0.0, 4.6, 0.0, 0.0];
        assert!(surprise.iter().zip(expected).all(|(nats, expected)| (nats - expected).abs() < 0.01), "{surprise:?}");
        let review =
            Review { of: (SessionId(0), 1), predicted: Some(2), changed: Some(2), both: Some(1), surprise_nats: None };
        assert_eq!((review.precision(), review.recall()), (Some(0.5), Some(0.5)));
        let blind = Review { predicted: None, both: Some(0), ..review };
        assert_eq!((blind.precision(), blind.recall()), (None, None));
    }
}
