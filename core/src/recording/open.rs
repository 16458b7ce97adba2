//! A recording: which format it has, what is in it, and one frame of it.

use super::entry::{Entry, Found};
use super::{Board, Settings, bop, folder, nerf, ros_frames, tum};
use crate::camera::{Frame, Pinhole};
use crate::files::names_in;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// More frames than this are refused, as view arrays have no more views.
const MAX_FRAMES: usize = u16::MAX as usize;

/// A recording on a disk. Images are read when they are asked for.
#[derive(Debug)]
pub struct Recording {
    pub(super) path: PathBuf,
    pub(super) format: &'static str,
    pub(super) entries: Vec<Entry>,
    pub(super) settings: Settings,
    pub(super) warnings: Vec<String>,
}

impl Recording {
    /// Opens a recording: reads what frames there are, and none of their images.
    ///
    /// # Errors
    /// One line for what is no recording of a known format, an empty one, and for what its format's own files get wrong.
    pub fn open(path: &Path, settings: Settings) -> Result<Self> {
        if !path.exists() {
            return Err(Error::input(path, "", "no such file or directory"));
        }
        if settings.every == 0 {
            return Err(Error::Usage("--every 0: must be a whole number from 1".to_owned()));
        }
        let has = |name: &str| path.join(name).exists();
        let is_mcap = path.is_file() && path.extension().is_some_and(|end| end.eq_ignore_ascii_case("mcap"));
        let (format, found) = if is_mcap {
            ("MCAP", ros_frames::list(path, &settings)?)
        } else if has("transforms.json") {
            ("Nerfstudio", nerf::list(path)?)
        } else if has("scene_camera.json") {
            ("BOP", bop::list(path)?)
        } else if has("groundtruth.txt") {
            ("TUM RGB-D", tum::list(path, &settings)?)
        } else if has("depth") {
            ("folder", folder::list(path, &settings)?)
        } else {
            return Err(Error::input(path, "", unknown(path)?));
        };
        let Found { entries, warnings } = found;
        if entries.is_empty() {
            return Err(Error::input(path, "", format!("is a recording ({format}) without a frame")));
        }
        let entries: Vec<Entry> = entries.into_iter().step_by(settings.every).collect();
        if entries.len() > MAX_FRAMES {
            let words = format!("{} frames; at most {MAX_FRAMES} are mapped: choose some with --every", entries.len());
            return Err(Error::input(path, "", words));
        }
        Ok(Self { path: path.to_owned(), format, entries, settings, warnings })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its format, by name.
    pub fn format(&self) -> &'static str {
        self.format
    }

    /// Number of frames that it lists.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether it lists none; one that opens does.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// What a frame is called in the recording.
    pub fn name(&self, at: usize) -> &str {
        &self.entries[at].name
    }

    /// The camera of a frame.
    pub fn camera(&self, at: usize) -> &Pinhole {
        &self.entries[at].camera
    }

    /// A frame in the board's frame, flying pixels dropped.
    ///
    /// # Errors
    /// One line that names the file, for images that cannot be read or are of another size than the camera's; for a frame
    /// that [`survey`](Self::survey) skips.
    pub fn frame(&self, at: usize, board: &Board) -> Result<Frame> {
        super::read::frame(&self.path, &self.entries[at], &self.settings, board)
    }
}

/// Why a path is no recording, in words.
fn unknown(path: &Path) -> Result<String> {
    if path.is_file() {
        return Ok("is no recording: a folder or an .mcap file is needed".to_owned());
    }
    let names = names_in(path)?;
    if names.is_empty() {
        return Ok("is an empty folder".to_owned());
    }
    // BOP keeps scenes side by side in a folder.
    if let Some(scene) = names.iter().find(|name| path.join(name).join("scene_camera.json").is_file()) {
        return Ok(format!("holds BOP scenes: name one of them, for example {}", path.join(scene).display()));
    }
    Ok("is no recording: there is no depth/ with intrinsics.json, groundtruth.txt, scene_camera.json or transforms.json"
        .to_owned())
}
