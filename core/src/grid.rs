//! The voxel grid of a shelf and the one place where metres become voxels and back.
//!
//! A [`Grid`] covers the shelf's interior: `W x D x H` voxels along x (width), y (depth, 0 at the front edge) and
//! z (up, 0 on the board). Arrays over voxels are laid out `[x][y][z]` with z fastest, arrays over floor cells
//! `[x][y]`, which is also the order of the files.

mod traversal;
mod voxel_set;

pub use traversal::{Crossing, Traversal};
pub use voxel_set::VoxelSet;

use crate::{Point, Vector};
use serde::{Deserialize, Serialize};

/// One voxel by its indices along x, y and z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Voxel {
    /// Index along the width.
    pub x: u16,
    /// Index along the depth.
    pub y: u16,
    /// Index along the height; also called the level.
    pub z: u16,
}

/// One floor cell by its indices along x and y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Cell {
    /// Index along the width.
    pub x: u16,
    /// Index along the depth.
    pub y: u16,
}

/// Shape and placement of the voxel grid in the shelf's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Edge of a voxel, metres.
    pub voxel_m: f32,
    /// Number of voxels along x (W), y (D), z (H).
    pub dims: [usize; 3],
    /// The corner with the smallest coordinates, metres.
    pub origin: [f32; 3],
}

impl Grid {
    /// The grid that covers a shelf interior of `size_m` (x, y, z) with voxels of `voxel_m`: x from minus to plus
    /// half the width, y and z from 0. A size that is no multiple of the voxel is rounded to the nearest one.
    pub fn for_shelf(size_m: [f32; 3], voxel_m: f32) -> Self {
        let dims = size_m.map(|size| ((size / voxel_m).round() as usize).max(1));
        Self { voxel_m, dims, origin: [-0.5 * dims[0] as f32 * voxel_m, 0.0, 0.0] }
    }

    /// Number of voxels, `W * D * H`.
    pub fn voxel_count(&self) -> usize {
        self.dims.iter().product()
    }

    /// Number of floor cells, `W * D`.
    pub fn cell_count(&self) -> usize {
        self.dims[0] * self.dims[1]
    }

    /// Size of the covered box, metres.
    pub fn size_m(&self) -> [f32; 3] {
        self.dims.map(|n| n as f32 * self.voxel_m)
    }

    /// The corner with the smallest coordinates.
    pub fn min(&self) -> Point {
        Point::from(self.origin)
    }

    /// The corner with the largest coordinates.
    pub fn max(&self) -> Point {
        self.min() + Vector::from(self.size_m())
    }

    /// Position of a voxel in arrays over voxels.
    pub fn index(&self, voxel: Voxel) -> usize {
        (usize::from(voxel.x) * self.dims[1] + usize::from(voxel.y)) * self.dims[2] + usize::from(voxel.z)
    }

    /// The voxel at a position in arrays over voxels; the inverse of [`Grid::index`].
    pub fn voxel(&self, index: usize) -> Voxel {
        let (column, z) = (index / self.dims[2], index % self.dims[2]);
        Voxel { x: (column / self.dims[1]) as u16, y: (column % self.dims[1]) as u16, z: z as u16 }
    }

    /// Position of a floor cell in arrays over cells. The voxels of its column are at
    /// `cell_index * H .. (cell_index + 1) * H`.
    pub fn cell_index(&self, cell: Cell) -> usize {
        usize::from(cell.x) * self.dims[1] + usize::from(cell.y)
    }

    /// The floor cell at a position in arrays over cells.
    pub fn cell(&self, index: usize) -> Cell {
        Cell { x: (index / self.dims[1]) as u16, y: (index % self.dims[1]) as u16 }
    }

    /// Positions of a cell's column in arrays over voxels, from the board up.
    pub fn column(&self, cell_index: usize) -> std::ops::Range<usize> {
        cell_index * self.dims[2]..(cell_index + 1) * self.dims[2]
    }

    /// Centre of a voxel, metres.
    pub fn center(&self, voxel: Voxel) -> Point {
        let at = |axis: usize, i: u16| self.origin[axis] + (f32::from(i) + 0.5) * self.voxel_m;
        Point::new(at(0, voxel.x), at(1, voxel.y), at(2, voxel.z))
    }

    /// Centre of a floor cell on the board, metres.
    pub fn cell_center(&self, cell: Cell) -> Point {
        let at = self.center(Voxel { x: cell.x, y: cell.y, z: 0 });
        Point::new(at.x, at.y, self.origin[2])
    }

    /// The voxel that holds `point`, or `None` outside the grid. A voxel owns its lower faces.
    pub fn voxel_at(&self, point: Point) -> Option<Voxel> {
        let mut index = [0_u16; 3];
        for axis in 0..3 {
            let at = ((point[axis] - self.origin[axis]) / self.voxel_m).floor();
            if !(at >= 0.0 && at < self.dims[axis] as f32) {
                return None;
            }
            index[axis] = at as u16;
        }
        Some(Voxel { x: index[0], y: index[1], z: index[2] })
    }

    /// The floor cell below or above `point`, or `None` outside the floor plan.
    pub fn cell_at(&self, point: Point) -> Option<Cell> {
        let on_board = Point::new(point.x, point.y, self.origin[2] + 0.5 * self.voxel_m);
        self.voxel_at(on_board).map(|voxel| Cell { x: voxel.x, y: voxel.y })
    }

    /// Number of levels whose centre is below `height_m`.
    pub fn levels_below(&self, height_m: f32) -> usize {
        (((height_m - self.origin[2]) / self.voxel_m - 0.5).ceil().max(0.0) as usize).min(self.dims[2])
    }

    /// Every voxel that the segment from `from` along `direction` crosses, in order; see [`Traversal`].
    pub fn traverse(&self, from: Point, direction: Vector, t_max: f32) -> Traversal {
        Traversal::new(self, from, direction, t_max)
    }
}

/// A box of whole voxel columns: the part of the floor plan that something touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First cell index along x, and one past the last.
    pub x: [usize; 2],
    /// First cell index along y, and one past the last.
    pub y: [usize; 2],
}

impl Window {
    /// The window of the whole floor plan.
    pub fn whole(grid: &Grid) -> Self {
        Self { x: [0, grid.dims[0]], y: [0, grid.dims[1]] }
    }

    /// Number of cells along x and y.
    pub fn size(&self) -> [usize; 2] {
        [self.x[1] - self.x[0], self.y[1] - self.y[0]]
    }

    /// Number of floor cells inside.
    pub fn cell_count(&self) -> usize {
        self.size().iter().product()
    }

    /// Cell indices of the window in the grid's arrays, in the window's own `[x][y]` order.
    pub fn cells(self, grid: &Grid) -> impl Iterator<Item = usize> {
        let depth = grid.dims[1];
        (self.x[0]..self.x[1]).flat_map(move |x| (self.y[0]..self.y[1]).map(move |y| x * depth + y))
    }

    /// The smallest window that holds both.
    pub fn hull(&self, other: &Self) -> Self {
        let hull = |a: [usize; 2], b: [usize; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self { x: hull(self.x, other.x), y: hull(self.y, other.y) }
    }

    /// The window grown by `cells` on every side, clipped to the grid.
    pub fn grown(self, cells: usize, grid: &Grid) -> Self {
        let grow = |range: [usize; 2], limit: usize| [range[0].saturating_sub(cells), (range[1] + cells).min(limit)];
        Self { x: grow(self.x, grid.dims[0]), y: grow(self.y, grid.dims[1]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_of_the_design_has_its_size() {
        let grid = Grid::for_shelf([0.80, 0.40, 0.40], 0.005);
        assert_eq!(grid.dims, [160, 80, 80]);
        assert_eq!((grid.voxel_count(), grid.cell_count()), (1_024_000, 12_800));
        assert_eq!(grid.levels_below(0.27), 54);
    }

    #[test]
    fn metres_to_voxel_and_back() {
        let grid = Grid::for_shelf([0.80, 0.40, 0.40], 0.005);
        for index in (0..grid.voxel_count()).step_by(977) {
            let voxel = grid.voxel(index);
            assert_eq!(grid.index(voxel), index);
            assert_eq!(grid.voxel_at(grid.center(voxel)), Some(voxel));
        }
        assert_eq!(grid.voxel_at(Point::new(0.0, -0.001, 0.1)), None);
        assert_eq!(grid.voxel_at(Point::new(f32::NAN, 0.1, 0.1)), None);
    }
}
