//! Work in the background of which only the latest matters: while one job runs, newer ones replace each other in line.
//!
//! A running job is let finish, so that answers keep coming while a person drags; [`Latest::hurry`] tells it to give up
//! when its answer is of no use any more. What must be done whatever comes after it is a task ([`super::tasks`]).

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// What is called when an answer is there, for example to draw a frame.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Lets a job see whether anybody still waits for it.
#[derive(Clone)]
pub struct Waiting {
    number: u64,
    oldest_wanted: Arc<AtomicU64>,
}

impl Waiting {
    /// Whether the job's answer is still wanted.
    pub fn go_on(&self) -> bool {
        self.number >= self.oldest_wanted.load(Ordering::Relaxed)
    }
}

type Job<A> = Box<dyn FnOnce(&Waiting) -> Option<A> + Send>;

struct Line<A> {
    asked: u64,
    next: Option<Job<A>>,
    is_running: bool,
    answer: Option<(u64, A)>,
    broke: Option<String>,
    is_closed: bool,
    wake: Option<Wake>,
}

struct Shared<A> {
    line: Mutex<Line<A>>,
    arrived: Condvar,
    oldest_wanted: Arc<AtomicU64>,
}

impl<A> Shared<A> {
    fn line(&self) -> MutexGuard<'_, Line<A>> {
        // Jobs run outside the lock: what it guards is whole even after a panic.
        self.line.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A thread that does the latest of the jobs that it is given.
pub struct Latest<A> {
    name: &'static str,
    shared: Arc<Shared<A>>,
    is_started: bool,
}

impl<A: Send + 'static> Latest<A> {
    /// A line without a thread; that starts with the first job and ends with this value.
    pub fn new(name: &'static str) -> Self {
        let line =
            Line { asked: 0, next: None, is_running: false, answer: None, broke: None, is_closed: false, wake: None };
        let shared = Shared { line: Mutex::new(line), arrived: Condvar::new(), oldest_wanted: Arc::default() };
        Self { name, shared: Arc::new(shared), is_started: false }
    }

    /// Calls `wake` after every answer.
    pub fn wake_with(&self, wake: Wake) {
        self.shared.line().wake = Some(wake);
    }

    /// Puts a job in line in place of the one that waits there; returns its number.
    pub fn ask(&mut self, job: impl FnOnce(&Waiting) -> Option<A> + Send + 'static) -> u64 {
        if !self.is_started {
            let shared = self.shared.clone();
            let thread = std::thread::Builder::new().name(self.name.to_owned()).spawn(move || work(&shared));
            // Without a thread there is no answer, which is shown as one that does not come.
            self.is_started = thread.is_ok();
        }
        let mut line = self.shared.line();
        line.asked += 1;
        line.next = Some(Box::new(job));
        self.shared.arrived.notify_one();
        line.asked
    }

    /// Tells every job but the latest to give up.
    pub fn hurry(&self) {
        self.shared.oldest_wanted.store(self.shared.line().asked, Ordering::Relaxed);
    }

    /// Tells every job to give up and drops what was answered.
    pub fn forget(&self) {
        let mut line = self.shared.line();
        line.next = None;
        line.answer = None;
        line.asked += 1;
        self.shared.oldest_wanted.store(line.asked, Ordering::Relaxed);
    }

    /// The newest answer, once, with the number of its job.
    pub fn take(&self) -> Option<(u64, A)> {
        self.shared.line().answer.take()
    }

    /// Why the last job that broke down did, once.
    pub fn broke(&self) -> Option<String> {
        self.shared.line().broke.take()
    }

    /// Whether a job runs or waits.
    pub fn is_busy(&self) -> bool {
        let line = self.shared.line();
        line.is_running || line.next.is_some()
    }
}

impl<A> Drop for Latest<A> {
    fn drop(&mut self) {
        let mut line = self.shared.line();
        line.is_closed = true;
        line.next = None;
        line.wake = None;
        self.shared.oldest_wanted.store(u64::MAX, Ordering::Relaxed);
        self.shared.arrived.notify_one();
    }
}

fn work<A>(shared: &Shared<A>) {
    loop {
        let (job, waiting) = {
            let mut line = shared.line();
            loop {
                if line.is_closed {
                    return;
                }
                if let Some(job) = line.next.take() {
                    line.is_running = true;
                    break (job, Waiting { number: line.asked, oldest_wanted: shared.oldest_wanted.clone() });
                }
                line = shared.arrived.wait(line).unwrap_or_else(PoisonError::into_inner);
            }
        };
        let done = catch_unwind(AssertUnwindSafe(|| job(&waiting)));
        let wake = {
            let mut line = shared.line();
            line.is_running = false;
            match done {
                Ok(Some(answer)) if waiting.go_on() => line.answer = Some((waiting.number, answer)),
                Ok(_) => {}
                // A job that panics has no answer; the next one may have.
                Err(panic) => line.broke = Some(words_of(&*panic)),
            }
            line.wake.clone()
        };
        if let Some(wake) = wake {
            wake();
        }
    }
}

/// A panic's own words.
pub fn words_of(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    text.unwrap_or("no reason was given").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn the_latest_job_is_done_and_the_ones_between_are_not() {
        let mut latest: Latest<u32> = Latest::new("test");
        let (woken, wakes) = channel();
        latest.wake_with(Arc::new(move || woken.send(()).expect("the test listens")));
        let (begun, begins) = channel();
        let (release, released) = channel::<()>();
        latest.ask(move |_| {
            begun.send(()).expect("the test listens");
            released.recv().expect("the test speaks");
            Some(1)
        });
        begins.recv().expect("begun");
        latest.ask(|_| unreachable!("a newer job took its place"));
        let last = latest.ask(|_| Some(3));
        assert!(latest.is_busy());
        release.send(()).expect("the job listens");
        wakes.recv().expect("first answer");
        wakes.recv().expect("last answer");
        assert_eq!(latest.take(), Some((last, 3)));
        assert!(!latest.is_busy() && latest.take().is_none());
    }

    #[test]
    fn a_job_in_a_hurry_gives_up_and_a_panic_is_no_answer() {
        let mut latest: Latest<u32> = Latest::new("test");
        let (woken, wakes) = channel();
        latest.wake_with(Arc::new(move || woken.send(()).expect("the test listens")));
        let (begun, begins) = channel();
        latest.ask(move |waiting| {
            begun.send(()).expect("the test listens");
            while waiting.go_on() {
                std::thread::yield_now();
            }
            Some(1)
        });
        begins.recv().expect("begun");
        latest.ask(|_| panic!("a broken job"));
        latest.hurry();
        wakes.recv().expect("gave up");
        wakes.recv().expect("panicked");
        assert_eq!(latest.take(), None);
        assert_eq!(latest.broke().as_deref(), Some("a broken job"));
        assert_eq!(latest.broke(), None, "told once");
        let last = latest.ask(|_| Some(5));
        wakes.recv().expect("the thread is still there");
        assert_eq!(latest.take(), Some((last, 5)));
    }
}
