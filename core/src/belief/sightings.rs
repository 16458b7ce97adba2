//! Which voxels looks have seen, and how the belief of a network is kept from drifting.
//!
//! A network that was trained on ten looks is applied up to forty times. Then the belief drifts: cells about which a
//! look says nothing new still change a little with every look, and the map gets worse (RESULTS.md). So the first looks
//! ([`LOOKS_TAKEN`]) change a column of the grid freely; after that a look changes it only near voxels that it sees for
//! the first time ([`NEWS_REACH_M`]).

use super::{Belief, BeliefUpdate, Prediction};
use crate::camera::MapObservation;
use crate::grid::{Grid, VoxelSet};

/// A look changes a drifting belief within this distance of voxels that it sees for the first time, along x and along
/// y, metres.
pub const NEWS_REACH_M: f32 = 0.08;
/// Voxels of a column that a look must see for the first time for the column to count as new; a single voxel is on the
/// rim of a shadow.
const NEWS_VOXELS: u32 = 2;
/// So many looks change a column freely: they still make the map better.
pub const LOOKS_TAKEN: u8 = 5;
/// Probability that a push changed a floor cell above which its column counts as unseen again.
pub const CHANGED: f32 = 0.1;

/// The voxels that looks have seen and that no push has probably changed since.
#[derive(Clone, Debug)]
pub struct Sightings {
    grid: Grid,
    seen: VoxelSet,
    /// Number of looks that changed each column of a drifting belief.
    taken: Vec<u8>,
}

impl Sightings {
    /// Nothing is seen yet.
    pub fn none(grid: &Grid) -> Self {
        Self { grid: *grid, seen: VoxelSet::empty(grid), taken: vec![0; grid.cell_count()] }
    }

    /// The voxels that were seen.
    pub fn seen(&self) -> &VoxelSet {
        &self.seen
    }

    /// Number of looks that changed each column of a drifting belief.
    pub fn taken(&self) -> &[u8] {
        &self.taken
    }

    /// Sightings as they were kept; `None` for parts that are not of this grid.
    pub fn from_parts(grid: &Grid, seen: VoxelSet, taken: Vec<u8>) -> Option<Self> {
        let fits = seen.voxel_count() == grid.voxel_count() && taken.len() == grid.cell_count();
        fits.then_some(Self { grid: *grid, seen, taken })
    }

    /// Adds the voxels that a look sees.
    fn add(&mut self, observation: &MapObservation) {
        self.seen.union_with(&observation.occupied);
        self.seen.union_with(&observation.free);
    }

    /// After a push: columns that it has probably changed ([`CHANGED`]) count as unseen, and their number of looks
    /// starts at 0.
    pub fn forget_changed(&mut self, prediction: &Prediction) {
        let grid = self.grid;
        let cells = prediction.window.cells(&grid).zip(&prediction.change);
        for (cell, _) in cells.filter(|(_, chance)| **chance > CHANGED) {
            self.taken[cell] = 0;
            grid.column(cell).for_each(|voxel| self.seen.remove(voxel));
        }
    }

    /// Adds a look. Returns for every floor cell whether the look may change the column of a drifting belief: where few
    /// looks have changed it yet, or within [`NEWS_REACH_M`] of what this look sees for the first time.
    fn take(&mut self, observation: &MapObservation) -> Vec<bool> {
        let [width, depth, height] = self.grid.dims;
        let mut new = observation.free.clone();
        new.union_with(&observation.occupied);
        new.subtract(&self.seen);
        self.add(observation);
        let mut counts = vec![0_u32; width * depth];
        new.iter().for_each(|voxel| counts[voxel / height] += 1);
        // Number of cells with news before (x, y), in both.
        let mut before = vec![0_u32; (width + 1) * (depth + 1)];
        let at = |x: usize, y: usize| x * (depth + 1) + y;
        for x in 0..width {
            for y in 0..depth {
                let here = u32::from(counts[x * depth + y] >= NEWS_VOXELS);
                before[at(x + 1, y + 1)] = here + before[at(x, y + 1)] + before[at(x + 1, y)] - before[at(x, y)];
            }
        }
        let reach = (NEWS_REACH_M / self.grid.voxel_m).round() as usize;
        let is_near_news = |cell: usize| {
            let (x, y) = (cell / depth, cell % depth);
            let [low_x, low_y] = [x.saturating_sub(reach), y.saturating_sub(reach)];
            let (high_x, high_y) = ((x + reach + 1).min(width), (y + reach + 1).min(depth));
            before[at(high_x, high_y)] + before[at(low_x, low_y)]
                > before[at(low_x, high_y)] + before[at(high_x, low_y)]
        };
        let changes = |(cell, taken): (usize, &mut u8)| {
            let changes = *taken < LOOKS_TAKEN || is_near_news(cell);
            *taken = taken.saturating_add(u8::from(changes));
            changes
        };
        self.taken.iter_mut().enumerate().map(changes).collect()
    }
}

/// The belief after a look; `sightings` is updated too. A belief that does not drift ([`BeliefUpdate::wears`]) is
/// updated everywhere; one that does keeps the columns that enough looks have changed and that are far from what is
/// seen for the first time.
pub fn look(
    update: &dyn BeliefUpdate,
    belief: &Belief,
    observation: &MapObservation,
    sightings: &mut Sightings,
) -> Belief {
    if !update.wears() {
        sightings.add(observation);
        return update.observe(belief, observation);
    }
    let changes = sightings.take(observation);
    if !changes.contains(&true) {
        return belief.clone();
    }
    let mut next = update.observe(belief, observation);
    for cell in (0..changes.len()).filter(|cell| !changes[*cell]) {
        let column = belief.grid.column(cell);
        next.occupancy[column.clone()].copy_from_slice(&belief.occupancy[column]);
        next.semantics[cell] = belief.semantics[cell];
    }
    next
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::Intervention;
    use crate::grid::Window;

    /// Halves the evidence for occupancy everywhere, whatever it sees, as a network that was shown too much.
    struct Worn(bool);

    impl BeliefUpdate for Worn {
        fn name(&self) -> &str {
            "worn"
        }

        fn wears(&self) -> bool {
            self.0
        }

        fn observe(&self, belief: &Belief, _: &MapObservation) -> Belief {
            let mut next = belief.clone();
            next.occupancy.iter_mut().for_each(|voxel| voxel[0] *= 0.5);
            next.semantics.iter_mut().for_each(|cell| cell[0] += 1.0);
            next
        }

        fn predict(&self, _: &Belief, _: &[Intervention]) -> Vec<Prediction> {
            Vec::new()
        }
    }

    /// 60 x 40 floor cells of two voxels.
    fn grid() -> Grid {
        Grid::for_shelf([0.3, 0.2, 0.01], 0.005)
    }

    /// A look that meets something in some voxels and sees through others.
    fn observed(occupied: &[usize], free: &[usize]) -> MapObservation {
        let set = |voxels: &[usize]| {
            let mut set = VoxelSet::empty(&grid());
            voxels.iter().for_each(|voxel| set.insert(*voxel));
            set
        };
        MapObservation { free: set(free), occupied: set(occupied), labels: vec![255; grid().cell_count()] }
    }

    /// The cell at column x, row y.
    fn cell(x: usize, y: usize) -> usize {
        x * 40 + y
    }

    /// The floor cells that two beliefs differ in.
    fn differing(a: &Belief, b: &Belief) -> Vec<usize> {
        let height = grid().dims[2];
        let differ = |cell: &usize| {
            let column = cell * height..(cell + 1) * height;
            let semantics = a.semantics[*cell] != b.semantics[*cell];
            assert_eq!(a.occupancy[column.clone()] != b.occupancy[column], semantics, "both maps or none");
            semantics
        };
        (0..grid().cell_count()).filter(differ).collect()
    }

    #[test]
    fn after_the_first_looks_a_look_changes_what_is_near_its_news_and_nothing_else() {
        let (mut belief, mut sightings) = (Belief::uniform(grid()), Sightings::none(&grid()));
        let here = cell(10, 5);
        let (everywhere, nothing): (Vec<usize>, [usize; 0]) = ((0..grid().cell_count()).collect(), []);
        let mut after = |update: &Worn, observation: &MapObservation| {
            let next = look(update, &belief, observation, &mut sightings);
            let changed = differing(&belief, &next);
            belief = next;
            changed
        };
        for _ in 0..LOOKS_TAKEN {
            assert_eq!(after(&Worn(true), &observed(&[], &[2 * here])), everywhere);
        }
        // The same again is no news, nor is a single voxel; two in one column are.
        assert_eq!(after(&Worn(true), &observed(&[], &[2 * here])), nothing);
        assert_eq!(after(&Worn(true), &observed(&[2 * cell(50, 30)], &[])), nothing);
        let there = cell(30, 10);
        let near = |other: &usize| (other / 40).abs_diff(30) <= 16 && (other % 40).abs_diff(10) <= 16;
        let expected: Vec<usize> = everywhere.iter().copied().filter(near).collect();
        assert_eq!(after(&Worn(true), &observed(&[2 * there], &[2 * there + 1])), expected);
        assert_eq!(after(&Worn(true), &observed(&[2 * there], &[2 * there + 1])), nothing);
        assert_eq!(after(&Worn(false), &observed(&[2 * there], &[])), everywhere, "a belief that does not wear");
        assert_eq!(sightings.seen().len(), 4);
    }

    #[test]
    fn what_a_push_may_have_changed_is_unseen_and_changes_again() {
        let (belief, mut sightings) = (Belief::uniform(grid()), Sightings::none(&grid()));
        let all: Vec<usize> = (0..grid().voxel_count()).collect();
        for _ in 0..=LOOKS_TAKEN {
            look(&Worn(true), &belief, &observed(&[], &all), &mut sightings);
        }
        assert!(look(&Worn(true), &belief, &observed(&[], &all), &mut sightings) == belief);
        let mut prediction = Prediction {
            window: Window::whole(&grid()),
            occupancy: belief.occupancy.clone(),
            semantics: belief.semantics.clone(),
            change: vec![0.5 * CHANGED; grid().cell_count()],
        };
        let moved = cell(10, 5);
        sightings.forget_changed(&prediction);
        assert_eq!(sightings.seen().len(), grid().voxel_count());
        prediction.change[moved] = 2.0 * CHANGED;
        sightings.forget_changed(&prediction);
        assert_eq!(sightings.seen().len(), grid().voxel_count() - 2);
        // Nothing is shown, and yet it changes where the push was: the first looks at it count again.
        let blind = look(&Worn(true), &belief, &observed(&[], &[]), &mut sightings);
        assert_eq!(differing(&belief, &blind), [moved]);
    }
}
