//! Reading an arm from a URDF file.
//!
//! The chain goes from the root link to the tool's, whose frame has its origin at the finger tip, z as the approach axis
//! and x along the gripper's broad side; the module `ends` knows what it and the camera in hand are usually called.
//! Joints off the chain (fingers) stay at zero. Collision shapes are boxes, cylinders, capsules, spheres, and convex hulls
//! of meshes (.stl, .obj, .glb). A link without any has its visuals instead.

use super::bounds::{reaches, self_pairs};
use super::cover::{Ball, cover};
use super::description::{Description, Geometry, JointElement};
use super::model::{Arm, Cup, Joint, JointKind, Part, Role, identity};
use super::tree::{Tree, place};
use super::{Frame, Joints, MAX_JOINTS, ends, frame_of, shapes};
use crate::scene::{RobotFile, RobotPlacement};
use crate::{Error, Result};
use nalgebra::{Unit, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

/// The link that tells that a hand holds by suction.
const CUP: &str = "suction_cup";

impl Arm {
    /// The UR5 with a closed Robotiq 2F-85 gripper that comes with the program, where `placement` puts it.
    pub fn standard(placement: &RobotPlacement) -> Self {
        Self::parse(&RobotFile::gripper(), placement).expect("the shipped URDF file is sound")
    }

    /// The arm of a placement.
    ///
    /// # Errors
    /// A file that is no URDF, missing meshes, joints of kinds or links that are not known, a loop, no tool link, shapes or
    /// links without length, a hand without any shape, limits that are missing or the wrong way round: one line that
    /// names the file, its line and the link or joint.
    pub fn placed(placement: &RobotPlacement) -> Result<Self> {
        match &placement.urdf {
            None => Ok(Self::standard(placement)),
            Some(file) => Self::parse(file, placement),
        }
    }

    /// Reads an arm from a URDF file.
    ///
    /// # Errors
    /// Those of [`RobotFile::read`] and [`Arm::placed`].
    pub fn load(path: &Path, placement: &RobotPlacement) -> Result<Self> {
        Self::parse(&RobotFile::read(path, path.to_string_lossy())?, placement)
    }

    fn parse(file: &RobotFile, placement: &RobotPlacement) -> Result<Self> {
        let path = Path::new(&file.source);
        let robot = Description::parse(&file.text, path)?;
        Reader { file, path, tree: Tree::new(&robot, path)? }.arm(&robot, placement)
    }
}

struct Reader<'r> {
    file: &'r RobotFile,
    path: &'r Path,
    tree: Tree<'r>,
}

impl<'r> Reader<'r> {
    fn wrong_link<T>(&self, name: &str, message: impl Into<String>) -> Result<T> {
        let place = self.tree.links.get(name).map_or_else(|| format!("link {name}"), |link| place("link", &link.at));
        Err(Error::input(self.path, place, message))
    }

    fn arm(&self, robot: &'r Description, placement: &RobotPlacement) -> Result<Arm> {
        let tool = ends::tool(&self.tree, self.file.tool.as_deref(), self.path)?;
        let camera_link = ends::camera(&self.tree, self.file.camera.as_deref(), self.path)?;

        // The moving joints from the root to the tool.
        let mut moving: Vec<&JointElement> = Vec::new();
        let mut at = tool;
        while let Some(joint) = self.tree.above.get(at) {
            if joint.kind != "fixed" {
                moving.push(joint);
            }
            at = &joint.parent;
        }
        moving.reverse();
        if moving.is_empty() || moving.len() > MAX_JOINTS {
            let message = format!("{} joints move the tool; 1 to {MAX_JOINTS} are supported", moving.len());
            return self.wrong_link(tool, message);
        }

        // The body of each link and the link's pose in it.
        let bodies: BTreeMap<&str, (usize, Frame)> =
            self.tree.links.keys().map(|&link| Ok((link, self.body_of(link, &moving)?))).collect::<Result<_>>()?;
        let mut joints = Vec::with_capacity(moving.len());
        for joint in &moving {
            joints.push(self.joint(joint, &bodies)?);
        }
        self.check_lengths(&joints)?;

        let last = joints.len();
        let wrist = moving[last - 1].child.as_str();
        let (camera, last_from_camera) = match camera_link.map(|(link, sure)| (link, sure, bodies[link])) {
            Some((link, _, (body, from_camera))) if body == last => (Some(link), Some(from_camera)),
            Some((link, true, _)) => return self.wrong_link(link, "the camera must be fixed to the hand"),
            Some(_) | None => (None, None),
        };
        let mut parts: Vec<Vec<Part>> = vec![Vec::new(); last + 1];
        for link in &robot.links {
            let (body, body_from_link) = bodies[link.at.name.as_str()];
            // What is fixed to the last moving link is the gripper, and so is that link where it is the tool.
            let fixed_beyond = body == last && link.at.name != wrist && !self.tree.hangs_from(&link.at.name, camera);
            let role = if fixed_beyond || (body == last && tool == wrist) { Role::Tool } else { Role::Link };
            for shape in shapes::of_link(self.file, self.path, link, &body_from_link)? {
                let balls = cover(&shape);
                let around = Ball::around(&balls);
                parts[body].push(Part { link: link.at.name.clone(), role, shape, balls, around });
            }
        }
        if !parts[last].iter().any(|part| part.role == Role::Tool) {
            // Nothing is mounted: the last link itself pushes.
            parts[last].iter_mut().filter(|part| part.link == wrist).for_each(|part| part.role = Role::Tool);
        }
        if !parts[last].iter().any(|part| part.role == Role::Tool) {
            let message = "nothing from here to the tool has a collision shape or a visual that can be read: a push would \
                           move nothing";
            return self.wrong_link(wrist, message);
        }
        let last_from_tool = bodies[tool].1;
        let mut arm = Arm {
            name: if robot.name.is_empty() { "robot".to_owned() } else { robot.name.clone() },
            reach_m: Joints::zero(last),
            joints,
            places: parts.iter().enumerate().flat_map(|(b, of)| (0..of.len()).map(move |p| [b, p])).collect(),
            bodies: parts,
            world_from_base: frame_of(&placement.world_from_base()),
            last_from_tool,
            last_from_camera,
            tool_link: tool.to_owned(),
            camera_link: camera.map(str::to_owned),
            cup: self.cup(last, &bodies)?,
            warnings: Vec::new(),
            self_pairs: Vec::new(),
            closed_form: None,
        };
        arm.reach_m = reaches(&arm);
        arm.closed_form = arm.three_parallel();
        arm.self_pairs = self_pairs(&arm);
        arm.warnings = warnings(robot, &moving, &arm);
        Ok(arm)
    }

    /// The suction cup, if the hand has one.
    fn cup(&self, last: usize, bodies: &BTreeMap<&str, (usize, Frame)>) -> Result<Option<Cup>> {
        let Some(link) = self.tree.links.get(CUP) else { return Ok(None) };
        if bodies.get(CUP).is_none_or(|(body, _)| *body != last) {
            return self.wrong_link(CUP, "the suction cup must be fixed to the hand");
        }
        let radius = |geometry: &Geometry| match geometry {
            Geometry::Cylinder { radius, .. } => Some(*radius),
            _ => None,
        };
        let radii = link.collisions.iter().filter_map(|collision| radius(&collision.geometry));
        match radii.reduce(f64::max) {
            Some(radius_m) => Ok(Some(Cup { radius_m })),
            None => self.wrong_link(CUP, "a suction cup has a cylinder as wide as its rim"),
        }
    }

    /// The body that a link belongs to (how many joints of the chain are above it) and its pose in the body's frame.
    fn body_of(&self, link: &str, moving: &[&JointElement]) -> Result<(usize, Frame)> {
        let mut body_from_link = identity();
        let mut at = link;
        while at != self.tree.root {
            let joint = self.tree.above[at];
            if let Some(number) = moving.iter().position(|m| std::ptr::eq(*m, joint)) {
                return Ok((number + 1, body_from_link));
            }
            body_from_link = joint.parent_from_joint * body_from_link;
            at = &joint.parent;
        }
        Ok((0, body_from_link))
    }

    fn joint(&self, joint: &JointElement, bodies: &BTreeMap<&str, (usize, Frame)>) -> Result<Joint> {
        let wrong = |message: String| Err(Error::input(self.path, place("joint", &joint.at), message));
        let [lower, upper] = joint.limits;
        let (kind, lower, upper) = match joint.kind.as_str() {
            "revolute" => (JointKind::Turning, lower, upper),
            "prismatic" => (JointKind::Sliding, lower, upper),
            "continuous" => (JointKind::Turning, -TAU, TAU),
            other => {
                return wrong(format!("is {other}; between base and tool a joint turns, slides or is fixed"));
            }
        };
        if let Some(mimic) = &joint.mimic {
            return wrong(format!("follows joint `{mimic}`; between base and tool every joint moves by itself"));
        }
        if !(lower.is_finite() && upper.is_finite()) {
            return wrong(format!("limits {lower} to {upper} must be finite"));
        }
        if lower > upper {
            return wrong(format!("limits are the wrong way round: lower {lower} is above upper {upper}"));
        }
        if lower == upper {
            return wrong(format!("has no room to move: its limits are missing or both {lower}"));
        }
        if kind == JointKind::Turning && upper - lower > 4.0 * TAU {
            return wrong(format!("limits {lower} to {upper} rad: at most four turns are supported"));
        }
        let Some(speed) = joint.speed else {
            return wrong("has no velocity limit (limit velocity=\"...\", rad/s or m/s)".to_owned());
        };
        if !(speed > 0.0 && speed.is_finite()) {
            return wrong(format!("velocity limit is {speed}; it must be above 0"));
        }
        let axis = Vector3::from(joint.axis);
        let Some(axis) = Unit::try_new(axis, 1e-9).filter(|axis| axis.iter().all(|v| v.is_finite())) else {
            return wrong("its axis has no direction".to_owned());
        };
        let (_, body_from_parent) = bodies[joint.parent.as_str()];
        let parent_from_joint = body_from_parent * joint.parent_from_joint;
        Ok(Joint { name: joint.at.name.clone(), kind, parent_from_joint, axis, lower, upper, speed })
    }

    /// Two joints in a row that turn about one line have a link of no length between them.
    fn check_lengths(&self, joints: &[Joint]) -> Result<()> {
        for pair in joints.windows(2) {
            let [before, after] = pair else { continue };
            let turning = before.kind == JointKind::Turning && after.kind == JointKind::Turning;
            let from_after = after.parent_from_joint;
            let parallel = before.axis.cross(&(from_after.rotation * after.axis.into_inner())).norm() < 1e-6;
            let offset = before.axis.cross(&from_after.translation.vector).norm();
            if turning && parallel && offset < 1e-6 {
                let message =
                    format!("turns about the same line as joint `{}`: the link between has no length", before.name);
                let element = self.tree.above.values().find(|joint| joint.at.name == after.name);
                let place = element.map_or(String::new(), |joint| place("joint", &joint.at));
                return Err(Error::input(self.path, place, message));
            }
        }
        Ok(())
    }
}

/// What a person should know of an arm that can be used all the same.
fn warnings(robot: &Description, moving: &[&JointElement], arm: &Arm) -> Vec<String> {
    let mut warnings = Vec::new();
    let has_shape = |link: &str| arm.parts().any(|(_, part)| part.link == link);
    let names = |links: Vec<&str>| links.join(", ");
    let drawn: Vec<&str> =
        robot.links.iter().filter(|link| link.from_visuals).map(|link| link.at.name.as_str()).collect();
    let (stand_in, unread): (Vec<&str>, Vec<&str>) = drawn.into_iter().partition(|link| has_shape(link));
    if !stand_in.is_empty() {
        warnings.push(format!("no collision shapes on {}: the visuals stand in for them", names(stand_in)));
    }
    if !unread.is_empty() {
        let message = "no collision shapes, and visuals that cannot be read (.stl, .obj and .glb can), on";
        warnings.push(format!("{message} {}: nothing meets these links", names(unread)));
    }
    let bare = arm.bodies.iter().skip(1).zip(moving).filter(|(parts, _)| parts.is_empty());
    let bare: Vec<&str> = bare.map(|(_, joint)| joint.child.as_str()).collect();
    if !bare.is_empty() {
        warnings.push(format!("no shapes at all on what moves with {}: nothing meets it", names(bare)));
    }
    warnings
}

#[cfg(test)]
mod tests;
