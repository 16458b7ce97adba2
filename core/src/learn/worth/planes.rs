//! Floor-plan planes of a state and of a push: what a network that values pushes may be shown.
//!
//! A plane has a number per block of 2 x 2 floor cells (1 cm; 80 x 40 in the usual shelf), or per 4 x 4 (2 cm; 40 x 20), in
//! `[x][y]` order. What has a height is split into [`BANDS`] bands of an eighth of the shelf's height, lowest first, each the mean
//! over its blocks. All values are within -1 to 1.
//!
//! | planes | of | value |
//! |---|---|---|
//! | occupancy, 8 | state | mean occupancy probability |
//! | deviation, 8 | state | mean standard deviation of the Betas, twice |
//! | seen, 8 | state | share of voxels that looks have seen |
//! | closed, 8 | state | share of voxels that no view reaches through the likeliest map: only a push can show them |
//! | certainty, entropy, vacuity | state | of the classes, shares of their largest values |
//! | tall | state | height of the largest occupied block of each column (`p` of half or more), share of the shelf's |
//! | swept, 8 | push | share of blocks that arm and gripper touch |
//! | change | push | sigma_m's probability of change |
//! | moved, 8 | push | sigma_m's change of mean occupancy |
//! | along, across | push | place relative to the push: along it from its start, and to its left, in units of 0.2 m, cut at 1 |
//! | contact | push | `exp(-(d / 2 cm)^2)` of the distance to the contact |

use super::blocks::{BLOCK, COARSE, coarse_dims, dims};
use super::state::{BANDS, WorthPush, WorthState};
use crate::grid::Grid;

/// Edge of a cell of the planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneScale {
    /// 2 x 2 floor cells.
    Fine,
    /// 4 x 4 floor cells.
    Coarse,
}

/// Planes one after the other, each `[x][y]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    /// Numbers of cells along x and y.
    pub size: [usize; 2],
    /// The values, plane by plane.
    pub values: Vec<f32>,
}

/// Planes of a state.
pub const STATE_PLANES: usize = 4 * BANDS + 4;
/// Planes of a push.
pub const PUSH_PLANES: usize = 2 * BANDS + 4;
/// Unit of the places relative to a push, metres.
const PLACE_M: f32 = 0.2;
/// Spread of a contact, metres.
const CONTACT_M: f32 = 0.02;

impl Planes {
    fn empty(grid: &Grid) -> Self {
        let [width, depth, _] = dims(grid);
        Self { size: [width, depth], values: Vec::new() }
    }

    /// Number of planes.
    pub fn count(&self) -> usize {
        self.values.len() / (self.size[0] * self.size[1])
    }

    /// Adds a plane of a value per cell.
    fn plane(&mut self, of: impl Fn([usize; 2]) -> f32) {
        let [width, depth] = self.size;
        self.values.extend((0..width * depth).map(|cell| of([cell / depth, cell % depth])));
    }

    /// Adds a plane per height band, each the mean of a value per block.
    fn bands(&mut self, grid: &Grid, of: impl Fn(usize) -> f32) {
        let [_, depth, height] = dims(grid);
        let per_band = height.div_ceil(BANDS);
        for band in 0..BANDS {
            let levels = (band * per_band).min(height)..((band + 1) * per_band).min(height);
            let count = levels.len().max(1) as f32;
            self.plane(|[x, y]| levels.clone().map(|level| of((x * depth + y) * height + level)).sum::<f32>() / count);
        }
    }

    /// Adds a plane of the mean of a value per floor cell.
    fn floor(&mut self, grid: &Grid, of: impl Fn(usize) -> f32) {
        let [width, depth, _] = grid.dims;
        self.plane(|[x, y]| {
            let [xs, ys] = [x * BLOCK..((x + 1) * BLOCK).min(width), y * BLOCK..((y + 1) * BLOCK).min(depth)];
            let count = (xs.len() * ys.len()).max(1) as f32;
            xs.flat_map(|x| ys.clone().map(move |y| x * depth + y)).map(&of).sum::<f32>() / count
        });
    }

    /// The same at a scale.
    pub fn at(self, scale: PlaneScale) -> Self {
        match scale {
            PlaneScale::Fine => self,
            PlaneScale::Coarse => self.halved(),
        }
    }

    /// Means over 2 x 2 cells.
    fn halved(self) -> Self {
        let [width, depth] = self.size;
        let size = [width.div_ceil(2), depth.div_ceil(2)];
        let mut values = Vec::with_capacity(self.values.len().div_ceil(4));
        for plane in self.values.chunks_exact(width * depth) {
            for cell in 0..size[0] * size[1] {
                let (x, y) = (cell / size[1] * 2, cell % size[1] * 2);
                let [xs, ys] = [x..(x + 2).min(width), y..(y + 2).min(depth)];
                let count = (xs.len() * ys.len()) as f32;
                let sum: f32 = xs.flat_map(|x| ys.clone().map(move |y| x * depth + y)).map(|at| plane[at]).sum();
                values.push(sum / count);
            }
        }
        Self { size, values }
    }
}

/// The planes of a state, [`STATE_PLANES`] of them.
pub fn state_planes(grid: &Grid, state: &WorthState, scale: PlaneScale) -> Planes {
    let mut planes = Planes::empty(grid);
    let (map, floor) = (&state.map, &state.floor);
    let voxels = BLOCK.pow(3) as f32;
    let share = |byte: u8| f32::from(byte) / 255.0;
    planes.bands(grid, |block| share(map.occupancy[block]));
    planes.bands(grid, |block| share(map.deviation[block]));
    planes.bands(grid, |block| f32::from(map.seen[block]) / voxels);
    planes.bands(grid, |block| 1.0 - f32::from(map.reached[block]) / voxels);
    for facts in [&floor.certainty, &floor.entropy, &floor.vacuity] {
        planes.floor(grid, |cell| share(facts[cell]));
    }
    let [_, depth, height] = dims(grid);
    planes.plane(|[x, y]| {
        let column = &map.occupancy[(x * depth + y) * height..][..height];
        column.iter().rposition(|p| *p >= 128).map_or(0.0, |top| (top + 1) as f32 / height as f32)
    });
    planes.at(scale)
}

/// The planes of a push, [`PUSH_PLANES`] of them.
pub fn push_planes(grid: &Grid, push: &WorthPush, scale: PlaneScale) -> Planes {
    let mut planes = Planes::empty(grid);
    let [_, depth, _] = dims(grid);
    planes.bands(grid, |block| f32::from(push.swept[block / 8] >> (block % 8) & 1));
    planes.plane(|[x, y]| f32::from(push.promise.change[x * depth + y]) / 255.0);
    let [_, coarse_depth] = coarse_dims(grid);
    for band in 0..BANDS {
        planes.plane(|[x, y]| {
            let [u, v] = [x, y].map(|at| at * BLOCK / COARSE);
            f32::from(push.promise.occupancy[(u * coarse_depth + v) * BANDS + band]) / 127.0
        });
    }
    let edge_m = BLOCK as f32 * grid.voxel_m;
    let place = |[x, y]: [usize; 2]| [0, 1].map(|axis| grid.origin[axis] + ([x, y][axis] as f32 + 0.5) * edge_m);
    let (sin, cos) = push.push.direction_deg.to_radians().sin_cos();
    let from_start = |cell: [usize; 2]| {
        let [x, y] = place(cell);
        [x - push.push.start[0], y - push.push.start[1]]
    };
    let unit = |m: f32| (m / PLACE_M).clamp(-1.0, 1.0);
    planes.plane(|cell| {
        let [x, y] = from_start(cell);
        unit(x * cos + y * sin)
    });
    planes.plane(|cell| {
        let [x, y] = from_start(cell);
        unit(y * cos - x * sin)
    });
    let contact = grid.center(push.contact);
    planes.plane(|cell| {
        let [x, y] = place(cell);
        (-((x - contact.x).powi(2) + (y - contact.y).powi(2)) / CONTACT_M.powi(2)).exp()
    });
    planes.at(scale)
}
