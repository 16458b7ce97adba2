//! The arm before the shelf: where it is in a step's motion, and the way of its tip.

use super::{Painter, Side, Space, at, nothing};
use crate::record::{robot, shapes};
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
                let pushes = matches!(outcome.record.action, Action::Push(_));
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
    let (mut positions, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    for (body, part) in arm.arm.parts() {
        let pose = pose_of(&poses[body]);
        let [r, g, b] = if part.role == Role::Tool { robot::TOOL_RGB } else { robot::LINK_RGB };
        for (position, normal) in shapes::facets(std::slice::from_ref(&part.shape)) {
            positions.push(<[f32; 3]>::from((pose * position).coords));
            normals.push(<[f32; 3]>::from(pose * normal));
            colors.push(rerun::Rgba32::from_unmultiplied_rgba(r, g, b, 255));
        }
    }
    if positions.is_empty() {
        return nothing();
    }
    let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    rerun::Mesh3D::new(positions)
        .with_vertex_normals(normals)
        .with_vertex_colors(colors)
        .with_triangle_indices(triangles)
        // What is drawn see-through before must be covered again.
        .with_albedo_factor(rerun::Rgba32::from_unmultiplied_rgba(255, 255, 255, 255))
}
