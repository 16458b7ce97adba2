//! The worth of pushes: IGM and Reg of every candidate.

use super::ahead::weigh_ahead;
use super::worth::Worth;
use super::{CandidateRecord, Gain, PlannerSettings, Situation};
use crate::arm::PhasedMotion;
use crate::belief::{Belief, FloorPlan, Intervention, Prediction, SOLID};
use crate::rng::stream;
use crate::skill::{Candidate, Ground, PushSampler, PushTruth, SkillKind, random_candidate};
use rayon::prelude::*;

/// The pushes that were weighed.
pub(super) struct Weighed {
    pub candidates: Vec<CandidateRecord>,
    /// Position of the push with the largest gain; `None` when no candidate is feasible.
    pub best: Option<usize>,
    /// The arm's motion for each candidate; `None` for those that were rejected.
    pub motions: Vec<Option<PhasedMotion>>,
}

impl Weighed {
    /// Position of the candidate of a skill with the largest gain, the first of equals.
    pub(super) fn best_of(&self, kind: SkillKind) -> Option<usize> {
        let gain = |at: usize| self.candidates[at].gain.filter(|_| self.candidates[at].manipulation.kind() == kind);
        let weighed = (0..self.candidates.len()).filter_map(|at| Some((at, gain(at)?)));
        weighed
            .fold(None, |best, (at, gain)| best.filter(|(_, most)| *most >= gain).or(Some((at, gain))))
            .map(|(at, _)| at)
    }

    /// The arm's motion for the best push.
    pub(super) fn take_motion(&mut self) -> Option<PhasedMotion> {
        self.best.and_then(|at| self.motions[at].take())
    }
}

/// Draws the candidates of a decision, rejected ones too, skill by skill in their order: the same ones whenever it is asked.
///
/// `actions` is the number of actions so far; [`Skill::sample`](crate::skill::Skill::sample) says what else they depend on.
pub fn draw_candidates(settings: &PlannerSettings, ground: &Ground<'_>, seed: u64, actions: usize) -> Vec<Candidate> {
    let of = |kind: crate::skill::SkillKind| {
        kind.sample(ground, settings.candidates, &mut stream(seed, kind.stream(), actions as u64))
    };
    settings.skills.kinds().flat_map(of).collect()
}

/// `Reg = min(0, H_s(belief) - H_s(predicted))`, nats.
pub fn disturbance(belief: &Belief, prediction: &Prediction) -> f32 {
    prediction.semantic_entropy_drop(belief).min(0.0) as f32
}

/// Draws candidates and weighs the feasible ones. The best is the one of most worth, the first of equals.
pub(super) fn weigh_pushes(settings: &PlannerSettings, situation: &Situation<'_>, gain: &Gain) -> Weighed {
    let (belief, update, views) = (situation.belief, situation.update, situation.views);
    let actions = situation.history.actions.len();
    let drawn = draw_candidates(settings, &situation.ground(settings), situation.seed, actions);
    let mut candidates: Vec<CandidateRecord> = drawn.iter().map(|drawn| record_of(drawn, situation)).collect();
    let motions: Vec<Option<PhasedMotion>> = drawn.iter().map(|drawn| drawn.motion.clone()).collect();
    let solid = FloorPlan::new(belief, SOLID);
    let (feasible, interventions): (Vec<usize>, Vec<Intervention>) = drawn
        .into_par_iter()
        .enumerate()
        .filter(|(_, candidate)| candidate.rejection.is_none())
        .map(|(at, candidate)| {
            let skill = candidate.manipulation.skill();
            (at, skill.intervention(belief, &solid, candidate.swept))
        })
        .unzip();

    let offered = situation.offered();
    let worth = Worth::new(gain, views, &offered);
    let predictions = update.predict(belief, &interventions);
    let predicted: Vec<(usize, &Prediction)> = feasible.into_iter().zip(&predictions).collect();
    for (&(at, prediction), (view, gain)) in predicted.iter().zip(worth.of_each(&predictions)) {
        candidates[at].gain = Some(gain);
        candidates[at].view = view;
        candidates[at].reg = Some(disturbance(belief, prediction));
    }
    let is_pick = |(at, _): &(usize, &Prediction)| candidates[*at].manipulation.kind() == SkillKind::Pick;
    let picks: Vec<(usize, &Prediction)> = predicted.iter().copied().filter(is_pick).collect();
    weigh_ahead(settings, situation, &worth, &mut candidates, &picks);
    let mut best: Option<(usize, &Prediction)> = None;
    for &(at, prediction) in &predicted {
        if best.is_none_or(|(best, _)| candidates[at].gain > candidates[best].gain) {
            best = Some((at, prediction));
        }
    }
    let best = best.map(|(at, prediction)| {
        worth.complete(prediction, &mut candidates[at]);
        at
    });
    Weighed { candidates, best, motions }
}

/// Weighs pushes as [`weigh_pushes`], but the best one is the one that really brings most objects into sight, hidden ones
/// taken off, and of equals the one that opens most space, the first of them. What it really does comes with it.
pub(super) fn weigh_clairvoyantly(
    settings: &PlannerSettings,
    situation: &Situation<'_>,
    gain: &Gain,
) -> (Weighed, Option<PushTruth>) {
    let mut weighed = weigh_pushes(settings, situation, gain);
    let (at, motions): (Vec<usize>, Vec<PhasedMotion>) =
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

/// Draws one feasible manipulation at random, pushes from the frontier as in the paper, with those that were rejected on the
/// way.
pub(super) fn random_push(situation: &Situation<'_>, settings: &PlannerSettings) -> Weighed {
    let actions = situation.history.actions.len();
    let ground = Ground { seen: None, sampler: PushSampler::Frontier, ..situation.ground(settings) };
    let drawn = random_candidate(settings.skills, &ground, situation.seed, actions);
    let candidates: Vec<CandidateRecord> = drawn.iter().map(|drawn| record_of(drawn, situation)).collect();
    let best = candidates.iter().position(|candidate| candidate.rejection.is_none());
    let motions = drawn.into_iter().map(|drawn| drawn.motion).collect();
    Weighed { candidates, best, motions }
}

/// Draws candidates, of which the best is the feasible one that touches nearest to the entrance, the first of equals.
pub(super) fn front_most(situation: &Situation<'_>, settings: &PlannerSettings) -> Weighed {
    let actions = situation.history.actions.len();
    let drawn = draw_candidates(settings, &situation.ground(settings), situation.seed, actions);
    let candidates: Vec<CandidateRecord> = drawn.iter().map(|drawn| record_of(drawn, situation)).collect();
    let depth = |at: &usize| drawn[*at].contact.y;
    let best = (0..drawn.len()).filter(|at| drawn[*at].rejection.is_none()).min_by_key(depth);
    let motions = drawn.into_iter().map(|drawn| drawn.motion).collect();
    Weighed { candidates, best, motions }
}

fn record_of(candidate: &Candidate, situation: &Situation<'_>) -> CandidateRecord {
    let rejection = candidate.rejection.clone();
    let motion_s = candidate.motion.as_ref().map(|motion| motion.duration_s(&situation.arm.arm));
    CandidateRecord { rejection, motion_s, ..CandidateRecord::of(candidate.manipulation) }
}
