//! Convex parts of closed surfaces.

use super::PartsFrom;
use super::topology::Component;
use crate::solid::ConvexPart;
use crate::{Point, Vector};
use parry3d::math::Vector as ParryVector;
use parry3d::transformation::vhacd::{VHACD, VHACDParameters};
use parry3d::transformation::voxelization::VoxelSet;
use std::f32::consts::PI;

/// Most corners of a convex part; a finer hull is simplified, at a loss below a hundredth of its size.
pub const MAX_PART_VERTICES: usize = 256;
/// A surface that fills at least this share of its convex hull is convex (scans have dents).
const CONVEX_SHARE: f64 = 0.98;
/// More surfaces than this are decomposed together instead of taken one by one.
const MAX_GIVEN_PARTS: usize = 64;
/// Most parts that a decomposition may have.
const MAX_DECOMPOSED_PARTS: u32 = 24;
/// Share of the volume that V-HACD may leave between a part and its hull.
const CONCAVITY: f32 = 0.03;
/// Parts below this volume, cubic metres, are crumbs of a decomposition (one cubic millimetre).
const CRUMB_M3: f32 = 1e-9;

/// The convex parts of a mesh.
pub struct Split {
    /// The parts.
    pub parts: Vec<ConvexPart>,
    /// How they were obtained.
    pub from: PartsFrom,
    /// How many of them were simplified.
    pub simplified: usize,
}

/// Takes convex surfaces as they are and decomposes the others.
pub fn convex_parts(surfaces: &[Component]) -> Split {
    let mut split = Split { parts: Vec::new(), from: PartsFrom::Given, simplified: 0 };
    if surfaces.len() > MAX_GIVEN_PARTS {
        let all = merged(surfaces);
        split.from = PartsFrom::Decomposed;
        for part in decompose(&all) {
            split.add(part);
        }
        return split;
    }
    let (mut given, mut decomposed) = (0, 0);
    for surface in surfaces {
        let Some(hull) = ConvexPart::hull(&surface.points) else { continue };
        if surface.volume() >= CONVEX_SHARE * f64::from(hull.volume()) {
            split.add(hull);
            given += 1;
        } else {
            for part in decompose(surface) {
                split.add(part);
            }
            decomposed += 1;
        }
    }
    split.from = match (given, decomposed) {
        (_, 0) => PartsFrom::Given,
        (0, _) => PartsFrom::Decomposed,
        _ => PartsFrom::Both,
    };
    split
}

impl Split {
    fn add(&mut self, part: ConvexPart) {
        if part.volume() < CRUMB_M3 {
            return;
        }
        if part.vertices.len() <= MAX_PART_VERTICES {
            self.parts.push(part);
        } else if let Some(simple) = simplified(&part) {
            self.simplified += 1;
            self.parts.push(simple);
        }
    }
}

fn merged(surfaces: &[Component]) -> Component {
    let mut all = Component::default();
    for surface in surfaces {
        let first = all.points.len() as u32;
        all.points.extend(&surface.points);
        all.triangles.extend(surface.triangles.iter().map(|triangle| triangle.map(|i| i + first)));
    }
    all
}

fn decompose(surface: &Component) -> Vec<ConvexPart> {
    let points: Vec<ParryVector> = surface.points.iter().map(|p| ParryVector::new(p.x, p.y, p.z)).collect();
    let parameters =
        VHACDParameters { concavity: CONCAVITY, max_convex_hulls: MAX_DECOMPOSED_PARTS, ..VHACDParameters::default() };
    let decomposition = VHACD::decompose(&parameters, &points, &surface.triangles, true);
    let part = |voxels: &VoxelSet| {
        // The surface itself, cut at the part's borders: voxels on the surface would stick out.
        let surface = voxels.compute_primitive_intersections(&points, &surface.triangles);
        let mut corners: Vec<Point> = surface.iter().map(|p| Point::new(p.x, p.y, p.z)).collect();
        // And the voxels inside: a part may have borders where no surface is near.
        let inside: Vec<Point> = voxels
            .voxels()
            .iter()
            .filter(|voxel| !voxel.is_on_surface)
            .map(|voxel| voxels.get_voxel_point(voxel))
            .map(|p| Point::new(p.x, p.y, p.z))
            .collect();
        let half = 0.5 * voxels.scale;
        corners.extend(directions().filter_map(|direction| {
            let outermost = outermost(&inside, &direction)?;
            Some(inside[outermost] + direction.map(|v| half.copysign(v)))
        }));
        ConvexPart::hull(&corners)
    };
    decomposition.voxel_parts().iter().filter_map(part).collect()
}

/// The hull of a part's outermost corners in evenly spread directions, so that the outer size stays.
fn simplified(part: &ConvexPart) -> Option<ConvexPart> {
    let mut corners: Vec<usize> = directions().filter_map(|direction| outermost(&part.vertices, &direction)).collect();
    corners.sort_unstable();
    corners.dedup();
    ConvexPart::hull(&corners.into_iter().map(|i| part.vertices[i]).collect::<Vec<_>>())
}

/// [`MAX_PART_VERTICES`] directions: a Fibonacci lattice on the sphere, and the axes.
fn directions() -> impl Iterator<Item = Vector> {
    let spread = MAX_PART_VERTICES - 6;
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    let on_sphere = (0..spread).map(move |i| {
        let z = 1.0 - 2.0 * (i as f32 + 0.5) / spread as f32;
        let (sin, cos) = (golden * i as f32).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        Vector::new(radius * cos, radius * sin, z)
    });
    let axes = (0..6).map(|i| Vector::ith(i / 2, if i % 2 == 0 { 1.0 } else { -1.0 }));
    on_sphere.chain(axes)
}

/// The point that reaches farthest along a direction.
fn outermost(points: &[Point], direction: &Vector) -> Option<usize> {
    let reach = |i: &usize| direction.dot(&points[*i].coords);
    (0..points.len()).max_by(|i, j| reach(i).total_cmp(&reach(j)))
}
