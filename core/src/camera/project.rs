//! Projection of a frame into the grid: free voxels that rays pass, occupied voxels that they hit, and labels from
//! above.
//!
//! Three rules decide where observations contradict each other:
//!
//! * A voxel with a hit is occupied, even where other rays pass through it (an edge crosses it).
//! * A hit on board, walls, back or ceiling is never occupied. Pixels labelled background are such hits; so are those of
//!   any label that lie within a millimetre of a shelf surface or outside the grid. Pixels without a label are taken for the
//!   shelf's within a centimetre of it; further away they are a surface of no class.
//! * Column closure fills unobserved voxels only: above a free voxel free, below an occupied one occupied, up or down
//!   to the first observation that contradicts it. An unobserved voxel between a free one below and an occupied one
//!   above is claimed by both and stays unobserved.

mod walk;

use super::{Frame, MapObservation, UNLABELLED, UNOBSERVED};
use crate::Point;
use crate::grid::{Grid, VoxelSet};
use crate::scene::{BACKGROUND, Shelf};
use rayon::prelude::*;
use walk::{LANES, SeenThrough, Segment};

/// How far behind its depth a hit is looked up, metres: a face on a voxel boundary belongs to the voxel behind it.
const NUDGE_M: f32 = 1e-4;
/// A hit this near a shelf surface is the shelf's, whatever its label, metres.
const SHELF_M: f32 = 1e-3;
/// A background hit this near the board, and nearer to it than to back and walls, labels its cell as background, and a hit
/// without a label is the shelf's this near to it, metres; the noise of a depth camera at a metre is a few millimetres.
const BOARD_M: f32 = 0.01;

/// What some of the image's rows say.
struct Partial {
    free: SeenThrough,
    /// Voxels with a hit, in no order, with repetitions.
    occupied: Vec<usize>,
    /// Highest labelled point per cell, metres, and its class.
    tops: Vec<(f32, u8)>,
}

impl Partial {
    fn empty(grid: &Grid) -> Self {
        Self {
            free: SeenThrough::nothing(grid),
            occupied: Vec::new(),
            tops: vec![(f32::NEG_INFINITY, UNOBSERVED); grid.cell_count()],
        }
    }

    fn label(&mut self, cell: usize, height_m: f32, class: u8) {
        let top = &mut self.tops[cell];
        // The smaller class wins a tie, so that the order of rows does not matter.
        if height_m > top.0 || (height_m == top.0 && class < top.1) {
            *top = (height_m, class);
        }
    }

    fn merge(mut self, other: &Self) -> Self {
        self.free.union_with(&other.free);
        self.occupied.extend(&other.occupied);
        for (cell, &(height_m, class)) in other.tops.iter().enumerate() {
            self.label(cell, height_m, class);
        }
        self
    }
}

/// Projects a frame into the shelf's grid.
///
/// Free are all voxels that a ray crosses before its hit minus half a voxel; pixels without depth say nothing. No voxel
/// is both free and occupied. The result does not depend on the number of threads.
pub fn project(frame: &Frame, shelf: &Shelf) -> MapObservation {
    let grid = shelf.grid();
    let height = frame.size()[1];
    let labels = frame.labels();
    let rows = height.div_ceil(rayon::current_num_threads() * 2).max(1);
    let whole = (0..height.div_ceil(rows))
        .into_par_iter()
        .map(|task| project_rows(frame, &labels, shelf, task * rows..((task + 1) * rows).min(height)))
        .reduce_with(|a, b| a.merge(&b))
        .unwrap_or_else(|| Partial::empty(&grid));
    let (mut free, mut occupied) = (VoxelSet::empty(&grid), VoxelSet::empty(&grid));
    let mut column = vec![Voxel::Unobserved; grid.dims[2]];
    let mut hits = VoxelSet::empty(&grid);
    whole.occupied.iter().for_each(|&at| hits.insert(at));
    for cell in 0..grid.cell_count() {
        let first = grid.column(cell).start;
        for (z, (voxel, &free)) in column.iter_mut().zip(whole.free.column(cell)).enumerate() {
            *voxel = if hits.contains(first + z) {
                Voxel::Occupied
            } else if free != 0 {
                Voxel::Free
            } else {
                Voxel::Unobserved
            };
        }
        if shelf.column_closure {
            close_column(&mut column);
        }
        for (z, voxel) in column.iter().enumerate() {
            match voxel {
                Voxel::Free => free.insert(first + z),
                Voxel::Occupied => occupied.insert(first + z),
                Voxel::Unobserved => {}
            }
        }
    }
    MapObservation { free, occupied, labels: whole.tops.into_iter().map(|(_, class)| class).collect() }
}

/// What an observation says of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Voxel {
    Unobserved,
    Free,
    Occupied,
}

fn project_rows(frame: &Frame, labels: &[u8], shelf: &Shelf, rows: std::ops::Range<usize>) -> Partial {
    let grid = shelf.grid();
    let mut partial = Partial::empty(&grid);
    let (from, width) = (frame.position(), frame.size()[0]);
    let (intrinsics, depth_m) = (frame.intrinsics(), frame.depth_m());
    let axes = frame.world_from_camera().rotation.to_rotation_matrix();
    for row in rows {
        for columns in (0..width).step_by(LANES) {
            let mut segments = [Segment::NOTHING; LANES];
            for (segment, column) in segments.iter_mut().zip(columns..width) {
                let at = row * width + column;
                let hit = Hit { depth_m: depth_m[at], class: labels[at] };
                if hit.depth_m > 0.0 {
                    let ray = axes * intrinsics.ray(column, row);
                    let stretch = ray.norm();
                    *segment = Segment { ray, end: hit.depth_m - 0.5 * grid.voxel_m / stretch };
                    add_hit(&mut partial, &grid, shelf, from + ray * (hit.depth_m + NUDGE_M / stretch), hit.class);
                }
            }
            partial.free.add(&grid, from, &segments);
        }
    }
    partial
}

/// What one pixel says.
#[derive(Clone, Copy)]
struct Hit {
    depth_m: f32,
    class: u8,
}

fn add_hit(partial: &mut Partial, grid: &Grid, shelf: &Shelf, point: Point, class: u8) {
    let Some(cell) = grid.cell_at(point) else { return };
    let (to_board, to_others) = shelf_distances(shelf, point);
    let cell = grid.cell_index(cell);
    if class == BACKGROUND.0 {
        if to_board.abs() < BOARD_M && to_board.abs() <= to_others {
            partial.label(cell, 0.0, BACKGROUND.0);
        }
        return;
    }
    let margin_m = if class == UNLABELLED { BOARD_M } else { SHELF_M };
    if to_board.min(to_others) > margin_m
        && let Some(voxel) = grid.voxel_at(point)
    {
        partial.occupied.push(grid.index(voxel));
        if class != UNLABELLED {
            partial.label(cell, point.z, class);
        }
    }
}

/// Height above the board, and distance to the nearest of back, walls and ceiling; negative outside.
fn shelf_distances(shelf: &Shelf, point: Point) -> (f32, f32) {
    let (min, max) = (shelf.min(), shelf.max());
    let others = (max.y - point.y).min(point.x - min.x).min(max.x - point.x).min(max.z - point.z);
    (point.z - min.z, others)
}

/// Above a free voxel all is free, below an occupied one all is occupied, as far as nothing was observed there. What a
/// voxel says of its column ends where an observation contradicts it, and voxels of which two say different things
/// stay unobserved.
fn close_column(column: &mut [Voxel]) {
    let claimed = |claim: Voxel, seen: Voxel| if seen == Voxel::Unobserved { claim } else { seen };
    // Upwards only free voxels have something to say, downwards only occupied ones.
    let mut up = Voxel::Unobserved;
    let above: Vec<Voxel> = column
        .iter()
        .map(|&seen| {
            up = claimed(up, seen);
            up
        })
        .collect();
    let mut down = Voxel::Unobserved;
    for (voxel, above) in column.iter_mut().zip(above).rev() {
        down = claimed(down, *voxel);
        if *voxel == Voxel::Unobserved {
            *voxel = match (above == Voxel::Free, down == Voxel::Occupied) {
                (true, false) => Voxel::Free,
                (false, true) => Voxel::Occupied,
                _ => Voxel::Unobserved,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closure_of_hand_made_columns() {
        // Observed columns, from the board up: o occupied, f free, . unobserved; and what closure makes of them.
        let cases = [
            ("........", "........"),
            ("...f....", "...fffff"),
            ("....o...", "ooooo..."),
            ("..o..f..", "ooo..fff"),
            (".f...o..", ".f...o.."),
            (".o.f.o..", "oo.f.o.."),
            ("f......o", "f......o"),
        ];
        for (observed, closed) in cases {
            let voxel = |what| match what {
                'f' => Voxel::Free,
                'o' => Voxel::Occupied,
                _ => Voxel::Unobserved,
            };
            let mut column: Vec<Voxel> = observed.chars().map(voxel).collect();
            close_column(&mut column);
            assert_eq!(column, closed.chars().map(voxel).collect::<Vec<_>>(), "of {observed}");
        }
    }

    #[test]
    fn the_highest_labelled_point_names_the_cell() {
        let shelf = Shelf::new([0.8, 0.4, 0.4]);
        let grid = shelf.grid();
        let mut partial = Partial::empty(&grid);
        let from = Point::new(0.0, -0.2, 0.3);
        let mut look = |x: f32, y: f32, z: f32, class: u8| {
            let nudge = (Point::new(x, y, z) - from).normalize() * NUDGE_M;
            add_hit(&mut partial, &grid, &shelf, Point::new(x, y, z) + nudge, class);
        };
        look(0.0012, 0.2512, 0.1, 3);
        look(0.0012, 0.2512, 0.2, 5);
        look(0.0012, 0.2512, 0.0, 14);
        look(0.1012, 0.2512, 0.0, 14);
        // On the back wall, in mid-air with a background label, and an object's label on the wall: no label, no surface.
        look(0.2012, 0.4, 0.2, 14);
        look(0.2512, 0.3, 0.2, 14);
        look(0.3012, 0.3999, 0.2, 2);
        let label =
            |x: f32, y: f32| partial.tops[grid.cell_index(grid.cell_at(Point::new(x, y, 0.0)).expect("inside"))].1;
        assert_eq!([label(0.0012, 0.2512), label(0.1012, 0.2512)], [5, 14]);
        assert_eq!([label(0.2012, 0.3975), label(0.2512, 0.3), label(0.3012, 0.3975)], [UNOBSERVED; 3]);
        let surface = |z| grid.index(grid.voxel_at(Point::new(0.0012, 0.2512, z)).expect("inside"));
        assert_eq!(partial.occupied.len(), 2);
        assert!(partial.occupied.contains(&surface(0.0999)) && partial.occupied.contains(&surface(0.1999)));
    }
}
