//! Opening an episode again: to continue a run that was stopped, or to look at it.

use super::directory::EpisodeDir;
use super::machine::Episode;
use super::record::{EpisodeRecord, StepOutcome};
use super::replay::{Comparison, Difference};
use crate::belief::{Belief, BeliefUpdate, Intervention, Prediction};
use crate::camera::MapObservation;
use crate::scene::Catalog;
use crate::{Error, Result};
use std::path::Path;
use std::sync::Arc;

/// Called for every state of an episode that is opened, with the outcome of the last action.
pub type Observer<'a> = &'a mut dyn FnMut(&Episode, Option<&StepOutcome>) -> Result<()>;

/// Opens the episode in `path` to continue it: repeats the actions of its log without deciding anew, and verifies after
/// every one that belief, truth and scores are those in the directory, the beliefs bit for bit. `observer` is called
/// for the prior (without an outcome) and for every action once it is verified, so that a recording can be made anew.
///
/// # Errors
/// [`Error::Input`] or [`Error::Io`] for a directory that holds no episode or a damaged one, [`Error::Check`] when the
/// repeated actions do not lead where the log says (written by another version, or on another machine).
/// [`Error::Input`], too, for an update of other weights than those that made the episode; it names them.
pub fn resume(
    path: impl AsRef<Path>,
    catalog: Arc<Catalog>,
    update: Arc<dyn BeliefUpdate>,
    observer: Observer<'_>,
) -> Result<(EpisodeDir, Episode)> {
    let directory = EpisodeDir::open_to_write(path.as_ref())?;
    if let Some(words) = directory.record()?.other_weights(&*update) {
        return Err(Error::input(directory.path(), "", format!("cannot be resumed: {words}")));
    }
    let (episode, _) = retrace(&directory, catalog, update, Departure::Refused, usize::MAX, observer)?;
    Ok((directory, episode))
}

/// Opens the episode in `path` to look at it: nothing is locked or written. Where the repeated actions do not lead where
/// the log says (it was written by another version, or on another machine), the filed step, belief and truth stand in
/// place of the repeated ones, and the first such place is told beside the episode. Bodies and images remain the
/// repeated ones. Without an update everything is as it is filed, nothing is compared, pushes have no predictions, and
/// after a push no voxel counts as seen: so an episode is to be opened whose update is not here, or here with other weights
/// ([`EpisodeRecord::other_weights`]).
///
/// # Errors
/// Those of [`resume`] but for [`Error::Check`], and [`Error::Usage`] for an action of the log that cannot be repeated.
pub fn review(
    path: impl AsRef<Path>,
    catalog: Arc<Catalog>,
    update: Option<Arc<dyn BeliefUpdate>>,
    observer: Observer<'_>,
) -> Result<(Episode, Option<Difference>)> {
    let directory = EpisodeDir::open(path.as_ref())?;
    match update {
        Some(update) => retrace(&directory, catalog, update, Departure::Overruled, usize::MAX, observer),
        None => {
            let update = Arc::new(Absent(directory.record()?.config.belief));
            retrace(&directory, catalog, update, Departure::Expected, usize::MAX, observer)
        }
    }
}

/// Goes through the first `actions` actions of an episode as [`review`] does: `observer` is shown the prior and every action.
///
/// # Errors
/// Those of [`review`].
pub(crate) fn revisit(
    directory: &EpisodeDir,
    catalog: Arc<Catalog>,
    update: Arc<dyn BeliefUpdate>,
    actions: usize,
    observer: Observer<'_>,
) -> Result<Option<Difference>> {
    Ok(retrace(directory, catalog, update, Departure::Overruled, actions, observer)?.1)
}

/// Placeholder for an update that the log names and this program lacks: leaves every belief as it is.
struct Absent(String);

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

/// What to do where repeated actions do not lead where the log says.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Departure {
    /// End with an error.
    Refused,
    /// Continue from the files, and report where the difference began.
    Overruled,
    /// Continue from the files after every action, comparing nothing.
    Expected,
}

/// Repeats at most `actions` actions of a log.
fn retrace(
    directory: &EpisodeDir,
    catalog: Arc<Catalog>,
    update: Arc<dyn BeliefUpdate>,
    departure: Departure,
    actions: usize,
    observer: Observer<'_>,
) -> Result<(Episode, Option<Difference>)> {
    let logged = directory.record()?;
    let mut episode = Episode::new(logged.scene.clone(), catalog, logged.config.clone(), update)?;
    let mut first = None;
    for done in 0..=logged.steps.len().min(actions) {
        let step = done.checked_sub(1).map(|at| &logged.steps[at]);
        let mut outcome = step.map(|step| episode.act(step.decision.clone())).transpose()?;
        let difference = match departure {
            Departure::Expected => None,
            Departure::Refused | Departure::Overruled => difference(directory, &logged, done, &episode)?,
        };
        if let (Departure::Refused, Some(difference)) = (departure, &difference) {
            let place = directory.path().display();
            return Err(Error::Check(format!("{place}: cannot be resumed: {difference}")));
        }
        if departure == Departure::Expected || difference.is_some() {
            episode.adopt_state(&logged, directory.read_belief(done)?, directory.read_truth(done)?);
            if let (Some(outcome), Some(step)) = (&mut outcome, step) {
                outcome.record = step.clone();
            }
        }
        first = first.or(difference);
        observer(&episode, outcome.as_ref())?;
    }
    if actions >= logged.steps.len() {
        episode.adopt_log(logged);
    }
    Ok((episode, first))
}

/// The first place where the episode after `done` actions differs from the files.
fn difference(
    directory: &EpisodeDir,
    logged: &EpisodeRecord,
    done: usize,
    episode: &Episode,
) -> Result<Option<Difference>> {
    let mut comparison = Comparison::new(0.0);
    match done.checked_sub(1) {
        Some(at) => comparison.step(&logged.steps[at], &episode.record().steps[at]),
        None => comparison.prior(logged, episode.record()),
    }
    comparison.arrays(directory, logged, done, episode)?;
    Ok(comparison.into_first_difference())
}
