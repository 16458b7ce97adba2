//! Working through a plan: several episodes at once, each in a thread pool of its own.

use super::plan::{EpisodeId, Plan, PolicyPlan};
use super::result::{EpisodeResult, EpisodeSeconds, tallied_steps};
use super::store::BenchDir;
use crate::driver::{Driver, belief_update};
use nudge_core::camera::{ViewArray, hidden_objects};
use nudge_core::episode::{Episode, EpisodeConfig, Frames, Overwrite};
use nudge_core::scene::Catalog;
use nudge_core::score::Tally;
use nudge_core::{Error, Result};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock, mpsc};
use std::thread;
use std::time::Instant;

/// What a running episode may take, bytes: with room for other beliefs, grids and recordings. Measured on the classical
/// belief with two threads, the whole process: 72 MB for `mem`, 49 MB for `oracle`.
pub const BYTES_PER_EPISODE: u64 = 250 << 20;

/// How many episodes run at once, and with how many threads each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Workers {
    /// Episodes at once.
    pub jobs: usize,
    /// Threads of each.
    pub threads: usize,
}

impl Workers {
    /// One thread per episode and as many episodes as there are processors, or as `jobs` says, but no more than have
    /// room in `memory` bytes and than there are `episodes`. Processors that are left over are shared out.
    pub fn new(jobs: Option<usize>, processors: usize, memory: Option<u64>, episodes: usize) -> Self {
        let room = memory.map_or(usize::MAX, |bytes| (bytes / BYTES_PER_EPISODE).max(1) as usize);
        let jobs = jobs.unwrap_or(processors.min(room)).clamp(1, episodes.max(1));
        Self { jobs, threads: (processors / jobs).max(1) }
    }
}

/// What became of an episode.
#[derive(Debug)]
pub enum Event {
    /// It is finished and filed.
    Done {
        /// The episode.
        id: EpisodeId,
        /// Its result.
        result: Box<EpisodeResult>,
        /// Wall-clock seconds that it took.
        seconds: f64,
    },
    /// It could not be finished.
    Failed {
        /// The episode.
        id: EpisodeId,
        /// Why.
        error: Error,
    },
}

/// Runs episodes of a plan and files them. With `record`, the whole episode is kept as well, with its recording. `watch`
/// is told of every episode as it ends. An episode that cannot be finished does not stop the others.
pub fn run(
    plan: &Plan,
    directory: &BenchDir,
    episodes: &[EpisodeId],
    workers: Workers,
    record: bool,
    watch: &mut dyn FnMut(Event),
) -> Result<()> {
    let shared = Shared::new(plan, directory, record)?;
    let (next, broken_off) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (sender, receiver) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..workers.jobs {
            let (sender, shared, next, broken_off) = (sender.clone(), &shared, &next, &broken_off);
            scope.spawn(move || {
                while let Some(&id) = episodes.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if broken_off.load(Ordering::Relaxed) {
                        break;
                    }
                    let event = shared.run_guarded(id, workers.threads);
                    // A disk that is full stays full: what could not be filed ends the bench.
                    let fatal = matches!(&event, Event::Failed { error: Error::Io { .. }, .. });
                    broken_off.fetch_or(fatal, Ordering::Relaxed);
                    if sender.send(event).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for event in receiver {
            watch(event);
        }
    });
    Ok(())
}

/// What the workers share.
struct Shared<'a> {
    plan: &'a Plan,
    directory: &'a BenchDir,
    catalog: Arc<Catalog>,
    views: ViewArray,
    record: bool,
    /// Hidden objects by set and scene, once somebody has looked.
    hidden: Vec<Vec<OnceLock<Vec<u16>>>>,
}

impl<'a> Shared<'a> {
    fn new(plan: &'a Plan, directory: &'a BenchDir, record: bool) -> Result<Self> {
        let hidden = plan.sets.iter().map(|set| set.scenes.iter().map(|_| OnceLock::new()).collect()).collect();
        let views = ViewArray::named(&plan.views)?;
        Ok(Self { plan, directory, catalog: Arc::new(Catalog::standard()), views, record, hidden })
    }

    /// Runs an episode to its end, whatever happens in it.
    fn run_guarded(&self, id: EpisodeId, threads: usize) -> Event {
        let started = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.map_err(|error| Error::Usage(format!("no threads to be had: {error}")))?;
            pool.install(|| self.run_and_file(id, threads, started))
        }));
        let name = || self.plan.name(id);
        match outcome {
            Ok(Ok((result, seconds))) => Event::Done { id, result: Box::new(result), seconds },
            Ok(Err(error @ Error::Io { .. })) => Event::Failed { id, error },
            Ok(Err(error)) => Event::Failed { id, error: Error::Usage(format!("{}: {error}", name())) },
            Err(panic) => Event::Failed { id, error: Error::Usage(format!("{} broke: {}", name(), words(&*panic))) },
        }
    }

    fn run_and_file(&self, id: EpisodeId, threads: usize, started: Instant) -> Result<(EpisodeResult, f64)> {
        let set = &self.plan.sets[id.set];
        let scene = &set.scenes[id.scene].scene;
        let hidden = match self.hidden[id.set][id.scene].get() {
            Some(hidden) => hidden.clone(),
            None => {
                let bodies = scene.bodies(&self.catalog)?;
                let hidden = hidden_objects(&scene.shelf, &bodies, &self.views).iter().map(|id| id.0).collect();
                self.hidden[id.set][id.scene].get_or_init(|| hidden).clone()
            }
        };
        let recording = self.record.then(|| self.directory.path().join(BenchDir::recording(self.plan, id)));
        let (episode, tallies) = run_episode(self.plan, id, self.catalog.clone(), recording.as_deref())?;
        let record = episode.record();
        let result = EpisodeResult::new(self.plan, id, record, hidden, tallies)?;
        let total = started.elapsed().as_secs_f64();
        let steps = record.steps.iter().map(|step| step.seconds).collect();
        self.directory.file_episode(self.plan, id, &result, &EpisodeSeconds { threads, total, steps })?;
        Ok((result, total))
    }
}

/// Runs one episode of a plan, into a directory if one is given, and keeps the tallies that results have.
///
/// # Errors
/// What [`Episode::new`], [`Episode::act`] and [`Driver::start`] refuse.
pub fn run_episode(
    plan: &Plan,
    id: EpisodeId,
    catalog: Arc<Catalog>,
    recording: Option<&Path>,
) -> Result<(Episode, Vec<(usize, Tally)>)> {
    let PolicyPlan { policy, belief, .. } = &plan.policies[id.policy];
    let update = belief_update(Some(belief), *policy)?;
    let config = EpisodeConfig {
        policy: *policy,
        belief: belief.clone(),
        seed: id.seed,
        budget: plan.budget,
        views: plan.views.clone(),
        planner: *plan.planner_of(id.policy),
        noise: plan.noise,
    };
    let scene = plan.sets[id.set].scenes[id.scene].scene.clone();
    let mut tallies = Vec::new();
    let mut note = |episode: &Episode| {
        let actions = episode.record().steps.len();
        if let Some(truth) = episode.truth().filter(|_| tallied_steps(plan.budget).contains(&actions)) {
            tallies.push((actions, Tally::of(episode.belief(), truth)));
        }
    };
    if let Some(path) = recording {
        let mut driver =
            Driver::start(Episode::new(scene, catalog, config, update)?, path, Overwrite::Replace, Frames::Filed)?;
        while !driver.episode().is_finished() {
            let decision = driver.decide();
            driver.act(decision)?;
            note(driver.episode());
        }
        return Ok((driver.finish()?, tallies));
    }
    let mut episode = Episode::new(scene, catalog, config, update)?;
    while !episode.is_finished() {
        let decision = episode.decide();
        episode.act(decision)?;
        note(&episode);
    }
    Ok((episode, tallies))
}

/// What a panic says.
fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no reason given".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn workers_fit_processors_memory_and_work() {
        let workers = |jobs, processors, memory, episodes| {
            let Workers { jobs, threads } = Workers::new(jobs, processors, memory, episodes);
            (jobs, threads)
        };
        assert_eq!(workers(None, 8, None, 100), (8, 1));
        assert_eq!(workers(None, 8, Some(3 * BYTES_PER_EPISODE), 100), (3, 2), "no more than memory has room for");
        assert_eq!(workers(None, 8, Some(1), 100), (1, 8));
        assert_eq!(workers(None, 8, None, 2), (2, 4), "no more than there is to do");
        assert_eq!(workers(Some(3), 2, Some(1), 100), (3, 1), "as many as was asked for");
        assert_eq!(workers(None, 2, None, 0), (1, 2));
    }
}
