//! The pushes from a state, with what is promised of each.

use super::rollout::Rollout;
use crate::belief::PushPrediction;
use crate::gain::{Openings, RayDensity};
use crate::plan::{Counted, Gain, coarse, disturbance};
use crate::push::{Candidate, PushSampler, sample};
use crate::rng::stream;

/// One of so many pushes is drawn before what is hidden, the others from the frontier.
const ONE_HIDDEN_IN: usize = 4;

/// Feasible pushes from a state.
pub(super) struct Considered {
    /// The pushes, those from the frontier first.
    pub pushes: Vec<Candidate>,
    /// Where each was drawn.
    pub samplers: Vec<PushSampler>,
    /// What each is predicted to leave.
    pub predictions: Vec<PushPrediction>,
    /// What each promises to open, nats.
    pub gains: Vec<f32>,
    /// What each is expected to blur, nats, at most 0.
    pub regs: Vec<f32>,
    /// How long the arm's motion for each takes, seconds.
    pub motions_s: Vec<f32>,
}

impl Considered {
    /// Draws pushes from a state and weighs them.
    pub fn of(rollout: &Rollout<'_>) -> Self {
        let (belief, seen) = (&rollout.belief, rollout.sightings.seen());
        let (base, wanted) = (&rollout.recipe.base, rollout.recipe.pushes);
        let of_hidden = wanted / ONE_HIDDEN_IN;
        let (mut pushes, mut samplers) = (Vec::new(), Vec::new());
        let draws = [(PushSampler::Frontier, wanted - of_hidden), (PushSampler::Hidden, of_hidden)];
        for (which, (sampler, count)) in draws.into_iter().enumerate() {
            let mut rng = stream(rollout.seed, "worth pushes", (2 * rollout.looks.len() + which) as u64);
            let drawn = sample(sampler, belief, Some(seen), &base.arm, count, &mut rng);
            let feasible = drawn.into_iter().filter(|candidate| candidate.rejection.is_none());
            pushes.extend(feasible);
            samplers.resize(pushes.len(), sampler);
        }
        let swept: Vec<_> = pushes.iter().map(|candidate: &Candidate| candidate.swept.clone()).collect();
        let predictions = rollout.recipe.update.predict_pushes(belief, &swept);
        let gain = Gain::new(Counted::Unseen, belief, seen);
        let openings = Openings::new(gain.field(), &base.views, &coarse(&rollout.offered()), RayDensity::COARSE);
        let gains = openings.under_each(&predictions);
        let regs = predictions.iter().map(|prediction| disturbance(belief, prediction)).collect();
        let arm = &base.arm.arm;
        let duration = |push: &Candidate| push.motion.as_ref().map_or(0.0, |motion| motion.duration_s(arm) as f32);
        let motions_s = pushes.iter().map(duration).collect();
        Self { pushes, samplers, predictions, gains, regs, motions_s }
    }

    /// Position of the push that promises most, the first of equals.
    pub fn best(&self) -> Option<usize> {
        let better = |best: Option<usize>, at: usize| match best {
            Some(best) if self.gains[at] <= self.gains[best] => Some(best),
            _ => Some(at),
        };
        (0..self.gains.len()).fold(None, better)
    }
}
