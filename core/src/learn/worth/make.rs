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
        considered = (is_wanted || is_pushed).then(|| rollout.considered());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::ArmTool;
    use crate::belief::Classical;
    use crate::camera::ViewArray;
    use crate::learn::worth::{
        PUSH_PLANES, PlaneScale, Planes, STATE_PLANES, WorthState, push_planes, state_planes, summarise,
    };
    use crate::learn::{Dataset, Recipe, Stretch};
    use crate::scene::{Catalog, Family, GenerateConfig};
    use std::sync::Arc;

    fn recipe() -> WorthRecipe {
        let scenes = GenerateConfig::default();
        let base = Recipe {
            catalog: Catalog::standard(),
            arm: Arc::new(ArmTool::standard(scenes.shelf)),
            scenes,
            views: ViewArray::named("real75").expect("shipped"),
            noise_share: 0.5,
            stretch: Stretch::default(),
        };
        let families = vec![Family::Walls, Family::TallFirst];
        WorthRecipe { base, families, update: Arc::new(Classical), pushes: 4, followed_share: 0.5 }
    }

    fn make(recipe: &WorthRecipe, count: usize, directory: &Path, threads: usize) -> WorthProgress {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let card = Card::of_worth(recipe, 4, count);
        pool.install(|| make_worth(&card, recipe, directory, Shard::default(), &|_| ())).expect("made")
    }

    #[test]
    fn states_are_the_same_on_any_number_of_threads_and_after_a_loss() {
        let (recipe, dir) = (recipe(), tempfile::tempdir().expect("tempdir"));
        let [one, other] = ["one", "other"].map(|name| dir.path().join(name));
        let bytes = |directory: &Path, number: usize| std::fs::read(shard::path(directory, number)).expect("a state");
        let made = make(&recipe, 6, &one, 1);
        assert_eq!((made.done, made.of, made.made), (6, 6, 6));
        let kept: Vec<Vec<u8>> = (0..6).map(|number| bytes(&one, number)).collect();

        // Three threads, in two calls, of which the second makes what the first one left out.
        make(&recipe, 3, &other, 3);
        assert_eq!(make(&recipe, 6, &other, 3).made, 3);
        assert!((0..6).all(|number| bytes(&other, number) == kept[number]));

        // A state that is lost, and one that is damaged, are made again; nothing else is.
        std::fs::remove_file(shard::index_path(&one, 2)).expect("removed");
        std::fs::write(shard::path(&one, 5), b"cut").expect("written");
        let again = make(&recipe, 6, &one, 2);
        assert_eq!((again.done, again.made), (6, 2));
        assert!((0..6).all(|number| bytes(&one, number) == kept[number]));

        let data = Dataset::<WorthState>::open(&one).expect("data");
        let states: Vec<WorthState> = (0..6).map(|at| data.get(at).expect("a state")).collect();
        assert_eq!(states.iter().map(|state| state.leg).collect::<Vec<_>>(), [0, 1, 2, 3, 0, 1]);
        for state in &states {
            let record = state.to_bytes();
            // Scores that were not found are not a number, which equals nothing.
            assert_eq!(WorthState::from_bytes(&data.grid(), &record).expect("a record").to_bytes(), record);
            assert!(WorthState::from_bytes(&data.grid(), &record[..record.len() - 1]).is_none());
            assert!(
                state.pushes.len() <= 4 && state.pushes.iter().all(|push| push.objects.len() == state.objects.len())
            );
        }
        assert!(states.windows(2).all(|pair| pair[1].leg == 0 || pair[1].looks.starts_with(&pair[0].looks)));
        let grid = data.grid();
        for state in &states {
            for (scale, size) in [(PlaneScale::Fine, [80, 40]), (PlaneScale::Coarse, [40, 20])] {
                let planes = state_planes(&grid, state, scale);
                assert_eq!((planes.count(), planes.size), (STATE_PLANES, size));
                let of_pushes: Vec<Planes> = state.pushes.iter().map(|push| push_planes(&grid, push, scale)).collect();
                assert!(of_pushes.iter().all(|planes| (planes.count(), planes.size) == (PUSH_PLANES, size)));
                let values = of_pushes.iter().chain([&planes]).flat_map(|planes| &planes.values);
                assert!(values.into_iter().all(|value| (-1.0..=1.0).contains(value)));
            }
        }
        let pushes: Vec<_> = states.iter().flat_map(|state| &state.pushes).collect();
        assert!(pushes.len() >= 6 && pushes.iter().any(|push| push.displacement_m > 0.0), "{}", pushes.len());
        assert!(pushes.iter().all(|push| push.swept.iter().any(|byte| *byte != 0)));
        let summaries = summarise(&data, &mut |_| ()).expect("summaries");
        assert_eq!((summaries[0].states, summaries[0].pushes), (6, pushes.len()));
        assert!(summaries[0].best >= summaries[0].chosen && summaries[0].best >= summaries[0].random);

        let card = Card::of_worth(&WorthRecipe { pushes: 5, ..recipe.clone() }, 4, 6);
        let refused = make_worth(&card, &recipe, &one, Shard::default(), &|_| ()).expect_err("other settings");
        assert_eq!(refused.exit_code(), 2);
        assert!(refused.to_string().contains("pushes per state 4, not 5"), "{refused}");
    }
}
