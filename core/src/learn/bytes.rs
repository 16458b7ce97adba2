//! Records of fixed size: little endian, voxel sets as bits, floor maps as bytes.

use crate::grid::{Grid, VoxelSet};

/// Appends a voxel set's bits.
pub(super) fn put_set(out: &mut Vec<u8>, set: &VoxelSet) {
    out.extend(set.words().iter().flat_map(|word| word.to_le_bytes()));
}

/// Reads a record from its start.
pub(super) struct Reader<'a> {
    grid: Grid,
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(super) fn new(grid: &Grid, bytes: &'a [u8]) -> Self {
        Self { grid: *grid, rest: bytes }
    }

    /// The next `count` bytes.
    pub(super) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(taken)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.take(1)?.first().copied()
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    pub(super) fn f32(&mut self) -> Option<f32> {
        Some(f32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    pub(super) fn set(&mut self) -> Option<VoxelSet> {
        let bytes = self.take(self.grid.voxel_count().div_ceil(64) * 8)?;
        let words =
            bytes.chunks_exact(8).map(|word| word.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte)));
        VoxelSet::from_words(&self.grid, words.collect())
    }

    /// A byte per floor cell.
    pub(super) fn floor(&mut self) -> Option<Vec<u8>> {
        Some(self.take(self.grid.cell_count())?.to_vec())
    }

    /// Whether everything was read.
    pub(super) fn is_done(&self) -> bool {
        self.rest.is_empty()
    }
}
