//! Exact voxel traversal (Amanatides and Woo, "A fast voxel traversal algorithm for ray tracing", 1987).

use super::{Grid, Voxel};
use crate::{Point, Vector};

/// One voxel on a ray and the part of the ray that lies inside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The voxel.
    pub voxel: Voxel,
    /// Its position in arrays over voxels.
    pub index: usize,
    /// Ray parameter where the ray enters, in lengths of the direction.
    pub t_enter: f32,
    /// Ray parameter where the ray leaves, at most the traversal's end.
    pub t_exit: f32,
}

/// Iterator over the voxels that a ray crosses, in order, none skipped and none twice. Neighbours in the sequence
/// share a face.
#[derive(Clone, Debug)]
pub struct Traversal {
    dims: [i32; 3],
    at: [i32; 3],
    step: [i32; 3],
    /// Ray parameter of the next boundary along each axis.
    t_next: [f64; 3],
    /// Ray parameter between two boundaries along each axis.
    t_delta: [f64; 3],
    t: f64,
    t_end: f64,
    alive: bool,
}

impl Traversal {
    /// The ray from `from` along `direction` (any length above zero) up to the parameter `t_max`. A ray that starts
    /// outside enters at the grid's face; a ray that misses the grid yields nothing.
    pub fn new(grid: &Grid, from: Point, direction: Vector, t_max: f32) -> Self {
        let voxel = f64::from(grid.voxel_m);
        let dims = grid.dims.map(|n| n as i32);
        let mut ray = Self {
            dims,
            at: [0; 3],
            step: [0; 3],
            t_next: [f64::INFINITY; 3],
            t_delta: [f64::INFINITY; 3],
            t: 0.0,
            t_end: f64::from(t_max),
            alive: false,
        };
        // Clip to the grid's box.
        let (mut enter, mut leave) = (0.0_f64, f64::from(t_max));
        for axis in 0..3 {
            let (o, d) = (f64::from(from[axis] - grid.origin[axis]), f64::from(direction[axis]));
            let size = f64::from(dims[axis]) * voxel;
            if d == 0.0 {
                if o < 0.0 || o >= size {
                    return ray;
                }
            } else {
                let (a, b) = (-o / d, (size - o) / d);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
        }
        if enter.is_nan() || leave.is_nan() || enter >= leave {
            return ray;
        }
        for axis in 0..3 {
            let (o, d) = (f64::from(from[axis] - grid.origin[axis]), f64::from(direction[axis]));
            let cell = ((o + enter * d) / voxel).floor() as i32;
            ray.at[axis] = cell.clamp(0, dims[axis] - 1);
            if d != 0.0 {
                ray.step[axis] = if d > 0.0 { 1 } else { -1 };
                let boundary = f64::from(ray.at[axis] + i32::from(d > 0.0)) * voxel;
                ray.t_next[axis] = ((boundary - o) / d).max(enter);
                ray.t_delta[axis] = voxel / d.abs();
            }
        }
        ray.t = enter;
        ray.t_end = leave;
        ray.alive = true;
        ray
    }
}

impl Iterator for Traversal {
    type Item = Crossing;

    fn next(&mut self) -> Option<Crossing> {
        if !self.alive {
            return None;
        }
        let axis = if self.t_next[0] <= self.t_next[1] {
            if self.t_next[0] <= self.t_next[2] { 0 } else { 2 }
        } else if self.t_next[1] <= self.t_next[2] {
            1
        } else {
            2
        };
        let t_exit = self.t_next[axis].min(self.t_end);
        let [x, y, z] = self.at;
        let crossing = Crossing {
            voxel: Voxel { x: x as u16, y: y as u16, z: z as u16 },
            index: ((x * self.dims[1] + y) * self.dims[2] + z) as usize,
            t_enter: self.t as f32,
            t_exit: t_exit as f32,
        };
        self.t = t_exit;
        self.at[axis] += self.step[axis];
        self.t_next[axis] += self.t_delta[axis];
        self.alive = t_exit < self.t_end && (0..self.dims[axis]).contains(&self.at[axis]);
        Some(crossing)
    }
}
