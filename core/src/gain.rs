//! Volumetric information gain: how much a view would tell, in nats.
//!
//! `IG(v) = sum_r sum_k H(p_rk) * prod_{j<k} (1 - p_rj)` over the rays `r` of view `v` and the voxels `k` along them
//! (occlusion-aware VIG, Delmerico et al. 2018). Voxels surer than `p > 0.95` are opaque and stop a ray, voxels with
//! `p < 0.05` are transparent and carry no information; shelf walls, board and ceiling are opaque.

use crate::belief::{Belief, PushPrediction};
use crate::camera::{ViewArray, ViewId};
use crate::grid::VoxelSet;

/// How densely a view is sampled with rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayDensity {
    /// Pixels between two rays, along both axes.
    pub stride_px: usize,
}

impl RayDensity {
    /// Every 8th pixel in both axes: 80 x 60 = 4,800 rays of a 640 x 480 view.
    pub const FULL: Self = Self { stride_px: 8 };
    /// Every 16th pixel: for ranking many candidates.
    pub const COARSE: Self = Self { stride_px: 16 };
}

/// A belief's occupancy prepared for walking rays: 8-bit probabilities and skippable macro-cells.
#[derive(Clone)]
pub struct GainField {}

impl GainField {
    /// Quantises a belief's occupancy.
    pub fn new(_belief: &Belief) -> Self {
        todo!()
    }

    /// This field with a push's predicted window in place of what stands there.
    pub fn with_prediction(&self, _prediction: &PushPrediction) -> Self {
        todo!()
    }

    /// This field where the given voxels still block but no longer inform (the first view of a pair saw them).
    pub fn with_seen(&self, _seen: &VoxelSet) -> Self {
        todo!()
    }
}

/// Gain of every given view, in nats, in the order of `ids`. Parallel over views; the result does not depend on the
/// number of threads.
pub fn gain_of_views(_field: &GainField, _array: &ViewArray, _ids: &[ViewId], _density: RayDensity) -> Vec<f32> {
    todo!()
}

/// The voxels that a view's rays reach and learn from under the field.
pub fn informed_voxels(_field: &GainField, _array: &ViewArray, _view: ViewId, _density: RayDensity) -> VoxelSet {
    todo!()
}

/// Where a view's gain comes from: voxel positions and their nats, summed over rays, in ascending order of position.
pub fn gain_per_voxel(
    _field: &GainField,
    _array: &ViewArray,
    _view: ViewId,
    _density: RayDensity,
) -> Vec<(usize, f32)> {
    todo!()
}

/// Two views that are good one after the other, greedily chosen (IGV).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewPair {
    /// The best single view.
    pub first: ViewId,
    /// Its gain, nats.
    pub first_gain: f32,
    /// The best view after the first one's voxels no longer count; `None` when only one view is allowed.
    pub second: Option<ViewId>,
    /// What the second one adds, nats.
    pub second_gain: f32,
}

impl ViewPair {
    /// IGV: what both tell together, nats.
    pub fn total(&self) -> f32 {
        self.first_gain + self.second_gain
    }
}

/// The greedy best pair among the views whose `gains` entry is above zero (used views are given zero). `gains` are
/// the single-view gains of all views under the same field. The second view is found lazily: its gain under the
/// first one's remainder is at most its own single gain, so views are tried in that order until none can win.
pub fn best_pair(_field: &GainField, _array: &ViewArray, _gains: &[f32], _density: RayDensity) -> Option<ViewPair> {
    todo!()
}
