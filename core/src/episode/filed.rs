//! Looking at an episode whose shelf cannot be simulated: everything is as it is filed.

use super::directory::EpisodeDir;
use super::estimate::Told;
use super::machine::Episode;
use super::record::{StepOutcome, StepRecord};
use super::replay::{Comparison, tolerance};
use crate::arm::{Arm, PhasedMotion};
use crate::belief::{Belief, BeliefUpdate, Intervention, Prediction};
use crate::camera::{Intrinsics, MapObservation, NoiseModel, Sensed, View, ViewArray, project};
use crate::environment::Environment;
use crate::scene::Catalog;
use crate::world::{ManipulationOutcome, TruthMap};
use crate::{Error, Result};
use std::path::Path;
use std::sync::Arc;

/// Called for every state of an episode that is opened, with the outcome of the last action.
pub type Observer<'a> = &'a mut dyn FnMut(&Episode, Option<&StepOutcome>) -> Result<()>;

/// Placeholder for an update that the log names and this program lacks: leaves every belief as it is.
pub(super) struct Absent(pub(super) String);

impl BeliefUpdate for Absent {
    fn name(&self) -> &str {
        &self.0
    }

    fn observe(&self, belief: &Belief, _observation: &MapObservation) -> Belief {
        belief.clone()
    }

    fn predict(&self, _belief: &Belief, _interventions: &[Intervention]) -> Vec<Prediction> {
        Vec::new()
    }
}

/// An environment that is no longer there, with its views if they were its own.
struct Gone(Option<ViewArray>);

impl Environment for Gone {
    fn frame(&mut self, _: &View, _: &Intrinsics) -> Result<Sensed> {
        Err(Error::Usage("this episode's surroundings are not here: it can only be looked at".to_owned()))
    }

    fn carry_out(&mut self, _: &Arm, _: &PhasedMotion) -> Result<ManipulationOutcome> {
        Err(Error::Usage("this episode's surroundings are not here: it can only be looked at".to_owned()))
    }

    fn truth(&self) -> Option<&TruthMap> {
        None
    }

    fn branch(&self) -> Option<Box<dyn Environment>> {
        Some(Box::new(Self(self.0.clone())))
    }

    fn views(&self) -> Option<&ViewArray> {
        self.0.as_ref()
    }
}

/// Shows every state of an episode as it is filed, with its frames if there are any. Predictions of pushes, and what has been
/// seen, are inferred again with the update, if there is one.
pub(super) fn look_through(
    directory: &EpisodeDir,
    catalog: Arc<Catalog>,
    update: Option<Arc<dyn BeliefUpdate>>,
    observer: Observer<'_>,
) -> Result<Episode> {
    let logged = directory.record()?;
    let update = update.unwrap_or_else(|| Arc::new(Absent(logged.config.belief.clone())));
    let scene = logged.scene.clone();
    let mut episode =
        Episode::within(Box::new(Gone(logged.recorded_views.clone())), scene, catalog, logged.config.clone(), update)?;
    let has_frames = directory.check_frames(&logged).is_ok();
    for done in 0..=logged.steps.len() {
        let step = done.checked_sub(1).map(|at| &logged.steps[at]);
        let told = step.filter(|_| has_frames).map(|step| directory.read_told(step)).transpose()?;
        let outcome = step.map(|step| episode.retell(step, told));
        episode.adopt_state(&logged, directory.read_belief(done)?, None);
        observer(&episode, outcome.as_ref())?;
    }
    episode.adopt_log(logged);
    Ok(episode)
}

/// Goes on with the episode in `path` in an environment that is back: whatever its updates were told is told again, and every
/// belief compared with the one that is filed. `observer` is shown the prior and every step.
///
/// # Errors
/// [`Error::Input`] for an episode without frames, for one of a simulated shelf, and for other weights than those that made it;
/// [`Error::Check`] where a belief differs from the one that is filed.
pub fn resume_within(
    path: impl AsRef<Path>,
    environment: Box<dyn Environment>,
    catalog: Arc<Catalog>,
    update: Arc<dyn BeliefUpdate>,
    observer: Observer<'_>,
) -> Result<(EpisodeDir, Episode)> {
    let directory = EpisodeDir::open_to_write(path.as_ref())?;
    let logged = directory.record()?;
    let refuse = |words: String| Error::input(directory.path(), "", format!("cannot be resumed: {words}"));
    if logged.has_truth() {
        return Err(refuse("it is an episode of a simulated shelf".to_owned()));
    }
    if let Some(words) = logged.other_weights(&*update) {
        return Err(refuse(words));
    }
    directory.check_frames(&logged)?;
    let (scene, config) = (logged.scene.clone(), logged.config.clone());
    let mut episode = Episode::within(environment, scene, catalog, config, update)?;
    if episode.record().recorded_views != logged.recorded_views {
        return Err(refuse("the world that is back offers other views".to_owned()));
    }
    let mut comparison = Comparison::new(tolerance(&logged));
    for done in 0..=logged.steps.len() {
        let step = done.checked_sub(1).map(|at| &logged.steps[at]);
        let told = step.map(|step| directory.read_told(step)).transpose()?;
        let outcome = step.map(|step| episode.retell(step, told));
        comparison.at(done);
        comparison.belief(&directory, done, episode.belief())?;
        observer(&episode, outcome.as_ref())?;
    }
    if let Some(found) = comparison.into_first_difference() {
        return Err(Error::Check(format!("{}: cannot be resumed: {found}", directory.path().display())));
    }
    episode.adopt_log(logged);
    Ok((directory, episode))
}

impl Episode {
    /// Takes note of a step of a log, and of what its belief update was told.
    fn retell(&mut self, step: &StepRecord, told: Option<Told>) -> StepOutcome {
        let (config, shelf) = (self.record().config.clone(), self.record().scene.shelf);
        let mut outcome = StepOutcome::of_log(step.clone());
        let mut estimate = self.estimate().clone();
        match told {
            Some(Told::Frame(sensed)) => {
                let noise = config.noise.unwrap_or(NoiseModel::OFF);
                let frame = noise.apply(&sensed, config.seed, step.index as u64);
                let observation = project(&frame, &shelf);
                estimate.look(self.update(), &observation);
                (outcome.frame, outcome.observation) = (Some(frame), Some(observation));
            }
            Some(Told::Manipulation(swept)) => {
                let is_predicted = config.is_predicted(step.decision.reason);
                outcome.prediction = estimate.manipulate(self.update(), &swept, is_predicted);
                outcome.swept = Some(swept);
            }
            None => {}
        }
        self.take_note(step, estimate);
        outcome
    }
}
