//! Two views that are good one after the other.

use super::ray::Camera;
use super::{GainField, RayDensity, nats, view_gain};
use crate::camera::{ViewArray, ViewId};
use rayon::prelude::*;

/// Views whose second gain is computed before looking again whether one of the others can still win. Fixed, so that
/// the work does not depend on the number of threads.
const BATCH: usize = 8;

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
/// the single-view gains of all views under the same field and density. The first of equals wins.
///
/// The second view is judged by [`GainField::with_view`] of the first. It is found lazily: its gain under the first
/// one's remainder is at most its own single gain, so views are tried in that order until none can win.
pub fn best_pair(field: &GainField, array: &ViewArray, gains: &[f32], density: RayDensity) -> Option<ViewPair> {
    let mut order: Vec<usize> = (0..gains.len()).filter(|&view| gains[view] > 0.0).collect();
    order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]).then(a.cmp(&b)));
    let (&first, others) = order.split_first()?;
    let remainder = field.with_view(array, ViewId(first as u16));
    let mut second: Option<(usize, f32)> = None;
    for batch in others.chunks(BATCH) {
        if second.is_some_and(|(_, gain)| gains[batch[0]] < gain) {
            break;
        }
        let added: Vec<f32> = batch
            .par_iter()
            .map(|&view| nats(view_gain(&remainder, &Camera::of(&remainder, array, ViewId(view as u16)), density)))
            .collect();
        for (&view, gain) in batch.iter().zip(added) {
            if second.is_none_or(|(best, most)| gain > most || gain == most && view < best) {
                second = Some((view, gain));
            }
        }
    }
    Some(ViewPair {
        first: ViewId(first as u16),
        first_gain: gains[first],
        second: second.map(|(view, _)| ViewId(view as u16)),
        second_gain: second.map_or(0.0, |(_, gain)| gain),
    })
}
