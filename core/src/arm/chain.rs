//! Kinematics of any chain: the Jacobian, how far from a singularity, and the inverse by whichever way fits.

use super::closed_form::ThreeParallel;
use super::model::{Arm, JointKind};
use super::numeric::{self, METRES_PER_RADIAN};
use super::{Frame, Joints};
use nalgebra::{Matrix6, Vector6};
use std::f64::consts::TAU;

impl Arm {
    /// The closed-form inverse, if the arm is built in the way that has one.
    pub(super) fn three_parallel(&self) -> Option<ThreeParallel> {
        if self.joints.len() != 6 || self.joints.iter().any(|joint| joint.kind != JointKind::Turning) {
            return None;
        }
        let poses = self.body_poses(&Joints::zero(6));
        let base_from = |at: usize| self.world_from_base.inv_mul(&poses[at]);
        let axes = std::array::from_fn(|i| base_from(i + 1).rotation * self.joints[i].axis.into_inner());
        let points = std::array::from_fn(|i| base_from(i + 1).translation.vector);
        ThreeParallel::of(axes, points, &(base_from(6) * self.last_from_tool))
    }

    /// Columns of the geometric Jacobian of the tool: velocity (m/s) over angular velocity (rad/s), shelf's frame.
    pub fn jacobian(&self, joints: &Joints) -> Vec<Vector6<f64>> {
        let poses = self.body_poses(joints);
        let tool = (poses[self.joints.len()] * self.last_from_tool).translation.vector;
        let column = |(at, joint): (usize, &super::Joint)| {
            // The axis is the same in the joint's frame and in the child's: the joint turns about it.
            let axis = poses[at + 1].rotation * joint.axis.into_inner();
            let (linear, angular) = match joint.kind {
                JointKind::Turning => (axis.cross(&(tool - poses[at + 1].translation.vector)), axis),
                JointKind::Sliding => (axis, nalgebra::Vector3::zeros()),
            };
            Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
        };
        self.joints.iter().enumerate().map(column).collect()
    }

    /// How far from a singularity: the smallest singular value of the Jacobian, 0.25 m counting as a radian. At 0 there
    /// is a direction in which the tool cannot move; a UR5 in the middle of its range has about 0.3.
    pub fn singularity_margin(&self, joints: &Joints) -> f64 {
        let mut square = Matrix6::zeros();
        for mut column in self.jacobian(joints) {
            column.fixed_rows_mut::<3>(0).scale_mut(1.0 / METRES_PER_RADIAN);
            square += column * column.transpose();
        }
        square.symmetric_eigenvalues().min().max(0.0).sqrt()
    }

    /// Every configuration within the limits that puts the tool at `world_from_tool`, nearest to `near` first.
    ///
    /// In closed form all branches are found (up to eight for a UR), each with every joint at the turn nearest to
    /// `near`; the numeric inverse finds what its starts lead to, and at least the one that `near` leads to. Empty when
    /// the pose is out of reach.
    pub fn inverse(&self, world_from_tool: &Frame, near: &Joints) -> Vec<Joints> {
        let mut found = match &self.closed_form {
            Some(closed_form) => {
                let base_from_tool = self.world_from_base.inv_mul(world_from_tool);
                let mut found = closed_form.inverse(&base_from_tool, near);
                found.retain_mut(|joints| self.turn_near(joints, near));
                found
            }
            None => numeric::inverse(self, world_from_tool, near),
        };
        found.sort_by(|a, b| self.travel_m(a, near).total_cmp(&self.travel_m(b, near)));
        found
    }

    /// The configuration for `world_from_tool` on the same branch as `previous`: none of its joints is farther than
    /// `jump` (rad or m) from there.
    pub fn inverse_from(&self, world_from_tool: &Frame, previous: &Joints, jump: f64) -> Option<Joints> {
        let found = match &self.closed_form {
            Some(_) => {
                let all = self.inverse(world_from_tool, previous);
                all.into_iter().min_by(|a, b| a.largest_change(previous).total_cmp(&b.largest_change(previous)))
            }
            None => numeric::descend(self, world_from_tool, previous),
        };
        found.filter(|joints| joints.largest_change(previous) <= jump && self.within_limits(joints))
    }

    /// Brings every turning joint to the turn nearest to `near` that is within its limits; false when there is none.
    pub(super) fn turn_near(&self, joints: &mut Joints, near: &Joints) -> bool {
        for ((value, joint), &near) in joints.iter_mut().zip(&self.joints).zip(near.iter()) {
            if joint.kind == JointKind::Turning {
                *value += TAU * ((near - *value) / TAU).round();
                while *value > joint.upper {
                    *value -= TAU;
                }
                while *value < joint.lower {
                    *value += TAU;
                }
            }
        }
        self.within_limits(joints)
    }
}
