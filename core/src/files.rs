//! Atomic file writing: a file is there whole or not at all.
//!
//! A file is written beside its place under a name that starts with [`TEMPORARY`] and then renamed over it. A process
//! that is killed leaves at most one such leftover, which the next writer removes.

use crate::{Error, Result};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// How the names of half-written files start.
pub const TEMPORARY: &str = ".partial-";

/// Writes `bytes` to `path`, whole or not at all.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let temporary = temporary_of(path);
    let written = write_and_rename(&temporary, path, bytes);
    if written.is_err() && !cut::is_cut() {
        let _ = fs::remove_file(&temporary);
    }
    written.map_err(|source| Error::io(path, source))
}

fn write_and_rename(temporary: &Path, path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    cut::point()?;
    let mut file = fs::File::create(temporary)?;
    cut::point()?;
    let (first, second) = bytes.split_at(bytes.len() / 2);
    file.write_all(first)?;
    cut::point()?;
    file.write_all(second)?;
    drop(file);
    cut::point()?;
    fs::rename(temporary, path)?;
    cut::point()
}

/// What the file or folder that is to stand at `path` is called until it is whole.
pub fn temporary_of(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{TEMPORARY}{name}"))
}

/// Removes a file; that it is not there is fine.
pub fn remove_if_there(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path, error)),
        _ => Ok(()),
    }
}

/// Names of what is in a directory; nothing for one that is not there.
pub fn names_in(path: &Path) -> Result<Vec<String>> {
    match fs::read_dir(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(Error::io(path, error)),
        Ok(entries) => {
            let mut names = Vec::new();
            for entry in entries {
                names.push(entry.map_err(|error| Error::io(path, error))?.file_name().to_string_lossy().into_owned());
            }
            names.sort();
            Ok(names)
        }
    }
}

/// Stops writing at a chosen point, as a kill would, so that tests can look at what is left.
#[cfg(test)]
pub mod cut {
    use std::cell::Cell;

    thread_local! {
        static LEFT: Cell<Option<usize>> = const { Cell::new(None) };
    }

    /// Lets this thread pass `points` points and stops it at the next.
    pub fn after(points: usize) {
        LEFT.set(Some(points));
    }

    /// Lets this thread write again.
    pub fn never() {
        LEFT.set(None);
    }

    pub(super) fn point() -> std::io::Result<()> {
        match LEFT.get() {
            None => Ok(()),
            Some(0) => Err(std::io::Error::other("cut")),
            Some(left) => {
                LEFT.set(Some(left - 1));
                Ok(())
            }
        }
    }

    pub(super) fn is_cut() -> bool {
        LEFT.get() == Some(0)
    }
}

#[cfg(not(test))]
mod cut {
    pub(super) fn point() -> std::io::Result<()> {
        Ok(())
    }

    pub(super) fn is_cut() -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_old_or_new_at_every_cut_and_never_half() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("file");
        write_atomically(&path, b"old").expect("written");
        for points in 0..5 {
            cut::after(points);
            assert!(write_atomically(&path, b"new").is_err());
            cut::never();
            let content = fs::read(&path).expect("read");
            assert_eq!(content, if points < 4 { b"old" } else { b"new" }, "cut after {points}");
        }
        write_atomically(&path, b"new").expect("written");
        assert_eq!(names_in(directory.path()).expect("listed"), ["file"]);
    }

    #[test]
    fn a_failed_write_names_the_file_and_leaves_nothing() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("nowhere").join("file");
        let error = write_atomically(&path, b"new").expect_err("no directory");
        assert!(error.to_string().starts_with(&path.display().to_string()), "{error}");
        assert_eq!(error.exit_code(), 2);
    }
}
