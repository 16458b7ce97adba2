//! An episode's worker: the thread that owns its [`Driver`], takes orders and sends events.
//!
//! The window never waits for it while it is open; [`super::threads`] waits once it is closed. A panic inside an order becomes an [`Event::Panicked`]; what was written to the
//! episode's directory until then is whole.

mod reopen;
pub mod told;

use super::latest::words_of;
use super::session::{Activity, Moment, SessionId};
use super::threads::Threads;
use crate::driver::Driver;
use nudge_core::Result;
use nudge_core::episode::{Episode, EpisodeConfig, EpisodeRecord, Frames, Overwrite, StepRecord};
use nudge_core::plan::Decision;
use nudge_core::scene::{Catalog, Scene};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, Sender, channel};
use told::{Brake, Post, Track, go_on, moment, setup};

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

pub use super::latest::Wake;
pub use told::{Checked, Event, Opened};

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

fn work(begin: Begin, catalog: Arc<Catalog>, inbox: &Receiver<Order>, post: &Post, brake: &Brake) {
    let begun = match begin {
        Begin::Open { path, look_only } => reopen::reopen(&path, look_only, catalog, post, brake),
        Begin::Start { scene, config, out } => begin_anew(*scene, *config, Vec::new(), &out, catalog, post, brake),
        Begin::Branch { of, steps, out } => {
            let shared = of.steps.into_iter().take(steps).collect();
            begin_anew(of.scene, of.config, shared, &out, catalog, post, brake)
        }
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

/// Starts an episode, which repeats the steps that it shares with another.
fn begin_anew(
    scene: Scene,
    config: EpisodeConfig,
    steps: Vec<StepRecord>,
    out: &Path,
    catalog: Arc<Catalog>,
    post: &Post,
    brake: &Brake,
) -> Result<(Track, Arc<Moment>)> {
    let update = crate::driver::belief_update(Some(&config.belief), config.policy)?;
    let mut driver =
        Driver::start(Episode::new(scene, catalog, config, update.clone())?, out, Overwrite::Refuse, Frames::Filed)?;
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
    post.send(Event::Opened(Box::new(Opened { path: out.to_owned(), record, setup, moments, read_only: None })));
    Ok((Track::Writing(Box::new(driver)), latest))
}
