//! An arm before its shelf, and its motion for one push.

use super::{Arm, Joints, Motion, Space};
use crate::arm::Push;
use crate::grid::{Grid, VoxelSet};
use crate::scene::{RobotPlacement, Shelf};
use serde::{Deserialize, Serialize};

/// Speed of the tip on the way to a push, metres per second.
pub const WAY_IN_M_S: f64 = 0.25;
/// Speed of the tip while it pushes, metres per second.
pub const PUSH_M_S: f64 = 0.10;
/// Speed of the tip on the way back, metres per second.
pub const WAY_BACK_M_S: f64 = 0.50;

/// An arm with the shelf that it pushes in and the place where it waits.
#[derive(Clone, Debug)]
pub struct ArmTool {
    /// The arm.
    pub arm: Arm,
    /// The shelf.
    pub shelf: Shelf,
    /// The configuration in which the arm waits between pushes; `None` when it reaches no place before the shelf, and
    /// then nothing in it.
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

/// The arm's motion for one push.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PushMotion {
    /// From where the arm waits to the push's start.
    pub way_in: Motion,
    /// Along the push.
    pub push: Motion,
}

impl PushMotion {
    /// The motion through these configurations at the speeds of a push.
    pub fn new(arm: &Arm, way_in: &[Joints], push: &[Joints]) -> Self {
        Self { way_in: Motion::along(arm, way_in, WAY_IN_M_S), push: Motion::along(arm, push, PUSH_M_S) }
    }

    /// The way back from the push's end, the same way, faster.
    pub fn way_back(&self, arm: &Arm) -> Motion {
        let path: Vec<Joints> = self.push.path().rev().chain(self.way_in.path().rev().skip(1)).collect();
        Motion::along(arm, &path, WAY_BACK_M_S)
    }

    /// How long it takes, way back included, seconds.
    pub fn duration_s(&self, arm: &Arm) -> f64 {
        self.way_in.duration_s() + self.push.duration_s() + self.way_back(arm).duration_s()
    }

    /// The whole motion: in, along the push, back.
    pub fn whole(&self, arm: &Arm) -> Motion {
        self.way_in.clone().then(&self.push).then(&self.way_back(arm))
    }

    /// Whether this motion carries out a push: its tip is at the push's start and end when it should be, to within a
    /// tenth of a millimetre, and it begins at `ready`.
    pub fn carries_out(&self, arm: &Arm, ready: &Joints, push: &Push) -> bool {
        const SAME_M: f64 = 1e-4;
        let tip = |joints: Option<Joints>| joints.map(|joints| arm.world_from_tool(&joints).translation.vector);
        let at = |joints: Option<Joints>, point: crate::Point| {
            tip(joints).is_some_and(|tip| (tip - point.coords.map(f64::from)).norm() < SAME_M)
        };
        let fits = |motion: &Motion| motion.stops.iter().all(|stop| stop.joints.len() == arm.joints.len());
        fits(&self.way_in)
            && fits(&self.push)
            && self.way_in.at(0.0) == Some(*ready)
            && at(self.push.at(0.0), push.start_point())
            && at(self.push.at(self.push.duration_s()), push.end_point())
    }

    /// Every voxel that the arm touches on the way in or along the push.
    pub fn swept_volume(&self, arm: &Arm, grid: &Grid) -> VoxelSet {
        let mut swept = VoxelSet::empty(grid);
        let path: Vec<Joints> = self.way_in.path().chain(self.push.path().skip(1)).collect();
        arm.sweep(&path, grid, &mut swept);
        swept
    }
}
