//! Collision shapes of a URDF file as convex parts.

use super::Frame;
use super::description::{FAR_M, Geometry, Link};
use super::tree::place;
use crate::scene::RobotFile;
use crate::solid::ConvexPart;
use crate::{Error, Point, Result};
use std::path::Path;

/// Sides of the prism that stands for a cylinder.
const SIDES: usize = 16;

/// Convex shapes of a link in its body's frame. `file` has the meshes.
///
/// # Errors
/// Shapes without volume, meshes that are not there: one line that names `path`, line and link. A visual that stands in
/// for a collision shape is left out instead, since it was not made for it.
pub(super) fn of_link(file: &RobotFile, path: &Path, link: &Link, body_from_link: &Frame) -> Result<Vec<ConvexPart>> {
    let mut shapes = Vec::new();
    for collision in &link.collisions {
        let from_shape = body_from_link * collision.link_from_shape;
        let place_point = |p: &Point| (from_shape * p.map(f64::from)).map(|v| v as f32);
        let shape = corners(file, &collision.geometry).and_then(|points| {
            let points: Vec<Point> = points.iter().map(place_point).collect();
            ConvexPart::hull(&points).ok_or_else(|| "a collision shape has no volume".to_owned())
        });
        match shape {
            Ok(shape) => shapes.push(shape),
            Err(_) if link.from_visuals => {}
            Err(message) => {
                let mut at = link.at.clone();
                at.line = collision.line;
                return Err(Error::input(path, place("link", &at), message));
            }
        }
    }
    Ok(shapes)
}

/// Corners of a collision shape, in the shape's frame.
fn corners(file: &RobotFile, geometry: &Geometry) -> std::result::Result<Vec<Point>, String> {
    let size = |name: &str, value: f64| {
        if value > 0.0 && value <= FAR_M {
            return Ok(value as f32);
        }
        Err(format!("{name} {value} of a collision shape: must be above 0, at most {FAR_M} m"))
    };
    Ok(match geometry {
        Geometry::Box { size: [x, y, z] } => {
            let half = [size("width", *x)? / 2.0, size("depth", *y)? / 2.0, size("height", *z)? / 2.0];
            (0..8).map(|i| [0, 1, 2].map(|a| if i >> a & 1 == 1 { half[a] } else { -half[a] }).into()).collect()
        }
        Geometry::Cylinder { radius, length } => prism(size("radius", *radius)?, size("length", *length)? / 2.0),
        Geometry::Capsule { radius, length } => {
            let (radius, half) = (size("radius", *radius)?, size("length", *length)? / 2.0);
            let mut points = ball(radius);
            points.iter_mut().for_each(|p| p.z += if p.z >= 0.0 { half } else { -half });
            points.extend(prism(radius, half));
            points
        }
        Geometry::Sphere { radius } => ball(size("radius", *radius)?),
        Geometry::Mesh { filename, scale } => {
            let Some(points) = file.meshes.get(filename) else { return Err(format!("mesh `{filename}` is not there")) };
            points.iter().map(|p| Point::from([0, 1, 2].map(|a| p[a] * scale[a] as f32))).collect()
        }
    })
}

/// A prism around a cylinder: its sides touch the cylinder from outside.
fn prism(radius: f32, half: f32) -> Vec<Point> {
    let outer = radius / (std::f32::consts::PI / SIDES as f32).cos();
    let corner = |i: usize| {
        let angle = std::f32::consts::TAU * i as f32 / SIDES as f32;
        [-half, half].map(|z| Point::new(outer * angle.cos(), outer * angle.sin(), z))
    };
    (0..SIDES).flat_map(corner).collect()
}

/// Corners of a polyhedron around a ball.
fn ball(radius: f32) -> Vec<Point> {
    let rings = SIDES / 2;
    let step = std::f32::consts::PI / rings as f32;
    let outer = radius / ((0.5 * step).cos() * (std::f32::consts::PI / SIDES as f32).cos());
    let ring = |i: usize| {
        let latitude = (i as f32 + 0.5) * step - std::f32::consts::FRAC_PI_2;
        (0..SIDES).map(move |j| {
            let longitude = std::f32::consts::TAU * j as f32 / SIDES as f32;
            let flat = outer * latitude.cos();
            Point::new(flat * longitude.cos(), flat * longitude.sin(), outer * latitude.sin())
        })
    };
    (0..rings).flat_map(ring).collect()
}
