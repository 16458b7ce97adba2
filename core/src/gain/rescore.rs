//! Gains under many predictions that differ from one field in a window each.

use super::field::GainField;
use super::layout::VoxelBox;
use super::ray::{Camera, Ray, Tally};
use super::{RayDensity, fixed, nats, ray_gain};
use crate::belief::Prediction;
use crate::camera::{ViewArray, ViewId};
use rayon::prelude::*;

/// The gain of every ray of some views under one field, so that under a prediction only those rays are walked again
/// that can meet a changed voxel. The results are those of the full computation, bit for bit.
pub struct RayGains {
    field: GainField,
    density: RayDensity,
    views: Vec<ViewRays>,
}

struct ViewRays {
    camera: Camera,
    /// Sum over the rays, in units of 2^-24 nats.
    sum: i64,
    /// Gain by ray number, in the same units; 0 for rays that do not enter the shelf.
    gains: Vec<i32>,
    /// What the ray crossed, by ray number.
    reached: Vec<Reached>,
}

/// The smallest box of voxels that holds a ray from its entry to its end. A ray is monotone, so it is the box of the
/// two.
#[derive(Clone, Copy)]
pub(super) struct Reached {
    pub(super) min: [u16; 3],
    pub(super) max: [u16; 3],
}

impl Reached {
    /// A ray that does not enter.
    pub(super) const NOTHING: Self = Self { min: [u16::MAX; 3], max: [0; 3] };

    #[inline(always)]
    pub(super) fn touches(&self, changed: &Self) -> bool {
        (0..3).all(|axis| self.min[axis] <= changed.max[axis] && changed.min[axis] <= self.max[axis])
    }
}

impl RayGains {
    /// Walks all rays of the given views.
    pub fn new(field: &GainField, array: &ViewArray, ids: &[ViewId], density: RayDensity) -> Self {
        let views = ids.par_iter().map(|&id| ViewRays::walk(field, Camera::of(field, array, id), density)).collect();
        Self { field: field.clone(), density, views }
    }

    /// Gain of every view, nats, in the order of the ids; as [`super::gain_of_views`].
    pub fn gains(&self) -> Vec<f32> {
        self.views.iter().map(|view| nats(view.sum)).collect()
    }

    /// Gain of every view under the field [with a prediction](GainField::with_prediction).
    pub fn under(&self, prediction: &Prediction) -> Vec<f32> {
        let (field, changed) = self.field.patched(prediction);
        let Some(VoxelBox { min, max }) = changed else { return self.gains() };
        let changed = Reached { min: min.map(|at| at as u16), max: max.map(|at| at as u16) };
        self.views.iter().map(|view| nats(view.sum_under(&field, &changed, self.density))).collect()
    }
}

impl ViewRays {
    fn walk(field: &GainField, camera: Camera, density: RayDensity) -> Self {
        let [across, down] = camera.rays(density);
        let mut gains = vec![0; across * down];
        let mut reached = vec![Reached::NOTHING; across * down];
        camera.for_each_ray(field, density, |number, ray| {
            let mut tally = GainAndEnd { field, nats: 0.0, last: 0 };
            ray.walk(field, &mut tally);
            gains[number] = fixed(tally.nats);
            if let Some(entering) = camera.ray(field, density, [number / down, number % down]) {
                reached[number] = Reached::between(field, &entering, tally.last);
            }
        });
        Self { camera, sum: gains.iter().map(|&gain| i64::from(gain)).sum(), gains, reached }
    }

    fn sum_under(&self, field: &GainField, changed: &Reached, density: RayDensity) -> i64 {
        let mut sum = self.sum;
        self.camera.for_rays(
            field,
            density,
            |number| self.reached[number].touches(changed),
            |number, ray| sum = sum + i64::from(ray_gain(field, ray)) - i64::from(self.gains[number]),
        );
        sum
    }
}

/// A ray's gain, summed as everywhere, and where it ended.
struct GainAndEnd<'a> {
    field: &'a GainField,
    nats: f32,
    last: usize,
}

impl Tally for GainAndEnd<'_> {
    #[inline(always)]
    fn visit(&mut self, index: usize, information: f32, transmittance: f32) {
        self.nats += self.field.unseen_share(index, transmittance) * information;
        self.last = index;
    }
}

impl Reached {
    /// The box from a ray's entry to the padded position of its last voxel, which may lie in the border.
    pub(super) fn between(field: &GainField, entering: &Ray, last: usize) -> Self {
        let layout = &field.layout;
        let [width, depth, height] = layout.grid.dims;
        let [plane, line, _] = layout.stride;
        let coordinates = |padded: usize| {
            let at = padded.saturating_sub(line);
            [at / plane, at % plane / line, at % line]
        };
        let [mut x, mut y, mut z] = coordinates(last);
        if z == height {
            // A line's border voxel lies above it and below the next one.
            if entering.descends() {
                [x, y, z] = coordinates(last + 1);
            } else {
                z -= 1;
            }
        }
        let end = [x.clamp(1, width) - 1, y.min(depth - 1), z];
        let [x, y, z] = coordinates(entering.voxel());
        let start = [x - 1, y, z];
        let along = |pick: fn(usize, usize) -> usize| std::array::from_fn(|axis| pick(start[axis], end[axis]) as u16);
        Self { min: along(usize::min), max: along(usize::max) }
    }
}
