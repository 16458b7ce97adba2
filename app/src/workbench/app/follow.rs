//! What follows the cursor: the gain of the chosen view, what the chosen push would do, what the step changed most.

use super::App;
use crate::workbench::changes;
use crate::workbench::model::{GainSource, LayoutKind, Preview};
use crate::workbench::panels::{causes, weighed};
use nudge_core::camera::ViewId;
use nudge_core::gain::RayDensity;
use nudge_core::plan::Gain;
use nudge_core::skill::{Manipulation, intended};
use std::sync::Arc;

impl App {
    pub(super) fn preview(&mut self, manipulation: Manipulation) {
        let Some(session) = self.model.session() else { return };
        let moment = session.moment(self.model.cursor).clone();
        let (of, setup) = ((session.id, moment.step), session.setup.clone());
        // Without networks there is no answer; of an episode that is still being checked it is asked again.
        let Some(update) = setup.update.clone() else { return };
        self.asked_preview = Some((of, manipulation));
        self.background.preview.ask(move |_| {
            let belief = moment.belief.belief();
            let intervention = intended(&setup.arm, &belief, &manipulation);
            let prediction = update.predict(&belief, std::slice::from_ref(&intervention)).pop()?;
            let (prediction, swept) = (Arc::new(prediction), Arc::new(intervention.swept));
            Some(Preview { of, manipulation, prediction, swept })
        });
    }

    pub(super) fn gain_of(&mut self, view: ViewId) {
        self.model.view = Some(view);
        let Some(session) = self.model.session() else { return };
        let moment = session.moment(self.model.cursor).clone();
        let (of, views) = ((session.id, moment.step), session.setup.views.clone());
        let counted = session.record.config.planner.counted;
        // What was seen is not known of a state that is still being repeated.
        if !moment.is_whole {
            return;
        }
        self.asked_gain = Some((of, view));
        self.background.gain.ask(move |_| {
            let gain = Gain::new(counted, &moment.belief.belief(), &moment.seen);
            let nats = gain.per_voxel(&views, view, RayDensity::FULL);
            Some(GainSource::new(of, view, nats))
        });
    }

    /// Asks again where the chosen view's gain comes from, once the cursor has moved.
    pub(super) fn follow_gain(&mut self) {
        let at = self.model.session().map(|session| (session.id, self.model.cursor.min(session.steps())));
        if let (true, Some(of), Some(view)) = (self.model.kept.layout.shows_gain(), at, self.model.view)
            && self.asked_gain != Some((of, view))
        {
            self.gain_of(view);
        }
    }

    /// In Why, asks what the step at the cursor changed most.
    pub(super) fn follow_changes(&mut self) {
        let Some(session) = self.model.session().filter(|_| self.model.kept.layout == LayoutKind::Why) else { return };
        let step = self.model.cursor.min(session.steps());
        let Some(before) = step.checked_sub(1).map(|before| session.moment(before).clone()) else { return };
        let after = session.moment(step).clone();
        let of = (session.id, step, after.is_whole);
        if self.asked_changes == Some(of) {
            return;
        }
        self.asked_changes = Some(of);
        let (catalog, belief) = (session.setup.catalog.clone(), session.record.config.belief.clone());
        self.background.changes.ask(move |_| {
            let cause = |picked| causes::of_step(&catalog, &belief, [&before, &after], picked);
            Some((of, changes::largest(&before, &after, cause)))
        });
    }

    /// In the layout of pushes, chooses the push of the decision at the cursor where none is chosen, and asks what the chosen
    /// one would do.
    pub(super) fn follow_push(&mut self) {
        let Some(session) = self.model.session().filter(|_| self.model.kept.layout == LayoutKind::Push) else { return };
        let of = (session.id, self.model.cursor.min(session.steps()));
        let Some(decision) = session.decision_after(of.1) else { return };
        let chosen = self.model.candidate.or_else(|| weighed::looked_at_first(decision));
        let push = chosen.and_then(|at| decision.candidates.get(at)).map(|candidate| candidate.manipulation);
        self.model.candidate = chosen;
        if let Some(push) = push.filter(|push| self.asked_preview != Some((of, *push))) {
            self.preview(push);
        }
    }
}
