//! What views really reach where the bodies are known, and what opens to them when the bodies stand elsewhere.
//!
//! A ray reaches the voxels on its way, the first one that a body fills included. This is the truth behind
//! [`super::Openings`], which says what a push is expected to open.

use super::RayDensity;
use super::field::GainField;
use super::ray::{Camera, Ray, Tally};
use super::skip::is_transparent;
use crate::camera::{View, ViewArray};
use crate::grid::{Grid, VoxelSet};
use crate::world::TruthMap;
use rayon::prelude::*;

/// What all views of an array together reach of a true map.
pub struct TrueReach {
    /// Without skip levels, so that a ray visits every voxel on its way.
    field: GainField,
    /// Each ray where it enters, and the position in the padded grid of what stops it.
    rays: Vec<(Ray, u32)>,
    /// Per voxel of the padded grid, whether a ray reaches it.
    reached: Vec<bool>,
}

/// What some of the views reach: the rays with their stops, and the voxels of the padded grid.
type Walked = (Vec<(Ray, u32)>, Vec<bool>);

impl TrueReach {
    /// Walks all rays of all views. The result does not depend on the number of threads.
    ///
    /// # Panics
    /// If the grid has more than 2,000 voxels along an axis.
    pub fn new(grid: &Grid, truth: &TruthMap, array: &ViewArray, density: RayDensity) -> Self {
        let field = GainField::of_truth(grid, truth);
        let begin = || (Vec::new(), vec![false; field.codes.len()]);
        let walk = |(mut rays, mut reached): Walked, view: &View| {
            Camera::of(&field, array, view.id).for_each_ray(&field, density, |_, ray| {
                let mut tally = Reached { reached: &mut reached, stop: 0 };
                ray.walk(&field, &mut tally);
                let stop = tally.stop;
                rays.push((ray, stop as u32));
            });
            (rays, reached)
        };
        let join = |(mut rays, mut reached): Walked, other: Walked| {
            rays.extend(other.0);
            reached.iter_mut().zip(other.1).for_each(|(reached, other)| *reached |= other);
            (rays, reached)
        };
        let (rays, reached) = array.views.par_iter().fold(begin, walk).reduce(begin, join);
        Self { field, rays, reached }
    }

    /// The voxels that a view reaches.
    pub fn reached(&self) -> VoxelSet {
        inside(&self.field, |index| self.reached[index])
    }

    /// The voxels that a view reaches once the bodies stand as in `after`, a truth of the same grid, and that none reached
    /// before. Only rays whose stop has become free are walked: no other reaches anything new.
    pub fn opened(&self, after: &TruthMap) -> VoxelSet {
        let field = GainField::of_truth(self.field.grid(), after);
        let mut reached = self.reached.clone();
        for (ray, stop) in &self.rays {
            if is_transparent(field.codes[*stop as usize]) {
                ray.walk(&field, &mut Reached { reached: &mut reached, stop: 0 });
            }
        }
        inside(&field, |index| reached[index] && !self.reached[index])
    }
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
    fn nothing_outside_the_shelf_is_reached() {
        let grid = small_grid();
        let reach = TrueReach::new(&grid, &truth(&grid, &[]), &looking([0.0, -0.3, 0.2], [0.0, 0.2, 0.2]), EVERY);
        let reached = reach.reached().len();
        assert!(reached > grid.voxel_count() / 2 && reached <= grid.voxel_count(), "{reached}");
    }
}
