//! Walking a ray through the field, slab by slab.
//!
//! A slab is one layer of voxels across the ray's steepest axis. Within it the ray moves by at most one voxel along
//! the two other axes `u` and `w`, so it visits one, two or three voxels. Where it enters slab `n` is
//! `u_1 + (n - 1) du`, in fixed point and thus the same however the ray got there: jumps over transparent space never
//! change which other voxels are visited.

use super::code::{MATTER, Matter};
use super::field::GainField;
use super::skip::RADIUS_OF_CODE;
use super::{NEGLIGIBLE, RayDensity};
use crate::camera::{ViewArray, ViewId};

/// Bits behind the point.
const BITS: i32 = 20;
const ONE: i32 = 1 << BITS;
/// Rays that jump side by side.
const LANES: usize = 4;

/// A view in the field's voxel units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    size: [usize; 2],
    focal_px: f32,
    origin: [f32; 3],
    /// Directions of the image's right, the image's down, and the optical axis, by world axis.
    axes: [[f32; 3]; 3],
}

/// A ray inside the shelf.
#[derive(Clone, Copy, Default)]
pub(super) struct Ray {
    /// Padded position of the slab's voxel with `u = w = 0`.
    slab: i32,
    /// Padded distance to the next slab, and along u and w.
    stride: [i32; 3],
    /// Where the ray enters the slab, and where it leaves it, along u and w.
    enter: [i32; 2],
    leave: [i32; 2],
    /// How far it moves in a whole slab.
    slope: [i32; 2],
    /// Slabs that are surely within a free box of radius one, times 256.
    slabs_per_radius: u32,
}

/// What is done with the voxels that a ray visits.
pub(super) trait Tally {
    /// What the codes mean to the ray.
    fn matter(&self) -> &'static [Matter; 256] {
        &MATTER
    }

    /// A voxel at a padded position, its entropy in nats, and the transmittance with which the ray arrives.
    fn visit(&mut self, index: usize, information: f32, transmittance: f32);
}

impl Camera {
    pub(super) fn of(field: &GainField, array: &ViewArray, view: ViewId) -> Self {
        let pose = &array.views[usize::from(view.0)].world_from_camera;
        let rotation = pose.rotation.to_rotation_matrix();
        let grid = field.grid();
        Self {
            size: [array.intrinsics.width, array.intrinsics.height],
            focal_px: array.intrinsics.focal_px,
            origin: std::array::from_fn(|axis| (pose.translation.vector[axis] - grid.origin[axis]) / grid.voxel_m),
            axes: std::array::from_fn(|axis| std::array::from_fn(|world| rotation[(world, axis)])),
        }
    }

    /// Number of rays across and down.
    pub(super) fn rays(&self, density: RayDensity) -> [usize; 2] {
        density.rays(self.size)
    }

    /// Calls `each` with the number of every ray that enters the shelf, and with the ray at the end of the
    /// transparent space behind its entry. Rays are numbered down the image's columns, from the left one to the
    /// right: neighbours in a column share cache lines.
    #[inline(always)]
    pub(super) fn for_each_ray(&self, field: &GainField, density: RayDensity, each: impl FnMut(usize, Ray)) {
        self.for_rays(field, density, |_| true, each);
    }

    /// [`Camera::for_each_ray`] for the rays whose number is chosen.
    #[inline(always)]
    pub(super) fn for_rays(
        &self,
        field: &GainField,
        density: RayDensity,
        chosen: impl Fn(usize) -> bool,
        mut each: impl FnMut(usize, Ray),
    ) {
        let [across, down] = density.rays(self.size);
        let mut lanes = [Ray::default(); LANES];
        let mut numbers = [0; LANES];
        let mut filled = 0;
        for column in 0..across {
            for row in 0..down {
                let number = column * down + row;
                if !chosen(number) {
                    continue;
                }
                let Some(ray) = self.ray(field, density, [column, row]) else { continue };
                (lanes[filled], numbers[filled]) = (ray, number);
                filled += 1;
                if filled == LANES {
                    skip_ahead(field, &mut lanes);
                    for (number, ray) in numbers.iter().zip(&lanes) {
                        each(*number, *ray);
                    }
                    filled = 0;
                }
            }
        }
        for (number, ray) in numbers.iter().zip(&lanes).take(filled) {
            each(*number, *ray);
        }
    }

    /// The ray in a column and row of rays, if it enters the shelf through its open front.
    #[inline(always)]
    pub(super) fn ray(&self, field: &GainField, density: RayDensity, at: [usize; 2]) -> Option<Ray> {
        let image = |axis: usize| {
            let pixel = (at[axis] as f32 + 0.5) * density.stride_px as f32;
            (pixel - 0.5 * self.size[axis] as f32) / self.focal_px
        };
        let (right, down) = (image(0), image(1));
        let along = |axis: usize| self.axes[2][axis] + right * self.axes[0][axis] + down * self.axes[1][axis];
        let inwards = along(1);
        if !(self.origin[1] <= 0.0 && inwards > 1e-6) {
            return None;
        }
        let (dx, dz) = (along(0) / inwards, along(2) / inwards);
        let (x, z) = (self.origin[0] - self.origin[1] * dx, self.origin[2] - self.origin[1] * dz);
        let [width, _, height] = field.grid().dims;
        if !(x >= 0.0 && x < width as f32 && z >= 0.0 && z < height as f32) {
            return None;
        }
        let [sx, sy, sz] = field.layout.stride.map(|stride| stride as i32);
        let start = sx + sy;
        let (steep_x, steep_z) = (dx.abs(), dz.abs());
        if steep_x <= 1.0 && steep_z <= 1.0 {
            // Enters the first slab across y at its front.
            let slope = [fixed(dx), fixed(dz)];
            let enter = [fixed(x), fixed(z)];
            return Some(Ray {
                slab: start,
                stride: [sy, sx, sz],
                enter,
                leave: [enter[0] + slope[0], enter[1] + slope[1]],
                slope,
                // A little less than 256 / slope, so that rounding cannot lead out of the free box; boxes are twice
                // as deep as they are wide to either side.
                slabs_per_radius: ((255.9 / steep_x.max(steep_z).max(0.5)) as u32).max(256),
            });
        }
        // Enters somewhere in a slab across x or z.
        let (along, step, stride, offset, slopes) = if steep_x >= steep_z {
            (x, dx, [sx, sy, sz], [0.0, z], [1.0 / steep_x, dz / steep_x])
        } else {
            (z, dz, [sz, sx, sy], [x, 0.0], [dx / steep_z, 1.0 / steep_z])
        };
        let cell = along.floor();
        let rest = if step > 0.0 { cell + 1.0 - along } else { along - cell };
        let enter = offset.map(fixed);
        let leave = std::array::from_fn(|k| enter[k] + fixed(rest * slopes[k]));
        Some(Ray {
            slab: start + cell as i32 * stride[0],
            stride: [if step > 0.0 { stride[0] } else { -stride[0] }, stride[1], stride[2]],
            enter,
            leave,
            slope: slopes.map(fixed),
            slabs_per_radius: 256,
        })
    }
}

/// Voxels to fixed point.
#[inline(always)]
fn fixed(voxels: f32) -> i32 {
    (voxels * ONE as f32) as i32
}

impl Ray {
    /// Padded position of the voxel at which the ray enters its slab.
    #[inline(always)]
    pub(super) fn voxel(&self) -> usize {
        let [_, su, sw] = self.stride;
        (self.slab + (self.enter[0] >> BITS) * su + (self.enter[1] >> BITS) * sw) as usize
    }

    /// Whether the ray goes down.
    pub(super) fn descends(&self) -> bool {
        // Voxels above each other are neighbours in the padded grid.
        let [along, _, w] = self.stride;
        if w == 1 { self.slope[1] < 0 } else { along < 0 }
    }

    /// Slabs that are surely transparent ahead of a voxel of this code.
    #[inline(always)]
    fn clear_slabs(&self, code: u8) -> i32 {
        ((u32::from(RADIUS_OF_CODE[usize::from(code)]) * self.slabs_per_radius) >> 8) as i32
    }

    /// Moves on by `slabs`, at least one.
    #[inline(always)]
    fn advance(&mut self, slabs: i32) {
        self.slab += slabs * self.stride[0];
        for k in 0..2 {
            self.enter[k] = self.leave[k] + (slabs - 1) * self.slope[k];
            self.leave[k] = self.enter[k] + self.slope[k];
        }
    }

    /// Visits the voxels that are not in clear space, in order, until the ray is stopped or next to nothing is left.
    #[inline(always)]
    pub(super) fn walk(mut self, field: &GainField, tally: &mut impl Tally) {
        let codes = &field.codes[..];
        let matter = tally.matter();
        let mut transmittance = 1.0_f32;
        let mut visit = |index: usize, code: u8| {
            let Matter { information, pass } = matter[usize::from(code)];
            tally.visit(index, information, transmittance);
            transmittance *= pass;
            transmittance
        };
        let [_, su, sw] = self.stride;
        loop {
            let index = self.voxel();
            let code = codes[index];
            let clear = self.clear_slabs(code);
            if clear > 0 {
                self.advance(clear);
                continue;
            }
            let mut left = visit(index, code);
            let across = |k: usize| (self.leave[k] >> BITS) - (self.enter[k] >> BITS);
            let (eu, ew) = (across(0), across(1));
            if eu != 0 {
                if ew != 0 {
                    let between = if self.crosses_u_first(eu, ew) { eu * su } else { ew * sw };
                    let between = (index as i32 + between) as usize;
                    visit(between, codes[between]);
                }
                let last = (index as i32 + eu * su + ew * sw) as usize;
                left = visit(last, codes[last]);
            } else if ew != 0 {
                let last = (index as i32 + ew * sw) as usize;
                left = visit(last, codes[last]);
            }
            if left < NEGLIGIBLE {
                return;
            }
            self.advance(1);
        }
    }

    /// Which of two boundaries that are crossed in one slab comes first.
    #[cold]
    fn crosses_u_first(&self, eu: i32, ew: i32) -> bool {
        let to_boundary = |k: usize, step: i32| {
            let inside = self.enter[k] & (ONE - 1);
            i64::from(if step > 0 { ONE - inside } else { inside })
        };
        let moves = |k: usize| i64::from((self.leave[k] - self.enter[k]).abs());
        to_boundary(0, eu) * moves(1) <= to_boundary(1, ew) * moves(0)
    }
}

/// Moves rays to the end of the clear space that they are in. All of them take every turn, moved or not, so that no
/// branch depends on one of them and their look-ups overlap.
#[inline(always)]
fn skip_ahead(field: &GainField, rays: &mut [Ray; LANES]) {
    let codes = &field.codes[..];
    loop {
        let clear: [i32; LANES] = std::array::from_fn(|lane| rays[lane].clear_slabs(codes[rays[lane].voxel()]));
        if clear.iter().all(|&slabs| slabs == 0) {
            return;
        }
        for (ray, slabs) in rays.iter_mut().zip(clear) {
            let mut moved = *ray;
            moved.advance(slabs);
            let stays = slabs == 0;
            ray.slab = moved.slab;
            for k in 0..2 {
                ray.enter[k] = if stays { ray.enter[k] } else { moved.enter[k] };
                ray.leave[k] = if stays { ray.leave[k] } else { moved.leave[k] };
            }
        }
    }
}
