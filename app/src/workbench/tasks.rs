//! Tasks that are done to the end whatever comes after them: exports, pictures. Each has a thread of its own, tells how
//! far it is, and can be cancelled.

use super::command::Level;
use super::latest::{Wake, words_of};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;

/// What a task ends with: a message for a person.
pub type Outcome = (Level, String);

/// How far a task is, and whether it shall go on.
#[derive(Default)]
struct Progress {
    /// The bits of the share that is done, an `f32` in 0 to 1.
    share: AtomicU32,
    cancelled: AtomicBool,
}

/// A task under way.
pub struct Task {
    /// What it does, in words: `Exporting to out/x`.
    pub title: String,
    progress: Arc<Progress>,
    thread: Option<JoinHandle<Outcome>>,
}

impl Task {
    /// The share that is done, 0 to 1.
    pub fn share(&self) -> f32 {
        f32::from_bits(self.progress.share.load(Ordering::Relaxed))
    }

    /// Tells it to give up; it still has to tidy away what is half-written.
    pub fn cancel(&self) {
        self.progress.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it was told to give up.
    pub fn is_cancelled(&self) -> bool {
        self.progress.cancelled.load(Ordering::Relaxed)
    }
}

/// The tasks under way.
#[derive(Default)]
pub struct Tasks {
    under_way: Vec<Task>,
}

impl Tasks {
    /// Starts a task. `work` is given a function to which it tells the share that is done and which answers whether to go
    /// on; a panic in it becomes an error message.
    ///
    /// # Errors
    /// When the system has no thread for it.
    pub fn start(
        &mut self,
        title: impl Into<String>,
        wake: Wake,
        work: impl FnOnce(&dyn Fn(f32) -> bool) -> Outcome + Send + 'static,
    ) -> std::io::Result<()> {
        let title = title.into();
        let progress = Arc::new(Progress::default());
        let (own, what) = (progress.clone(), title.clone());
        let thread = std::thread::Builder::new().name("task".to_owned()).spawn(move || {
            let watch = |share: f32| {
                own.share.store(share.to_bits(), Ordering::Relaxed);
                wake();
                !own.cancelled.load(Ordering::Relaxed)
            };
            let outcome = catch_unwind(AssertUnwindSafe(|| work(&watch)))
                .unwrap_or_else(|panic| (Level::Error, format!("{what} failed: {}", words_of(&*panic))));
            wake();
            outcome
        })?;
        self.under_way.push(Task { title, progress, thread: Some(thread) });
        Ok(())
    }

    /// The tasks under way, the oldest first.
    pub fn under_way(&self) -> &[Task] {
        &self.under_way
    }

    /// What the tasks that have ended since the last call have to say.
    pub fn ended(&mut self) -> Vec<Outcome> {
        let mut outcomes = Vec::new();
        self.under_way.retain_mut(|task| {
            if task.thread.as_ref().is_some_and(|thread| !thread.is_finished()) {
                return true;
            }
            outcomes.extend(task.thread.take().and_then(|thread| thread.join().ok()));
            false
        });
        outcomes
    }
}

impl Drop for Tasks {
    /// Tells all to give up and waits until nothing half-written is left.
    fn drop(&mut self) {
        self.under_way.iter().for_each(Task::cancel);
        for task in &mut self.under_way {
            let _ = task.thread.take().map(JoinHandle::join);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    fn wake() -> Wake {
        Arc::new(|| {})
    }

    fn end(tasks: &mut Tasks) -> Vec<Outcome> {
        while tasks.under_way().iter().any(|task| task.thread.as_ref().is_some_and(|thread| !thread.is_finished())) {
            std::thread::yield_now();
        }
        tasks.ended()
    }

    #[test]
    fn a_task_tells_how_far_it_is_and_gives_up_when_told() {
        let mut tasks = Tasks::default();
        let (begun, begins) = channel();
        let work = move |watch: &dyn Fn(f32) -> bool| {
            while watch(0.25) {
                let _ = begun.send(());
            }
            (Level::Info, "given up".to_owned())
        };
        tasks.start("Exporting", wake(), work).expect("a thread");
        begins.recv().expect("begun");
        assert_eq!(tasks.under_way()[0].share(), 0.25);
        assert!(tasks.ended().is_empty());
        tasks.under_way()[0].cancel();
        assert_eq!(end(&mut tasks), [(Level::Info, "given up".to_owned())]);
        assert!(tasks.under_way().is_empty());
    }

    #[test]
    fn a_task_that_panics_says_so_and_does_no_harm_to_others() {
        let mut tasks = Tasks::default();
        tasks.start("Exporting to x", wake(), |_| panic!("a bad disk")).expect("a thread");
        tasks.start("Other", wake(), |_| (Level::Info, "done".to_owned())).expect("a thread");
        let mut said = end(&mut tasks);
        said.sort_by(|a, b| a.1.cmp(&b.1));
        assert_eq!(said[0].1, "Exporting to x failed: a bad disk");
        assert_eq!(said[1].1, "done");
    }
}
