//! Balls that cover a convex part: what distance queries are asked with.

use crate::Point;
use crate::solid::{Bounds, ConvexPart};

/// How far the balls along a rod stick out of its side, metres.
const OVERSHOOT_M: f32 = 0.004;
/// How far balls may stick out of a flat end, metres.
const END_OVERSHOOT_M: f32 = 0.010;
/// Smallest and largest edge of the cells that cover a part that is not a rod, metres; between them it is half of the
/// part's thickness.
const CELL_M: [f32; 2] = [0.0175, 0.03];
/// Most cells along an edge.
const MOST_ALONG: usize = 16;

/// A ball in the frame of its body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre, metres.
    pub center: nalgebra::Point3<f64>,
    /// Radius, metres.
    pub radius_m: f64,
}

impl Ball {
    /// A ball around others, about the middle of their box.
    pub(super) fn around(balls: &[Ball]) -> Self {
        let points = balls.iter().map(|ball| ball.center.map(|v| v as f32));
        let center =
            Bounds::around(points).map_or_else(Point::origin, |b| nalgebra::center(&b.min, &b.max)).map(f64::from);
        let radius_m = balls.iter().map(|b| (b.center - center).norm() + b.radius_m).fold(0.0, f64::max);
        Self { center, radius_m }
    }
}

/// Balls that cover a part: one row along a rod and many small ones at its flat ends, a grid through everything
/// else.
pub(super) fn cover(part: &ConvexPart) -> Vec<Ball> {
    let Some(bounds) = Bounds::around(part.vertices.iter().copied()) else { return Vec::new() };
    let size = bounds.size();
    if let Some(rod) = rod(part, &bounds) {
        let step = 2.0 * side(rod.radius_m, OVERSHOOT_M);
        let end = (rod.radius_m + OVERSHOOT_M - 0.5 * step - END_OVERSHOOT_M).max(0.0);
        if size[rod.axis] > 2.0 * end + 0.5 * step {
            let slab = |from: f32, to: f32| {
                let mut slab = bounds;
                slab.min[rod.axis] = from;
                slab.max[rod.axis] = to;
                slab
            };
            let (low, high) = (bounds.min[rod.axis], bounds.max[rod.axis]);
            let mut along = [f32::INFINITY; 3];
            along[rod.axis] = step;
            let mut balls = balls_in(part, &slab(low + end, high - end), along);
            if end > 0.0 {
                let mut cell = [2.0 * side(0.5 * end, END_OVERSHOOT_M) / 2.0_f32.sqrt(); 3];
                cell[rod.axis] = f32::INFINITY;
                balls.extend(balls_in(part, &slab(low, low + end), cell));
                balls.extend(balls_in(part, &slab(high - end, high), cell));
            }
            return balls;
        }
    }
    let [finest, coarsest] = CELL_M;
    balls_in(part, &bounds, [(0.5 * size.min()).clamp(finest, coarsest); 3])
}

/// A part with a round section: the axis along which it is long, and the section's radius.
struct Rod {
    axis: usize,
    radius_m: f32,
}

fn rod(part: &ConvexPart, bounds: &Bounds) -> Option<Rod> {
    let (size, center) = (bounds.size(), nalgebra::center(&bounds.min, &bounds.max));
    (0..3).find_map(|axis| {
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let radius_m = part.vertices.iter().map(|v| (v[a] - center[a]).hypot(v[b] - center[b])).fold(0.0, f32::max);
        (radius_m < 0.55 * size[a].min(size[b])).then_some(Rod { axis, radius_m })
    })
}

/// Half the side of what a ball covers that sticks out of a thickness of twice `half_m` by `over_m`.
fn side(half_m: f32, over_m: f32) -> f32 {
    (2.0 * half_m * over_m + over_m * over_m).sqrt()
}

/// Balls around the cells of at most `cell` metres that a box is divided into.
fn balls_in(part: &ConvexPart, bounds: &Bounds, cell: [f32; 3]) -> Vec<Ball> {
    let size = bounds.size();
    let count = [0, 1, 2].map(|axis| ((size[axis] / cell[axis]).ceil() as usize).clamp(1, MOST_ALONG));
    let edge = [0, 1, 2].map(|axis| size[axis] / count[axis] as f32);
    let mut balls = Vec::new();
    for x in 0..count[0] {
        for y in 0..count[1] {
            for z in 0..count[2] {
                let at = [x, y, z];
                let low = Point::from([0, 1, 2].map(|a| bounds.min[a] + edge[a] * at[a] as f32));
                let high = Point::from([0, 1, 2].map(|a| low[a] + edge[a]));
                balls.extend(ball_around(part, &Bounds { min: low, max: high }));
            }
        }
    }
    balls
}

/// The ball around what of the part lies in a cell: the cell cut by the part's faces, or nothing.
fn ball_around(part: &ConvexPart, cell: &Bounds) -> Option<Ball> {
    let corners: Vec<Point> = (0..8)
        .map(|i: usize| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { cell.max[axis] } else { cell.min[axis] };
            Point::new(pick(0), pick(1), pick(2))
        })
        .collect();
    let mut polygons = box_faces(&corners);
    for plane in &part.planes {
        polygons = cut(polygons, plane.normal, plane.offset + 1e-6);
    }
    // Corners of the piece lie on a face of the cell, or they are corners of the part inside it.
    let inside = |p: &&Point| (0..3).all(|a| p[a] >= cell.min[a] - 1e-6 && p[a] <= cell.max[a] + 1e-6);
    let corners_inside = part.vertices.iter().filter(inside).copied();
    let points: Vec<Point> = polygons.into_iter().flatten().chain(corners_inside).collect();
    let bounds = Bounds::around(points.iter().copied())?;
    let center = nalgebra::center(&bounds.min, &bounds.max);
    let radius = points.iter().map(|p| (p - center).norm()).fold(0.0, f32::max);
    Some(Ball { center: center.map(f64::from), radius_m: f64::from(radius) })
}

fn box_faces(corners: &[Point]) -> Vec<Vec<Point>> {
    const FACES: [[usize; 4]; 6] = [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
    FACES.iter().map(|face| face.iter().map(|&i| corners[i]).collect()).collect()
}

/// A convex polyhedron's faces cut by a half-space. The new face is left out except for its corners, which the other
/// faces have.
fn cut(faces: Vec<Vec<Point>>, normal: crate::Vector, offset: f32) -> Vec<Vec<Point>> {
    let height = |p: &Point| normal.dot(&p.coords) - offset;
    let cut_face = |face: Vec<Point>| {
        let mut kept = Vec::with_capacity(face.len() + 1);
        for (at, p) in face.iter().enumerate() {
            let next = &face[(at + 1) % face.len()];
            let (a, b) = (height(p), height(next));
            if a <= 0.0 {
                kept.push(*p);
            }
            if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
                kept.push(p + (next - p) * (a / (a - b)));
            }
        }
        kept
    };
    faces.into_iter().map(cut_face).filter(|face| !face.is_empty()).collect()
}
