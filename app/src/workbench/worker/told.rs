//! What a worker tells the window, and what stops it.

use crate::driver::Driver;
use crate::workbench::half_belief::HalfBelief;
use crate::workbench::latest::Wake;
use crate::workbench::packed_frame::PackedFrame;
use crate::workbench::session::{Activity, Moment, SessionId, Setup};
use nudge_core::belief::BeliefUpdate;
use nudge_core::camera::hidden_objects;
use nudge_core::episode::{Episode, EpisodeRecord, StepOutcome};
use nudge_core::plan::{Action, Decision};
use nudge_core::scene::ObjectId;
use nudge_core::{Error, Result};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;

/// What a worker tells.
pub enum Event {
    /// The episode is there.
    Opened(Box<Opened>),
    /// A state of the opened episode with all that repeating its action brought.
    Repeated(Arc<Moment>),
    /// The log of the opened episode is repeated.
    Checked(Box<Checked>),
    /// The log of the opened episode cannot be repeated, for a reason that is no other version, machine or network's.
    Unchecked(String),
    /// What it is at.
    Activity(Activity),
    /// What the policy would do.
    Decided(Arc<Decision>),
    /// A step is done.
    Stepped(Arc<Moment>),
    /// Something could not be done; the episode is as it was.
    Failed(String),
    /// The worker broke down; the episode takes no more orders.
    Panicked(String),
}

/// An episode that has been opened.
pub struct Opened {
    /// Its directory.
    pub path: PathBuf,
    /// Scene, configuration, steps.
    pub record: EpisodeRecord,
    /// What does not change.
    pub setup: Setup,
    /// The states so far.
    pub moments: Vec<Arc<Moment>>,
    /// Why nothing more can be done with it, if it can only be looked at.
    pub read_only: Option<String>,
}

/// What repeating the log of an opened episode brought, beside its states.
pub struct Checked {
    /// Scene, configuration, steps.
    pub record: EpisodeRecord,
    /// What does not change.
    pub setup: Setup,
    /// Why nothing more can be done with it, if it can only be looked at.
    pub read_only: Option<String>,
}

/// What stops a worker before it has done all that it was told.
#[derive(Default)]
pub(in crate::workbench) struct Brake {
    /// Stop after the action that is under way.
    pub paused: AtomicBool,
    /// Leave the orders that are in line.
    pub forgotten: AtomicBool,
    /// Stop as soon as can be; what has been decided is not done.
    pub cancelled: AtomicBool,
}

impl Brake {
    pub fn is_paused(&self) -> bool {
        self.paused.load(Ordering::Relaxed) || self.is_cancelled()
    }

    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

#[derive(Clone)]
pub(in crate::workbench) struct Post {
    pub id: SessionId,
    pub events: Sender<(SessionId, Event)>,
    pub wake: Wake,
}

impl Post {
    pub fn send(&self, event: Event) {
        // Nobody listens any more once the window is closed.
        let _ = self.events.send((self.id, event));
        (self.wake)();
    }
}

/// An episode that goes on, or one that can only be looked at.
pub(in crate::workbench) enum Track {
    Writing(Box<Driver>),
    Reading,
}

/// The state of an episode and what led to it; what has not changed since `before` is shared with it.
pub(in crate::workbench) fn moment(
    episode: &Episode,
    mut outcome: Option<StepOutcome>,
    before: Option<&Moment>,
) -> Moment {
    let frame = PackedFrame::taken_from(outcome.as_mut());
    let pushed = outcome.as_ref().is_none_or(|outcome| matches!(outcome.record.action, Action::Manipulate(_)));
    let shared = before.filter(|_| !pushed);
    Moment {
        step: episode.record().steps.len(),
        belief: HalfBelief::of(episode.belief()),
        seen: Arc::new(episode.seen().clone()),
        truth: shared.map_or_else(|| episode.truth().cloned().map(Arc::new), |before| before.truth.clone()),
        bodies: shared.map_or_else(|| Arc::new(episode.bodies()), |before| before.bodies.clone()),
        scores: match &outcome {
            Some(outcome) => outcome.record.scores().copied(),
            None => episode.record().prior.scores,
        },
        entropy_nats: outcome
            .as_ref()
            .map_or(episode.record().prior.entropy_nats, |outcome| outcome.record.entropy_nats),
        outcome: outcome.map(Arc::new),
        frame,
        is_whole: true,
    }
}

/// Refuses to go on once nobody waits any more.
pub(in crate::workbench) fn go_on(brake: &Brake) -> Result<()> {
    if brake.is_cancelled() { Err(Error::Usage("cancelled".to_owned())) } else { Ok(()) }
}

/// What does not change in an episode that began with `first`.
pub(in crate::workbench) fn setup(
    episode: &Episode,
    update: Option<Arc<dyn BeliefUpdate>>,
    first: &Moment,
) -> Result<Setup> {
    let record = episode.record();
    let views = record.view_array()?;
    let hidden = hidden_objects(&record.scene.shelf, &first.bodies, &views);
    let name = |id: &ObjectId| {
        let object = record.scene.objects.get(usize::from(id.0));
        format!("{}#{}", object.map_or("object", |object| object.class.as_str()), id.0)
    };
    Ok(Setup {
        catalog: Arc::new(episode.catalog().clone()),
        views: Arc::new(views),
        update,
        arm: episode.arm().clone(),
        unreachable: Arc::new(episode.unreachable_views().to_vec()),
        hidden: Some(Arc::new(hidden.iter().map(name).collect())),
    })
}
