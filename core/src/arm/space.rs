//! What an arm may not touch.

use super::{Arm, DistanceField};
use crate::grid::VoxelSet;
use crate::scene::Shelf;
use crate::solid::Bounds;

/// How far the arm keeps from voxels of the map, metres.
pub const MAP_MARGIN_M: f64 = 0.010;
/// How far the arm keeps from the shelf's panels and from the table, metres.
pub const SHELF_MARGIN_M: f64 = 0.005;
/// Thickness of the shelf's panels, metres: as thick as the simulated ones.
pub(super) const PANEL_M: f64 = 0.02;

/// The shelf's panels in the order of [`super::Obstacle::Shelf`]'s names.
pub(super) const PANELS: [&str; 6] = ["board", "back", "left wall", "right wall", "ceiling", "inside"];

/// A panel, `f64`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slab {
    pub min: [f64; 3],
    pub max: [f64; 3],
}

impl Slab {
    /// Distance of a point, metres; negative inside.
    pub(super) fn distance_m(&self, point: &nalgebra::Point3<f64>) -> f64 {
        let (mut outside, mut inside) = (0.0, f64::NEG_INFINITY);
        for axis in 0..3 {
            let beyond = (self.min[axis] - point[axis]).max(point[axis] - self.max[axis]);
            outside += beyond.max(0.0).powi(2);
            inside = inside.max(beyond);
        }
        if inside > 0.0 { outside.sqrt() } else { inside }
    }
}

/// The surroundings of an arm: shelf, table, the map, itself.
#[derive(Clone)]
pub struct Space<'a> {
    /// The arm.
    pub arm: &'a Arm,
    pub(super) panels: Vec<Slab>,
    /// A box around them and all that they hold.
    pub(super) outer: Slab,
    /// Height of the table that the arm stands on, metres.
    pub(super) table_z: f64,
    pub(super) map: Option<MapObstacles<'a>>,
}

/// What the gripper may do with what is on the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gripper {
    /// It keeps the margin like all parts of the arm.
    KeepsAway,
    /// It may touch.
    MayTouch,
}

/// Voxels that are believed to be there, with the distances to them.
#[derive(Clone, Copy)]
pub(super) struct MapObstacles<'a> {
    pub occupied: &'a VoxelSet,
    pub field: &'a DistanceField,
    /// Whether the gripper counts too; while it pushes it is checked voxel by voxel instead ([`Arm::gripper_touches`]).
    pub gripper: Gripper,
}

impl<'a> Space<'a> {
    /// The arm before an empty shelf.
    pub fn empty(arm: &'a Arm, shelf: &Shelf) -> Self {
        let (min, max) = (shelf.min().map(f64::from), shelf.max().map(f64::from));
        let t = PANEL_M;
        let slab = |min: [f64; 3], max: [f64; 3]| Slab { min, max };
        Self {
            arm,
            panels: vec![
                slab([min.x - t, min.y, min.z - t], [max.x + t, max.y + t, min.z]),
                slab([min.x - t, max.y, min.z], [max.x + t, max.y + t, max.z]),
                slab([min.x - t, min.y, min.z], [min.x, max.y, max.z]),
                slab([max.x, min.y, min.z], [max.x + t, max.y, max.z]),
                slab([min.x - t, min.y, max.z], [max.x + t, max.y + t, max.z + t]),
            ],
            outer: slab([min.x - t, min.y, min.z - t], [max.x + t, max.y + t, max.z + t]),
            table_z: arm.world_from_base.translation.z,
            map: None,
        }
    }

    /// The same with the whole inside of the shelf forbidden.
    pub fn closed(arm: &'a Arm, shelf: &Shelf) -> Self {
        let mut space = Self::empty(arm, shelf);
        space.panels.push(Slab { min: shelf.min().map(f64::from).into(), max: shelf.max().map(f64::from).into() });
        space
    }

    /// The same with voxels that must not be touched, and the distances to them.
    pub fn with_map(mut self, occupied: &'a VoxelSet, field: &'a DistanceField) -> Self {
        self.map = Some(MapObstacles { occupied, field, gripper: Gripper::KeepsAway });
        self
    }

    /// The same, but the gripper may touch what the map has.
    pub fn pushing(&self) -> Self {
        let mut space = self.clone();
        if let Some(map) = &mut space.map {
            map.gripper = Gripper::MayTouch;
        }
        space
    }

    /// A lower bound on the distance from a point to the panels, metres, that costs less than asking each.
    pub(super) fn to_panels_m(&self, point: &nalgebra::Point3<f64>) -> f64 {
        // Between the walls the nearest panel is the nearest of their planes; before the front edge all are behind it.
        let [low, high] = [self.outer.min, self.outer.max];
        let beside = (point.x - low[0]).min(high[0] - point.x).min(point.z - low[2]).min(high[2] - point.z) - PANEL_M;
        let front = low[1] - point.y;
        match self.panels.len() {
            5 if front > 0.0 => front,
            5 => beside.min(high[1] - PANEL_M - point.y).max(0.0),
            _ => 0.0,
        }
    }

    /// The panels as boxes.
    pub fn panels(&self) -> Vec<Bounds> {
        let bounds =
            |slab: &Slab| Bounds { min: slab.min.map(|v| v as f32).into(), max: slab.max.map(|v| v as f32).into() };
        self.panels.iter().map(bounds).collect()
    }
}
