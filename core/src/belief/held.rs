//! The belief after the arm has taken an object and set it down: what is held moves as a whole, and nothing else changes.
//!
//! The evidence of the object's columns goes where the object goes. Where it stood, what was believed solid is free; what
//! nobody has seen there stays unknown. Both happen with the chance that the object is held; the change is that chance in
//! the columns that are left or come to, so what is there counts as unseen until it is looked at.

use super::classical::{GONE, LOG_ODDS_LIMIT, evidence};
use super::{Belief, Intervention, Prediction, beta_mean};
use crate::grid::Window;
use crate::scene::{BACKGROUND, CLASS_COUNT};

/// What is predicted of something that is held, with the chance that it is.
pub(super) fn predict(belief: &Belief, intervention: &Intervention, chance: f32) -> Prediction {
    let (grid, height) = (&belief.grid, belief.grid.dims[2]);
    let moved = intervention.flow.moved(grid);
    let window = moved.corners().fold(None, |window: Option<Window>, [x, y]| {
        let Window { x: [x0, x1], y: [y0, y1] } = window.unwrap_or(Window { x: [x, x + 1], y: [y, y + 1] });
        Some(Window { x: [x0.min(x), x1.max(x + 1)], y: [y0.min(y), y1.max(y + 1)] })
    });
    let window = window.unwrap_or(Window { x: [0, 1], y: [0, 1] });
    let gone = evidence(-LOG_ODDS_LIMIT, GONE);
    let is_solid = |a: [f32; 2]| beta_mean(a) > 0.5;
    let mut background = [1.0; CLASS_COUNT];
    background[usize::from(BACKGROUND.0)] += 1.0;
    let mut prediction = Prediction {
        window,
        occupancy: Vec::with_capacity(window.cell_count() * height),
        semantics: Vec::with_capacity(window.cell_count()),
        change: Vec::with_capacity(window.cell_count()),
    };
    for cell in window.cells(grid) {
        let (column, labels) = (&belief.occupancy[grid.column(cell)], &belief.semantics[cell]);
        let (left, source) = (moved.stood(cell), moved.source(cell));
        let p = if left || source.is_some() { chance } else { 0.0 };
        let arriving = source.map(|source| &belief.occupancy[grid.column(source)]);
        prediction.occupancy.extend(column.iter().enumerate().map(|(level, &before)| {
            let arrives = arriving.map(|column| column[level]).filter(|a| is_solid(*a));
            let stays = if left && is_solid(before) { gone } else { before };
            mixed(before, arrives.unwrap_or(stays), p)
        }));
        let after = source.map_or(if left { background } else { *labels }, |source| belief.semantics[source]);
        prediction.semantics.push(std::array::from_fn(|k| (1.0 - p) * labels[k] + p * after[k]));
        prediction.change.push(p);
    }
    prediction
}

/// Before and after, with the chance of after: their mean probability with the mean of their totals.
fn mixed(before: [f32; 2], after: [f32; 2], p: f32) -> [f32; 2] {
    if p <= 0.0 || before == after {
        return before;
    }
    if p >= 1.0 {
        return after;
    }
    let total = (1.0 - p) * (before[0] + before[1]) + p * (after[0] + after[1]);
    let mean = (1.0 - p) * beta_mean(before) + p * beta_mean(after);
    // No negative evidence: each parameter is at least one.
    let total = total.max(1.0 / mean.min(1.0 - mean));
    [mean * total, (1.0 - mean) * total]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::{BeliefUpdate, Classical, FloorPlan, Flow, SOLID, Stroke};
    use crate::grid::{Cell, Grid, VoxelSet};
    use crate::{Point, Vector};

    /// A box of 4 x 4 cells and 4 levels of class 3 in a shelf that is seen free but for a dark corner behind it.
    fn standing() -> (Belief, Intervention, impl Fn(u16, u16) -> usize) {
        let grid = Grid::for_shelf([0.20, 0.20, 0.05], 0.005);
        let mut belief = Belief::uniform(grid);
        let cell = move |x: u16, y: u16| grid.cell_index(Cell { x, y });
        for at in 0..grid.cell_count() {
            let Cell { x, y } = grid.cell(at);
            if y < 24 {
                belief.occupancy[grid.column(at)].fill(evidence(-3.0, 30.0));
            }
            if (10..14).contains(&x) && (20..24).contains(&y) {
                belief.occupancy[grid.column(at)][..4].fill(evidence(3.0, 30.0));
                belief.semantics[at][3] += 9.0;
            }
        }
        let patch = FloorPlan::new(&belief, SOLID).patch(cell(11, 21), 0.1);
        let flow = Flow::rigid(&grid, &patch, [0.05, -0.05]);
        let stroke = Stroke { start: Point::origin(), direction: Vector::new(0.0, -1.0, 0.0), length_m: 0.1 };
        let intervention = Intervention { swept: VoxelSet::empty(&grid), flow, stroke, held: Some(1.0) };
        (belief, intervention, cell)
    }

    #[test]
    fn what_is_held_moves_as_a_whole_and_leaves_free_space_behind() {
        let (belief, intervention, cell) = standing();
        let mut after = belief.clone();
        let prediction = predict(&belief, &intervention, 1.0);
        after.apply(&prediction);
        let grid = belief.grid;
        let (from, to) = (cell(11, 21), cell(21, 11));
        assert_eq!(after.occupancy[grid.column(to)][..4], belief.occupancy[grid.column(from)][..4]);
        assert_eq!(after.semantics[to], belief.semantics[from]);
        assert!(grid.column(from).all(|voxel| after.probability(voxel) < 0.05), "it has left");
        assert_eq!(after.likeliest(from).0, BACKGROUND);
        let behind = grid.column(cell(11, 30)).start;
        assert_eq!(after.probability(behind), 0.5, "what nobody has seen stays unknown");
        assert_eq!(prediction.change.iter().filter(|p| **p == 1.0).count(), 32, "16 cells are left, 16 come to");
    }

    #[test]
    fn a_pick_that_may_fail_is_between_before_and_after_and_one_that_failed_changes_nothing() {
        let (belief, mut intervention, cell) = standing();
        let grid = belief.grid;
        let of = |chance| {
            let mut after = belief.clone();
            after.apply(&predict(&belief, &intervention, chance));
            [cell(11, 21), cell(21, 11)].map(|at| after.probability(grid.column(at).start))
        };
        let ([here, there], [still, _], [gone, come]) = (of(0.5), of(0.0), of(1.0));
        assert!((here - 0.5 * (still + gone)).abs() < 1e-5 && there > 0.4 && there < come, "{here} {there}");
        intervention.flow = Flow::nothing();
        intervention.held = Some(0.0);
        let mut after = belief.clone();
        after.apply(&predict(&belief, &intervention, 0.0));
        assert_eq!(after, belief);
    }

    #[test]
    fn pushes_beside_picks_are_predicted_as_alone_and_in_order() {
        let (belief, held, _) = standing();
        let pushed = Intervention { held: None, ..held.clone() };
        let alone = Classical.predict(&belief, std::slice::from_ref(&pushed));
        let both = Classical.predict(&belief, &[held.clone(), pushed.clone(), held]);
        assert_eq!(both.len(), 3);
        assert_eq!(both[1], alone[0]);
        assert!(both[0] == both[2] && both[0] != both[1]);
    }

    #[test]
    fn what_is_taken_away_leaves_and_comes_nowhere() {
        let (belief, mut intervention, cell) = standing();
        let patch = FloorPlan::new(&belief, SOLID).patch(cell(11, 21), 0.1);
        intervention.flow = Flow::away(&belief.grid, &patch);
        let mut after = belief.clone();
        after.apply(&predict(&belief, &intervention, 1.0));
        let solid = |belief: &Belief| (0..belief.grid.voxel_count()).filter(|at| belief.probability(*at) > 0.6).count();
        assert_eq!((solid(&belief), solid(&after)), (64, 0));
    }
}
