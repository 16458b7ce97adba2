//! How a recording is read.

use super::LabelMap;
use super::flying::EDGE_DEG;
use std::path::PathBuf;

/// How a recording is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What the numbers of its label images mean; `None` where they are class numbers of the catalogue.
    pub labels: Option<LabelMap>,
    /// Metres per unit of its depth images, against what the recording says.
    pub depth_unit_m: Option<f64>,
    /// Edge angle of the filter for flying pixels, degrees; 0 switches it off.
    pub edge_deg: f32,
    /// How far the times of a pose and an image may be apart, seconds.
    pub tolerance_s: f64,
    /// Only every so many frames are taken, from the first on.
    pub every: usize,
    /// A file of intrinsics, for recordings that do not tell.
    pub intrinsics: Option<PathBuf>,
    /// A file that says which topics of an MCAP file are what; `None` where its content tells.
    pub topics: Option<PathBuf>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            labels: None,
            depth_unit_m: None,
            edge_deg: EDGE_DEG,
            tolerance_s: 0.02,
            every: 1,
            intrinsics: None,
            topics: None,
        }
    }
}
