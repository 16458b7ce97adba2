//! Finding the board in a recording: a plane below the camera, its front edge, and how far what stands on it reaches.
//!
//! 1. Points of up to [`FRAMES`] frames, and "up" as the mean of where the top of their images points.
//! 2. RANSAC (Fischler and Bolles 1981) for the plane with most points within [`NEAR_M`], far ones counting less, whose normal is up within
//!    [`TILT_DEG`] and that has the cameras above it; then least squares over its points.
//! 3. y is where the cameras look, along the plane. Of the plane the largest connected patch counts, in cells of [`CELL_M`]; if
//!    it fills a rectangle, the rectangle's sides are x and y, and its near side is the front edge.
//! 4. A patch that is larger than a shelf is a table: of it what carries objects counts, with a margin.

use super::read::depth;
use super::survey::{median, sparse_points};
use super::{Board, Recording};
use crate::rng::stream;
use crate::scene::{Shelf, outline};
use crate::{Error, Point, Pose, Result, Vector};
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Translation3, UnitQuaternion};
use rand::Rng;
use std::collections::{BTreeMap, BTreeSet};

/// Frames whose points are taken, spread over the recording.
const FRAMES: usize = 24;
/// Planes that are tried.
const TRIES: usize = 600;
/// Points against which every plane is tried.
const TRIED_ON: usize = 4000;
/// A point this near to a plane is of it, metres.
const NEAR_M: f32 = 0.008;
/// Points of the plane are refined with those within so many median distances, three standard deviations of normal noise, ...
const MADS: f32 = 3.0 * 1.4826;
/// ... and within the step of a depth image's numbers in any case, metres.
const STEP_M: f32 = 0.001;
/// From this distance on farther points count less, with the square, metres.
const REACH_M: f32 = 0.5;
/// How far a board's normal may be from up, degrees.
const TILT_DEG: f32 = 45.0;
/// Cells in which the plane's patch is told, metres.
const CELL_M: f32 = 0.01;
/// Sizes of boards that are taken whole, width and depth, metres.
const SHELF_M: [f32; 2] = [1.25, 0.65];
/// What is added around objects on a table, and above the highest, metres.
const MARGIN_M: [f32; 2] = [0.08, 0.05];
/// Heights of what is mapped, metres.
const HEIGHT_M: [f32; 2] = [0.30, 0.80];
/// A point this high above the board is of an object, metres.
const OBJECT_M: f32 = 0.02;

/// A plane `normal . p = offset`.
#[derive(Clone, Copy)]
struct Plane {
    normal: Vector,
    offset: f32,
}

impl Plane {
    fn distance(&self, point: &Point) -> f32 {
        self.normal.dot(&point.coords) - self.offset
    }
}

/// Finds the board. The result is the same for the same recording.
///
/// # Errors
/// [`Error::Input`] where no plane below the cameras has a twentieth of the points; those of reading images.
pub fn find_board(recording: &Recording) -> Result<Board> {
    let seen = Seen::of(recording)?;
    let fail = |words: &str| {
        Error::input(&recording.path, "", format!("no board found: {words}; give it as a pose with --board"))
    };
    let plane = seen.plane().ok_or_else(|| fail("no plane below the camera has a twentieth of what it shows"))?;
    let axes = seen.axes(&plane).ok_or_else(|| fail("the camera looks straight down"))?;
    seen.board(&plane, axes).ok_or_else(|| fail("the plane is smaller than a shelf's board"))
}

/// What a recording shows, sparsely.
struct Seen {
    points: Vec<Point>,
    up: Vector,
    forward: Vector,
    /// The mean of where the cameras were.
    from: Point,
}

impl Seen {
    fn of(recording: &Recording) -> Result<Self> {
        let step = recording.len().div_ceil(FRAMES);
        let mut seen =
            Self { points: Vec::new(), up: Vector::zeros(), forward: Vector::zeros(), from: Point::origin() };
        let mut count = 0;
        for entry in recording.entries.iter().step_by(step.max(1)) {
            let (Ok(pose), Ok(depth_m)) = (&entry.pose, depth(entry, &recording.settings)?) else { continue };
            seen.points.extend(sparse_points(&depth_m, &entry.camera, pose).into_iter().map(|(point, _)| point));
            seen.up -= pose.rotation * Vector::y();
            seen.forward += pose.rotation * Vector::z();
            seen.from += pose.translation.vector;
            count += 1;
        }
        if seen.points.len() < 100 {
            return Err(Error::input(&recording.path, "", "no board found: no frame has both a pose and depth"));
        }
        seen.from = Point::from(seen.from.coords / count as f32);
        Ok(seen)
    }

    fn plane(&self) -> Option<Plane> {
        let up = self.up.try_normalize(1e-6)?;
        let mut rng = stream(0, "find board", 0);
        let mut pick = || self.points[rng.random_range(0..self.points.len())];
        let sample: Vec<Point> = (0..TRIED_ON.min(self.points.len())).map(|_| pick()).collect();
        // The shelf is what the camera is held before: a floor behind it has more pixels, and is farther away.
        let weights: Vec<f32> = sample.iter().map(|p| (p - self.from).norm().max(REACH_M).powi(-2)).collect();
        let near = |plane: &Plane| -> f32 {
            sample
                .iter()
                .zip(&weights)
                .filter(|(p, _)| plane.distance(p).abs() < NEAR_M)
                .map(|(_, weight)| weight)
                .sum()
        };
        let mut best: Option<(f32, Plane)> = None;
        for _ in 0..TRIES {
            let [a, b, c] = [pick(), pick(), pick()];
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-5) else { continue };
            let normal = if normal.dot(&up) < 0.0 { -normal } else { normal };
            let plane = Plane { normal, offset: normal.dot(&a.coords) };
            if normal.dot(&up) < TILT_DEG.to_radians().cos() || plane.distance(&self.from) <= 0.0 {
                continue;
            }
            let weight = near(&plane);
            if best.as_ref().is_none_or(|(most, _)| weight > *most) {
                best = Some((weight, plane));
            }
        }
        let (_, mut plane) = best.filter(|(weight, _)| 20.0 * weight >= weights.iter().sum())?;
        for _ in 0..5 {
            // What stands on the board begins within a few millimetres of it, on one side: only the noise's own width counts.
            let off = |p: &Point| plane.distance(p).abs();
            let usual = median(self.points.iter().map(off).filter(|off| *off < NEAR_M).collect())?;
            let near_m = (MADS * usual).clamp(STEP_M, NEAR_M);
            let of: Vec<&Point> = self.points.iter().filter(|p| off(p) < near_m).collect();
            let mean = of.iter().fold(Vector::zeros(), |sum, p| sum + p.coords) / of.len() as f32;
            let spread =
                of.iter().fold(Matrix3::zeros(), |sum, p| sum + (p.coords - mean) * (p.coords - mean).transpose());
            let eigen = SymmetricEigen::new(spread);
            let normal: Vector = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
            let normal = if normal.dot(&up) < 0.0 { -normal } else { normal };
            plane = Plane { normal, offset: normal.dot(&mean) };
        }
        Some(plane)
    }

    /// The board's axes in the recording's frame: columns x, y, z. y is where the cameras look.
    fn axes(&self, plane: &Plane) -> Option<Rotation3<f32>> {
        let z = plane.normal;
        let y = (self.forward - z * z.dot(&self.forward)).try_normalize(1e-3)?;
        Some(Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[y.cross(&z), y, z])))
    }

    fn board(&self, plane: &Plane, axes: Rotation3<f32>) -> Option<Board> {
        let origin = Point::from(plane.normal * plane.offset);
        let patch = self.patch(&axes, origin);
        let axes = axes * Rotation3::from_axis_angle(&Vector::z_axis(), turn_of(&patch));
        let patch = self.patch(&axes, origin);
        let mut ranges = [0, 1].map(|axis| range_of(&patch, axis));
        let within = |local: &Point, ranges: &[[f32; 2]; 2]| {
            (0..2).all(|axis| (ranges[axis][0]..=ranges[axis][1]).contains(&local[axis]))
        };
        let local: Vec<Point> = self.points.iter().map(|p| axes.inverse() * (p - origin)).map(Point::from).collect();
        let mut standing: Vec<&Point> =
            local.iter().filter(|p| (OBJECT_M..HEIGHT_M[1]).contains(&p.z) && within(p, &ranges)).collect();
        if ranges[0][1] - ranges[0][0] > SHELF_M[0] || ranges[1][1] - ranges[1][0] > SHELF_M[1] {
            // A table: what carries objects, as far as the table goes.
            for (axis, range) in ranges.iter_mut().enumerate() {
                let mut along: Vec<f32> = standing.iter().map(|p| p[axis]).collect();
                along.sort_by(f32::total_cmp);
                let (Some(low), Some(high)) = (share(&along, 0.02), share(&along, 0.98)) else { return None };
                let middle = 0.5 * (low + high);
                let half = (0.5 * (high - low) + MARGIN_M[0]).min(0.5 * SHELF_M[axis]);
                *range = [range[0].max(middle - half), range[1].min(middle + half)];
            }
            standing.retain(|p| within(p, &ranges));
        }
        let [width, depth] = ranges.map(|[low, high]| ((high - low) / CELL_M).round() * CELL_M);
        if width < 0.1 || depth < 0.1 {
            return None;
        }
        let mut heights: Vec<f32> = standing.iter().map(|p| p.z).collect();
        heights.sort_by(f32::total_cmp);
        let top = share(&heights, 0.995).unwrap_or(0.0) + MARGIN_M[1];
        let height = ((top / 0.05).ceil() * 0.05).clamp(HEIGHT_M[0], HEIGHT_M[1]);
        let front = origin + axes * Vector::new(0.5 * (ranges[0][0] + ranges[0][1]), ranges[1][0], 0.0);
        let rounded = |m: f32| (m * 1000.0).round() / 1000.0;
        let recording_from_board =
            Pose::from_parts(Translation3::from(front), UnitQuaternion::from_rotation_matrix(&axes));
        Some(Board { shelf: Shelf::new([width, depth, height].map(rounded)), recording_from_board })
    }

    /// The cells of the largest connected patch of the plane.
    fn patch(&self, axes: &Rotation3<f32>, origin: Point) -> Vec<[i32; 2]> {
        let mut counts = BTreeMap::<[i32; 2], usize>::new();
        for point in &self.points {
            let local = axes.inverse() * (point - origin);
            if local.z.abs() < NEAR_M {
                *counts.entry([local.x, local.y].map(|m| (m / CELL_M).floor() as i32)).or_default() += 1;
            }
        }
        let mut left: BTreeSet<[i32; 2]> = counts.into_keys().collect();
        let mut largest = Vec::new();
        while let Some(start) = left.pop_first() {
            let mut patch = vec![start];
            let mut at = 0;
            while at < patch.len() {
                let [x, y] = patch[at];
                at += 1;
                // Objects hide strips of the board: a gap of two cells is none.
                for dx in -3..=3 {
                    for dy in -3..=3 {
                        if left.remove(&[x + dx, y + dy]) {
                            patch.push([x + dx, y + dy]);
                        }
                    }
                }
            }
            if patch.len() > largest.len() {
                largest = patch;
            }
        }
        largest
    }
}

/// How far the sides of a patch that fills a rectangle are turned against the axes, radians; 0 for one that fills none.
fn turn_of(patch: &[[i32; 2]]) -> f32 {
    let corners = hull(patch);
    let Some(rectangle) = outline::smallest_rectangle(&corners) else { return 0.0 };
    if outline::area(&corners) < 0.93 * rectangle.size_m[0] * rectangle.size_m[1] {
        return 0.0;
    }
    let quarter = rectangle.angle_deg.rem_euclid(90.0);
    (if quarter > 45.0 { quarter - 90.0 } else { quarter }).to_radians()
}

/// The convex hull of cells' centres, counter-clockwise (Andrew 1979), metres.
fn hull(patch: &[[i32; 2]]) -> Vec<[f32; 2]> {
    let mut cells = patch.to_vec();
    cells.sort_unstable();
    let half = |cells: &mut dyn Iterator<Item = &[i32; 2]>| {
        let mut chain: Vec<[i32; 2]> = Vec::new();
        for &[x, y] in cells {
            while let [.., [ax, ay], [bx, by]] = chain[..]
                && (bx - ax) * (y - ay) - (by - ay) * (x - ax) <= 0
            {
                chain.pop();
            }
            chain.push([x, y]);
        }
        chain.pop();
        chain
    };
    let lower = half(&mut cells.iter());
    let upper = half(&mut cells.iter().rev());
    lower.into_iter().chain(upper).map(|cell| cell.map(|n| (n as f32 + 0.5) * CELL_M)).collect()
}

/// From where to where a patch reaches along an axis, its outermost crumbs left out, metres.
fn range_of(patch: &[[i32; 2]], axis: usize) -> [f32; 2] {
    // A row of cells is of the board if it has a tenth of what rows have.
    let mut rows = BTreeMap::<i32, usize>::new();
    for cell in patch {
        *rows.entry(cell[axis]).or_default() += 1;
    }
    let mut sizes: Vec<usize> = rows.values().copied().collect();
    sizes.sort_unstable();
    let usual = sizes.get(sizes.len() / 2).copied().unwrap_or(0);
    let kept: Vec<i32> = rows.into_iter().filter(|(_, size)| 10 * size >= usual).map(|(row, _)| row).collect();
    let (low, high) = (kept.first().copied().unwrap_or(0), kept.last().copied().unwrap_or(0) + 1);
    [low as f32 * CELL_M, high as f32 * CELL_M]
}

/// The number below which a share of sorted ones lies.
fn share(sorted: &[f32], share: f32) -> Option<f32> {
    sorted.get(((sorted.len() as f32 * share) as usize).min(sorted.len().saturating_sub(1))).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_rectangle_says_by_how_much_and_a_triangle_nothing() {
        let (sin, cos) = 0.2_f32.sin_cos();
        let turned: BTreeSet<[i32; 2]> = (0..160)
            .flat_map(|x| (0..80).map(move |y| [0.5 * x as f32, 0.5 * y as f32]))
            .map(|[x, y]| [cos * x - sin * y, sin * x + cos * y].map(|n| n.floor() as i32))
            .collect();
        let turned: Vec<[i32; 2]> = turned.into_iter().collect();
        assert!((turn_of(&turned) - 0.2).abs() < 0.03, "{}", turn_of(&turned));
        let triangle: Vec<[i32; 2]> = (0..60).flat_map(|x| (0..=x).map(move |y| [x, y])).collect();
        assert_eq!(turn_of(&triangle), 0.0);
    }
}
