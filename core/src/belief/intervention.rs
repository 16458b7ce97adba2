//! What a belief update is told of a manipulation: what the arm sweeps, and what moves where.

use super::{Belief, Patch, beta_mean};
use crate::grid::{Grid, VoxelSet, Window};
use crate::{Point, Vector};

/// Occupancy probability from which a voxel counts as part of an object.
pub const SOLID: f32 = 0.6;

/// A manipulation as a belief update sees it, whatever the skill: the skill derives it from the belief and from what it
/// does.
#[derive(Clone, Debug, PartialEq)]
pub struct Intervention {
    /// Every voxel that gripper or links touch, approach included; nothing stands there afterwards. Where an object comes
    /// to stand that was moved through what the approach swept, those voxels are left out.
    pub swept: VoxelSet,
    /// What is expected to move.
    pub flow: Flow,
    /// The straight way of the tool in contact. Swept volume and flow do not tell where in what was swept the tool touched
    /// and from where it came; sigma_m's marks and the reach of the classical rule are made of it.
    pub stroke: Stroke,
    /// The chance that what moves is held and goes exactly where the flow says, while nothing else moves; `None` where the tool
    /// pushes or pulls, and what it touches may do anything.
    pub held: Option<f32>,
}

/// The straight way of the tool's tip while it is in contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Where it begins, metres.
    pub start: Point,
    /// Unit direction, in the plane of the board.
    pub direction: Vector,
    /// How far the tip moves, metres.
    pub length_m: f32,
}

impl Stroke {
    /// Where it ends.
    pub fn end(&self) -> Point {
        self.start + self.direction * self.length_m
    }

    /// How far along the stroke a point is, metres; negative behind the start.
    pub fn along(&self, on_board: Point) -> f32 {
        Vector::new(on_board.x - self.start.x, on_board.y - self.start.y, 0.0).dot(&self.direction)
    }
}

/// Where the floor cells of what is moved are expected to go.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    /// The floor cells that it covers, no more than needed.
    pub window: Window,
    /// Displacement along x and y per floor cell of the window, metres; `None` where nothing is moved. A cell of an object
    /// that is met but held, for example by a wall, has a displacement of zero.
    pub displacement_m: Vec<Option<[f32; 2]>>,
}

impl Flow {
    /// Nothing moves.
    pub fn nothing() -> Self {
        Self { window: Window { x: [0, 0], y: [0, 0] }, displacement_m: Vec::new() }
    }

    /// An object moves as a whole without turning, by `wanted_m` metres along x and y, rounded to cells and at most up to the
    /// walls.
    pub fn rigid(grid: &Grid, patch: &Patch, wanted_m: [f32; 2]) -> Self {
        let dims = [grid.dims[0], grid.dims[1]];
        let (mut low, mut high) = ([isize::MAX; 2], [0; 2]);
        for cell in patch.cells() {
            let at = [cell / dims[1], cell % dims[1]].map(|at| at as isize);
            low = std::array::from_fn(|axis| low[axis].min(at[axis]));
            high = std::array::from_fn(|axis| high[axis].max(at[axis]));
        }
        let displacement_m: [f32; 2] = std::array::from_fn(|axis| {
            let wanted = (wanted_m[axis] / grid.voxel_m).round() as isize;
            wanted.clamp(-low[axis], dims[axis] as isize - 1 - high[axis]) as f32 * grid.voxel_m
        });
        let range = |axis: usize| [low[axis] as usize, high[axis] as usize + 1];
        let window = Window { x: range(0), y: range(1) };
        let of = |cell: usize| patch.contains(cell).then_some(displacement_m);
        Self { window, displacement_m: window.cells(grid).map(of).collect() }
    }

    /// An object is taken out of the shelf.
    pub fn away(grid: &Grid, patch: &Patch) -> Self {
        let mut flow = Self::rigid(grid, patch, [0.0; 2]);
        // Farther than any shelf is deep.
        flow.displacement_m.iter_mut().flatten().for_each(|displacement_m| *displacement_m = [0.0, -1e3]);
        flow
    }

    /// The floor cells of a grid that it leaves and comes to.
    pub(crate) fn moved(&self, grid: &Grid) -> Moved {
        let [width, depth, _] = grid.dims;
        let to = |cell: usize, displacement_m: [f32; 2]| -> Option<[usize; 2]> {
            let [dx, dy] = displacement_m.map(|m| (m / grid.voxel_m).round() as isize);
            let x = (cell / depth).checked_add_signed(dx).filter(|x| *x < width)?;
            let y = (cell % depth).checked_add_signed(dy).filter(|y| *y < depth)?;
            Some([x, y])
        };
        let moving = self.window.cells(grid).zip(&self.displacement_m);
        let ways: Vec<(usize, [usize; 2])> =
            moving.filter_map(|(cell, displacement_m)| Some((cell, to(cell, (*displacement_m)?)?))).collect();
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for (_, at) in &ways {
            low = std::array::from_fn(|axis| low[axis].min(at[axis]));
            high = std::array::from_fn(|axis| high[axis].max(at[axis] + 1));
        }
        let after = if ways.is_empty() {
            Self::nothing().window
        } else {
            Window { x: [low[0], high[0]], y: [low[1], high[1]] }
        };
        let mut moved = Moved {
            depth,
            before: self.window,
            stood: self.displacement_m.iter().map(Option::is_some).collect(),
            after,
            source: vec![None; after.cell_count()],
        };
        for (cell, [x, y]) in ways {
            if let Some(at) = at(&after, x, y) {
                moved.source[at] = Some(cell);
            }
        }
        moved
    }
}

/// The floor cells that a flow leaves and comes to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Moved {
    depth: usize,
    before: Window,
    stood: Vec<bool>,
    after: Window,
    /// Per cell of `after` the cell from which something comes there.
    source: Vec<Option<usize>>,
}

impl Moved {
    /// Whether nothing moves.
    #[cfg(any(test, feature = "cnabu"))]
    pub(crate) fn is_nothing(&self) -> bool {
        self.source.is_empty()
    }

    /// Whether what is moved stands on a floor cell before.
    pub(crate) fn stood(&self, cell: usize) -> bool {
        at(&self.before, cell / self.depth, cell % self.depth).is_some_and(|at| self.stood[at])
    }

    /// The floor cell from which something comes to a floor cell; `None` where nothing comes.
    pub(crate) fn source(&self, cell: usize) -> Option<usize> {
        at(&self.after, cell / self.depth, cell % self.depth).and_then(|at| self.source[at])
    }

    /// The corners `[x, y]` of the windows that are left and come to.
    pub(super) fn corners(&self) -> impl Iterator<Item = [usize; 2]> {
        let windows = [self.before, self.after].into_iter().filter(|window| window.cell_count() > 0);
        windows.flat_map(|window| [[window.x[0], window.y[0]], [window.x[1] - 1, window.y[1] - 1]])
    }
}

/// Position of a floor cell in a window.
fn at(window: &Window, x: usize, y: usize) -> Option<usize> {
    let inside = (window.x[0]..window.x[1]).contains(&x) && (window.y[0]..window.y[1]).contains(&y);
    inside.then(|| (x - window.x[0]) * (window.y[1] - window.y[0]) + y - window.y[0])
}

/// What a sweep passes through, for every floor cell.
pub(crate) struct Met {
    /// Largest occupancy probability that the sweep passes through; negative where it does not pass.
    pub(crate) probability: Vec<f32>,
    /// Lowest voxel that was passed; the grid's height where nothing passed.
    pub(crate) lowest: Vec<usize>,
}

impl Met {
    pub(crate) fn of(belief: &Belief, swept: &VoxelSet) -> Self {
        let (cells, height) = (belief.grid.cell_count(), belief.grid.dims[2]);
        let mut met = Self { probability: vec![-1.0; cells], lowest: vec![height; cells] };
        for index in swept.iter() {
            let (cell, level) = (index / height, index % height);
            met.probability[cell] = met.probability[cell].max(beta_mean(belief.occupancy[index]));
            met.lowest[cell] = met.lowest[cell].min(level);
        }
        met
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::FloorPlan;
    use crate::grid::Cell;

    /// A shelf of 0.2 x 0.2 m with something on cells 10 to 13 of x and 20 to 25 of y.
    fn standing() -> (Grid, Patch) {
        let grid = Grid::for_shelf([0.20, 0.20, 0.05], 0.005);
        let mut belief = Belief::uniform(grid);
        for cell in 0..grid.cell_count() {
            let Cell { x, y } = grid.cell(cell);
            let inside = (10..14).contains(&x) && (20..26).contains(&y);
            belief.occupancy[grid.column(cell)].fill(if inside { [9.0, 1.0] } else { [1.0, 9.0] });
        }
        (grid, FloorPlan::new(&belief, SOLID).patch(grid.cell_index(Cell { x: 11, y: 22 }), 0.2))
    }

    #[test]
    fn a_rigid_flow_leaves_its_cells_and_comes_to_as_many_others() {
        let (grid, patch) = standing();
        let flow = Flow::rigid(&grid, &patch, [0.011, -0.03]);
        assert_eq!((flow.window, flow.displacement_m.len()), (Window { x: [10, 14], y: [20, 26] }, 24));
        let moved = flow.moved(&grid);
        let cells = |is: &dyn Fn(usize) -> bool| (0..grid.cell_count()).filter(|cell| is(*cell)).collect::<Vec<_>>();
        assert_eq!(cells(&|cell| moved.stood(cell)), cells(&|cell| patch.contains(cell)));
        let to = grid.cell_index(Cell { x: 12, y: 14 });
        assert_eq!(moved.source(to), Some(grid.cell_index(Cell { x: 10, y: 20 })), "2 cells right, 6 to the front");
        assert_eq!(cells(&|cell| moved.source(cell).is_some()).len(), 24);
        assert!(Flow::nothing().moved(&grid).is_nothing() && !moved.is_nothing());
    }

    #[test]
    fn what_is_held_by_a_wall_is_met_but_does_not_move() {
        let (grid, patch) = standing();
        let flow = Flow::rigid(&grid, &patch, [0.0, 0.5]);
        // 40 rows: from 25 it can go 14 more.
        assert!(flow.displacement_m.iter().all(|d| d.is_some_and(|d| (d[1] - 0.07).abs() < 1e-6)));
        let mut held = Flow::rigid(&grid, &patch, [0.0, 0.0]);
        let moved = held.moved(&grid);
        assert!(patch.cells().iter().all(|&cell| moved.stood(cell) && moved.source(cell) == Some(cell)));
        held.displacement_m.fill(None);
        assert!(patch.cells().iter().all(|&cell| !held.moved(&grid).stood(cell)));
    }
}
