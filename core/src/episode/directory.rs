//! The directory of an episode, written step by step.
//!
//! ```text
//! episode.json        what was decided, done and scored; the index of everything else
//! beliefs/NNN.npz     the belief after NNN actions, 000 the prior
//! truth/NNN.npz       the truth at the start (000) and after every push, where it is known
//! frames/NNN.frame    what the camera gave in step NNN, a look; optional
//! frames/NNN.push     what the arm swept in step NNN, a push; optional
//! checkpoints/NNN.state   the exact state after the last step, from which a stopped run goes on
//! episode.rrd, summary.png, notes.json, board.toml      written by others, removed with the episode they belong to
//! ```
//!
//! Every file is there whole or not at all, and `episode.json` is renamed last: everything that it names is there. A
//! run that is killed at any moment leaves a directory that opens and resumes, or, before its first `episode.json`, one
//! that a new run may start in.

use super::checkpoint::Checkpoint;
use super::estimate::Told;
use super::machine::Episode;
use super::npz::{self, Precision, StoredTruth};
use super::record::{EpisodeRecord, StepRecord};
use super::told_file;
use crate::belief::Belief;
use crate::files::{TEMPORARY, names_in, remove_if_there, write_atomically};
use crate::grid::Grid;
use crate::plan::Action;
use crate::world::TruthMap;
use crate::{Error, Result};
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;

const DOCUMENT: &str = "episode.json";
const BELIEFS: &str = "beliefs";
const TRUTH: &str = "truth";
const FRAMES: &str = "frames";
const CHECKPOINTS: &str = "checkpoints";
/// The folders of numbered files, and how the names in them end.
const NUMBERED: [(&str, &str); 5] =
    [(BELIEFS, "npz"), (TRUTH, "npz"), (FRAMES, "frame"), (FRAMES, "push"), (CHECKPOINTS, "state")];
/// The folders, each once.
const FOLDERS: [&str; 4] = [BELIEFS, TRUTH, FRAMES, CHECKPOINTS];
/// Files of an episode that other parts write.
const COMPANIONS: [&str; 4] = ["episode.rrd", "summary.png", "notes.json", "board.toml"];

/// What to do with an episode that is already there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overwrite {
    /// Refuse.
    Refuse,
    /// Remove the old episode's files, and no others, and start anew.
    Replace,
}

/// Whether what belief updates are told (frames, and what the arm swept) is filed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Frames {
    /// It is; [`infer`](super::infer()) needs it.
    #[default]
    Filed,
    /// It is not.
    Left,
}

/// What a path holds, seen by someone who wants to write an episode there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DirectoryState {
    /// Nothing: no directory, or an empty one.
    Free,
    /// The first files of a run that was stopped before its first `episode.json`: as good as free.
    Begun,
    /// An episode.
    Episode,
    /// Files of an episode without its `episode.json`.
    Unindexed,
    /// Something else; the name of a file or directory that is no episode's.
    Foreign(String),
}

/// The directory of an episode: [`create`](Self::create) to write one, [`open`](Self::open) to read one.
#[derive(Debug)]
pub struct EpisodeDir {
    path: PathBuf,
    precision: Precision,
    /// Whether what belief updates are told is filed.
    frames: Frames,
    grid: OnceLock<Grid>,
    /// Held while this process writes here.
    lock: Option<File>,
}

impl EpisodeDir {
    /// What `path` contains.
    pub fn state(path: impl AsRef<Path>) -> Result<DirectoryState> {
        let path = path.as_ref();
        if path.exists() && !path.is_dir() {
            return Err(Error::input(path, "", "is a file, not a directory"));
        }
        let names = names_in(path)?;
        let numbered = numbered_files(path)?;
        let is_known = |name: &str| {
            name == DOCUMENT || FOLDERS.contains(&name) || COMPANIONS.contains(&name) || name.starts_with(TEMPORARY)
        };
        if names.iter().any(|name| name == DOCUMENT) {
            let is_ours = is_document(&path.join(DOCUMENT))? || !numbered.is_empty();
            return Ok(if is_ours { DirectoryState::Episode } else { DirectoryState::Foreign(DOCUMENT.to_owned()) });
        }
        let stranger = names.iter().find(|name| !is_known(name) || *name == "notes.json");
        if let Some(stranger) = stranger.cloned().or(stranger_inside(path)?) {
            return Ok(DirectoryState::Foreign(stranger));
        }
        Ok(if names.is_empty() {
            DirectoryState::Free
        } else if numbered.iter().all(|file| file.index == 0) {
            DirectoryState::Begun
        } else {
            DirectoryState::Unindexed
        })
    }

    /// Prepares `path` for a new episode, and makes the directory if need be. Refuses a directory that holds anything
    /// but an episode, and an episode unless it may be replaced. Only files of an episode are ever removed.
    pub fn create(path: impl AsRef<Path>, overwrite: Overwrite) -> Result<Self> {
        let path = path.as_ref();
        match Self::state(path)? {
            DirectoryState::Free | DirectoryState::Begun => {}
            DirectoryState::Foreign(name) => {
                let message = format!("is not empty and holds no episode (there is {name}): choose another directory");
                return Err(Error::input(path, "", message));
            }
            DirectoryState::Episode | DirectoryState::Unindexed if overwrite == Overwrite::Replace => {}
            DirectoryState::Episode => {
                let message = "holds an episode: --resume goes on with it, --force replaces it";
                return Err(Error::input(path, "", message));
            }
            DirectoryState::Unindexed => {
                let message = "holds beliefs without their episode.json: --force replaces them";
                return Err(Error::input(path, "", message));
            }
        }
        fs::create_dir_all(path).map_err(|error| Error::io(path, error))?;
        let directory = Self::at(path, lock(path)?);
        directory.remove_episode()?;
        for part in [BELIEFS, TRUTH] {
            let part = path.join(part);
            fs::create_dir_all(&part).map_err(|error| Error::io(&part, error))?;
        }
        Ok(directory)
    }

    /// Files a whole episode at once in a new or empty directory, float16: `states` are belief and truth after every
    /// number of actions, the prior first.
    ///
    /// # Errors
    /// Those of [`create`](Self::create), and for states that do not go with the steps of the record.
    pub fn store<'a>(
        path: impl AsRef<Path>,
        record: &EpisodeRecord,
        states: impl IntoIterator<Item = (Belief, Option<&'a TruthMap>)>,
    ) -> Result<Self> {
        let directory = Self::create(path, Overwrite::Refuse)?;
        let mut count = 0;
        for (belief, truth) in states {
            let has_new_truth = record.has_new_truth(count);
            directory.write_arrays(count, &belief, truth.filter(|_| has_new_truth))?;
            count += 1;
        }
        if count != record.steps.len() + 1 {
            return Err(Error::Usage(format!("{count} states for {} steps", record.steps.len())));
        }
        directory.write_document(record)?;
        Ok(directory)
    }

    /// Keeps beliefs with the given precision; the default is float16.
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.precision = precision;
        self
    }

    /// Files what belief updates are told, or leaves it; the default is to file it.
    pub fn with_frames(mut self, frames: Frames) -> Self {
        self.frames = frames;
        self
    }

    /// Opens an episode for reading, also one that is still being written. Checks that `episode.json` is well-formed
    /// and that every file it tells of is a whole archive; leftovers of a killed run are removed.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let directory = Self::at(path, None);
        let record = directory.record()?;
        for index in 0..=record.steps.len() {
            npz::check_archive(&directory.belief_path(index), &["occupancy", "semantics"])?;
        }
        for index in record.truth_indices() {
            npz::check_archive(&directory.truth_path(index), &["occupancy", "labels"])?;
        }
        // A leftover is stale only if nobody is writing; a directory that cannot be written keeps its leftovers.
        if let Ok(Some(_writing)) = lock(path) {
            let _ = directory.remove_leftovers();
        }
        Ok(directory)
    }

    /// Opens an episode to continue writing: no other run may be writing it. Files beyond the last step in
    /// `episode.json` are removed.
    pub(super) fn open_to_write(path: &Path) -> Result<Self> {
        let mut directory = Self::open(path)?;
        directory.lock = lock(path)?;
        directory.remove_leftovers()?;
        let steps = directory.record()?.steps.len();
        for file in numbered_files(path)?.into_iter().filter(|file| file.index > steps) {
            remove_if_there(&file.path)?;
        }
        directory.frames = if path.join(FRAMES).is_dir() { Frames::Filed } else { Frames::Left };
        directory.precision = directory.read_belief_as_kept(0)?.1;
        Ok(directory)
    }

    fn at(path: &Path, lock: Option<File>) -> Self {
        Self {
            path: path.to_owned(),
            precision: Precision::default(),
            frames: Frames::default(),
            grid: OnceLock::new(),
            lock,
        }
    }

    /// The directory's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes what the last action brought: what the belief was told, a checkpoint, the belief, after a push the truth, and
    /// then `episode.json`. Before the first action it writes the prior. To be called once after [`Episode::new`] and after
    /// every [`Episode::act`].
    ///
    /// The time it takes is added to the step's `record` seconds, but for the writing of `episode.json` itself.
    pub fn write(&mut self, episode: &mut Episode) -> Result<()> {
        let started = Instant::now();
        let index = episode.record().steps.len();
        if self.frames == Frames::Filed {
            self.make_folder(FRAMES)?;
            if let Some(told) = episode.told().filter(|_| index > 0) {
                write_atomically(&self.numbered(FRAMES, index, told.extension()), &told.to_bytes())?;
            }
        }
        if let Some(checkpoint) = Checkpoint::of(episode).filter(|_| index > 0) {
            self.make_folder(CHECKPOINTS)?;
            write_atomically(&self.checkpoint_path(index), &checkpoint.to_bytes())?;
        }
        self.write_arrays(index, episode.belief(), episode.truth().filter(|_| episode.record().has_new_truth(index)))?;
        episode.add_record_seconds(started.elapsed().as_secs_f64());
        self.write_document(episode.record())?;
        // The one before has done its duty.
        index.checked_sub(1).map_or(Ok(()), |before| remove_if_there(&self.checkpoint_path(before)))
    }

    /// Removes the checkpoint of an episode that needs none any more: all of it is written.
    pub fn finish(&self) -> Result<()> {
        for file in numbered_files(&self.path)?.iter().filter(|file| file.folder == CHECKPOINTS) {
            remove_if_there(&file.path)?;
        }
        let _ = fs::remove_dir(self.path.join(CHECKPOINTS));
        Ok(())
    }

    fn make_folder(&self, name: &str) -> Result<()> {
        let folder = self.path.join(name);
        fs::create_dir_all(&folder).map_err(|error| Error::io(&folder, error))
    }

    pub(super) fn write_arrays(&self, index: usize, belief: &Belief, truth: Option<&TruthMap>) -> Result<()> {
        write_atomically(&self.belief_path(index), &npz::belief_archive(belief, self.precision))?;
        match truth {
            Some(truth) => write_atomically(&self.truth_path(index), &npz::truth_archive(truth)),
            None => Ok(()),
        }
    }

    pub(super) fn write_document(&self, record: &EpisodeRecord) -> Result<()> {
        write_atomically(&self.path.join(DOCUMENT), record.to_json().as_bytes())
    }

    /// Reads `episode.json` as it is now.
    pub fn record(&self) -> Result<EpisodeRecord> {
        let path = self.path.join(DOCUMENT);
        let text = match fs::read(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound && self.path.is_dir() => {
                return Err(Error::input(&self.path, "", "holds no episode (no episode.json)"));
            }
            read => read.map_err(|error| Error::io(&path, error))?,
        };
        let text = String::from_utf8(text).map_err(|error| {
            let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            let line = 1 + good.iter().filter(|byte| **byte == b'\n').count();
            Error::input(&path, format!("line {line}"), "is not UTF-8")
        })?;
        let record = EpisodeRecord::from_json(&text, &path)?;
        let _ = self.grid.set(record.scene.grid());
        Ok(record)
    }

    /// The belief after `actions` actions (0 is the prior), as exactly as it was kept.
    pub fn read_belief(&self, actions: usize) -> Result<Belief> {
        Ok(self.read_belief_as_kept(actions)?.0)
    }

    pub(super) fn read_belief_as_kept(&self, actions: usize) -> Result<(Belief, Precision)> {
        let path = self.belief_path(actions);
        let bytes = fs::read(&path).map_err(|error| Error::io(&path, error))?;
        npz::read_belief(&bytes, &path, self.grid()?)
    }

    /// The truth that holds after `actions` actions: the one filed at the last push until then, or at the start.
    pub fn read_truth(&self, actions: usize) -> Result<StoredTruth> {
        let filed = numbered_files(&self.path)?;
        let latest = filed.iter().filter(|file| file.folder == TRUTH && file.index <= actions).map(|file| file.index);
        let path = self.truth_path(latest.max().unwrap_or(0));
        let bytes = fs::read(&path).map_err(|error| Error::io(&path, error))?;
        npz::read_truth(&bytes, &path, self.grid()?)
    }

    /// Whether there are frames to infer from.
    ///
    /// # Errors
    /// [`Error::Input`] that says what is missing.
    pub(super) fn check_frames(&self, record: &EpisodeRecord) -> Result<()> {
        if !self.path.join(FRAMES).is_dir() {
            let message = "holds no frames to infer from: it was run with --no-frames, or by a program that filed none";
            return Err(Error::input(&self.path, "", message));
        }
        let missing = record.steps.iter().map(|step| self.told_path(step)).find(|path| !path.is_file());
        missing.map_or(Ok(()), |path| {
            Err(Error::input(path, "", "is missing: what is to be inferred from was filed there"))
        })
    }

    /// Reads what the belief update of a step was told.
    pub fn read_told(&self, step: &StepRecord) -> Result<Told> {
        let path = self.told_path(step);
        Ok(match step.action {
            Action::Look { .. } => Told::Frame(told_file::read_frame(&path)?),
            Action::Manipulate(_) => Told::Manipulation(told_file::read_push(&path, &self.grid()?)?),
        })
    }

    /// The checkpoint after the last step; `None` where there is none, or none that can be read.
    pub(super) fn read_checkpoint(&self, record: &EpisodeRecord) -> Result<Option<Checkpoint>> {
        let Ok(bytes) = fs::read(self.checkpoint_path(record.steps.len())) else { return Ok(None) };
        Ok(Checkpoint::from_bytes(&bytes, &self.grid()?))
    }

    fn told_path(&self, step: &StepRecord) -> PathBuf {
        let extension = match step.action {
            Action::Look { .. } => "frame",
            Action::Manipulate(_) => "push",
        };
        self.numbered(FRAMES, step.index, extension)
    }

    fn checkpoint_path(&self, actions: usize) -> PathBuf {
        self.numbered(CHECKPOINTS, actions, "state")
    }

    fn numbered(&self, folder: &str, index: usize, extension: &str) -> PathBuf {
        self.path.join(folder).join(file_name(index, extension))
    }

    /// Path of the belief after `actions` actions.
    pub fn belief_path(&self, actions: usize) -> PathBuf {
        self.numbered(BELIEFS, actions, "npz")
    }

    /// Path of the truth that is filed after `actions` actions, if there is one.
    pub fn truth_path(&self, actions: usize) -> PathBuf {
        self.numbered(TRUTH, actions, "npz")
    }

    fn grid(&self) -> Result<Grid> {
        if self.grid.get().is_none() {
            self.record()?;
        }
        Ok(*self.grid.get().expect("reading the record sets the grid"))
    }

    fn remove_leftovers(&self) -> Result<()> {
        let folders = FOLDERS.map(|folder| self.path.join(folder));
        for part in std::iter::once(self.path.clone()).chain(folders) {
            for name in names_in(&part)?.iter().filter(|name| name.starts_with(TEMPORARY)) {
                remove_if_there(&part.join(name))?;
            }
        }
        Ok(())
    }

    /// Removes the files of an episode, `episode.json` first so that a half-removed one does not pass for whole.
    fn remove_episode(&self) -> Result<()> {
        remove_if_there(&self.path.join(DOCUMENT))?;
        for name in COMPANIONS {
            remove_if_there(&self.path.join(name))?;
        }
        // From the last to the first: what a kill leaves is taken for what it is.
        let mut numbered = numbered_files(&self.path)?;
        numbered.sort_by_key(|file| std::cmp::Reverse(file.index));
        for file in numbered {
            remove_if_there(&file.path)?;
        }
        self.remove_leftovers()?;
        // Whether these are there says whether frames are filed; what holds a stranger's file stays.
        for folder in [FRAMES, CHECKPOINTS] {
            let _ = fs::remove_dir(self.path.join(folder));
        }
        Ok(())
    }
}

fn file_name(index: usize, extension: &str) -> String {
    format!("{index:03}.{extension}")
}

/// A numbered file of an episode.
struct Numbered {
    path: PathBuf,
    folder: &'static str,
    index: usize,
}

/// The numbered files of an episode.
fn numbered_files(path: &Path) -> Result<Vec<Numbered>> {
    let mut found = Vec::new();
    for folder in FOLDERS {
        let directory = path.join(folder);
        if directory.is_dir() {
            let numbered =
                |name: &String| Some(Numbered { path: directory.join(name), folder, index: index_of(folder, name)? });
            found.extend(names_in(&directory)?.iter().filter_map(numbered));
        }
    }
    Ok(found)
}

/// The number in a name that [`file_name`] made for a folder.
fn index_of(folder: &str, name: &str) -> Option<usize> {
    let (number, extension) = name.split_once('.')?;
    let index = number.parse().ok()?;
    (NUMBERED.contains(&(folder, extension)) && file_name(index, extension) == name).then_some(index)
}

/// The name of something in a folder of an episode that is no episode's.
fn stranger_inside(path: &Path) -> Result<Option<String>> {
    for folder in FOLDERS {
        let directory = path.join(folder);
        if directory.exists() && !directory.is_dir() {
            return Ok(Some(folder.to_owned()));
        }
        let names = names_in(&directory)?;
        let stranger = names.iter().find(|name| index_of(folder, name).is_none() && !name.starts_with(TEMPORARY));
        if let Some(name) = stranger {
            return Ok(Some(format!("{folder}/{name}")));
        }
    }
    Ok(None)
}

/// Whether the file has the members of an episode document, whatever their values.
fn is_document(path: &Path) -> Result<bool> {
    let text = fs::read(path).map_err(|error| Error::io(path, error))?;
    let document: Option<serde_json::Map<String, serde_json::Value>> = serde_json::from_slice(&text).ok();
    Ok(document.is_some_and(|members| ["format", "scene", "steps"].iter().all(|key| members.contains_key(*key))))
}

/// Takes the right to write in a directory until the handle is dropped or the process ends. `None` where the system
/// cannot lock directories: then nobody is kept out.
fn lock(path: &Path) -> Result<Option<File>> {
    let Ok(handle) = File::open(path) else { return Ok(None) };
    match handle.try_lock() {
        Ok(()) => Ok(Some(handle)),
        Err(TryLockError::WouldBlock) => Err(Error::input(path, "", "another run is writing this episode")),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

#[cfg(test)]
#[path = "directory_tests.rs"]
mod tests;
