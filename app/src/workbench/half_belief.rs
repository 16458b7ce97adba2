//! A belief in half precision, as `beliefs/NNN.npz` keeps it, and packed, so that a window can hold every step of an episode.

use super::packed::Halves;
use nudge_core::belief::Belief;
use nudge_core::grid::Grid;
use nudge_core::scene::CLASS_COUNT;

/// Columns of the grid in a block: what is read together is unpacked together.
const COLUMNS: usize = 64;

/// A belief of about 1 MB in place of 9 MB for the design's grid. One number of it takes microseconds, all of it tens of
/// milliseconds.
#[derive(Clone, Debug, PartialEq)]
pub struct HalfBelief {
    grid: Grid,
    occupancy: Halves,
    semantics: Halves,
}

impl HalfBelief {
    /// The belief, rounded.
    pub fn of(belief: &Belief) -> Self {
        Self {
            grid: belief.grid,
            occupancy: Halves::pack(belief.occupancy.as_flattened(), 2 * COLUMNS * belief.grid.dims[2]),
            semantics: Halves::pack(belief.semantics.as_flattened(), CLASS_COUNT * 8 * COLUMNS),
        }
    }

    /// The belief in full precision.
    pub fn belief(&self) -> Belief {
        let mut belief = Belief::uniform(self.grid);
        self.occupancy.unpack(belief.occupancy.as_flattened_mut());
        self.semantics.unpack(belief.semantics.as_flattened_mut());
        belief
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// `[a_occ, a_free]` of a voxel.
    pub fn voxel(&self, index: usize) -> [f32; 2] {
        [self.occupancy.get(2 * index), self.occupancy.get(2 * index + 1)]
    }

    /// Dirichlet parameters of a floor cell.
    pub fn cell(&self, index: usize) -> [f32; CLASS_COUNT] {
        std::array::from_fn(|class| self.semantics.get(CLASS_COUNT * index + class))
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        self.occupancy.bytes() + self.semantics.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_comes_back_within_half_a_thousandth() {
        let mut belief = Belief::uniform(Grid::for_shelf([0.02, 0.02, 0.02], 0.01));
        belief.occupancy[3] = [17.3, 1.25];
        belief.semantics[2][7] = 9.1;
        let half = HalfBelief::of(&belief);
        assert!((half.voxel(3)[0] - 17.3).abs() < 0.01 && half.voxel(3)[1] == 1.25);
        assert!((half.cell(2)[7] - 9.1).abs() < 0.01 && half.cell(2)[6] == 1.0);
        let back = half.belief();
        assert_eq!(back.occupancy[3], half.voxel(3));
        assert_eq!(back.semantics[2], half.cell(2));
    }

    #[test]
    fn a_kept_belief_takes_a_quarter_of_its_half_precision_at_most() {
        let session = crate::workbench::fixture::session(1);
        for moment in &session.moments {
            let grid = moment.belief.grid();
            let plain = 2 * (2 * grid.voxel_count() + CLASS_COUNT * grid.cell_count());
            assert!(
                4 * moment.belief.bytes() <= plain,
                "step {}: {} of {plain} bytes",
                moment.step,
                moment.belief.bytes()
            );
        }
    }
}
