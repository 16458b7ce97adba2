//! The pushes from a state, with what is promised of each.

use crate::belief::Prediction;
use crate::skill::{Candidate, PushSampler};

/// Feasible pushes from a state.
pub(super) struct Considered {
    /// The pushes, those from the frontier first.
    pub pushes: Vec<Candidate>,
    /// Where each was drawn.
    pub samplers: Vec<PushSampler>,
    /// What each is predicted to leave.
    pub predictions: Vec<Prediction>,
    /// What each promises to open, nats.
    pub gains: Vec<f32>,
    /// What each is expected to blur, nats, at most 0.
    pub regs: Vec<f32>,
    /// How long the arm's motion for each takes, seconds.
    pub motions_s: Vec<f32>,
}

impl Considered {
    /// Position of the push that promises most, the first of equals.
    pub fn best(&self) -> Option<usize> {
        let better = |best: Option<usize>, at: usize| match best {
            Some(best) if self.gains[at] <= self.gains[best] => Some(best),
            _ => Some(at),
        };
        (0..self.gains.len()).fold(None, better)
    }
}
