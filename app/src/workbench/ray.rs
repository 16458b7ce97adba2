//! A ray from the eye of a three-dimensional view into the room.

use nudge_core::{Point, Vector};

/// A ray from the eye of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the eye is.
    pub origin: Point,
    /// Where it goes; of length 1.
    pub direction: Vector,
}
