//! An episode with its directory and its recording: what the command line and the window drive.
//!
//! A [`Driver`] keeps three things in step: the [`Episode`] itself, the [`EpisodeDir`] that it is written to, and the
//! recording in it. One call of [`Driver::act`] moves all three by one action; a run that is killed between or within
//! calls leaves a directory that [`Driver::go_on`] goes on with.

use crate::figure::{Moment, Summary, summary};
use crate::made_by;
use crate::picture::{self, RgbImage};
use crate::record::Recorder;
use nudge_core::belief::{Belief, BeliefUpdate, CLASSICAL, CNABU, Classical, mixed_parts};
use nudge_core::camera::hidden_objects;
use nudge_core::cnabu;
use nudge_core::environment::Environment;
use nudge_core::episode::{
    Episode, EpisodeDir, EpisodeRecord, Frames, Observer, Overwrite, StepOutcome, resume, resume_from_checkpoint,
    resume_within,
};
use nudge_core::files::{remove_if_there, temporary_of};
use nudge_core::foreign::CONVERTED;
use nudge_core::plan::{Decision, PolicyKind};
use nudge_core::scene::{Body, Catalog, ObjectId, Scene};
use nudge_core::world::TruthMap;
use nudge_core::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

pub mod own;

pub use crate::record::RECORDING;

/// File of the summary figure in an episode's directory.
pub const SUMMARY: &str = "summary.png";

/// An episode on its way, written to a directory step by step.
pub struct Driver {
    episode: Episode,
    directory: EpisodeDir,
    recorder: Recorder,
    story: Story,
}

/// What the summary figure shows beside the log.
struct Story {
    /// The bodies before the first action.
    start: Vec<Body>,
    /// Belief and truth after the first action and after half of the budget.
    moments: Vec<(usize, Belief, Option<TruthMap>)>,
}

impl Story {
    fn new(episode: &Episode) -> Self {
        Self { start: episode.bodies(), moments: Vec::new() }
    }

    /// The same of an episode that goes on from a checkpoint: what it went through is read from its files.
    fn of_files(directory: &EpisodeDir, episode: &Episode) -> Result<Self> {
        let record = episode.record();
        let mut story = Self { start: Vec::new(), moments: Vec::new() };
        if let Some(shelf) = episode.simulated() {
            story.start = shelf.bodies_at_start();
        }
        for step in (1..=record.steps.len()).filter(|step| Self::shows(record, *step)) {
            let truth = record.has_truth().then(|| directory.read_truth(step)).transpose()?;
            story.moments.push((step, directory.read_belief(step)?, truth.map(|truth| truth.into_map(|| None))));
        }
        Ok(story)
    }

    /// Whether the figure shows the state after a step, other than the last.
    fn shows(record: &EpisodeRecord, step: usize) -> bool {
        step == 1 || step == record.config.budget.div_ceil(2)
    }

    /// Takes note of a step if it is one that the figure shows.
    fn note(&mut self, episode: &Episode) {
        let step = episode.record().steps.len();
        if Self::shows(episode.record(), step) {
            self.moments.push((step, episode.belief().clone(), episode.truth().cloned()));
        }
    }

    /// The figure of the episode as it stands.
    fn figure(&self, episode: &Episode, beside: Option<&EpisodeRecord>) -> Result<RgbImage> {
        let last = episode.record().steps.len();
        let mut moments: Vec<Moment<'_>> = self
            .moments
            .iter()
            .filter(|(step, ..)| *step != last)
            .map(|(step, belief, truth)| Moment { step: *step, belief, truth: truth.as_ref() })
            .collect();
        moments.push(Moment { step: last, belief: episode.belief(), truth: episode.truth() });
        summary(&Summary {
            record: episode.record(),
            catalog: episode.catalog(),
            start: &self.start,
            moments: &moments,
            beside,
        })
    }
}

impl Driver {
    /// Starts an episode that was just set up, in the directory `out`, with or without what belief updates are told, and writes
    /// its prior.
    ///
    /// # Errors
    /// What [`EpisodeDir::create`] refuses; nothing is written then.
    pub fn start(mut episode: Episode, out: &Path, overwrite: Overwrite, frames: Frames) -> Result<Self> {
        episode.built_from(made_by::build());
        let mut directory = EpisodeDir::create(out, overwrite)?.with_frames(frames);
        let mut recorder = Recorder::create(&out.join(RECORDING), &episode)?;
        recorder.prior(&episode)?;
        directory.write(&mut episode)?;
        Ok(Self { story: Story::new(&episode), episode, directory, recorder })
    }

    /// Goes on with the episode in `out` from its checkpoint, without repeating anything; where it has none, or its recording
    /// does not hold all of its steps, as [`Driver::resume`] does.
    ///
    /// # Errors
    /// What [`resume_from_checkpoint`] and [`resume`] refuse.
    pub fn go_on(
        out: &Path,
        catalog: Arc<Catalog>,
        update: Arc<dyn BeliefUpdate>,
        watch: Observer<'_>,
    ) -> Result<Self> {
        if let Some((directory, mut episode)) = resume_from_checkpoint(out, catalog.clone(), update.clone())? {
            let recording = out.join(RECORDING);
            let anew = temporary_of(&recording);
            if let Some(mut recorder) = Recorder::go_on(&anew, &recording, &episode)? {
                recorder.move_to(&recording)?;
                episode.built_from(made_by::build());
                let story = Story::of_files(&directory, &episode)?;
                return Ok(Self { episode, directory, recorder, story });
            }
            remove_if_there(&anew)?;
        }
        Self::resume(out, catalog, update, watch)
    }

    /// Goes on with the episode in `out`: repeats and verifies its log, and records it anew on the way.
    /// `watch` is shown the prior and every repeated step. Where it is refused, the recording is as it was.
    ///
    /// # Errors
    /// What [`resume`] refuses.
    pub fn resume(
        out: &Path,
        catalog: Arc<Catalog>,
        update: Arc<dyn BeliefUpdate>,
        watch: Observer<'_>,
    ) -> Result<Self> {
        Self::resume_by(out, watch, |observer| resume(out, catalog, update, observer))
    }

    /// Goes on with an episode whose environment is not simulated and is back; as [`Driver::resume`].
    ///
    /// # Errors
    /// What [`resume_within`] refuses.
    pub fn resume_within(
        environment: Box<dyn Environment>,
        out: &Path,
        catalog: Arc<Catalog>,
        update: Arc<dyn BeliefUpdate>,
        watch: Observer<'_>,
    ) -> Result<Self> {
        Self::resume_by(out, watch, |observer| resume_within(out, environment, catalog, update, observer))
    }

    /// Resumes in one way or another, and records anew what is gone through.
    fn resume_by(
        out: &Path,
        watch: Observer<'_>,
        resume: impl FnOnce(Observer<'_>) -> Result<(EpisodeDir, Episode)>,
    ) -> Result<Self> {
        // Beside the old recording, which stays unless the whole log leads where it says.
        let anew = temporary_of(&out.join(RECORDING));
        let mut begun: Option<(Recorder, Story)> = None;
        let resumed = resume(&mut |episode, outcome| {
            if let (Some((recorder, story)), Some(outcome)) = (&mut begun, outcome) {
                recorder.step(episode, outcome)?;
                story.note(episode);
            } else {
                let mut recorder = Recorder::create(&anew, episode)?;
                recorder.prior(episode)?;
                begun = Some((recorder, Story::new(episode)));
            }
            watch(episode, outcome)
        });
        if resumed.is_err() && begun.is_some() {
            let _ = remove_if_there(&anew);
        }
        let (directory, mut episode) = resumed?;
        episode.built_from(made_by::build());
        let (mut recorder, story) = begun.ok_or_else(|| Error::input(out, "", "holds no prior to go on from"))?;
        recorder.move_to(&out.join(RECORDING))?;
        Ok(Self { episode, directory, recorder, story })
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
        self.story.note(&self.episode);
        if let Some(step) = self.episode.record().steps.last() {
            outcome.record.seconds = step.seconds;
        }
        Ok(outcome)
    }

    /// The objects that no view of the array shows before the first action.
    ///
    /// # Errors
    /// For a view array that cannot be read any more.
    pub fn hidden(&self) -> Result<Vec<ObjectId>> {
        let record = self.episode.record();
        Ok(hidden_objects(&record.scene.shelf, &self.story.start, &record.view_array()?))
    }

    /// Ends the recording, draws the summary figure beside it, and gives the episode back.
    pub fn finish(self) -> Result<Episode> {
        self.finish_beside(None)
    }

    /// The same with the scores of another episode of the same scene in the figure.
    pub fn finish_beside(self, beside: Option<&EpisodeRecord>) -> Result<Episode> {
        let Self { episode, directory, recorder, story } = self;
        recorder.finish()?;
        picture::save(&story.figure(&episode, beside)?, &directory.path().join(SUMMARY))?;
        if episode.is_finished() {
            directory.finish()?;
        }
        Ok(episode)
    }
}

/// The names of the belief updates that come with the program.
pub const BELIEFS: [&str; 2] = [CLASSICAL, CNABU];

/// The belief update that a policy runs with: the one named, or the policy's own. No other one ever stands in for it.
///
/// # Errors
/// [`Error::Usage`] for a name that is unknown, or whose networks are not there: it says what is missing and how to get
/// it; what is wrong with the networks' weights.
pub fn belief_update(named: Option<&str>, policy: PolicyKind) -> Result<Arc<dyn BeliefUpdate>> {
    let name = named.unwrap_or_else(|| policy.default_belief());
    update_of(name)?.map_err(|why| Error::Usage(format!("the belief {name} is not there: {why}")))
}

/// The belief update of a name, or why this program has none although it knows the name.
///
/// # Errors
/// [`Error::Usage`] for an unknown name; what is wrong with the networks' weights, where they are there.
pub fn update_of(name: &str) -> Result<std::result::Result<Arc<dyn BeliefUpdate>, &'static str>> {
    match name {
        CLASSICAL => Ok(Ok(Arc::new(Classical))),
        CNABU => match networks() {
            Ok(update) => Ok(Ok(update)),
            // Broken weights are an error even for who did not ask for them; that there are none is not.
            Err(NoNetworks::Broken(error)) => Err(error),
            Err(NoNetworks::Missing(why)) => Ok(Err(why)),
        },
        CONVERTED => Ok(Err("its beliefs were converted from files, so no update makes them")),
        other => match mixed_parts(other) {
            Some(parts) => own::update(parts),
            None => Err(Error::Usage(format!("unknown belief \"{other}\"; there are classical, cnabu"))),
        },
    }
}

/// Said where the program was built without networks.
pub const WITHOUT_NETWORKS: &str =
    "this program was built without networks; build it with them (`make demo`), or choose --belief classical";
/// Said where no weights are found.
const WITHOUT_WEIGHTS: &str = "no weights were found; name the folder that holds sigma_o.safetensors and \
                               sigma_m.safetensors with NUDGE_MODELS, or choose --belief classical";

/// Why there are no networks to run on.
enum NoNetworks {
    /// This build has none, or no weights are there.
    Missing(&'static str),
    /// The weights are there but cannot be used.
    Broken(Error),
}

/// The networks with the weights that [`cnabu::models_dir`] finds; read once in the program's life.
fn networks() -> std::result::Result<Arc<dyn BeliefUpdate>, NoNetworks> {
    static LOADED: OnceLock<Arc<dyn BeliefUpdate>> = OnceLock::new();
    if !cnabu::AVAILABLE {
        return Err(NoNetworks::Missing(WITHOUT_NETWORKS));
    }
    if let Some(loaded) = LOADED.get() {
        return Ok(loaded.clone());
    }
    let directory = cnabu::models_dir().ok_or(NoNetworks::Missing(WITHOUT_WEIGHTS))?;
    cnabu::compute_beside_rayon();
    let update = cnabu::load(&directory).map_err(NoNetworks::Broken)?;
    Ok(LOADED.get_or_init(|| update).clone())
}

/// Where an episode goes unless told: `out/<scene>-<policy>-<seed>`.
pub fn default_out(scene: &Scene, policy: PolicyKind, seed: u64) -> PathBuf {
    let name: String =
        scene.name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    Path::new("out").join(format!("{name}-{policy}-{seed}"))
}

/// The belief update that a policy runs with unless another is asked for, as far as this program has it.
#[cfg(feature = "workbench")]
pub fn default_belief(policy: PolicyKind) -> &'static str {
    if let Some(name) = own_belief() {
        return name;
    }
    let own = policy.default_belief();
    let is_here = own != CNABU || (cnabu::AVAILABLE && cnabu::models_dir().is_some());
    if is_here { own } else { CLASSICAL }
}

/// The belief update with the modules of the user's own, if there are any.
#[cfg(feature = "workbench")]
pub fn own_belief() -> Option<&'static str> {
    static NAME: OnceLock<Option<String>> = OnceLock::new();
    NAME.get_or_init(|| own::with_own(None)).as_deref()
}

/// A belief update's name for people.
#[cfg(feature = "workbench")]
pub fn belief_title(name: &str) -> &str {
    if name == CNABU { "networks (cnabu)" } else { name }
}
