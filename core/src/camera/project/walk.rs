//! Marking what rays see through: the voxels of `Grid::traverse`, several neighbouring rays in step.
//!
//! An image asks for ten to thirty million voxel visits, and most of them mark what a neighbour has marked already. So
//! marks are bytes that are only ever set, never read on the way; rays run side by side without branches, which lets
//! the compiler use vector instructions; and a ray that is done simply marks its last voxel again. Numbers are single
//! here; against the grid's own traversal a ray may miss or add voxels that it crosses for less than a few hundredths
//! of a millimetre.

use crate::grid::Grid;
use crate::{Point, Vector};

/// Number of rays that run side by side.
pub(super) const LANES: usize = 8;

/// A ray from the camera up to a parameter.
#[derive(Clone, Copy)]
pub(super) struct Segment {
    pub(super) ray: Vector,
    pub(super) end: f32,
}

impl Segment {
    /// A segment without length.
    pub(super) const NOTHING: Self = Self { ray: Vector::new(0.0, 1.0, 0.0), end: 0.0 };
}

/// A byte per voxel, 1 where some ray passed. Around the grid is a margin of one voxel, where rays may end by rounding.
pub(super) struct SeenThrough {
    marks: Vec<u8>,
    dims: [usize; 3],
}

impl SeenThrough {
    pub(super) fn nothing(grid: &Grid) -> Self {
        let dims = grid.dims.map(|n| n + 2);
        Self { marks: vec![0; dims.iter().product()], dims }
    }

    pub(super) fn union_with(&mut self, other: &Self) {
        for (mark, other) in self.marks.iter_mut().zip(&other.marks) {
            *mark |= other;
        }
    }

    /// The marks of a floor cell's column, from the board up.
    pub(super) fn column(&self, cell_index: usize) -> &[u8] {
        let (depth, height) = (self.dims[1] - 2, self.dims[2] - 2);
        let (x, y) = (cell_index / depth + 1, cell_index % depth + 1);
        &self.marks[(x * self.dims[1] + y) * self.dims[2] + 1..][..height]
    }

    /// Marks the voxels that the segments cross.
    pub(super) fn add(&mut self, grid: &Grid, from: Point, segments: &[Segment; LANES]) {
        let strides = [(self.dims[1] * self.dims[2]) as i32, self.dims[2] as i32, 1];
        // A lane that does nothing marks voxel 0, in the margin.
        let mut index = [0_i32; LANES];
        let mut leave = [f32::NEG_INFINITY; LANES];
        let mut next = [[f32::INFINITY; LANES]; 3];
        let mut delta = [[0.0_f32; LANES]; 3];
        let mut step = [[0_i32; LANES]; 3];
        let per_voxel = 1.0 / grid.voxel_m;
        let offset = [0, 1, 2].map(|axis| (from[axis] - grid.origin[axis]) * per_voxel);
        for (lane, Segment { ray, end }) in segments.iter().enumerate() {
            // In voxels along each axis per unit of the ray's parameter.
            let pace = ray * per_voxel;
            let (mut enter, mut exit) = (0.0_f32, *end);
            let inverse = [0, 1, 2].map(|axis| 1.0 / pace[axis]);
            for axis in 0..3 {
                let size = grid.dims[axis] as f32;
                if pace[axis] == 0.0 {
                    if offset[axis] < 0.0 || offset[axis] >= size {
                        exit = f32::NEG_INFINITY;
                    }
                } else {
                    let (a, b) = (-offset[axis] * inverse[axis], (size - offset[axis]) * inverse[axis]);
                    enter = enter.max(a.min(b));
                    exit = exit.min(a.max(b));
                }
            }
            if enter.partial_cmp(&exit) != Some(std::cmp::Ordering::Less) {
                continue;
            }
            leave[lane] = exit;
            for axis in 0..3 {
                let cell = (offset[axis] + enter * pace[axis]).clamp(0.0, grid.dims[axis] as f32 - 1.0) as i32;
                index[lane] += (cell + 1) * strides[axis];
                if pace[axis] != 0.0 {
                    let forward = pace[axis] > 0.0;
                    step[axis][lane] = if forward { strides[axis] } else { -strides[axis] };
                    let boundary = (cell + i32::from(forward)) as f32;
                    next[axis][lane] = ((boundary - offset[axis]) * inverse[axis]).max(enter);
                    delta[axis][lane] = inverse[axis].abs();
                }
            }
        }
        loop {
            for at in index {
                self.marks[at as usize] = 1;
            }
            if !advance(&mut next, &delta, &mut index, &step, &leave) {
                return;
            }
        }
    }
}

/// Moves every lane that has not left yet over its nearest boundary; whether there was one. All in masks, so that it
/// becomes a few vector instructions.
#[inline(always)]
fn advance(
    next: &mut [[f32; LANES]; 3],
    delta: &[[f32; LANES]; 3],
    index: &mut [i32; LANES],
    step: &[[i32; LANES]; 3],
    leave: &[f32; LANES],
) -> bool {
    let mask = |yes: bool| if yes { u32::MAX } else { 0 };
    let least = |a: f32, b: f32| if a < b { a } else { b };
    let [next_x, next_y, next_z] = next;
    let mut along = [[0_u32; LANES]; 3];
    let mut any = 0;
    for lane in 0..LANES {
        let (x, y, z) = (next_x[lane], next_y[lane], next_z[lane]);
        let nearest = least(least(x, y), z);
        let goes = mask(nearest < leave[lane]);
        let along_x = mask(x == nearest) & goes;
        let along_y = mask(y == nearest) & goes & !along_x;
        along[0][lane] = along_x;
        along[1][lane] = along_y;
        along[2][lane] = goes & !along_x & !along_y;
        any |= goes;
    }
    for ((next, delta), along) in [next_x, next_y, next_z].into_iter().zip(delta).zip(&along) {
        for lane in 0..LANES {
            next[lane] += f32::from_bits(delta[lane].to_bits() & along[lane]);
        }
    }
    for (step, along) in step.iter().zip(&along) {
        for lane in 0..LANES {
            index[lane] += step[lane] & along[lane] as i32;
        }
    }
    any != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        /// The walk marks what the grid's traversal visits, up to clipped corners.
        #[test]
        fn the_walk_is_the_traversal(
            from in prop::array::uniform3(-0.3_f32..0.3), ray in prop::array::uniform3(-1.0_f32..1.0),
            flat in 0_usize..8, ends in prop::array::uniform8(-0.1_f32..1.5),
        ) {
            let grid = Grid::for_shelf([0.20, 0.15, 0.10], 0.005);
            let from = Point::from(from);
            let mut segments = [Segment::NOTHING; LANES];
            for (lane, (segment, end)) in segments.iter_mut().zip(ends).enumerate() {
                let mut ray = Vector::from(ray) + Vector::new(0.03, 0.02, -0.05) * lane as f32;
                if flat < 3 {
                    ray[flat] = 0.0;
                }
                if lane != flat {
                    *segment = Segment { ray, end };
                }
            }
            let mut seen = SeenThrough::nothing(&grid);
            seen.add(&grid, from, &segments);
            let (mut may, mut must) = (vec![false; grid.voxel_count()], vec![false; grid.voxel_count()]);
            for Segment { ray, end } in segments {
                // Rounding moves a boundary by a few hundredths of a millimetre along the ray at most.
                let slack = 5e-5 / ray.norm().max(0.05);
                for crossing in grid.traverse(from, ray, end) {
                    may[crossing.index] = true;
                    must[crossing.index] |= crossing.t_exit - crossing.t_enter > slack;
                }
                for shift in [[1, 1, 1], [1, 1, -1], [1, -1, 1], [1, -1, -1]].map(|s: [i8; 3]| s.map(f32::from)) {
                    for sign in [-2e-5, 2e-5] {
                        let beside = from + Vector::from(shift) * sign;
                        grid.traverse(beside, ray, end + slack).for_each(|crossing| may[crossing.index] = true);
                    }
                }
            }
            for index in 0..grid.voxel_count() {
                let (cell, z) = (index / grid.dims[2], index % grid.dims[2]);
                let marked = seen.column(cell)[z] == 1;
                prop_assert!(!must[index] || marked, "{:?} missed", grid.voxel(index));
                prop_assert!(!marked || may[index], "{:?} added", grid.voxel(index));
            }
        }
    }
}
