//! Gain by coverage: each voxel counts once, however many rays of a view meet it.
//!
//! `IG(v) = sum_b U_b T_b(v)` over cubes `b` of edge [`CELL_M`], about the distance between neighbouring rays of a
//! view: `U_b` is the entropy of the voxels in it that no look has seen, and `T_b(v)` the largest transmittance with
//! which any ray of the view arrives at one of them. Two views together have `sum_b U_b max(T_b(v), T_b(w))`, a
//! facility-location function: monotone and submodular, so that the greedy choice is within 1 - 1/e of the best.
//!
//! Summed over rays ([`super::gain_of_views`]) a voxel counts once for every ray that meets it, so near voxels count
//! many times. After the first look, the order of views by that sum agrees with what real looks bring no better than
//! chance (RESULTS.md).

use super::pair::ViewPair;
use super::ray::{Camera, Tally};
use super::{GainField, RayDensity};
use crate::camera::{ViewArray, ViewId};
use rayon::prelude::*;

/// Edge of the cubes that are counted as one, m.
pub const CELL_M: f32 = 0.015;

/// The cubes that each of some views covers under one field.
pub struct Coverage<'a> {
    field: &'a GainField,
    /// Number of the cell by position in the padded grid: 0 where it holds nothing unseen, and outside.
    cells: Vec<u32>,
    /// `U_b` by cell, nats; nothing in the first.
    unseen: Vec<f32>,
    /// `T_b` by view, in the order of the ids, and cell.
    reached: Vec<Vec<f32>>,
    ids: Vec<ViewId>,
}

impl<'a> Coverage<'a> {
    /// Walks the rays of the given views. Parallel over views; the result does not depend on the number of threads.
    pub fn new(field: &'a GainField, array: &ViewArray, ids: &[ViewId], density: RayDensity) -> Self {
        let (cells, unseen) = numbered(field);
        let reach = |&id: &ViewId| {
            let mut tally = Reach { cells: &cells, reached: vec![0.0; unseen.len()] };
            Camera::of(field, array, id).for_each_ray(field, density, |_, ray| ray.walk(field, &mut tally));
            tally.reached
        };
        let reached = ids.par_iter().map(reach).collect();
        Self { field, cells, unseen, reached, ids: ids.to_vec() }
    }

    /// Gain of every view, nats, in the order of the ids.
    pub fn gains(&self) -> Vec<f32> {
        self.reached.par_iter().map(|reached| self.sum(|cell| reached[cell])).collect()
    }

    /// The greedy best pair of the views that are offered; `None` where none of them gains anything. `gains` are
    /// [`Coverage::gains`]. The first of equals wins.
    pub fn best_pair(&self, gains: &[f32], offered: impl Fn(&ViewId) -> bool) -> Option<ViewPair> {
        let open: Vec<usize> = (0..self.ids.len()).filter(|&at| offered(&self.ids[at])).collect();
        let best = |gains: Vec<(usize, f32)>| {
            gains.into_iter().filter(|(_, gain)| *gain > 0.0).reduce(|best, at| if at.1 > best.1 { at } else { best })
        };
        let (first, first_gain) = best(open.iter().map(|&at| (at, gains[at])).collect())?;
        let before = &self.reached[first];
        let beyond = |at: usize| self.sum(|cell| (self.reached[at][cell] - before[cell]).max(0.0));
        let second = best(open.par_iter().map(|&at| (at, beyond(at))).collect());
        Some(ViewPair {
            first: self.ids[first],
            first_gain,
            second: second.map(|(at, _)| self.ids[at]),
            second_gain: second.map_or(0.0, |(_, gain)| gain),
        })
    }

    /// Where the gain of the view at position `at` of the ids comes from: voxel positions and their nats, in ascending
    /// order of position.
    pub fn per_voxel(&self, at: usize) -> Vec<(usize, f32)> {
        let nats = |voxel: usize| {
            let padded = self.field.layout.padded(voxel);
            self.field.unseen_information(padded) * self.reached[at][self.cells[padded] as usize]
        };
        let voxels = (0..self.field.grid().voxel_count()).map(|voxel| (voxel, nats(voxel)));
        voxels.filter(|(_, nats)| *nats > 0.0).collect()
    }

    /// Sum over the cells of what is unseen in them, by shares of it.
    fn sum(&self, share: impl Fn(usize) -> f32) -> f32 {
        self.unseen.iter().enumerate().map(|(cell, nats)| f64::from(nats * share(cell))).sum::<f64>() as f32
    }
}

/// Numbers the cells that hold something unseen, by position in the padded grid, from 1 on, and tells what is unseen in each.
fn numbered(field: &GainField) -> (Vec<u32>, Vec<f32>) {
    let grid = field.grid();
    let voxels = (CELL_M / grid.voxel_m).round().max(1.0) as usize;
    let along = grid.dims.map(|dim| dim.div_ceil(voxels));
    let cube = |voxel: usize| {
        let at = grid.voxel(voxel);
        let [x, y, z] = [at.x, at.y, at.z].map(|at| usize::from(at) / voxels);
        (x * along[1] + y) * along[2] + z
    };
    let mut nats = vec![0.0_f32; along.iter().product()];
    for voxel in 0..grid.voxel_count() {
        nats[cube(voxel)] += field.unseen_information(field.layout.padded(voxel));
    }
    let mut unseen = vec![0.0];
    let number = |nats: &f32| {
        if *nats <= 0.0 {
            return 0;
        }
        unseen.push(*nats);
        unseen.len() as u32 - 1
    };
    let numbers: Vec<u32> = nats.iter().map(number).collect();
    let mut cells = vec![0; field.codes.len()];
    for voxel in 0..grid.voxel_count() {
        cells[field.layout.padded(voxel)] = numbers[cube(voxel)];
    }
    (cells, unseen)
}

/// The largest transmittance with which a ray arrives in every cell.
struct Reach<'a> {
    cells: &'a [u32],
    reached: Vec<f32>,
}

impl Tally for Reach<'_> {
    #[inline(always)]
    fn visit(&mut self, index: usize, _information: f32, transmittance: f32) {
        let reached = &mut self.reached[self.cells[index] as usize];
        *reached = reached.max(transmittance);
    }
}

#[cfg(test)]
mod tests {
    use super::super::arrivals;
    use super::super::tests::support::{exactly, facing, patchy, small_grid, standard};
    use super::*;
    use crate::belief::bernoulli_entropy;
    use crate::grid::{Grid, VoxelSet};

    const EVERY: RayDensity = RayDensity { stride_px: 1 };

    /// Every third voxel.
    fn some(grid: &Grid) -> VoxelSet {
        let mut seen = VoxelSet::empty(grid);
        (0..grid.voxel_count()).step_by(3).for_each(|voxel| seen.insert(voxel));
        seen
    }

    #[test]
    fn a_voxel_counts_once_and_what_is_seen_not_at_all() {
        // One voxel of 0.1 m deep, wide and high after the other, and a camera of 9 rays in front of them.
        let grid = Grid::for_shelf([0.1, 0.3, 0.1], 0.1);
        let p = [0.3, 0.5, 0.2];
        let field = GainField::new(&exactly(grid, |voxel| p[usize::from(voxel.y)]));
        let mut array = facing([0.0, -0.3, 0.05]);
        (array.intrinsics.width, array.intrinsics.height) = (3, 3);
        let gain = |field: &GainField| Coverage::new(field, &array, &[ViewId(0)], EVERY).gains()[0];
        let near = |value: f32, expected: f32| assert!((value - expected).abs() < 0.01, "{value} is not {expected}");
        let [h0, h1, h2] = p.map(bernoulli_entropy);
        near(gain(&field), h0 + 0.7 * h1 + 0.35 * h2);
        let mut seen = VoxelSet::empty(&grid);
        seen.insert(1);
        // It still takes its share of the rays.
        near(gain(&field.with_seen(&seen)), h0 + 0.35 * h2);
        near(super::super::gain_of_views(&field, &array, &[ViewId(0)], EVERY)[0], 9.0 * (h0 + 0.7 * h1 + 0.35 * h2));
    }

    #[test]
    fn a_cell_is_reached_where_any_of_its_voxels_is() {
        // Voxels of 7.5 mm, 8 to a cell, the ray along one line of them; half of it passes the nearer cell.
        let grid = Grid::for_shelf([0.015, 0.03, 0.015], 0.0075);
        assert_eq!(grid.dims, [2, 4, 2]);
        let p = [0.5, 0.01, 0.5, 0.5];
        let field = GainField::new(&exactly(grid, |voxel| p[usize::from(voxel.y)]));
        let array = facing([-0.00375, -0.3, 0.00375]);
        let coverage = Coverage::new(&field, &array, &[ViewId(0)], EVERY);
        let h = bernoulli_entropy(0.5);
        assert!((coverage.gains()[0] - (4.0 * h + 0.5 * 8.0 * h)).abs() < 0.01, "{}", coverage.gains()[0]);
        let parts = coverage.per_voxel(0);
        assert_eq!(parts.len(), 12, "not those believed to be free");
        assert!(parts.iter().all(|(voxel, nats)| {
            let share = if grid.voxel(*voxel).y < 2 { 1.0 } else { 0.5 };
            (nats - share * h).abs() < 1e-3
        }));
    }

    #[test]
    fn gains_and_pairs_are_those_of_the_definition() {
        let (grid, array) = (small_grid(), standard());
        let ids: Vec<ViewId> = (0..300).step_by(17).map(ViewId).collect();
        for seed in 0..6 {
            let field = GainField::new(&patchy(grid, seed)).with_seen(&some(&grid));
            let coverage = Coverage::new(&field, &array, &ids, RayDensity::COARSE);
            // A voxel of 2 cm is a cell of its own.
            let reached: Vec<Vec<f32>> =
                ids.iter().map(|&id| arrivals(&field, &array, id, RayDensity::COARSE)).collect();
            let sum = |share: &dyn Fn(usize) -> f32| -> f64 {
                (0..field.codes.len()).map(|at| f64::from(field.unseen_information(at) * share(at))).sum()
            };
            let close = |a: f32, b: f64| assert!((f64::from(a) - b).abs() < 1e-4 * (1.0 + b), "{a} is not {b}");
            let gains = coverage.gains();
            for (at, gain) in gains.iter().enumerate() {
                close(*gain, sum(&|voxel| reached[at][voxel]));
                close(coverage.per_voxel(at).iter().map(|part| part.1).sum(), f64::from(*gain));
            }
            // The best of the views that are offered, then the one that adds most to it.
            let first = (0..ids.len()).max_by(|&a, &b| gains[a].total_cmp(&gains[b])).expect("views");
            for used in [None, Some(ids[first])] {
                let pair = coverage.best_pair(&gains, |view| Some(*view) != used).expect("a pair");
                let at = |view: ViewId| ids.iter().position(|id| *id == view).expect("one of them");
                let offered = || (0..ids.len()).filter(|&at| Some(ids[at]) != used);
                assert!(offered().all(|at| gains[at] <= pair.first_gain) && Some(pair.first) != used);
                assert_eq!(pair.first_gain, gains[at(pair.first)]);
                let first = &reached[at(pair.first)];
                let both = |at: usize| sum(&|voxel| reached[at][voxel].max(first[voxel]));
                let most = offered().map(both).fold(0.0, f64::max);
                close(pair.total(), both(at(pair.second.expect("a second view"))));
                close(pair.total(), most);
            }
            assert!(coverage.best_pair(&gains, |_| false).is_none());
        }
    }

    #[test]
    fn where_all_is_seen_no_view_gains() {
        let (grid, array) = (small_grid(), standard());
        let mut all = VoxelSet::empty(&grid);
        (0..grid.voxel_count()).for_each(|voxel| all.insert(voxel));
        let field = GainField::new(&patchy(grid, 1)).with_seen(&all);
        let coverage = Coverage::new(&field, &array, &[ViewId(3), ViewId(150)], RayDensity::COARSE);
        assert_eq!(coverage.gains(), [0.0, 0.0]);
        assert!(coverage.best_pair(&[0.0, 0.0], |_| true).is_none() && coverage.per_voxel(0).is_empty());
    }

    #[test]
    fn the_number_of_threads_changes_no_digit() {
        let (grid, array) = (small_grid(), standard());
        let ids: Vec<ViewId> = (0..300).map(ViewId).collect();
        let all = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| {
                let field = GainField::new(&patchy(grid, 8)).with_seen(&some(&grid));
                let coverage = Coverage::new(&field, &array, &ids, RayDensity::COARSE);
                let gains = coverage.gains();
                let pair = coverage.best_pair(&gains, |_| true);
                (gains, pair)
            })
        };
        assert_eq!(all(1), all(3));
    }
}
