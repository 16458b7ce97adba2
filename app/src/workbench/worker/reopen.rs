//! Opening an episode that is there already: shown first, repeated and compared with its files then.

use super::told::{Brake, Checked, Event, Post, Track, go_on, moment, setup};
use crate::driver::{Driver, update_of};
use crate::workbench::filed;
use crate::workbench::session::{Activity, Moment};
use nudge_core::belief::BeliefUpdate;
use nudge_core::episode::{Episode, EpisodeRecord, StepOutcome, review};
use nudge_core::scene::Catalog;
use nudge_core::{Error, Result};
use std::path::Path;
use std::sync::Arc;

/// Shows an episode as its files hold it, and then repeats its log: to go on with it, or, where that cannot be, to bring what
/// the files do not hold.
pub(super) fn reopen(
    path: &Path,
    look_only: bool,
    catalog: Arc<Catalog>,
    post: &Post,
    brake: &Brake,
) -> Result<(Track, Arc<Moment>)> {
    let filed = filed::open(path, catalog.clone())?;
    let record = filed.record.clone();
    let mut states = States { post, brake, of: record.steps.len(), first: None, latest: None };
    post.send(Event::Opened(Box::new(filed)));
    let (track, checked) = match check(path, &record, look_only, catalog, &mut states) {
        Ok(checked) => checked,
        Err(error) if brake.is_cancelled() => return Err(error),
        Err(error) => {
            // It is in sight as its files hold it, and stays so.
            post.send(Event::Unchecked(error.to_string()));
            let latest = states.latest.take().ok_or(error)?;
            return Ok((Track::Reading, latest));
        }
    };
    let latest = states.latest.take().ok_or_else(|| Error::input(path, "", "holds no prior"))?;
    post.send(Event::Checked(Box::new(checked)));
    Ok((track, latest))
}

/// Repeats the log of an episode, on and on if it can be gone on with.
fn check(
    path: &Path,
    record: &EpisodeRecord,
    look_only: bool,
    catalog: Arc<Catalog>,
    states: &mut States<'_>,
) -> Result<(Track, Checked)> {
    // Networks that are not here, cannot be read, or have other weights than those that made it.
    let (update, hindrance) = match update_of(&record.config.belief) {
        Ok(Ok(update)) => match record.other_weights(&*update) {
            None => (Some(update), None),
            Some(words) => (None, Some(format!("{words}; {HELD}"))),
        },
        Ok(Err(why)) => (None, Some(format!("{why}; {HELD}"))),
        Err(error) => (None, Some(format!("{error}; {HELD}"))),
    };
    let hindrance = hindrance.or_else(|| look_only.then(|| "nothing in its directory shall change".to_owned()));
    let refused = match (&update, hindrance) {
        (Some(update), None) => {
            let resumed = Driver::resume(path, catalog.clone(), update.clone(), &mut |episode, outcome| {
                states.take(episode, outcome)
            });
            match resumed {
                Ok(driver) => {
                    let checked = states.checked(driver.episode(), Some(update.clone()), None)?;
                    return Ok((Track::Writing(Box::new(driver)), checked));
                }
                // What cannot be written, is being written by another run, or is of another version or machine.
                Err(refused @ (Error::Io { .. } | Error::Input { .. } | Error::Check(_))) => refused.to_string(),
                Err(error) => return Err(error),
            }
        }
        (_, hindrance) => hindrance.unwrap_or_default(),
    };
    let (episode, difference) =
        review(path, catalog, update.clone(), &mut |episode, outcome| states.take(episode, outcome))?;
    let reason = difference.map_or(refused, |difference| {
        format!("repeating its actions gives another result here ({difference}); shown is what it holds")
    });
    Ok((Track::Reading, states.checked(&episode, update, Some(reason))?))
}

/// What an episode lacks whose belief update is not here.
const HELD: &str =
    "shown is what it holds: pushes are not predicted, and after one every voxel counts as unseen in Gains";

/// The states of an episode that is being repeated, sent one by one.
struct States<'a> {
    post: &'a Post,
    brake: &'a Brake,
    of: usize,
    first: Option<Arc<Moment>>,
    latest: Option<Arc<Moment>>,
}

impl States<'_> {
    fn take(&mut self, episode: &Episode, outcome: Option<&StepOutcome>) -> Result<()> {
        go_on(self.brake)?;
        let done = episode.record().steps.len();
        let before = self.latest.take().filter(|_| outcome.is_some());
        let next = Arc::new(moment(episode, outcome.cloned(), before.as_deref()));
        if done == 0 {
            self.first = Some(next.clone());
        }
        self.latest = Some(next.clone());
        self.post.send(Event::Repeated(next));
        self.post.send(Event::Activity(Activity::Checking { done, of: self.of }));
        Ok(())
    }

    fn checked(
        &self,
        episode: &Episode,
        update: Option<Arc<dyn BeliefUpdate>>,
        read_only: Option<String>,
    ) -> Result<Checked> {
        let first = self.first.as_ref().ok_or_else(|| Error::Usage("there is no prior".to_owned()))?;
        Ok(Checked { record: episode.record().clone(), setup: setup(episode, update, first)?, read_only })
    }
}
