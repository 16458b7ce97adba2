//! Which arm stands where before the shelf: the `[robot]` table of a scene.

use super::{Shelf, read_mesh_points};
use crate::solid::ConvexPart;
use crate::{Error, Pose, Result, Vector};
use nalgebra::{Translation3, UnitQuaternion};
use roxmltree::{Document, Node};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A URDF file larger than this, bytes, is something else.
const MAX_BYTES: u64 = 16 << 20;

/// Which arm stands where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RobotPlacement {
    /// The arm's own URDF file; `None` for the UR5 with its gripper that comes with the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub urdf: Option<RobotFile>,
    /// Origin of the arm's base, metres; the table that it stands on is as high.
    pub base: [f32; 3],
    /// Counter-clockwise turn of the base about z, degrees.
    pub yaw_deg: f32,
}

impl Default for RobotPlacement {
    /// The shipped arm, 0.70 m before the shelf's front edge and 15 mm under its board.
    fn default() -> Self {
        Self { urdf: None, base: [0.0, -0.70, -0.015], yaw_deg: 0.0 }
    }
}

impl RobotPlacement {
    /// The base's pose.
    pub fn world_from_base(&self) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&Vector::z_axis(), self.yaw_deg.to_radians());
        Pose::from_parts(Translation3::from(Vector::from(self.base)), turn)
    }

    /// What is wrong with the place, if anything: a base that is no number, far away, or inside the shelf.
    pub fn fault(&self, shelf: &Shelf) -> Option<String> {
        /// Farther than this from the shelf's front edge no arm reaches it, metres.
        const FAR_M: f32 = 10.0;
        /// Half a base's width, metres.
        const BASE_M: f32 = 0.08;
        let [x, y, z] = self.base;
        if !(self.base.iter().all(|v| v.abs() <= FAR_M) && self.yaw_deg.abs() <= 3600.0) {
            return Some(format!(
                "robot base [{x}, {y}, {z}], yaw_deg = {}: must be finite and within {FAR_M} m of the shelf's origin",
                self.yaw_deg
            ));
        }
        let (min, max) = (shelf.min(), shelf.max());
        let inside = x > min.x - BASE_M && x < max.x + BASE_M && y > min.y - BASE_M && y < max.y + BASE_M && z < max.z;
        inside.then(|| {
            format!("robot base [{x}, {y}, {z}] stands in or under the shelf; put it before y = {}", min.y - BASE_M)
        })
    }
}

/// A URDF file with the hulls of the meshes that it names, so that an episode needs no other file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotFile {
    /// The file that it was read from, relative to the scene.
    pub source: String,
    /// The file's text.
    pub text: String,
    /// Corners of the convex hull of each collision mesh, in the mesh file's own unit, by the name that the text gives it;
    /// of a link without collision shapes those of its visuals, as far as they can be read.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub meshes: BTreeMap<String, Vec<[f32; 3]>>,
    /// The link at the finger tip, where it was named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
    /// The link of the camera in hand, where it was named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
}

impl RobotFile {
    /// The UR5 with a closed Robotiq 2F-85 gripper that comes with the program.
    pub fn gripper() -> Self {
        Self::shipped("ur5_2f85.urdf", include_str!("../../../assets/robots/ur5_2f85.urdf"))
    }

    /// The UR5 with a suction cup that comes with the program.
    pub fn suction() -> Self {
        Self::shipped("ur5_suction.urdf", include_str!("../../../assets/robots/ur5_suction.urdf"))
    }

    fn shipped(source: &str, text: &str) -> Self {
        Self { source: source.to_owned(), text: text.to_owned(), meshes: BTreeMap::new(), tool: None, camera: None }
    }

    /// The arm that a person names: `gripper` or `suction` of those that come with the program, else a URDF file.
    ///
    /// # Errors
    /// Those of [`RobotFile::read`].
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "gripper" => Ok(Self::gripper()),
            "suction" => Ok(Self::suction()),
            file => Self::read(Path::new(file), file),
        }
    }

    /// Reads a URDF file and the collision meshes that it names; `source` is what it is called from then on.
    ///
    /// # Errors
    /// A file that cannot be read or is no XML, a mesh that is not there or has no volume: one line that names file, line
    /// and link.
    pub fn read(path: &Path, source: impl Into<String>) -> Result<Self> {
        let length = std::fs::metadata(path).map_err(|error| Error::io(path, error))?.len();
        if length > MAX_BYTES {
            return Err(Error::input(path, "", format!("{length} bytes; a URDF file has at most {MAX_BYTES}")));
        }
        let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
        let text = String::from_utf8(bytes).map_err(|_| Error::input(path, "", "not a URDF file (not UTF-8 text)"))?;
        let document = xml(&text, path)?;
        let mut meshes = BTreeMap::new();
        for node in document.descendants().filter(|node| node.has_tag_name("mesh")) {
            let Some(name) = node.attribute("filename") else { continue };
            let inside = |tag: &str| node.ancestors().any(|above| above.has_tag_name(tag));
            let stands_in = inside("visual") && node.ancestors().any(|above| has_only_visuals(&above));
            if !(inside("collision") || stands_in) {
                continue;
            }
            match hull_of(path, name) {
                Ok(hull) => {
                    meshes.insert(name.to_owned(), hull);
                }
                // A picture's format need not be read here; who uses the arm is told which link has no shape.
                Err(_) if stands_in => {}
                Err(message) => return Err(Error::input(path, mesh_place(&document, &node), message)),
            }
        }
        Ok(Self { source: source.into(), text, meshes, tool: None, camera: None })
    }
}

/// Whether a node is a link that has visuals and no collision shapes.
pub(crate) fn has_only_visuals(link: &Node<'_, '_>) -> bool {
    let has = |tag: &str| link.children().any(|child| child.has_tag_name(tag));
    link.has_tag_name("link") && has("visual") && !has("collision")
}

/// Corners of the convex hull of a mesh that a URDF file names.
fn hull_of(urdf: &Path, name: &str) -> std::result::Result<Vec<[f32; 3]>, String> {
    let file = find(urdf, name).ok_or_else(|| format!("mesh `{name}` is not there"))?;
    let points = read_mesh_points(&file).map_err(|error| error.to_string())?;
    let hull = ConvexPart::hull(&points).ok_or_else(|| format!("mesh `{name}` has no volume"))?;
    Ok(hull.vertices.iter().map(|p| p.coords.into()).collect())
}

/// What to say of a URDF file in the making.
const XACRO: &str = "is a xacro file: turn it into URDF first, for example with `xacro arm.urdf.xacro > arm.urdf`";

/// A URDF file's text as a tree.
pub(crate) fn xml<'t>(text: &'t str, path: &Path) -> Result<Document<'t>> {
    let document = Document::parse(text).map_err(|error| {
        let place = format!("line {}", error.pos().row);
        if matches!(error, roxmltree::Error::UnknownNamespace(..)) && text.contains("<xacro:") {
            return Error::input(path, place, XACRO);
        }
        let words = error.to_string();
        // The place is named apart from the words.
        let words = words.rsplit_once(" at ").map_or(words.as_str(), |(words, _)| words);
        Error::input(path, place, format!("not a URDF file that can be read: {words}"))
    })?;
    // What is left of it in a finished file is at most the name of its namespace.
    let of_xacro = |node: &Node<'_, '_>| node.tag_name().namespace().is_some_and(|name| name.contains("xacro"));
    if let Some(node) = document.descendants().find(of_xacro) {
        let place = format!("line {}", document.text_pos_at(node.range().start).row);
        return Err(Error::input(path, place, XACRO));
    }
    Ok(document)
}

fn mesh_place(document: &Document<'_>, node: &Node<'_, '_>) -> String {
    let line = document.text_pos_at(node.range().start).row;
    let link = node.ancestors().find(|above| above.has_tag_name("link")).and_then(|link| link.attribute("name"));
    format!("line {line}, link {}", link.unwrap_or("without a name"))
}

/// The file of a mesh: `package://name/rest` is looked for as `name/rest` and as `rest` in the folders above the URDF
/// file.
fn find(urdf: &Path, name: &str) -> Option<PathBuf> {
    let folder = urdf.parent().unwrap_or(Path::new(""));
    let Some(inside) = name.strip_prefix("package://") else {
        return Some(folder.join(name.strip_prefix("file://").unwrap_or(name))).filter(|file| file.is_file());
    };
    let rest = inside.split_once('/').map_or(inside, |(_, rest)| rest);
    let folder = if folder == Path::new("") { Path::new(".") } else { folder };
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder.ancestors().flat_map(|above| [above.join(inside), above.join(rest)]).find(|file| file.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_in_the_shelf_is_a_fault() {
        let shelf = Shelf::new([0.80, 0.40, 0.40]);
        let fault = |base: [f32; 3]| RobotPlacement { base, ..RobotPlacement::default() }.fault(&shelf);
        assert_eq!(fault([0.0, -0.70, -0.015]), None);
        assert!(fault([0.0, 0.2, 0.0]).expect("inside").contains("stands in or under the shelf"));
        assert!(fault([f32::NAN, 0.0, 0.0]).expect("no number").contains("must be finite"));
        assert!(fault([0.0, -70.0, 0.0]).expect("far").contains("within 10 m"));
    }

    #[test]
    fn meshes_are_taken_along_as_hulls() {
        let folder = tempfile::tempdir().expect("tempdir");
        let corner = |i: usize| [0, 1, 2].map(|a| if i >> a & 1 == 1 { 0.1_f32 } else { 0.0 });
        let mut obj: String =
            (0..8).map(|i| corner(i).map(|v| v.to_string()).join(" ")).map(|v| format!("v {v}\n")).collect();
        obj += "v 0.05 0.05 0.05\nf 1 2 3\nf 4 5 6\nf 7 8 9\n";
        std::fs::create_dir(folder.path().join("meshes")).expect("folder");
        std::fs::write(folder.path().join("meshes/box.obj"), obj).expect("mesh");
        let urdf = folder.path().join("arm.urdf");
        let text = |name: &str| {
            format!(
                "<robot>\n<link name=\"a\">\n<collision><geometry><mesh filename=\"{name}\"/></geometry></collision></link></robot>"
            )
        };
        std::fs::write(&urdf, text("package://some_arm/meshes/box.obj")).expect("urdf");
        let file = RobotFile::read(&urdf, "arm.urdf").expect("readable");
        assert_eq!(file.meshes["package://some_arm/meshes/box.obj"].len(), 8, "the hull leaves out what is inside");
        std::fs::write(&urdf, text("no/such.stl")).expect("urdf");
        let message = RobotFile::read(&urdf, "arm.urdf").expect_err("no mesh").to_string();
        assert!(message.ends_with("arm.urdf: line 3, link a: mesh `no/such.stl` is not there"), "{message}");
        let text = |name: &str| text(name).replace("collision", "visual");
        std::fs::write(&urdf, text("package://some_arm/meshes/box.obj")).expect("urdf");
        assert_eq!(RobotFile::read(&urdf, "arm.urdf").expect("readable").meshes.len(), 1, "what is drawn stands in");
        std::fs::write(&urdf, text("no/such.dae")).expect("urdf");
        assert_eq!(RobotFile::read(&urdf, "arm.urdf").expect("only a picture").meshes.len(), 0);
        std::fs::write(&urdf, "<robot>\n<link").expect("urdf");
        let message = RobotFile::read(&urdf, "arm.urdf").expect_err("no XML").to_string();
        assert!(message.contains("arm.urdf: line 1: not a URDF file"), "{message}");
    }

    #[test]
    fn a_xacro_file_is_called_one_and_not_an_arm_without_links() {
        let told = |text: &str| xml(text, Path::new("arm.urdf.xacro")).map(|_| ()).map_err(|error| error.to_string());
        let named = "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name=\"a\">\n<xacro:arm/>\n</robot>";
        assert!(told(named).is_err_and(|m| m.starts_with("arm.urdf.xacro: line 2: is a xacro file")));
        assert!(told("<robot>\n<xacro:arm/>\n</robot>").is_err_and(|m| m.contains("line 2: is a xacro file")));
        assert_eq!(told(&named.replace("<xacro:arm/>", "<!-- <xacro:arm/> -->")), Ok(()), "a finished file");
    }
}
