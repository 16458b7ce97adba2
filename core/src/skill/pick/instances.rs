//! Which part of a patch is one object, where several of one class stand side by side.
//!
//! A map does not show the seam between two boxes of one class that touch: they are one patch of the floor plan. How large an
//! object of that class is stands in the catalogue. A patch that covers at least one and a half such footprints is taken
//! to be several: its front, as far as that runs on without a step, is divided into as many equal widths as the footprint fits
//! best, whichever side it shows; its depth likewise. A turned object covers no more than its own footprint, and stays whole.

use crate::belief::{FloorPlan, OBJECT_RADIUS_M, Patch};
use crate::grid::Grid;
use crate::scene::{Catalog, ClassId, outline};
use std::ops::RangeInclusive;

/// Footprints from which on a patch is more than one object.
const SEVERAL: f32 = 1.5;
/// A front runs on where the next column's begins within so many rows.
const STEP_ROWS: usize = 2;

/// The object of which the floor cell at `from` is, as far as a pick would take it.
pub(super) fn object(plan: &FloorPlan, grid: &Grid, from: usize) -> Patch {
    let patch = plan.patch(from, OBJECT_RADIUS_M);
    let whole = plan.patch(from, f32::INFINITY);
    let footprint = patch.cells().iter().find_map(|cell| plan.class(*cell)).and_then(Footprint::of);
    let Some(footprint) = footprint else { return patch };
    let covered = whole.cells().iter().filter(|cell| plan.stands(**cell)).count() as f32 * grid.voxel_m.powi(2);
    if covered < SEVERAL * footprint.area_m2 {
        return patch;
    }
    Front::of(&whole, grid, from).and_then(|front| front.part(&footprint)).unwrap_or(patch)
}

/// What an object of a class covers of the board.
struct Footprint {
    sides_m: [f32; 2],
    area_m2: f32,
}

impl Footprint {
    fn of(class: ClassId) -> Option<Self> {
        let catalog = Catalog::standard();
        let corners = &catalog.classes.get(usize::from(class.0))?.footprint;
        let side = |axis: usize| {
            let along = || corners.iter().map(|corner| corner[axis]);
            along().fold(f32::MIN, f32::max) - along().fold(f32::MAX, f32::min)
        };
        Some(Self { sides_m: [side(0), side(1)], area_m2: outline::area(corners) })
    }
}

/// The front of a patch around a column, as far as it runs on without a step.
struct Front<'a> {
    patch: &'a Patch,
    grid: &'a Grid,
    /// The column from which it runs on.
    from: usize,
    columns: RangeInclusive<usize>,
    /// How many rows stand behind one another, in the middle column of all.
    rows: usize,
}

impl<'a> Front<'a> {
    fn of(patch: &'a Patch, grid: &'a Grid, from: usize) -> Option<Self> {
        let [width, depth, _] = grid.dims;
        let at = from / depth;
        let first = |x: usize| first_row(patch, depth, x);
        let runs_on =
            |x: usize, next: usize| first(x).zip(first(next)).is_some_and(|(a, b)| a.abs_diff(b) <= STEP_ROWS);
        first(at)?;
        let left = (1..=at).rev().take_while(|x| runs_on(*x, x - 1)).last().map_or(at, |x| x - 1);
        let right = (at..width - 1).take_while(|x| runs_on(*x, x + 1)).last().map_or(at, |x| x + 1);
        let behind = |x: usize| {
            let first = first(x).unwrap_or(depth);
            (first..depth).take_while(|y| patch.contains(x * depth + y)).count()
        };
        let mut rows: Vec<usize> = (left..=right).map(behind).collect();
        rows.sort_unstable();
        let rows = rows[rows.len() / 2];
        Some(Self { patch, grid, from: at, columns: left..=right, rows })
    }

    /// The part that one object of that footprint has.
    fn part(&self, footprint: &Footprint) -> Option<Patch> {
        let voxel_m = self.grid.voxel_m;
        let size_m = [self.columns.clone().count(), self.rows].map(|cells| cells as f32 * voxel_m);
        let [a, b] = footprint.sides_m;
        let fit = |sides_m: [f32; 2]| {
            let counts = [0, 1].map(|axis| (size_m[axis] / sides_m[axis]).round().max(1.0));
            let off_m: f32 = (0..2).map(|axis| (size_m[axis] - counts[axis] * sides_m[axis]).abs()).sum();
            (off_m, counts)
        };
        let (_, counts) = [fit([a, b]), fit([b, a])].into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let [width, rows] = [size_m[0] / counts[0], size_m[1] / counts[1]].map(|m| m / voxel_m);
        let first = *self.columns.start();
        let number = (((self.from - first) as f32 + 0.5) / width) as usize;
        let depth = self.grid.dims[1];
        let is_of = |cell: usize| {
            let (x, y) = (cell / depth, cell % depth);
            let in_columns = self.columns.contains(&x) && (((x - first) as f32 + 0.5) / width) as usize == number;
            let front = first_row(self.patch, depth, x).unwrap_or(depth);
            in_columns && ((y - front) as f32) < rows + 0.5
        };
        Some(self.patch.part(is_of))
    }
}

/// The first row of a patch in a column of a floor plan of so many rows.
fn first_row(patch: &Patch, depth: usize, x: usize) -> Option<usize> {
    (0..depth).find(|y| patch.contains(x * depth + y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;
    use crate::belief::{Belief, evidence};

    const CRACKER: usize = 5;

    /// The objects that are found from the front, left to right, as `[left, right, back]` in millimetres, of boxes
    /// `[x0, x1, y0, y1]` in metres of one class.
    fn found(boxes: &[[f32; 4]], class: usize) -> Vec<[i32; 3]> {
        let grid = Grid::for_shelf([0.80, 0.40, 0.10], 0.005);
        let mut belief = Belief::uniform(grid);
        belief.occupancy.fill(evidence(-3.0, 30.0));
        for cell in 0..grid.cell_count() {
            let at = grid.cell_center(grid.cell(cell));
            if boxes.iter().any(|[x0, x1, y0, y1]| (*x0..*x1).contains(&at.x) && (*y0..*y1).contains(&at.y)) {
                belief.occupancy[grid.column(cell)][..10].fill(evidence(3.0, 30.0));
                belief.semantics[cell][class] += 20.0;
            }
        }
        let plan = FloorPlan::new(&belief, 0.5);
        let depth = grid.dims[1];
        let mut objects: Vec<Patch> = Vec::new();
        for x in 0..grid.dims[0] {
            let first = (0..depth).map(|y| x * depth + y).find(|cell| plan.stands(*cell));
            if let Some(first) = first.filter(|cell| !objects.iter().any(|object| object.contains(*cell))) {
                objects.push(object(&plan, &grid, first));
            }
        }
        let mm = |m: f32| (m * 1e3).round() as i32;
        let bounds = |object: &Patch| {
            let points: Vec<Point> = object.cells().iter().map(|cell| grid.cell_center(grid.cell(*cell))).collect();
            let x = |pick: fn(f32, f32) -> f32, start| points.iter().map(|p| p.x).fold(start, pick);
            let back = points.iter().map(|p| p.y).fold(f32::MIN, f32::max);
            [mm(x(f32::min, f32::MAX) - 0.0025), mm(x(f32::max, f32::MIN) + 0.0025), mm(back + 0.0025)]
        };
        objects.iter().map(bounds).collect()
    }

    #[test]
    fn boxes_of_one_class_that_touch_are_told_apart_by_the_size_of_their_class() {
        let [w, d] = sides(CRACKER);
        // Three with their narrow sides to the front, and two broadside.
        let row = |count: usize, w: f32, d: f32| -> Vec<[f32; 4]> {
            (0..count).map(|i| [i as f32 * w - 0.15, (i + 1) as f32 * w - 0.15, 0.1, 0.1 + d]).collect()
        };
        let narrow = found(&row(3, d, w), CRACKER);
        assert_eq!(narrow.len(), 3, "{narrow:?}");
        assert!(narrow.iter().all(|[left, right, _]| (right - left - (d * 1e3) as i32).abs() <= 6), "{narrow:?}");
        let broad = found(&row(2, w, d), CRACKER);
        assert_eq!(broad.len(), 2, "{broad:?}");
        // One behind the other: the first alone.
        let files = found(&[[0.0, w, 0.1, 0.1 + d], [0.0, w, 0.1 + d, 0.1 + 2.0 * d]], CRACKER);
        assert_eq!(files.len(), 1);
        assert!((files[0][2] - ((0.1 + d) * 1e3) as i32).abs() <= 6, "{files:?}");
    }

    #[test]
    fn one_object_stays_whole_whichever_side_it_shows() {
        let [w, d] = sides(CRACKER);
        for [w, d] in [[w, d], [d, w], [1.1 * w, 1.1 * d]] {
            let one = found(&[[-0.05, w - 0.05, 0.1, 0.1 + d]], CRACKER);
            assert_eq!(one.len(), 1, "{one:?}");
        }
    }

    /// The longer and the shorter side of a class's footprint, metres.
    fn sides(class: usize) -> [f32; 2] {
        let [a, b] = Footprint::of(Catalog::standard().classes[class].id).expect("a class").sides_m;
        [a.max(b), a.min(b)]
    }
}
