//! Making data of what pushes are worth, state by state.
//!
//! State `n` is number `n % 4` of episode `n / 4`. Every state is a file of its own as soon as it is done, so that whatever ends
//! the work loses at most the states in hand, one a thread. To go on, an episode is repeated up to the states that are missing.

use super::considered::Considered;
use super::measure::measure;
use super::rollout::{Rollout, legs};
use super::{STATES_PER_EPISODE, WorthRecipe};
use crate::files::remove_if_there;
use crate::learn::shard::{self, Frame};
use crate::learn::{Card, Kind, Record};
use crate::shard::Shard;
use crate::{Error, Result};
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How far the making of data is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorthProgress {
    /// States of this process that are on disk.
    pub done: usize,
    /// States of this process.
    pub of: usize,
    /// States that this call has made.
    pub made: usize,
    /// Pushes that this call has carried out.
    pub pushes: usize,
}

/// Makes the states of `card` that are not there yet in `directory`, as far as their episodes are among `mine`. An unfinished
/// directory is continued; a larger count extends it. `progress` is called after every push and state, from any thread.
///
/// # Errors
/// For a directory that was started with other settings, and when something cannot be simulated or written.
pub fn make_worth(
    card: &Card,
    recipe: &WorthRecipe,
    directory: &Path,
    mine: Shard,
    progress: &(dyn Fn(WorthProgress) + Sync),
) -> Result<WorthProgress> {
    recipe.update.check_grid(&recipe.base.grid())?;
    card.begin(Kind::Worth, directory)?;
    let episodes = (0..card.count.div_ceil(STATES_PER_EPISODE)).filter(|episode| mine.has(*episode));
    let missing_of = |episode: usize| -> Vec<usize> {
        let numbers = episode * STATES_PER_EPISODE..((episode + 1) * STATES_PER_EPISODE).min(card.count);
        numbers.filter(|number| !is_there(directory, *number)).collect()
    };
    let all: usize =
        episodes.clone().map(|episode| STATES_PER_EPISODE.min(card.count - episode * STATES_PER_EPISODE)).sum();
    let missing: Vec<(usize, Vec<usize>)> =
        episodes.map(|episode| (episode, missing_of(episode))).filter(|(_, missing)| !missing.is_empty()).collect();
    let there = all - missing.iter().map(|(_, missing)| missing.len()).sum::<usize>();
    let [made, pushes] = [AtomicUsize::new(0), AtomicUsize::new(0)];
    let state = || {
        let made = made.load(Ordering::Relaxed);
        WorthProgress { done: there + made, of: all, made, pushes: pushes.load(Ordering::Relaxed) }
    };
    progress(state());
    let pushed = || {
        pushes.fetch_add(1, Ordering::Relaxed);
        progress(state());
    };
    // In their order, one after the other on each thread.
    missing.into_iter().par_bridge().try_for_each(|(episode, missing)| -> Result<()> {
        let seed = card.sample_seed(episode);
        run(
            recipe,
            seed,
            &missing.iter().map(|number| number % STATES_PER_EPISODE).collect::<Vec<_>>(),
            &pushed,
            &mut |leg, record| {
                write(directory, episode * STATES_PER_EPISODE + leg, seed, record)?;
                made.fetch_add(1, Ordering::Relaxed);
                progress(state());
                Ok(())
            },
        )
    })?;
    Ok(state())
}

/// Runs the episode of a seed as far as the last of the states that are wanted, and hands over their records.
fn run(
    recipe: &WorthRecipe,
    seed: u64,
    wanted: &[usize],
    pushed: &(dyn Fn() + Sync),
    each: &mut dyn FnMut(usize, &[u8]) -> Result<()>,
) -> Result<()> {
    let mut rollout = Rollout::new(recipe, seed)?;
    let mut considered: Option<Considered> = None;
    let last = wanted.iter().copied().max().unwrap_or(0);
    let legs = legs(seed);
    for (at, leg) in legs.iter().enumerate().take(last + 1) {
        if let (Some(which), Some(considered)) = (leg.push, &considered) {
            rollout.push(considered, which);
        }
        (0..leg.looks).for_each(|_| rollout.look());
        let is_wanted = wanted.contains(&at);
        let is_pushed = at < last && legs[at + 1].push.is_some();
        considered = (is_wanted || is_pushed).then(|| Considered::of(&rollout));
        if let (true, Some(considered)) = (is_wanted, &considered) {
            each(at, &measure(&rollout, at as u8, considered, pushed).to_bytes())?;
        }
    }
    Ok(())
}

fn write(directory: &Path, number: usize, seed: u64, record: &[u8]) -> Result<()> {
    remove_if_there(&shard::index_path(directory, number))?;
    let bytes = shard::compress(record).map_err(|error| Error::io(shard::path(directory, number), error))?;
    shard::write(directory, number, &[Frame { number, seed, record: record.len(), bytes }])
}

fn is_there(directory: &Path, number: usize) -> bool {
    shard::verified_index(directory, number)
        .is_ok_and(|index| index.samples.iter().map(|entry| entry.number).eq([number]))
}
