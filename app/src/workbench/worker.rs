//! An episode's worker: the thread that owns its [`Driver`], takes orders and sends events.
//!
//! The window never waits for it while it is open; [`super::threads`] waits once it is closed. A panic inside an order becomes an [`Event::Panicked`]; what was written to the
//! episode's directory until then is whole.

use super::half_belief::HalfBelief;
use super::latest::words_of;
use super::session::{Activity, Moment, SessionId, Setup};
use super::threads::Threads;
use crate::driver::{Driver, update_of};
use nudge_core::belief::BeliefUpdate;
use nudge_core::camera::hidden_objects;
use nudge_core::episode::{Episode, EpisodeConfig, EpisodeDir, EpisodeRecord, Frames, Overwrite, StepOutcome, review};
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

pub use super::latest::Wake;

/// What stops a worker before it has done all that it was told.
#[derive(Default)]
struct Brake {
    /// Stop after the action that is under way.
    paused: AtomicBool,
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
                let broke = catch_unwind(AssertUnwindSafe(|| work(begin, catalog, &inbox, &post, &own)));
                if let Err(panic) = broke {
                    post.send(Event::Panicked(words_of(&*panic)));
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
        let _ = self.orders.send(order);
    }

    /// Stops a run after the action that it is at.
    pub fn pause(&self) {
        self.brake.paused.store(true, Ordering::Relaxed);
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
    let (mut track, mut latest) = match open(begin, catalog, post, brake) {
        Ok((track, opened)) => {
            let latest = opened.moments.last().expect("there is a prior").clone();
            post.send(Event::Opened(Box::new(opened)));
            (track, latest)
        }
        Err(error) => return post.send(Event::Failed(error.to_string())),
    };
    post.send(Event::Activity(Activity::Idle));
    while let Ok(order) = inbox.recv() {
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
fn moment(episode: &Episode, outcome: Option<StepOutcome>, before: Option<&Moment>) -> Moment {
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
    }
}

fn update_named(name: &str, config: &EpisodeConfig) -> Result<Arc<dyn BeliefUpdate>> {
    crate::driver::belief_update(Some(name), config.policy)
}

fn open(begin: Begin, catalog: Arc<Catalog>, post: &Post, brake: &Brake) -> Result<(Track, Opened)> {
    match begin {
        Begin::Start { scene, config, out } => {
            let update = update_named(&config.belief, &config)?;
            let driver =
                Driver::start(*scene, catalog, *config, update.clone(), &out, Overwrite::Refuse, Frames::Filed)?;
            let moments = vec![Arc::new(moment(driver.episode(), None, None))];
            let opened = opened(&out, driver.episode(), Some(update), moments, None)?;
            Ok((Track::Writing(Box::new(driver)), opened))
        }
        Begin::Branch { of, steps, out } => {
            let update = update_named(&of.config.belief, &of.config)?;
            let mut driver =
                Driver::start(of.scene, catalog, of.config, update.clone(), &out, Overwrite::Refuse, Frames::Filed)?;
            let mut moments = vec![Arc::new(moment(driver.episode(), None, None))];
            for (done, step) in of.steps.into_iter().take(steps).enumerate() {
                progress(post, brake, done, steps)?;
                let outcome = driver.act(step.decision)?;
                let next = moment(driver.episode(), Some(outcome), moments.last().map(|moment| &**moment));
                moments.push(Arc::new(next));
            }
            let opened = opened(&out, driver.episode(), Some(update), moments, None)?;
            Ok((Track::Writing(Box::new(driver)), opened))
        }
        Begin::Open { path, look_only } => {
            let record = EpisodeDir::open(&path)?.record()?;
            let of = record.steps.len();
            let look = |update: Option<Arc<dyn BeliefUpdate>>, why: String| {
                let mut moments = Vec::with_capacity(of + 1);
                let mut watch = watch(post, brake, of, &mut moments);
                let (episode, difference) = review(&path, catalog.clone(), update.clone(), &mut watch)?;
                drop(watch);
                let reason = difference.map_or(why, |difference| {
                    format!("repeating its actions gives another result here ({difference}); shown is what it holds")
                });
                Ok((Track::Reading, opened(&path, &episode, update, moments, Some(reason))?))
            };
            // Networks that are not here, cannot be read, or have other weights than those that made it.
            let update = match update_of(&record.config.belief) {
                Ok(Ok(update)) => match record.other_weights(&*update) {
                    None => update,
                    Some(words) => return look(None, format!("{words}; {HELD}")),
                },
                Ok(Err(why)) => return look(None, format!("{why}; {HELD}")),
                Err(error) => return look(None, format!("{error}; {HELD}")),
            };
            if look_only {
                return look(Some(update), "nothing in its directory shall change".to_owned());
            }
            let mut moments = Vec::with_capacity(of + 1);
            let resumed =
                Driver::resume(&path, catalog.clone(), update.clone(), &mut watch(post, brake, of, &mut moments));
            match resumed {
                Ok(driver) => {
                    let opened = opened(&path, driver.episode(), Some(update), moments, None)?;
                    Ok((Track::Writing(Box::new(driver)), opened))
                }
                // What cannot be written, is being written by another run, or is of another version or machine.
                Err(refused @ (Error::Io { .. } | Error::Input { .. } | Error::Check(_))) => {
                    look(Some(update), refused.to_string())
                }
                Err(error) => Err(error),
            }
        }
    }
}

/// What an episode lacks whose belief update is not here.
const HELD: &str =
    "shown is what it holds: pushes are not predicted, and after one every voxel counts as unseen in Gains";

/// Keeps every state of an episode that is being repeated, and tells how far it is.
fn watch<'a>(
    post: &'a Post,
    brake: &'a Brake,
    of: usize,
    moments: &'a mut Vec<Arc<Moment>>,
) -> impl FnMut(&Episode, Option<&StepOutcome>) -> Result<()> + 'a {
    move |episode, outcome| {
        progress(post, brake, episode.record().steps.len(), of)?;
        let next = moment(episode, outcome.cloned(), moments.last().map(|moment| &**moment));
        moments.push(Arc::new(next));
        Ok(())
    }
}

fn progress(post: &Post, brake: &Brake, done: usize, of: usize) -> Result<()> {
    if brake.is_cancelled() {
        return Err(Error::Usage("cancelled".to_owned()));
    }
    post.send(Event::Activity(Activity::Opening { done, of }));
    Ok(())
}

fn opened(
    path: &Path,
    episode: &Episode,
    update: Option<Arc<dyn BeliefUpdate>>,
    moments: Vec<Arc<Moment>>,
    read_only: Option<String>,
) -> Result<Opened> {
    let record = episode.record().clone();
    let views = record.view_array()?;
    let hidden = hidden_objects(&record.scene.shelf, &moments[0].bodies, &views);
    let name = |id: &ObjectId| {
        let object = record.scene.objects.get(usize::from(id.0));
        format!("{}#{}", object.map_or("object", |object| object.class.as_str()), id.0)
    };
    let setup = Setup {
        catalog: Arc::new(episode.catalog().clone()),
        views: Arc::new(views),
        update,
        arm: episode.arm().clone(),
        unreachable: Arc::new(episode.unreachable_views().to_vec()),
        hidden: Arc::new(hidden.iter().map(name).collect()),
    };
    Ok(Opened { path: path.to_owned(), record, setup, moments, read_only })
}
