//! The camera's pose from joint states: forward kinematics of the arm that holds it.
//!
//! The pose is in the frame of the arm's base, so that is the recording's frame.

use super::transforms::nearest;
use crate::arm::{Arm, Joints};
use crate::scene::{RobotFile, RobotPlacement};
use crate::{Pose, Result};
use std::collections::BTreeMap;
use std::path::Path;

/// The joints of one message: name and position, radians or metres.
pub(super) type JointPositions = Vec<(String, f64)>;

/// An arm with a camera in hand.
pub(super) struct Holder(Arm);

impl Holder {
    /// The arm that a topic map names: `gripper` or `suction` of those that come with the program, else a URDF file beside the
    /// topic map. `camera` is the link of the camera where it has no usual name.
    ///
    /// # Errors
    /// Those of reading the file; an arm without a camera link.
    pub(super) fn read(robot: &str, camera: Option<&str>, topics: &Path) -> Result<Self> {
        let file = match robot {
            "gripper" | "suction" => RobotFile::named(robot)?,
            file => {
                let path = topics.parent().unwrap_or(Path::new("")).join(file);
                RobotFile::read(&path, path.to_string_lossy())?
            }
        };
        let file = RobotFile { camera: camera.map(str::to_owned).or(file.camera), ..file };
        let source = file.source.clone();
        let arm = Arm::placed(&RobotPlacement { urdf: Some(file), ..RobotPlacement::default() })?;
        if arm.last_from_camera.is_none() {
            let words = "has no link of a camera; camera_link says which it is";
            return Err(crate::Error::input(source, "", words));
        }
        Ok(Self(arm))
    }

    /// `base_from_camera` at a time.
    ///
    /// # Errors
    /// In words: no joint state within the tolerance, or one that lacks a joint of the arm.
    pub(super) fn pose(
        &self,
        states: &BTreeMap<i64, JointPositions>,
        time_ns: i64,
        tolerance_s: f64,
    ) -> std::result::Result<Pose, String> {
        let state = nearest(states, time_ns, tolerance_s)?;
        let mut joints = Joints::zero(self.0.joints.len());
        for (joint, value) in self.0.joints.iter().zip(joints.iter_mut()) {
            let told = state.iter().find(|(name, _)| *name == joint.name).map(|(_, position)| *position);
            *value = told
                .filter(|position| position.is_finite())
                .ok_or(format!("no pose: the joint state says nothing of joint {} of {}", joint.name, self.0.name))?;
        }
        let camera = self.0.world_from_camera(&joints).ok_or("no pose: no camera in hand")?;
        Ok((self.0.world_from_base.inverse() * camera).cast())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_is_where_the_arm_holds_it_whatever_the_order_of_the_joints() {
        let holder = Holder::read("gripper", None, Path::new("topics.toml")).expect("the shipped arm");
        let arm = &holder.0;
        let values = [0.3, -1.2, 1.4, -0.4, 0.7, 0.2];
        let joints = Joints::of(&values);
        let names = || arm.joints.iter().map(|joint| joint.name.clone());
        let mut state: JointPositions = names().zip(values).collect();
        state.reverse();
        state.push(("finger_joint".to_owned(), 0.8));
        let states = BTreeMap::from([(1_000_000_000, state.clone()), (2_000_000_000, state[1..].to_vec())]);
        let pose = holder.pose(&states, 1_010_000_000, 0.02).expect("a pose");
        let expected = arm.world_from_camera(&joints).expect("a camera");
        let from_base = arm.world_from_base.inverse() * expected;
        let apart = (pose.translation.vector.cast::<f64>() - from_base.translation.vector).norm();
        assert!(apart < 1e-6 && pose.rotation.cast::<f64>().angle_to(&from_base.rotation) < 1e-6, "{apart}");
        let late = holder.pose(&states, 1_500_000_000, 0.02).expect_err("too late");
        assert!(late.contains("no pose within"), "{late}");
        let last = names().next_back().expect("a joint");
        let lacking = holder.pose(&states, 2_000_000_000, 0.02).expect_err("a joint is missing");
        assert!(lacking.contains(&format!("says nothing of joint {last} of")), "{lacking}");
    }
}
