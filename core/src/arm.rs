//! The robot arm: its model, kinematics, collision checks, motion planning, and timed motions.
//!
//! An [`Arm`] is read from a URDF file and stands before the shelf. Everything here is a serial chain of up to
//! [`MAX_JOINTS`] turning or sliding joints; arms built like the UR5 have a closed-form inverse, others a numeric one.
//! A [`Space`] is what the arm may not touch (shelf, table, a map of believed voxels, itself); [`plan()`] finds
//! collision-free paths through it (RRT-Connect, Kuffner and LaValle 2000) whose segments are checked by clearance and
//! not by fixed steps (Schwarzer, Saha and Latombe 2005), so that nothing thin is jumped over.
//!
//! Poses are in the shelf's frame. Kinematics is in `f64`, so that forward and inverse agree to a micrometre.

mod bounds;
mod chain;
mod clearance;
mod closed_form;
mod cover;
mod description;
mod distance;
mod ends;
mod hand;
mod joints;
mod line;
mod model;
mod motion;
mod numeric;
mod phases;
mod plan;
mod reach;
mod ready;
mod rrt;
mod segment;
mod shapes;
mod shortcut;
mod space;
mod sweep;
mod tool;
mod tree;
mod urdf;

pub use clearance::{Hit, Obstacle};
pub use cover::Ball;
pub use distance::DistanceField;
pub use hand::{HAND_M_S, HandFault, HandPose};
pub use joints::{Joints, MAX_JOINTS};
pub use line::{Follow, LINE_STEP_M, SINGULARITY_MARGIN, follow_line};
pub use model::{Arm, BodyPoses, Joint, JointKind, Part, Role};
pub use motion::{Motion, Stop};
pub use phases::{CONTACT_M_S, Phase, PhaseKind, PhasedMotion, WAY_BACK_M_S, WAY_IN_M_S};
pub use plan::{PlanSettings, Planned, plan, retreat, turned};
pub use reach::{Reach, YAWS_DEG};
pub use ready::{inclined_tool, level_tool};
pub use space::{MAP_MARGIN_M, SHELF_MARGIN_M, Space};
pub use tool::ArmTool;

/// A rigid transform with the precision that kinematics needs; names say `to_from`, for example `world_from_tool`.
pub type Frame = nalgebra::Isometry3<f64>;

/// A [`Frame`] as the rest of the program keeps poses.
pub fn pose_of(frame: &Frame) -> crate::Pose {
    nalgebra::convert(*frame)
}

/// A pose with the precision that kinematics needs.
pub fn frame_of(pose: &crate::Pose) -> Frame {
    let frame: Frame = nalgebra::convert(*pose);
    // The rotation was unit in f32 only.
    Frame::from_parts(frame.translation, nalgebra::UnitQuaternion::new_normalize(frame.rotation.into_inner()))
}

#[cfg(test)]
mod tests;
