//! How far it is to the nearest voxel of a set: an exact Euclidean distance transform, capped.
//!
//! Distances are between voxel centres. One pass along each axis takes, per voxel, the smallest of the squared distances
//! around it; since nothing farther than the cap matters, each pass looks only that far, and 16-bit sums of whole rows
//! are as fast as the memory.

use crate::grid::{Grid, VoxelSet};
use rayon::prelude::*;

/// Distances above this many voxels are not distinguished.
const CAP: usize = 24;
const FAR: i16 = (CAP * CAP) as i16;

/// Distance from everywhere to the nearest voxel of a set, up to a cap of 24 voxels.
#[derive(Clone, Debug)]
pub struct DistanceField {
    grid: Grid,
    /// Squared distance per voxel, in voxels.
    squared: Vec<i16>,
    /// Distance in metres for each squared distance, less half a voxel: to the face, not to the centre.
    metres: Vec<f64>,
    empty: bool,
}

impl DistanceField {
    /// The field around `occupied`.
    pub fn new(grid: &Grid, occupied: &VoxelSet) -> Self {
        let [width, depth, height] = grid.dims;
        let mut along_z = vec![FAR; grid.voxel_count()];
        along_z.par_chunks_mut(height).enumerate().for_each(|(cell, column)| {
            let base = cell * height;
            let mut since = CAP;
            for (z, value) in column.iter_mut().enumerate() {
                since = if occupied.contains(base + z) { 0 } else { (since + 1).min(CAP) };
                *value = (since * since) as i16;
            }
            let mut since = CAP;
            for (z, value) in column.iter_mut().enumerate().rev() {
                since = if occupied.contains(base + z) { 0 } else { (since + 1).min(CAP) };
                *value = (*value).min((since * since) as i16);
            }
        });
        let slice = depth * height;
        let mut along_y = vec![FAR; grid.voxel_count()];
        along_y.par_chunks_mut(slice).zip(along_z.par_chunks(slice)).for_each(|(out, from)| {
            for (y, row) in from.chunks_exact(height).enumerate() {
                if row.iter().any(|v| *v < FAR) {
                    spread(row, y, out, height, depth);
                }
            }
        });
        let mut squared = along_z;
        squared.par_chunks_mut(slice).enumerate().for_each(|(x, out)| {
            out.fill(FAR);
            for other in x.saturating_sub(CAP - 1)..(x + CAP).min(width) {
                let add = other.abs_diff(x).pow(2) as i16;
                lower(out, &along_y[other * slice..(other + 1) * slice], add);
            }
        });
        let voxel_m = f64::from(grid.voxel_m);
        let metres = (0..=CAP * CAP).map(|squared| ((squared as f64).sqrt() - 0.5) * voxel_m).collect();
        Self { grid: *grid, squared, metres, empty: occupied.is_empty() }
    }

    /// The grid that it covers.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The largest distance that is distinguished, metres.
    pub fn cap_m(&self) -> f64 {
        self.metres[CAP * CAP]
    }

    /// A lower bound on the distance from `point` to the nearest voxel of the set, metres, up to [`DistanceField::cap_m`];
    /// at most one voxel's diagonal below the true distance inside the grid. Negative inside such a voxel.
    pub fn distance_m(&self, point: &nalgebra::Point3<f64>) -> f64 {
        if self.empty {
            return self.cap_m();
        }
        let voxel_m = f64::from(self.grid.voxel_m);
        let (mut index, mut outside) = (0, 0.0);
        for axis in 0..3 {
            let at = (point[axis] - f64::from(self.grid.origin[axis])) / voxel_m;
            let last = self.grid.dims[axis] as f64;
            let clamped = at.clamp(0.5, last - 0.5);
            if !(0.0..=last).contains(&at) {
                outside += (at - clamped) * (at - clamped);
            }
            index = index * self.grid.dims[axis] + clamped as usize;
        }
        let squared = self.squared[index];
        if outside == 0.0 {
            return self.metres[squared as usize];
        }
        // The nearest voxel is beyond the plane of the grid's side: both ways add up by Pythagoras.
        ((f64::from(squared) + outside).sqrt() - 0.5).min(CAP as f64 - 0.5) * voxel_m
    }
}

/// Lowers the rows around `y` to what the row at `y` allows.
fn spread(row: &[i16], y: usize, out: &mut [i16], height: usize, depth: usize) {
    for other in y.saturating_sub(CAP - 1)..(y + CAP).min(depth) {
        let add = other.abs_diff(y).pow(2) as i16;
        lower(&mut out[other * height..(other + 1) * height], row, add);
    }
}

fn lower(out: &mut [i16], from: &[i16], add: i16) {
    for (out, from) in out.iter_mut().zip(from) {
        *out = (*out).min(from + add);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::stream;
    use rand::Rng;

    #[test]
    fn it_agrees_with_looking_at_every_voxel() {
        let grid = Grid { voxel_m: 0.01, dims: [17, 31, 29], origin: [-0.085, 0.0, 0.0] };
        let mut rng = stream(5, "distance field", 0);
        let mut set = VoxelSet::empty(&grid);
        let chosen: Vec<usize> = (0..5).map(|_| rng.random_range(0..grid.voxel_count())).collect();
        chosen.iter().for_each(|&index| set.insert(index));
        let field = DistanceField::new(&grid, &set);
        for index in 0..grid.voxel_count() {
            let center = grid.center(grid.voxel(index));
            let nearest = chosen
                .iter()
                .map(|&other| f64::from((grid.center(grid.voxel(other)) - center).norm()))
                .fold(f64::INFINITY, f64::min);
            let expected = (nearest - 0.005).min(0.235);
            let got = field.distance_m(&center.map(f64::from));
            assert!((got - expected).abs() < 1e-5, "{center}: {got} {expected}");
        }
        // Before the grid it is a lower bound that is not far off.
        for _ in 0..200 {
            let point = nalgebra::Point3::new(
                rng.random_range(-0.2..0.2),
                rng.random_range(-0.1..0.5),
                rng.random_range(-0.1..0.4),
            );
            let nearest = chosen
                .iter()
                .map(|&other| (grid.center(grid.voxel(other)).map(f64::from) - point).norm())
                .fold(f64::INFINITY, f64::min);
            let expected = (nearest - 0.005).min(0.235);
            let got = field.distance_m(&point);
            assert!(got < expected + 0.0088 && got > 0.7 * expected - 0.01, "{point}: {got} {expected}");
        }
        assert_eq!(DistanceField::new(&grid, &VoxelSet::empty(&grid)).distance_m(&[0.0; 3].into()), field.cap_m());
    }
}
