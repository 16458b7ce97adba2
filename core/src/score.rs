//! Scores of a belief against the truth: IoU, mIoU, calibration, entropy, object verdicts.
//!
//! Everything is counted in the scored volume, the grid below [`SCORED_HEIGHT_M`], so that the empty air above does not
//! flatter. [`Scores::of`] judges one belief; a [`Tally`] keeps the counts behind the scores, and tallies merged over a
//! set of scenes give the set's scores from one confusion matrix. [`object_verdicts`] gives the verdict on each object;
//! [`Interval`] is a mean over scenes with its confidence interval; [`scores_without`] gives the scores of a perfect
//! map that lacks some objects.

mod confusion;
mod interval;
mod known;
mod objects;
mod rank;
mod reliability;
mod tally;

pub use confusion::Confusion;
pub use interval::{Interval, RESAMPLES, deviation, mean};
pub use known::scores_without;
pub use objects::{SPECK_M2, object_verdicts};
pub use rank::rank_correlation;
pub use reliability::{BIN_COUNT, Reliability, ReliabilityBin};
pub use tally::Tally;

use crate::belief::Belief;
use crate::world::TruthMap;
use serde::{Deserialize, Serialize};

/// The scored volume is the grid below this height (the tallest class and a margin), metres.
pub const SCORED_HEIGHT_M: f32 = 0.27;

/// The scores of one belief.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Mean IoU of free and occupied.
    pub occupancy_iou: f64,
    /// IoU of occupied.
    pub occupied_iou: f64,
    /// Mean IoU over the classes present in truth or prediction, background included.
    pub semantic_miou: f64,
    /// Entropy of the occupancy map (scored volume) and the semantic map together, nats.
    pub entropy_nats: f64,
    /// Expected calibration error of occupancy, mean over the two true classes.
    pub mece_occupancy: f64,
    /// Expected calibration error of semantics, mean over the true classes.
    pub mece_semantics: f64,
}

impl Scores {
    /// The scores of `belief` against `truth`, which must cover the same grid.
    ///
    /// Runs in parallel; the result does not depend on the number of threads.
    pub fn of(belief: &Belief, truth: &TruthMap) -> Self {
        Tally::of(belief, truth).scores()
    }
}

/// The verdict on an object in the belief.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Most of its cells are occupied with the right class.
    Found,
    /// Most of its cells are occupied, but most of them with another class.
    Misclassified,
    /// Most of its cells are believed free or unknown.
    NotFound,
    /// A predicted object that is not there.
    Hallucinated,
}

/// The verdict on one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectVerdict {
    /// Position in the scene's list; `None` for a hallucinated one.
    pub object: Option<u16>,
    /// Class name, of the truth or, for a hallucinated one, of the prediction.
    pub class: String,
    /// The verdict.
    pub verdict: Verdict,
    /// Middle of its cells on the board, metres.
    pub position: [f32; 2],
}
