//! Where in an empty shelf the level gripper can be.

use super::ready::level_tool;
use super::tool::ArmTool;
use nalgebra::Point3;
use rayon::prelude::*;

/// Turns of the gripper that are tried, degrees counter-clockwise from straight into the shelf.
pub const YAWS_DEG: [f64; 5] = [0.0, 20.0, -20.0, 40.0, -40.0];

/// Places of the finger tip over the board, row by row from the front edge, x ascending.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// Distance of neighbouring places, metres.
    pub step_m: f32,
    /// Number of places across (x) and into the shelf (y).
    pub size: [usize; 2],
    /// Per place, whether the arm can have its tip there in an empty shelf.
    pub reached: Vec<bool>,
}

impl Reach {
    /// Share of the places that are in reach.
    pub fn share(&self) -> f32 {
        self.reached.iter().filter(|reached| **reached).count() as f32 / self.reached.len().max(1) as f32
    }

    /// How far into the shelf the tip comes, metres; `None` when it comes nowhere.
    pub fn depth_m(&self) -> Option<f32> {
        let row = self.reached.iter().rposition(|reached| *reached)? / self.size[0];
        Some((row as f32 + 0.5) * self.step_m)
    }

    /// Whether the arm comes to the place in column `x` of row `y`.
    pub fn at(&self, x: usize, y: usize) -> bool {
        self.reached[y * self.size[0] + x]
    }
}

impl ArmTool {
    /// Where the tip of the level gripper, in any of the turns of a push, can be `height_m` above the board with nothing
    /// but the shelf in the way. Runs in parallel.
    pub fn reach(&self, height_m: f32, step_m: f32) -> Reach {
        let min = self.shelf.min();
        let size = [0, 1].map(|axis| (self.shelf.size[axis] / step_m).round().max(1.0) as usize);
        let space = self.space();
        let near = self.ready.unwrap_or_else(|| super::Joints::zero(self.arm.joints.len()));
        let reached = |at: usize| {
            let place = |axis: usize, i: usize| f64::from(min[axis] + (i as f32 + 0.5) * step_m);
            let tip = Point3::new(place(0, at % size[0]), place(1, at / size[0]), f64::from(min.z + height_m));
            YAWS_DEG.iter().any(|yaw| {
                let pose = level_tool(&tip, yaw.to_radians());
                self.arm.inverse(&pose, &near).iter().any(|joints| space.is_free(joints))
            })
        };
        Reach { step_m, size, reached: (0..size[0] * size[1]).into_par_iter().map(reached).collect() }
    }
}
