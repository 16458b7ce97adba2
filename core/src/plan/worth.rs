//! What pushes are worth under one [`Gain`].
//!
//! Where all voxels count, a push is worth the best single view after it: a coarse ranking first, then the winner with
//! all views and rays. A coarse gain is multiplied by the ratio of ray counts (4), so that it compares with exact ones.
//! A push clears the list of used views, so every view counts. Where only unseen voxels count, a push is worth what it
//! opens to the coarse views together ([`Openings`]), and the best of these views after the winner is reported for
//! display only.

use super::CandidateRecord;
use super::gain::{By, Gain};
use crate::belief::Prediction;
use crate::camera::{ViewArray, ViewId};
use crate::gain::{Openings, RayDensity, RayGains, gain_per_voxel};
use rayon::prelude::*;

/// About how many views rank the candidates: every 5th of 300, all of an array that has fewer than twice as many.
pub const COARSE_VIEWS: usize = 60;

/// The views that rank the candidates, of those that are offered.
pub(crate) fn coarse(offered: &[ViewId]) -> Vec<ViewId> {
    offered.iter().copied().step_by((offered.len() / COARSE_VIEWS).max(1)).collect()
}

/// Where a push's worth comes from.
pub struct Sources {
    /// Voxel positions and their nats, in ascending order of position.
    pub nats: Vec<(usize, f32)>,
    /// What the worth is, as the end of a sentence.
    pub words: String,
}

impl Gain {
    /// Where a push's worth comes from under its prediction; this is the gain before it, `offered` the views that count.
    ///
    /// Where all voxels count it is the gain of `best`, the best view after the push, and `None` without one. Where only
    /// unseen voxels count it is what the push opens to all views together, as [`CandidateRecord::gain`] has it.
    pub fn push_sources(
        &self,
        array: &ViewArray,
        offered: &[ViewId],
        prediction: &Prediction,
        best: Option<ViewId>,
    ) -> Option<Sources> {
        Some(match &self.0 {
            By::Rays(field) => {
                let best = best?;
                let after = field.with_prediction(prediction);
                Sources {
                    nats: gain_per_voxel(&after, array, best, RayDensity::FULL),
                    words: format!("the best view after it, view {}", best.0),
                }
            }
            By::Coverage(field) => Sources {
                nats: Openings::new(field, array, &coarse(offered), RayDensity::COARSE).per_voxel(prediction),
                words: "what it opens to all views together".to_owned(),
            },
        })
    }
}

/// What makes a push worth it, with what is computed once for all candidates.
pub(super) struct Worth<'a> {
    gain: &'a Gain,
    array: &'a ViewArray,
    offered: &'a [ViewId],
    coarse: Vec<ViewId>,
    of: Of,
}

enum Of {
    /// The best of some single views afterwards.
    View(RayGains),
    /// What it opens to some views together.
    Opened(Openings),
}

impl<'a> Worth<'a> {
    pub(super) fn new(gain: &'a Gain, array: &'a ViewArray, offered: &'a [ViewId]) -> Self {
        let coarse = coarse(offered);
        let of = match &gain.0 {
            By::Rays(field) => Of::View(RayGains::new(field, array, &coarse, RayDensity::COARSE)),
            By::Coverage(field) => Of::Opened(Openings::new(field, array, &coarse, RayDensity::COARSE)),
        };
        Self { gain, array, offered, coarse, of }
    }

    /// The view that counts, if it is one, and the worth in nats, of every predicted push.
    pub(super) fn of_each(&self, predictions: &[Prediction]) -> Vec<(Option<ViewId>, f32)> {
        match &self.of {
            Of::View(rays) => {
                let scale = (RayDensity::COARSE.stride_px as f32 / RayDensity::FULL.stride_px as f32).powi(2);
                let of = |prediction| {
                    let (view, gain) = best_view(&self.coarse, &rays.under(prediction));
                    (view, gain * scale)
                };
                predictions.par_iter().map(of).collect()
            }
            Of::Opened(openings) => openings.under_each(predictions).into_iter().map(|gain| (None, gain)).collect(),
        }
    }

    /// Completes what is known of the best push: its worth with all views and rays where it is that of one view, else the
    /// view to show with it.
    pub(super) fn complete(&self, prediction: &Prediction, best: &mut CandidateRecord) {
        let after = self.gain.after(prediction);
        match self.of {
            Of::View(_) => {
                let gains = after.of_views(self.array, self.offered, RayDensity::FULL);
                let (view, gain) = best_view(self.offered, &gains);
                (best.view, best.gain) = (view, Some(gain));
            }
            Of::Opened(_) => {
                let gains = after.of_views(self.array, &self.coarse, RayDensity::COARSE);
                best.view = best_view(&self.coarse, &gains).0;
            }
        }
    }
}

/// The view with the largest gain, the first of equals, and that gain; no view and 0 without views.
fn best_view(ids: &[ViewId], gains: &[f32]) -> (Option<ViewId>, f32) {
    let better = |best: (Option<ViewId>, f32), (&id, &gain): (&ViewId, &f32)| {
        if best.0.is_none() || gain > best.1 { (Some(id), gain) } else { best }
    };
    ids.iter().zip(gains).fold((None, 0.0), better)
}
