//! Straight lines of the tool: the joints follow without leaving their branch.

use super::{Arm, Frame, Joints};
use nalgebra::{Translation3, Vector3};

/// Distance of the poses along a line, metres.
pub const LINE_STEP_M: f64 = 0.01;
/// Largest change of a joint between two poses of a line, rad: more is a jump to another branch.
const JUMP_RAD: f64 = 0.35;
/// Distance from a singularity ([`Arm::singularity_margin`]) that is kept on a line.
pub const SINGULARITY_MARGIN: f64 = 0.02;

/// What following a line came to.
#[derive(Clone, Debug)]
pub struct Follow {
    /// Configurations along the line, the start first, at most a centimetre apart.
    pub path: Vec<Joints>,
    /// Whether the line's end was reached.
    pub complete: bool,
}

/// Moves the tool from `start` straight along `travel` (shelf's frame, metres) without turning it, as far as the same
/// branch reaches and `allowed` lets it.
pub fn follow_line(
    arm: &Arm,
    start: &Joints,
    travel: &Vector3<f64>,
    mut allowed: impl FnMut(&Joints) -> bool,
) -> Follow {
    let from = arm.world_from_tool(start);
    let steps = ((travel.norm() / LINE_STEP_M) - 1e-6).ceil().max(0.0) as usize;
    let mut path = vec![*start];
    let mut last = *start;
    for step in 1..=steps {
        let offset = travel * (step as f64 / steps as f64);
        let target = Frame::from_parts(Translation3::from(from.translation.vector + offset), from.rotation);
        let next = arm
            .inverse_from(&target, &last, JUMP_RAD)
            .filter(|joints| arm.singularity_margin(joints) > SINGULARITY_MARGIN && allowed(joints));
        let Some(joints) = next else { return Follow { path, complete: false } };
        path.push(joints);
        last = joints;
    }
    Follow { path, complete: true }
}
