//! Opening an episode again: to continue a run that was stopped, or to look at it.

use super::directory::EpisodeDir;
use super::filed::{self, Absent, Observer};
use super::judgement::NO_TRUTH;
use super::machine::Episode;
use super::record::EpisodeRecord;
use super::replay::{Comparison, Difference};
use crate::belief::BeliefUpdate;
use crate::scene::Catalog;
use crate::score::Scores;
use crate::{Error, Result};
use std::path::Path;
use std::sync::Arc;

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
    refuse_other_weights(&directory, &directory.record()?, &*update)?;
    let (episode, _) = retrace(&directory, catalog, update, Departure::Refused, usize::MAX, observer)?;
    Ok((directory, episode))
}

/// Opens the episode in `path` to continue it from its checkpoint, without repeating anything: a run that is killed again and
/// again still gets on. What is filed last (belief, scores, truth) is compared with the checkpoint. The pushes so far are
/// simulated again when the next one is carried out, and have to lead to the same poses. `None` where there is no checkpoint of
/// the last step: [`resume`] then goes on.
///
/// # Errors
/// Those of [`resume`].
pub fn resume_from_checkpoint(
    path: impl AsRef<Path>,
    catalog: Arc<Catalog>,
    update: Arc<dyn BeliefUpdate>,
) -> Result<Option<(EpisodeDir, Episode)>> {
    let directory = EpisodeDir::open_to_write(path.as_ref())?;
    let logged = directory.record()?;
    refuse_other_weights(&directory, &logged, &*update)?;
    refuse_without_truth(&directory, &logged)?;
    let Some(checkpoint) = directory.read_checkpoint(&logged)? else { return Ok(None) };
    let mut episode = Episode::new(logged.scene.clone(), catalog, logged.config.clone(), update)?;
    let done = logged.steps.len();
    if episode.go_to(checkpoint, logged.clone()).is_err() {
        return Ok(None);
    }
    let mut comparison = Comparison::new(0.0);
    comparison.at(done);
    comparison.arrays(&directory, &logged, done, &episode)?;
    if let (Some(scores), Some(truth)) = (logged.scores_after(done), episode.truth()) {
        comparison.documents("scores", scores, &Scores::of(episode.belief(), truth));
    }
    refuse(&directory, comparison.into_first_difference())?;
    Ok(Some((directory, episode)))
}

fn refuse_other_weights(directory: &EpisodeDir, logged: &EpisodeRecord, update: &dyn BeliefUpdate) -> Result<()> {
    let refused = |words| Err(Error::input(directory.path(), "", format!("cannot be resumed: {words}")));
    logged.other_weights(update).map_or(Ok(()), refused)
}

/// What was not simulated cannot be repeated.
fn refuse_without_truth(directory: &EpisodeDir, logged: &EpisodeRecord) -> Result<()> {
    let message = || format!("cannot be resumed: {NO_TRUTH}, so its shelf cannot be simulated");
    if logged.has_truth() { Ok(()) } else { Err(Error::input(directory.path(), "", message())) }
}

fn refuse(directory: &EpisodeDir, difference: Option<Difference>) -> Result<()> {
    let place = directory.path().display();
    difference.map_or(Ok(()), |found| Err(Error::Check(format!("{place}: cannot be resumed: {found}"))))
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
    if !directory.record()?.has_truth() {
        return Ok((filed::look_through(&directory, catalog, update, observer)?, None));
    }
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
    refuse_without_truth(directory, &logged)?;
    let mut episode = Episode::new(logged.scene.clone(), catalog, logged.config.clone(), update)?;
    let mut first = None;
    for done in 0..=logged.steps.len().min(actions) {
        let step = done.checked_sub(1).map(|at| &logged.steps[at]);
        let mut outcome = step.map(|step| episode.act(step.decision.clone())).transpose()?;
        let difference = match departure {
            Departure::Expected => None,
            Departure::Refused | Departure::Overruled => difference(directory, &logged, done, &episode)?,
        };
        if departure == Departure::Refused {
            refuse(directory, difference.clone())?;
        }
        if departure == Departure::Expected || difference.is_some() {
            let truth = logged.has_truth().then(|| directory.read_truth(done)).transpose()?;
            episode.adopt_state(&logged, directory.read_belief(done)?, truth);
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
