//! A convex hull that stands on all of a face.
//!
//! Contacts between polyhedra are found between two faces of at most four corners each. Parry takes the first four
//! corners of a face, which on the round base of a can lie side by side: the can would rest on a sliver of its base,
//! rock, and creep over the board. This hull gives four corners that span the face instead.

use rapier3d::math::{Pose, Real, Vector};
use rapier3d::parry::bounding_volume::{Aabb, BoundingSphere};
use rapier3d::parry::mass_properties::MassProperties;
use rapier3d::parry::query::{PointProjection, PointQuery, Ray, RayCast, RayIntersection};
use rapier3d::parry::shape::{
    ConvexPolyhedron, FeatureId, PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, Shape, ShapeType, SupportMap,
    TypedShape,
};

/// A convex polyhedron with faces of any number of corners.
#[derive(Clone)]
pub(super) struct Hull {
    hull: ConvexPolyhedron,
    /// Per face with more than four corners, the four on which the body stands; empty for the others.
    stands: Vec<Vec<u32>>,
}

impl Hull {
    pub(super) fn new(hull: ConvexPolyhedron) -> Self {
        let points = hull.points();
        let stand = |face: usize| {
            let ring = ring(&hull, face);
            if ring.len() <= 4 {
                return Vec::new();
            }
            let center = ring.iter().map(|&v| points[v as usize]).sum::<Vector>() / ring.len() as Real;
            let start = farthest(points, ring, |p| (p - center).length_squared());
            spanning_quad(points, ring, start, hull.faces()[face].normal)
        };
        let stands = (0..hull.faces().len()).map(stand).collect();
        Self { hull, stands }
    }

    /// Whether a point of a face's plane lies within a quad of its corners.
    fn covers(&self, quad: &[u32], normal: Vector, point: Vector) -> bool {
        let corner = |i: usize| self.hull.points()[quad[i % 4] as usize];
        (0..4).all(|i| (corner(i + 1) - corner(i)).cross(point - corner(i)).dot(normal) >= 0.0)
    }
}

/// The corners of a face, counter-clockwise seen from outside.
fn ring(hull: &ConvexPolyhedron, face: usize) -> &[u32] {
    let face = &hull.faces()[face];
    let first = face.first_vertex_or_edge as usize;
    &hull.vertices_adj_to_face()[first..first + face.num_vertices_or_edges as usize]
}

/// Position in the ring of the corner with the largest `score`, the first of equals.
fn farthest(points: &[Vector], ring: &[u32], score: impl Fn(Vector) -> Real) -> usize {
    let mut best = (0, Real::NEG_INFINITY);
    for (at, &vertex) in ring.iter().enumerate() {
        let value = score(points[vertex as usize]);
        if value > best.1 {
            best = (at, value);
        }
    }
    best.0
}

/// Four corners of a ring, in its order: `start`, the corner farthest from it, and the farthest on both sides of the
/// line between them.
fn spanning_quad(points: &[Vector], ring: &[u32], start: usize, normal: Vector) -> Vec<u32> {
    let origin = points[ring[start] as usize];
    let opposite = farthest(points, ring, |p| (p - origin).length_squared());
    let across = normal.cross(points[ring[opposite] as usize] - origin);
    let mut corners = [
        start,
        opposite,
        farthest(points, ring, |p| (p - origin).dot(across)),
        farthest(points, ring, |p| -(p - origin).dot(across)),
    ];
    corners.sort_unstable();
    corners.map(|at| ring[at]).to_vec()
}

impl PolygonalFeatureMap for Hull {
    fn local_support_feature(&self, dir: Vector, out: &mut PolygonalFeature) {
        self.local_support_feature_toward(dir, Vector::NAN, out);
    }

    fn local_support_feature_toward(&self, dir: Vector, hint: Vector, out: &mut PolygonalFeature) {
        self.hull.local_support_feature(dir, out);
        let face = out.fid.unpack();
        let FeatureId::Face(face) = face else { return };
        let stand = &self.stands[face as usize];
        if stand.is_empty() {
            return;
        }
        // What stands on the rim beside the usual four corners gets four of its own. The usual ones are kept where
        // they will do: changing corners would make a resting body restless.
        let normal = self.hull.faces()[face as usize].normal;
        let own;
        let mut quad = stand;
        if hint.is_finite() && !self.covers(stand, normal, hint) {
            let (points, ring) = (self.hull.points(), ring(&self.hull, face as usize));
            let nearest = farthest(points, ring, |p| -(p - hint).length_squared());
            own = spanning_quad(points, ring, nearest, normal);
            quad = &own;
        }
        out.num_vertices = 4;
        for (i, &vertex) in quad.iter().enumerate() {
            out.vertices[i] = self.hull.points()[vertex as usize];
            out.vids[i] = PackedFeatureId::vertex(vertex);
            // The sides of the quad are no edges of the hull; they are told apart by their first corner.
            out.eids[i] = PackedFeatureId::edge(vertex);
        }
    }

    fn is_convex_polyhedron(&self) -> bool {
        true
    }
}

impl SupportMap for Hull {
    fn local_support_point(&self, dir: Vector) -> Vector {
        self.hull.local_support_point(dir)
    }
}

impl RayCast for Hull {
    fn cast_local_ray_and_get_normal(&self, ray: &Ray, max: Real, solid: bool) -> Option<RayIntersection> {
        self.hull.cast_local_ray_and_get_normal(ray, max, solid)
    }
}

impl PointQuery for Hull {
    fn project_local_point(&self, point: Vector, solid: bool) -> PointProjection {
        self.hull.project_local_point(point, solid)
    }

    fn project_local_point_and_get_feature(&self, point: Vector) -> (PointProjection, FeatureId) {
        self.hull.project_local_point_and_get_feature(point)
    }
}

impl Shape for Hull {
    fn compute_local_aabb(&self) -> Aabb {
        self.hull.compute_local_aabb()
    }

    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        self.hull.compute_local_bounding_sphere()
    }

    fn compute_aabb(&self, position: &Pose) -> Aabb {
        self.hull.compute_aabb(position)
    }

    fn clone_dyn(&self) -> Box<dyn Shape> {
        Box::new(self.clone())
    }

    fn scale_dyn(&self, scale: Vector, _num_subdivisions: u32) -> Option<Box<dyn Shape>> {
        Some(Box::new(Self::new(self.hull.clone().scaled(scale)?)))
    }

    fn mass_properties(&self, density: Real) -> MassProperties {
        self.hull.mass_properties(density)
    }

    fn shape_type(&self) -> ShapeType {
        ShapeType::Custom
    }

    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::Custom(self)
    }

    fn ccd_thickness(&self) -> Real {
        self.hull.ccd_thickness()
    }

    fn ccd_angular_thickness(&self) -> Real {
        self.hull.ccd_angular_thickness()
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn as_support_map(&self) -> Option<&dyn SupportMap> {
        Some(self)
    }

    fn as_polygonal_feature_map(&self) -> Option<(&dyn PolygonalFeatureMap, Real)> {
        Some((self, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_base_is_stood_on_by_four_corners_far_apart() {
        let ring = (0..24).flat_map(|i| {
            let (sin, cos) = (i as f32 * std::f32::consts::TAU / 24.0).sin_cos();
            [0.0, 0.1].map(|z| Vector::new(0.03 * cos, 0.03 * sin, z))
        });
        let hull = Hull::new(ConvexPolyhedron::from_convex_hull(&ring.collect::<Vec<_>>()).expect("a hull"));
        // The area of the quad below, from a hint within it and from one at the rim.
        for hint in [Vector::ZERO, Vector::new(0.0298, 0.001, 0.0), Vector::new(0.02, -0.0215, 0.0)] {
            let mut feature = PolygonalFeature::default();
            hull.local_support_feature_toward(-Vector::Z, hint, &mut feature);
            let [a, b, c, d] = feature.vertices;
            assert!([a, b, c, d].iter().all(|v| v.z == 0.0) && feature.num_vertices == 4);
            let area = 0.5 * (c - a).cross(d - b);
            assert!((area.length() / (2.0 * 0.03 * 0.03) - 1.0).abs() < 0.01 && area.z < 0.0, "{area}");
        }
        // A side has four corners anyway.
        let mut side = PolygonalFeature::default();
        hull.local_support_feature_toward(Vector::new(1.0, 0.13, 0.0), Vector::ZERO, &mut side);
        assert_eq!(side.num_vertices, 4);
    }
}
