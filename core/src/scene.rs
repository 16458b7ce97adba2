//! What is really in the shelf: the catalogue of classes, checked scenes, meshes, and the random generator.
//!
//! A scene file is read as [`RawScene`] (what was typed) and becomes a [`Scene`] (what it means, checked). A
//! [`Scene`] gives the [`Body`]s that the world simulates, the camera sees and the truth map voxelises.

mod body;
mod catalog;
// mod check; mod file; mod generate; mod mesh; mod shape; -- to come

pub use body::{Body, ObjectId, Shelf};
pub use catalog::{BACKGROUND, CLASS_COUNT, Catalog, Class, ClassId, OBJECT_CLASS_COUNT};

use crate::grid::Grid;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

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

/// Convex parts of a mesh, in metres, z up, origin at the centre of the footprint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshShape {
    /// The file that it was read from, relative to the scene.
    pub source: String,
    /// Corners of each convex part.
    pub parts: Vec<Vec<[f32; 3]>>,
}

impl Scene {
    /// The scene's voxel grid.
    pub fn grid(&self) -> Grid {
        self.shelf.grid()
    }
}
