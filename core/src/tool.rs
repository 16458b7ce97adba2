//! What pushes: one straight push, the gripper and links that carry it out, and the space they sweep.
//!
//! The tool is a closed two-finger gripper as a triangular prism (base 0.111 m, length 0.085 m, 35 mm thick) with the
//! last two links as boxes 70 mm wide, which trail towards the shelf's entrance. The tool's frame has its origin at
//! the finger tip and +y as the approach axis.

use crate::grid::{Grid, VoxelSet};
use crate::solid::Solid;
use crate::{Point, Pose, Vector};
use serde::{Deserialize, Serialize};

/// One straight-line manipulation of the shelf: the tip goes in along +y to `start`, then `length_m` along
/// `direction_deg`, then back the same way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Push {
    /// Where the tip starts to push, metres.
    pub start: [f32; 3],
    /// Direction of the push in the plane of the board, degrees counter-clockwise from +x (90 is into the shelf).
    pub direction_deg: f32,
    /// How far the tip moves, metres.
    pub length_m: f32,
}

impl Push {
    /// The tip's position at the start.
    pub fn start_point(&self) -> Point {
        Point::from(self.start)
    }

    /// Unit direction of the push.
    pub fn direction(&self) -> Vector {
        let angle = self.direction_deg.to_radians();
        Vector::new(angle.cos(), angle.sin(), 0.0)
    }

    /// The tip's position at the end.
    pub fn end_point(&self) -> Point {
        self.start_point() + self.direction() * self.length_m
    }
}

/// The tool's shape in its own frame.
#[derive(Clone, Debug)]
pub struct Tool {
    /// Gripper first, then the links; origin at the tip, +y is the approach axis.
    pub parts: Vec<Solid>,
}
// To come: `Tool::standard()`, `Tool::world_from_tool(tip: Point) -> Pose`, `Tool::path(&Push, step_m) -> Vec<Pose>` (approach
// from before the shelf, then the push), `Tool::swept_volume(&self, &Push, &Grid) -> VoxelSet`.
const _: Option<(Grid, VoxelSet, Pose)> = None;
