//! The shelf and the rigid bodies in it.

use super::{ClassId, outline};
use crate::grid::Grid;
use crate::solid::Solid;
use crate::{Point, Pose};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// An object by its position in the scene's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ObjectId(pub u16);

/// The shelf's interior and how it is mapped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shelf {
    /// Interior width (x), depth (y) and height (z), metres.
    pub size: [f32; 3],
    /// Edge of a voxel, metres.
    #[serde(default = "default_voxel")]
    pub voxel_m: f32,
    /// Whether observations are closed along columns (above a free voxel all is free, below an occupied one all is
    /// occupied): true where objects stand on the board and do not overhang.
    #[serde(default = "default_closure")]
    pub column_closure: bool,
}

fn default_voxel() -> f32 {
    0.005
}

fn default_closure() -> bool {
    true
}

impl Shelf {
    /// A shelf of the given interior with 5 mm voxels and column closure.
    pub fn new(size: [f32; 3]) -> Self {
        Self { size, voxel_m: default_voxel(), column_closure: default_closure() }
    }

    /// The voxel grid of the interior.
    pub fn grid(&self) -> Grid {
        Grid::for_shelf(self.size, self.voxel_m)
    }

    /// The interior's corner with the smallest coordinates.
    pub fn min(&self) -> Point {
        Point::new(-0.5 * self.size[0], 0.0, 0.0)
    }

    /// The interior's corner with the largest coordinates.
    pub fn max(&self) -> Point {
        Point::new(0.5 * self.size[0], self.size[1], self.size[2])
    }
}

/// A rigid object somewhere: what the camera sees and the truth map is made of.
#[derive(Clone, Debug)]
pub struct Body {
    /// Which object of the scene it is.
    pub id: ObjectId,
    /// Its class.
    pub class: ClassId,
    /// Its shape, scale applied; origin at the centre of the footprint.
    pub solid: Arc<Solid>,
    /// Where it is.
    pub world_from_body: Pose,
    /// Mass, kg.
    pub mass_kg: f32,
    /// Coulomb friction coefficient.
    pub friction: f32,
}

impl Body {
    /// How thin it is as it stands: the smaller side of the smallest rectangle around its footprint, or its height where
    /// that is less, metres.
    pub fn thickness_m(&self) -> f32 {
        let height = self.solid.bounds().size().z;
        let rectangle = outline::smallest_rectangle(&self.solid.footprint());
        rectangle.map_or(height, |rectangle| rectangle.size_m.iter().copied().fold(height, f32::min))
    }
}
