//! An arm as the planner sees it: rigid bodies with simple shapes, joined in a chain.

use super::closed_form::ThreeParallel;
use super::cover::Ball;
use super::{Frame, Joints, MAX_JOINTS};
use crate::rng::ChaCha8Rng;
use crate::solid::ConvexPart;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use rand::Rng;

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// It turns about its axis; values are radians.
    Turning,
    /// It slides along its axis; values are metres.
    Sliding,
}

/// One moving joint.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Name in the URDF file.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// From the joint's frame at zero to the frame of the body before it.
    pub parent_from_joint: Frame,
    /// Axis in the joint's frame.
    pub axis: Unit<Vector3<f64>>,
    /// Smallest value, rad or m.
    pub lower: f64,
    /// Largest value, rad or m.
    pub upper: f64,
    /// Largest speed, rad/s or m/s.
    pub speed: f64,
}

impl Joint {
    /// The transform that the joint adds at `value`.
    pub fn parent_from_child(&self, value: f64) -> Frame {
        self.parent_from_joint
            * match self.kind {
                JointKind::Turning => {
                    Frame::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&self.axis, value))
                }
                JointKind::Sliding => {
                    Frame::from_parts(Translation3::from(self.axis.into_inner() * value), UnitQuaternion::identity())
                }
            }
    }
}

/// What a part is for when it meets something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A link of the arm: it may touch nothing.
    Link,
    /// The gripper: it may touch objects while it pushes.
    Tool,
}

/// One convex piece of a body.
#[derive(Clone, Debug)]
pub struct Part {
    /// The URDF link that it belongs to.
    pub link: String,
    /// What it is for.
    pub role: Role,
    /// Its shape in the frame of its body.
    pub shape: ConvexPart,
    /// Balls that cover it, in the frame of its body.
    pub balls: Vec<Ball>,
    /// A ball around them all.
    pub around: Ball,
}

/// A suction cup at the tool's frame, which points along its z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cup {
    /// Radius of the rim, metres.
    pub radius_m: f64,
}

/// A serial arm that stands somewhere.
#[derive(Clone, Debug)]
pub struct Arm {
    /// Name in the URDF file.
    pub name: String,
    /// The moving joints, from the base to the tool.
    pub joints: Vec<Joint>,
    /// Parts of each rigid body: the base first, then what each joint moves.
    pub bodies: Vec<Vec<Part>>,
    /// From the base to the shelf's frame.
    pub world_from_base: Frame,
    /// From the tool's frame (origin at the finger tip, z the approach axis, x along the broad side) to the last body's.
    pub last_from_tool: Frame,
    /// From the camera's frame (x right, y down, z forward) to the last body's, when there is a camera in hand.
    pub last_from_camera: Option<Frame>,
    /// The link that is the tool's frame.
    pub tool_link: String,
    /// The link that is the camera's frame.
    pub camera_link: Option<String>,
    /// The suction cup of a hand that has one; its rim is at the tool's frame.
    pub cup: Option<Cup>,
    /// What a person should know about the file that it was read from.
    pub warnings: Vec<String>,
    /// Per joint, how far the farthest point that it moves can be from its axis, metres (1 for a sliding joint): a
    /// change of the joint moves no point of the arm farther than that times the change.
    pub reach_m: Joints,
    /// Pairs of parts (of bodies that are not neighbours) that may collide, by position in [`Arm::parts`].
    pub(super) self_pairs: Vec<[u16; 2]>,
    /// Body and number within it of each part, in the order of [`Arm::parts`].
    pub(super) places: Vec<[usize; 2]>,
    pub(super) closed_form: Option<ThreeParallel>,
}

/// Poses of all bodies of an arm, the base first.
#[derive(Clone, Copy, Debug)]
pub struct BodyPoses {
    poses: [Frame; MAX_JOINTS + 1],
    count: usize,
}

impl std::ops::Deref for BodyPoses {
    type Target = [Frame];

    fn deref(&self) -> &[Frame] {
        &self.poses[..self.count]
    }
}

impl Arm {
    /// Poses of all bodies in the shelf's frame.
    pub fn body_poses(&self, joints: &Joints) -> BodyPoses {
        let mut poses = [self.world_from_base; MAX_JOINTS + 1];
        for (at, (joint, &value)) in self.joints.iter().zip(joints.iter()).enumerate() {
            poses[at + 1] = poses[at] * joint.parent_from_child(value);
        }
        BodyPoses { poses, count: self.joints.len() + 1 }
    }

    /// The tool's pose: forward kinematics.
    pub fn world_from_tool(&self, joints: &Joints) -> Frame {
        self.last_pose(joints) * self.last_from_tool
    }

    /// The pose of the camera in hand, if there is one.
    pub fn world_from_camera(&self, joints: &Joints) -> Option<Frame> {
        self.last_from_camera.map(|last_from_camera| self.last_pose(joints) * last_from_camera)
    }

    /// Where the tool must be for the camera to be at `world_from_camera`.
    pub fn tool_for_camera(&self, world_from_camera: &Frame) -> Option<Frame> {
        let last_from_camera = self.last_from_camera?;
        Some(world_from_camera * last_from_camera.inverse() * self.last_from_tool)
    }

    fn last_pose(&self, joints: &Joints) -> Frame {
        let mut pose = self.world_from_base;
        for (joint, &value) in self.joints.iter().zip(joints.iter()) {
            pose *= joint.parent_from_child(value);
        }
        pose
    }

    /// All parts with the number of their body, the base's first.
    pub fn parts(&self) -> impl Iterator<Item = (usize, &Part)> {
        self.bodies.iter().enumerate().flat_map(|(body, parts)| parts.iter().map(move |part| (body, part)))
    }

    /// Whether every joint is within its limits.
    pub fn within_limits(&self, joints: &Joints) -> bool {
        /// Rounding in the inverse is no violation, rad.
        const ROUNDING: f64 = 1e-9;
        let fits = |(joint, &value): (&Joint, &f64)| value >= joint.lower - ROUNDING && value <= joint.upper + ROUNDING;
        self.joints.iter().zip(joints.iter()).all(fits)
    }

    /// A configuration anywhere within the limits; every joint is as likely at any of its values.
    pub fn random(&self, rng: &mut ChaCha8Rng) -> Joints {
        let mut joints = Joints::zero(self.joints.len());
        for (value, joint) in joints.iter_mut().zip(&self.joints) {
            *value = rng.random_range(joint.lower..=joint.upper);
        }
        joints
    }

    /// An upper bound on how far any point of the arm moves between two configurations, metres.
    pub fn travel_m(&self, a: &Joints, b: &Joints) -> f64 {
        a.iter().zip(b.iter()).zip(self.reach_m.iter()).map(|((a, b), reach)| (a - b).abs() * reach).sum()
    }

    /// The shortest time from one configuration straight to another at full speed, seconds.
    pub fn shortest_time_s(&self, a: &Joints, b: &Joints) -> f64 {
        let times = a.iter().zip(b.iter()).zip(&self.joints).map(|((a, b), joint)| (a - b).abs() / joint.speed);
        times.fold(0.0, f64::max)
    }

    /// The link that the gripper's first part belongs to; the last link where there is no gripper.
    pub fn gripper_name(&self) -> &str {
        let parts = self.bodies.last().into_iter().flatten();
        let tool = parts.clone().find(|part| part.role == Role::Tool).or(parts.last());
        tool.map_or("gripper", |part| part.link.as_str())
    }

    /// Whether the inverse is computed in closed form.
    pub fn has_closed_form(&self) -> bool {
        self.closed_form.is_some()
    }

    /// The straight distance along the links from the first joint's axis to the tool with every bend stretched, metres:
    /// nothing farther from the first joint is in reach.
    pub fn stretched_m(&self) -> f64 {
        let offsets = self.joints.iter().skip(1).map(|joint| joint.parent_from_joint.translation.vector.norm());
        let slides = self.joints.iter().filter(|joint| joint.kind == JointKind::Sliding);
        offsets.sum::<f64>()
            + slides.map(|joint| joint.lower.abs().max(joint.upper.abs())).sum::<f64>()
            + self.last_from_tool.translation.vector.norm()
    }
}

/// The identity, spelled once for this module's users.
pub(super) fn identity() -> Frame {
    Isometry3::identity()
}
