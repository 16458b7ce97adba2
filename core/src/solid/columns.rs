//! Convex regions cut by voxel columns: the one test behind swept volumes and the truth map.

use super::HalfSpace;
use crate::grid::Grid;
use std::ops::Range;

/// The levels of a floor cell's column whose voxel centres are inside all of `faces` (the grid's frame).
///
/// A convex region meets a vertical line in one piece, so the faces are intersected once per column and not once per
/// voxel.
pub(crate) fn levels_inside(grid: &Grid, cell_index: usize, faces: &[HalfSpace]) -> Range<usize> {
    let center = grid.cell_center(grid.cell(cell_index));
    let (mut bottom, mut top) = (f32::NEG_INFINITY, f32::INFINITY);
    for HalfSpace { normal, offset } in faces {
        let rest = offset - normal.x * center.x - normal.y * center.y;
        if normal.z > 1e-6 {
            top = top.min(rest / normal.z);
        } else if normal.z < -1e-6 {
            bottom = bottom.max(rest / normal.z);
        } else if rest < 0.0 {
            return 0..0;
        }
    }
    if bottom > top {
        return 0..0;
    }
    let level = |z: f32| (z - grid.origin[2]) / grid.voxel_m - 0.5;
    let end = (level(top).floor() + 1.0).clamp(0.0, grid.dims[2] as f32) as usize;
    (level(bottom).ceil().max(0.0) as usize).min(end)..end
}
