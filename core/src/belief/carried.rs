//! The object that a push touches first and moves along, according to a belief.

use super::{Belief, FloorPlan, OBJECT_RADIUS_M, Patch, SweptPush, beta_mean};
use crate::{Point, Vector};

/// Occupancy probability from which a voxel counts as part of an object.
pub(crate) const SOLID: f32 = 0.6;

/// What a push passes through, for every floor cell.
pub(super) struct Met {
    /// Largest occupancy probability that the sweep passes through; negative where it does not pass.
    pub(super) probability: Vec<f32>,
    /// Lowest voxel that was passed; the grid's height where nothing passed.
    pub(super) lowest: Vec<usize>,
}

impl Met {
    pub(super) fn of(belief: &Belief, push: &SweptPush) -> Self {
        let (cells, height) = (belief.grid.cell_count(), belief.grid.dims[2]);
        let mut met = Self { probability: vec![-1.0; cells], lowest: vec![height; cells] };
        for index in push.swept.iter() {
            let (cell, level) = (index / height, index % height);
            met.probability[cell] = met.probability[cell].max(beta_mean(belief.occupancy[index]));
            met.lowest[cell] = met.lowest[cell].min(level);
        }
        met
    }
}

/// The tip's way along a push.
pub(super) struct Track {
    pub(super) start: Point,
    pub(super) direction: Vector,
    /// Metres.
    pub(super) length: f32,
}

impl Track {
    pub(super) fn of(push: &SweptPush) -> Self {
        let push = &push.push;
        Self { start: push.start_point(), direction: push.direction(), length: push.length_m }
    }

    /// How far along the push a point is, metres; negative behind the start.
    pub(super) fn along(&self, on_board: Point) -> f32 {
        Vector::new(on_board.x - self.start.x, on_board.y - self.start.y, 0.0).dot(&self.direction)
    }
}

/// The object that the tool touches first, and how far it moves: with the tool for the rest of the push, at most up to
/// the walls. It is assumed neither to turn nor to push other objects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Carried {
    patch: Patch,
    /// Cells along x and y.
    shift: [isize; 2],
    dims: [usize; 2],
}

impl Carried {
    /// The object that `push` moves; `None` when it touches nothing that is believed occupied. `plan` holds the
    /// occupied floor cells ([`SOLID`]).
    #[cfg(feature = "cnabu")]
    pub(crate) fn by(push: &SweptPush, belief: &Belief, plan: &FloorPlan) -> Option<Self> {
        Self::of(belief, plan, &Met::of(belief, push), &Track::of(push))
    }

    pub(super) fn of(belief: &Belief, plan: &FloorPlan, met: &Met, track: &Track) -> Option<Self> {
        let grid = &belief.grid;
        let along = |cell: usize| track.along(grid.cell_center(grid.cell(cell)));
        let first = (0..grid.cell_count())
            .filter(|&cell| met.probability[cell] >= SOLID && along(cell) >= 0.0)
            .min_by(|&a, &b| along(a).total_cmp(&along(b)))?;
        let patch = plan.patch(first, OBJECT_RADIUS_M);
        let way_m = (track.length - along(first) + 0.5 * grid.voxel_m).max(0.0);
        let dims = [grid.dims[0], grid.dims[1]];
        let shift = std::array::from_fn(|axis| {
            let at = |cell: &usize| [cell / dims[1], cell % dims[1]][axis] as isize;
            let (low, high) =
                patch.cells().iter().fold((isize::MAX, 0), |(low, high), cell| (low.min(at(cell)), high.max(at(cell))));
            let wanted = (track.direction[axis] * way_m / grid.voxel_m).round() as isize;
            wanted.clamp(-low, dims[axis] as isize - 1 - high)
        });
        Some(Self { patch, shift, dims })
    }

    /// Whether the object stands on a floor cell before the push.
    pub(crate) fn stood(&self, cell: usize) -> bool {
        self.patch.contains(cell)
    }

    /// The floor cell from which the object comes to a floor cell; `None` where it does not come.
    pub(crate) fn source(&self, cell: usize) -> Option<usize> {
        let x = (cell / self.dims[1]).checked_add_signed(-self.shift[0]).filter(|x| *x < self.dims[0])?;
        let y = (cell % self.dims[1]).checked_add_signed(-self.shift[1]).filter(|y| *y < self.dims[1])?;
        Some(x * self.dims[1] + y).filter(|&source| self.patch.contains(source))
    }

    /// The floor cells `[x, y]` that the object leaves and those that it comes to.
    pub(super) fn cells(&self) -> impl Iterator<Item = [usize; 2]> {
        self.patch.cells().iter().flat_map(|cell| {
            let at = [cell / self.dims[1], cell % self.dims[1]];
            [at, std::array::from_fn(|axis| at[axis].saturating_add_signed(self.shift[axis]))]
        })
    }
}
