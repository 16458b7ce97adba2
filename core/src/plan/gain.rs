//! What views gain under one belief: by rays or by coverage.
//!
//! Where all voxels count, a view gains what its rays meet ([`gain_of_views`], the gain that the paper takes from Delmerico
//! et al. 2018). Where only unseen ones do, each counts once ([`Coverage`]). [`Gain`] is made once per decision of the
//! setting and the belief; everything else takes from it.
//!
//! Before the first look the belief is `p = 0.5` everywhere, and no ray gets farther than a few voxels: all views that
//! show the shelf's front are equally good. But objects stand on the board. So until something was seen, a voxel
//! without evidence has the occupancy probability of [`standing`], which falls with its height. The first look then
//! comes from above, where the camera sees most past the objects in front.

use super::Counted;
use crate::belief::{Belief, Prediction};
use crate::camera::{ViewArray, ViewId};
use crate::gain::{Coverage, GainField, RayDensity, ViewPair, best_pair, gain_of_views, gain_per_voxel, gain_together};
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

/// How gains are counted under one belief, with the field that rays pass through.
#[derive(Clone)]
pub struct Gain(pub(super) By);

/// How a gain is counted: the one place where the two ways part.
#[derive(Clone)]
pub(super) enum By {
    /// All voxels, summed over rays.
    Rays(GainField),
    /// Only voxels that no look has seen, each once: those that were seen block rays but do not count.
    Coverage(GainField),
}

/// What looking gains at one step.
pub(crate) struct Looking {
    /// Gain of every view of the array, nats.
    pub gains: Vec<f32>,
    /// The best pair of those offered; `None` where none gains anything.
    pub pair: Option<ViewPair>,
    /// Gain of that pair together, nats.
    pub igv: f32,
}

impl Looking {
    /// First and second view of the best pair.
    pub(super) fn views(&self) -> Vec<ViewId> {
        self.pair.map_or_else(Vec::new, |pair| std::iter::once(pair.first).chain(pair.second).collect())
    }
}

impl Gain {
    /// Gains under a belief. `seen` are the voxels that looks have seen and no push has probably changed since; where all
    /// voxels count they make no difference.
    pub fn new(counted: Counted, belief: &Belief, seen: &VoxelSet) -> Self {
        let Some(seen) = counted.left_out(seen) else { return Self(By::Rays(GainField::new(belief))) };
        if !seen.is_empty() {
            return Self(By::Coverage(GainField::new(belief).with_seen(seen)));
        }
        let mut expected = belief.clone();
        let grid = expected.grid;
        for (index, beta) in expected.occupancy.iter_mut().enumerate().filter(|(_, beta)| **beta == [1.0; 2]) {
            let p = standing((f32::from(grid.voxel(index).z) + 0.5) * grid.voxel_m);
            *beta = [p, 1.0 - p];
        }
        Self(By::Coverage(GainField::new(&expected).with_seen(seen)))
    }

    /// What counts.
    pub fn counted(&self) -> Counted {
        match self.0 {
            By::Rays(_) => Counted::All,
            By::Coverage(_) => Counted::Unseen,
        }
    }

    /// The field that rays pass through.
    pub fn field(&self) -> &GainField {
        match &self.0 {
            By::Rays(field) | By::Coverage(field) => field,
        }
    }

    /// Gains after a push, under its prediction. Voxels that were seen before it do not count after it either.
    pub(super) fn after(&self, prediction: &Prediction) -> Self {
        Self(match &self.0 {
            By::Rays(field) => By::Rays(field.with_prediction(prediction)),
            By::Coverage(field) => By::Coverage(field.with_prediction(prediction)),
        })
    }

    /// Gain of every given view, nats, in the order of `ids`.
    pub fn of_views(&self, array: &ViewArray, ids: &[ViewId], density: RayDensity) -> Vec<f32> {
        match &self.0 {
            By::Rays(field) => gain_of_views(field, array, ids, density),
            By::Coverage(field) => Coverage::new(field, array, ids, density).gains(),
        }
    }

    /// Gain of every view of the array, and the best pair of those offered.
    pub(crate) fn of_looking(&self, array: &ViewArray, offered: impl Fn(&ViewId) -> bool) -> Looking {
        let ids: Vec<ViewId> = array.views.iter().map(|view| view.id).collect();
        match &self.0 {
            By::Rays(field) => {
                let gains = gain_of_views(field, array, &ids, RayDensity::FULL);
                let fresh: Vec<f32> =
                    ids.iter().zip(&gains).map(|(id, gain)| if offered(id) { *gain } else { 0.0 }).collect();
                let pair = best_pair(field, array, &fresh, RayDensity::FULL);
                Looking { gains, pair, igv: pair.map_or(0.0, |pair| pair.total()) }
            }
            By::Coverage(field) => {
                let coverage = Coverage::new(field, array, &ids, RayDensity::FULL);
                let gains = coverage.gains();
                let pair = coverage.best_pair(&gains, offered);
                let mut looking = Looking { gains, pair, igv: 0.0 };
                let gapless = RayDensity::gapless(field.grid(), array);
                looking.igv = gain_together(field, array, &looking.views(), gapless);
                looking
            }
        }
    }

    /// Where a view's gain comes from: voxel positions and their nats, in ascending order of position.
    pub fn per_voxel(&self, array: &ViewArray, view: ViewId, density: RayDensity) -> Vec<(usize, f32)> {
        match &self.0 {
            By::Rays(field) => gain_per_voxel(field, array, view, density),
            By::Coverage(field) => Coverage::new(field, array, &[view], density).per_voxel(0),
        }
    }
}
