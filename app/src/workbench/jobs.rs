//! Work that the window asks for and does not wait for: floor maps, previews, gains by voxel, drawing in three
//! dimensions, files to write.
//!
//! One thread does one job after the other, the latest first. A job that waits is dropped when another of its kind
//! comes, since only the latest answer matters; what must not be dropped has a kind of its own.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};

/// Jobs of one kind replace each other while they wait.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JobKind {
    /// Floor maps of the state at the cursor.
    Maps,
    /// Floor maps of the second episode.
    OtherMaps,
    /// What a push would do.
    Preview,
    /// Where a view's gain comes from.
    Gain,
    /// Drawing in three dimensions.
    Space,
    /// Something that is never replaced, by a running number.
    Errand(u64),
}

type Work = Box<dyn FnOnce() + Send>;

#[derive(Default)]
struct Queue {
    waiting: VecDeque<(JobKind, Work)>,
    running: bool,
    closed: bool,
}

/// The thread and its queue.
pub struct Jobs {
    shared: Arc<(Mutex<Queue>, Condvar)>,
}

impl Jobs {
    /// Starts the thread. `broke` is told when a job breaks down, with the panic's words.
    pub fn start(broke: impl Fn(String) + Send + 'static) -> Self {
        let shared = Arc::new((Mutex::new(Queue::default()), Condvar::new()));
        let own = shared.clone();
        std::thread::Builder::new()
            .name("workbench jobs".to_owned())
            .spawn(move || {
                while let Some(work) = next(&own) {
                    if let Err(panic) = catch_unwind(AssertUnwindSafe(work)) {
                        broke(super::worker::words_of(&*panic));
                    }
                }
            })
            .expect("a thread can be started");
        Self { shared }
    }

    /// Adds a job in place of one of its kind that waits.
    pub fn add(&self, kind: JobKind, work: impl FnOnce() + Send + 'static) {
        let (queue, bell) = &*self.shared;
        let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
        queue.waiting.retain(|(other, _)| *other != kind);
        queue.waiting.push_back((kind, Box::new(work)));
        bell.notify_one();
    }

    /// Whether nothing waits and nothing is being done.
    pub fn is_idle(&self) -> bool {
        let queue = self.shared.0.lock().unwrap_or_else(PoisonError::into_inner);
        queue.waiting.is_empty() && !queue.running
    }
}

impl Drop for Jobs {
    fn drop(&mut self) {
        let (queue, bell) = &*self.shared;
        queue.lock().unwrap_or_else(PoisonError::into_inner).closed = true;
        bell.notify_one();
    }
}

/// Waits for a job; `None` once the window is closed and nothing is left that must not be dropped.
fn next((queue, bell): &(Mutex<Queue>, Condvar)) -> Option<Work> {
    let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
    queue.running = false;
    loop {
        if queue.closed {
            queue.waiting.retain(|(kind, _)| matches!(kind, JobKind::Errand(_)));
        }
        // Drawing last: it wants what the others make.
        let at = queue.waiting.iter().position(|(kind, _)| *kind != JobKind::Space);
        if let Some((_, work)) = at.and_then(|at| queue.waiting.remove(at)).or_else(|| queue.waiting.pop_front()) {
            queue.running = true;
            return Some(work);
        }
        if queue.closed {
            return None;
        }
        queue = bell.wait(queue).unwrap_or_else(PoisonError::into_inner);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn only_the_latest_of_a_kind_is_done_and_errands_always_are() {
        let (broke, broken) = channel();
        let jobs = Jobs::start(move |words| broke.send(words).expect("heard"));
        let (done, doing) = channel();
        let (go, gate) = channel::<()>();
        let say = |text: &'static str| {
            let done = done.clone();
            move || done.send(text).expect("heard")
        };
        jobs.add(JobKind::Maps, move || gate.recv().expect("opened"));
        // The gate job is running once nothing waits any more.
        while jobs.shared.0.lock().expect("queue").waiting.len() > 0 {
            std::thread::yield_now();
        }
        jobs.add(JobKind::Gain, say("first"));
        jobs.add(JobKind::Errand(1), say("errand"));
        jobs.add(JobKind::Gain, say("second"));
        jobs.add(JobKind::Preview, || panic!("a bad push"));
        jobs.add(JobKind::Errand(2), say("last"));
        assert!(!jobs.is_idle());
        go.send(()).expect("open");
        assert_eq!(doing.iter().take(3).collect::<Vec<_>>(), ["errand", "second", "last"]);
        assert_eq!(broken.recv().expect("told"), "a bad push");
    }
}
