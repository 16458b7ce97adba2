//! The folders that the program writes to.

use super::Problem;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Less room than this is told, bytes: an episode of 40 steps takes up to 100 MB while it is written.
const LEAST_ROOM: u64 = 500_000_000;

/// A folder that the program writes to.
#[derive(Clone, Debug, Serialize)]
pub struct Folder {
    /// For what.
    pub purpose: &'static str,
    /// The folder; it may not be there yet.
    pub path: PathBuf,
    /// Why it cannot be written to; `null` if it can.
    pub fault: Option<String>,
    /// Room on its disk that this user may fill, bytes; `null` where the system does not tell.
    pub free_bytes: Option<u64>,
    /// What to do where it cannot be written to.
    #[serde(skip)]
    remedy: &'static str,
}

impl Folder {
    /// Looks at a folder: writes a file into it, or into the first folder above it that is there, and removes it again.
    pub(super) fn of(purpose: &'static str, path: PathBuf, remedy: &'static str) -> Self {
        let path = std::path::absolute(&path).unwrap_or(path);
        let there = path.ancestors().find(|above| above.exists()).unwrap_or(Path::new("/"));
        let written = tempfile::Builder::new().prefix(nudge_core::files::TEMPORARY).tempfile_in(there);
        let fault = written.and_then(tempfile::NamedTempFile::close).err().map(|error| {
            let words = error.to_string();
            // The path in the system's words is that of a file that is not there any more.
            words.split(" at path").next().unwrap_or(&words).to_owned()
        });
        let free_bytes = free_bytes(there);
        Self { purpose, fault, free_bytes, remedy, path }
    }

    /// What is wrong with it.
    pub(super) fn problems(&self) -> impl Iterator<Item = Problem> + use<> {
        let (path, remedy) = (self.path.display(), self.remedy);
        let fault = self
            .fault
            .as_ref()
            .map(|why| Problem::new(format!("{path}: {} cannot be written there: {why}", self.purpose), remedy));
        let full = self.free_bytes.filter(|&free| free < LEAST_ROOM && self.fault.is_none()).map(|free| {
            Problem::new(format!("{path}: only {} MB are free", free / 1_000_000), "make room on its disk")
        });
        fault.into_iter().chain(full)
    }
}

/// All of them.
pub(super) fn all() -> Vec<Folder> {
    let episodes = Folder::of("episodes", "out".into(), "go to another folder, or name one with --out");
    let temporary = Folder::of("temporary files", std::env::temp_dir(), "name another folder with TMPDIR");
    let remembered = remembered()
        .map(|path| Folder::of("what the window remembers", path, "name another folder with XDG_DATA_HOME"));
    [episodes, temporary].into_iter().chain(remembered).collect()
}

/// Where the window keeps what outlasts the program; nowhere if there is no home folder either.
#[cfg(feature = "workbench")]
fn remembered() -> Option<PathBuf> {
    re_viewer::external::eframe::storage_dir(crate::workbench::APP_ID)
}

#[cfg(not(feature = "workbench"))]
fn remembered() -> Option<PathBuf> {
    None
}

#[cfg(unix)]
fn free_bytes(folder: &Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    Some(disk.f_bavail.saturating_mul(disk.f_frsize))
}

#[cfg(not(unix))]
fn free_bytes(_folder: &Path) -> Option<u64> {
    None
}
