//! The boundary to rapier3d: colliders, time steps, the kinematic arm, and what can be read back.
//!
//! Lengths here are tenths of metres and less, so rapier's `length_unit` is 0.1: contact margins, correction speeds
//! and sleeping thresholds scale with it, and objects that are squeezed come apart at 0.3 m/s and do not explode.

mod suction;

pub(super) use suction::Touch;
pub use suction::{BEND_NM, LIP_M, PULL_N, STROKE_M};

use super::hull::Hull;
use super::shelf_panels;
use crate::arm::{Arm, Joints, Role, pose_of};
use crate::scene::{Body, Shelf};
use crate::solid::ConvexPart;
use crate::{Point, Pose, Vector};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use rapier3d::math::{Pose as RapierPose, Rotation as RapierRotation, Vector as RapierVector};
use rapier3d::parry::bounding_volume::BoundingVolume;
use rapier3d::parry::shape::ConvexPolyhedron;
use rapier3d::pipeline::PhysicsWorld;
use rapier3d::prelude::{
    CCDSolver, ColliderBuilder, ColliderHandle, FrictionModel, Group, InteractionGroups, InteractionTestMode,
    PhysicsPipeline, RigidBodyBuilder, RigidBodyHandle, SharedShape,
};

/// The fixed time step, seconds.
pub(super) const TIME_STEP_S: f32 = 1.0 / 240.0;
/// How far below the board a centre of mass must be for the body to be taken away, metres.
pub(super) const FALL_M: f32 = 0.10;
/// Force on the arm, newtons, from which it counts as blocked: what pushes a shelf full of objects along the board is
/// about half of it, what jams them against a wall far more.
pub(super) const BLOCKING_FORCE_N: f32 = 60.0;
/// Successive steps with that force until the arm gives up; a single hit is no blockade.
const BLOCKED_STEPS: u32 = 8;
/// Friction of shelf and tool; a contact has the mean of both sides.
const SHELF_FRICTION: f32 = 0.5;
const TOOL_FRICTION: f32 = 0.4;
/// Speed below which, for a fifth of a second, a body is at rest: 5 mm/s at the fastest of its points.
const REST_SPEED_M_S: f32 = 0.005;
const REST_TIME_S: f32 = 0.2;
/// Stand-ins for rolling resistance, which rapier has not: without them a can rolls for ever.
const LINEAR_DAMPING: f32 = 0.1;
const ANGULAR_DAMPING: f32 = 1.0;

const SHELF: Group = Group::GROUP_1;
const OBJECT: Group = Group::GROUP_2;
const TOOL: Group = Group::GROUP_3;
/// What the cup holds, beside [`OBJECT`].
const HELD: Group = Group::GROUP_4;

/// A rigid body of the arm.
#[derive(Clone)]
struct ArmBody {
    handle: RigidBodyHandle,
    /// Which of the arm's bodies it is.
    number: usize,
    /// Its colliders, each with its link and what that is for.
    parts: Vec<(ColliderHandle, String, Role)>,
}

/// All that the simulation remembers between two steps.
pub(super) struct Physics {
    world: PhysicsWorld,
    handles: Vec<RigidBodyHandle>,
    /// The arm's bodies while it moves.
    arm: Vec<ArmBody>,
    /// Board first, then back, left, right, ceiling.
    panels: Vec<ColliderHandle>,
    blocked_steps: u32,
    steps: u64,
    /// What the cup holds while it does.
    held: Option<suction::Held>,
}

impl Clone for Physics {
    fn clone(&self) -> Self {
        let world = &self.world;
        Self {
            world: PhysicsWorld {
                gravity: world.gravity,
                integration_parameters: world.integration_parameters,
                // Pipelines and the CCD solver are workspace; `begin` renews them in the original too.
                physics_pipeline: PhysicsPipeline::new(),
                collision_pipeline: Default::default(),
                ccd_solver: CCDSolver::new(),
                islands: world.islands.clone(),
                broad_phase: world.broad_phase.clone(),
                narrow_phase: world.narrow_phase.clone(),
                bodies: world.bodies.clone(),
                colliders: world.colliders.clone(),
                impulse_joints: world.impulse_joints.clone(),
                multibody_joints: world.multibody_joints.clone(),
                soft_bodies: world.soft_bodies.clone(),
            },
            handles: self.handles.clone(),
            arm: self.arm.clone(),
            panels: self.panels.clone(),
            blocked_steps: self.blocked_steps,
            steps: self.steps,
            held: self.held.clone(),
        }
    }
}

impl Physics {
    pub(super) fn new(shelf: &Shelf, bodies: &[Body]) -> Self {
        let mut world = PhysicsWorld { gravity: RapierVector::new(0.0, 0.0, -9.81), ..Default::default() };
        let parameters = &mut world.integration_parameters;
        parameters.dt = TIME_STEP_S;
        parameters.length_unit = 0.1;
        parameters.friction_model = FrictionModel::Coulomb;
        // A can dropped from the ceiling reaches 2.8 m/s; nothing has a reason to be faster.
        parameters.normalized_max_linear_velocity = 50.0;
        // Five millimetres of stale contacts are too many beside a corner of a box.
        parameters.normalized_contact_recycle_distance = 0.005;
        let mut panels = Vec::new();
        for panel in shelf_panels(shelf) {
            let (center, half) = (nalgebra::center(&panel.min, &panel.max), panel.size() * 0.5);
            let collider = ColliderBuilder::cuboid(half.x, half.y, half.z)
                .translation(to_rapier(center.coords))
                .friction(SHELF_FRICTION)
                .collision_groups(groups(SHELF, OBJECT));
            panels.push(world.insert_collider(collider, None));
        }
        let handles = bodies.iter().map(|body| insert_body(&mut world, body)).collect();
        Self { world, handles, arm: Vec::new(), panels, blocked_steps: 0, steps: 0, held: None }
    }

    /// Starts an action. Workspaces are renewed, so that a clone, which cannot copy them, starts from the same state.
    pub(super) fn begin(&mut self) {
        self.world.physics_pipeline = PhysicsPipeline::new();
        self.world.ccd_solver = CCDSolver::new();
        self.blocked_steps = 0;
    }

    /// Number of time steps so far.
    pub(super) fn steps(&self) -> u64 {
        self.steps
    }

    pub(super) fn step(&mut self) {
        self.world.step();
        self.steps += 1;
    }

    /// Whether every body sleeps.
    pub(super) fn is_at_rest(&self) -> bool {
        let moving = |handle: &RigidBodyHandle| self.world.bodies.get(*handle).is_some_and(|b| !b.is_sleeping());
        !self.handles.iter().any(moving)
    }

    /// Takes the rest of their speed from all bodies and lets them sleep.
    pub(super) fn stop_all(&mut self) {
        for &handle in &self.handles {
            if let Some(body) = self.world.bodies.get_mut(handle)
                && !body.is_sleeping()
            {
                body.set_linvel(RapierVector::ZERO, false);
                body.set_angvel(RapierVector::ZERO, false);
            }
        }
    }

    pub(super) fn pose(&self, at: usize) -> Pose {
        self.world.bodies.get(self.handles[at]).map_or_else(Pose::identity, |body| from_rapier(body.position()))
    }

    pub(super) fn center_of_mass(&self, at: usize) -> Point {
        let center = self.world.bodies.get(self.handles[at]).map_or(RapierVector::ZERO, |body| body.center_of_mass());
        Point::new(center.x, center.y, center.z)
    }

    pub(super) fn remove(&mut self, at: usize) {
        self.world.remove_body(self.handles[at]);
    }

    pub(super) fn kinetic_energy_j(&self) -> f32 {
        self.handles.iter().filter_map(|&handle| self.world.bodies.get(handle)).map(|body| body.kinetic_energy()).sum()
    }

    /// Puts the tool with its tip at `tip`.
    /// Whether what pushes has met more than [`BLOCKING_FORCE_N`] for a while, the last step included.
    fn note_force(&mut self, force_n: f32) -> bool {
        let blocked = force_n > BLOCKING_FORCE_N;
        self.blocked_steps = if blocked { self.blocked_steps + 1 } else { 0 };
        if self.blocked_steps >= BLOCKED_STEPS {
            self.blocked_steps = 0;
            return true;
        }
        false
    }

    /// Puts the arm's links where `joints` has them. The base touches nothing and is left out.
    pub(super) fn insert_arm(&mut self, arm: &Arm, joints: &Joints) {
        let poses = arm.body_poses(joints);
        for (number, parts) in arm.bodies.iter().enumerate().skip(1) {
            let pose = to_rapier_pose(&pose_of(&poses[number]));
            let handle = self.world.insert_body(RigidBodyBuilder::kinematic_position_based().pose(pose));
            let mut placed = Vec::with_capacity(parts.len());
            for part in parts {
                if let Some(shape) = shape_of(&part.shape) {
                    let collider =
                        ColliderBuilder::new(shape).friction(TOOL_FRICTION).collision_groups(groups(TOOL, OBJECT));
                    let collider = self.world.insert_collider(collider, Some(handle));
                    placed.push((collider, part.link.clone(), part.role));
                }
            }
            self.arm.push(ArmBody { handle, number, parts: placed });
        }
    }

    pub(super) fn remove_arm(&mut self) {
        for body in std::mem::take(&mut self.arm) {
            self.world.remove_body(body.handle);
        }
    }

    /// One time step in which the arm goes to `joints`; returns whether it has been blocked for a while.
    pub(super) fn step_arm(&mut self, arm: &Arm, joints: &Joints) -> bool {
        let poses = arm.body_poses(joints);
        for body in &self.arm {
            if let Some(rigid) = self.world.bodies.get_mut(body.handle) {
                rigid.set_next_kinematic_position(to_rapier_pose(&pose_of(&poses[body.number])));
            }
        }
        if let Some(at) = self.held() {
            self.world.wake_up(self.handles[at], true);
        }
        self.step();
        let parts = self.arm.iter().flat_map(|body| &body.parts);
        let force_n = parts.map(|(collider, ..)| self.force_on_n(*collider)).sum::<f32>();
        self.note_force(force_n)
    }

    /// Links (not the gripper) that touch an object now, with the object's number.
    pub(super) fn link_contacts(&self) -> Vec<(&str, usize)> {
        let mut contacts = Vec::new();
        for (collider, link, role) in self.arm.iter().flat_map(|body| &body.parts) {
            if *role == Role::Tool {
                continue;
            }
            for pair in self.world.narrow_phase.contact_pairs_with(*collider) {
                let other = if pair.collider1 == *collider { pair.collider2 } else { pair.collider1 };
                if pair.total_impulse_magnitude() > 0.0
                    && let Some(at) = self.object_of(other)
                {
                    contacts.push((link.as_str(), at));
                }
            }
        }
        contacts
    }

    /// Objects that press against a wall (not the board) with more than `force_n` newtons.
    pub(super) fn pressed_against_walls(&self, force_n: f32) -> Vec<usize> {
        let mut pressed = Vec::new();
        for &panel in self.panels.iter().skip(1) {
            for pair in self.world.narrow_phase.contact_pairs_with(panel) {
                let other = if pair.collider1 == panel { pair.collider2 } else { pair.collider1 };
                if pair.total_impulse_magnitude() / TIME_STEP_S > force_n
                    && let Some(at) = self.object_of(other)
                {
                    pressed.push(at);
                }
            }
        }
        pressed
    }

    /// How deep a link of the arm is in a panel of the shelf now, metres.
    pub(super) fn arm_in_shelf_m(&self) -> f32 {
        let mut deepest = 0.0_f32;
        for (collider, ..) in self.arm.iter().flat_map(|body| &body.parts) {
            let Some(part) = self.world.colliders.get(*collider) else { continue };
            let near = part.compute_aabb();
            for panel in self.panels.iter().filter_map(|panel| self.world.colliders.get(*panel)) {
                if !panel.compute_aabb().intersects(&near) {
                    continue;
                }
                let contact = rapier3d::parry::query::contact(
                    part.position(),
                    part.shape(),
                    panel.position(),
                    panel.shape(),
                    0.0,
                );
                if let Ok(Some(contact)) = contact {
                    deepest = deepest.max(-contact.dist);
                }
            }
        }
        deepest
    }

    /// The object that a collider belongs to.
    fn object_of(&self, collider: ColliderHandle) -> Option<usize> {
        let parent = self.world.colliders.get(collider)?.parent()?;
        self.handles.iter().position(|handle| *handle == parent)
    }

    fn force_on_n(&self, collider: ColliderHandle) -> f32 {
        let pairs = self.world.narrow_phase.contact_pairs_with(collider);
        pairs.map(|pair| pair.total_impulse_magnitude()).sum::<f32>() / TIME_STEP_S
    }

    pub(super) fn deepest_overlap_m(&self) -> f32 {
        let colliders: Vec<_> = self.world.colliders.iter().collect();
        let mut deepest = 0.0_f32;
        for (i, (_, a)) in colliders.iter().enumerate() {
            for (_, b) in &colliders[..i] {
                // Parts of one body may overlap, and so may the shelf's panels.
                if a.parent() == b.parent() {
                    continue;
                }
                let contact = rapier3d::parry::query::contact(a.position(), a.shape(), b.position(), b.shape(), 0.0);
                if let Ok(Some(contact)) = contact {
                    deepest = deepest.max(-contact.dist);
                }
            }
        }
        deepest
    }
}

fn insert_body(world: &mut PhysicsWorld, body: &Body) -> RigidBodyHandle {
    let mut builder = RigidBodyBuilder::dynamic()
        .pose(to_rapier_pose(&body.world_from_body))
        .linear_damping(LINEAR_DAMPING)
        .angular_damping(ANGULAR_DAMPING)
        .build();
    let activation = builder.activation_mut();
    // The threshold is in length units of 0.1 m.
    activation.normalized_linear_threshold = REST_SPEED_M_S / 0.1;
    activation.time_until_sleep = REST_TIME_S;
    let handle = world.insert_body(std::mem::take(&mut builder));
    let volume = body.solid.volume().max(f32::MIN_POSITIVE);
    for part in &body.solid.parts {
        if let Some(shape) = shape_of(part) {
            let collider = ColliderBuilder::new(shape)
                .mass(body.mass_kg * part.volume() / volume)
                .friction(body.friction)
                .collision_groups(groups(OBJECT, SHELF | OBJECT | TOOL));
            let _: ColliderHandle = world.insert_collider(collider, Some(handle));
        }
    }
    handle
}

fn shape_of(part: &ConvexPart) -> Option<SharedShape> {
    let points: Vec<RapierVector> = part.vertices.iter().map(|v| to_rapier(v.coords)).collect();
    let hull = ConvexPolyhedron::from_convex_mesh(points.clone(), &part.triangles)
        .or_else(|| ConvexPolyhedron::from_convex_hull(&points))?;
    Some(SharedShape::new(Hull::new(hull)))
}

fn groups(member: Group, filter: Group) -> InteractionGroups {
    InteractionGroups::new(member, filter, InteractionTestMode::And)
}

fn to_rapier(v: Vector) -> RapierVector {
    RapierVector::new(v.x, v.y, v.z)
}

fn to_rapier_pose(pose: &Pose) -> RapierPose {
    let q = pose.rotation.quaternion();
    RapierPose::from_parts(to_rapier(pose.translation.vector), RapierRotation::from_xyzw(q.i, q.j, q.k, q.w))
}

fn from_rapier(pose: &RapierPose) -> Pose {
    let (t, q) = (pose.translation, pose.rotation);
    Pose::from_parts(
        Translation3::new(t.x, t.y, t.z),
        UnitQuaternion::new_normalize(Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}
