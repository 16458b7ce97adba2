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
    /// Cells in which something really changed.
    pub changed: usize,
    /// Cells that were predicted to change and did.
    pub both: usize,
    /// How surprising what happened is, all floor cells together, nats; `None` if nothing was predicted.
    pub surprise_nats: Option<f32>,
}

impl Review {
    /// Compares the truth before and after a push with what was predicted.
    pub fn of(id: SessionId, before: &Moment, after: &Moment) -> Self {
        let grid = after.belief.grid();
        let prediction = after.outcome.as_ref().and_then(|outcome| outcome.prediction.as_ref());
        let changed = before.truth.changed_cells(&after.truth);
        let predicted = prediction.map(|prediction| predicted_cells(grid, prediction));
        let count = |cells: &[bool]| cells.iter().filter(|cell| **cell).count();
        let both = predicted.as_ref().map_or(0, |predicted| {
            predicted.iter().zip(&changed).filter(|(predicted, changed)| **predicted && **changed).count()
        });
        let surprise_nats = prediction.map(|prediction| prediction.surprise(grid, &changed).iter().sum());
        let predicted = predicted.as_deref().map(count);
        Self { of: (id, after.step), predicted, changed: count(&changed), both, surprise_nats }
    }

    /// Share of the cells predicted to change that did.
    fn precision(&self) -> Option<f32> {
        self.predicted.filter(|predicted| *predicted > 0).map(|predicted| self.both as f32 / predicted as f32)
    }

    /// Share of the cells that changed which were predicted to.
    fn recall(&self) -> Option<f32> {
        (self.predicted.is_some() && self.changed > 0).then(|| self.both as f32 / self.changed as f32)
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
    let dropped = if outcome.record.dropped.is_empty() {
        "nothing".to_owned()
    } else {
        outcome.record.dropped.join(", ").replace('_', " ")
    };
    let predicted = review.predicted.map_or("n/a".to_owned(), |cells| cells.to_string());
    let facts = [
        fact(
            "objects moved",
            format!("{moved} of {}", record.scene.objects.len()),
            "Objects that moved by more than 2 mm",
        ),
        fact("displacement", format!("{:.0} mm", total * 1e3), "Of all objects together"),
        fact(
            "tool went",
            length(&outcome.record).unwrap_or_default(),
            "How far the tip moved in contact, of the length that was planned",
        ),
        fact("blocked", if pushed.stalled { "yes" } else { "no" }, "Whether the arm met too much force and stopped"),
        fact("dropped", dropped, "Objects that left the board"),
        fact("cells changed", review.changed.to_string(), "Floor cells in whose column something really changed"),
        fact("predicted to change", predicted, "Floor cells with a predicted probability of change above 0.5"),
        fact("of these, changed", review.both.to_string(), "Cells that were predicted to change and did"),
        fact("precision", share(review.precision()), "Share of the cells predicted to change that did"),
        fact("recall", share(review.recall()), "Share of the cells that changed which were predicted to"),
        fact(
            "surprise",
            review.surprise_nats.map_or("n/a".to_owned(), words::nats),
            "−ln of the probability given to what happened, all floor cells together",
        ),
    ];
    facts::show(ui, "push review", 2, &facts);
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
        let review = Review { of: (SessionId(0), 1), predicted: Some(2), changed: 2, both: 1, surprise_nats: None };
        assert_eq!((review.precision(), review.recall()), (Some(0.5), Some(0.5)));
        let blind = Review { predicted: None, both: 0, ..review };
        assert_eq!((blind.precision(), blind.recall()), (None, None));
    }
}
