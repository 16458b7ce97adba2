//! Files of what belief updates were told: `frames/NNN.frame` after a look, `frames/NNN.push` after a manipulation.
//!
//! A manipulation is filed as the voxels that the arm swept, one bit each and compressed (Zstandard), behind a first line of JSON with
//! the manipulation as far as it came. Frames are [`Sensed::to_bytes`].

use super::estimate::Told;
use crate::camera::Sensed;
use crate::files::{split_head, with_head};
use crate::grid::{Grid, VoxelSet};
use crate::skill::{Manipulation, SweptManipulation};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The format number of filed pushes.
const FORMAT: u32 = 1;
const LEVEL: i32 = 9;

/// The first line of a filed push.
#[derive(Serialize, Deserialize)]
struct Head {
    format: u32,
    /// Of before there were other skills it has no `kind`, and is a push.
    #[serde(rename = "push")]
    manipulation: Manipulation,
}

impl Told {
    /// How the names of its files end.
    pub(super) fn extension(&self) -> &'static str {
        match self {
            Self::Frame(_) => "frame",
            Self::Manipulation(_) => "push",
        }
    }

    /// The file's bytes.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        match self {
            Self::Frame(sensed) => sensed.to_bytes(),
            Self::Manipulation(swept) => push_bytes(swept),
        }
    }
}

fn push_bytes(swept: &SweptManipulation) -> Vec<u8> {
    let words: Vec<u8> = swept.swept.words().iter().flat_map(|word| word.to_le_bytes()).collect();
    with_head(&Head { format: FORMAT, manipulation: swept.manipulation }, &words, LEVEL)
}

/// The voxel set of bytes, which are not compressed.
pub(super) fn voxel_set(grid: &Grid, bytes: &[u8]) -> Option<VoxelSet> {
    let (words, rest) = bytes.as_chunks();
    VoxelSet::from_words(grid, words.iter().map(|word| u64::from_le_bytes(*word)).collect()).filter(|_| rest.is_empty())
}

/// Reads a filed frame.
pub(super) fn read_frame(path: &Path) -> Result<Sensed> {
    Sensed::from_bytes(&std::fs::read(path).map_err(|error| Error::io(path, error))?, path)
}

/// Reads a filed push over a grid.
pub(super) fn read_push(path: &Path, grid: &Grid) -> Result<SweptManipulation> {
    let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
    let fail = |place: &str, words: &str| Error::input(path, place, words);
    let (head, content) = split_head(&bytes).ok_or_else(|| fail("", "is no push"))?;
    let head: Head = serde_json::from_slice(head).map_err(|_| fail("line 1", "is not that of a push"))?;
    if head.format != FORMAT {
        return Err(fail("format", &format!("is {}, this version reads {FORMAT}", head.format)));
    }
    let words = zstd::bulk::decompress(content, 8 * grid.voxel_count().div_ceil(64))
        .map_err(|error| fail("", &format!("is cut short or damaged ({error})")))?;
    let swept = voxel_set(grid, &words).ok_or_else(|| fail("", "sweeps another grid than the scene's"))?;
    Ok(SweptManipulation { manipulation: head.manipulation, swept })
}
