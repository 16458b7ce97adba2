//! Numbers kept packed, in blocks that are unpacked one at a time, so that a window can hold every step of an episode.

use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// How hard zstd tries: the quickest of its usual levels, since a belief is packed in every step.
const LEVEL: i32 = 1;

/// Numbers in half precision. Reading one unpacks its block, which is remembered until another block is read.
#[derive(Debug)]
pub struct Halves {
    len: usize,
    block: usize,
    packed: Vec<Box<[u8]>>,
    last: Mutex<Option<(usize, Arc<[f16]>)>>,
}

impl Halves {
    /// The numbers, rounded, in blocks of `block`.
    pub fn pack(values: &[f32], block: usize) -> Self {
        let block = block.max(1);
        let packed = values.par_chunks(block).map(|values| {
            let mut halves = vec![f16::ZERO; values.len()];
            halves.convert_from_f32_slice(values);
            packed(&halves.iter().flat_map(|half| half.to_le_bytes()).collect::<Vec<u8>>())
        });
        Self { len: values.len(), block, packed: packed.collect(), last: Mutex::default() }
    }

    /// Writes all numbers into `values`, which has as many.
    pub fn unpack(&self, values: &mut [f32]) {
        values.par_chunks_mut(self.block).zip(self.packed.par_iter()).for_each(|(values, packed)| {
            halves(packed, values.len()).convert_to_f32_slice(values);
        });
    }

    /// The number at a place.
    pub fn get(&self, index: usize) -> f32 {
        let (block, at) = (index / self.block, index % self.block);
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.as_ref().is_none_or(|(of, _)| *of != block) {
            let len = self.block.min(self.len - block * self.block);
            *last = Some((block, halves(&self.packed[block], len).into()));
        }
        last.as_ref().map_or(f32::NAN, |(_, halves)| halves[at].to_f32())
    }

    /// Bytes that the packed numbers take.
    pub fn bytes(&self) -> usize {
        self.packed.iter().map(|block| block.len()).sum()
    }
}

impl Clone for Halves {
    fn clone(&self) -> Self {
        Self { len: self.len, block: self.block, packed: self.packed.clone(), last: Mutex::default() }
    }
}

impl PartialEq for Halves {
    fn eq(&self, other: &Self) -> bool {
        (self.len, self.block) == (other.len, other.block) && self.packed == other.packed
    }
}

/// Bytes, packed.
pub fn packed(bytes: &[u8]) -> Box<[u8]> {
    // Memory has no reason to refuse, and zstd packs whatever there is.
    zstd::bulk::compress(bytes, LEVEL).expect("bytes can be packed").into()
}

/// The bytes that were packed, `len` of them.
pub fn unpacked(packed: &[u8], len: usize) -> Vec<u8> {
    zstd::bulk::decompress(packed, len).expect("what was packed here can be unpacked")
}

fn halves(packed: &[u8], len: usize) -> Vec<f16> {
    unpacked(packed, 2 * len).chunks_exact(2).map(|pair| f16::from_le_bytes([pair[0], pair[1]])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_one_by_one_and_all_together_and_take_little_room() {
        let values: Vec<f32> = (0..10_000).map(|at| (at / 100) as f32).collect();
        let halves = Halves::pack(&values, 333);
        for at in [0, 332, 333, 5000, 9999, 1] {
            assert_eq!(halves.get(at), values[at], "{at}");
        }
        let mut back = vec![0.0; values.len()];
        halves.unpack(&mut back);
        assert_eq!(back, values);
        assert!(halves.bytes() < values.len() / 2, "{} bytes", halves.bytes());
        assert!(halves == halves.clone() && halves != Halves::pack(&values[1..], 333));
    }
}
