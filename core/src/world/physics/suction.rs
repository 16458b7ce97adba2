//! A suction cup: when it seals on an object, and when what it holds comes off.
//!
//! A cup of 40 mm at 0.6 bar below the air's pressure presses an object on with `p A = 75 N`. What hangs on its front comes
//! off when it is pulled sideways with more than friction holds (0.4, rubber on cardboard: [`PULL_N`]) or bent about the rim
//! with more than `p A r` ([`BEND_NM`]).

use super::{HELD, OBJECT, Physics, TIME_STEP_S, from_rapier, groups, to_rapier, to_rapier_pose};
use crate::arm::{Arm, Joints, pose_of};
use crate::{Point, Vector};
use rapier3d::dynamics::{FixedJointBuilder, ImpulseJointHandle};
use rapier3d::math::Pose as RapierPose;
use rapier3d::parry::query::Ray;
use rapier3d::prelude::{Group, RigidBodyHandle};

/// How far the bellows gives way: the rim seals on what is at most so far behind it, uncompressed, metres.
pub const STROKE_M: f32 = 0.008;
/// How far before the rim a surface may be that the lip still meets, metres.
pub const LIP_M: f32 = 0.002;
/// Load at which what is held comes off, newtons.
pub const PULL_N: f32 = 30.0;
/// Moment about the cup's middle at which it comes off, newton metres.
pub const BEND_NM: f32 = 1.5;
/// Successive steps with more than that until it is off: what starts to move pulls harder for a moment.
const LOADED_STEPS: u32 = 8;
/// Points of the rim that have to meet the object.
const RIM_POINTS: usize = 16;
/// How far behind the rim rays begin, metres: deeper than any bellows.
const BEHIND_M: f32 = 0.03;

/// What the cup holds.
#[derive(Clone)]
pub(super) struct Held {
    /// The object's number.
    at: usize,
    joint: ImpulseJointHandle,
    loaded_steps: u32,
}

/// What the cup of an arm meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::world) enum Touch {
    /// Some of its rim meets nothing, or another object than the rest: no vacuum.
    Open,
    /// All of its rim meets the object of this number within the bellows' stroke: the vacuum sensor tells.
    Sealed(usize),
    /// Somewhere the bellows gives way no farther: the arm feels it.
    Pressed,
}

impl Physics {
    /// What the cup of an arm at `joints` meets.
    pub(in crate::world) fn touch(&self, arm: &Arm, joints: &Joints) -> Touch {
        let Some(cup) = arm.cup else { return Touch::Open };
        let rim = pose_of(&arm.world_from_tool(joints));
        let ahead = rim.rotation * Vector::z();
        let met = (0..RIM_POINTS).map(|number| {
            let (sin, cos) = (std::f32::consts::TAU * number as f32 / RIM_POINTS as f32).sin_cos();
            let radius = cup.radius_m as f32;
            self.first_object(rim * Point::new(radius * cos, radius * sin, -BEHIND_M), ahead, BEHIND_M + LIP_M)
        });
        let met: Vec<Option<(usize, f32)>> = met.collect();
        if met.iter().flatten().any(|(_, distance)| *distance < BEHIND_M - STROKE_M) {
            return Touch::Pressed;
        }
        match met[0] {
            Some((at, _)) if met.iter().all(|met| met.is_some_and(|met| met.0 == at)) => Touch::Sealed(at),
            _ => Touch::Open,
        }
    }

    /// The first object along a ray and how far it is, metres.
    fn first_object(&self, origin: Point, ahead: Vector, reach_m: f32) -> Option<(usize, f32)> {
        let ray = Ray::new(to_rapier(origin.coords), to_rapier(ahead));
        let mut first: Option<(usize, f32)> = None;
        for (at, handle) in self.handles.iter().enumerate() {
            let Some(body) = self.world.bodies.get(*handle) else { continue };
            for collider in body.colliders().iter().filter_map(|collider| self.world.colliders.get(*collider)) {
                let reach = first.map_or(reach_m, |(_, distance)| distance);
                if let Some(distance) = collider.shape().cast_ray(collider.position(), &ray, reach, true)
                    && first.is_none_or(|(_, nearest)| distance < nearest)
                {
                    first = Some((at, distance));
                }
            }
        }
        first
    }

    /// Joins an object to the cup's body, as they are to each other now.
    pub(in crate::world) fn hold(&mut self, at: usize) {
        let Some(hand) = self.arm.last().map(|body| body.handle) else { return };
        let object = self.handles[at];
        let pose = |handle| self.world.bodies.get(handle).map(|body| from_rapier(body.position()));
        let (Some(world_from_hand), Some(world_from_object)) = (pose(hand), pose(object)) else { return };
        let hand_from_object = to_rapier_pose(&(world_from_hand.inverse() * world_from_object));
        let joint = FixedJointBuilder::new()
            .local_frame1(hand_from_object)
            .local_frame2(RapierPose::IDENTITY)
            .contacts_enabled(false);
        let joint = self.world.insert_impulse_joint(hand, object, joint.build());
        self.join_group(object, OBJECT | HELD);
        self.held = Some(Held { at, joint, loaded_steps: 0 });
    }

    /// Puts an object's colliders into some groups.
    ///
    /// The cup has pressed on the object before it holds it. Rapier goes on with a contact as long as the two hardly move to
    /// each other, without asking again whether they may touch; a change of groups makes it ask.
    fn join_group(&mut self, object: RigidBodyHandle, memberships: Group) {
        let colliders = self.world.bodies.get(object).map(|body| body.colliders().to_vec()).unwrap_or_default();
        for handle in colliders {
            if let Some(collider) = self.world.colliders.get_mut(handle) {
                let filter = collider.collision_groups().filter;
                collider.set_collision_groups(groups(memberships, filter));
            }
        }
    }

    /// The object in hand.
    pub(in crate::world) fn held(&self) -> Option<usize> {
        self.held.as_ref().map(|held| held.at)
    }

    /// Force and moment about the cup's middle between cup and what it holds in the last step, newtons and newton metres.
    pub(in crate::world) fn load(&self, arm: &Arm, joints: &Joints) -> Option<(f32, f32)> {
        let held = self.held.as_ref()?;
        let joint = self.world.impulse_joints.get(held.joint)?;
        let impulses = joint.impulses;
        // The solver leaves the impulses of the last of its substeps.
        let substep_s = TIME_STEP_S / self.world.integration_parameters.num_solver_iterations as f32;
        let per_s = |x: f32, y: f32, z: f32| Vector::new(x, y, z) / substep_s;
        let force = per_s(impulses[0], impulses[1], impulses[2]);
        let moment = per_s(impulses[3], impulses[4], impulses[5]);
        // The joint is at the object's origin and its axes; the moment about the cup has the force's too.
        let object = from_rapier(self.world.bodies.get(self.handles[held.at])?.position());
        let cup = arm.world_from_tool(joints).translation.vector.map(|v| v as f32);
        let arm_m = object.inverse_transform_vector(&(object.translation.vector - cup));
        Some((force.norm(), (moment + arm_m.cross(&force)).norm()))
    }

    /// Whether what is held comes off now, for it has been loaded with more than it bears for a while.
    pub(in crate::world) fn comes_off(&mut self, arm: &Arm, joints: &Joints) -> bool {
        let Some((force_n, moment_nm)) = self.load(arm, joints) else { return false };
        let Some(held) = &mut self.held else { return false };
        let is_loaded = force_n > PULL_N || moment_nm > BEND_NM;
        held.loaded_steps = if is_loaded { held.loaded_steps + 1 } else { 0 };
        held.loaded_steps >= LOADED_STEPS
    }

    /// Switches suction off.
    pub(in crate::world) fn let_go(&mut self) {
        if let Some(held) = self.held.take() {
            self.world.remove_impulse_joint(held.joint);
            self.join_group(self.handles[held.at], OBJECT);
            self.world.wake_up(self.handles[held.at], true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::ArmTool;
    use crate::scene::{Body, ClassId, ObjectId, RobotFile, RobotPlacement, Shelf};
    use crate::solid::Solid;
    use crate::{Pose, arm};
    use std::sync::Arc;

    /// The arm where it waits, and a box of 0.4 kg before its cup, `ahead_m` from the rim.
    fn hanging(ahead_m: f32, aside_m: f32) -> (ArmTool, Joints, Physics) {
        let shelf = Shelf::new([0.80, 0.40, 0.40]);
        let placement = RobotPlacement { urdf: Some(RobotFile::suction()), ..RobotPlacement::default() };
        let tool = ArmTool::new(Arm::placed(&placement).expect("shipped"), shelf);
        let ready = tool.ready.expect("within reach");
        let rim = arm::pose_of(&tool.arm.world_from_tool(&ready));
        let place = rim.translation.vector + Vector::new(aside_m, 0.03 + ahead_m, -0.05);
        let body = Body {
            id: ObjectId(0),
            class: ClassId(1),
            solid: Arc::new(Solid::standing_box(Vector::new(0.06, 0.06, 0.10))),
            world_from_body: Pose::translation(place.x, place.y, place.z),
            mass_kg: 0.4,
            friction: 0.5,
        };
        let mut physics = Physics::new(&shelf, &[body]);
        physics.begin();
        physics.insert_arm(&tool.arm, &ready);
        (tool, ready, physics)
    }

    #[test]
    fn the_cup_seals_within_the_bellows_stroke_and_on_all_of_its_rim() {
        let sealed = |ahead_m, aside_m| {
            let (tool, ready, physics) = hanging(ahead_m, aside_m);
            physics.touch(&tool.arm, &ready)
        };
        for ahead_m in [-0.007, -0.004, 0.001] {
            assert_eq!(sealed(ahead_m, 0.0), Touch::Sealed(0), "{ahead_m}");
        }
        assert_eq!(sealed(-0.010, 0.0), Touch::Pressed, "the bellows gives way no farther");
        assert_eq!(sealed(0.004, 0.0), Touch::Open, "nothing meets the lip");
        let edge = [0.009, 0.012].map(|aside_m| sealed(-0.004, aside_m));
        assert_eq!(edge, [Touch::Sealed(0), Touch::Open], "over an edge");
    }

    #[test]
    fn what_hangs_on_the_cup_loads_it_with_its_weight_and_stays_where_it_is() {
        let (tool, ready, mut physics) = hanging(-0.004, 0.0);
        let Touch::Sealed(at) = physics.touch(&tool.arm, &ready) else { panic!("no seal") };
        physics.hold(at);
        let before = physics.pose(at);
        for _ in 0..120 {
            physics.step_arm(&tool.arm, &ready);
            assert!(!physics.comes_off(&tool.arm, &ready));
        }
        let (force_n, moment_nm) = physics.load(&tool.arm, &ready).expect("held");
        assert!((force_n - 0.4 * 9.81).abs() < 0.1, "{force_n} N");
        // Its middle hangs 26 mm before the cup.
        assert!((moment_nm - 0.4 * 9.81 * 0.026).abs() < 0.02, "{moment_nm} Nm");
        assert!((physics.pose(at).translation.vector - before.translation.vector).norm() < 0.001);
        physics.let_go();
        assert_eq!((physics.held(), physics.load(&tool.arm, &ready)), (None, None));
        (0..24).for_each(|_| physics.step());
        assert!(physics.pose(at).translation.z < before.translation.z - 0.02, "it falls");
    }
}
