//! Where objects stand on the board according to a belief: floor cells, their labels, and the patch of one object.

use super::{Belief, beta_mean};
use crate::grid::Grid;
use crate::scene::{BACKGROUND, ClassId};
use rayon::prelude::*;
use std::collections::VecDeque;

/// What is known of a floor cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Footing {
    /// Nothing stands here.
    Empty,
    /// Something of unknown class (never labelled, or labelled as background at an object's rim).
    Unlabelled,
    /// Something of this class.
    Labelled(ClassId),
}

/// The floor cells that something stands on: those with a voxel of at least some occupancy probability.
#[derive(Clone, Debug, PartialEq)]
pub struct FloorPlan {
    grid: Grid,
    cells: Vec<Footing>,
}

/// The floor cells of one object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    inside: Vec<bool>,
    /// Cell indices, nearest to the first one first.
    cells: Vec<usize>,
}

impl Patch {
    /// Whether the floor cell at `cell_index` belongs to the object.
    pub fn contains(&self, cell_index: usize) -> bool {
        self.inside[cell_index]
    }

    /// The part of it whose cells are asked for.
    pub fn part(&self, is_of: impl Fn(usize) -> bool) -> Self {
        let cells: Vec<usize> = self.cells.iter().copied().filter(|cell| is_of(*cell)).collect();
        let mut inside = vec![false; self.inside.len()];
        cells.iter().for_each(|cell| inside[*cell] = true);
        Self { inside, cells }
    }

    /// The cells' indices; the cell that the patch was grown from comes first.
    pub fn cells(&self) -> &[usize] {
        &self.cells
    }
}

impl FloorPlan {
    /// The cells with a voxel of `p >= threshold`.
    pub fn new(belief: &Belief, threshold: f32) -> Self {
        let footing = |cell: usize| {
            if !belief.occupancy[belief.grid.column(cell)].iter().any(|a| beta_mean(*a) >= threshold) {
                return Footing::Empty;
            }
            let labelled = belief.semantics[cell].windows(2).any(|a| a[0] != a[1]);
            match belief.likeliest(cell).0 {
                class if labelled && class != BACKGROUND => Footing::Labelled(class),
                _ => Footing::Unlabelled,
            }
        };
        Self { grid: belief.grid, cells: (0..belief.grid.cell_count()).into_par_iter().map(footing).collect() }
    }

    /// Whether something stands on the floor cell at `cell_index`.
    pub fn stands(&self, cell_index: usize) -> bool {
        self.cells[cell_index] != Footing::Empty
    }

    /// The class of what stands on the floor cell at `cell_index`, where it is known.
    pub fn class(&self, cell_index: usize) -> Option<ClassId> {
        if let Footing::Labelled(class) = self.cells[cell_index] { Some(class) } else { None }
    }

    /// The object that stands on the floor cell at `from`.
    ///
    /// Objects stand on the board and do not overhang, so an object is a patch of the floor plan: the cells that are
    /// connected to the first one by edge or corner, carry its class or none, and lie within `radius_m` of it. Where the
    /// first cell has no label, the first label met on the way is the object's. Two objects of one class that touch
    /// count as one.
    pub fn patch(&self, from: usize, radius_m: f32) -> Patch {
        let [width, depth, _] = self.grid.dims;
        let radius = radius_m / self.grid.voxel_m;
        let mut patch = Patch { inside: vec![false; self.cells.len()], cells: vec![from] };
        patch.inside[from] = true;
        let mut class = Footing::Unlabelled;
        let mut queue = VecDeque::from([from]);
        while let Some(cell) = queue.pop_front() {
            if class == Footing::Unlabelled && self.stands(cell) {
                class = self.cells[cell];
            }
            let (x, y) = (cell / depth, cell % depth);
            for x in x.saturating_sub(1)..(x + 2).min(width) {
                for y in y.saturating_sub(1)..(y + 2).min(depth) {
                    let next = x * depth + y;
                    let of_object = match self.cells[next] {
                        Footing::Empty => false,
                        Footing::Unlabelled => true,
                        labelled => class == Footing::Unlabelled || class == labelled,
                    };
                    let offset = (x as f32 - (from / depth) as f32).hypot(y as f32 - (from % depth) as f32);
                    if of_object && offset <= radius && !patch.inside[next] {
                        patch.inside[next] = true;
                        patch.cells.push(next);
                        queue.push_back(next);
                    }
                }
            }
        }
        patch
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;
    use crate::belief::classical::evidence;

    /// Boxes `[x0, x1, y0, y1]` (metres) with a class each, everything else free.
    fn standing(boxes: &[([f32; 4], usize)]) -> Belief {
        let grid = Grid::for_shelf([0.80, 0.40, 0.10], 0.005);
        let mut belief = Belief::uniform(grid);
        belief.occupancy.fill(evidence(-3.0, 30.0));
        for cell in 0..grid.cell_count() {
            let at = grid.cell_center(grid.cell(cell));
            for &([x0, x1, y0, y1], class) in boxes {
                if (x0..x1).contains(&at.x) && (y0..y1).contains(&at.y) {
                    belief.occupancy[grid.column(cell)][..10].fill(evidence(3.0, 30.0));
                    belief.semantics[cell][class] += 4.0;
                }
            }
        }
        belief
    }

    fn cell(belief: &Belief, x: f32, y: f32) -> usize {
        belief.grid.cell_index(belief.grid.cell_at(Point::new(x, y, 0.0)).expect("inside"))
    }

    #[test]
    fn an_object_is_its_connected_patch_of_one_class() {
        let belief =
            standing(&[([-0.04, 0.04, 0.20, 0.24], 3), ([-0.04, 0.04, 0.24, 0.28], 5), ([0.06, 0.10, 0.20, 0.24], 3)]);
        let plan = FloorPlan::new(&belief, 0.85);
        let patch = plan.patch(cell(&belief, 0.0, 0.20), 0.2);
        assert_eq!(patch.cells().len(), 16 * 8);
        assert_eq!(patch.cells()[0], cell(&belief, 0.0, 0.20));
        assert!(patch.contains(cell(&belief, 0.03, 0.23)));
        assert!(!patch.contains(cell(&belief, 0.0, 0.25)) && !patch.contains(cell(&belief, 0.08, 0.22)));
        assert!(plan.stands(cell(&belief, 0.08, 0.22)) && !plan.stands(cell(&belief, 0.05, 0.22)));
        assert!(!FloorPlan::new(&belief, 0.96).stands(cell(&belief, 0.08, 0.22)), "p is 0.953");
    }

    #[test]
    fn unlabelled_cells_join_and_the_first_label_met_decides() {
        let mut belief = standing(&[([-0.04, 0.04, 0.20, 0.24], 3), ([-0.04, 0.04, 0.24, 0.28], 5)]);
        for x in -8..8 {
            let rim = cell(&belief, 0.005 * x as f32 + 0.0025, 0.2025);
            belief.semantics[rim] = [1.0; crate::scene::CLASS_COUNT];
        }
        let patch = FloorPlan::new(&belief, 0.85).patch(cell(&belief, 0.0, 0.2025), 0.2);
        assert_eq!(patch.cells().len(), 16 * 8, "the rim and the box behind it, not the next one");
    }

    #[test]
    fn an_object_without_any_label_is_the_whole_patch_within_reach() {
        let mut belief = standing(&[([-0.30, 0.30, 0.20, 0.24], 3)]);
        belief.semantics.fill([1.0; crate::scene::CLASS_COUNT]);
        let patch = FloorPlan::new(&belief, 0.85).patch(cell(&belief, 0.0, 0.20), 0.2);
        // 40 cells of radius to both sides and the middle one, nearly all of 8 rows.
        assert!((79 * 8..=81 * 8).contains(&patch.cells().len()), "{}", patch.cells().len());
    }
}
