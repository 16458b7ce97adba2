//! The frontier: the first surely occupied voxels seen from the shelf's entrance; and pushes from it into the shelf.

use super::{CONFIDENT, LENGTH_M, LIKELY, REACH_M, STANDOFF_M, TOOL_HEIGHT_M};
use crate::belief::Belief;
use crate::grid::Voxel;
use crate::rng::ChaCha8Rng;
use crate::skill::Push;
use rand::Rng;

/// The frontier of a belief, from which points are drawn without replacement.
pub(super) struct Frontier<'a> {
    belief: &'a Belief,
    /// Those before `next` are used up.
    points: Vec<Voxel>,
    next: usize,
}

impl<'a> Frontier<'a> {
    pub(super) fn new(belief: &'a Belief) -> Self {
        Self { belief, points: frontier(belief), next: 0 }
    }

    /// How many points are left to draw.
    pub(super) fn left(&self) -> usize {
        self.points.len() - self.next
    }

    /// One of the points that are left, and a push from it towards something likely; no push where nothing likely is near.
    /// Always draws as much.
    pub(super) fn draw(&mut self, rng: &mut ChaCha8Rng) -> (Voxel, Option<Push>) {
        let chosen = rng.random_range(self.next..self.points.len());
        self.points.swap(self.next, chosen);
        let point = self.points[self.next];
        self.next += 1;
        let (which, length_m) = (rng.random::<f64>(), rng.random_range(LENGTH_M[0]..LENGTH_M[1]));
        let start = start_of(self.belief, point);
        let targets = likely_targets(self.belief, point, start[1]);
        let towards = |target: &Voxel| {
            let target = self.belief.grid.center(*target);
            let direction_deg = (target.y - start[1]).atan2(target.x - start[0]).to_degrees();
            Push { start, direction_deg, length_m }
        };
        (point, targets.get((which * targets.len() as f64) as usize).map(towards))
    }
}

/// Where a push from a frontier point starts: before the point, at the tool's height.
pub(super) fn start_of(belief: &Belief, frontier: Voxel) -> [f32; 3] {
    let point = belief.grid.center(frontier);
    [point.x, point.y - STANDOFF_M, belief.grid.origin[2] + TOOL_HEIGHT_M]
}

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
