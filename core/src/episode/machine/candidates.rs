//! What there is to choose from in the state that an episode is in.

use super::Episode;
use crate::plan;
use crate::skill::{Candidate, Counterfactual, Ground};

impl Episode {
    /// The world as it stands, for telling what pushes would really do; `None` where it is not simulated.
    pub fn counterfactual(&self) -> Option<Counterfactual<'_>> {
        let world = self.simulated()?.world();
        Some(Counterfactual::new(world, &self.arm, &self.views, self.estimate.sightings.seen()))
    }

    /// The candidates that a decision to be made now draws, whatever the policy makes of them.
    pub fn draw_candidates(&self) -> Vec<Candidate> {
        let config = &self.record.config;
        let actions = self.history.actions.len();
        let (seen, sampler) = (config.planner.counted.left_out(self.seen()), config.planner.push_sampler);
        let planner = config.policy.settings(&config.planner);
        let ground = Ground {
            belief: self.belief(),
            seen,
            arm: &self.arm,
            sampler,
            place: planner.place,
            unsealed: &self.history.unsealed,
        };
        plan::draw_candidates(&planner, &ground, config.seed, actions)
    }
}
