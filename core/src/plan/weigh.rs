//! The worth of pushes: IGM and Reg of every candidate.

use super::{CandidateRecord, Counted, PlannerSettings, Situation, look};
use crate::arm::{ArmTool, PushMotion};
use crate::belief::{Belief, PushPrediction, SweptPush};
use crate::camera::{ViewArray, ViewId};
use crate::gain::{GainField, Openings, RayDensity, RayGains, gain_of_views, gain_per_voxel};
use crate::grid::VoxelSet;
use crate::push::{Candidate, PushSampler, PushTruth, sample};
use crate::rng::{ChaCha8Rng, stream};
use rayon::prelude::*;

/// About how many views rank the candidates: every 5th of 300, all of an array that has fewer than twice as many.
pub const COARSE_VIEWS: usize = 60;

/// The pushes that were weighed.
pub(super) struct Weighed {
    pub candidates: Vec<CandidateRecord>,
    /// Position of the push with the largest gain; `None` when no candidate is feasible.
    pub best: Option<usize>,
    /// The arm's motion for each candidate; `None` for those that were rejected.
    pub motions: Vec<Option<PushMotion>>,
}

impl Weighed {
    /// The arm's motion for the best push.
    pub(super) fn take_motion(&mut self) -> Option<PushMotion> {
        self.best.and_then(|at| self.motions[at].take())
    }
}

/// Draws the push candidates of a decision, rejected ones too, in their order: the same ones whenever it is asked.
///
/// `actions` is the number of actions so far; [`sample`] says what else they depend on.
pub fn draw_pushes(
    settings: &PlannerSettings,
    belief: &Belief,
    seen: Option<&VoxelSet>,
    arm: &ArmTool,
    seed: u64,
    actions: usize,
) -> Vec<Candidate> {
    let mut rng = push_stream(seed, actions);
    sample(settings.push_sampler, belief, seen, arm, settings.candidates, &mut rng)
}

/// `Reg = min(0, H_s(belief) - H_s(predicted))`, nats.
pub fn disturbance(belief: &Belief, prediction: &PushPrediction) -> f32 {
    prediction.semantic_entropy_drop(belief).min(0.0) as f32
}

/// Draws candidates and weighs the feasible ones.
///
/// Where all voxels count, a push is worth the best single view after it: a coarse ranking first, then the winner with
/// all views and rays. A coarse gain is multiplied by the ratio of ray counts (4), so that it compares with exact ones.
/// A push clears the list of used views, so every view counts. Where only unseen voxels count, a push is worth what it
/// opens to the coarse views together ([`Openings`]), and the best of these views after the winner is reported for
/// display only.
pub(super) fn weigh_pushes(settings: &PlannerSettings, situation: &Situation<'_>, field: &GainField) -> Weighed {
    let (belief, update, views) = (situation.belief, situation.update, situation.views);
    let actions = situation.history.actions.len();
    let drawn = draw_pushes(settings, belief, situation.seen, situation.arm, situation.seed, actions);
    let mut candidates: Vec<CandidateRecord> = drawn.iter().map(|drawn| record_of(drawn, situation)).collect();
    let motions: Vec<Option<PushMotion>> = drawn.iter().map(|drawn| drawn.motion.clone()).collect();
    let (feasible, pushes): (Vec<usize>, Vec<SweptPush>) = drawn
        .into_iter()
        .enumerate()
        .filter(|(_, candidate)| candidate.rejection.is_none())
        .map(|(at, candidate)| (at, candidate.swept))
        .unzip();

    let offered = situation.offered();
    let worth = Worth::new(settings.counted, field, views, coarse(&offered));
    let predictions = update.predict_pushes(belief, &pushes);
    let mut best: Option<(usize, &PushPrediction)> = None;
    for ((prediction, (view, gain)), &at) in predictions.iter().zip(worth.of_each(&predictions)).zip(&feasible) {
        candidates[at].gain = Some(gain);
        candidates[at].view = view;
        candidates[at].reg = Some(disturbance(belief, prediction));
        if best.is_none_or(|(best, _)| candidates[at].gain > candidates[best].gain) {
            best = Some((at, prediction));
        }
    }
    let best = best.map(|(at, prediction)| {
        let after = field.with_prediction(prediction);
        match &worth {
            Worth::View(..) => {
                let gains = gain_of_views(&after, views, &offered, RayDensity::FULL);
                let (view, gain) = best_view(&offered, &gains);
                (candidates[at].view, candidates[at].gain) = (view, Some(gain));
            }
            Worth::Opened(_, coarse) => {
                let gains = look::gains(&after, views, coarse, RayDensity::COARSE);
                candidates[at].view = best_view(coarse, &gains).0;
            }
        }
        at
    });
    Weighed { candidates, best, motions }
}

/// Weighs pushes as [`weigh_pushes`], but the best one is the one that really brings most objects into sight, hidden ones
/// taken off, and of equals the one that opens most space, the first of them. What it really does comes with it.
pub(super) fn weigh_clairvoyantly(
    settings: &PlannerSettings,
    situation: &Situation<'_>,
    field: &GainField,
) -> (Weighed, Option<PushTruth>) {
    let mut weighed = weigh_pushes(settings, situation, field);
    let (at, motions): (Vec<usize>, Vec<PushMotion>) =
        weighed.motions.iter().enumerate().filter_map(|(at, motion)| Some((at, motion.clone()?))).unzip();
    let mut best: Option<(usize, PushTruth)> = None;
    for (at, truth) in at.into_iter().zip((situation.really_push)(&motions)) {
        let worth = |truth: &PushTruth| (truth.balance(), truth.opened.len());
        if best.as_ref().is_none_or(|(_, best)| worth(&truth) > worth(best)) {
            best = Some((at, truth));
        }
    }
    weighed.best = best.as_ref().map(|(at, _)| *at);
    (weighed, best.map(|(_, truth)| truth))
}

/// The views that rank the candidates, of those that are offered.
pub(crate) fn coarse(offered: &[ViewId]) -> Vec<ViewId> {
    offered.iter().copied().step_by((offered.len() / COARSE_VIEWS).max(1)).collect()
}

/// Where a push's worth comes from under its prediction: voxel positions and their nats, in ascending order of position.
/// `field` is that of the belief before it, `offered` the views that count.
///
/// Where all voxels count it is the gain of `best`, the best view after the push, and nothing without one. Where only
/// unseen voxels count it is what the push opens to all views together, as [`CandidateRecord::gain`] has it.
pub fn push_sources(
    counted: Counted,
    field: &GainField,
    array: &ViewArray,
    offered: &[ViewId],
    prediction: &PushPrediction,
    best: Option<ViewId>,
) -> Vec<(usize, f32)> {
    match (counted, best) {
        (Counted::All, None) => Vec::new(),
        (Counted::All, Some(best)) => gain_per_voxel(&field.with_prediction(prediction), array, best, RayDensity::FULL),
        (Counted::Unseen, _) => Openings::new(field, array, &coarse(offered), RayDensity::COARSE).per_voxel(prediction),
    }
}

/// What makes a push worth it, and what is computed once for all candidates.
enum Worth {
    /// The best of some single views afterwards.
    View(RayGains, Vec<ViewId>),
    /// What it opens to some views together.
    Opened(Openings, Vec<ViewId>),
}

impl Worth {
    fn new(counted: Counted, field: &GainField, array: &ViewArray, coarse: Vec<ViewId>) -> Self {
        match counted {
            Counted::All => Self::View(RayGains::new(field, array, &coarse, RayDensity::COARSE), coarse),
            Counted::Unseen => Self::Opened(Openings::new(field, array, &coarse, RayDensity::COARSE), coarse),
        }
    }

    /// The view that counts, if it is one, and the worth in nats, of every predicted push.
    fn of_each(&self, predictions: &[PushPrediction]) -> Vec<(Option<ViewId>, f32)> {
        match self {
            Self::View(rays, coarse) => {
                let scale = (RayDensity::COARSE.stride_px as f32 / RayDensity::FULL.stride_px as f32).powi(2);
                let of = |prediction| {
                    let (view, gain) = best_view(coarse, &rays.under(prediction));
                    (view, gain * scale)
                };
                predictions.par_iter().map(of).collect()
            }
            Self::Opened(openings, _) => {
                openings.under_each(predictions).into_iter().map(|gain| (None, gain)).collect()
            }
        }
    }
}

/// Draws one feasible push at random, from the frontier as in the paper, with those that were rejected on the way.
pub(super) fn random_push(situation: &Situation<'_>) -> Weighed {
    let (belief, arm) = (situation.belief, situation.arm);
    let mut rng = push_stream(situation.seed, situation.history.actions.len());
    let drawn = sample(PushSampler::Frontier, belief, None, arm, 1, &mut rng);
    let candidates: Vec<CandidateRecord> = drawn.iter().map(|drawn| record_of(drawn, situation)).collect();
    let best = candidates.iter().position(|candidate| candidate.rejection.is_none());
    let motions = drawn.into_iter().map(|drawn| drawn.motion).collect();
    Weighed { candidates, best, motions }
}

fn push_stream(seed: u64, actions: usize) -> ChaCha8Rng {
    stream(seed, "pushes", actions as u64)
}

fn record_of(candidate: &Candidate, situation: &Situation<'_>) -> CandidateRecord {
    let rejection = candidate.rejection.clone();
    let motion_s = candidate.motion.as_ref().map(|motion| motion.duration_s(&situation.arm.arm));
    CandidateRecord { rejection, motion_s, ..CandidateRecord::of(candidate.swept.push) }
}

/// The view with the largest gain, the first of equals, and that gain; no view and 0 without views.
fn best_view(ids: &[ViewId], gains: &[f32]) -> (Option<ViewId>, f32) {
    let better = |best: (Option<ViewId>, f32), (&id, &gain): (&ViewId, &f32)| {
        if best.0.is_none() || gain > best.1 { (Some(id), gain) } else { best }
    };
    ids.iter().zip(gains).fold((None, 0.0), better)
}
