//! The names of the entities, on the timeline [`TIMELINE`] (those of a training run have one of their own).
//!
//! Below `/belief`, `/gain`, `/truth` and `/world/shelf` a second form of the same thing (voxels of a floor map, the
//! scale beside it) is a child of its entity.

use nudge_core::scene::ObjectId;

/// The timeline of episodes: number of actions so far.
pub const TIMELINE: &str = "step";
/// The robot's own clock, seconds that it has moved: for scrubbing through its motions.
pub const ROBOT_TIMELINE: &str = "robot";

/// The shelf's panels.
pub const SHELF: &str = "world/shelf";
/// The shelf's edges, as lines.
pub const SHELF_EDGES: &str = "world/shelf/edges";
/// The candidate views as frusta, coloured by gain.
pub const CAMERA_VIEWS: &str = "camera/views";
/// Where the hand can be to look, and where it cannot.
pub const CAMERA_REACH: &str = "camera/reach";
/// The camera that took the step's image.
pub const CAMERA_CURRENT: &str = "camera/current";
/// Its depth image.
pub const OBSERVATION_DEPTH: &str = "observation/depth";
/// Its label image.
pub const OBSERVATION_LABELS: &str = "observation/labels";
/// Voxels believed occupied, by probability.
pub const BELIEF_OCCUPANCY: &str = "belief/occupancy";
/// The classes' colours.
pub const CLASS_LEGEND: &str = "belief/semantics/legend";
/// The classes' names beside their colours.
pub const CLASS_LEGEND_NAMES: &str = "belief/semantics/legend/names";
/// The likeliest class per floor cell.
pub const BELIEF_SEMANTICS: &str = "belief/semantics";
/// Voxels believed occupied, in the colours of the classes.
pub const BELIEF_CLASSES: &str = "belief/semantics/voxels";
/// Entropy over each floor cell, nats.
pub const BELIEF_ENTROPY: &str = "belief/entropy";
/// Where the occupancy is still open, by entropy.
pub const BELIEF_OPEN: &str = "belief/entropy/voxels";
/// The likeliest class's probability per floor cell.
pub const BELIEF_CERTAINTY: &str = "belief/certainty";
/// The views' gains as heat maps.
pub const GAIN_VIEWS: &str = "gain/views";
/// The chosen views in the heat maps.
pub const GAIN_CHOSEN: &str = "gain/views/chosen";
/// Where the chosen action's gain comes from: the view's, or what the push is worth.
pub const GAIN_VOXELS: &str = "gain/voxels";
/// What gain that is, in words.
pub const GAIN_LABEL: &str = "gain/voxels/label";
/// The candidates to move something, by value; rejected ones grey.
pub const PUSH_CANDIDATES: &str = "push/candidates";
/// The way of the tool in contact in this step.
pub const PUSH_CHOSEN: &str = "push/chosen";
/// How the tool stands at the beginning of it, where its skill tells.
pub const PUSH_LINES: &str = "push/lines";
/// What the tool swept.
pub const PUSH_SWEPT: &str = "push/swept";
/// The way of the arm's tip in this step.
pub const ROBOT_PATH: &str = "robot/path";
/// Voxels predicted occupied after the push, where it can reach.
pub const PREDICTED_OCCUPANCY: &str = "predicted/occupancy";
/// Classes predicted after the push, where it can reach.
pub const PREDICTED_SEMANTICS: &str = "predicted/semantics";
/// Probability per floor cell that the push changes it.
pub const PREDICTED_CHANGE: &str = "predicted/change";
/// How surprising, per floor cell, what the push did is under the prediction.
pub const PREDICTED_SURPRISE: &str = "predicted/surprise";
/// The true objects as voxels.
pub const TRUTH_OCCUPANCY: &str = "truth/occupancy";
/// The true class per floor cell.
pub const TRUTH_LABELS: &str = "truth/labels";
/// The true objects' outlines on the floor plan.
pub const TRUTH_OUTLINES: &str = "truth/outlines";
/// Voxels believed but not there, and there but not believed.
pub const ERROR_OCCUPANCY: &str = "error/occupancy";
/// Floor cells with the wrong class.
pub const ERROR_SEMANTICS: &str = "error/semantics";
/// What was weighed, chosen, and why.
pub const DECISION: &str = "decision";
/// What a person noted on the step.
pub const NOTES: &str = "notes";
/// What became of each object, and where a person overruled the scorer.
pub const VERDICTS: &str = "verdicts";
/// One line a step.
pub const LOG: &str = "log";
/// All scores.
pub const SCORES: &str = "scores";
/// The steps that were pushes, below [`SCORES`].
pub const SCORE_PUSH: &str = "push";
/// A map's colour scale, below the map.
pub const SCALE: &str = "scale";
/// The numbers at the scale, below the map.
pub const SCALE_LABELS: &str = "scale/labels";

/// The timeline of a training run: updates of the weights so far.
#[cfg(feature = "cnabu")]
pub const UPDATES: &str = "updates";

/// A curve of a training run.
#[cfg(feature = "cnabu")]
pub fn training(curve: &str) -> String {
    format!("training/{curve}")
}

/// An object of the scene.
pub fn object(id: ObjectId) -> String {
    format!("world/objects/{}", id.0)
}

/// A rigid body of the arm, the base first.
pub fn robot_body(number: usize) -> String {
    format!("robot/bodies/{number}")
}

/// A score by its key in `episode.json`.
pub fn score(key: &str) -> String {
    format!("{SCORES}/{key}")
}
