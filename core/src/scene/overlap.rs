//! Whether placed bodies overlap, exactly, by the separating-axis theorem on their convex parts.
//!
//! Most pairs are separated by their outlines on the floor plan; the others are tested along every face normal and
//! every product of two edges, so that an object may stand under the shoulder of another.

use super::body::Body;
use super::outline;
use crate::solid::{Bounds, ConvexPart};
use crate::{Point, Vector};
use std::collections::BTreeMap;

/// Penetration up to this depth, metres, counts as contact.
pub const CONTACT_DEPTH_M: f32 = 0.000_5;

/// A body's parts where they stand, ready for tests.
pub struct PlacedBody {
    bounds: Bounds,
    parts: Vec<PlacedPart>,
}

struct PlacedPart {
    bounds: Bounds,
    vertices: Vec<Point>,
    outline: Vec<[f32; 2]>,
    normals: Vec<Vector>,
    edges: Vec<Vector>,
}

impl PlacedBody {
    /// The body's parts in the shelf's frame.
    pub fn new(body: &Body) -> Self {
        let place = |part: &ConvexPart| {
            let vertices: Vec<Point> = part.vertices.iter().map(|p| body.world_from_body * p).collect();
            let mut plan: Vec<[f32; 2]> = vertices.iter().map(|p| [p.x, p.y]).collect();
            PlacedPart {
                bounds: Bounds::around(vertices.iter().copied())
                    .unwrap_or(Bounds { min: Point::origin(), max: Point::origin() }),
                outline: crate::solid::convex_outline(&mut plan),
                normals: part.planes.iter().map(|plane| body.world_from_body * plane.normal).collect(),
                edges: edge_directions(part).iter().map(|edge| body.world_from_body * edge).collect(),
                vertices,
            }
        };
        Self {
            bounds: body.solid.bounds_at(&body.world_from_body),
            parts: body.solid.parts.iter().map(place).collect(),
        }
    }

    /// Depth by which two bodies overlap, metres; `None` when they are apart or only in contact.
    pub fn overlap(&self, other: &Self) -> Option<f32> {
        if !meet(&self.bounds, &other.bounds) {
            return None;
        }
        let pairs = self.parts.iter().flat_map(|a| other.parts.iter().map(move |b| (a, b)));
        pairs.filter_map(|(a, b)| a.overlap(b)).max_by(f32::total_cmp)
    }
}

impl PlacedPart {
    fn overlap(&self, other: &Self) -> Option<f32> {
        if !meet(&self.bounds, &other.bounds) {
            return None;
        }
        let deep = |depth: f32| (depth > CONTACT_DEPTH_M).then_some(depth);
        let mut depth = deep(-outline::separation(&self.outline, &other.outline))?;
        for axis in self.normals.iter().chain(&other.normals) {
            depth = depth.min(deep(self.depth_along(other, axis))?);
        }
        for a in &self.edges {
            for b in &other.edges {
                if let Some(axis) = a.cross(b).try_normalize(1e-3) {
                    depth = depth.min(deep(self.depth_along(other, &axis))?);
                }
            }
        }
        Some(depth)
    }

    /// How far the parts' shadows on a unit axis overlap.
    fn depth_along(&self, other: &Self, axis: &Vector) -> f32 {
        let shadow = |part: &Self| {
            part.vertices
                .iter()
                .map(|p| axis.dot(&p.coords))
                .fold([f32::INFINITY, f32::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)])
        };
        let ([a0, a1], [b0, b1]) = (shadow(self), shadow(other));
        (a1 - b0).min(b1 - a0)
    }
}

fn meet(a: &Bounds, b: &Bounds) -> bool {
    (0..3).all(|axis| a.max[axis].min(b.max[axis]) - a.min[axis].max(b.min[axis]) > CONTACT_DEPTH_M)
}

/// Directions of the edges between two faces, each once: diagonals inside a face separate nothing.
fn edge_directions(part: &ConvexPart) -> Vec<Vector> {
    let mut first_face: BTreeMap<(u32, u32), Vector> = BTreeMap::new();
    let mut directions: Vec<Vector> = Vec::new();
    for triangle in &part.triangles {
        let [a, b, c] = triangle.map(|i| part.vertices[i as usize]);
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-12) else { continue };
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (from, to) = (triangle[from].min(triangle[to]), triangle[from].max(triangle[to]));
            let Some(other) = first_face.insert((from, to), normal) else { continue };
            let edge = part.vertices[to as usize] - part.vertices[from as usize];
            let Some(edge) = edge.try_normalize(1e-9) else { continue };
            let known = |known: &Vector| known.dot(&edge).abs() > 1.0 - 1e-6;
            if other.dot(&normal) < 1.0 - 1e-5 && !directions.iter().any(known) {
                directions.push(edge);
            }
        }
    }
    directions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pose;
    use crate::scene::{Catalog, ClassId, ObjectId};
    use crate::solid::Solid;
    use proptest::prelude::*;
    use std::sync::Arc;

    fn body(solid: Arc<Solid>, x: f32, y: f32, yaw_deg: f32) -> PlacedBody {
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector::z_axis(), yaw_deg.to_radians());
        let world_from_body = Pose::from_parts(Vector::new(x, y, 0.0).into(), turn);
        let (id, class) = (ObjectId(0), ClassId(0));
        PlacedBody::new(&Body { id, class, solid, world_from_body, mass_kg: 1.0, friction: 0.5 })
    }

    #[test]
    fn boxes_overlap_by_what_was_typed_and_touch_without_overlap() {
        let solid = Arc::new(Solid::standing_box(Vector::new(0.1, 0.1, 0.2)));
        let still = body(solid.clone(), 0.0, 0.0, 0.0);
        let depth = |x: f32| still.overlap(&body(solid.clone(), x, 0.02, 0.0));
        assert!((depth(0.097).expect("overlap") - 0.003).abs() < 1e-5);
        assert_eq!((depth(0.1), depth(0.0996), depth(0.2)), (None, None, None));
        assert!(still.overlap(&body(solid, 0.0, 0.0, 0.0)).is_some(), "the same place twice");
    }

    #[test]
    fn a_small_box_may_stand_under_a_wide_top_but_not_in_the_stem() {
        let slab = |x: f32, z0: f32, z1: f32| {
            let corners = (0..8).map(|i| {
                let s = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
                Point::new(s(0) * x, s(1) * x, if i & 4 == 0 { z0 } else { z1 })
            });
            ConvexPart::hull(&corners.collect::<Vec<_>>()).expect("slab")
        };
        let mushroom = Arc::new(Solid { parts: vec![slab(0.01, 0.0, 0.1), slab(0.1, 0.1, 0.12)] });
        let small = Arc::new(Solid::standing_box(Vector::new(0.04, 0.04, 0.09)));
        let still = body(mushroom, 0.0, 0.0, 0.0);
        assert_eq!(still.overlap(&body(small.clone(), 0.05, 0.0, 20.0)), None);
        assert!(still.overlap(&body(small, 0.025, 0.0, 0.0)).is_some());
    }

    proptest! {
        /// No sampled point is deep inside both bodies that are said to be apart, and bodies that share a deep point
        /// overlap.
        #[test]
        fn agrees_with_sampled_points(a in 0_usize..14, b in 0_usize..14, x in -0.15_f32..0.15, y in -0.15_f32..0.15, yaw in 0.0_f32..180.0) {
            let catalog = Catalog::standard();
            let (solid_a, solid_b) = (&catalog.classes[a].solid, &catalog.classes[b].solid);
            let overlap = body(solid_a.clone(), 0.0, 0.0, 0.0).overlap(&body(solid_b.clone(), x, y, yaw));
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector::z_axis(), yaw.to_radians());
            let world_from_b = Pose::from_parts(Vector::new(x, y, 0.0).into(), turn);
            let bounds = solid_a.bounds();
            let shared = (0..20 * 20 * 12).any(|i| {
                let share = [i % 20, i / 20 % 20, i / 400].map(|k| k as f32 + 0.5);
                let size = bounds.size();
                let p = bounds.min + Vector::new(share[0] / 20.0 * size.x, share[1] / 20.0 * size.y, share[2] / 12.0 * size.z);
                let deep = |solid: &Solid, p: Point| solid.parts.iter().any(|part| {
                    part.planes.iter().all(|plane| plane.normal.dot(&p.coords) <= plane.offset - 0.000_6)
                });
                deep(solid_a, p) && deep(solid_b, world_from_b.inverse_transform_point(&p))
            });
            if shared {
                prop_assert!(overlap.is_some());
            }
            if let Some(depth) = overlap {
                // A lens deeper than the sampling grid holds a sample.
                prop_assert!(shared || depth < 0.03, "depth {}", depth);
            }
        }
    }
}
