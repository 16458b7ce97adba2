//! A classical prediction of what a manipulation leaves behind.
//!
//! Nothing is simulated. The prediction makes four assumptions, all inside a window around the swept volume:
//!
//! * **Swept columns are free.** Where arm and tool have passed, nothing stands any more. Objects stand on the board
//!   and do not overhang, so nothing is above either, as surely as the log-odds limit allows. Below, the column is free
//!   too where the tool passed lower than any object is high ([`SHORTEST_M`]), or where it touched something, which has
//!   then left. What is lower than a link that passed above it stays. The reported change of a swept cell is the
//!   largest occupancy probability in the swept part of its column.
//! * **What is expected to move goes where it is expected to go** ([`Flow`](crate::belief::Flow)): of a push the first object
//!   that the tool touches, shifted along for the rest of the push. Where it stood is free. Its evidence moves along, halved in log-odds (it may turn or slip off), and so do its labels.
//! * **Evidence of objects near the tool's stroke decays to the prior**, because a moving object pushes others. The probability
//!   of change is 1 within [`NEAR_M`] of the tip's track, falls linearly to 0 at [`FAR_M`], and is scaled by the
//!   probability that the tool touches anything. The track is extended by [`AHEAD_M`] beyond its end, because that is
//!   where objects go. Cells behind the start keep their evidence: nothing moves against the tool.
//! * **Known free space stays free** unless the moved object comes to stand there. If it decayed as well, every
//!   manipulation would promise a large gain for looking again at what was only forgotten: a ray through many voxels of small `p`
//!   gains up to `H(p) / p` nats, 4 at `p = 0.05` but 1.4 in truly unknown space.
//!
//! The posterior is gated with the probability of change: `lambda' = (1 - p) lambda + p lambda_predicted`; swept
//! columns are free for certain.

use super::{LOG_ODDS_LIMIT, evidence, log_odds};
use crate::Point;
use crate::belief::intervention::{Met, Moved};
use crate::belief::{Belief, FloorPlan, Intervention, Prediction, Stroke, beta_mean};
use crate::grid::Window;
use crate::scene::{BACKGROUND, CLASS_COUNT};

/// Distance from the tip's track within which an object surely moves, if the tool touches anything, metres.
pub const NEAR_M: f32 = 0.03;
/// Distance from the tip's track from which nothing changes, metres.
pub const FAR_M: f32 = 0.09;
/// How far the track is extended beyond the end of the stroke, metres: about the depth of what is pushed.
pub const AHEAD_M: f32 = 0.06;
/// Lower than any object is high, metres: what passes here passes through the whole column.
pub const SHORTEST_M: f32 = 0.06;
/// Evidence for free space where an object has left, strong enough to outweigh the old evidence in a mixture.
pub const GONE: f32 = 100.0;

/// The belief that a manipulation is predicted to leave. `plan` holds the occupied floor cells
/// ([`SOLID`](crate::belief::SOLID)).
pub(super) fn predict(belief: &Belief, plan: &FloorPlan, intervention: &Intervention) -> Prediction {
    let grid = &belief.grid;
    let height = grid.dims[2];
    let (met, stroke) = (Met::of(belief, &intervention.swept), &intervention.stroke);
    let contact = met.probability.iter().copied().fold(0.0, f32::max);
    let moved = intervention.flow.moved(grid);
    let window = window(belief, &met, stroke, &moved);

    let free = evidence(-LOG_ODDS_LIMIT, 1.0 + LOG_ODDS_LIMIT.exp());
    let gone = evidence(-LOG_ODDS_LIMIT, GONE);
    let mut prediction = Prediction {
        window,
        occupancy: Vec::with_capacity(window.cell_count() * height),
        semantics: Vec::with_capacity(window.cell_count()),
        change: Vec::with_capacity(window.cell_count()),
    };
    let mut background = [1.0; CLASS_COUNT];
    background[usize::from(BACKGROUND.0)] += 1.0;
    for cell in window.cells(grid) {
        let column = &belief.occupancy[grid.column(cell)];
        let before = &belief.semantics[cell];
        let (left, source) = (moved.stood(cell), moved.source(cell));
        let change;
        let labels: [f32; CLASS_COUNT];
        if met.probability[cell] >= 0.0 {
            let lowest = met.lowest[cell];
            let passed_low = lowest as f32 * grid.voxel_m <= SHORTEST_M;
            let gone = passed_low || column[lowest..].iter().any(|a| beta_mean(*a) > 0.5);
            let free_from = if gone { 0 } else { lowest };
            change = met.probability[cell];
            labels = if gone { background } else { *before };
            prediction.occupancy.extend(
                column
                    .iter()
                    .enumerate()
                    .map(|(level, a)| if level >= free_from && beta_mean(*a) > beta_mean(free) { free } else { *a }),
            );
        } else if left || source.is_some() {
            change = contact;
            labels = source.map_or(background, |source| belief.semantics[source].map(|a| 0.5 * (1.0 + a)));
            let stays = column.iter().map(|a| if left && beta_mean(*a) > 0.5 { gone } else { *a });
            match source.map(|source| &belief.occupancy[grid.column(source)]) {
                None => prediction.occupancy.extend(column.iter().zip(stays).map(|(a, b)| gated(*a, b, change))),
                Some(arriving) => {
                    prediction.occupancy.extend(column.iter().zip(stays).zip(arriving).map(|((a, stays), arrives)| {
                        let arrives = evidence(0.5 * log_odds(*arrives), 0.5 * (arrives[0] + arrives[1]));
                        let solid = beta_mean(arrives) > 0.5 && beta_mean(arrives) > beta_mean(stays);
                        gated(*a, if solid { arrives } else { stays }, change)
                    }))
                }
            }
        } else {
            let near = if plan.stands(cell) { nearness(stroke, grid.cell_center(grid.cell(cell))) } else { 0.0 };
            change = contact * near;
            labels = [1.0; CLASS_COUNT];
            let decayed = |a: &[f32; 2]| if beta_mean(*a) > 0.5 { gated(*a, [1.0; 2], change) } else { *a };
            if change > 0.0 {
                prediction.occupancy.extend(column.iter().map(decayed));
            } else {
                prediction.occupancy.extend_from_slice(column);
            }
        }
        prediction.change.push(change);
        prediction.semantics.push(std::array::from_fn(|k| (1.0 - change) * before[k] + change * labels[k]));
    }
    prediction
}

/// `(1 - p) lambda + p lambda_predicted`.
fn gated(before: [f32; 2], predicted: [f32; 2], p: f32) -> [f32; 2] {
    std::array::from_fn(|k| (1.0 - p) * before[k] + p * predicted[k])
}

/// The columns that the prediction may change: swept cells, cells within [`FAR_M`] of the track, and cells that the
/// moved object leaves or comes to.
fn window(belief: &Belief, met: &Met, stroke: &Stroke, moved: &Moved) -> Window {
    let grid = &belief.grid;
    let (mut low, mut high) = ([usize::MAX; 2], [0_usize; 2]);
    let mut include = |at: [usize; 2]| {
        for axis in 0..2 {
            low[axis] = low[axis].min(at[axis]);
            high[axis] = high[axis].max(at[axis] + 1);
        }
    };
    for cell in (0..grid.cell_count()).filter(|&cell| met.probability[cell] >= 0.0) {
        include([cell / grid.dims[1], cell % grid.dims[1]]);
    }
    for end in [stroke.start, stroke.start + stroke.direction * (stroke.length_m + AHEAD_M)] {
        for reach in [-FAR_M, FAR_M] {
            let at: [usize; 2] = std::array::from_fn(|axis| {
                let cell = ((end[axis] + reach - grid.origin[axis]) / grid.voxel_m).floor().max(0.0) as usize;
                cell.min(grid.dims[axis] - 1)
            });
            include(at);
        }
    }
    moved.corners().for_each(include);
    Window { x: [low[0], high[0]], y: [low[1], high[1]] }
}

/// 1 near the extended track of the tip, 0 far from it or behind its start.
fn nearness(stroke: &Stroke, on_board: Point) -> f32 {
    let along = stroke.along(on_board);
    if along < 0.0 {
        return 0.0;
    }
    let on_track = stroke.start + stroke.direction * along.min(stroke.length_m + AHEAD_M);
    let distance = (on_board.x - on_track.x).hypot(on_board.y - on_track.y);
    ((FAR_M - distance) / (FAR_M - NEAR_M)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::Classical;
    use super::*;
    use crate::belief::{BeliefUpdate, SOLID};
    use crate::grid::{Grid, VoxelSet};
    use crate::scene::ClassId;
    use crate::skill::push::{Push, SweptPush};

    fn predicted(belief: &Belief, push: &SweptPush) -> Prediction {
        let intervention = push.intervention(belief, &FloorPlan::new(belief, SOLID));
        Classical.predict(belief, &[intervention]).remove(0)
    }

    /// A shelf with a box of class 5 on it, `x` in +-5 cm, `y` in 20 to 28 cm, `z` below 10 cm, and one of class 7 to the
    /// right of where that is going, `x` in 8 to 12 cm, `y` in 22 to 26 cm; everything else known free. The tool passes
    /// a corridor 4 cm wide at 4 to 8 cm of height, 5 cm into the box.
    fn push_into_a_box() -> (Belief, SweptPush) {
        let grid = Grid::for_shelf([0.80, 0.40, 0.40], 0.005);
        let mut belief = Belief::uniform(grid);
        let mut swept = VoxelSet::empty(&grid);
        for index in 0..grid.voxel_count() {
            let at = grid.center(grid.voxel(index));
            let cell = index / grid.dims[2];
            let box_ = at.x.abs() < 0.05 && (0.20..0.28).contains(&at.y);
            let other = (0.08..0.12).contains(&at.x) && (0.22..0.26).contains(&at.y);
            belief.occupancy[index] = evidence(if (box_ || other) && at.z < 0.10 { 3.4 } else { -3.4 }, 40.0);
            belief.semantics[cell] = [1.0; CLASS_COUNT];
            belief.semantics[cell][if box_ {
                5
            } else if other {
                7
            } else {
                14
            }] += 5.0;
            if at.x.abs() < 0.02 && at.y < 0.25 && (0.04..0.08).contains(&at.z) {
                swept.insert(index);
            }
        }
        let push = Push { start: [0.0, 0.18, 0.06], direction_deg: 90.0, length_m: 0.07 };
        (belief, SweptPush { push, swept })
    }

    #[test]
    fn swept_columns_become_free_and_background() {
        let (belief, push) = push_into_a_box();
        let mut after = belief.clone();
        after.apply(&predicted(&belief, &push));
        let grid = &belief.grid;
        for index in push.swept.iter() {
            for voxel in grid.column(index / grid.dims[2]) {
                assert!(after.probability(voxel) < 0.035, "{:?}", grid.voxel(voxel));
            }
        }
        let in_box = grid.cell_index(grid.cell_at(Point::new(0.0, 0.22, 0.0)).expect("inside"));
        assert_eq!(belief.likeliest(in_box).0.0, 5);
        assert_eq!(after.likeliest(in_box).0, BACKGROUND);
    }

    #[test]
    fn what_is_lower_than_a_link_that_passes_above_it_stays() {
        let (belief, mut push) = push_into_a_box();
        let grid = &belief.grid;
        let voxel = |x: f32, y: f32, z: f32| grid.index(grid.voxel_at(Point::new(x, y, z)).expect("inside"));
        // A link passes over the box, which is 10 cm high, and another over the second box's upper half.
        push.swept = VoxelSet::empty(grid);
        push.swept.insert(voxel(0.0, 0.22, 0.15));
        push.swept.insert(voxel(0.10, 0.24, 0.08));
        let mut after = belief.clone();
        after.apply(&predicted(&belief, &push));
        assert_eq!(after.occupancy[voxel(0.0, 0.22, 0.05)], belief.occupancy[voxel(0.0, 0.22, 0.05)]);
        assert_eq!(after.likeliest(voxel(0.0, 0.22, 0.0) / grid.dims[2]).0, ClassId(5));
        assert!(after.probability(voxel(0.10, 0.24, 0.02)) < 0.05, "what was met has left, down to the board");
        // Nothing was known of this column: it is free from where the link passed, and as unknown as before below.
        let mut unknown = belief.clone();
        unknown.occupancy[grid.column(voxel(0.0, 0.22, 0.0) / grid.dims[2])].fill([1.0; 2]);
        let mut after = unknown.clone();
        after.apply(&predicted(&unknown, &push));
        assert!(after.probability(voxel(0.0, 0.22, 0.30)) < 0.05);
        assert_eq!(after.occupancy[voxel(0.0, 0.22, 0.10)], [1.0; 2]);
    }

    #[test]
    fn the_box_moves_with_the_tool_and_leaves_free_space() {
        let (belief, push) = push_into_a_box();
        let mut after = belief.clone();
        after.apply(&predicted(&belief, &push));
        let grid = &belief.grid;
        let voxel = |x: f32, y: f32, z: f32| grid.index(grid.voxel_at(Point::new(x, y, z)).expect("inside"));
        let p = |x: f32, y: f32, z: f32| (belief.probability(voxel(x, y, z)), after.probability(voxel(x, y, z)));
        let class = |x: f32, y: f32| after.likeliest(voxel(x, y, 0.0) / grid.dims[2]).0;
        // The tip meets it after 2 of 7 cm, so it goes 5 cm: from y = 20..28 to 25..33 cm.
        for x in [-0.048, 0.0, 0.048] {
            let (before, there) = p(x, 0.27, 0.05);
            assert!(before > 0.95 && (0.7..0.9).contains(&there), "still there, less sure: {there}");
            let (before, there) = p(x, 0.327, 0.05);
            assert!(before < 0.05 && (0.7..0.9).contains(&there), "its back has come here: {there}");
            assert_eq!(class(x, 0.327), ClassId(5));
            assert_eq!(p(x, 0.333, 0.05).1, before, "and no farther");
            assert_eq!(p(x, 0.327, 0.15).1, before, "nor higher");
        }
        let (before, beside_the_tool) = p(0.04, 0.22, 0.05);
        assert!(before > 0.95 && beside_the_tool < 0.05, "it has left: {beside_the_tool}");
        assert_eq!(class(0.04, 0.22), BACKGROUND);
    }

    #[test]
    fn things_near_the_push_are_forgotten_and_the_rest_is_kept() {
        let (belief, push) = push_into_a_box();
        let prediction = &predicted(&belief, &push);
        let mut after = belief.clone();
        after.apply(prediction);
        let grid = &belief.grid;
        let parameters = |x: f32, y: f32, z: f32| {
            let index = grid.index(grid.voxel_at(Point::new(x, y, z)).expect("inside"));
            (belief.occupancy[index], after.occupancy[index])
        };
        // 8.25 cm from the track: change 0.967 x 0.125, of 38.7 parameters less one.
        let (before, near) = parameters(0.0825, 0.24, 0.05);
        assert!((before[0] - near[0] - 0.967_7 * 0.125 * (before[0] - 1.0)).abs() < 0.02, "{before:?} {near:?}");
        let (before, beyond_reach) = parameters(0.1025, 0.24, 0.05);
        assert_eq!(before, beyond_reach);
        let (before, free) = parameters(0.06, 0.24, 0.05);
        assert_eq!(before, free, "known free space stays");
        assert!(after.semantic_entropy() > belief.semantic_entropy());
    }

    #[test]
    fn what_moves_stops_at_the_walls() {
        let (belief, mut push) = push_into_a_box();
        push.push.length_m = 0.20;
        let prediction = &predicted(&belief, &push);
        let mut after = belief.clone();
        after.apply(prediction);
        let grid = &belief.grid;
        let solid = |y: usize| after.probability(grid.index(crate::grid::Voxel { x: 80, y: y as u16, z: 5 })) > 0.5;
        let rows: Vec<usize> = (0..80).filter(|&y| solid(y)).collect();
        assert_eq!(rows, (64..80).collect::<Vec<_>>(), "16 rows, up to the back wall");
    }

    #[test]
    fn nothing_outside_the_window_is_touched_and_the_window_is_not_the_whole_plan() {
        let (belief, push) = push_into_a_box();
        let prediction = &predicted(&belief, &push);
        let grid = &belief.grid;
        let window = prediction.window;
        assert!(window.size()[0] < grid.dims[0] / 2, "{window:?}");
        assert_eq!(prediction.change.len(), window.cell_count());
        assert_eq!(prediction.semantics.len(), window.cell_count());
        assert_eq!(prediction.occupancy.len(), window.cell_count() * grid.dims[2]);
        let mut after = belief.clone();
        after.apply(prediction);
        for cell in 0..grid.cell_count() {
            let at = grid.cell(cell);
            let (x, y) = (usize::from(at.x), usize::from(at.y));
            let inside = (window.x[0]..window.x[1]).contains(&x) && (window.y[0]..window.y[1]).contains(&y);
            let same = after.occupancy[grid.column(cell)] == belief.occupancy[grid.column(cell)]
                && after.semantics[cell] == belief.semantics[cell];
            assert!(inside || same, "{at:?}");
        }
        assert!(after != belief);
        assert!(prediction.change.iter().all(|p| (0.0..=1.0).contains(p)));
    }

    #[test]
    fn a_push_through_known_air_changes_next_to_nothing() {
        let (mut belief, push) = push_into_a_box();
        let air = evidence(-3.5, 40.0);
        belief.occupancy.fill(air);
        let prediction = &predicted(&belief, &push);
        assert!(prediction.change.iter().all(|p| *p < 0.03));
        assert!(prediction.occupancy.iter().all(|a| beta_mean(*a) < 0.05));
    }
}
