//! An episode with its directory and its recording: what the command line and the window drive.
//!
//! A [`Driver`] keeps three things in step: the [`Episode`] itself, the [`EpisodeDir`] that it is written to, and the
//! recording in it. One call of [`Driver::act`] moves all three by one action; a run that is killed between or within
//! calls leaves a directory that [`Driver::resume`] goes on with.

use crate::figure::{Moment, Summary, summary};
use crate::picture;
use crate::record::Recorder;
use nudge_core::belief::{Belief, BeliefUpdate, Classical};
use nudge_core::episode::{Episode, EpisodeConfig, EpisodeDir, Overwrite, Repeated, StepOutcome, resume};
use nudge_core::plan::{Decision, PolicyKind};
use nudge_core::scene::{Body, Catalog, Scene};
use nudge_core::world::TruthMap;
use nudge_core::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// File of the recording in an episode's directory.
pub const RECORDING: &str = "episode.rrd";
/// File of the summary figure in an episode's directory.
pub const SUMMARY: &str = "summary.png";

/// An episode on its way, written to a directory step by step.
pub struct Driver {
    episode: Episode,
    directory: EpisodeDir,
    recorder: Recorder,
    /// The bodies before the first action.
    start: Vec<Body>,
}

impl Driver {
    /// Starts an episode in the directory `out` and writes its prior.
    ///
    /// # Errors
    /// What [`Episode::new`] and [`EpisodeDir::create`] refuse; nothing is written then.
    pub fn start(
        scene: Scene,
        catalog: Arc<Catalog>,
        config: EpisodeConfig,
        update: Arc<dyn BeliefUpdate>,
        out: &Path,
        overwrite: Overwrite,
    ) -> Result<Self> {
        let mut episode = Episode::new(scene, catalog, config, update)?;
        let mut directory = EpisodeDir::create(out, overwrite)?;
        let mut recorder = Recorder::create(&out.join(RECORDING), &episode)?;
        recorder.prior(&episode)?;
        directory.write(&mut episode)?;
        Ok(Self { start: episode.bodies(), episode, directory, recorder })
    }

    /// Goes on with the episode in `out`: repeats and verifies its log, and records it anew on the way.
    /// `progress` is called with the number of steps repeated and of those in the log.
    ///
    /// # Errors
    /// What [`resume`] refuses.
    pub fn resume(
        out: &Path,
        catalog: Arc<Catalog>,
        update: Arc<dyn BeliefUpdate>,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Self> {
        let mut recorder: Option<Recorder> = None;
        let mut start = Vec::new();
        let (directory, episode) = resume(out, catalog, update, &mut |repeated: &Repeated<'_>| {
            match (&mut recorder, repeated.outcome) {
                (Some(recorder), Some(outcome)) => recorder.step(repeated.episode, outcome)?,
                _ => {
                    let mut fresh = Recorder::create(&out.join(RECORDING), repeated.episode)?;
                    fresh.prior(repeated.episode)?;
                    recorder = Some(fresh);
                    start = repeated.episode.bodies();
                }
            }
            progress(repeated.done, repeated.of);
            Ok(())
        })?;
        let recorder = recorder.ok_or_else(|| Error::input(out, "", "holds no step to go on from"))?;
        Ok(Self { episode, directory, recorder, start })
    }

    /// The episode.
    pub fn episode(&self) -> &Episode {
        &self.episode
    }

    /// Where the episode is written.
    pub fn path(&self) -> &Path {
        self.directory.path()
    }

    /// What the policy would do now; changes nothing.
    pub fn decide(&self) -> Decision {
        self.episode.decide()
    }

    /// Does `decision.action` and writes what it brought.
    pub fn act(&mut self, decision: Decision) -> Result<StepOutcome> {
        let mut outcome = self.episode.act(decision)?;
        let started = Instant::now();
        self.recorder.step(&self.episode, &outcome)?;
        self.episode.add_record_seconds(started.elapsed().as_secs_f64());
        self.directory.write(&mut self.episode)?;
        if let Some(step) = self.episode.record().steps.last() {
            outcome.record.seconds = step.seconds;
        }
        Ok(outcome)
    }

    /// Ends the recording, draws the summary figure beside it, and gives the episode back.
    pub fn finish(self) -> Result<Episode> {
        let Self { episode, directory, recorder, start } = self;
        recorder.finish()?;
        write_summary(&episode, &directory, &start)?;
        Ok(episode)
    }
}

/// Draws `summary.png`: maps after the first, the middle and the last step, read back from the directory.
fn write_summary(episode: &Episode, directory: &EpisodeDir, start: &[Body]) -> Result<()> {
    let last = episode.record().steps.len();
    let mut steps = vec![last.min(1), last.div_ceil(2), last];
    steps.dedup();
    let moments: Vec<(usize, Belief, TruthMap)> = steps
        .into_iter()
        .map(|step| Ok((step, directory.read_belief(step)?, directory.read_truth(step)?.into_map())))
        .collect::<Result<_>>()?;
    let moments: Vec<Moment<'_>> =
        moments.iter().map(|(step, belief, truth)| Moment { step: *step, belief, truth }).collect();
    let figure =
        summary(&Summary { record: episode.record(), catalog: episode.catalog(), start, moments: &moments })?;
    picture::save(&figure, &directory.path().join(SUMMARY))
}

/// The belief update that a policy runs with: the one named, or the policy's own. Says in the second value what a
/// person should know about the choice.
///
/// # Errors
/// [`Error::Usage`] for a name that is unknown, or asked for but not there.
pub fn belief_update(named: Option<&str>, policy: PolicyKind) -> Result<(Arc<dyn BeliefUpdate>, Option<String>)> {
    match named.unwrap_or_else(|| policy.default_belief()) {
        "classical" => Ok((Arc::new(Classical), None)),
        "cnabu" if named.is_none() => {
            let note = format!("no network weights are there yet: {policy} runs on the classical belief");
            Ok((Arc::new(Classical), Some(note)))
        }
        "cnabu" => Err(Error::Usage("--belief cnabu: no network weights are there yet; use classical".to_owned())),
        other => Err(Error::Usage(format!("unknown belief \"{other}\"; there are classical, cnabu"))),
    }
}

/// Where an episode goes unless told: `out/<scene>-<policy>-<seed>`.
pub fn default_out(scene: &Scene, policy: PolicyKind, seed: u64) -> PathBuf {
    let name: String =
        scene.name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    Path::new("out").join(format!("{name}-{policy}-{seed}"))
}
