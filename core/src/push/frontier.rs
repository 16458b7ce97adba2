//! The frontier: where the known things begin, seen from the shelf's entrance.

use super::{CONFIDENT, LIKELY, REACH_M};
use crate::belief::Belief;
use crate::grid::Voxel;

/// The first voxel with `p >= 0.85` seen from the shelf's entrance in every (x, z) column, in ascending order of x, then
/// z; columns without one are left out.
pub fn frontier(belief: &Belief) -> Vec<Voxel> {
    let [width, depth, height] = belief.grid.dims;
    let mut found = Vec::new();
    let mut first = vec![None; height];
    for x in 0..width {
        first.fill(None);
        for y in 0..depth {
            let column = &belief.occupancy[belief.grid.column(x * depth + y)];
            for (first, &[occupied, free]) in first.iter_mut().zip(column) {
                if first.is_none() && occupied >= CONFIDENT * (occupied + free) {
                    *first = Some(y);
                }
            }
        }
        let voxel = |(z, y): (usize, &Option<usize>)| y.map(|y| Voxel { x: x as u16, y: y as u16, z: z as u16 });
        found.extend(first.iter().enumerate().filter_map(voxel));
    }
    found
}

/// Likely occupied voxels within [`REACH_M`] of a frontier voxel, itself left out (one voxel alone is noise), and not
/// nearer to the entrance than `start_y`, in the grid's order.
pub(super) fn likely_targets(belief: &Belief, frontier: Voxel, start_y: f32) -> Vec<Voxel> {
    let grid = &belief.grid;
    let reach = (REACH_M / grid.voxel_m) as i32;
    let range = |at: u16, axis: usize| {
        let (low, high) = (i32::from(at) - reach, i32::from(at) + reach + 1);
        low.max(0)..high.min(grid.dims[axis] as i32)
    };
    let squared = |a: i32, b: u16| (a - i32::from(b)) * (a - i32::from(b));
    let mut found = Vec::new();
    for x in range(frontier.x, 0) {
        for y in range(frontier.y, 1) {
            let on_plan = squared(x, frontier.x) + squared(y, frontier.y);
            if on_plan > reach * reach || grid.origin[1] + (y as f32 + 0.5) * grid.voxel_m < start_y {
                continue;
            }
            let column = &belief.occupancy[grid.column(x as usize * grid.dims[1] + y as usize)];
            for z in range(frontier.z, 2) {
                let [occupied, free] = column[z as usize];
                if occupied >= LIKELY * (occupied + free) && on_plan + squared(z, frontier.z) <= reach * reach {
                    found.push(Voxel { x: x as u16, y: y as u16, z: z as u16 });
                }
            }
        }
    }
    found.retain(|voxel| *voxel != frontier);
    found
}
