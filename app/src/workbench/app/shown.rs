//! The panels of this window that remember something from frame to frame.

use crate::workbench::panels::{camera, compare, decision, gains, maps, promises, push, why};

/// The panels that remember something from frame to frame.
#[derive(Default)]
pub(super) struct Panels {
    pub maps: maps::State,
    pub camera: camera::State,
    pub decision: decision::State,
    pub why: why::State,
    pub gains: gains::State,
    pub promises: promises::State,
    pub push: push::State,
    pub compare: compare::State,
}
