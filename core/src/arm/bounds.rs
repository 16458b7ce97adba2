//! Quantities that are computed once for an arm: how far each joint can move a point, and which links can collide.

use super::model::{Arm, JointKind, Part};
use super::{BodyPoses, Joints};
use crate::rng::stream;

/// Per joint, how far the farthest point beyond it can be from its axis.
pub(super) fn reaches(arm: &Arm) -> Joints {
    let count = arm.joints.len();
    let mut reaches = Joints::zero(count);
    // The farthest point of each body from its origin, and of all beyond it with every bend stretched.
    let mut beyond = 0.0_f64;
    for at in (0..count).rev() {
        let own = arm.bodies[at + 1].iter().flat_map(|part| &part.balls).map(|b| b.center.coords.norm() + b.radius_m);
        beyond = own.fold(beyond, f64::max);
        reaches[at] = match arm.joints[at].kind {
            JointKind::Turning => beyond,
            JointKind::Sliding => 1.0,
        };
        let slide = match arm.joints[at].kind {
            JointKind::Turning => 0.0,
            JointKind::Sliding => arm.joints[at].lower.abs().max(arm.joints[at].upper.abs()),
        };
        beyond += arm.joints[at].parent_from_joint.translation.vector.norm() + slide;
    }
    reaches
}

/// Pairs of parts of bodies that are not neighbours, without those that overlap in every configuration (they are built
/// that way).
pub(super) fn self_pairs(arm: &Arm) -> Vec<[u16; 2]> {
    let parts: Vec<(usize, &Part)> = arm.parts().collect();
    let mut rng = stream(0, "pairs of links", 0);
    let poses: Vec<_> = (0..100).map(|_| arm.body_poses(&arm.random(&mut rng))).collect();
    let mut pairs = Vec::new();
    for (a, (body_a, part_a)) in parts.iter().enumerate() {
        for (b, (body_b, part_b)) in parts.iter().enumerate().skip(a + 1) {
            let overlaps = |poses: &BodyPoses| {
                part_a.balls.iter().any(|ball_a| {
                    let center = poses[*body_a] * ball_a.center;
                    part_b.balls.iter().any(|ball_b| {
                        (center - poses[*body_b] * ball_b.center).norm() < ball_a.radius_m + ball_b.radius_m
                    })
                })
            };
            if body_a.abs_diff(*body_b) > 1 && !poses.iter().all(overlaps) {
                pairs.push([a as u16, b as u16]);
            }
        }
    }
    pairs
}
