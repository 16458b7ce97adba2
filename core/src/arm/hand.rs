//! Where the hand can be to look, and how it gets from one place to the next.
//!
//! A view counts only if the camera in hand can be there: some configuration within the joints' limits has it there,
//! clear of table, shelf and the arm itself, and there is a way to it from where the arm waits. While it looks the arm
//! stays out of the shelf altogether, whatever may stand in it.

use super::plan::{PlanSettings, plan};
use super::pusher::ArmTool;
use super::shortcut::shortcut;
use super::{Joints, Motion, Space, frame_of};
use crate::Pose;
use crate::rng::{ChaCha8Rng, stream};
use rayon::prelude::*;

/// Speed of the tool between two views, metres per second.
pub const HAND_M_S: f64 = 0.50;
/// Work of a query for the way to a view.
const QUERY: PlanSettings = PlanSettings { rounds: 200, shortcuts: 20 };
/// Attempts to shorten the way between two views.
const SHORTCUTS: usize = 30;
/// Branches of the inverse that are tried for a view, those with the most room first.
const BRANCHES: usize = 3;

/// A place of the hand, and the way there from where the arm waits.
#[derive(Clone, Debug, PartialEq)]
pub struct HandPose {
    /// Configurations from where the arm waits to the place, straight in between; never empty.
    way: Vec<Joints>,
}

impl HandPose {
    /// Where the arm waits.
    pub fn waiting(ready: Joints) -> Self {
        Self { way: vec![ready] }
    }

    /// The configuration.
    pub fn joints(&self) -> Joints {
        self.way[self.way.len() - 1]
    }
}

impl ArmTool {
    /// Per camera pose, how the hand gets there; `None` where it cannot be.
    ///
    /// Runs in parallel; the result depends on arm, shelf and poses alone.
    pub fn hand_poses(&self, world_from_camera: &[Pose]) -> Vec<Option<HandPose>> {
        let Some(ready) = self.ready else { return vec![None; world_from_camera.len()] };
        let space = Space::closed(&self.arm, &self.shelf);
        let way = |(number, pose): (usize, &Pose)| {
            let tool = self.arm.tool_for_camera(&frame_of(pose))?;
            let mut free: Vec<(f64, Joints)> = Vec::new();
            for joints in self.arm.inverse(&tool, &ready) {
                let room = space.room_m(&joints);
                if room >= 0.0 {
                    free.push((room, joints));
                }
            }
            free.sort_by(|a, b| b.0.total_cmp(&a.0));
            let goals: Vec<Vec<Joints>> = free.into_iter().take(BRANCHES).map(|(_, joints)| vec![joints]).collect();
            let mut rng = stream(0, "ways of the hand", number as u64);
            plan(&space, &ready, &goals, QUERY, &mut rng).map(|planned| HandPose { way: planned.path })
        };
        world_from_camera.par_iter().enumerate().map(way).collect()
    }

    /// The hand's motion from one place to another, outside the shelf: straight if that is free, else a shortened way past
    /// where the arm waits. The same stream gives the same motion.
    pub fn carry(&self, from: &HandPose, to: &HandPose, rng: &mut ChaCha8Rng) -> Motion {
        let space = Space::closed(&self.arm, &self.shelf);
        let mut path: Vec<Joints> = from.way.iter().rev().chain(to.way.iter().skip(1)).copied().collect();
        path.dedup();
        Motion::along(&self.arm, &shortcut(&space, path, SHORTCUTS, rng), HAND_M_S)
    }
}
