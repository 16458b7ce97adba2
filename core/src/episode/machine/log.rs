//! Taking over what a log says.

use super::super::estimate::Estimate;
use super::super::npz::StoredTruth;
use super::super::record::{EpisodeRecord, StepRecord};
use super::Episode;
use crate::arm::HandPose;
use crate::belief::Belief;
use crate::environment::Environment;
use crate::plan::{Action, History};
use std::sync::Arc;

impl Episode {
    /// Adds a step of a log with the estimate after it.
    pub(in crate::episode) fn take_note(&mut self, step: &StepRecord, estimate: Estimate) {
        self.history.record(&step.decision, !step.dropped().is_empty(), step.grip());
        let to = match step.action {
            Action::Look { view } => self.hands.get(usize::from(view.0)).cloned().flatten(),
            Action::Manipulate(_) => self.arm.ready.map(HandPose::waiting),
        };
        self.hand = self.hand.take().map(|from| to.unwrap_or(from));
        self.record.steps.push(step.clone());
        self.estimate = estimate;
    }

    /// Takes over the state at the end of a log.
    pub(in crate::episode) fn adopt(
        &mut self,
        environment: Box<dyn Environment>,
        estimate: Estimate,
        history: History,
        hand: Option<HandPose>,
        logged: EpisodeRecord,
    ) {
        (self.environment, self.estimate, self.history, self.hand) = (environment, estimate, history, hand);
        self.record = logged;
    }

    /// Takes the seconds and the version of a log whose actions this episode has repeated.
    pub(in crate::episode) fn adopt_log(&mut self, logged: EpisodeRecord) {
        self.record = logged;
    }

    /// Replaces the repeated prior or last step by the one of a log, with belief and truth from the files. Which object
    /// stands where is taken from the repeated truth if the files do not tell.
    pub(in crate::episode) fn adopt_state(
        &mut self,
        logged: &EpisodeRecord,
        belief: Belief,
        truth: Option<StoredTruth>,
    ) {
        self.record.prior = logged.prior;
        if let Some(step) = self.record.steps.last_mut() {
            *step = logged.steps[step.index - 1].clone();
        }
        self.estimate.belief = Arc::new(belief);
        let repeated = || self.truth().map(|truth| truth.objects.clone());
        self.filed_truth = truth.map(|truth| Arc::new(truth.into_map(repeated)));
    }
}
