//! Contacts before unseen space: pushes against the front or the sides of what stands before it.

use super::{CONFIDENT, LENGTH_M, STANDOFF_M, TOOL_HEIGHT_M};
use crate::belief::{Belief, bernoulli_entropy};
use crate::grid::{Cell, Grid, Voxel, VoxelSet};
use crate::rng::ChaCha8Rng;
use crate::skill::Push;
use rand::Rng;

/// How far above and below the tip something must stand to be met by it, metres.
const BAND_M: f32 = 0.02;
/// How far to either side of a contact the space behind it counts, metres.
const SHADOW_M: f32 = 0.04;
/// Directions of a push, degrees: from across and a little back, over straight in, to across the other way.
const DIRECTIONS_DEG: [f32; 2] = [-20.0, 200.0];
/// Directions that are tried at a contact.
const TRIES: usize = 12;
/// What a contact with nothing hidden behind it weighs, as a share of the mean weight.
const LEAST: f64 = 0.05;
/// Places between the tip's start and the contact that must be clear.
const CLEAR_STEPS: u8 = 4;

/// The floor cells at the rim of what surely stands at the tip's height; each is drawn with a probability proportional
/// to the unseen space behind it.
pub(super) struct Contacts {
    grid: Grid,
    /// Per floor cell whether something stands there at the tip's height.
    solid: Vec<bool>,
    cells: Vec<usize>,
    /// Sum of the weights up to each of `cells`, its own included.
    sums: Vec<f64>,
}

impl Contacts {
    /// Those of a belief. Hidden is what no look has `seen`, each voxel by its entropy.
    pub(super) fn new(belief: &Belief, seen: Option<&VoxelSet>) -> Self {
        let grid = belief.grid;
        let [width, depth, height] = grid.dims;
        let [low, high] =
            [-BAND_M, BAND_M].map(|off| (((TOOL_HEIGHT_M + off) / grid.voxel_m) as usize).min(height - 1));
        let stands = |cell: usize| {
            let column = &belief.occupancy[grid.column(cell)][low..=high];
            column.iter().any(|&[occupied, free]| occupied >= CONFIDENT * (occupied + free))
        };
        let solid: Vec<bool> = (0..grid.cell_count()).map(stands).collect();
        let is_rim = |cell: usize| {
            let (x, y) = (cell / depth, cell % depth);
            let edge = x == 0 || x + 1 == width || y == 0;
            edge || !solid[cell - depth] || !solid[cell + depth] || !solid[cell - 1]
        };
        let cells: Vec<usize> = (0..grid.cell_count()).filter(|&cell| solid[cell] && is_rim(cell)).collect();

        // What is hidden behind every cell in its own line, then over some lines to either side.
        let hidden = |cell: usize| -> f64 {
            let unseen = grid.column(cell).filter(|voxel| seen.is_none_or(|seen| !seen.contains(*voxel)));
            unseen.map(|voxel| f64::from(bernoulli_entropy(belief.probability(voxel)))).sum()
        };
        let mut behind = vec![0.0; grid.cell_count()];
        for line in 0..width {
            for cell in (line * depth..(line + 1) * depth - 1).rev() {
                behind[cell] = behind[cell + 1] + hidden(cell + 1);
            }
        }
        let reach = (SHADOW_M / grid.voxel_m) as usize;
        let weight = |cell: usize| -> f64 {
            let (x, y) = (cell / depth, cell % depth);
            (x.saturating_sub(reach)..(x + reach + 1).min(width)).map(|x| behind[x * depth + y]).sum()
        };
        let weights: Vec<f64> = cells.iter().map(|&cell| weight(cell)).collect();
        let least = (LEAST * weights.iter().sum::<f64>() / weights.len().max(1) as f64).max(f64::MIN_POSITIVE);
        let add = |sum: &mut f64, weight: f64| {
            *sum += weight + least;
            Some(*sum)
        };
        let sums = weights.into_iter().scan(0.0, add).collect();
        Self { grid, solid, cells, sums }
    }

    /// Whether there is nothing to touch.
    pub(super) fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// A contact and a push against it; no push where no direction tried has room for the tip before the contact.
    pub(super) fn draw(&self, rng: &mut ChaCha8Rng) -> (Voxel, Option<Push>) {
        let at = rng.random::<f64>() * self.sums.last().copied().unwrap_or(0.0);
        let cell = self.cells[self.sums.partition_point(|sum| *sum < at).min(self.cells.len() - 1)];
        let length_m = rng.random_range(LENGTH_M[0]..LENGTH_M[1]);
        let Cell { x, y } = self.grid.cell(cell);
        let contact = Voxel { x, y, z: (TOOL_HEIGHT_M / self.grid.voxel_m) as u16 };
        let mut directions = (0..TRIES).map(|_| rng.random_range(DIRECTIONS_DEG[0]..DIRECTIONS_DEG[1]));
        let direction_deg = directions.find(|direction_deg| self.has_room(contact, *direction_deg));
        let point = self.grid.center(contact);
        let push = |direction_deg: f32| {
            let (sin, cos) = direction_deg.to_radians().sin_cos();
            let z = self.grid.origin[2] + TOOL_HEIGHT_M;
            Push { start: [point.x - cos * STANDOFF_M, point.y - sin * STANDOFF_M, z], direction_deg, length_m }
        };
        (contact, direction_deg.map(push))
    }

    /// Whether nothing stands between the tip's start and the contact.
    fn has_room(&self, contact: Voxel, direction_deg: f32) -> bool {
        let point = self.grid.center(contact);
        let (sin, cos) = direction_deg.to_radians().sin_cos();
        (1..=CLEAR_STEPS).all(|step| {
            let back = 0.5 * self.grid.voxel_m + STANDOFF_M * f32::from(step) / f32::from(CLEAR_STEPS);
            let at = [point.x - cos * back, point.y - sin * back, point.z];
            match self.grid.cell_at(at.into()) {
                Some(cell) => !self.solid[self.grid.cell_index(cell)],
                // Before the shelf there is room, beside it there is none.
                None => at[1] < self.grid.origin[1],
            }
        })
    }
}
