//! Making a data directory, shard by shard.

use super::shard::{self, Frame};
use super::{Card, Recipe, Sample};
use crate::files::remove_if_there;
use crate::shard::Shard;
use crate::{Error, Result};
use rayon::prelude::*;
use std::path::Path;

/// Progress of making samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples of this process that are on disk or made.
    pub done: usize,
    /// Samples that this call has made.
    pub made: usize,
    /// Samples of this process.
    pub of: usize,
}

/// Makes the samples of `card` that are not there yet in `directory`, as far as their files are among `mine`. An
/// unfinished directory is continued; a larger count extends it.
///
/// `progress` is called after every sample, from any thread.
///
/// # Errors
/// For a directory that was started with other settings, and when something cannot be simulated or written.
pub fn make<S: Sample>(
    card: &Card,
    recipe: &Recipe,
    directory: &Path,
    mine: Shard,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Progress> {
    card.begin(S::KIND, directory)?;
    let shards: Vec<usize> = (0..card.shard_count()).filter(|&file| mine.has(file)).collect();
    let of = shards.iter().map(|&shard| card.shard_samples(shard).len()).sum();
    let missing: Vec<usize> = shards.into_iter().filter(|&shard| !is_complete(card, directory, shard)).collect();
    let to_make: usize = missing.iter().map(|&shard| card.shard_samples(shard).len()).sum();
    let made = std::sync::atomic::AtomicUsize::new(0);
    let state = || {
        let made = made.load(std::sync::atomic::Ordering::Relaxed);
        Progress { done: of - to_make + made, made, of }
    };
    progress(state());
    for shard in missing {
        remove_if_there(&shard::index_path(directory, shard))?;
        let frames = card
            .shard_samples(shard)
            .into_par_iter()
            .with_max_len(1)
            .map(|number| {
                let seed = card.sample_seed(number);
                let record = S::simulate(recipe, seed)?.to_bytes();
                let bytes =
                    shard::compress(&record).map_err(|error| Error::io(shard::path(directory, shard), error))?;
                made.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                progress(state());
                Ok(Frame { number, seed, record: record.len(), bytes })
            })
            .collect::<Result<Vec<_>>>()?;
        shard::write(directory, shard, &frames)?;
    }
    Ok(state())
}

/// Whether a shard is there with every sample that it should have.
fn is_complete(card: &Card, directory: &Path, shard: usize) -> bool {
    shard::verified_index(directory, shard).is_ok_and(|index| {
        let numbers: Vec<usize> = index.samples.iter().map(|entry| entry.number).collect();
        numbers.into_iter().eq(card.shard_samples(shard))
    })
}
