//! The largest changes of a step: voxels by their probability, floor cells by the probability of a class.

use super::half_belief::HalfBelief;
use super::picked::Picked;
use super::session::{Moment, SessionId};
use nudge_core::belief::{Belief, beta_mean};
use nudge_core::scene::{CLASS_COUNT, ClassId};

/// How many of each are listed.
pub const LISTED: usize = 40;
/// A change of a probability above this has a line.
pub const CHANGED: f32 = 0.02;

/// One of the largest changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The voxel, or the floor cell.
    pub of: Picked,
    /// The class whose probability changed most, of a floor cell.
    pub class: Option<ClassId>,
    /// The probability before and after: of being occupied, or of the class.
    pub from_to: [f32; 2],
    /// What made it, in words.
    pub cause: String,
}

impl Change {
    /// By how much the probability changed, with its sign.
    pub fn change(&self) -> f32 {
        self.from_to[1] - self.from_to[0]
    }
}

/// The largest changes of a step.
#[derive(Clone, Debug, Default)]
pub struct Largest {
    /// The voxels that changed most, the largest change first.
    pub voxels: Vec<Change>,
    /// The floor cells whose class changed most, the largest change first.
    pub cells: Vec<Change>,
}

/// The changes of one state of an episode, and whether all that the step brought was known then.
pub type Of = (SessionId, usize, bool);

/// Looks through both beliefs; takes some tens of milliseconds. `cause` says what made a change.
pub fn largest(before: &Moment, after: &Moment, cause: impl Fn(Picked) -> String) -> Largest {
    let full: [Belief; 2] = [&before.belief, &after.belief].map(HalfBelief::belief);
    let p = |at: usize, voxel: usize| beta_mean(full[at].occupancy[voxel]);
    let voxels = most(full[0].occupancy.len(), |voxel| p(1, voxel) - p(0, voxel));
    let voxels = voxels.into_iter().map(|voxel| {
        let of = Picked::Voxel(voxel);
        Change { of, class: None, from_to: [p(0, voxel), p(1, voxel)], cause: cause(of) }
    });
    let classes = |at: usize, cell: usize| shares(&full[at].semantics[cell]);
    let moved = |cell: usize| {
        let [from, to] = [classes(0, cell), classes(1, cell)];
        let change = |class: &usize| (to[*class] - from[*class]).abs();
        let class = (0..CLASS_COUNT).max_by(|a, b| change(a).total_cmp(&change(b))).unwrap_or(0);
        (ClassId(class as u8), [from[class], to[class]])
    };
    let cells = most(full[0].semantics.len(), |cell| {
        let (_, [from, to]) = moved(cell);
        to - from
    });
    let cells = cells.into_iter().map(|cell| {
        let (of, (class, from_to)) = (Picked::Cell(cell), moved(cell));
        Change { of, class: Some(class), from_to, cause: cause(of) }
    });
    Largest { voxels: voxels.collect(), cells: cells.collect() }
}

/// The probabilities of a cell's classes.
pub fn shares(a: &[f32; CLASS_COUNT]) -> [f32; CLASS_COUNT] {
    let sum: f32 = a.iter().sum();
    a.map(|a| a / sum)
}

/// The positions with the largest changes above [`CHANGED`], the largest first, equals in their order.
fn most(count: usize, change: impl Fn(usize) -> f32) -> Vec<usize> {
    let mut changed: Vec<(f32, usize)> =
        (0..count).map(|at| (change(at).abs(), at)).filter(|(size, _)| *size > CHANGED).collect();
    let order = |a: &(f32, usize), b: &(f32, usize)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if changed.len() > LISTED {
        changed.select_nth_unstable_by(LISTED, order);
        changed.truncate(LISTED);
    }
    changed.sort_by(order);
    changed.into_iter().map(|(_, at)| at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::{fixture, panels::causes};
    use nudge_core::belief::CLASSICAL;

    #[test]
    fn the_largest_change_comes_first_and_every_one_has_a_cause() {
        let session = fixture::session(1);
        for step in 1..session.moments.len() {
            let (before, after) = (&session.moments[step - 1], &session.moments[step]);
            let cause = |of| causes::of_step(&session.setup.catalog, CLASSICAL, [before, after], of);
            let found = largest(before, after, cause);
            let full = [before, after].map(|moment| moment.belief.belief());
            let sizes = (0..full[0].occupancy.len())
                .map(|voxel| (full[1].probability(voxel) - full[0].probability(voxel)).abs());
            let top = sizes.fold(0.0, f32::max);
            assert!(top <= CHANGED || found.voxels[0].change().abs() == top, "step {step}");
            for list in [&found.voxels, &found.cells] {
                assert!(list.len() <= LISTED && list.is_sorted_by(|a, b| a.change().abs() >= b.change().abs()));
                assert!(
                    list.iter().all(|change| change.change().abs() > CHANGED && !change.cause.is_empty()),
                    "step {step}"
                );
            }
        }
    }
}
