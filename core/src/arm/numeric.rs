//! The inverse of any serial arm by damped least squares (Wampler 1986; Nakamura and Hanafusa 1986).

use super::model::Arm;
use super::{Frame, Joints};
use crate::rng::stream;
use nalgebra::{Matrix6, Vector6};

/// Metres that count as much as a radian where translation and rotation are compared.
pub(super) const METRES_PER_RADIAN: f64 = 0.25;
/// Steps until a start is given up.
const STEPS: usize = 80;
/// Starts besides the configuration that was asked from.
const STARTS: u64 = 24;
/// Remaining error that counts as none: a tenth of a micrometre and of a microradian.
const SOLVED: f64 = 1e-7;
/// Configurations closer than this are the same, rad or m.
const SAME: f64 = 1e-3;
/// Largest change of a joint in one step, rad or m.
const LARGEST_STEP: f64 = 0.3;

/// What descends to the pose from `near` and from fixed random starts, each found configuration once.
pub(super) fn inverse(arm: &Arm, world_from_tool: &Frame, near: &Joints) -> Vec<Joints> {
    let mut found: Vec<Joints> = Vec::new();
    let mut rng = stream(0, "numeric inverse kinematics", 0);
    let starts = std::iter::once(*near).chain((0..STARTS).map(|_| arm.random(&mut rng)));
    for start in starts {
        let Some(mut joints) = descend(arm, world_from_tool, &start) else { continue };
        if arm.turn_near(&mut joints, near) && found.iter().all(|known| known.largest_change(&joints) > SAME) {
            found.push(joints);
        }
    }
    found
}

/// The configuration that damped least squares reaches from `start`, if it puts the tool at `world_from_tool`.
pub(super) fn descend(arm: &Arm, world_from_tool: &Frame, start: &Joints) -> Option<Joints> {
    let mut joints = *start;
    let mut error = difference(world_from_tool, &arm.world_from_tool(&joints));
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        if error.amax() < SOLVED {
            return Some(joints);
        }
        let columns = arm.jacobian(&joints);
        let mut square = Matrix6::identity() * damping;
        let scaled: Vec<Vector6<f64>> = columns.into_iter().map(scaled).collect();
        for column in &scaled {
            square += column * column.transpose();
        }
        let weight = square.cholesky()?.solve(&error);
        let mut next = joints;
        let mut step: Vec<f64> = scaled.iter().map(|column| column.dot(&weight)).collect();
        let largest = step.iter().fold(0.0_f64, |largest, s| largest.max(s.abs()));
        if largest > LARGEST_STEP {
            step.iter_mut().for_each(|s| *s *= LARGEST_STEP / largest);
        }
        for ((value, step), joint) in next.iter_mut().zip(&step).zip(&arm.joints) {
            *value = (*value + step).clamp(joint.lower, joint.upper);
        }
        let after = difference(world_from_tool, &arm.world_from_tool(&next));
        if after.norm() < error.norm() {
            (joints, error) = (next, after);
            damping = (damping * 0.3).max(1e-12);
        } else {
            damping *= 10.0;
            if damping > 1e3 {
                return None;
            }
        }
    }
    (error.amax() < SOLVED).then_some(joints)
}

/// How the tool must move, metres scaled to radians over radians, shelf's frame.
fn difference(target: &Frame, now: &Frame) -> Vector6<f64> {
    let linear = target.translation.vector - now.translation.vector;
    let angular = (target.rotation * now.rotation.inverse()).scaled_axis();
    scaled(Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z))
}

fn scaled(mut v: Vector6<f64>) -> Vector6<f64> {
    v.fixed_rows_mut::<3>(0).scale_mut(1.0 / METRES_PER_RADIAN);
    v
}
