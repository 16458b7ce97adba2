//! Meshes of real objects become shapes: convex parts, metres, z up, centred on their footprint.
//!
//! Connected components that are convex are taken as given convex parts; others are decomposed by V-HACD (Mamou and
//! Ghorbel 2009). A mesh keeps its own direction about z; [`MeshReport::footprint`] tells by how much it is turned.

mod glb;
mod group;
mod obj;
mod parts;
mod read;
mod stl;
mod text;
mod topology;
mod unit;

use super::outline::{self, Rectangle};
use super::{Class, MeshShape, Warning};
use crate::solid::{Bounds, ConvexPart, Solid};
use crate::wall::guarded;
use crate::{Error, Point, Result};
use group::Corner;
use serde::Serialize;
use std::path::Path;
use topology::{Component, Fault};

pub use group::MAX_TRIANGLES;
pub use parts::MAX_PART_VERTICES;
pub use unit::Unit;

/// Density of a mesh whose class is not known: packed groceries, kg per cubic metre.
const ESTIMATED_DENSITY: f32 = 400.0;
/// How the convex parts of a mesh were obtained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PartsFrom {
    /// Every connected component is convex and was taken as it is.
    Given,
    /// By approximate convex decomposition.
    Decomposed,
    /// Some components were taken as they are, others decomposed.
    Both,
}

/// What a mesh file holds and what was made of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshReport {
    /// The file.
    pub file: String,
    /// The class that it stands for, when one was named.
    pub class: Option<String>,
    /// The file's unit: the one that was named, else metres unless the numbers cannot be that.
    pub unit: Unit,
    /// Metres per unit of the file.
    pub metres_per_unit: f32,
    /// Triangles in the file.
    pub triangles: usize,
    /// Corners after identical ones were joined.
    pub vertices: usize,
    /// Connected components.
    pub components: usize,
    /// Corners of each convex part.
    pub part_vertices: Vec<usize>,
    /// How the parts were obtained.
    pub parts_from: PartsFrom,
    /// Size along x, y, z, metres.
    pub size_m: [f32; 3],
    /// Smallest rectangle around the footprint, about the origin.
    pub footprint: Rectangle,
    /// Area of the footprint's convex outline, square metres.
    pub footprint_area_m2: f32,
    /// Volume inside the mesh, cubic metres.
    pub volume_m3: f32,
    /// Volume of the convex parts, cubic metres; where parts overlap it counts twice.
    pub parts_volume_m3: f32,
    /// The class's mass or the estimate, kg.
    pub mass_kg: f32,
    /// Whether the mass is an estimate (0.4 g per cubic centimetre).
    pub mass_is_estimate: bool,
    /// What a person should know.
    pub warnings: Vec<Warning>,
}

/// All corners of a mesh file (OBJ, STL, GLB) as they are in the file: for who only needs its hull.
pub(crate) fn read_mesh_points(path: &Path) -> Result<Vec<Point>> {
    Ok(read::read(path)?.into_iter().flat_map(|group| group.points).map(|point| point.cast()).collect())
}

/// Reads a mesh (OBJ, STL, GLB) and makes a shape of it, with a report of what was done.
///
/// `source` is what the shape notes as its file (relative to a scene); `class` gives the mass. Without a `unit` it is
/// guessed, and `class` helps.
///
/// # Errors
/// A file that cannot be read, is no mesh, is empty, open, larger than [`MAX_TRIANGLES`], flat, or has numbers that are
/// not finite.
pub fn load_mesh(
    path: &Path,
    source: &str,
    class: Option<&Class>,
    unit: Option<Unit>,
) -> Result<(MeshShape, MeshReport)> {
    let wrong = |message: String| Error::input(path, "", message);
    let groups = read::read(path)?;
    let triangles: usize = groups.iter().map(|group| group.triangles.len()).sum();
    let Some([low, high]) = group::bounds(&groups) else {
        return Err(wrong("the mesh is empty (no triangles)".into()));
    };
    let mut warnings = Vec::new();
    let edge = (high - low).max();
    let expected = class.map(|class| f64::from(class.solid.bounds().size().max()));
    let file_unit = unit.or_else(|| Unit::guess(edge, expected)).ok_or_else(|| {
        wrong(format!("the largest edge is {edge} in the file's units, which is no object in any of m, cm, mm, inches"))
    })?;
    if unit.is_none() && file_unit != Unit::Metre {
        warnings.push(format!(
            "not in metres: the largest edge of {} was read as {} ({:.3} m); --unit, or `unit` in a scene, says otherwise",
            (edge * 1e5).round() / 1e5,
            file_unit.name(),
            edge * file_unit.metres()
        ));
    }
    // About its own middle: far from its origin a mesh would lose all digits.
    let middle = nalgebra::center(&low, &high);
    let metres = |point: &Corner| Point::from(((point - middle) * file_unit.metres()).cast::<f32>());
    let surfaces: Vec<Component> = groups
        .into_iter()
        .map(|group| Component { points: group.points.iter().map(metres).collect(), triangles: group.triangles })
        .collect();

    let topology = topology::components(&surfaces).map_err(|fault| match fault {
        Fault::Open { edges, first } if ConvexPart::hull(&corners_of(&surfaces)).is_some() => {
            let first = middle + first.coords.cast::<f64>() / file_unit.metres();
            wrong(format!(
                "the mesh is open: {edges} edges have a triangle on one side only, the first at ({:.4}, {:.4}, {:.4}); \
                 close its holes",
                first.x, first.y, first.z
            ))
        }
        Fault::Open { .. } => wrong("the mesh is flat: all its corners lie in one plane".into()),
        Fault::Flat => wrong("the mesh is flat: every triangle has shrunk to a line".into()),
    })?;
    if topology.repeated > 0 {
        warnings.push(format!("{} triangles are there twice and count once", topology.repeated));
    }
    if topology.turned > 0 {
        warnings.push(format!("{} triangles were wound the wrong way and were turned", topology.turned));
    }
    if topology.cavities > 0 {
        warnings.push(format!("{} closed cavities inside were filled", topology.cavities));
    }
    let split = guarded(|| Ok(parts::convex_parts(&topology.components))).map_err(wrong)?;
    if split.parts.is_empty() {
        return Err(wrong("the mesh is flat: it encloses no volume".into()));
    }
    if split.simplified > 0 {
        warnings.push(format!("{} parts were simplified to at most {MAX_PART_VERTICES} corners", split.simplified));
    }

    let mut solid = Solid { parts: split.parts };
    let rectangle = outline::smallest_rectangle(&solid.footprint())
        .ok_or_else(|| wrong("the mesh is flat: its footprint has no area".into()))?;
    centre(&mut solid, rectangle.center);
    let size = solid.bounds().size();
    let volume_m3: f64 = topology.components.iter().map(topology::Component::volume).sum();
    let report = MeshReport {
        file: path.display().to_string(),
        class: class.map(|class| class.name.clone()),
        unit: file_unit,
        metres_per_unit: file_unit.metres() as f32,
        triangles,
        vertices: topology.components.iter().map(|component| component.points.len()).sum(),
        components: topology.components.len(),
        part_vertices: solid.parts.iter().map(|part| part.vertices.len()).collect(),
        parts_from: split.from,
        size_m: size.into(),
        footprint: Rectangle { center: [0.0; 2], ..rectangle },
        footprint_area_m2: outline::area(&solid.footprint()),
        volume_m3: volume_m3 as f32,
        parts_volume_m3: solid.volume(),
        mass_kg: class.map_or(volume_m3 as f32 * ESTIMATED_DENSITY, |class| class.mass_kg),
        mass_is_estimate: class.is_none(),
        warnings,
    };
    let corners = |part: &ConvexPart| part.vertices.iter().map(|p| [p.x, p.y, p.z]).collect();
    Ok((MeshShape { source: source.to_owned(), unit, parts: solid.parts.iter().map(corners).collect() }, report))
}

/// All corners of some surfaces.
fn corners_of(surfaces: &[Component]) -> Vec<Point> {
    surfaces.iter().flat_map(|surface| surface.points.iter().copied()).collect()
}

/// Moves a solid so that the centre of its footprint is the origin and it stands on the board.
fn centre(solid: &mut Solid, center: [f32; 2]) {
    let base = solid.bounds().min.z;
    let shift = crate::Vector::new(-center[0], -center[1], -base);
    for part in &mut solid.parts {
        for vertex in &mut part.vertices {
            *vertex += shift;
        }
        for plane in &mut part.planes {
            plane.offset += plane.normal.dot(&shift);
        }
    }
}

/// Bounding box of points, `None` without any.
fn bounds_of(points: impl IntoIterator<Item = Point>) -> Option<Bounds> {
    Bounds::around(points)
}

#[cfg(test)]
mod tests;
