//! Room for an object in hand: straight out of the shelf, and where it can be set down.

use crate::belief::Patch;
use crate::grid::Grid;
use crate::skill::Rejection;

/// How far an object that is carried is lifted, metres.
pub const LIFT_M: f32 = 0.01;
/// Room that is kept around a place and on the way to it, metres.
const MARGIN_M: f32 = 0.01;
/// Distance of the places that are tried, metres.
const STEP_M: f32 = 0.01;
/// Places that are offered for one object, and how far apart they are, metres.
const PLACES: usize = 3;
const APART_M: f32 = 0.10;

/// What is in the shelf, by voxel.
#[derive(Clone, Copy)]
pub struct Room<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// Whether something may stand in a voxel that an object must not be carried through.
    pub blocks: &'a dyn Fn(usize) -> bool,
    /// Whether an object must not be set down in a voxel.
    pub is_taken: &'a dyn Fn(usize) -> bool,
    /// Whether nobody knows what is in a voxel.
    pub is_unknown: &'a dyn Fn(usize) -> bool,
}

/// An object's outline in cells: columns from `x[0]` to `x[1]`, rows from `y[0]` to `y[1]`, both ends included, and its height
/// in levels.
#[derive(Clone, Copy)]
pub struct Extent {
    pub x: [usize; 2],
    pub y: [usize; 2],
    pub levels: usize,
}

impl Room<'_> {
    /// The outline of an object.
    pub fn extent(&self, target: &Patch) -> Extent {
        let depth = self.grid.dims[1];
        let mut extent = Extent { x: [usize::MAX, 0], y: [usize::MAX, 0], levels: 0 };
        for &cell in target.cells() {
            let (x, y) = (cell / depth, cell % depth);
            extent.x = [extent.x[0].min(x), extent.x[1].max(x)];
            extent.y = [extent.y[0].min(y), extent.y[1].max(y)];
            let top = self.grid.column(cell).rposition(|voxel| (self.blocks)(voxel)).map_or(0, |level| level + 1);
            extent.levels = extent.levels.max(top);
        }
        extent
    }

    fn lift(&self) -> usize {
        self.cells(LIFT_M)
    }

    fn cells(&self, m: f32) -> usize {
        (m / self.grid.voxel_m).round().max(1.0) as usize
    }

    /// Whether an object of that height in hand could pass over a floor cell.
    fn is_passable(&self, cell: usize, levels: usize) -> bool {
        let column = self.grid.column(cell);
        let top = (levels + self.lift()).min(self.grid.dims[2]);
        (column.start + self.lift()..column.start + top).all(|voxel| !(self.blocks)(voxel))
    }

    /// Whether a floor cell is the object's or touches one of its cells.
    fn is_rim(&self, target: &Patch, cell: usize) -> bool {
        let [width, depth, _] = self.grid.dims;
        let (x, y) = (cell / depth, cell % depth);
        let xs = x.saturating_sub(1)..(x + 2).min(width);
        xs.into_iter().any(|x| (y.saturating_sub(1)..(y + 2).min(depth)).any(|y| target.contains(x * depth + y)))
    }

    /// Whether an object can be lifted and pulled straight out of the shelf.
    ///
    /// # Errors
    /// [`Rejection::NoWayOut`] where something stands before it, or the shelf is too low.
    pub fn way_out(&self, target: &Patch) -> Result<(), Rejection> {
        let (depth, extent) = (self.grid.dims[1], self.extent(target));
        if extent.levels + self.lift() > self.grid.dims[2] {
            return Err(Rejection::NoWayOut);
        }
        // Maps are a cell wide of the truth at rims: the outermost columns and the cells beside the object are its own.
        for x in extent.x[0] + 1..extent.x[1] {
            let cells = x * depth..x * depth + extent.y[1] + 1;
            let Some(last) = cells.clone().rfind(|cell| target.contains(*cell)) else { continue };
            let mut before = (cells.start..last).filter(|cell| !self.is_rim(target, *cell));
            if before.any(|cell| !self.is_passable(cell, extent.levels)) {
                return Err(Rejection::NoWayOut);
            }
        }
        Ok(())
    }

    /// Whether an object can be set down so far from where it stands, metres along x and y, coming straight from the front.
    ///
    /// # Errors
    /// [`Rejection::NoPlace`] where it cannot.
    pub fn place(&self, target: &Patch, place: [f32; 2]) -> Result<(), Rejection> {
        let shift = place.map(|m| (m / self.grid.voxel_m).round() as isize);
        Places::new(self, target).hides(shift).map(drop).ok_or(Rejection::NoPlace)
    }

    /// Where an object can be set down, metres along x and y from where it stands: where it hides least that nobody knows
    /// comes first, of equals the nearest.
    pub fn places(&self, target: &Patch) -> Vec<[f32; 2]> {
        let places = Places::new(self, target);
        let [width, depth, _] = self.grid.dims;
        let extent = places.extent;
        let step = self.cells(STEP_M) as isize;
        let range = |size: usize, [low, high]: [usize; 2]| {
            let (least, most) = (-(low as isize), size as isize - 1 - high as isize);
            (least..=most).step_by(step as usize)
        };
        let mut found: Vec<(u32, isize, [isize; 2])> = range(width, extent.x)
            .flat_map(|dx| range(depth, extent.y).map(move |dy| [dx, dy]))
            .filter_map(|shift| {
                let far = shift[0] * shift[0] + shift[1] * shift[1];
                places.hides(shift).map(|hidden| (hidden, far, shift))
            })
            .collect();
        found.sort_unstable();
        let apart = (APART_M / self.grid.voxel_m).powi(2) as isize;
        let mut chosen: Vec<[isize; 2]> = Vec::new();
        for (_, _, shift) in found {
            let is_apart = |other: &[isize; 2]| (0..2).map(|a| (shift[a] - other[a]).pow(2)).sum::<isize>() >= apart;
            if chosen.len() < PLACES && chosen.iter().all(is_apart) {
                chosen.push(shift);
            }
        }
        chosen.into_iter().map(|shift| shift.map(|cells| cells as f32 * self.grid.voxel_m)).collect()
    }
}

/// Places for one object, by sums over rectangles of floor cells.
struct Places {
    extent: Extent,
    margin: usize,
    dims: [usize; 2],
    /// Cells where it cannot stand, cells that it cannot be carried over, unknown voxels as high as it is.
    taken: Sums,
    blocked: Sums,
    unknown: Sums,
}

impl Places {
    fn new(room: &Room<'_>, target: &Patch) -> Self {
        let (grid, extent) = (room.grid, room.extent(target));
        let of = |count: &dyn Fn(usize) -> u32| Sums::new(grid, count);
        let levels = |cell: usize| {
            let first = grid.column(cell).start;
            first..first + extent.levels
        };
        // The object itself is in hand.
        let other = |cell: usize| !room.is_rim(target, cell);
        Self {
            extent,
            margin: room.cells(MARGIN_M),
            dims: [grid.dims[0], grid.dims[1]],
            taken: of(&|cell| u32::from(other(cell) && levels(cell).any(|voxel| (room.is_taken)(voxel)))),
            blocked: of(&|cell| u32::from(other(cell) && !room.is_passable(cell, extent.levels))),
            unknown: of(&|cell| levels(cell).filter(|voxel| (room.is_unknown)(*voxel)).count() as u32),
        }
    }

    /// How many unknown voxels it hides there; `None` where it cannot be set down.
    fn hides(&self, [dx, dy]: [isize; 2]) -> Option<u32> {
        let moved =
            |[low, high]: [usize; 2], by: isize| Some([low.checked_add_signed(by)?, high.checked_add_signed(by)?]);
        let (x, y) = (moved(self.extent.x, dx)?, moved(self.extent.y, dy)?);
        let m = self.margin;
        let inside = x[0] >= m && y[0] >= m && x[1] + m < self.dims[0] && y[1] + m < self.dims[1];
        if !inside || (dx, dy) == (0, 0) {
            return None;
        }
        let around = [x[0] - m, x[1] + m + 1];
        if self.taken.over(around, [y[0] - m, y[1] + m + 1]) > 0 || self.blocked.over(around, [0, y[1] + 1]) > 0 {
            return None;
        }
        Some(self.unknown.over([x[0], x[1] + 1], [y[0], self.dims[1]]))
    }
}

/// Sums over rectangles of floor cells.
struct Sums {
    depth: usize,
    before: Vec<u32>,
}

impl Sums {
    fn new(grid: &Grid, count: &dyn Fn(usize) -> u32) -> Self {
        let [width, depth, _] = grid.dims;
        let mut before = vec![0; (width + 1) * (depth + 1)];
        let at = |x: usize, y: usize| x * (depth + 1) + y;
        for x in 0..width {
            for y in 0..depth {
                before[at(x + 1, y + 1)] =
                    count(x * depth + y) + before[at(x, y + 1)] + before[at(x + 1, y)] - before[at(x, y)];
            }
        }
        Self { depth, before }
    }

    /// Over columns and rows, ends left out.
    fn over(&self, [x0, x1]: [usize; 2], [y0, y1]: [usize; 2]) -> u32 {
        let at = |x: usize, y: usize| self.before[x * (self.depth + 1) + y];
        at(x1, y1) + at(x0, y0) - at(x0, y1) - at(x1, y0)
    }
}
