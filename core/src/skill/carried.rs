//! The object that a tool touches first and moves along, according to a belief.

use crate::belief::{Belief, FloorPlan, Flow, Met, OBJECT_RADIUS_M, SOLID, Stroke};
use crate::grid::VoxelSet;

/// The object that the tool touches first moves with it for the rest of the stroke, at most up to the walls; nothing moves
/// when it touches nothing that is believed occupied. The object is assumed neither to turn nor to push other objects.
///
/// `solid` holds the occupied floor cells ([`SOLID`]), `swept` is what the tool sweeps.
pub(super) fn carried_along(belief: &Belief, solid: &FloorPlan, swept: &VoxelSet, stroke: &Stroke) -> Flow {
    let (grid, met) = (&belief.grid, Met::of(belief, swept));
    let along = |cell: usize| stroke.along(grid.cell_center(grid.cell(cell)));
    let first = (0..grid.cell_count())
        .filter(|&cell| met.probability[cell] >= SOLID && along(cell) >= 0.0)
        .min_by(|&a, &b| along(a).total_cmp(&along(b)));
    let Some(first) = first else { return Flow::nothing() };
    let way_m = (stroke.length_m - along(first) + 0.5 * grid.voxel_m).max(0.0);
    Flow::rigid(grid, &solid.patch(first, OBJECT_RADIUS_M), [0, 1].map(|axis| stroke.direction[axis] * way_m))
}
