//! Entities of the window's recording.

/// The panels of the shelf.
pub const SHELF: &str = "shelf/panels";
/// Its edges.
pub const EDGES: &str = "shelf/edges";
/// The outlines of the true objects.
pub const OBJECTS: &str = "objects";
/// The belief of the shown episode.
pub const BELIEF: &str = "belief";
/// The candidate views.
pub const VIEWS: &str = "camera/views";
/// The view that was looked from last.
pub const CURRENT: &str = "camera/current";
/// The push candidates.
pub const CANDIDATES: &str = "push/candidates";
/// The push that was done or is looked at.
pub const CHOSEN: &str = "push/chosen";
/// How the tool stands at the beginning of it, where its skill tells.
pub const LINES: &str = "push/lines";
/// What it sweeps.
pub const SWEPT: &str = "push/swept";
/// The belief that it is predicted to leave.
pub const PREDICTED: &str = "push/predicted";
/// How that differs from now.
pub const DIFFERENCE: &str = "push/difference";
/// What it really left.
pub const HAPPENED: &str = "push/happened";
/// Why there is nothing of it to show.
pub const HAPPENED_NOTE: &str = "push/happened/note";
/// The arm.
pub const ARM: &str = "robot/arm";
/// The way of its tip.
pub const ARM_PATH: &str = "robot/path";
/// Where a gain comes from.
pub const GAIN: &str = "gain";
/// The belief of the second episode.
pub const OTHER: &str = "other/belief";
/// The outlines of its true objects.
pub const OTHER_OBJECTS: &str = "other/objects";
/// How the two beliefs differ.
pub const BETWEEN: &str = "between";
/// What the pointer is over.
pub const HOVERED: &str = "pointer/hovered";
/// What is asked about.
pub const PICKED: &str = "pointer/picked";
