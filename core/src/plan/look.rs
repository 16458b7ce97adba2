//! The gain of views: by rays or by coverage.
//!
//! Where all voxels count, a view gains what its rays meet ([`gain_of_views`], the gain that the paper takes from Delmerico
//! et al. 2018). Where only unseen ones do, each counts once ([`Coverage`]).
//!
//! Before the first look the belief is `p = 0.5` everywhere, and no ray gets farther than a few voxels: all views that
//! show the shelf's front are equally good. But objects stand on the board. So until something was seen, a voxel
//! without evidence has the occupancy probability of [`standing`], which falls with its height. The first look then
//! comes from above, where the camera sees most past the objects in front.

use crate::belief::Belief;
use crate::camera::{ViewArray, ViewId};
use crate::gain::{Coverage, GainField, RayDensity, ViewPair, best_pair, gain_of_views, gain_per_voxel};
use crate::grid::VoxelSet;

/// How probably a voxel right above the board is occupied.
const ON_BOARD: f32 = 0.5;
/// Height above the board from which nothing is expected any more, m.
const TALLEST_M: f32 = 0.25;

/// Occupancy probability at a height above the board before anything was seen: as in shelves of the generator, where it
/// is 0.5 up to 7 cm, 0.3 at 12 cm, 0.14 at 21 cm and nothing from 25 cm on.
fn standing(height_m: f32) -> f32 {
    ON_BOARD * (1.0 - height_m / TALLEST_M).max(0.0)
}

/// The field that rays pass through to compute the gain of views under a belief: voxels of `seen` block rays but do not
/// count.
pub fn gain_field(belief: &Belief, seen: Option<&VoxelSet>) -> GainField {
    let Some(seen) = seen else { return GainField::new(belief) };
    if !seen.is_empty() {
        return GainField::new(belief).with_seen(seen);
    }
    let mut expected = belief.clone();
    let grid = expected.grid;
    for (index, beta) in expected.occupancy.iter_mut().enumerate().filter(|(_, beta)| **beta == [1.0; 2]) {
        let p = standing((f32::from(grid.voxel(index).z) + 0.5) * grid.voxel_m);
        *beta = [p, 1.0 - p];
    }
    GainField::new(&expected).with_seen(seen)
}

/// Gain of every given view, nats, in the order of `ids`.
pub(super) fn gains(field: &GainField, array: &ViewArray, ids: &[ViewId], density: RayDensity) -> Vec<f32> {
    if field.knows_seen() {
        Coverage::new(field, array, ids, density).gains()
    } else {
        gain_of_views(field, array, ids, density)
    }
}

/// Gain of every given view, nats, in the order of `ids` (those of the array), and the best pair of those offered.
pub(crate) fn gains_and_pair(
    field: &GainField,
    array: &ViewArray,
    ids: &[ViewId],
    offered: impl Fn(&ViewId) -> bool,
) -> (Vec<f32>, Option<ViewPair>) {
    if field.knows_seen() {
        let coverage = Coverage::new(field, array, ids, RayDensity::FULL);
        let gains = coverage.gains();
        let pair = coverage.best_pair(&gains, offered);
        return (gains, pair);
    }
    let gains = gain_of_views(field, array, ids, RayDensity::FULL);
    let fresh: Vec<f32> = ids.iter().zip(&gains).map(|(id, gain)| if offered(id) { *gain } else { 0.0 }).collect();
    let pair = best_pair(field, array, &fresh, RayDensity::FULL);
    (gains, pair)
}

/// Where a view's gain comes from: voxel positions and their nats, in ascending order of position.
pub fn gain_sources(field: &GainField, array: &ViewArray, view: ViewId, density: RayDensity) -> Vec<(usize, f32)> {
    if field.knows_seen() {
        Coverage::new(field, array, &[view], density).per_voxel(0)
    } else {
        gain_per_voxel(field, array, view, density)
    }
}
