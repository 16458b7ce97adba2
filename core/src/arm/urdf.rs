//! Reading an arm from a URDF file.
//!
//! The chain goes from the root link to the link named `tool` (or `tool0`, `tcp`, `tool_tip`), whose frame has its
//! origin at the finger tip, z as the approach axis and x along the gripper's broad side. A link named `camera` (or
//! `camera_optical_frame`) is the camera in hand. Joints off the chain (fingers) stay at zero. Collision shapes are
//! boxes, cylinders, capsules, spheres, and convex hulls of meshes (.stl, .obj, .glb); visuals are not read.

use super::closed_form::ThreeParallel;
use super::cover::{Ball, cover};
use super::model::{Arm, Joint, JointKind, Part, Role, identity};
use super::placement::RobotPlacement;
use super::{Frame, Joints, MAX_JOINTS, frame_of};
use crate::rng::stream;
use crate::scene::read_mesh_points;
use crate::solid::ConvexPart;
use crate::{Error, Point, Result};
use nalgebra::{Translation3, Unit, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// The arm that comes with the program.
const SHIPPED: &str = include_str!("../../../assets/robots/ur5_2f85.urdf");
/// Its name in messages.
const SHIPPED_NAME: &str = "ur5_2f85.urdf";
const TOOL_LINKS: [&str; 4] = ["tool", "tool_tip", "tcp", "tool0"];
const CAMERA_LINKS: [&str; 2] = ["camera", "camera_optical_frame"];
/// Sides of the prism that stands for a cylinder.
const SIDES: usize = 16;
/// Numbers beyond this are no lengths of an arm, metres.
const FAR_M: f64 = 20.0;
/// A URDF file larger than this, bytes, is something else.
const MAX_BYTES: u64 = 16 << 20;

impl Arm {
    /// The UR5 with a closed Robotiq 2F-85 gripper that comes with the program.
    pub fn standard(placement: &RobotPlacement) -> Self {
        Self::parse(SHIPPED, Path::new(SHIPPED_NAME), placement).expect("the shipped URDF file is sound")
    }

    /// The arm of a placement; its URDF file is looked for in `folder`.
    ///
    /// # Errors
    /// As for [`Arm::load`].
    pub fn placed(placement: &RobotPlacement, folder: &Path) -> Result<Self> {
        match &placement.urdf {
            None => Ok(Self::standard(placement)),
            Some(file) => Self::load(&folder.join(file), placement),
        }
    }

    /// Reads an arm from a URDF file.
    ///
    /// # Errors
    /// A file that cannot be read or is no URDF, missing meshes, joints of kinds or links that are not known, a loop, no
    /// tool link, shapes or links without length, limits that are missing or the wrong way round: one line that names the
    /// file and the link or joint.
    pub fn load(path: &Path, placement: &RobotPlacement) -> Result<Self> {
        let length = std::fs::metadata(path).map_err(|error| Error::io(path, error))?.len();
        if length > MAX_BYTES {
            return Err(Error::input(path, "", format!("{length} bytes; a URDF file has at most {MAX_BYTES}")));
        }
        let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
        let text = String::from_utf8(bytes).map_err(|_| Error::input(path, "", "not a URDF file (not UTF-8 text)"))?;
        Self::parse(&text, path, placement)
    }

    /// Reads an arm from the text of a URDF file; `path` is what errors name and what mesh files are relative to.
    ///
    /// # Errors
    /// As for [`Arm::load`].
    pub fn parse(text: &str, path: &Path, placement: &RobotPlacement) -> Result<Self> {
        let robot = urdf_rs::read_from_string(text).map_err(|error| {
            let message = error.to_string().lines().collect::<Vec<_>>().join(" ");
            Error::input(path, "", format!("not a URDF file that can be read: {message}"))
        })?;
        Reader { text, path, tree: Tree::new(&robot, text, path)? }.arm(&robot, placement)
    }
}

/// Where things stand in the file, for messages.
fn place(text: &str, element: &str, name: &str) -> String {
    let opening = format!("<{element}");
    let named = [format!("name=\"{name}\""), format!("name='{name}'")];
    let line = text.match_indices(&opening).find_map(|(at, _)| {
        let tag = &text[at..];
        let tag = &tag[..tag.find('>').unwrap_or(tag.len())];
        let of_element = tag[opening.len()..].starts_with(char::is_whitespace);
        (of_element && named.iter().any(|n| tag.contains(n.as_str()))).then(|| text[..at].matches('\n').count() + 1)
    });
    line.map_or_else(|| format!("{element} {name}"), |line| format!("line {line}, {element} {name}"))
}

/// Links and what joins them, checked to be one tree.
struct Tree<'r> {
    links: BTreeMap<&'r str, &'r urdf_rs::Link>,
    /// The joint above each link but the root.
    above: BTreeMap<&'r str, &'r urdf_rs::Joint>,
    root: &'r str,
}

impl<'r> Tree<'r> {
    fn new(robot: &'r urdf_rs::Robot, text: &str, path: &Path) -> Result<Self> {
        let mut links = BTreeMap::new();
        for link in &robot.links {
            if links.insert(link.name.as_str(), link).is_some() {
                return Err(Error::input(path, place(text, "link", &link.name), "is there twice"));
            }
        }
        if links.is_empty() {
            return Err(Error::input(path, "", "has no links"));
        }
        let mut above: BTreeMap<&str, &urdf_rs::Joint> = BTreeMap::new();
        for joint in &robot.joints {
            let wrong = |message: String| Err(Error::input(path, place(text, "joint", &joint.name), message));
            for (end, name) in [("parent", &joint.parent.link), ("child", &joint.child.link)] {
                if !links.contains_key(name.as_str()) {
                    return wrong(format!("its {end} link `{name}` is not in the file"));
                }
            }
            if let Some(other) = above.insert(&joint.child.link, joint) {
                let child = &joint.child.link;
                return wrong(format!("closes a loop: link `{child}` already hangs from joint `{}`", other.name));
            }
        }
        for joint in &robot.joints {
            let mut at = joint.child.link.as_str();
            for _ in 0..=links.len() {
                match above.get(at) {
                    Some(above) => at = &above.parent.link,
                    None => break,
                }
            }
            if above.contains_key(at) {
                let message = "is part of a loop: its links have no root";
                return Err(Error::input(path, place(text, "joint", &joint.name), message));
            }
        }
        let roots: Vec<&str> = links.keys().copied().filter(|link| !above.contains_key(link)).collect();
        match roots[..] {
            [root] => Ok(Self { links, above, root }),
            _ => {
                let message = format!("has {} links that hang from nothing: {}", roots.len(), roots.join(", "));
                Err(Error::input(path, "", message))
            }
        }
    }
}

struct Reader<'r> {
    text: &'r str,
    path: &'r Path,
    tree: Tree<'r>,
}

impl<'r> Reader<'r> {
    fn wrong<T>(&self, element: &str, name: &str, message: impl Into<String>) -> Result<T> {
        Err(Error::input(self.path, place(self.text, element, name), message))
    }

    fn arm(&self, robot: &'r urdf_rs::Robot, placement: &RobotPlacement) -> Result<Arm> {
        let Some(tool) = TOOL_LINKS.into_iter().find(|name| self.tree.links.contains_key(name)) else {
            let message = format!(
                "has no tool link: name the frame at the finger tip `{}` (z ahead, x along the broad side)",
                TOOL_LINKS[0]
            );
            return Err(Error::input(self.path, "", message));
        };
        let camera = CAMERA_LINKS.into_iter().find(|name| self.tree.links.contains_key(name));

        // The moving joints from the root to the tool.
        let mut moving: Vec<&urdf_rs::Joint> = Vec::new();
        let mut at = tool;
        while let Some(joint) = self.tree.above.get(at) {
            if joint.joint_type != urdf_rs::JointType::Fixed {
                moving.push(joint);
            }
            at = &joint.parent.link;
        }
        moving.reverse();
        if moving.is_empty() || moving.len() > MAX_JOINTS {
            let message = format!("{} joints move the tool; 1 to {MAX_JOINTS} are supported", moving.len());
            return Err(Error::input(self.path, place(self.text, "link", tool), message));
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
        let wrist = moving[last - 1].child.link.as_str();
        let mut parts: Vec<Vec<Part>> = vec![Vec::new(); last + 1];
        for link in &robot.links {
            let (body, body_from_link) = bodies[link.name.as_str()];
            // What is fixed to the last moving link is the gripper; so is the last link where nothing is.
            let fixed_beyond = body == last && link.name != wrist && !self.hangs_from(&link.name, camera);
            let role = if fixed_beyond || (body == last && tool == wrist) { Role::Tool } else { Role::Link };
            for shape in self.shapes(link, &body_from_link)? {
                let balls = cover(&shape);
                let around = Ball::around(&balls);
                parts[body].push(Part { link: link.name.clone(), role, shape, balls, around });
            }
        }
        let last_from_tool = bodies[tool].1;
        let last_from_camera = match camera.map(|camera| bodies[camera]) {
            Some((body, from_camera)) if body == last => Some(from_camera),
            Some(_) => return self.wrong("link", camera.unwrap_or_default(), "the camera must be fixed to the hand"),
            None => None,
        };
        let mut arm = Arm {
            name: if robot.name.is_empty() { "robot".to_owned() } else { robot.name.clone() },
            reach_m: Joints::zero(last),
            joints,
            places: parts.iter().enumerate().flat_map(|(b, of)| (0..of.len()).map(move |p| [b, p])).collect(),
            bodies: parts,
            world_from_base: frame_of(&placement.world_from_base()),
            last_from_tool,
            last_from_camera,
            self_pairs: Vec::new(),
            closed_form: None,
        };
        arm.reach_m = reaches(&arm);
        arm.closed_form = ThreeParallel::of(&arm);
        arm.self_pairs = self_pairs(&arm);
        Ok(arm)
    }

    fn hangs_from(&self, link: &str, ancestor: Option<&str>) -> bool {
        let mut at = link;
        loop {
            if Some(at) == ancestor {
                return true;
            }
            match self.tree.above.get(at) {
                Some(joint) => at = &joint.parent.link,
                None => return false,
            }
        }
    }

    /// The body that a link belongs to (how many joints of the chain are above it) and its pose in the body's frame.
    fn body_of(&self, link: &str, moving: &[&urdf_rs::Joint]) -> Result<(usize, Frame)> {
        let mut body_from_link = identity();
        let mut at = link;
        while at != self.tree.root {
            let joint = self.tree.above[at];
            if let Some(number) = moving.iter().position(|m| m.name == joint.name && m.child.link == joint.child.link) {
                return Ok((number + 1, body_from_link));
            }
            body_from_link = self.origin(&joint.origin, "joint", &joint.name)? * body_from_link;
            at = &joint.parent.link;
        }
        Ok((0, body_from_link))
    }

    fn origin(&self, pose: &urdf_rs::Pose, element: &str, name: &str) -> Result<Frame> {
        let ([x, y, z], [roll, pitch, yaw]) = (pose.xyz.0, pose.rpy.0);
        if ![x, y, z].iter().all(|v| v.abs() <= FAR_M) || ![roll, pitch, yaw].iter().all(|v| v.is_finite()) {
            return self.wrong(element, name, format!("origin [{x}, {y}, {z}] must be finite and within {FAR_M} m"));
        }
        Ok(Frame::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw)))
    }

    fn joint(&self, joint: &urdf_rs::Joint, bodies: &BTreeMap<&str, (usize, Frame)>) -> Result<Joint> {
        use urdf_rs::JointType;
        let wrong = |message: String| self.wrong("joint", &joint.name, message);
        let limit = &joint.limit;
        let (kind, lower, upper) = match joint.joint_type {
            JointType::Revolute => (JointKind::Turning, limit.lower, limit.upper),
            JointType::Prismatic => (JointKind::Sliding, limit.lower, limit.upper),
            JointType::Continuous => (JointKind::Turning, -TAU, TAU),
            ref other => {
                let kind = format!("{other:?}").to_lowercase();
                return wrong(format!("is {kind}; between base and tool a joint turns, slides or is fixed"));
            }
        };
        if let Some(mimic) = &joint.mimic {
            return wrong(format!("follows joint `{}`; between base and tool every joint moves by itself", mimic.joint));
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
        if !(limit.velocity > 0.0 && limit.velocity.is_finite()) {
            return wrong(format!("velocity limit is {}; it must be above 0", limit.velocity));
        }
        let axis = Vector3::from(joint.axis.xyz.0);
        let Some(axis) = Unit::try_new(axis, 1e-9).filter(|axis| axis.iter().all(|v| v.is_finite())) else {
            return wrong("its axis has no direction".to_owned());
        };
        let (_, body_from_parent) = bodies[joint.parent.link.as_str()];
        let parent_from_joint = body_from_parent * self.origin(&joint.origin, "joint", &joint.name)?;
        Ok(Joint { name: joint.name.clone(), kind, parent_from_joint, axis, lower, upper, speed: limit.velocity })
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
                let message = format!("turns about the same line as joint `{}`: the link between has no length", before.name);
                return self.wrong("joint", &after.name, message);
            }
        }
        Ok(())
    }

    /// Convex shapes of a link in its body's frame.
    fn shapes(&self, link: &urdf_rs::Link, body_from_link: &Frame) -> Result<Vec<ConvexPart>> {
        let mut shapes = Vec::new();
        for collision in &link.collision {
            let from_shape = body_from_link * self.origin(&collision.origin, "link", &link.name)?;
            for points in self.points(link, &collision.geometry)? {
                let place = |p: &Point| (from_shape * p.map(f64::from)).map(|v| v as f32);
                let points: Vec<Point> = points.iter().map(place).collect();
                match ConvexPart::hull(&points) {
                    Some(part) => shapes.push(part),
                    None => return self.wrong("link", &link.name, "a collision shape has no volume"),
                }
            }
        }
        Ok(shapes)
    }

    /// Corners of a collision shape's convex pieces, in the shape's frame.
    fn points(&self, link: &urdf_rs::Link, geometry: &urdf_rs::Geometry) -> Result<Vec<Vec<Point>>> {
        let size = |name: &str, value: f64| -> Result<f32> {
            if value > 0.0 && value <= FAR_M {
                return Ok(value as f32);
            }
            self.wrong("link", &link.name, format!("{name} {value} of a collision shape: must be above 0, at most {FAR_M} m"))
        };
        Ok(match geometry {
            urdf_rs::Geometry::Box { size: extent } => {
                let [x, y, z] = extent.0;
                let half = [size("width", x)? / 2.0, size("depth", y)? / 2.0, size("height", z)? / 2.0];
                let corner = |i: usize| [0, 1, 2].map(|a| if i >> a & 1 == 1 { half[a] } else { -half[a] }).into();
                vec![(0..8).map(corner).collect()]
            }
            urdf_rs::Geometry::Cylinder { radius, length } => {
                let half = size("length", *length)? / 2.0;
                vec![prism(size("radius", *radius)?, half)]
            }
            urdf_rs::Geometry::Capsule { radius, length } => {
                let (radius, half) = (size("radius", *radius)?, size("length", *length)? / 2.0);
                let mut points = ball(radius);
                points.iter_mut().for_each(|p| p.z += if p.z >= 0.0 { half } else { -half });
                points.extend(prism(radius, half));
                vec![points]
            }
            urdf_rs::Geometry::Sphere { radius } => vec![ball(size("radius", *radius)?)],
            urdf_rs::Geometry::Mesh { filename, scale } => {
                let file = self.mesh_file(link, filename)?;
                let scale = scale.map_or([1.0; 3], |scale| scale.0);
                let stretch = |p: Point| Point::from([0, 1, 2].map(|a| p[a] * scale[a] as f32));
                vec![read_mesh_points(&file)?.into_iter().map(stretch).collect()]
            }
        })
    }

    /// The file of a mesh: `package://name/rest` is looked for as `name/rest` and as `rest` in the folders above the URDF
    /// file.
    fn mesh_file(&self, link: &urdf_rs::Link, filename: &str) -> Result<PathBuf> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let found = match filename.strip_prefix("package://") {
            None => Some(folder.join(filename.strip_prefix("file://").unwrap_or(filename))).filter(|file| file.is_file()),
            Some(inside) => {
                let rest = inside.split_once('/').map_or(inside, |(_, rest)| rest);
                let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
                let tries = folder.ancestors().flat_map(|above| [above.join(inside), above.join(rest)]);
                tries.into_iter().find(|file| file.is_file())
            }
        };
        match found {
            Some(file) => Ok(file),
            None => self.wrong("link", &link.name, format!("mesh `{filename}` is not there")),
        }
    }
}

/// A prism around a cylinder: its sides touch the cylinder from outside.
fn prism(radius: f32, half: f32) -> Vec<Point> {
    let outer = radius / (std::f32::consts::PI / SIDES as f32).cos();
    let corner = |i: usize| {
        let angle = std::f32::consts::TAU * i as f32 / SIDES as f32;
        [-half, half].map(|z| Point::new(outer * angle.cos(), outer * angle.sin(), z))
    };
    (0..SIDES).flat_map(corner).collect()
}

/// Corners of a polyhedron around a ball.
fn ball(radius: f32) -> Vec<Point> {
    let rings = SIDES / 2;
    let step = std::f32::consts::PI / rings as f32;
    let outer = radius / ((0.5 * step).cos() * (std::f32::consts::PI / SIDES as f32).cos());
    let ring = |i: usize| {
        let latitude = (i as f32 + 0.5) * step - std::f32::consts::FRAC_PI_2;
        (0..SIDES).map(move |j| {
            let longitude = std::f32::consts::TAU * j as f32 / SIDES as f32;
            let flat = outer * latitude.cos();
            Point::new(flat * longitude.cos(), flat * longitude.sin(), outer * latitude.sin())
        })
    };
    (0..rings).flat_map(ring).collect()
}

/// Per joint, how far the farthest point beyond it can be from its axis.
fn reaches(arm: &Arm) -> Joints {
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
fn self_pairs(arm: &Arm) -> Vec<[u16; 2]> {
    let parts: Vec<(usize, &Part)> = arm.parts().collect();
    let mut rng = stream(0, "pairs of links", 0);
    let poses: Vec<_> = (0..100).map(|_| arm.body_poses(&arm.random(&mut rng))).collect();
    let mut pairs = Vec::new();
    for (a, (body_a, part_a)) in parts.iter().enumerate() {
        for (b, (body_b, part_b)) in parts.iter().enumerate().skip(a + 1) {
            let overlaps = |poses: &super::BodyPoses| {
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
