//! The directory of a bench.
//!
//! ```text
//! bench.json                                    the plan, with the scenes
//! episodes/SET/SCENE/POLICY-SEED.json           the result of a finished episode, the same byte for byte whenever it ran
//! seconds/SET/SCENE/POLICY-SEED.json            where its time went
//! recordings/SET/SCENE/POLICY-SEED/             the episode's directory, when it was recorded
//! ```
//!
//! Every file is there whole or not at all; an episode counts as finished when its result is there.

use super::makers::Mixing;
use super::plan::{EpisodeId, FORMAT, Plan};
use super::result::{EpisodeResult, EpisodeSeconds};
use nudge_core::files::{TEMPORARY, names_in, remove_if_there, write_atomically};
use nudge_core::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

const DOCUMENT: &str = "bench.json";
const EPISODES: &str = "episodes";
const SECONDS: &str = "seconds";
const RECORDINGS: &str = "recordings";

/// The directory of a bench.
#[derive(Debug)]
pub struct BenchDir {
    path: PathBuf,
    /// Held while this process writes here.
    _lock: Option<File>,
}

impl BenchDir {
    /// Opens a bench to read it.
    ///
    /// # Errors
    /// For a directory that holds no bench.
    pub fn open(path: &Path) -> Result<(Self, Plan)> {
        let directory = Self { path: path.to_owned(), _lock: None };
        let plan = directory.plan()?;
        Ok((directory, plan))
    }

    /// Prepares a directory for a plan: a new one, or one that holds results of the same plan.
    ///
    /// # Errors
    /// For a directory that holds something else, a bench of another plan (what differs is named), and one that another
    /// process is writing.
    pub fn prepare(path: &Path, plan: &Plan) -> Result<Self> {
        Ok(Self::go_on(path, plan, Mixing::Refused)?.0)
    }

    /// The same, for results that may be mixed with those of other makers. Gives the plan as it is filed beside it: what
    /// began the bench stays its `made_by`, and what goes on with it is noted.
    ///
    /// # Errors
    /// Those of [`Self::prepare`], and for results made otherwise, unless they may be mixed.
    pub fn go_on(path: &Path, plan: &Plan, mixing: Mixing) -> Result<(Self, Plan)> {
        if path.exists() && !path.is_dir() {
            return Err(Error::input(path, "", "is a file, not a directory"));
        }
        let names = names_in(path)?;
        let has_plan = names.iter().any(|name| name == DOCUMENT);
        if let Some(stranger) = names.iter().find(|name| !has_plan && !name.starts_with(TEMPORARY)) {
            let message = format!("is not empty and holds no bench (there is {stranger}): choose another directory");
            return Err(Error::input(path, "", message));
        }
        fs::create_dir_all(path).map_err(|error| Error::io(path, error))?;
        let directory = Self { path: path.to_owned(), _lock: lock(path)? };
        let mut filed = plan.clone();
        if has_plan {
            let before = directory.plan()?;
            if let Some(difference) = plan.difference(&before) {
                let message = format!("holds another bench: {difference}; choose another --out");
                return Err(Error::input(path, "", message));
            }
            // A bench without results is as good as a new one.
            if directory.missing(&before)?.len() < before.episodes().len() {
                let (sets, broken) = (plan.sets.clone(), plan.broken.clone());
                filed = Plan { sets, broken, ..before };
                let mut joined = filed.clone();
                joined.join(plan, mixing).map_err(|words| {
                    let message = format!("holds results that were made otherwise: {words}; --allow-mixed goes on");
                    Error::input(path, "", message)
                })?;
                // Who finds nothing left to do makes nothing.
                if !directory.missing(&filed)?.is_empty() {
                    filed = joined;
                }
            }
        }
        directory.write(Path::new(DOCUMENT), &filed)?;
        Ok((directory, filed))
    }

    /// The directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn plan(&self) -> Result<Plan> {
        let path = self.path.join(DOCUMENT);
        if self.path.is_dir() && !path.exists() {
            return Err(Error::input(&self.path, "", "holds no bench (no bench.json)"));
        }
        let plan: Plan = read(&path)?;
        if plan.format != FORMAT {
            let message = format!("is {}, this version reads {FORMAT}", plan.format);
            return Err(Error::input(&path, "format", message));
        }
        plan.check(&path)?;
        Ok(plan)
    }

    /// The result of an episode, if it is finished.
    ///
    /// # Errors
    /// For a result that cannot be read or belongs to something else: nothing is overwritten in silence.
    pub fn result(&self, plan: &Plan, id: EpisodeId) -> Result<Option<EpisodeResult>> {
        let path = self.file(EPISODES, plan, id);
        if !path.exists() {
            return Ok(None);
        }
        let result: EpisodeResult = read(&path)?;
        if !result.belongs_to(plan, id) {
            let message = format!("is not the result of {}: remove the file to run it again", plan.name(id));
            return Err(Error::input(&path, "", message));
        }
        Ok(Some(result))
    }

    /// Where the time of a finished episode went, if that is known.
    pub fn seconds(&self, plan: &Plan, id: EpisodeId) -> Option<EpisodeSeconds> {
        read(&self.file(SECONDS, plan, id)).ok()
    }

    /// Files a finished episode: its result last.
    pub fn file_episode(
        &self,
        plan: &Plan,
        id: EpisodeId,
        result: &EpisodeResult,
        seconds: &EpisodeSeconds,
    ) -> Result<()> {
        self.write(&place(SECONDS, plan, id), seconds)?;
        self.write(&place(EPISODES, plan, id), result)
    }

    /// Where an episode is recorded, seen from the directory.
    pub fn recording(plan: &Plan, id: EpisodeId) -> PathBuf {
        Path::new(RECORDINGS).join(plan.place(id))
    }

    /// The episodes of the plan that are not finished.
    ///
    /// # Errors
    /// Those of [`Self::result`].
    pub fn missing(&self, plan: &Plan) -> Result<Vec<EpisodeId>> {
        let mut missing = Vec::new();
        for id in plan.episodes() {
            if self.result(plan, id)?.is_none() {
                missing.push(id);
            }
        }
        Ok(missing)
    }

    fn file(&self, part: &str, plan: &Plan, id: EpisodeId) -> PathBuf {
        self.path.join(place(part, plan, id))
    }

    pub(super) fn write(&self, place: &Path, document: &impl Serialize) -> Result<()> {
        let path = self.path.join(place);
        let folder = path.parent().unwrap_or(&self.path);
        fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        for leftover in names_in(folder)?.iter().filter(|name| is_leftover_of(name, &path)) {
            remove_if_there(&folder.join(leftover))?;
        }
        let mut text = serde_json::to_vec(document).map_err(|error| Error::input(&path, "", error.to_string()))?;
        text.push(b'\n');
        write_atomically(&path, &text)
    }
}

fn is_leftover_of(name: &str, path: &Path) -> bool {
    let own = path.file_name().unwrap_or_default().to_string_lossy();
    name.strip_prefix(TEMPORARY).is_some_and(|name| name == own)
}

fn place(part: &str, plan: &Plan, id: EpisodeId) -> PathBuf {
    let mut place = Path::new(part).join(plan.place(id)).into_os_string();
    place.push(".json");
    place.into()
}

fn read<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let text = fs::read(path).map_err(|error| Error::io(path, error))?;
    serde_json::from_slice(&text).map_err(|error| {
        let words = error.to_string();
        let words = words.rsplit_once(" at line ").map_or(words.as_str(), |(words, _)| words);
        Error::input(path, format!("line {}, column {}", error.line(), error.column()), words)
    })
}

/// Takes the right to write in a directory. `None` where the system cannot lock directories: then nobody is kept out.
fn lock(path: &Path) -> Result<Option<File>> {
    let Ok(handle) = File::open(path) else { return Ok(None) };
    match handle.try_lock() {
        Ok(()) => Ok(Some(handle)),
        Err(TryLockError::WouldBlock) => Err(Error::input(path, "", "another bench is writing here")),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}
