//! One straight push, as a policy, a person or a file names it; a [`PhasedMotion`](crate::arm::PhasedMotion) is how the arm
//! carries it out.

use crate::belief::Stroke;
use crate::skill::Arrow;
use crate::{Point, Vector};
use serde::{Deserialize, Serialize};

/// One straight-line manipulation of the shelf: the tip goes in along +y to `start`, then `length_m` along
/// `direction_deg`, then back the same way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Push {
    /// Where the tip starts to push, metres.
    pub start: [f32; 3],
    /// Direction of the push in the plane of the board, degrees counter-clockwise from +x (90 is into the shelf).
    pub direction_deg: f32,
    /// How far the tip moves, metres.
    pub length_m: f32,
}

impl Push {
    /// The tip's position at the start.
    pub fn start_point(&self) -> Point {
        Point::from(self.start)
    }

    /// Unit direction of the push.
    pub fn direction(&self) -> Vector {
        let angle = self.direction_deg.to_radians();
        Vector::new(angle.cos(), angle.sin(), 0.0)
    }

    /// The tip's position at the end.
    pub fn end_point(&self) -> Point {
        self.start_point() + self.direction() * self.length_m
    }

    /// The way of the tip in contact.
    pub fn stroke(&self) -> Stroke {
        Stroke { start: self.start_point(), direction: self.direction(), length_m: self.length_m }
    }

    /// The same, to be drawn.
    pub fn arrow(&self) -> Arrow {
        Arrow { start: self.start_point(), way: self.direction() * self.length_m }
    }
}
