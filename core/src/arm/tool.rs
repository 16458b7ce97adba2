//! An arm before its shelf.

use super::{Arm, Joints, Space};
use crate::scene::{RobotPlacement, Shelf};

/// An arm with the shelf that it works in and the place where it waits.
#[derive(Clone, Debug)]
pub struct ArmTool {
    /// The arm.
    pub arm: Arm,
    /// The shelf.
    pub shelf: Shelf,
    /// The configuration in which the arm waits between manipulations; `None` when it reaches no place before the shelf,
    /// and then nothing in it.
    pub ready: Option<Joints>,
}

impl ArmTool {
    /// An arm before a shelf.
    pub fn new(arm: Arm, shelf: Shelf) -> Self {
        let ready = Space::empty(&arm, &shelf).ready();
        Self { arm, shelf, ready }
    }

    /// The shipped arm where it stands by default.
    pub fn standard(shelf: Shelf) -> Self {
        Self::new(Arm::standard(&RobotPlacement::default()), shelf)
    }

    /// The arm before its shelf, with no map of what stands in it.
    pub fn space(&self) -> Space<'_> {
        Space::empty(&self.arm, &self.shelf)
    }
}
