//! The threads of episodes that the window has let go of: they still end a recording and draw a figure, and nobody may
//! leave before they have.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

type List = Vec<(PathBuf, JoinHandle<()>)>;

/// The episodes' threads, each with the directory that it writes. All clones are the same list.
#[derive(Clone, Debug, Default)]
pub struct Threads(Arc<Mutex<List>>);

impl Threads {
    /// Remembers a thread.
    pub fn add(&self, writes: &Path, thread: JoinHandle<()>) {
        let mut list = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        list.retain(|(_, thread)| !thread.is_finished());
        list.push((plain(writes), thread));
    }

    /// Takes the threads that write a directory, to be waited for before somebody else does.
    pub fn take(&self, writes: &Path) -> Vec<JoinHandle<()>> {
        let wanted = plain(writes);
        let mut list = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (taken, kept) = std::mem::take(&mut *list).into_iter().partition(|(path, _)| *path == wanted);
        *list = kept;
        taken.into_iter().map(|(_, thread): (PathBuf, _)| thread).collect()
    }

    /// Waits for all of them; to be called once no window gives them orders any more.
    pub fn join(&self) {
        let list = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        for (_, thread) in list {
            // A panic was told of already.
            let _ = thread.join();
        }
    }
}

/// A directory by one name, whether it is there yet or not.
pub fn plain(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    match (absolute.canonicalize(), absolute.parent(), absolute.file_name()) {
        (Ok(canonical), ..) => canonical,
        (Err(_), Some(parent), Some(name)) => plain(parent).join(name),
        _ => absolute,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_are_found_by_what_they_write_and_all_are_waited_for() {
        let folder = tempfile::tempdir().expect("folder");
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        let threads = Threads::default();
        let (open, gate) = std::sync::mpsc::channel::<()>();
        threads.add(&a, std::thread::spawn(move || while gate.recv().is_ok() {}));
        let done = b.clone();
        let other = threads.clone();
        other.add(&b, std::thread::spawn(move || std::fs::write(done, "done").expect("written")));
        assert!(threads.take(&folder.path().join("c")).is_empty());
        let of_a = threads.take(&a);
        assert_eq!(of_a.len(), 1);
        drop(open);
        of_a.into_iter().for_each(|thread| thread.join().expect("ended"));
        threads.join();
        assert!(b.exists());
    }
}
