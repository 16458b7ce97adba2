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
    /// outside enters at the grid's face; a ray that misses the grid, or one that is not a number, yields nothing.
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
            let (o, d) = (f64::from(from[axis]) - f64::from(grid.origin[axis]), f64::from(direction[axis]));
            let size = f64::from(dims[axis]) * voxel;
            if d == 0.0 {
                if !(o >= 0.0 && o < size) {
                    return ray;
                }
            } else if !(o + d).is_finite() {
                return ray;
            } else {
                let (a, b) = (-o / d, (size - o) / d);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
        }
        if t_max.is_nan() || enter >= leave {
            return ray;
        }
        for axis in 0..3 {
            let (o, d) = (f64::from(from[axis]) - f64::from(grid.origin[axis]), f64::from(direction[axis]));
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid() -> Grid {
        Grid { voxel_m: 0.05, dims: [16, 8, 7], origin: [-0.4, 0.0, 0.1] }
    }

    /// The part of the ray inside the grid's box, by clipping with every face in turn.
    fn clipped(grid: &Grid, from: Point, direction: Vector, t_max: f32) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (0.0_f64, f64::from(t_max));
        for axis in 0..3 {
            let (min, d) = (f64::from(grid.origin[axis]), f64::from(direction[axis]));
            let max = min + grid.dims[axis] as f64 * f64::from(grid.voxel_m);
            let o = f64::from(from[axis]);
            if d == 0.0 {
                if !(min..max).contains(&o) {
                    return None;
                }
                continue;
            }
            let (near, far) = if d > 0.0 { (min, max) } else { (max, min) };
            enter = enter.max((near - o) / d);
            leave = leave.min((far - o) / d);
        }
        (enter < leave).then_some((enter, leave))
    }

    /// Coordinates that are often on a face, an edge or a corner of a voxel.
    fn coordinate() -> impl Strategy<Value = f32> {
        prop_oneof![-1.0_f32..1.0, (-20_i8..20).prop_map(|i| f32::from(i) * 0.05)]
    }

    /// Components that are often zero, so that rays run along an axis or in a plane, or nearly zero, so that they
    /// graze.
    fn component() -> impl Strategy<Value = f32> {
        prop_oneof![2 => -1.0_f32..1.0, 1 => Just(0.0), 1 => Just(1.0), 1 => Just(-1.0), 1 => -1e-6_f32..1e-6]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn no_voxel_is_skipped_and_none_comes_twice(
            from in prop::array::uniform3(coordinate()),
            direction in prop::array::uniform3(component()),
            t_max in prop_oneof![Just(f32::INFINITY), 0.0_f32..3.0],
        ) {
            let (grid, from, direction) = (grid(), Point::from(from), Vector::from(direction));
            if direction.norm() < 1e-3 {
                return Ok(());
            }
            let crossings: Vec<Crossing> = grid.traverse(from, direction, t_max).collect();
            let Some((enter, leave)) = clipped(&grid, from, direction, t_max) else {
                // A ray along a face may be counted in or out by a rounding error.
                prop_assert!(crossings.iter().all(|c| c.t_exit - c.t_enter < 1e-4), "{crossings:?}");
                return Ok(());
            };
            if crossings.is_empty() {
                prop_assert!(leave - enter < 1e-4);
                return Ok(());
            }
            // The pieces join to the clipped ray.
            prop_assert!((f64::from(crossings[0].t_enter) - enter).abs() < 1e-4);
            prop_assert!((f64::from(crossings[crossings.len() - 1].t_exit) - leave).abs() < 1e-4);
            for pair in crossings.windows(2) {
                prop_assert_eq!(pair[0].t_exit, pair[1].t_enter);
                let (a, b) = (pair[0].voxel, pair[1].voxel);
                prop_assert_eq!(a.x.abs_diff(b.x) + a.y.abs_diff(b.y) + a.z.abs_diff(b.z), 1, "a shared face");
            }
            let mut indices: Vec<usize> = crossings.iter().map(|c| c.index).collect();
            indices.sort_unstable();
            indices.dedup();
            prop_assert_eq!(indices.len(), crossings.len(), "none twice");
            // Every piece lies in its voxel.
            for c in &crossings {
                prop_assert!(c.t_enter <= c.t_exit);
                prop_assert_eq!(c.index, grid.index(c.voxel));
                let middle = from + direction * (0.5 * (c.t_enter + c.t_exit));
                let off = middle - grid.center(c.voxel);
                prop_assert!(off.amax() < 0.5 * grid.voxel_m + 1e-5, "{c:?} {off:?}");
            }
        }
    }

    #[test]
    fn along_an_axis_every_voxel_of_the_row_comes_once() {
        let grid = grid();
        let row: Vec<usize> = grid
            .traverse(Point::new(-9.0, 0.12, 0.27), Vector::new(2.0, 0.0, 0.0), f32::INFINITY)
            .map(|c| usize::from(c.voxel.x))
            .collect();
        assert_eq!(row, (0..16).collect::<Vec<_>>());
        let back = grid.traverse(Point::new(0.02, 0.12, 0.27), Vector::new(0.0, -1.0, 0.0), f32::INFINITY);
        assert_eq!(back.map(|c| c.voxel.y).collect::<Vec<_>>(), [2, 1, 0]);
    }

    #[test]
    fn what_is_no_ray_yields_nothing() {
        let (grid, inside) = (grid(), Point::new(0.0, 0.2, 0.2));
        let count = |from, direction, t_max| grid.traverse(from, direction, t_max).count();
        assert_eq!(count(inside, Vector::new(f32::NAN, 1.0, 0.0), 1.0), 0);
        assert_eq!(count(Point::new(f32::NAN, 0.2, 0.2), Vector::y(), 1.0), 0);
        assert_eq!(count(Point::new(f32::INFINITY, 0.2, 0.2), -Vector::x(), f32::INFINITY), 0);
        assert_eq!(count(inside, Vector::y(), 0.0), 0);
        assert_eq!(count(inside, Vector::y(), f32::NAN), 0);
        assert_eq!(count(Point::new(0.0, -0.1, 0.2), -Vector::y(), 1.0), 0);
    }
}
