//! Augmentation: a scene shifted and turned a little on its board, truth and observations alike.

use crate::camera::MapObservation;
use crate::grid::{Grid, VoxelSet};
use crate::learn::{MapSample, ViewSample};
use rand::Rng;

/// Farthest shift along x and along y, metres.
const SHIFT_M: [f32; 2] = [0.04, 0.02];
/// Largest turn about the middle of the board, degrees.
const TURN_DEG: f32 = 8.0;

/// Where the column of voxels above every floor cell comes from.
///
/// Whole columns move, so what was seen of a column stays what was seen of it. What comes from beyond the board's edge is
/// what stands at the edge, so that no column is without truth.
#[derive(Debug)]
pub(super) struct Moved {
    sources: Vec<usize>,
    height: usize,
}

impl Moved {
    /// A random small shift and turn.
    pub(super) fn random(grid: &Grid, rng: &mut impl Rng) -> Self {
        let shift_m = SHIFT_M.map(|most| rng.random_range(-most..=most));
        Self::by(grid, shift_m, rng.random_range(-TURN_DEG..=TURN_DEG))
    }

    /// A shift, then a turn counter-clockwise about the middle of the board.
    fn by(grid: &Grid, shift_m: [f32; 2], turn_deg: f32) -> Self {
        let [width, depth, height] = grid.dims;
        let (sin, cos) = turn_deg.to_radians().sin_cos();
        let middle = [width, depth].map(|cells| 0.5 * (cells as f32 - 1.0));
        let shift = shift_m.map(|metres| metres / grid.voxel_m);
        let nearest = |at: f32, cells: usize| at.round().clamp(0.0, cells as f32 - 1.0) as usize;
        let source = |cell: usize| {
            let (x, y) = ((cell / depth) as f32 - middle[0], (cell % depth) as f32 - middle[1]);
            let from = [cos * x + sin * y - shift[0], cos * y - sin * x - shift[1]];
            nearest(from[0] + middle[0], width) * depth + nearest(from[1] + middle[1], depth)
        };
        Self { sources: (0..grid.cell_count()).map(source).collect(), height }
    }

    /// The sample, moved.
    pub(super) fn sample(&self, sample: &MapSample) -> MapSample {
        let view = |seen: &ViewSample| ViewSample { view: seen.view, observation: self.observation(&seen.observation) };
        MapSample {
            seed: sample.seed,
            truth: self.voxels(&sample.truth),
            labels: self.cells(&sample.labels),
            views: sample.views.iter().map(view).collect(),
        }
    }

    fn observation(&self, seen: &MapObservation) -> MapObservation {
        MapObservation {
            free: self.voxels(&seen.free),
            occupied: self.voxels(&seen.occupied),
            labels: self.cells(&seen.labels),
        }
    }

    fn voxels(&self, set: &VoxelSet) -> VoxelSet {
        set.with_columns_of(self.height, &self.sources)
    }

    fn cells(&self, labels: &[u8]) -> Vec<u8> {
        self.sources.iter().map(|&cell| labels[cell]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{UNOBSERVED, ViewId};
    use crate::grid::Cell;

    /// A post of two cells by two at `[x, y]`, seen as high as it is.
    fn sample(grid: &Grid, [x, y]: [u16; 2]) -> MapSample {
        let mut truth = VoxelSet::empty(grid);
        let mut labels = vec![14; grid.cell_count()];
        for (x, y) in [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)] {
            let cell = grid.cell_index(Cell { x, y });
            labels[cell] = 3;
            grid.column(cell).take(7).for_each(|voxel| truth.insert(voxel));
        }
        let mut seen = vec![UNOBSERVED; grid.cell_count()];
        seen.iter_mut().zip(&labels).filter(|(_, label)| **label == 3).for_each(|(seen, _)| *seen = 3);
        let observation = MapObservation { free: VoxelSet::empty(grid), occupied: truth.clone(), labels: seen };
        MapSample { seed: 1, truth, labels, views: vec![ViewSample { view: ViewId(0), observation }] }
    }

    #[test]
    fn a_scene_moves_as_a_whole() {
        let grid = Grid::for_shelf([0.8, 0.4, 0.4], 0.005);
        let at = |x, y| sample(&grid, [x, y]);
        let moved = |shift_m, turn_deg, x, y| Moved::by(&grid, shift_m, turn_deg).sample(&at(x, y));
        assert_eq!(moved([0.0; 2], 0.0, 100, 30), at(100, 30));
        assert_eq!(moved([0.04, -0.02], 0.0, 100, 30), at(108, 26));
        // A quarter turn: a post in the middle stays, one 30 cells to the right of it comes to 30 cells behind it.
        assert_eq!(moved([0.0; 2], 90.0, 79, 39), at(79, 39));
        assert_eq!(moved([0.0; 2], 90.0, 109, 39), at(79, 69));
        assert_eq!(moved([0.0; 2], 90.0, 79, 69), at(49, 39));
        // What is pushed over the edge is gone, and the edge's column stands in for what comes from beyond it.
        assert_eq!(moved([0.04, 0.0], 0.0, 157, 10).truth.len(), 0);
        assert_eq!(moved([0.04, 0.0], 0.0, 0, 10).truth.len(), 2 * 10 * 7);
    }

    #[test]
    fn random_moves_are_small_and_differ() {
        let grid = Grid::for_shelf([0.8, 0.4, 0.4], 0.005);
        let mut rng = crate::rng::stream(1, "moves", 0);
        let moves: Vec<Moved> = (0..50).map(|_| Moved::random(&grid, &mut rng)).collect();
        let middle = grid.cell_index(Cell { x: 80, y: 40 });
        let farthest = |moved: &Moved| {
            let from = grid.cell_center(grid.cell(moved.sources[middle]));
            (from - grid.cell_center(grid.cell(middle))).norm()
        };
        assert!(moves.iter().all(|moved| farthest(moved) < 0.055));
        assert!(moves.iter().any(|moved| farthest(moved) > 0.02));
        assert!(moves.windows(2).all(|pair| pair[0].sources != pair[1].sources));
    }
}
