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

    /// The set whose bits are `words` (voxel `i` is bit `i % 64` of word `i / 64`); `None` for another number of words than
    /// the grid needs. Bits past the last voxel are cleared.
    pub fn from_words(grid: &Grid, mut words: Vec<u64>) -> Option<Self> {
        let voxel_count = grid.voxel_count();
        if words.len() != voxel_count.div_ceil(64) {
            return None;
        }
        if let (Some(last), rest @ 1..) = (words.last_mut(), voxel_count % 64) {
            *last &= (1 << rest) - 1;
        }
        Some(Self { words, voxel_count })
    }

    /// Number of voxels that could be in the set.
    pub fn voxel_count(&self) -> usize {
        self.voxel_count
    }

    /// The set's bits, 64 voxels a word, the first in the lowest bit.
    pub fn words(&self) -> &[u64] {
        &self.words
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

    /// The set whose column `i` (`height` voxels from `i height` on) is this one's column `sources[i]`.
    pub fn with_columns_of(&self, height: usize, sources: &[usize]) -> Self {
        debug_assert_eq!(sources.len() * height, self.voxel_count);
        let mut moved = Self { words: vec![0; self.words.len()], voxel_count: self.voxel_count };
        for (column, &source) in sources.iter().enumerate() {
            for first in (0..height).step_by(64) {
                let count = (height - first).min(64);
                moved.add_bits(column * height + first, self.bits(source * height + first, count));
            }
        }
        moved
    }

    /// At most 64 voxels from `first` on as the lowest bits of a word.
    fn bits(&self, first: usize, count: usize) -> u64 {
        let (word, shift) = (first / 64, first % 64);
        let mut bits = self.words[word] >> shift;
        if shift + count > 64 {
            bits |= self.words[word + 1] << (64 - shift);
        }
        bits & (u64::MAX >> (64 - count))
    }

    /// Adds those of the 64 voxels from `first` on whose bits are set.
    fn add_bits(&mut self, first: usize, bits: u64) {
        let (word, shift) = (first / 64, first % 64);
        self.words[word] |= bits << shift;
        if shift > 0 && bits >> (64 - shift) != 0 {
            self.words[word + 1] |= bits >> (64 - shift);
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn it_is_a_set(
            a in prop::collection::btree_set(0_usize..150, 0..60),
            b in prop::collection::btree_set(0_usize..150, 0..60),
        ) {
            let grid = Grid { voxel_m: 0.1, dims: [5, 6, 5], origin: [0.0; 3] };
            let of = |indices: &BTreeSet<usize>| {
                let mut set = VoxelSet::empty(&grid);
                indices.iter().for_each(|&index| set.insert(index));
                set
            };
            let listed = |set: &VoxelSet| set.iter().collect::<BTreeSet<_>>();
            let (mut union, mut difference, mut emptied) = (of(&a), of(&a), of(&a));
            union.union_with(&of(&b));
            difference.subtract(&of(&b));
            a.iter().for_each(|&index| emptied.remove(index));
            prop_assert!(of(&a).iter().is_sorted());
            prop_assert_eq!(listed(&of(&a)), a.clone());
            prop_assert_eq!(listed(&union), a.union(&b).copied().collect());
            prop_assert_eq!(listed(&difference), a.difference(&b).copied().collect());
            prop_assert_eq!((of(&a).len(), of(&a).is_empty()), (a.len(), a.is_empty()));
            prop_assert!((0..150).all(|index| of(&a).contains(index) == a.contains(&index)));
            prop_assert!(emptied.is_empty());
            // Columns of 5 voxels lie across the words' borders.
            let sources: Vec<usize> = (0..30).map(|column| (7 * column + 3) % 29).collect();
            let moved = of(&a).with_columns_of(5, &sources);
            prop_assert!((0..150).all(|i| moved.contains(i) == a.contains(&(sources[i / 5] * 5 + i % 5))));
            prop_assert_eq!(VoxelSet::from_words(&grid, of(&a).words().to_vec()), Some(of(&a)));
            prop_assert_eq!(VoxelSet::from_words(&grid, vec![0; 2]), None);
        }
    }
}
