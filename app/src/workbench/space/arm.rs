//! The arm before the shelf: where it is in a step's motion, and the way of its tip.

use super::{Facets, Painter, Side, Space, at, nothing};
use crate::record::robot;
use nudge_core::arm::{ArmTool, Joints, Motion, Role, pose_of};
use nudge_core::plan::Action;

impl Painter {
    /// Draws the arm where the scrubbed motion has it, else where the step left it to be seen.
    pub(super) fn arm(&mut self, side: &Side, space: &Space) {
        let arm = &side.setup.arm;
        let outcome = side.moment.outcome.as_ref();
        let motion = outcome.and_then(|outcome| outcome.motion.as_ref());
        let shown = space.shows_arm();
        if !self.differs(at::ARM, format!("{:?} {shown} {:?}", side.key(), space.motion_s)) {
            return;
        }
        let joints = match (outcome, motion) {
            (Some(outcome), Some(motion)) => {
                let pushes = matches!(outcome.record.action, Action::Manipulate(_));
                let rests_s = || robot::shown_at_s(arm, motion, &outcome.record.decision, pushes);
                motion.at(space.motion_s.unwrap_or_else(rests_s))
            }
            _ => arm.ready,
        };
        match joints.filter(|_| shown) {
            Some(joints) => self.log(at::ARM, &links(arm, &joints)),
            None => self.log(at::ARM, &nothing()),
        }
        match motion.filter(|_| shown) {
            Some(motion) => self.log(at::ARM_PATH, &robot::path(arm, motion)),
            None => self.log(at::ARM_PATH, &robot::path(arm, &Motion::default())),
        }
    }
}

/// All links of the arm as one mesh in the shelf's frame.
fn links(arm: &ArmTool, joints: &Joints) -> rerun::Mesh3D {
    let poses = arm.arm.body_poses(joints);
    let mut facets = Facets::default();
    for (body, part) in arm.arm.parts() {
        let [r, g, b] = if part.role == Role::Tool { robot::TOOL_RGB } else { robot::LINK_RGB };
        let color = rerun::Rgba32::from_unmultiplied_rgba(r, g, b, 255);
        facets.add(std::slice::from_ref(&part.shape), &pose_of(&poses[body]), color);
    }
    facets.mesh(255)
}
