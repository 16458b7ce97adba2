//! The simulated scene (rapier3d): bodies settle, a push is executed by the tool as a kinematic body, drops are
//! detected. Deterministic: the same scene and the same pushes give the same poses, bit for bit, on one machine.

use crate::scene::{Body, ObjectId, Shelf};
use crate::tool::{Push, Tool};

/// The shelf with its bodies and their contacts at one time. A clone is a snapshot: run one, keep the other.
#[derive(Clone)]
pub struct World {
    shelf: Shelf,
    bodies: Vec<Body>,
}

/// What a push did.
#[derive(Clone, Debug, PartialEq)]
pub struct PushOutcome {
    /// How far each object's origin moved, metres, by object.
    pub displacement_m: Vec<f32>,
    /// Objects that left the board during this push.
    pub dropped: Vec<ObjectId>,
    /// Simulated time, seconds.
    pub duration_s: f32,
}

impl World {
    /// The world of the given bodies, not yet settled.
    pub fn new(shelf: Shelf, bodies: Vec<Body>) -> Self {
        Self { shelf, bodies }
    }

    /// Lets the bodies come to rest; returns the largest displacement of an object, metres.
    pub fn settle(&mut self) -> f32 {
        todo!()
    }

    /// The shelf.
    pub fn shelf(&self) -> &Shelf {
        &self.shelf
    }

    /// The bodies where they are now, dropped ones left out.
    pub fn bodies(&self) -> Vec<Body> {
        self.bodies.clone()
    }

    /// Carries out a push with the tool: in from before the shelf, along the push, back the same way, then settles.
    pub fn execute(&mut self, _tool: &Tool, _push: &Push) -> PushOutcome {
        todo!()
    }
}

/// The ground truth: the same shape as a belief's argmax (`ToMap(c)`).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TruthMap {
    /// Numbers of voxels along x, y, z.
    pub dims: [usize; 3],
    /// 1 where a voxel's centre is inside an object.
    pub occupancy: Vec<u8>,
    /// Class of the tallest occupied voxel above a floor cell, else background.
    pub labels: Vec<u8>,
    /// Object with the tallest occupied voxel above a floor cell, [`u16::MAX`] where none.
    pub objects: Vec<u16>,
}

impl TruthMap {
    /// Voxelises bodies exactly: point in shape at voxel centres.
    pub fn of(_grid: &crate::grid::Grid, _bodies: &[Body]) -> Self {
        todo!()
    }
}
