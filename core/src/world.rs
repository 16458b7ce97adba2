//! The simulated scene (rapier3d): bodies settle, a motion is carried out by the arm as kinematic bodies, drops are
//! detected. Deterministic: the same scene and the same motions give the same poses, bit for bit, on one machine.

mod hull;
mod manipulate;
mod physics;
mod truth;

pub use manipulate::{Grip, GripEnd, LinkContact};
pub use physics::{BEND_NM, LIP_M, PULL_N, STROKE_M};
pub use truth::TruthMap;

use crate::arm::Joints;
use crate::scene::{Body, ObjectId, Shelf};
use crate::solid::Bounds;
use crate::{Point, Pose};
use physics::Physics;
use serde::{Deserialize, Serialize};

/// Thickness of the shelf's panels outside its interior, metres.
pub const PANEL_M: f32 = 0.02;
/// Longest simulated time that bodies are given to come to rest, seconds; what still moves then is stopped.
pub const SETTLE_LIMIT_S: f32 = 4.0;

/// The panels of the shelf (board, back, left, right, ceiling) as boxes around the interior; the front is open.
pub fn shelf_panels(shelf: &Shelf) -> [Bounds; 5] {
    let (min, max) = (shelf.min(), shelf.max());
    let t = PANEL_M;
    let panel = |a: [f32; 3], b: [f32; 3]| Bounds { min: Point::from(a), max: Point::from(b) };
    [
        panel([min.x - t, min.y, min.z - t], [max.x + t, max.y + t, min.z]),
        panel([min.x - t, max.y, min.z], [max.x + t, max.y + t, max.z]),
        panel([min.x - t, min.y, min.z], [min.x, max.y, max.z]),
        panel([max.x, min.y, min.z], [max.x + t, max.y, max.z]),
        panel([min.x - t, min.y, max.z], [max.x + t, max.y + t, max.z + t]),
    ]
}

/// The shelf with its bodies and their contacts at one time. A clone is a snapshot: run one, keep the other; both have
/// the same future, bit for bit.
#[derive(Clone)]
pub struct World {
    shelf: Shelf,
    bodies: Vec<Body>,
    /// Per body, whether it has left the board.
    dropped: Vec<bool>,
    /// Per body, whether the arm has laid it down beside the robot.
    stowed: Vec<bool>,
    physics: Physics,
}

/// Where a body stands, and whether it has left the board.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// Its pose; of a dropped one the last before it was taken away.
    pub world_from_body: Pose,
    /// Whether it has left the board.
    pub dropped: bool,
    /// Whether the arm has laid it down beside the robot.
    #[serde(default, skip_serializing_if = "is_false")]
    pub stowed: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde hands fields over by reference")]
fn is_false(flag: &bool) -> bool {
    !*flag
}

/// What a manipulation did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ManipulationOutcome {
    /// How far each object's origin moved, metres, in the order of the bodies that the world was made of; for a drop
    /// to where it was when it had fallen past the board, 0 for objects dropped earlier.
    pub displacement_m: Vec<f32>,
    /// Objects that left the board on the way.
    pub dropped: Vec<ObjectId>,
    /// Simulated time, seconds.
    pub duration_s: f32,
    /// Whether the arm was blocked (objects jammed against the shelf) and gave up before the contact's end.
    pub stalled: bool,
    /// How far the tip really moved in contact, metres.
    pub way_m: f32,
    /// Objects that a link of the arm touched, which only the gripper should; each once per link.
    pub link_contacts: Vec<LinkContact>,
    /// Objects that the arm pressed against a wall of the shelf.
    pub against_wall: Vec<ObjectId>,
    /// How deep the arm got into a panel of the shelf at most, metres.
    pub arm_in_shelf_m: f32,
    /// What became of what the cup was to hold; `None` for a motion without suction.
    pub grip: Option<Grip>,
    /// How long the arm moved, seconds.
    pub arm_s: f32,
    /// The configurations that the arm passed until it turned back.
    pub passed: Vec<Joints>,
}

impl ManipulationOutcome {
    /// Sum of the displacements, metres, without that of an object that was held until it was where it was to be.
    pub fn disturbed_m(&self) -> f64 {
        let carried = self.grip.as_ref().filter(|grip| grip.end.is_held()).and_then(|grip| grip.object);
        let others = (0u16..).zip(&self.displacement_m).filter(|(at, _)| carried != Some(ObjectId(*at)));
        others.map(|(_, m)| f64::from(*m)).sum()
    }
}

impl World {
    /// The world of the given bodies, not yet settled.
    pub fn new(shelf: Shelf, bodies: Vec<Body>) -> Self {
        let physics = Physics::new(&shelf, &bodies);
        Self { shelf, dropped: vec![false; bodies.len()], stowed: vec![false; bodies.len()], bodies, physics }
    }

    /// Lets the bodies come to rest; returns the largest displacement of an object, metres.
    pub fn settle(&mut self) -> f32 {
        let before = self.poses();
        self.physics.begin();
        self.come_to_rest();
        self.read_back();
        self.displacements(&before).into_iter().fold(0.0, f32::max)
    }

    /// The shelf.
    pub fn shelf(&self) -> &Shelf {
        &self.shelf
    }

    /// The bodies where they are now; those left out that have left the board or were laid down beside the robot.
    pub fn bodies(&self) -> Vec<Body> {
        (0..self.bodies.len()).filter(|at| !self.is_gone(*at)).map(|at| self.bodies[at].clone()).collect()
    }

    /// Whether a body is no longer in the shelf.
    fn is_gone(&self, at: usize) -> bool {
        self.dropped[at] || self.stowed[at]
    }

    /// Where every body stands, in the order of the bodies that the world was made of.
    pub fn standing(&self) -> Vec<Standing> {
        let of = |at: usize| Standing {
            world_from_body: self.bodies[at].world_from_body,
            dropped: self.dropped[at],
            stowed: self.stowed[at],
        };
        (0..self.bodies.len()).map(of).collect()
    }

    /// This world's bodies as they would be elsewhere, dropped ones left out; the world stays as it is.
    ///
    /// # Errors
    /// In words, for another number of bodies.
    pub fn bodies_at(&self, standing: &[Standing]) -> Result<Vec<Body>, String> {
        if standing.len() != self.bodies.len() {
            return Err(format!("{} bodies where the scene has {}", standing.len(), self.bodies.len()));
        }
        let both = self.bodies.iter().zip(standing).filter(|(_, at)| !at.dropped && !at.stowed);
        Ok(both.map(|(body, at)| Body { world_from_body: at.world_from_body, ..body.clone() }).collect())
    }

    /// Kinetic energy of all bodies, joules.
    pub fn kinetic_energy_j(&self) -> f32 {
        self.physics.kinetic_energy_j()
    }

    /// How deep two bodies, or a body and the shelf, overlap at most, metres; 0 when nothing touches.
    pub fn deepest_overlap_m(&self) -> f32 {
        self.physics.deepest_overlap_m()
    }

    fn come_to_rest(&mut self) {
        let limit = (SETTLE_LIMIT_S / physics::TIME_STEP_S) as usize;
        for _ in 0..limit {
            if self.physics.is_at_rest() {
                break;
            }
            self.physics.step();
            self.note_drops();
        }
        self.physics.stop_all();
        for at in 0..self.bodies.len() {
            // Nothing holds a body up out here; this is for one that was stopped while it slid over the edge.
            if !self.is_gone(at) && self.is_outside(at) {
                self.drop_body(at);
            }
        }
    }

    /// Takes away bodies that have fallen past the board.
    fn note_drops(&mut self) {
        for at in 0..self.bodies.len() {
            if !self.is_gone(at) && self.physics.center_of_mass(at).z < -physics::FALL_M {
                self.drop_body(at);
            }
        }
    }

    fn drop_body(&mut self, at: usize) {
        self.bodies[at].world_from_body = self.physics.pose(at);
        self.dropped[at] = true;
        self.physics.remove(at);
    }

    /// Lays what the cup holds down beside the robot.
    fn stow(&mut self) {
        if let Some(at) = self.physics.held() {
            self.physics.let_go();
            self.bodies[at].world_from_body = self.physics.pose(at);
            self.stowed[at] = true;
            self.physics.remove(at);
        }
    }

    /// Whether a body's centre of mass is no longer over the board.
    fn is_outside(&self, at: usize) -> bool {
        let (center, min, max) = (self.physics.center_of_mass(at), self.shelf.min(), self.shelf.max());
        !(center.y >= min.y && center.z >= min.z && center.x >= min.x && center.x <= max.x && center.y <= max.y)
    }

    fn poses(&self) -> Vec<Pose> {
        self.bodies.iter().map(|body| body.world_from_body).collect()
    }

    fn read_back(&mut self) {
        for (at, body) in self.bodies.iter_mut().enumerate() {
            if !self.dropped[at] && !self.stowed[at] {
                body.world_from_body = self.physics.pose(at);
            }
        }
    }

    fn displacements(&self, before: &[Pose]) -> Vec<f32> {
        let moved = |(body, before): (&Body, &Pose)| {
            (body.world_from_body.translation.vector - before.translation.vector).norm()
        };
        self.bodies.iter().zip(before).map(moved).collect()
    }
}

#[cfg(test)]
mod tests;
