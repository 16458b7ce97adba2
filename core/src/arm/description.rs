//! What a URDF file says, before it is checked: links with their collision shapes, and joints.
//!
//! Only what an arm needs is read: `link` (its `collision`s, or its `visual`s where it has none), `joint` with `origin`, `axis`, `limit` and `mimic`. The XML
//! is read by `roxmltree`, which keeps the place of every element, so that a fault is told with its line. (The crate
//! `urdf-rs` reads the same format, but forgets the places.)

use crate::scene::robot::{has_only_visuals, xml};
use crate::{Error, Result};
use nalgebra::{Translation3, UnitQuaternion};
use roxmltree::{Document, Node};
use std::path::Path;

use super::Frame;

/// Larger numbers are refused as lengths of an arm, metres.
pub(super) const FAR_M: f64 = 20.0;

/// A robot as its file describes it.
pub(super) struct Description {
    pub name: String,
    pub links: Vec<Link>,
    pub joints: Vec<JointElement>,
}

/// An element's name, and the line that it begins in.
#[derive(Clone)]
pub(super) struct Named {
    pub name: String,
    pub line: u32,
}

pub(super) struct Link {
    pub at: Named,
    pub collisions: Vec<Collision>,
    /// Whether these are the visuals of a link that has no collision shapes.
    pub from_visuals: bool,
}

pub(super) struct Collision {
    pub line: u32,
    pub link_from_shape: Frame,
    pub geometry: Geometry,
}

/// A collision shape; sizes in metres.
pub(super) enum Geometry {
    Box { size: [f64; 3] },
    Cylinder { radius: f64, length: f64 },
    Capsule { radius: f64, length: f64 },
    Sphere { radius: f64 },
    Mesh { filename: String, scale: [f64; 3] },
}

pub(super) struct JointElement {
    pub at: Named,
    /// The `type` attribute.
    pub kind: String,
    pub parent: String,
    pub child: String,
    pub parent_from_joint: Frame,
    pub axis: [f64; 3],
    /// Lower and upper; both 0 where they are missing.
    pub limits: [f64; 2],
    /// Largest speed, rad/s or m/s, if it is there.
    pub speed: Option<f64>,
    /// The joint that it follows.
    pub mimic: Option<String>,
}

impl Description {
    /// Reads a URDF file's text; `path` is what errors name.
    pub(super) fn parse(text: &str, path: &Path) -> Result<Self> {
        let document = xml(text, path)?;
        let root = document.root_element();
        if !root.has_tag_name("robot") {
            let message = format!("not a URDF file: its root is `{}`, not `robot`", root.tag_name().name());
            return Err(Error::input(path, "line 1", message));
        }
        let reader = Reader { document: &document, path };
        let elements = |name: &'static str| root.children().filter(move |node| node.has_tag_name(name));
        Ok(Self {
            name: root.attribute("name").unwrap_or_default().to_owned(),
            links: elements("link").map(|node| reader.link(node)).collect::<Result<_>>()?,
            joints: elements("joint").map(|node| reader.joint(node)).collect::<Result<_>>()?,
        })
    }
}

struct Reader<'d> {
    document: &'d Document<'d>,
    path: &'d Path,
}

impl Reader<'_> {
    fn line(&self, node: &Node<'_, '_>) -> u32 {
        self.document.text_pos_at(node.range().start).row
    }

    /// `line 12, joint elbow`: the place of an element by the link or joint that it belongs to.
    fn place(&self, node: &Node<'_, '_>) -> String {
        let owner = node.ancestors().find(|above| above.has_tag_name("link") || above.has_tag_name("joint"));
        let owner = owner.map_or(String::new(), |owner| {
            format!(", {} {}", owner.tag_name().name(), owner.attribute("name").unwrap_or("without a name"))
        });
        format!("line {}{owner}", self.line(node))
    }

    fn wrong<T>(&self, node: &Node<'_, '_>, message: impl Into<String>) -> Result<T> {
        Err(Error::input(self.path, self.place(node), message))
    }

    fn named(&self, node: &Node<'_, '_>) -> Result<Named> {
        match node.attribute("name") {
            Some(name) if !name.is_empty() => Ok(Named { name: name.to_owned(), line: self.line(node) }),
            _ => self.wrong(node, format!("a {} without a name", node.tag_name().name())),
        }
    }

    fn link(&self, node: Node<'_, '_>) -> Result<Link> {
        let from_visuals = has_only_visuals(&node);
        let tag = if from_visuals { "visual" } else { "collision" };
        let mut collisions = Vec::new();
        for collision in node.children().filter(|child| child.has_tag_name(tag)) {
            let geometry = child(&collision, "geometry").and_then(|g| g.children().find(Node::is_element));
            let Some(shape) = geometry else { return self.wrong(&collision, format!("a {tag} without a shape")) };
            collisions.push(Collision {
                line: self.line(&collision),
                link_from_shape: self.origin(&collision)?,
                geometry: self.geometry(&shape)?,
            });
        }
        Ok(Link { at: self.named(&node)?, collisions, from_visuals })
    }

    fn geometry(&self, shape: &Node<'_, '_>) -> Result<Geometry> {
        let number = |name: &str| match self.numbers::<1>(shape, name)? {
            Some([value]) => Ok(value),
            None => self.wrong(shape, format!("a {} without {name}", shape.tag_name().name())),
        };
        Ok(match shape.tag_name().name() {
            "box" => match self.numbers::<3>(shape, "size")? {
                Some(size) => Geometry::Box { size },
                None => return self.wrong(shape, "a box without size"),
            },
            "cylinder" => Geometry::Cylinder { radius: number("radius")?, length: number("length")? },
            "capsule" => Geometry::Capsule { radius: number("radius")?, length: number("length")? },
            "sphere" => Geometry::Sphere { radius: number("radius")? },
            "mesh" => match shape.attribute("filename") {
                Some(filename) => Geometry::Mesh {
                    filename: filename.to_owned(),
                    scale: self.numbers::<3>(shape, "scale")?.unwrap_or([1.0; 3]),
                },
                None => return self.wrong(shape, "a mesh without filename"),
            },
            other => return self.wrong(shape, format!("shape `{other}` is not known")),
        })
    }

    fn joint(&self, node: Node<'_, '_>) -> Result<JointElement> {
        let end = |name: &str| match child(&node, name).and_then(|end| end.attribute("link")) {
            Some(link) => Ok(link.to_owned()),
            None => self.wrong(&node, format!("has no {name} link")),
        };
        let at = self.named(&node)?;
        let Some(kind) = node.attribute("type") else { return self.wrong(&node, "has no type") };
        let axis = child(&node, "axis").map(|axis| self.numbers::<3>(&axis, "xyz")).transpose()?.flatten();
        let limit = child(&node, "limit");
        let number = |name: &str| -> Result<Option<f64>> {
            Ok(limit.map(|limit| self.numbers::<1>(&limit, name)).transpose()?.flatten().map(|[value]| value))
        };
        Ok(JointElement {
            at,
            kind: kind.to_owned(),
            parent: end("parent")?,
            child: end("child")?,
            parent_from_joint: self.origin(&node)?,
            axis: axis.unwrap_or([1.0, 0.0, 0.0]),
            limits: [number("lower")?.unwrap_or(0.0), number("upper")?.unwrap_or(0.0)],
            speed: number("velocity")?,
            mimic: child(&node, "mimic").map(|mimic| mimic.attribute("joint").unwrap_or_default().to_owned()),
        })
    }

    /// The transform of an `origin`: metres, then fixed-axis roll, pitch and yaw.
    fn origin(&self, node: &Node<'_, '_>) -> Result<Frame> {
        let Some(origin) = child(node, "origin") else { return Ok(Frame::identity()) };
        let [x, y, z] = self.numbers::<3>(&origin, "xyz")?.unwrap_or_default();
        let [roll, pitch, yaw] = self.numbers::<3>(&origin, "rpy")?.unwrap_or_default();
        if ![x, y, z].iter().all(|v| v.abs() <= FAR_M) || ![roll, pitch, yaw].iter().all(|v| v.is_finite()) {
            return self.wrong(&origin, format!("origin [{x}, {y}, {z}] must be finite and within {FAR_M} m"));
        }
        Ok(Frame::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw)))
    }

    /// An attribute of `N` numbers, if it is there.
    fn numbers<const N: usize>(&self, node: &Node<'_, '_>, name: &str) -> Result<Option<[f64; N]>> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
            Some(numbers) => Ok(Some(numbers)),
            None => self.wrong(node, format!("{name}=\"{text}\" must be {N} number{}", if N == 1 { "" } else { "s" })),
        }
    }
}

fn child<'a, 'i>(node: &Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}
