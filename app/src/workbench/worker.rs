//! An episode's worker: the thread that owns its [`Driver`], takes orders and sends events.
//!
//! The window never waits for it while it is open; [`super::threads`] waits once it is closed. A panic inside an order becomes an [`Event::Panicked`]; what was written to the
//! episode's directory until then is whole.

use super::filed;
use super::half_belief::HalfBelief;
use super::latest::words_of;
use super::packed_frame::PackedFrame;
use super::session::{Activity, Moment, SessionId, Setup};
use super::threads::Threads;
use crate::driver::{Driver, update_of};
use nudge_core::belief::BeliefUpdate;
use nudge_core::camera::{ViewArray, hidden_objects};
use nudge_core::episode::{Episode, EpisodeConfig, EpisodeRecord, Frames, Overwrite, StepOutcome, review};
use nudge_core::plan::{Action, Decision};
use nudge_core::scene::{Catalog, ObjectId, Scene};
use nudge_core::{Error, Result};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

/// What a worker begins with.
pub enum Begin {
    /// A new episode in a directory that holds none.
    Start {
        /// The scene.
        scene: Box<Scene>,
        /// Policy, belief, seed, budget.
        config: Box<EpisodeConfig>,
        /// Where it is written.
        out: PathBuf,
    },
    /// An episode that is in a directory.
    Open {
        /// The directory.
        path: PathBuf,
        /// Whether to leave everything in it as it is.
        look_only: bool,
    },
    /// A new episode that repeats the first steps of another.
    Branch {
        /// The other's scene, configuration and steps.
        of: Box<EpisodeRecord>,
        /// How many of its steps are shared.
        steps: usize,
        /// Where it is written.
        out: PathBuf,
    },
}

/// What a worker can be told.
pub enum Order {
    /// Ask the policy; answers with [`Event::Decided`].
    Decide,
    /// Do it; answers with [`Event::Stepped`].
    Act(Arc<Decision>),
    /// Decide and act until the budget is used up, or [`Worker::pause`] or [`Worker::cancel`] is called.
    Run,
    /// Break down.
    #[cfg(test)]
    Break,
}

impl Begin {
    /// The directory that it writes.
    pub fn path(&self) -> &Path {
        match self {
            Self::Start { out, .. } | Self::Branch { out, .. } => out,
            Self::Open { path, .. } => path,
        }
    }
}

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

pub use super::latest::Wake;

/// What stops a worker before it has done all that it was told.
#[derive(Default)]
struct Brake {
    /// Stop after the action that is under way.
    paused: AtomicBool,
    /// Leave the orders that are in line.
    forgotten: AtomicBool,
    /// Stop as soon as can be; what has been decided is not done.
    cancelled: AtomicBool,
}

impl Brake {
    fn is_paused(&self) -> bool {
        self.paused.load(Ordering::Relaxed) || self.is_cancelled()
    }

    fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// The window's end of a worker.
pub struct Worker {
    orders: Sender<Order>,
    brake: Arc<Brake>,
}

impl Worker {
    /// Starts the thread, which `threads` remembers. Events carry the id, so that all workers can share a channel.
    pub fn spawn(
        id: SessionId,
        begin: Begin,
        catalog: Arc<Catalog>,
        events: Sender<(SessionId, Event)>,
        wake: Wake,
        threads: &Threads,
    ) -> Self {
        let (orders, inbox) = channel();
        let brake = Arc::new(Brake::default());
        let post = Post { id, events, wake };
        let own = brake.clone();
        let path = begin.path().to_owned();
        // An episode that was closed a moment ago may still be ending its recording.
        let before = threads.take(&path);
        let thread = std::thread::Builder::new()
            .name(format!("episode {}", id.0))
            .spawn(move || {
                before.into_iter().for_each(|thread| drop(thread.join()));
                let told = post.clone();
                let work = AssertUnwindSafe(move || work(begin, catalog, &inbox, &post, &own));
                if let Err(panic) = catch_unwind(move || beside_the_window(work)) {
                    told.send(Event::Panicked(words_of(&*panic)));
                }
            })
            .expect("a thread can be started");
        threads.add(&path, thread);
        Self { orders, brake }
    }

    /// Gives an order; one that comes after a breakdown is lost.
    pub fn order(&self, order: Order) {
        self.brake.paused.store(false, Ordering::Relaxed);
        self.brake.cancelled.store(false, Ordering::Relaxed);
        self.brake.forgotten.store(false, Ordering::Relaxed);
        let _ = self.orders.send(order);
    }

    /// Stops a run after the action that it is at.
    pub fn pause(&self) {
        self.brake.paused.store(true, Ordering::Relaxed);
    }

    /// Leaves the orders that wait behind the check of a log.
    pub fn forget(&self) {
        self.brake.forgotten.store(true, Ordering::Relaxed);
    }

    /// Stops a run without doing what it decides just now, or an opening.
    pub fn cancel(&self) {
        self.brake.cancelled.store(true, Ordering::Relaxed);
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.cancel();
    }
}

/// Does an episode's work on all cores but one, which is the window's.
fn beside_the_window(work: impl FnOnce() + Send) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    match rayon::ThreadPoolBuilder::new().num_threads(cores.saturating_sub(1).max(1)).build() {
        Ok(pool) => pool.install(work),
        // Without threads of its own it shares everybody's.
        Err(_) => work(),
    }
}

#[derive(Clone)]
struct Post {
    id: SessionId,
    events: Sender<(SessionId, Event)>,
    wake: Wake,
}

impl Post {
    fn send(&self, event: Event) {
        // Nobody listens any more once the window is closed.
        let _ = self.events.send((self.id, event));
        (self.wake)();
    }
}

/// An episode that goes on, or one that can only be looked at.
enum Track {
    Writing(Box<Driver>),
    Reading,
}

fn work(begin: Begin, catalog: Arc<Catalog>, inbox: &Receiver<Order>, post: &Post, brake: &Brake) {
    let begun = match begin {
        Begin::Open { path, look_only } => reopen(&path, look_only, catalog, post, brake),
        begin => begin_anew(begin, catalog, post, brake),
    };
    let (mut track, mut latest) = match begun {
        Ok(begun) => begun,
        Err(error) => return post.send(Event::Failed(error.to_string())),
    };
    post.send(Event::Activity(Activity::Idle));
    while let Ok(order) = inbox.recv() {
        if brake.forgotten.load(Ordering::Relaxed) {
            continue;
        }
        let Track::Writing(driver) = &mut track else {
            post.send(Event::Failed("this episode is read only; branch from it to continue".to_owned()));
            continue;
        };
        let done = match order {
            Order::Decide => {
                post.send(Event::Activity(Activity::Deciding));
                post.send(Event::Decided(Arc::new(driver.decide())));
                Ok(())
            }
            Order::Act(decision) => {
                post.send(Event::Activity(Activity::Acting));
                act(driver, (*decision).clone(), &mut latest, post)
            }
            Order::Run => run(driver, &mut latest, post, brake),
            #[cfg(test)]
            Order::Break => panic!("a broken order"),
        };
        if let Err(error) = done {
            post.send(Event::Failed(error.to_string()));
        }
        post.send(Event::Activity(Activity::Idle));
    }
    // The window has let go of the episode: end the recording and draw its figure.
    if let Track::Writing(driver) = track
        && !driver.episode().record().steps.is_empty()
    {
        let _ = driver.finish();
    }
}

fn run(driver: &mut Driver, latest: &mut Arc<Moment>, post: &Post, brake: &Brake) -> Result<()> {
    while !driver.episode().is_finished() && !brake.is_paused() {
        post.send(Event::Activity(Activity::Running));
        let decision = driver.decide();
        post.send(Event::Decided(Arc::new(decision.clone())));
        if brake.is_cancelled() {
            break;
        }
        act(driver, decision, latest, post)?;
    }
    Ok(())
}

fn act(driver: &mut Driver, decision: Decision, latest: &mut Arc<Moment>, post: &Post) -> Result<()> {
    let outcome = driver.act(decision)?;
    *latest = Arc::new(moment(driver.episode(), Some(outcome), Some(latest)));
    post.send(Event::Stepped(latest.clone()));
    Ok(())
}

/// The state of an episode and what led to it; what has not changed since `before` is shared with it.
fn moment(episode: &Episode, mut outcome: Option<StepOutcome>, before: Option<&Moment>) -> Moment {
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

/// Starts an episode, or one that shares the first steps of another.
fn begin_anew(begin: Begin, catalog: Arc<Catalog>, post: &Post, brake: &Brake) -> Result<(Track, Arc<Moment>)> {
    let (scene, config, steps, out) = match begin {
        Begin::Start { scene, config, out } => (*scene, *config, Vec::new(), out),
        Begin::Branch { of, steps, out } => {
            let shared: Vec<_> = of.steps.into_iter().take(steps).collect();
            (of.scene, of.config, shared, out)
        }
        Begin::Open { .. } => unreachable!("what is there already is reopened"),
    };
    let update = crate::driver::belief_update(Some(&config.belief), config.policy)?;
    let mut driver = Driver::start(scene, catalog, config, update.clone(), &out, Overwrite::Refuse, Frames::Filed)?;
    let mut moments = vec![Arc::new(moment(driver.episode(), None, None))];
    let shared = steps.len();
    for (done, step) in steps.into_iter().enumerate() {
        go_on(brake)?;
        post.send(Event::Activity(Activity::Opening { done, of: shared }));
        let outcome = driver.act(step.decision)?;
        let next = moment(driver.episode(), Some(outcome), moments.last().map(|moment| &**moment));
        moments.push(Arc::new(next));
    }
    let latest = moments[moments.len() - 1].clone();
    let (record, setup) = (driver.episode().record().clone(), setup(driver.episode(), Some(update), &moments[0])?);
    post.send(Event::Opened(Box::new(Opened { path: out, record, setup, moments, read_only: None })));
    Ok((Track::Writing(Box::new(driver)), latest))
}

/// Shows an episode as its files hold it, and then repeats its log: to go on with it, or, where that cannot be, to bring what
/// the files do not hold.
fn reopen(
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

/// Refuses to go on once nobody waits any more.
fn go_on(brake: &Brake) -> Result<()> {
    if brake.is_cancelled() { Err(Error::Usage("cancelled".to_owned())) } else { Ok(()) }
}

/// What does not change in an episode that began with `first`.
fn setup(episode: &Episode, update: Option<Arc<dyn BeliefUpdate>>, first: &Moment) -> Result<Setup> {
    let record = episode.record();
    let views = ViewArray::named(&record.config.views)?;
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
