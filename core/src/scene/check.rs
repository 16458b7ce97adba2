//! What makes a scene sound: known classes, finite numbers, everything inside the shelf, nothing overlapping.

use super::lines::Places;
use super::overlap::PlacedBody;
use super::{Body, Catalog, Object, Scene, Shelf, Warning};
use crate::Result;
use std::path::Path;

/// Most voxels a scene's grid may have.
pub const MAX_VOXELS: usize = 10_000_000;
/// Most objects a scene may have.
pub const MAX_OBJECTS: usize = 500;
/// Smallest and largest edge of a shelf, metres.
const SHELF_EDGE_M: [f32; 2] = [0.05, 5.0];
/// Smallest and largest edge of a voxel, metres.
const VOXEL_EDGE_M: [f32; 2] = [0.001, 0.05];
/// Smallest and largest stretch factor of an object.
const SCALE: [f32; 2] = [0.05, 20.0];
/// Larger numbers are refused as positions, metres.
const FAR_M: f32 = 100.0;
/// Standing outside by this much, metres, is rounding.
const ROUNDING_M: f32 = 0.000_5;

/// What is wrong with where an object stands, by position in the scene's list.
#[derive(Clone, Debug, PartialEq)]
pub enum Problem {
    /// An object sticks out of the shelf.
    Outside {
        /// The object.
        object: u16,
        /// On which side, and by how much.
        message: String,
    },
    /// Two objects take the same space.
    Overlap {
        /// The later one in the list.
        object: u16,
        /// The earlier one.
        other: u16,
        /// How deep, metres.
        depth_m: f32,
    },
}

/// Everything that is wrong with where bodies stand: first what stands outside, then what overlaps.
pub(super) fn problems(shelf: &Shelf, bodies: &[Body]) -> impl Iterator<Item = Problem> {
    let outside = bodies
        .iter()
        .enumerate()
        .filter_map(|(at, body)| outside(shelf, body).map(|message| Problem::Outside { object: at as u16, message }));
    let overlaps = std::iter::once_with(|| bodies.iter().map(PlacedBody::new).collect::<Vec<_>>()).flat_map(|placed| {
        let mut found = Vec::new();
        for (at, body) in placed.iter().enumerate() {
            found.extend(placed[..at].iter().enumerate().filter_map(|(before, other)| {
                let depth_m = body.overlap(other)?;
                Some(Problem::Overlap { object: at as u16, other: before as u16, depth_m })
            }));
        }
        found
    });
    outside.chain(overlaps)
}

pub(super) fn check(scene: &Scene, catalog: &Catalog, places: &Places) -> Result<Vec<Warning>> {
    check_name(scene, places)?;
    check_shelf(&scene.shelf, places)?;
    if let Some(fault) = scene.robot.fault(&scene.shelf) {
        return Err(places.key("robot.base", fault));
    }
    for key in scene.meshes.keys() {
        check_mesh_key(scene, catalog, key, places)?;
    }
    if scene.objects.len() > MAX_OBJECTS {
        let message = format!("{} objects; the limit is {MAX_OBJECTS}", scene.objects.len());
        return Err(places.file(message));
    }
    for (at, object) in scene.objects.iter().enumerate() {
        check_object(scene, catalog, at, object, places)?;
    }
    let bodies = scene.bodies_at(catalog, places)?;
    if let Some(problem) = problems(&scene.shelf, &bodies).next() {
        let (at, message) = match problem {
            Problem::Outside { object, message } => (object, message),
            Problem::Overlap { object, other, depth_m } => {
                let other = places.name_object(scene, other.into());
                (object, format!("overlaps {other} by {}", millimetres(depth_m)))
            }
        };
        return Err(places.object(scene, at.into(), "position", message));
    }
    let mut warnings = Vec::new();
    if scene.objects.is_empty() {
        warnings.push("the scene has no objects".to_owned());
    }
    let voxel_m = scene.shelf.voxel_m;
    for (at, body) in bodies.iter().enumerate() {
        let thickness = body.thickness_m();
        if thickness < voxel_m {
            warnings.push(format!(
                "{} is {} thick, less than a voxel ({}): the map shows it one voxel thick",
                places.name_object(scene, at),
                millimetres(thickness),
                millimetres(voxel_m)
            ));
        }
    }
    Ok(warnings)
}

impl Scene {
    /// Checks the numbers of a scene that lies within another file (an episode, a bench): the size of the shelf and its grid,
    /// the count of objects, and where everything is. `path` is the file that errors name. Whether objects overlap is not
    /// asked again.
    ///
    /// # Errors
    /// For numbers that no scene file may have.
    pub fn check_numbers(&self, path: &Path) -> Result<()> {
        check_numbers(self, &Places::without_file(path))
    }
}

fn check_numbers(scene: &Scene, places: &Places) -> Result<()> {
    check_shelf(&scene.shelf, places)?;
    if let Some(fault) = scene.robot.fault(&scene.shelf) {
        return Err(places.key("robot.base", fault));
    }
    if scene.objects.len() > MAX_OBJECTS {
        let message = format!("{} objects; the limit is {MAX_OBJECTS}", scene.objects.len());
        return Err(places.file(message));
    }
    if let Some(key) = scene.meshes.keys().find(|key| !is_finite(scene, key)) {
        return Err(places.mesh(key, "its convex parts have corners that are nowhere"));
    }
    scene.objects.iter().enumerate().try_for_each(|(at, object)| check_placement(scene, at, object, places))
}

fn check_name(scene: &Scene, places: &Places) -> Result<()> {
    let wrong = |c: char| c.is_control() || matches!(c, '/' | '\\' | ':' | '"');
    if scene.name.is_empty() || scene.name.len() > 100 || scene.name.contains(wrong) || scene.name.starts_with('.') {
        let message = "name must be 1 to 100 characters that a file name can have (no / \\ : \", no leading dot)";
        return Err(places.key("name", message));
    }
    if scene.description.chars().any(char::is_control) {
        return Err(places.key("description", "description must be one line"));
    }
    Ok(())
}

/// Checks the interior and its grid; also used by the generator, whose shelf comes from the command line.
pub(super) fn check_shelf(shelf: &Shelf, places: &Places) -> Result<()> {
    let [low, high] = SHELF_EDGE_M;
    if let Some(size) = shelf.size.iter().find(|size| !(low..=high).contains(*size)) {
        let message = format!("shelf size {size} m: each of width, depth and height must be {low} to {high} m");
        return Err(places.key("shelf.size", message));
    }
    let [low, high] = VOXEL_EDGE_M;
    if !(low..=high).contains(&shelf.voxel_m) {
        let message = format!("voxel_m = {}: a voxel's edge must be {low} to {high} m", shelf.voxel_m);
        return Err(places.key("shelf.voxel_m", message));
    }
    let grid = shelf.grid();
    if grid.voxel_count() > MAX_VOXELS {
        let [w, d, h] = grid.dims;
        let message = format!(
            "the grid would have {w} x {d} x {h} = {} voxels; the limit is {MAX_VOXELS} (make the shelf smaller or \
             voxel_m larger)",
            grid.voxel_count()
        );
        return Err(places.key("shelf.size", message));
    }
    Ok(())
}

fn check_mesh_key(scene: &Scene, catalog: &Catalog, key: &str, places: &Places) -> Result<()> {
    let is_class = catalog.by_name(key).is_some();
    let is_file = scene.objects.iter().any(|object| object.mesh.as_deref() == Some(key));
    if !is_class && !is_file {
        return Err(places.mesh(key, unknown_class(catalog, key)));
    }
    if !is_finite(scene, key) || scene.meshes[key].solid().parts.is_empty() {
        return Err(places.mesh(key, "its convex parts have no volume"));
    }
    Ok(())
}

/// Whether all corners of a mesh are near enough to be numbers.
fn is_finite(scene: &Scene, key: &str) -> bool {
    scene.meshes[key].parts.iter().flatten().flatten().all(|v| v.abs() < FAR_M)
}

fn check_object(scene: &Scene, catalog: &Catalog, at: usize, object: &Object, places: &Places) -> Result<()> {
    let wrong = |key: &str, message: String| Err(places.object(scene, at, key, message));
    if catalog.by_name(&object.class).is_none() {
        return wrong("class", unknown_class(catalog, &object.class));
    }
    check_placement(scene, at, object, places)?;
    match &object.mesh {
        Some(key) if !scene.meshes.contains_key(key) => wrong("mesh", format!("mesh `{key}` is not in the scene")),
        _ => Ok(()),
    }
}

fn check_placement(scene: &Scene, at: usize, object: &Object, places: &Places) -> Result<()> {
    let wrong = |key: &str, message: String| Err(places.object(scene, at, key, message));
    if !object.position.iter().all(|v| v.abs() < FAR_M) {
        let [x, y] = object.position;
        return wrong("position", format!("position [{x}, {y}]: must be two finite numbers of metres in the shelf"));
    }
    if !object.yaw_deg.is_finite() || object.yaw_deg.abs() > 3600.0 {
        return wrong("yaw_deg", format!("yaw_deg = {}: must be a finite number of degrees", object.yaw_deg));
    }
    let [low, high] = SCALE;
    if !object.scale.iter().all(|v| (low..=high).contains(v)) {
        let [x, y, z] = object.scale;
        return wrong("scale", format!("scale [{x}, {y}, {z}]: each factor must be {low} to {high}"));
    }
    Ok(())
}

pub(super) fn unknown_class(catalog: &Catalog, name: &str) -> String {
    if name == catalog.background.name {
        return format!("`{name}` is the class of what is no object; nothing can be placed as it");
    }
    let hint = match catalog.nearest_name(name) {
        Some(near) => format!("did you mean `{near}`?"),
        None => {
            let names: Vec<&str> = catalog.classes.iter().map(|class| class.name.as_str()).collect();
            format!("known are {}", names.join(", "))
        }
    };
    format!("unknown class `{name}`; {hint}")
}

/// Which side of the shelf a body sticks out of, and by how much.
fn outside(shelf: &Shelf, body: &Body) -> Option<String> {
    let bounds = body.solid.bounds_at(&body.world_from_body);
    let (low, high) = (shelf.min() - bounds.min, bounds.max - shelf.max());
    if high.z > ROUNDING_M {
        let (tall, room) = (bounds.size().z, shelf.size[2]);
        return Some(format!("too tall by {}: {tall:.3} m in a shelf {room:.3} m high", millimetres(high.z)));
    }
    let sides = [(low.x, "on the left"), (high.x, "on the right"), (low.y, "at the front"), (high.y, "at the back")];
    let worst = sides.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    (worst.0 > ROUNDING_M).then(|| format!("stands outside the shelf {} by {}", worst.1, millimetres(worst.0)))
}

fn millimetres(length_m: f32) -> String {
    format!("{:.1} mm", length_m * 1000.0)
}
