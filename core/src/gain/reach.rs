//! What views really reach where the bodies are known, and what opens to them when the bodies stand elsewhere.
//!
//! A ray reaches the voxels on its way, the first one that a body fills included. This is the truth behind
//! [`super::Openings`], which says what a push is expected to open.

use super::RayDensity;
use super::field::GainField;
use super::ray::{Camera, Ray, Tally};
use crate::Point;
use crate::camera::{Intrinsics, View, ViewArray};
use crate::grid::{Grid, VoxelSet};
use crate::solid::Bounds;
use crate::world::TruthMap;
use rayon::prelude::*;
use std::ops::Range;

/// Nearer to the camera's plane than this, a corner of a box has no place in the image, metres.
const BEFORE_CAMERA_M: f32 = 1e-3;

/// Every so many-th view counts for what is shown of objects: neighbours see the same things.
const SHOWN_EVERY: usize = 4;

/// What all views of an array together reach of a true map.
pub struct TrueReach {
    /// Without skip levels, so that a ray visits every voxel on its way.
    field: GainField,
    array: ViewArray,
    density: RayDensity,
    /// Of each view's rays.
    views: Vec<ViewRays>,
    /// Per voxel of the padded grid, whether a ray reaches it.
    reached: Vec<bool>,
    /// Per voxel of the padded grid, how many rays of every [`SHOWN_EVERY`]-th view it stops.
    stopped: Vec<u32>,
}

/// The rays of a view that enter the shelf.
#[derive(Default)]
struct ViewRays {
    /// Each where it enters.
    rays: Vec<Ray>,
    /// Position in the padded grid of what stops it.
    stops: Vec<u32>,
    /// Its column and row among the view's rays.
    places: Vec<[u16; 2]>,
}

/// What all views reach once some bodies stand elsewhere.
pub struct ReachAfter {
    /// The voxels that a view reaches now and none reached before.
    pub opened: VoxelSet,
    field: GainField,
    stopped: Vec<u32>,
}

impl TrueReach {
    /// Walks all rays of all views. The result does not depend on the number of threads.
    ///
    /// # Panics
    /// If the grid has more than 2,000 voxels along an axis.
    pub fn new(grid: &Grid, truth: &TruthMap, array: &ViewArray, density: RayDensity) -> Self {
        let field = GainField::of_truth(grid, truth);
        let begin = || (Vec::new(), vec![false; field.codes.len()]);
        let walk = |(mut views, mut reached): (Vec<ViewRays>, Vec<bool>), view: &View| {
            let camera = Camera::of(&field, array, view.id);
            let down = camera.rays(density)[1];
            let mut seen = ViewRays::default();
            camera.for_each_ray(&field, density, |number, ray| {
                let mut tally = Reached { reached: &mut reached, stop: 0 };
                ray.walk(&field, &mut tally);
                seen.stops.push(tally.stop as u32);
                seen.places.push([(number / down) as u16, (number % down) as u16]);
                seen.rays.push(ray);
            });
            views.push(seen);
            (views, reached)
        };
        let join = |(mut views, mut reached): (Vec<ViewRays>, Vec<bool>), other: (Vec<ViewRays>, Vec<bool>)| {
            views.extend(other.0);
            reached.iter_mut().zip(other.1).for_each(|(reached, other)| *reached |= other);
            (views, reached)
        };
        let (views, reached) = array.views.par_iter().fold(begin, walk).reduce(begin, join);
        let mut stopped = vec![0; field.codes.len()];
        views.iter().step_by(SHOWN_EVERY).flat_map(|view| &view.stops).for_each(|stop| stopped[*stop as usize] += 1);
        Self { field, array: array.clone(), density, views, reached, stopped }
    }

    /// The voxels that a view reaches.
    pub fn reached(&self) -> VoxelSet {
        inside(&self.field, |index| self.reached[index])
    }

    /// How many voxels of each object a view reaches, of every fourth view of the array; `owners` says per voxel whose it is,
    /// as [`TruthMap::owners`].
    pub fn shown(&self, owners: &[u16], objects: usize) -> Vec<u32> {
        shown(&self.field, &self.stopped, owners, objects)
    }

    /// The voxels that a view reaches once the bodies stand as in `after`, a truth of the same grid, and that none reached
    /// before. Only rays whose stop has become free are walked: no other reaches anything new.
    pub fn opened(&self, after: &TruthMap) -> VoxelSet {
        self.after(after, &[]).opened
    }

    /// What views reach once the bodies stand as in `after`, a truth of the same grid; everything that is filled there and
    /// was not before is inside of one of the boxes `filled`. Only rays are walked whose stop has become free or, of views that
    /// count for what is shown, that may meet a box: all others end where they ended.
    pub fn after(&self, after: &TruthMap, filled: &[Bounds]) -> ReachAfter {
        let field = GainField::of_truth(self.field.grid(), after);
        let mut freed = vec![0_u64; field.codes.len().div_ceil(64)];
        for (at, (before, now)) in self.field.codes.iter().zip(&field.codes).enumerate() {
            if before > now {
                freed[at / 64] |= 1 << (at % 64);
            }
        }
        let mut reached = self.reached.clone();
        let mut stopped = self.stopped.clone();
        for (number, (view, seen)) in self.array.views.iter().zip(&self.views).enumerate() {
            let counts = number % SHOWN_EVERY == 0;
            let boxes = filled.iter().filter(|_| counts);
            let across: Vec<[Range<u16>; 2]> = boxes.map(|bounds| self.rays_through(view, bounds)).collect();
            let may_meet = |[column, row]: [u16; 2]| {
                across.iter().any(|[columns, rows]| columns.contains(&column) && rows.contains(&row))
            };
            for (at, (stop, place)) in seen.stops.iter().zip(&seen.places).enumerate() {
                let stop = *stop as usize;
                if freed[stop / 64] >> (stop % 64) & 1 == 1 || may_meet(*place) {
                    let mut tally = Reached { reached: &mut reached, stop: 0 };
                    seen.rays[at].walk(&field, &mut tally);
                    if counts {
                        stopped[stop] -= 1;
                        stopped[tally.stop] += 1;
                    }
                }
            }
        }
        let opened = inside(&field, |index| reached[index] && !self.reached[index]);
        ReachAfter { opened, field, stopped }
    }

    /// Columns and rows of a view's rays that may meet a voxel that touches a box.
    fn rays_through(&self, view: &View, bounds: &Bounds) -> [Range<u16>; 2] {
        let Intrinsics { width, height, focal_px, .. } = self.array.intrinsics;
        let margin_m = 1.5 * self.field.grid().voxel_m;
        let camera_from_world = view.world_from_camera.inverse();
        let center = self.array.intrinsics.principal_px();
        let count = self.density.rays([width, height]).map(|count| count as u16);
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for corner in 0..8 {
            let pick = |axis: usize| match corner >> axis & 1 {
                0 => bounds.min[axis] - margin_m,
                _ => bounds.max[axis] + margin_m,
            };
            let seen = camera_from_world * Point::new(pick(0), pick(1), pick(2));
            if seen.z < BEFORE_CAMERA_M {
                return [0..count[0], 0..count[1]];
            }
            for axis in 0..2 {
                let pixel = focal_px * seen[axis] / seen.z + center[axis];
                (low[axis], high[axis]) = (low[axis].min(pixel), high[axis].max(pixel));
            }
        }
        // Ray `n` is at pixel `(n + 0.5) stride`; one ray more to either side.
        let stride = self.density.stride_px as f32;
        std::array::from_fn(|axis| {
            let first = (low[axis] / stride - 1.5).clamp(0.0, f32::from(count[axis]));
            let end = (high[axis] / stride + 1.5).clamp(0.0, f32::from(count[axis]));
            first.floor() as u16..end.ceil() as u16
        })
    }
}

impl ReachAfter {
    /// How many voxels of each object a view reaches, as [`TrueReach::shown`].
    pub fn shown(&self, owners: &[u16], objects: usize) -> Vec<u32> {
        shown(&self.field, &self.stopped, owners, objects)
    }
}

/// Counts the voxels of each object that stop a ray.
fn shown(field: &GainField, stopped: &[u32], owners: &[u16], objects: usize) -> Vec<u32> {
    let grid = field.grid();
    let mut counts = vec![0; objects];
    for cell in 0..grid.cell_count() {
        let padded = field.layout.column(cell);
        for (level, owner) in owners[grid.column(cell)].iter().enumerate() {
            if let Some(count) = counts.get_mut(usize::from(*owner)) {
                *count += u32::from(stopped[padded + level] > 0);
            }
        }
    }
    counts
}

/// The voxels of the shelf whose position in the padded grid is one of those.
fn inside(field: &GainField, is_one: impl Fn(usize) -> bool) -> VoxelSet {
    let grid = field.grid();
    let mut set = VoxelSet::empty(grid);
    for cell in 0..grid.cell_count() {
        let padded = field.layout.column(cell);
        for (level, index) in grid.column(cell).enumerate() {
            if is_one(padded + level) {
                set.insert(index);
            }
        }
    }
    set
}

/// Voxels that rays reach, and what stopped the last ray.
struct Reached<'a> {
    reached: &'a mut [bool],
    stop: usize,
}

impl Tally for Reached<'_> {
    #[inline(always)]
    fn visit(&mut self, index: usize, _information: f32, transmittance: f32) {
        if transmittance > 0.0 {
            self.reached[index] = true;
            self.stop = index;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::support::{facing, looking, small_grid, standard};
    use super::*;
    use crate::rng::stream;
    use rand::Rng;

    const EVERY: RayDensity = RayDensity { stride_px: 1 };

    fn truth(grid: &Grid, filled: &[usize]) -> TruthMap {
        let mut occupancy = vec![0; grid.voxel_count()];
        filled.iter().for_each(|&voxel| occupancy[voxel] = 1);
        let cells = grid.cell_count();
        TruthMap { dims: grid.dims, occupancy, labels: vec![14; cells], objects: vec![u16::MAX; cells] }
    }

    #[test]
    fn what_stands_in_the_way_hides_what_is_behind_and_opens_it_when_it_goes() {
        // Six voxels of 0.1 m into the shelf, and a camera that looks straight into them.
        let grid = Grid::for_shelf([0.1, 0.6, 0.1], 0.1);
        let array = facing([0.0, -0.3, 0.05]);
        let reach = TrueReach::new(&grid, &truth(&grid, &[2]), &array, EVERY);
        let listed = |set: VoxelSet| set.iter().collect::<Vec<_>>();
        assert_eq!(listed(reach.reached()), [0, 1, 2]);
        assert_eq!(listed(reach.opened(&truth(&grid, &[]))), [3, 4, 5]);
        assert_eq!(
            listed(reach.opened(&truth(&grid, &[4]))),
            [3, 4],
            "what is met is reached, what is behind it is not"
        );
        assert!(reach.opened(&truth(&grid, &[2, 4])).is_empty());
        assert!(reach.opened(&truth(&grid, &[0])).is_empty(), "what comes in the way opens nothing");
    }

    #[test]
    fn walking_only_rays_that_go_on_leaves_nothing_out() {
        let grid = small_grid();
        let array = ViewArray { views: standard().views.into_iter().take(40).collect(), ..standard() };
        let density = RayDensity { stride_px: 24 };
        let random = |seed: u64| {
            let mut rng = stream(seed, "reach", 0);
            let blocks: Vec<usize> = (0..40).map(|_| rng.random_range(0..grid.voxel_count())).collect();
            // Each block with its neighbours up, so that something is hidden.
            let filled = blocks.iter().flat_map(|&at| at..(at + 12).min(grid.voxel_count())).collect::<Vec<_>>();
            truth(&grid, &filled)
        };
        let mut total = 0;
        for seed in 0..6 {
            let (before, after) = (random(seed), random(100 + seed));
            let reach = TrueReach::new(&grid, &before, &array, density);
            let mut expected = TrueReach::new(&grid, &after, &array, density).reached();
            expected.subtract(&reach.reached());
            assert!(reach.opened(&after) == expected);
            total += expected.len();
        }
        assert!(total > 100, "the test opens something: {total}");
    }

    #[test]
    fn what_shows_of_objects_afterwards_is_what_a_look_from_everywhere_says() {
        let grid = small_grid();
        let array = ViewArray { views: standard().views.into_iter().take(40).collect(), ..standard() };
        let density = RayDensity { stride_px: 24 };
        let [width, depth, height] = grid.dims;
        // Three upright blocks of voxels, of which the second moves.
        let block = |x: usize, y: usize| {
            let columns = (x..x + 4).flat_map(move |x| (y..y + 3).map(move |y| x * depth + y));
            columns.flat_map(move |cell| cell * height..cell * height + height / 2)
        };
        let put = |places: [[usize; 2]; 3]| {
            let mut owners = vec![u16::MAX; grid.voxel_count()];
            for (object, [x, y]) in places.into_iter().enumerate() {
                block(x, y).for_each(|voxel| owners[voxel] = object as u16);
            }
            let filled: Vec<usize> = (0..owners.len()).filter(|voxel| owners[*voxel] != u16::MAX).collect();
            (truth(&grid, &filled), owners)
        };
        let [far, middle] = [depth - 4, width / 2];
        let (before, owners) = put([[middle, far], [middle, 1], [2, far]]);
        let reach = TrueReach::new(&grid, &before, &array, density);
        let mut differ = 0;
        for [x, y] in [[2, 2], [middle + 3, 1], [middle, 5]] {
            let (after, now) = put([[middle, far], [x, y], [2, far]]);
            let corner = |x: usize, y: usize, z: usize| {
                Point::from(std::array::from_fn(|axis| grid.origin[axis] + [x, y, z][axis] as f32 * grid.voxel_m))
            };
            let filled = Bounds { min: corner(x, y, 0), max: corner(x + 4, y + 3, height / 2) };
            let quick = reach.after(&after, &[filled]);
            let fresh = TrueReach::new(&grid, &after, &array, density);
            assert_eq!(quick.shown(&now, 3), fresh.shown(&now, 3));
            differ += usize::from(quick.shown(&now, 3) != reach.shown(&owners, 3));
            assert!(quick.stopped == fresh.stopped && quick.opened == reach.opened(&after));
        }
        assert!(differ > 0, "a move shows more or less of something");
    }

    #[test]
    fn nothing_outside_the_shelf_is_reached() {
        let grid = small_grid();
        let reach = TrueReach::new(&grid, &truth(&grid, &[]), &looking([0.0, -0.3, 0.2], [0.0, 0.2, 0.2]), EVERY);
        let reached = reach.reached().len();
        assert!(reached > grid.voxel_count() / 2 && reached <= grid.voxel_count(), "{reached}");
    }
}
