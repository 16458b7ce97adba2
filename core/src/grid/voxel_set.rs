//! A set of voxels, one bit each.

use super::Grid;

/// A set of voxels by their position in arrays over voxels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VoxelSet {
    words: Vec<u64>,
    voxel_count: usize,
}

impl VoxelSet {
    /// The empty set over the voxels of `grid`.
    pub fn empty(grid: &Grid) -> Self {
        Self { words: vec![0; grid.voxel_count().div_ceil(64)], voxel_count: grid.voxel_count() }
    }

    /// Whether the voxel at `index` is in the set.
    pub fn contains(&self, index: usize) -> bool {
        self.words[index / 64] >> (index % 64) & 1 == 1
    }

    /// Adds the voxel at `index`.
    pub fn insert(&mut self, index: usize) {
        debug_assert!(index < self.voxel_count);
        self.words[index / 64] |= 1 << (index % 64);
    }

    /// Removes the voxel at `index`.
    pub fn remove(&mut self, index: usize) {
        self.words[index / 64] &= !(1 << (index % 64));
    }

    /// Adds every voxel of `other`.
    pub fn union_with(&mut self, other: &Self) {
        for (word, other) in self.words.iter_mut().zip(&other.words) {
            *word |= other;
        }
    }

    /// Removes every voxel of `other`.
    pub fn subtract(&mut self, other: &Self) {
        for (word, other) in self.words.iter_mut().zip(&other.words) {
            *word &= !other;
        }
    }

    /// Number of voxels in the set.
    pub fn len(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether no voxel is in the set.
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|word| *word == 0)
    }

    /// The voxels' positions, ascending.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.words.iter().enumerate().flat_map(|(at, &word)| {
            let mut rest = word;
            std::iter::from_fn(move || {
                (rest != 0).then(|| {
                    let bit = rest.trailing_zeros() as usize;
                    rest &= rest - 1;
                    at * 64 + bit
                })
            })
        })
    }
}
