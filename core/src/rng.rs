//! Named, seeded random streams.
//!
//! Every random choice draws from a stream that is named by what it is for, so that adding a choice in one place
//! never shifts the choices in another, and the same seed gives the same result on any number of threads.

use rand::{RngCore, SeedableRng};
pub use rand_chacha::ChaCha8Rng;

/// The stream `name` of `seed`; `index` tells repeated uses apart (a step, an object, a sample).
pub fn stream(seed: u64, name: &str, index: u64) -> ChaCha8Rng {
    let mut bytes = [0_u8; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    bytes[8..16].copy_from_slice(&fnv1a(name).to_le_bytes());
    bytes[16..24].copy_from_slice(&index.to_le_bytes());
    ChaCha8Rng::from_seed(bytes)
}

/// A seed of its own for the `index`-th of things that each take one (scenes of a set, episodes of a bench).
pub fn derived_seed(seed: u64, name: &str, index: u64) -> u64 {
    stream(seed, name, index).next_u64()
}

/// FNV-1a, 64 bits: short, portable, and fixed for ever.
fn fnv1a(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::{derived_seed, stream};
    use rand::Rng;

    #[test]
    fn streams_differ_by_seed_name_and_index_and_repeat() {
        let first = |seed, name, index| stream(seed, name, index).random::<u64>();
        assert_eq!(first(1, "views", 0), first(1, "views", 0));
        assert_eq!(derived_seed(1, "views", 0), first(1, "views", 0));
        let all = [first(1, "views", 0), first(2, "views", 0), first(1, "pushes", 0), first(1, "views", 1)];
        for i in 0..all.len() {
            for j in 0..i {
                assert_ne!(all[i], all[j]);
            }
        }
    }
}
