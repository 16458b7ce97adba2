//! Beliefs, views and a slow gain for the tests.

use super::super::RayDensity;
use crate::belief::Belief;
use crate::camera::{Intrinsics, View, ViewArray, ViewId};
use crate::grid::{Grid, Voxel};
use crate::rng::stream;
use crate::{Point, Pose, Vector};
use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use rand::Rng;

/// The design's shelf with voxels of 2 cm: 40 x 20 x 20.
pub fn small_grid() -> Grid {
    Grid::for_shelf([0.80, 0.40, 0.40], 0.02)
}

/// A belief of given probabilities.
pub fn exactly(grid: Grid, probability: impl Fn(Voxel) -> f32) -> Belief {
    let mut belief = Belief::uniform(grid);
    for (index, beta) in belief.occupancy.iter_mut().enumerate() {
        let p = probability(grid.voxel(index));
        *beta = [p, 1.0 - p];
    }
    belief
}

/// Free space with boxes of random probabilities in it, some transparent, some opaque, some noisy inside.
pub fn patchy(grid: Grid, seed: u64) -> Belief {
    let mut rng = stream(seed, "patchy", 0);
    let mut p = vec![0.02_f32; grid.voxel_count()];
    for _ in 0..25 {
        let min = grid.dims.map(|n| rng.random_range(0..n));
        let max = [0, 1, 2].map(|axis| (min[axis] + rng.random_range(1..8)).min(grid.dims[axis]));
        let base = [0.02, 0.5, 0.97, rng.random_range(0.0..1.0)][rng.random_range(0..4)];
        let noise = if rng.random::<bool>() { 0.3 } else { 0.0 };
        for x in min[0]..max[0] {
            for y in min[1]..max[1] {
                for z in min[2]..max[2] {
                    let p = &mut p[(x * grid.dims[1] + y) * grid.dims[2] + z];
                    *p = (base + noise * rng.random_range(-1.0..1.0_f32)).clamp(0.01, 0.99);
                }
            }
        }
    }
    exactly(grid, |voxel| p[grid.index(voxel)])
}

fn look_at(position: [f32; 3], target: [f32; 3]) -> Pose {
    let forward = (Point::from(target) - Point::from(position)).normalize();
    let right = forward.cross(&Vector::z()).normalize();
    let axes = Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
    Pose::from_parts(Translation3::from(Vector::from(position)), UnitQuaternion::from_rotation_matrix(&axes))
}

fn array(size: [usize; 2], poses: Vec<([f32; 3], [f32; 3])>) -> ViewArray {
    let views = poses.into_iter().enumerate().map(|(id, (position, target))| View {
        id: ViewId(id as u16),
        world_from_camera: look_at(position, target),
        target,
        slot: [0; 3],
    });
    let [width, height] = size;
    let intrinsics = Intrinsics { width, height, focal_px: 433.0, depth_range_m: [0.07, 1.5] };
    ViewArray { name: "test".to_owned(), intrinsics, layout: [0; 3], views: views.collect() }
}

/// A camera of one pixel that looks straight into the shelf.
pub fn facing(position: [f32; 3]) -> ViewArray {
    array([1, 1], vec![(position, [position[0], position[1] + 1.0, position[2]])])
}

/// One view of 640 x 480.
pub fn looking(position: [f32; 3], target: [f32; 3]) -> ViewArray {
    array([640, 480], vec![(position, target)])
}

/// The design's 300 views.
pub fn standard() -> ViewArray {
    let mut poses = Vec::new();
    for i in 0..10 {
        for j in 0..10 {
            let (u, v) = (i as f32 / 9.0, j as f32 / 9.0);
            let bulge = (std::f32::consts::PI * u).sin() * (std::f32::consts::PI * v).sin();
            let position = [-0.3375 + 0.675 * u, -0.20 - 0.10 * bulge, 0.055 + 0.2 * v];
            poses.extend([-0.3, 0.0, 0.3].map(|x| (position, [x, 0.25, 0.155])));
        }
    }
    array([640, 480], poses)
}

/// The gain of a view by definition: exact probabilities and entropies, and voxels found between the sorted
/// crossings of all grid planes.
pub fn slow_gain(belief: &Belief, array: &ViewArray, view: ViewId, density: RayDensity) -> f64 {
    let camera = &array.intrinsics;
    let pose = array.views[usize::from(view.0)].world_from_camera;
    let centres = |pixels: usize| {
        let centre = move |i: usize| (i as f64 + 0.5) * density.stride_px as f64;
        (0..).map(centre).take_while(move |&at| at < pixels as f64)
    };
    let mut gain = 0.0;
    for u in centres(camera.width) {
        for v in centres(camera.height) {
            let focal = f64::from(camera.focal_px);
            let right = (u - camera.width as f64 / 2.0) / focal;
            let down = (v - camera.height as f64 / 2.0) / focal;
            let direction = pose.rotation.cast::<f64>() * nalgebra::Vector3::new(right, down, 1.0);
            gain += slow_ray(belief, pose.translation.vector.cast::<f64>(), direction);
        }
    }
    gain
}

fn slow_ray(belief: &Belief, from: nalgebra::Vector3<f64>, direction: nalgebra::Vector3<f64>) -> f64 {
    let grid = &belief.grid;
    let (min, edge) = (grid.origin.map(f64::from), f64::from(grid.voxel_m));
    let inside = |axis: usize, at: f64| at >= min[axis] && at < min[axis] + grid.dims[axis] as f64 * edge;
    let front = (min[1] - from.y) / direction.y;
    let entry = from + direction * front;
    if direction.y <= 0.0 || front < 0.0 || !inside(0, entry.x) || !inside(2, entry.z) {
        return 0.0;
    }
    let mut crossings = vec![front, front + 1e3];
    for axis in (0..3).filter(|&axis| direction[axis] != 0.0) {
        crossings.extend((0..=grid.dims[axis]).map(|i| (min[axis] + i as f64 * edge - from[axis]) / direction[axis]));
    }
    crossings.retain(|&t| t >= front);
    crossings.sort_by(f64::total_cmp);
    let (mut gain, mut transmittance) = (0.0, 1.0);
    for pair in crossings.windows(2).filter(|pair| pair[1] - pair[0] > 1e-12) {
        let at = from + direction * (0.5 * (pair[0] + pair[1]));
        if (0..3).any(|axis| !inside(axis, at[axis])) {
            break;
        }
        let index = [0, 1, 2].map(|axis| ((at[axis] - min[axis]) / edge) as u16);
        let p = f64::from(belief.probability(grid.index(Voxel { x: index[0], y: index[1], z: index[2] })));
        if p > 0.95 {
            break;
        } else if p >= 0.05 {
            gain += transmittance * (-p * p.ln() - (1.0 - p) * (1.0 - p).ln());
            transmittance *= 1.0 - p;
        }
    }
    gain
}
