//! What is really in the shelf: the catalogue of classes, checked scenes, meshes, and the random generator.
//!
//! A scene file is read as it was typed and becomes a [`Scene`] (what it means, checked). A [`Scene`] gives the
//! [`Body`]s that the world simulates, the camera sees and the truth map voxelises.

mod body;
mod catalog;
mod check;
mod file;
mod generate;
mod lines;
mod mesh;
pub mod outline;
mod overlap;
mod rescale;
pub(crate) mod robot;
mod shape;

#[cfg(test)]
mod file_tests;

pub use body::{Body, ObjectId, Shelf};
pub use catalog::{BACKGROUND, Background, CLASS_COUNT, Catalog, Class, ClassId, OBJECT_CLASS_COUNT};
pub use check::{MAX_OBJECTS, MAX_VOXELS, Problem};
pub use file::FORMAT;
pub use generate::{Family, GenerateConfig, generate};
pub(crate) use mesh::read_mesh_points;
pub use mesh::{MAX_PART_VERTICES, MAX_TRIANGLES, MeshReport, PartsFrom, Unit, load_mesh};
pub use overlap::CONTACT_DEPTH_M;
pub(crate) use overlap::PlacedBody;
pub use rescale::{rescale, rescale_if_room};
pub use robot::{RobotFile, RobotPlacement};
pub use shape::Shape;

use crate::grid::Grid;
use crate::solid::{ConvexPart, Solid};
use crate::{Point, Pose, Result, Vector};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Something that a person should know about a scene or mesh that can be used all the same.
pub type Warning = String;

/// A scene whose content has been checked: known classes, finite numbers, nothing overlaps or stands outside.
///
/// Serialises as the JSON that episodes embed; meshes are embedded as convex parts, so that an episode needs no other
/// file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Short name, also of thumbnails and episodes.
    pub name: String,
    /// One line on what makes the scene what it is; may be empty.
    #[serde(default)]
    pub description: String,
    /// The shelf and its grid.
    pub shelf: Shelf,
    /// What stands on the board, in file order; the position here is the object's [`ObjectId`].
    pub objects: Vec<Object>,
    /// Shapes that replace a class's catalogue shape.
    #[serde(default)]
    pub meshes: BTreeMap<String, MeshShape>,
    /// The arm before the shelf.
    #[serde(default)]
    pub robot: RobotPlacement,
}

/// One placed object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Class name of the catalogue.
    pub class: String,
    /// Centre of the footprint on the board, metres (x, y).
    pub position: [f32; 2],
    /// Counter-clockwise about z, degrees.
    #[serde(default)]
    pub yaw_deg: f32,
    /// Stretch along the object's own x, y, z.
    #[serde(default = "unit_scale")]
    pub scale: [f32; 3],
    /// A shape of this object's own: a key of [`Scene::meshes`] that is not a class name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
}

fn unit_scale() -> [f32; 3] {
    [1.0; 3]
}

impl Object {
    /// An object of a class as the catalogue has it.
    pub fn new(class: impl Into<String>, position: [f32; 2], yaw_deg: f32) -> Self {
        Self { class: class.into(), position, yaw_deg, scale: unit_scale(), mesh: None }
    }

    /// Where its body stands: on the board, turned by its yaw.
    pub fn world_from_body(&self) -> Pose {
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector::z_axis(), self.yaw_deg.to_radians());
        Pose::from_parts(Vector::new(self.position[0], self.position[1], 0.0).into(), turn)
    }
}

/// Convex parts of a mesh, in metres, z up, origin at the centre of the footprint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshShape {
    /// The file that it was read from, relative to the scene.
    pub source: String,
    /// The file's unit, where the scene names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// Corners of each convex part.
    pub parts: Vec<Vec<[f32; 3]>>,
}

impl MeshShape {
    /// The parts as a solid; parts without volume are left out.
    pub fn solid(&self) -> Solid {
        let hull = |corners: &Vec<[f32; 3]>| {
            ConvexPart::hull(&corners.iter().map(|corner| Point::from(*corner)).collect::<Vec<_>>())
        };
        Solid { parts: self.parts.iter().filter_map(hull).collect() }
    }
}

impl Scene {
    /// The same with the hand that is needed, where the scene names no arm of its own: of the arms that come with the program
    /// the one that takes objects by suction, or the one with the gripper.
    #[must_use]
    pub fn with_hand_for(mut self, picks: bool) -> Self {
        if picks && self.robot.urdf.is_none() {
            self.robot.urdf = Some(RobotFile::suction());
        }
        self
    }

    /// The scene's voxel grid.
    pub fn grid(&self) -> Grid {
        self.shelf.grid()
    }

    /// The objects as bodies, by [`ObjectId`], each standing on the board where the scene puts it. The mass of a
    /// stretched object grows with its volume.
    pub fn bodies(&self, catalog: &Catalog) -> Result<Vec<Body>> {
        self.bodies_at(catalog, &lines::Places::without_file(format!("scene {}", self.name)))
    }

    fn bodies_at(&self, catalog: &Catalog, places: &lines::Places) -> Result<Vec<Body>> {
        let mut solids: BTreeMap<(&str, [u32; 3]), Arc<Solid>> = BTreeMap::new();
        let mut bodies = Vec::with_capacity(self.objects.len());
        for (at, object) in self.objects.iter().enumerate() {
            let class = catalog
                .by_name(&object.class)
                .ok_or_else(|| places.object(self, at, "class", check::unknown_class(catalog, &object.class)))?;
            let key = object.mesh.as_deref().unwrap_or(&object.class);
            let mesh = self.meshes.get(key);
            if object.mesh.is_some() && mesh.is_none() {
                return Err(places.object(self, at, "mesh", format!("mesh `{key}` is not in the scene")));
            }
            let solid = solids.entry((key, object.scale.map(f32::to_bits))).or_insert_with(|| {
                let solid = mesh.map_or_else(|| class.solid.clone(), |mesh| Arc::new(mesh.solid()));
                if object.scale == unit_scale() { solid } else { Arc::new(solid.scaled(object.scale)) }
            });
            if solid.parts.is_empty() {
                return Err(places.object(self, at, "mesh", "its shape has no volume"));
            }
            bodies.push(Body {
                id: ObjectId(at as u16),
                class: class.id,
                solid: solid.clone(),
                world_from_body: object.world_from_body(),
                mass_kg: class.mass_kg * object.scale.iter().product::<f32>(),
                friction: class.friction,
            });
        }
        Ok(bodies)
    }

    /// Everything that is wrong with where the objects stand, for a scene that is being made. A checked scene has none.
    ///
    /// # Errors
    /// For objects that have no body: of an unknown class, of a mesh that is not there.
    pub fn problems(&self, catalog: &Catalog) -> Result<Vec<Problem>> {
        Ok(check::problems(&self.shelf, &self.bodies(catalog)?).collect())
    }

    /// Share of the floor that the objects' footprints cover.
    pub fn fill(&self, catalog: &Catalog) -> Result<f32> {
        let covered: f64 =
            self.bodies(catalog)?.iter().map(|body| f64::from(outline::area(&body.solid.footprint()))).sum();
        Ok((covered / f64::from(self.shelf.size[0] * self.shelf.size[1])) as f32)
    }
}
