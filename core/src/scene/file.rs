//! Scene files: TOML as it was typed ([`RawScene`]) becomes a checked [`Scene`], and back.
//!
//! ```toml
//! format = 1
//! name = "two-cans"
//! description = "one line"          # optional
//!
//! [shelf]
//! size = [0.80, 0.40, 0.40]         # metres; optional: voxel_m = 0.005, column_closure = true
//!
//! [meshes]                          # optional: class = mesh file, relative to this file
//! chips_can = "chips_can.obj"
//! gum_tin = { file = "tin.stl", unit = "in" }   # m, dm, cm, mm, in or km; guessed from the size where it is left out
//!
//! [robot]                           # optional: the arm before the shelf
//! base = [0.0, -0.70, -0.015]       # metres: origin of its base, as high as the table
//! yaw_deg = 0.0                     # turn of the base about z
//! urdf = "my_arm.urdf"              # an arm of one's own, relative to this file; else the UR5 that Nudge has
//! tool = "my_tip_link"              # optional: its link at the finger tip, where that has no usual name
//! camera = "my_lens_link"           # optional: its link of the camera in hand
//!
//! [[object]]
//! class = "chips_can"
//! position = [0.1, 0.2]             # metres: centre of the footprint on the board
//! yaw_deg = 30.0                    # optional
//! scale = [1.0, 1.0, 1.2]           # optional
//! mesh = "other_can.stl"            # optional: a shape of this object's own
//! ```

mod raw_mesh;

use super::lines::{Places, name_object};
use super::mesh::{Unit, load_mesh};
use super::{Catalog, MeshShape, Object, RobotFile, RobotPlacement, Scene, Shelf, Warning, check};
use crate::files::write_atomically;
use crate::fixed::Fixed;
use crate::{Error, Result};
use raw_mesh::RawMesh;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use toml::Spanned;

/// The scene format that this version reads and writes.
pub const FORMAT: i64 = 1;
/// Scene files larger than this, bytes, are something else.
const MAX_BYTES: u64 = 4 << 20;

/// A scene file as it was typed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScene {
    #[serde(rename = "format")]
    _format: toml::Value,
    name: Spanned<String>,
    description: Option<Spanned<String>>,
    shelf: RawShelf,
    #[serde(default)]
    meshes: BTreeMap<String, Spanned<RawMesh>>,
    robot: Option<Spanned<RawRobot>>,
    #[serde(default)]
    object: Vec<Spanned<RawObject>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawShelf {
    size: Spanned<Fixed<f64, 3>>,
    voxel_m: Option<Spanned<f64>>,
    column_closure: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRobot {
    urdf: Option<Spanned<String>>,
    tool: Option<Spanned<String>>,
    camera: Option<Spanned<String>>,
    base: Option<Spanned<Fixed<f64, 3>>>,
    yaw_deg: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawObject {
    class: Spanned<String>,
    position: Spanned<Fixed<f64, 2>>,
    yaw_deg: Option<Spanned<f64>>,
    scale: Option<Spanned<Fixed<f64, 3>>>,
    mesh: Option<Spanned<RawMesh>>,
}

/// Only the format number, so that the error for a file of another format names the format and not unknown keys.
#[derive(Deserialize)]
struct RawHead {
    format: Option<Spanned<toml::Value>>,
}

impl Scene {
    /// Reads and checks a scene file with the meshes that it names.
    ///
    /// # Errors
    /// One line that names file, line, object number (from one) and class.
    pub fn load(path: &Path, catalog: &Catalog) -> Result<(Self, Vec<Warning>)> {
        let length = std::fs::metadata(path).map_err(|error| Error::io(path, error))?.len();
        if length > MAX_BYTES {
            return Err(Error::input(path, "", format!("{length} bytes; a scene file has at most {MAX_BYTES}")));
        }
        let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
        let text = String::from_utf8(bytes).map_err(|_| Error::input(path, "", "not a scene file (not UTF-8 text)"))?;
        Self::parse(&text, path, catalog)
    }

    /// Reads and checks the text of a scene file; `path` is what errors name and what mesh files are relative to.
    pub fn parse(text: &str, path: &Path, catalog: &Catalog) -> Result<(Self, Vec<Warning>)> {
        let head: RawHead = toml::from_str(text).map_err(|error| syntax_error(text, path, &error))?;
        check_format(head.format.as_ref(), text, path)?;
        let raw: RawScene = toml::from_str(text).map_err(|error| syntax_error(text, path, &error))?;
        let places = Places { path: path.to_owned(), lines: lines(&raw, text) };

        let mut shelf = Shelf::new(raw.shelf.size.get_ref().map(|v| v as f32));
        shelf.voxel_m = raw.shelf.voxel_m.map_or(shelf.voxel_m, |voxel| voxel.into_inner() as f32);
        shelf.column_closure = raw.shelf.column_closure.unwrap_or(shelf.column_closure);
        // The unit of an object's own mesh, where it is named.
        let mut units: Vec<Option<Unit>> = Vec::with_capacity(raw.object.len());
        let object = |raw: Spanned<RawObject>| {
            let raw = raw.into_inner();
            let mesh = raw.mesh.map(Spanned::into_inner);
            units.push(mesh.as_ref().and_then(|mesh| mesh.unit));
            Object {
                class: raw.class.into_inner(),
                position: raw.position.get_ref().map(|v| v as f32),
                yaw_deg: raw.yaw_deg.map_or(0.0, |yaw| yaw.into_inner() as f32),
                scale: raw.scale.map_or([1.0; 3], |scale| scale.get_ref().map(|v| v as f32)),
                mesh: mesh.map(|mesh| mesh.file),
            }
        };
        let mut scene = Self {
            name: raw.name.into_inner(),
            description: raw.description.map(Spanned::into_inner).unwrap_or_default(),
            shelf,
            objects: raw.object.into_iter().map(object).collect(),
            meshes: BTreeMap::new(),
            robot: RobotPlacement::default(),
        };
        let mut warnings = Vec::new();
        let folder = path.parent().unwrap_or(Path::new(""));
        for (class, file) in &raw.meshes {
            let Some(known) = catalog.by_name(class) else {
                return Err(places.mesh(class, check::unknown_class(catalog, class)));
            };
            let RawMesh { file, unit } = file.get_ref();
            let mesh = load_mesh(&folder.join(file), file, Some(known), *unit);
            let (mesh, report) = mesh.map_err(|error| places.mesh(class, error.to_string()))?;
            warnings.extend(report.warnings.iter().map(|warning| format!("mesh of {class}: {warning}")));
            scene.meshes.insert(class.clone(), mesh);
        }
        for (at, object) in scene.objects.iter().enumerate() {
            let Some(file) = &object.mesh else { continue };
            if catalog.by_name(file).is_some() {
                return Err(places.object(&scene, at, "mesh", format!("mesh `{file}` must be a file, not a class")));
            }
            if let Some(known) = scene.meshes.get(file) {
                if known.unit != units[at] {
                    let message = format!("mesh `{file}` is named with two units");
                    return Err(places.object(&scene, at, "mesh", message));
                }
                continue;
            }
            let (mesh, report) = load_mesh(&folder.join(file), file, catalog.by_name(&object.class), units[at])
                .map_err(|error| places.object(&scene, at, "mesh", error.to_string()))?;
            let name = name_object(at, &object.class);
            warnings.extend(report.warnings.iter().map(|warning| format!("mesh of {name}: {warning}")));
            scene.meshes.insert(file.clone(), mesh);
        }
        if let Some(robot) = raw.robot.map(Spanned::into_inner) {
            scene.robot = placement(robot, folder, &places)?;
        }
        warnings.extend(check::check(&scene, catalog, &places)?);
        Ok((scene, warnings))
    }

    /// Checks a scene that came from elsewhere than a file (an episode, the generator, a window).
    pub fn check(&self, catalog: &Catalog) -> Result<Vec<Warning>> {
        check::check(self, catalog, &Places::without_file(format!("scene {}", self.name)))
    }

    /// The scene as a file: keys in a fixed order, one block per object, defaults left out.
    pub fn to_toml(&self) -> String {
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let mut text = format!("format = {FORMAT}\nname = {}\n", quoted(&self.name));
        // Writing into a string cannot fail.
        if !self.description.is_empty() {
            let _ = writeln!(text, "description = {}", quoted(&self.description));
        }
        let standard = Shelf::new(self.shelf.size);
        let _ = writeln!(text, "\n[shelf]\nsize = {:?}", self.shelf.size);
        if self.shelf.voxel_m != standard.voxel_m {
            let _ = writeln!(text, "voxel_m = {:?}", self.shelf.voxel_m);
        }
        if self.shelf.column_closure != standard.column_closure {
            let _ = writeln!(text, "column_closure = {}", self.shelf.column_closure);
        }
        let own: Vec<&String> = self.objects.iter().filter_map(|object| object.mesh.as_ref()).collect();
        let of_classes: Vec<(&String, &MeshShape)> = self.meshes.iter().filter(|(key, _)| !own.contains(key)).collect();
        if !of_classes.is_empty() {
            text.push_str("\n[meshes]\n");
        }
        for (class, mesh) in of_classes {
            let _ = writeln!(text, "{class} = {}", raw_mesh::to_toml(&mesh.source, mesh.unit));
        }
        let (robot, standard) = (&self.robot, RobotPlacement::default());
        if *robot != standard {
            let _ = writeln!(text, "\n[robot]\nbase = {:?}", robot.base);
            if robot.yaw_deg != standard.yaw_deg {
                let _ = writeln!(text, "yaw_deg = {:?}", robot.yaw_deg);
            }
            if let Some(file) = &robot.urdf {
                let _ = writeln!(text, "urdf = {}", quoted(&file.source));
                for (key, link) in [("tool", &file.tool), ("camera", &file.camera)] {
                    if let Some(link) = link {
                        let _ = writeln!(text, "{key} = {}", quoted(link));
                    }
                }
            }
        }
        for object in &self.objects {
            let _ = write!(text, "\n[[object]]\nclass = {}\nposition = {:?}\n", quoted(&object.class), object.position);
            if object.yaw_deg != 0.0 {
                let _ = writeln!(text, "yaw_deg = {:?}", object.yaw_deg);
            }
            if object.scale != [1.0; 3] {
                let _ = writeln!(text, "scale = {:?}", object.scale);
            }
            if let Some(mesh) = &object.mesh {
                let unit = self.meshes.get(mesh).and_then(|shape| shape.unit);
                let _ = writeln!(text, "mesh = {}", raw_mesh::to_toml(mesh, unit));
            }
        }
        text
    }

    /// Writes the scene's file whole or not at all. Mesh files must lie where the scene names them, seen from `path`.
    pub fn save_toml(&self, path: &Path) -> Result<()> {
        let folder = folder_of(path);
        if let Some((key, mesh)) = self.meshes.iter().find(|(_, mesh)| !folder.join(&mesh.source).is_file()) {
            let message = format!("mesh of {key}: {} is not there; save beside the meshes", mesh.source);
            return Err(Error::input(path, "", message));
        }
        if let Some(file) = self.robot.urdf.as_ref().filter(|file| !folder.join(&file.source).is_file()) {
            let message = format!("robot: {} is not there; save beside the URDF file", file.source);
            return Err(Error::input(path, "", message));
        }
        write_atomically(path, self.to_toml().as_bytes())
    }
}

/// The arm of a scene's `[robot]`.
fn placement(robot: RawRobot, folder: &Path, places: &Places) -> Result<RobotPlacement> {
    let standard = RobotPlacement::default();
    let mut urdf = robot.urdf.map(|file| RobotFile::read(&folder.join(file.get_ref()), file.get_ref())).transpose()?;
    match &mut urdf {
        Some(file) => {
            file.tool = robot.tool.map(Spanned::into_inner);
            file.camera = robot.camera.map(Spanned::into_inner);
        }
        None => {
            if let Some((key, _)) = [("tool", &robot.tool), ("camera", &robot.camera)].iter().find(|(_, l)| l.is_some())
            {
                let message = format!("{key} names a link of an arm of one's own, and no urdf is named");
                return Err(places.key(&format!("robot.{key}"), message));
            }
        }
    }
    Ok(RobotPlacement {
        base: robot.base.map_or(standard.base, |base| base.get_ref().map(|v| v as f32)),
        yaw_deg: robot.yaw_deg.map_or(standard.yaw_deg, |yaw| yaw.into_inner() as f32),
        urdf,
    })
}

/// The folder that a file lies in.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."))
}

fn check_format(format: Option<&Spanned<toml::Value>>, text: &str, path: &Path) -> Result<()> {
    match format {
        None => Err(Error::input(path, "line 1", format!("`format = {FORMAT}` is missing"))),
        Some(format) if format.get_ref().as_integer() == Some(FORMAT) => Ok(()),
        Some(format) => {
            let place = format!("line {}", line_at(text, format.span().start));
            let message = format!("format {} is not known; this version reads format {FORMAT}", format.get_ref());
            Err(Error::input(path, place, message))
        }
    }
}

fn line_at(text: &str, offset: usize) -> usize {
    text.as_bytes()[..offset.min(text.len())].iter().filter(|byte| **byte == b'\n').count() + 1
}

fn lines(raw: &RawScene, text: &str) -> BTreeMap<String, usize> {
    let mut lines = BTreeMap::new();
    let mut note = |key: String, offset: usize| lines.insert(key, line_at(text, offset));
    note("name".into(), raw.name.span().start);
    if let Some(description) = &raw.description {
        note("description".into(), description.span().start);
    }
    note("shelf".into(), raw.shelf.size.span().start);
    note("shelf.size".into(), raw.shelf.size.span().start);
    if let Some(voxel) = &raw.shelf.voxel_m {
        note("shelf.voxel_m".into(), voxel.span().start);
    }
    for (class, file) in &raw.meshes {
        note(format!("meshes.{class}"), file.span().start);
    }
    if let Some(robot) = &raw.robot {
        note("robot".into(), robot.span().start);
        let robot = robot.get_ref();
        let spans = [
            ("base", robot.base.as_ref().map(Spanned::span)),
            ("yaw_deg", robot.yaw_deg.as_ref().map(Spanned::span)),
            ("urdf", robot.urdf.as_ref().map(Spanned::span)),
            ("tool", robot.tool.as_ref().map(Spanned::span)),
            ("camera", robot.camera.as_ref().map(Spanned::span)),
        ];
        for (key, span) in spans {
            if let Some(span) = span {
                note(format!("robot.{key}"), span.start);
            }
        }
    }
    for (at, object) in raw.object.iter().enumerate() {
        note(format!("object.{at}"), object.span().start);
        let object = object.get_ref();
        note(format!("object.{at}.class"), object.class.span().start);
        note(format!("object.{at}.position"), object.position.span().start);
        let spans = [
            ("yaw_deg", object.yaw_deg.as_ref().map(Spanned::span)),
            ("scale", object.scale.as_ref().map(Spanned::span)),
            ("mesh", object.mesh.as_ref().map(Spanned::span)),
        ];
        for (key, span) in spans {
            if let Some(span) = span {
                note(format!("object.{at}.{key}"), span.start);
            }
        }
    }
    lines
}

/// What the TOML reader says, with line and, inside an object's block, the object.
fn syntax_error(text: &str, path: &Path, error: &toml::de::Error) -> Error {
    let message = error.message().lines().collect::<Vec<_>>().join(", ");
    let Some(span) = error.span() else { return Error::input(path, "", message) };
    let line = line_at(text, span.start);
    let mut place = format!("line {line}");
    if let Some(object) = object_of_line(text, line) {
        place = format!("{place}, {object}");
    }
    Error::input(path, place, message)
}

/// The object whose block holds a line, when the file may not even parse.
fn object_of_line(text: &str, line: usize) -> Option<String> {
    let all: Vec<&str> = text.lines().map(str::trim).collect();
    let header = |text: &str| text.starts_with('[') && !text.contains('=');
    let is_object = |text: &str| text.replace(' ', "").starts_with("[[object]]");
    let start = all.iter().take(line).rposition(|text| header(text)).filter(|at| is_object(all[*at]))?;
    let number = all[..start].iter().filter(|text| is_object(text)).count();
    let block = all[start + 1..].iter().take_while(|text| !header(text));
    let class = block.filter_map(|text| text.strip_prefix("class")?.trim_start().strip_prefix('=')).next();
    Some(match class.and_then(|class| class.split(['"', '\'']).nth(1)) {
        Some(class) => name_object(number, class),
        None => format!("object {}", number + 1),
    })
}
