//! One frame as its recording lists it, before an image is read.

use super::mcap_file::Address;
use crate::Pose;
use crate::camera::Pinhole;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Nearest and farthest depth that is asked of a recorded camera, metres: what its depth images say counts.
pub(super) const DEPTH_RANGE_M: [f32; 2] = [0.02, 5.0];

/// One frame of a recording.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Its number or time, as its files are called.
    pub(super) name: String,
    /// When it was taken, seconds of the recording's clock, where that is told.
    pub(super) time_s: Option<f64>,
    /// `recording_from_camera`, or why there is none.
    pub(super) pose: Result<Pose, String>,
    /// The camera.
    pub(super) camera: Pinhole,
    /// Where its depth is, or why there is none.
    pub(super) depth: Result<Depth, String>,
    /// Where its labels are.
    pub(super) labels: Labels,
}

/// Where an image is.
#[derive(Clone, Debug)]
pub(super) enum Place {
    /// A file of its own.
    File(PathBuf),
    /// A message of this type.
    Message { address: Address, kind: Arc<str> },
}

impl Place {
    /// The file that holds it.
    pub(super) fn file(&self) -> &Path {
        match self {
            Self::File(file) => file,
            Self::Message { address, .. } => &address.file,
        }
    }
}

/// Where a depth image is, and what its numbers mean.
#[derive(Clone, Debug)]
pub(super) struct Depth {
    pub(super) place: Place,
    /// Metres per unit of whole numbers. Real numbers are metres, unless a person says otherwise.
    pub(super) unit_m: f64,
}

/// Where a frame's labels are.
#[derive(Clone, Debug)]
pub(super) enum Labels {
    /// Nowhere.
    None,
    /// A number per pixel.
    Image(Place),
    /// A mask per object, each with the object's number; the later wins where they overlap.
    Masks(Vec<(PathBuf, u16)>),
}

impl Labels {
    /// A label image that may be there.
    pub(super) fn image_if_there(path: PathBuf) -> Self {
        if path.is_file() { Self::Image(Place::File(path)) } else { Self::None }
    }
}

/// What a format's reader finds.
pub(super) struct Found {
    pub(super) entries: Vec<Entry>,
    /// What a person should know all the same.
    pub(super) warnings: Vec<String>,
}
