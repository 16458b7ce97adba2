//! Solids made of a few convex parts: what objects and tools are for rays, for contact and for the truth map.
//!
//! A convex part is kept as its hull (for contact and pictures) and as half-spaces (for exact point and ray tests), so
//! that the camera, the physics and the truth map all see the very same shape.

mod columns;

pub(crate) use columns::levels_inside;

use crate::{Point, Pose, Vector};

/// An axis-aligned box, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The corner with the smallest coordinates.
    pub min: Point,
    /// The corner with the largest coordinates.
    pub max: Point,
}

impl Bounds {
    /// The smallest box around `points`; `None` without points.
    pub fn around(points: impl IntoIterator<Item = Point>) -> Option<Self> {
        points.into_iter().fold(None, |bounds: Option<Self>, point| {
            Some(match bounds {
                None => Self { min: point, max: point },
                Some(b) => Self { min: b.min.inf(&point), max: b.max.sup(&point) },
            })
        })
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    /// Edge lengths, metres.
    pub fn size(&self) -> Vector {
        self.max - self.min
    }
}

/// A face plane: points with `normal . p <= offset` are inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Outward unit normal.
    pub normal: Vector,
    /// Distance of the plane from the origin along the normal, metres.
    pub offset: f32,
}

/// A convex polyhedron in its body's frame.
#[derive(Clone, Debug)]
pub struct ConvexPart {
    /// Corners of the hull, metres.
    pub vertices: Vec<Point>,
    /// Triangles of the hull, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The face planes, coplanar triangles merged.
    pub planes: Vec<HalfSpace>,
}

impl ConvexPart {
    /// The convex hull of `points` (metres). `None` when they span no volume.
    pub fn hull(points: &[Point]) -> Option<Self> {
        let input: Vec<parry3d::math::Vector> =
            points.iter().map(|p| parry3d::math::Vector::new(p.x, p.y, p.z)).collect();
        let (hull, triangles) = parry3d::transformation::try_convex_hull(&input).ok()?;
        let vertices: Vec<Point> = hull.iter().map(|p| Point::new(p.x, p.y, p.z)).collect();
        let mut planes: Vec<HalfSpace> = Vec::new();
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|i| vertices[i as usize]);
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-12) else { continue };
            let offset = normal.dot(&a.coords);
            let known = |p: &HalfSpace| p.normal.dot(&normal) > 1.0 - 1e-5 && (p.offset - offset).abs() < 1e-5;
            if !planes.iter().any(known) {
                planes.push(HalfSpace { normal, offset });
            }
        }
        (planes.len() >= 4).then_some(Self { vertices, triangles, planes })
    }

    /// The edges at which the surface bends by more than `angle`, radians: those that a draughtsman would draw. Ends in the
    /// body's frame, metres.
    pub fn creases(&self, angle: f32) -> Vec<[Point; 2]> {
        let corner = |i: u32| self.vertices[i as usize];
        let mut sides: std::collections::BTreeMap<[u32; 2], Vec<Vector>> = std::collections::BTreeMap::new();
        for &[a, b, c] in &self.triangles {
            let normal = (corner(b) - corner(a)).cross(&(corner(c) - corner(a)));
            let Some(normal) = normal.try_normalize(1e-12) else { continue };
            for [from, to] in [[a, b], [b, c], [c, a]] {
                sides.entry([from.min(to), from.max(to)]).or_default().push(normal);
            }
        }
        let bends = |normals: &[Vector]| !matches!(normals, [a, b] if a.dot(b) > angle.cos());
        sides.into_iter().filter(|(_, normals)| bends(normals)).map(|(ends, _)| ends.map(corner)).collect()
    }

    /// Whether a point of the body's frame is inside or on the surface.
    pub fn contains(&self, point: Point) -> bool {
        self.planes.iter().all(|plane| plane.normal.dot(&point.coords) <= plane.offset)
    }

    /// Where the ray `from + t direction` enters the part, with `0 <= t <= t_max`. A ray that starts inside hits at 0.
    pub fn ray_enter(&self, from: Point, direction: Vector, t_max: f32) -> Option<f32> {
        let (mut enter, mut leave) = (0.0_f32, t_max);
        for plane in &self.planes {
            let speed = plane.normal.dot(&direction);
            let height = plane.normal.dot(&from.coords) - plane.offset;
            if speed.abs() < 1e-12 {
                if height > 0.0 {
                    return None;
                }
            } else {
                let t = -height / speed;
                if speed < 0.0 {
                    enter = enter.max(t);
                } else {
                    leave = leave.min(t);
                }
                if enter > leave {
                    return None;
                }
            }
        }
        Some(enter)
    }

    /// Volume, cubic metres.
    pub fn volume(&self) -> f32 {
        self.triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|i| self.vertices[i as usize].coords);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }
}

/// A rigid shape of one or more convex parts, in its body's frame: the origin is the centre of the footprint on the
/// board, z is up.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The parts; they may touch or overlap.
    pub parts: Vec<ConvexPart>,
}

impl Solid {
    /// A box of `size` (metres) standing on its origin.
    pub fn standing_box(size: Vector) -> Self {
        let corner = |i: usize| {
            let side = |axis: usize| if i >> axis & 1 == 1 { 0.5 } else { -0.5 };
            Point::new(side(0) * size.x, side(1) * size.y, (side(2) + 0.5) * size.z)
        };
        let points: Vec<Point> = (0..8).map(corner).collect();
        Self { parts: ConvexPart::hull(&points).into_iter().collect() }
    }

    /// The bounding box in the body's frame.
    pub fn bounds(&self) -> Bounds {
        self.bounds_at(&Pose::identity())
    }

    /// The bounding box of the solid at `pose`.
    pub fn bounds_at(&self, pose: &Pose) -> Bounds {
        Bounds::around(self.parts.iter().flat_map(|part| &part.vertices).map(|p| pose * p))
            .unwrap_or(Bounds { min: Point::origin(), max: Point::origin() })
    }

    /// Whether a point of the body's frame is inside.
    pub fn contains(&self, point: Point) -> bool {
        self.parts.iter().any(|part| part.contains(point))
    }

    /// The solid stretched along the axes of its body.
    pub fn scaled(&self, scale: [f32; 3]) -> Self {
        let stretch = |part: &ConvexPart| {
            let points: Vec<Point> =
                part.vertices.iter().map(|p| Point::new(p.x * scale[0], p.y * scale[1], p.z * scale[2])).collect();
            ConvexPart::hull(&points)
        };
        Self { parts: self.parts.iter().filter_map(stretch).collect() }
    }

    /// Convex outline of the footprint (the projection onto the board), counter-clockwise, metres.
    pub fn footprint(&self) -> Vec<[f32; 2]> {
        let mut points: Vec<[f32; 2]> = self.parts.iter().flat_map(|part| &part.vertices).map(|p| [p.x, p.y]).collect();
        convex_outline(&mut points)
    }

    /// Volume of the parts together, cubic metres; overlaps count twice.
    pub fn volume(&self) -> f32 {
        self.parts.iter().map(ConvexPart::volume).sum()
    }
}

/// Convex hull of points in the plane (Andrew's monotone chain), counter-clockwise.
pub fn convex_outline(points: &mut [[f32; 2]]) -> Vec<[f32; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turn = |o: [f32; 2], a: [f32; 2], b: [f32; 2]| (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
    let mut outline: Vec<[f32; 2]> = Vec::with_capacity(points.len() + 1);
    for pass in 0..2 {
        let base = outline.len();
        let walk: Box<dyn Iterator<Item = &[f32; 2]>> =
            if pass == 0 { Box::new(points.iter()) } else { Box::new(points.iter().rev()) };
        for &point in walk {
            while outline.len() >= base + 2
                && turn(outline[outline.len() - 2], outline[outline.len() - 1], point) <= 0.0
            {
                outline.pop();
            }
            outline.push(point);
        }
        outline.pop();
    }
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_hit_where_geometry_says() {
        let solid = Solid::standing_box(Vector::new(0.2, 0.1, 0.3));
        assert!((solid.volume() - 0.006).abs() < 1e-6);
        assert_eq!(solid.parts[0].planes.len(), 6);
        let hit = solid.parts[0].ray_enter(Point::new(0.0, -1.0, 0.1), Vector::y(), 10.0).expect("hit");
        assert!((hit - 0.95).abs() < 1e-5);
        assert!(solid.parts[0].ray_enter(Point::new(0.0, -1.0, 0.31), Vector::y(), 10.0).is_none());
        assert!(solid.parts[0].ray_enter(Point::new(0.0, -1.0, 0.1), Vector::y(), 0.9).is_none());
        assert!(solid.contains(Point::new(0.0, 0.0, 0.29)) && !solid.contains(Point::new(0.11, 0.0, 0.1)));
        assert_eq!(solid.footprint().len(), 4);
    }

    #[test]
    fn flat_points_make_no_part() {
        let flat = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]| Point::new(x, y, 0.0));
        assert!(ConvexPart::hull(&flat).is_none());
    }

    #[test]
    fn only_edges_that_bend_are_drawn() {
        let cube = Solid::standing_box(Vector::new(0.2, 0.1, 0.3));
        assert_eq!(cube.parts[0].creases(0.5).len(), 12, "of a box its twelve edges, and no diagonal");
        let turn = |i: usize| i as f32 * std::f32::consts::TAU / 24.0;
        let ring = |z: f32| (0..24).map(move |i| Point::new(turn(i).cos(), turn(i).sin(), z));
        let can = ConvexPart::hull(&ring(0.0).chain(ring(2.0)).collect::<Vec<_>>()).expect("a can");
        assert_eq!(can.creases(0.5).len(), 48, "of a can its two rims");
    }
}
