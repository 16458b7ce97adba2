//! Maps in blocks of voxels, a byte each.

use super::state::BANDS;
use crate::belief::{Belief, Prediction, beta_mean, beta_variance};
use crate::grid::{Grid, VoxelSet};

/// Edge of a block, voxels.
pub(super) const BLOCK: usize = 2;
/// Edge of a coarse block on the floor, cells.
pub(super) const COARSE: usize = 4;

/// Numbers of blocks along x, y, z.
pub(super) fn dims(grid: &Grid) -> [usize; 3] {
    grid.dims.map(|n| n.div_ceil(BLOCK))
}

/// Numbers of coarse blocks along x and y.
pub(super) fn coarse_dims(grid: &Grid) -> [usize; 2] {
    [grid.dims[0].div_ceil(COARSE), grid.dims[1].div_ceil(COARSE)]
}

/// Calls `each` with the block of every voxel, in the grid's order.
fn for_each_voxel(grid: &Grid, mut each: impl FnMut(usize, usize)) {
    let [_, depth, height] = dims(grid);
    for cell in 0..grid.cell_count() {
        let (x, y) = (cell / grid.dims[1], cell % grid.dims[1]);
        let column = (x / BLOCK * depth + y / BLOCK) * height;
        for (level, voxel) in grid.column(cell).enumerate() {
            each(voxel, column + level / BLOCK);
        }
    }
}

/// The mean of a number over the voxels of every block.
fn mean(grid: &Grid, of: impl Fn(usize) -> f32) -> Vec<f32> {
    let count = dims(grid).iter().product();
    let (mut sums, mut counts) = (vec![0.0_f32; count], vec![0.0_f32; count]);
    for_each_voxel(grid, |voxel, block| {
        sums[block] += of(voxel);
        counts[block] += 1.0;
    });
    sums.iter().zip(&counts).map(|(sum, count)| sum / count).collect()
}

/// Occupancy probability of every block, in 255ths, and the standard deviation of its Beta, in 510ths (0.5 is the largest
/// that there is): means over its voxels.
pub(super) fn occupancy(belief: &Belief) -> [Vec<u8>; 2] {
    let byte =
        |values: Vec<f32>, scale: f32| values.iter().map(|v| (v * scale).round().clamp(0.0, 255.0) as u8).collect();
    let mean_p = mean(&belief.grid, |voxel| beta_mean(belief.occupancy[voxel]));
    let deviation = mean(&belief.grid, |voxel| beta_variance(belief.occupancy[voxel]).sqrt());
    [byte(mean_p, 255.0), byte(deviation, 510.0)]
}

/// How many voxels of every block are in a set.
pub(super) fn counts(grid: &Grid, set: &VoxelSet) -> Vec<u8> {
    let mut counts = vec![0; dims(grid).iter().product()];
    for_each_voxel(grid, |voxel, block| counts[block] += u8::from(set.contains(voxel)));
    counts
}

/// The blocks that hold a voxel of a set, a bit each, the first in the lowest bit.
pub(super) fn bits(grid: &Grid, set: &VoxelSet) -> Vec<u8> {
    let [_, depth, height] = dims(grid);
    let count: usize = dims(grid).iter().product();
    let mut bits = vec![0; count.div_ceil(8)];
    for voxel in set.iter() {
        let (cell, level) = (voxel / grid.dims[2], voxel % grid.dims[2]);
        let (x, y) = (cell / grid.dims[1], cell % grid.dims[1]);
        let block = (x / BLOCK * depth + y / BLOCK) * height + level / BLOCK;
        bits[block / 8] |= 1 << (block % 8);
    }
    bits
}

/// Per block of the floor, the largest probability that a push changes one of its cells, in 255ths.
pub(super) fn change(grid: &Grid, prediction: &Prediction) -> Vec<u8> {
    let [width, depth, _] = dims(grid);
    let mut change = vec![0; width * depth];
    for (cell, chance) in prediction.window.cells(grid).zip(&prediction.change) {
        let (x, y) = (cell / grid.dims[1], cell % grid.dims[1]);
        let block = x / BLOCK * depth + y / BLOCK;
        let chance = if chance.is_finite() { *chance } else { 0.5 };
        change[block] = change[block].max((chance * 255.0).round().clamp(0.0, 255.0) as u8);
    }
    change
}

/// Per coarse block of the floor and height band, how the mean occupancy probability is predicted to change, in 127ths.
pub(super) fn occupancy_change(belief: &Belief, prediction: &Prediction) -> Vec<i8> {
    let grid = &belief.grid;
    let [width, depth] = coarse_dims(grid);
    let height = grid.dims[2];
    let per_band = height.div_ceil(BANDS);
    let mut sums = vec![0.0_f32; width * depth * BANDS];
    for (at, cell) in prediction.window.cells(grid).enumerate() {
        let (x, y) = (cell / grid.dims[1], cell % grid.dims[1]);
        let column = (x / COARSE * depth + y / COARSE) * BANDS;
        for (level, voxel) in grid.column(cell).enumerate() {
            let after = beta_mean(prediction.occupancy[at * height + level]);
            sums[column + level / per_band] += after - beta_mean(belief.occupancy[voxel]);
        }
    }
    let voxels = (COARSE * COARSE * per_band) as f32;
    sums.iter().map(|sum| (sum / voxels * 127.0).round().clamp(-127.0, 127.0) as i8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Window;

    #[test]
    fn blocks_hold_means_counts_and_bits_of_their_voxels() {
        // 4 x 4 x 4 voxels: 2 x 2 x 2 blocks.
        let mut belief = Belief::uniform(Grid::for_shelf([0.02, 0.02, 0.02], 0.005));
        let grid = belief.grid;
        let at = |x: u16, y: u16, z: u16| grid.index(crate::grid::Voxel { x, y, z });
        belief.occupancy[at(0, 0, 3)] = [3.0, 1.0];
        let [p, deviation] = occupancy(&belief);
        // The block (0, 0, 1) holds it: (7 x 0.5 + 0.75) / 8.
        assert_eq!((p.len(), p[1], p[0]), (8, (255.0_f32 * 4.25 / 8.0).round() as u8, 128));
        assert_eq!(deviation[0], (510.0_f32 * (1.0_f32 / 12.0).sqrt()).round() as u8);
        let mut set = VoxelSet::empty(&grid);
        for voxel in [at(2, 1, 0), at(3, 0, 1), at(3, 3, 3)] {
            set.insert(voxel);
        }
        assert_eq!(counts(&grid, &set), [0, 0, 0, 0, 2, 0, 0, 1]);
        assert_eq!(bits(&grid, &set), [0b1001_0000]);
    }

    #[test]
    fn a_predicted_change_is_filed_where_it_is() {
        let belief = Belief::uniform(Grid::for_shelf([0.04, 0.02, 0.04], 0.005));
        // 8 x 4 cells of 8 levels; the window is the cell (5, 2) alone, and its lowest level is cleared for certain.
        let mut occupancy = vec![[1.0; 2]; 8];
        occupancy[0] = [0.0, 1.0];
        let prediction = Prediction {
            window: Window { x: [5, 6], y: [2, 3] },
            occupancy,
            semantics: vec![[1.0; crate::scene::CLASS_COUNT]],
            change: vec![0.4],
        };
        let grid = belief.grid;
        let of_floor = change(&grid, &prediction);
        assert_eq!(of_floor.iter().enumerate().filter(|(_, c)| **c != 0).collect::<Vec<_>>(), [(5, &102)]);
        let of_bands = occupancy_change(&belief, &prediction);
        // Coarse block (1, 0), lowest band: minus a half in one of 16 cells.
        let changed: Vec<_> = of_bands.iter().enumerate().filter(|(_, c)| **c != 0).collect();
        assert_eq!(changed, [(BANDS, &-4)]);
    }
}
