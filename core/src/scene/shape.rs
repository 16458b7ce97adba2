//! The catalogue's shapes: convex or a few convex parts, of exact outer sizes.
//!
//! Round sections are polygons with [`SIDES`] corners *on* the circle: the outer size is exact along x and y, and the
//! area falls short by 0.6 %. All shapes narrow upwards, so that column closure holds for every one of them.

use crate::solid::{ConvexPart, Solid};
use crate::{Point, Vector};
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;

/// Corners of a round section; a multiple of four, so that corners lie on the axes.
const SIDES: usize = 32;

/// A shape standing on the board with the centre of its footprint at the origin; lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// An upright cylinder.
    Cylinder {
        /// Radius.
        radius_m: f32,
        /// Height.
        height_m: f32,
    },
    /// A box.
    Box {
        /// Size along x, y, z.
        #[serde(deserialize_with = "crate::fixed::array")]
        size_m: [f32; 3],
    },
    /// A box with rounded upright edges.
    RoundedBox {
        /// Size along x, y, z.
        #[serde(deserialize_with = "crate::fixed::array")]
        size_m: [f32; 3],
        /// Radius of the upright edges.
        corner_radius_m: f32,
    },
    /// A body of oval section, a shoulder that tapers, and a round neck.
    Bottle {
        /// Outer size along x, y, z.
        #[serde(deserialize_with = "crate::fixed::array")]
        size_m: [f32; 3],
        /// Height where the body ends and the shoulder begins.
        body_m: f32,
        /// Height where the shoulder ends and the neck begins.
        neck_from_m: f32,
        /// Radius of the neck.
        neck_radius_m: f32,
    },
    /// A drink carton: upright walls, two roof faces, and the upright seal on their ridge, along x.
    Carton {
        /// Outer size along x, y, z.
        #[serde(deserialize_with = "crate::fixed::array")]
        size_m: [f32; 3],
        /// Height of the walls.
        walls_m: f32,
        /// Height where the roof faces meet the seal.
        ridge_m: f32,
        /// Thickness of the seal.
        seal_m: f32,
    },
}

impl Shape {
    /// The shape as convex parts. Parts without volume are left out, so that a senseless description has none.
    pub fn solid(&self) -> Solid {
        let layers = |layers: &[(&[[f32; 2]], f32)]| {
            let corners = layers.iter().flat_map(|(outline, z)| outline.iter().map(|[x, y]| Point::new(*x, *y, *z)));
            ConvexPart::hull(&corners.collect::<Vec<_>>())
        };
        let parts = match *self {
            Self::Cylinder { radius_m, height_m } => {
                let circle = circle(radius_m);
                vec![layers(&[(&circle, 0.0), (&circle, height_m)])]
            }
            Self::Box { size_m } => return Solid::standing_box(Vector::from(size_m)),
            Self::RoundedBox { size_m, corner_radius_m } => {
                let section = rounded_rectangle([size_m[0], size_m[1]], corner_radius_m);
                vec![layers(&[(&section, 0.0), (&section, size_m[2])])]
            }
            Self::Bottle { size_m, body_m, neck_from_m, neck_radius_m } => {
                let section = rounded_rectangle([size_m[0], size_m[1]], 0.5 * size_m[0].min(size_m[1]));
                let neck = circle(neck_radius_m);
                vec![
                    layers(&[(&section, 0.0), (&section, body_m), (&neck, neck_from_m)]),
                    layers(&[(&neck, neck_from_m), (&neck, size_m[2])]),
                ]
            }
            Self::Carton { size_m, walls_m, ridge_m, seal_m } => {
                let rectangle = |depth: f32| rounded_rectangle([size_m[0], depth], 0.0);
                let (walls, seal) = (rectangle(size_m[1]), rectangle(seal_m));
                vec![
                    layers(&[(&walls, 0.0), (&walls, walls_m), (&seal, ridge_m)]),
                    layers(&[(&seal, ridge_m), (&seal, size_m[2])]),
                ]
            }
        };
        Solid { parts: parts.into_iter().flatten().collect() }
    }

    /// Whether a turn about z changes nothing that matters.
    pub fn is_round(&self) -> bool {
        matches!(self, Self::Cylinder { .. })
    }
}

fn circle(radius: f32) -> Vec<[f32; 2]> {
    rounded_rectangle([2.0 * radius; 2], radius)
}

/// A rectangle about the origin whose corners are arcs of `radius`, counter-clockwise.
fn rounded_rectangle(size: [f32; 2], radius: f32) -> Vec<[f32; 2]> {
    let quarter = SIDES / 4;
    let mut outline: Vec<[f32; 2]> = Vec::with_capacity(SIDES + 4);
    for corner in 0..4 {
        let (sign_x, sign_y) = ([1.0, -1.0, -1.0, 1.0][corner], [1.0, 1.0, -1.0, -1.0][corner]);
        let centre = [sign_x * (0.5 * size[0] - radius), sign_y * (0.5 * size[1] - radius)];
        for step in 0..=quarter {
            let (sin, cos) = (TAU * (corner * quarter + step) as f32 / SIDES as f32).sin_cos();
            // Exactly zero on the axes, so that straight sides are straight.
            let snap = |v: f32| if v.abs() < 1e-6 { 0.0 } else { v };
            let point = [centre[0] + radius * snap(cos), centre[1] + radius * snap(sin)];
            let close = |other: &[f32; 2]| (other[0] - point[0]).abs() + (other[1] - point[1]).abs() < 1e-6;
            if !outline.last().is_some_and(close) && !outline.first().is_some_and(close) {
                outline.push(point);
            }
        }
    }
    outline
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    #[test]
    fn a_cylinder_is_a_prism_with_corners_on_the_circle() {
        let solid = Shape::Cylinder { radius_m: 0.037, height_m: 0.242 }.solid();
        assert_eq!(solid.parts.len(), 1);
        assert_eq!((solid.parts[0].vertices.len(), solid.parts[0].planes.len()), (2 * SIDES, SIDES + 2));
        let exact = PI * 0.037 * 0.037 * 0.242;
        let share = solid.volume() / exact;
        assert!((0.993..0.994).contains(&share), "{share}");
    }

    #[test]
    fn a_rounded_box_loses_its_corners_only() {
        let shape = Shape::RoundedBox { size_m: [0.103, 0.056, 0.084], corner_radius_m: 0.018 };
        let solid = shape.solid();
        let lost = (4.0 - PI) * 0.018 * 0.018;
        let expected = (0.103 * 0.056 - lost) * 0.084;
        assert!((solid.volume() / expected - 1.0).abs() < 0.003);
        assert!(solid.contains(Point::new(0.0, 0.0279, 0.01)) && !solid.contains(Point::new(0.05, 0.027, 0.01)));
    }

    #[test]
    fn a_bottle_narrows_to_its_neck() {
        let shape =
            Shape::Bottle { size_m: [0.104, 0.068, 0.252], body_m: 0.15, neck_from_m: 0.198, neck_radius_m: 0.015 };
        let solid = shape.solid();
        let inside = |x: f32, z: f32| solid.contains(Point::new(x, 0.0, z));
        assert!(inside(0.05, 0.14) && !inside(0.05, 0.16) && inside(0.03, 0.17));
        assert!(inside(0.014, 0.25) && !inside(0.016, 0.25) && !inside(0.0, 0.253));
        assert_eq!(solid.parts.len(), 2);
    }

    #[test]
    fn a_carton_has_a_gable_along_x() {
        let shape = Shape::Carton { size_m: [0.07, 0.07, 0.23], walls_m: 0.18, ridge_m: 0.213, seal_m: 0.006 };
        let solid = shape.solid();
        assert!(solid.contains(Point::new(0.034, 0.034, 0.179)) && !solid.contains(Point::new(0.0, 0.034, 0.2)));
        assert!(solid.contains(Point::new(0.034, 0.0, 0.229)) && !solid.contains(Point::new(0.0, 0.004, 0.229)));
    }

    #[test]
    fn shapes_survive_stretching_with_their_faces() {
        for class in &super::super::Catalog::standard().classes {
            let scaled = class.solid.scaled([0.8, 1.2, 1.1]);
            assert_eq!(scaled.parts.len(), class.solid.parts.len());
            let ratio = scaled.volume() / class.solid.volume();
            assert!((ratio - 0.8 * 1.2 * 1.1).abs() < 1e-4, "{} {ratio}", class.name);
            for (a, b) in scaled.parts.iter().zip(&class.solid.parts) {
                assert_eq!(a.planes.len(), b.planes.len(), "{}", class.name);
            }
        }
    }
}
