//! How the voxels of a field lie in memory.

use crate::grid::Grid;

/// The most voxels along one axis that fixed-point rays can count.
const MOST_VOXELS: usize = 2_000;

/// The padded grid: an opaque voxel around the shelf, shared by neighbouring lines and planes, so that a ray that
/// leaves the shelf anywhere but through its open front meets one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layout {
    pub grid: Grid,
    /// Distance in the padded array between neighbours along x, y and z.
    pub stride: [usize; 3],
}

impl Layout {
    pub fn of(grid: &Grid) -> Self {
        assert!(grid.dims.iter().all(|&n| n <= MOST_VOXELS), "at most {MOST_VOXELS} voxels along an axis");
        let line = grid.dims[2] + 1;
        Self { grid: *grid, stride: [(grid.dims[1] + 1) * line, line, 1] }
    }

    /// Number of padded voxels: a plane and a line before the first voxel, a plane after the last.
    pub fn len(&self) -> usize {
        (self.grid.dims[0] + 2) * self.stride[0] + self.stride[1]
    }

    /// Position of a voxel in the padded grid.
    pub fn at(&self, voxel: [usize; 3]) -> usize {
        (voxel[0] + 1) * self.stride[0] + (voxel[1] + 1) * self.stride[1] + voxel[2]
    }

    /// Position in the padded grid of a floor cell's lowest voxel.
    pub fn column(&self, cell: usize) -> usize {
        self.at([cell / self.grid.dims[1], cell % self.grid.dims[1], 0])
    }

    /// Position in the padded grid of the voxel at `index` in arrays over voxels.
    pub fn padded(&self, index: usize) -> usize {
        let voxel = self.grid.voxel(index);
        self.at([voxel.x, voxel.y, voxel.z].map(usize::from))
    }

    /// Position in arrays over voxels of a voxel inside the shelf.
    pub fn unpadded(&self, padded: usize) -> usize {
        let at = padded - self.at([0, 0, 0]);
        let (x, y, z) = (at / self.stride[0], at % self.stride[0] / self.stride[1], at % self.stride[1]);
        (x * self.grid.dims[1] + y) * self.grid.dims[2] + z
    }
}

/// A box of voxels, both corners included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct VoxelBox {
    pub min: [usize; 3],
    pub max: [usize; 3],
}

impl VoxelBox {
    /// Grows a box, or begins it, so that it holds `voxel`.
    pub fn add(grown: &mut Option<Self>, voxel: [usize; 3]) {
        let grown = grown.get_or_insert(Self { min: voxel, max: voxel });
        for (axis, at) in voxel.into_iter().enumerate() {
            grown.min[axis] = grown.min[axis].min(at);
            grown.max[axis] = grown.max[axis].max(at);
        }
    }
}
