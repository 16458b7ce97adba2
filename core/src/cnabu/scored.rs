//! Rows of scores in cards and tables.

use serde::{Deserialize, Serialize};

/// Scores after a number of views, over a set of held-out scenes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scored {
    /// Random views.
    pub views: usize,
    /// Mean IoU of free and occupied.
    pub occupancy_iou: f64,
    /// IoU of occupied.
    pub occupied_iou: f64,
    /// Mean IoU over classes.
    pub semantic_miou: f64,
    /// Calibration error of occupancy.
    pub mece_occupancy: f64,
    /// Calibration error of semantics.
    pub mece_semantics: f64,
}
