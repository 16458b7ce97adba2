//! The arm before the shelf: where it is in a step's motion, and the way of its tip.

use super::{Painter, Side, Space, at, nothing, shapes};
use crate::colors;
use crate::record::robot;
use nudge_core::Pose;
use nudge_core::arm::{ArmTool, Joints, Motion, Role, pose_of};
use nudge_core::episode::StepOutcome;
use nudge_core::plan::Action;
use nudge_core::scene::Body;
use nudge_core::solid::ConvexPart;

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
        let (mut joints, mut held) = (arm.ready, None);
        if let (Some(outcome), Some(motion)) = (outcome, motion) {
            let pushes = matches!(outcome.record.action, Action::Manipulate(_));
            let rests_s = || robot::shown_at_s(arm, motion, &outcome.record.decision, pushes);
            let at_s = space.motion_s.unwrap_or_else(rests_s);
            joints = motion.at(at_s);
            held = in_hand(side, outcome, at_s);
        }
        match joints.filter(|_| shown) {
            Some(joints) => {
                let mut facets = links(arm, &joints);
                if let Some((body, pose)) = held {
                    let [r, g, b] = colors::of_class(&side.setup.catalog, body.class);
                    facets.add(&body.solid.parts, &pose, rerun::Rgba32::from_unmultiplied_rgba(r, g, b, 255));
                }
                self.log(at::ARM, &facets.mesh(255));
            }
            None => self.log(at::ARM, &nothing()),
        }
        match motion.filter(|_| shown) {
            Some(motion) => self.log(at::ARM_PATH, &robot::path(arm, motion)),
            None => self.log(at::ARM_PATH, &robot::path(arm, &Motion::default())),
        }
    }
}

/// What a step's motion carries, with where it is at a time of the motion.
fn in_hand<'a>(side: &'a Side, outcome: &StepOutcome, at_s: f64) -> Option<(&'a Body, Pose)> {
    let held = robot::Held::in_step(&side.setup.arm, outcome)?;
    let body = side.before.as_ref()?.bodies.iter().find(|body| body.id == held.object)?;
    Some((body, held.pose_at(at_s, &body.world_from_body)?))
}

/// All links of the arm in the shelf's frame.
fn links(arm: &ArmTool, joints: &Joints) -> Facets {
    let poses = arm.arm.body_poses(joints);
    let mut facets = Facets::default();
    for (body, part) in arm.arm.parts() {
        let [r, g, b] = if part.role == Role::Tool { robot::TOOL_RGB } else { robot::LINK_RGB };
        let color = rerun::Rgba32::from_unmultiplied_rgba(r, g, b, 255);
        facets.add(std::slice::from_ref(&part.shape), &pose_of(&poses[body]), color);
    }
    facets
}

/// Coloured triangles of solids, on their way to one mesh.
#[derive(Default)]
struct Facets {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colors: Vec<rerun::Rgba32>,
}

impl Facets {
    fn add(&mut self, parts: &[ConvexPart], world_from_parts: &Pose, color: rerun::Rgba32) {
        for (position, normal) in shapes::facets(parts) {
            self.positions.push((world_from_parts * position).coords.into());
            self.normals.push((world_from_parts * normal).into());
            self.colors.push(color);
        }
    }

    /// `alpha` is that of the whole: 255 for what covers what was drawn see-through before.
    fn mesh(self, alpha: u8) -> rerun::Mesh3D {
        if self.positions.is_empty() {
            return nothing();
        }
        let triangles = (0..self.positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        rerun::Mesh3D::new(self.positions)
            .with_vertex_normals(self.normals)
            .with_vertex_colors(self.colors)
            .with_triangle_indices(triangles)
            .with_albedo_factor(rerun::Rgba32::from_unmultiplied_rgba(255, 255, 255, alpha))
    }
}
