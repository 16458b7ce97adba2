//! What can be taken according to a belief: objects that stand first behind the entrance, and where a cup fits on each.

use super::room::Room;
use super::{Pick, PickPlace, instances};
use crate::Point;
use crate::belief::{Belief, FloorPlan, Patch};
use crate::grid::{Cell, Voxel, VoxelSet};
use crate::skill::{AVOIDED, Ground, LIKELY, Rejection};
use crate::world::STROKE_M;

/// Heights of the cup's middle above the board, metres.
const HEIGHTS_M: [f32; 2] = [0.03, 0.12];
/// Heights that are tried, from the middle of the object on, metres.
const TRIED_M: [f32; 5] = [0.0, 0.02, -0.02, 0.04, -0.04];
/// Rows before the first solid voxel in which the front may be.
const UNSURE_ROWS: usize = 2;
/// How far beside where it did not seal a cup is tried again, in radii.
const TRIED_APART: f32 = 1.0;
/// Largest tangent of the angle between a front and the entrance's plane: 30 degrees.
const STEEPEST: f32 = 0.577;
/// Occupancy probability above which nothing is set down in a voxel.
const SEEN_FREE: f32 = 0.3;
/// Occupancy probabilities between which nobody knows what is in a voxel.
const UNKNOWN: [f32; 2] = [0.1, 0.9];

/// An object with one way to take it.
pub(super) struct Offer {
    /// The pick; of an object without a face for the cup the one that would take it by its middle.
    pub pick: Pick,
    /// Where it touches.
    pub contact: Voxel,
    /// The object.
    pub target: Patch,
    /// What is against it before the arm is asked.
    pub against: Option<Rejection>,
}

/// A belief prepared for looking for what can be taken.
pub(super) struct Shelf<'a> {
    belief: &'a Belief,
    seen: Option<&'a VoxelSet>,
    /// Where a cup touched and did not seal.
    unsealed: &'a [[f32; 3]],
    plan: FloorPlan,
}

impl<'a> Shelf<'a> {
    pub(super) fn new(ground: &Ground<'a>) -> Self {
        let Ground { belief, seen, unsealed, .. } = *ground;
        Self { belief, seen, unsealed, plan: FloorPlan::new(belief, AVOIDED) }
    }

    /// The objects that stand first behind the entrance somewhere, from left to right.
    fn first_objects(&self) -> Vec<Patch> {
        let [width, depth, _] = self.belief.grid.dims;
        let mut objects: Vec<Patch> = Vec::new();
        for x in 0..width {
            let first = (x * depth..(x + 1) * depth).find(|cell| self.plan.stands(*cell));
            let Some(first) = first.filter(|cell| !objects.iter().any(|object| object.contains(*cell))) else {
                continue;
            };
            objects.push(instances::object(&self.plan, &self.belief.grid, first));
        }
        objects
    }

    /// Where the front of an object is expected at a column and level, in rows: its first solid voxel, less what is believed
    /// of the voxels right before it. The front lies within one of them, which is therefore less sure.
    fn front(&self, target: &Patch, x: usize, level: usize) -> Option<f32> {
        let grid = &self.belief.grid;
        let probability = |y: usize| self.belief.probability(grid.column(x * grid.dims[1] + y).start + level);
        let first = (0..grid.dims[1]).find(|y| target.contains(x * grid.dims[1] + y) && probability(*y) > AVOIDED)?;
        let before = (first.saturating_sub(UNSURE_ROWS)..first).map(probability).sum::<f32>();
        Some(first as f32 - before)
    }

    /// The place on an object's front where the cup fits that is nearest to its middle: where the cup touches, and the
    /// tangent of the front's turn away from the entrance.
    fn face(&self, room: &Room<'_>, target: &Patch, radius_m: f32) -> Option<(Voxel, Point, f32)> {
        let (grid, extent) = (&self.belief.grid, room.extent(target));
        let middle = 0.5 * (extent.x[0] + extent.x[1]) as f32;
        let mut columns: Vec<usize> = (extent.x[0]..=extent.x[1]).collect();
        columns.sort_by(|a, b| (*a as f32 - middle).abs().total_cmp(&(*b as f32 - middle).abs()));
        let top_m = extent.levels as f32 * grid.voxel_m;
        let fits = |z: &f32| *z - radius_m >= grid.voxel_m && *z + radius_m <= top_m - 0.5 * grid.voxel_m;
        let heights = TRIED_M.map(|by| (0.5 * top_m + by).clamp(HEIGHTS_M[0], HEIGHTS_M[1]));
        columns
            .iter()
            .find_map(|&x| heights.into_iter().filter(fits).find_map(|z| self.is_face(target, x, z, radius_m)))
    }

    fn is_face(&self, target: &Patch, x: usize, z_m: f32, radius_m: f32) -> Option<(Voxel, Point, f32)> {
        let grid = &self.belief.grid;
        let level = (z_m / grid.voxel_m) as usize;
        let radius = radius_m / grid.voxel_m;
        let reach = radius.ceil() as isize;
        // Rows of the front over the cup's circle.
        let mut rows: Vec<(f32, f32)> = Vec::new();
        for i in -reach..=reach {
            for k in -reach..=reach {
                if (i as f32).hypot(k as f32) > radius {
                    continue;
                }
                let (column, level) = (x.checked_add_signed(i)?, level.checked_add_signed(k)?);
                if column >= grid.dims[0] || level >= grid.dims[2] {
                    return None;
                }
                rows.push((i as f32, self.front(target, column, level)?));
            }
        }
        let Front { mean, slope, bulge } = Front::fit(&rows);
        let off = |(i, row): &(f32, f32)| row - mean - slope * i;
        let (least, most) = rows.iter().map(off).fold((f32::MAX, f32::MIN), |(a, b), off| (a.min(off), b.max(off)));
        let is_flat = (most - least) * grid.voxel_m <= STROKE_M + 0.5 * grid.voxel_m;
        let found = (is_flat && slope.abs() <= STEEPEST).then(|| {
            let at = grid.cell_center(Cell { x: x as u16, y: 0 });
            // Midway between what the rim meets first and last, so that it may err either way.
            let middle = mean + bulge * (0.5 * radius * radius - mean_square(&rows));
            let y = grid.origin[1] + middle * grid.voxel_m;
            let contact = Voxel { x: x as u16, y: mean.ceil() as u16, z: level as u16 };
            (contact, Point::new(at.x, y, grid.origin[2] + z_m), slope)
        });
        // Edges and seams run up a front: what did not seal at one height does not at another.
        let apart = |at: &[f32; 3], touch: &Point| (at[0] - touch.x).hypot(at[1] - touch.y);
        let is_new = |touch: &Point| self.unsealed.iter().all(|at| apart(at, touch) > TRIED_APART * radius_m);
        found.filter(|(_, touch, _)| is_new(touch))
    }

    /// What is asked of voxels, for `work`.
    fn with_room<T>(&self, work: impl FnOnce(&Room<'_>) -> T) -> T {
        let belief = self.belief;
        let is_seen = |voxel: usize| self.seen.is_some_and(|seen| seen.contains(voxel));
        let blocks = |voxel: usize| belief.probability(voxel) >= LIKELY;
        let is_taken = |voxel: usize| belief.probability(voxel) > SEEN_FREE;
        let is_unknown = |voxel: usize| {
            let p = belief.probability(voxel);
            (UNKNOWN[0]..=UNKNOWN[1]).contains(&p) && !is_seen(voxel)
        };
        work(&Room { grid: &belief.grid, blocks: &blocks, is_taken: &is_taken, is_unknown: &is_unknown })
    }
}

/// A front over the cup's circle: `row = mean + slope i + bulge (i^2 - mean of i^2)`, in cells; `i` is the column from the middle.
struct Front {
    mean: f32,
    slope: f32,
    bulge: f32,
}

impl Front {
    /// The least squares fit to pairs of column and row, the columns symmetric about 0. A front never bulges inwards.
    fn fit(rows: &[(f32, f32)]) -> Self {
        let of = |weight: &dyn Fn(f32) -> f32| {
            let sums = rows.iter().map(|(i, row)| (weight(*i) * row, weight(*i).powi(2)));
            let (product, square) = sums.fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
            if square > 0.0 { product / square } else { 0.0 }
        };
        let square = mean_square(rows);
        Self { mean: of(&|_| 1.0), slope: of(&|i| i), bulge: of(&|i| i * i - square).max(0.0) }
    }
}

fn mean_square(rows: &[(f32, f32)]) -> f32 {
    rows.iter().map(|(i, _)| i * i).sum::<f32>() / rows.len() as f32
}

/// Everything that can be taken, and what stands first but cannot, from left to right.
pub(super) fn offers(shelf: &Shelf<'_>, radius_m: f32, place: PickPlace) -> Vec<Offer> {
    shelf.with_room(|room| {
        let offers =
            shelf.first_objects().into_iter().flat_map(|target| offers_of(shelf, room, target, radius_m, place));
        offers.collect()
    })
}

fn offers_of(shelf: &Shelf<'_>, room: &Room<'_>, target: Patch, radius_m: f32, place: PickPlace) -> Vec<Offer> {
    let grid = &shelf.belief.grid;
    let face = shelf.face(room, &target, radius_m);
    let (contact, touch, slope) = face.unwrap_or_else(|| {
        let Cell { x, y } = grid.cell(target.cells()[0]);
        let level = (HEIGHTS_M[0] / grid.voxel_m) as u16;
        let at = Voxel { x, y, z: level };
        (at, grid.center(at), 0.0)
    });
    // A front that falls back to the right is met by a cup that is turned to the left.
    let direction_deg = 90.0 + slope.atan().to_degrees();
    let of = |place, against| Offer {
        pick: Pick { contact: touch.coords.into(), direction_deg, place, end: None },
        contact,
        target: target.clone(),
        against,
    };
    let against = match face {
        None => Some(Rejection::NoFace),
        Some(_) => room.way_out(&target).err(),
    };
    if against.is_some() {
        return vec![of(None, against)];
    }
    match place {
        PickPlace::Tray => vec![of(None, None)],
        PickPlace::Shelf => match room.places(&target) {
            places if places.is_empty() => vec![of(None, Some(Rejection::NoPlace))],
            places => places.into_iter().map(|place| of(Some(place), None)).collect(),
        },
    }
}
