//! Pushes in three dimensions: the candidates, and of the one that is looked at what is predicted and what really happened.

use super::voxels::{Shown, Voxels};
use super::{Painter, Side, Space, at, no_arrows};
use crate::colors;
use crate::record::shapes;
use crate::record::voxels::{colored, surface};
use crate::workbench::model::{ColourBy, Display, LayoutKind};
use crate::workbench::session::Moment;
use nudge_core::plan::Action;
use nudge_core::scene::ClassId;
use nudge_core::skill::Manipulation;
use std::sync::Arc;

impl Painter {
    pub(super) fn pushes(&mut self, side: &Side, space: &Space) {
        let shown = space.display.pushes || space.layout == LayoutKind::Push;
        let any = side.decision.as_ref().is_some_and(|decision| shown && !decision.candidates.is_empty());
        if self.differs(at::CANDIDATES, format!("{:?} {any}", side.key())) {
            self.log(at::CANDIDATES, &if any { candidates(side) } else { no_arrows() });
        }
        // The push that is looked at, or else the one that led here.
        let chosen = looked_at(side, space).or_else(|| push_of(&side.moment));
        if self.differs(at::CHOSEN, format!("{:?} {chosen:?}", side.id)) {
            match chosen {
                Some(chosen) => self.log(at::CHOSEN, &shapes::chosen(&chosen)),
                None => self.log(at::CHOSEN, &no_arrows()),
            }
            self.log(at::LINES, &shapes::chosen_lines(chosen.as_ref()));
        }
    }

    /// Beside what is believed now: predicted, the difference, and what happened. Of the push that is looked at, else of the
    /// one that led here.
    pub(super) fn push_views(&mut self, side: &Side, space: &Space) {
        let looked_at = looked_at(side, space);
        let asked = space.preview.as_ref().filter(|preview| preview.of == side.key());
        let asked = asked.filter(|preview| looked_at.is_none_or(|looked_at| looked_at == preview.manipulation));
        let led_here = side
            .moment
            .outcome
            .as_deref()
            .filter(|outcome| asked.is_none() && looked_at.is_none() && outcome.prediction.is_some());
        let now = self.full(side.key(), &side.moment.belief);
        let grid = now.grid;
        if self.differs(
            at::PREDICTED,
            format!("{:?} {looked_at:?} {:?}", side.key(), asked.map(|asked| asked.manipulation)),
        ) {
            let swept = asked.map(|preview| &*preview.swept);
            let swept = swept.or_else(|| led_here.and_then(|outcome| outcome.swept.as_ref()).map(|told| &told.swept));
            let swept = swept.map_or_else(Vec::new, |swept| {
                let mut inside = vec![false; grid.voxel_count()];
                swept.iter().for_each(|index| inside[index] = true);
                surface(&grid, &inside)
            });
            self.log(at::SWEPT, &colored(&grid, &swept, |_| [120, 200, 255]).with_opacity(0.25));
            let beliefs = match (asked, &side.before) {
                (Some(preview), _) => {
                    let mut after = (*now).clone();
                    after.apply(&preview.prediction);
                    Some((now.clone(), Arc::new(after)))
                }
                (None, Some(before)) if led_here.is_some() => {
                    Some((self.full((side.id, before.step), &before.belief), now.clone()))
                }
                _ => None,
            };
            match beliefs {
                None => {
                    self.log_voxels(at::PREDICTED, &grid, Shown::nothing());
                    self.log_voxels(at::DIFFERENCE, &grid, Shown::nothing());
                }
                Some((before, after)) => {
                    let truth = side.moment.truth.as_deref();
                    let plain = Display::default();
                    let shown = Voxels { belief: &after, truth, catalog: &side.setup.catalog }.drawn(&plain, None);
                    self.log_voxels(at::PREDICTED, &grid, shown);
                    let changed = Display { colour_by: ColourBy::Change, band: [0.0, 1.0], ..plain };
                    let shown =
                        Voxels { belief: &after, truth, catalog: &side.setup.catalog }.drawn(&changed, Some(&before));
                    self.log_voxels(at::DIFFERENCE, &grid, shown);
                }
            }
        }
        let happened = happened(side, looked_at);
        let note = if happened.is_some() { "" } else { note(side, looked_at) };
        if self.differs(at::HAPPENED, format!("{:?} {:?} {note}", side.key(), happened.map(|moment| moment.step))) {
            let truth = happened.and_then(|happened| happened.truth.as_deref());
            let inside = truth.map_or_else(Vec::new, |truth| truth.occupancy.iter().map(|o| *o == 1).collect());
            let catalog = &side.setup.catalog;
            let rgb = |index: usize| {
                let label = truth.and_then(|truth| truth.labels.get(index / grid.dims[2]));
                label.map_or(colors::UNKNOWN_RGB, |label| colors::of_class(catalog, ClassId(*label)))
            };
            let outside = if truth.is_some() { surface(&grid, &inside) } else { Vec::new() };
            self.log_voxels(at::HAPPENED, &grid, Shown { outside, inside, rgb: Box::new(rgb) });
            let [_, depth, height] = side.shelf.size;
            self.log(at::HAPPENED_NOTE, &shapes::words([0.0, 0.5 * depth, 0.5 * height], note));
        }
    }
}

/// The candidates as arrows, in the colours of what they are worth by the episode's own weight of the disturbance.
fn candidates(side: &Side) -> rerun::Arrows3D {
    side.decision.as_ref().map_or_else(no_arrows, |decision| shapes::candidates(decision))
}

/// The manipulation that a moment's step did.
fn push_of(moment: &Moment) -> Option<Manipulation> {
    match moment.outcome.as_ref()?.record.action {
        Action::Manipulate(manipulation) => Some(manipulation),
        Action::Look { .. } => None,
    }
}

/// The candidate that is looked at.
fn looked_at(side: &Side, space: &Space) -> Option<Manipulation> {
    let at = space.candidate.filter(|_| space.layout == LayoutKind::Push)?;
    side.decision.as_ref()?.candidates.get(at).map(|candidate| candidate.manipulation)
}

/// The state that a push really left: of the one that is looked at if it was done, of the one that led here if none is
/// looked at, else of the one that was done next.
fn happened(side: &Side, looked_at: Option<Manipulation>) -> Option<&Arc<Moment>> {
    let after = side.after.as_ref();
    match looked_at {
        Some(push) => after.filter(|after| push_of(after) == Some(push)),
        None => {
            let here = Some(&side.moment).filter(|here| push_of(here).is_some());
            here.or(after.filter(|after| push_of(after).is_some()))
        }
    }
}

/// Why there is nothing to show of what happened.
fn note(side: &Side, looked_at: Option<Manipulation>) -> &'static str {
    match (looked_at, &side.after) {
        (Some(_), Some(_)) => "This push was not done",
        (Some(_), None) => "This push is not done yet",
        (None, _) => "No push was done here",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::fixture;
    use nudge_core::plan::GAMMA;

    #[test]
    fn push_arrows_have_the_colours_of_the_episodes_own_gamma() {
        let mut session = fixture::session(1);
        let mut decision = session.moments[4].decision().expect("step 4").clone();
        // Two that are weighed the other way round by another weight.
        for (candidate, (gain, reg)) in decision.candidates.iter_mut().zip([(100.0, -60.0), (50.0, 0.0)]) {
            (candidate.gain, candidate.reg, candidate.rejection) = (Some(gain), Some(reg), None);
        }
        let mut by = |gamma: f32| {
            decision.rule.as_mut().expect("of an episode").settings.gamma = gamma;
            decision.clone()
        };
        let (own, other) = (by(3.0), by(GAMMA));
        assert_ne!(shapes::candidates(&own), shapes::candidates(&other), "the weight matters here");
        session.pending = Some(Arc::new(own.clone()));
        assert_eq!(candidates(&Side::of(&session, session.steps())), shapes::candidates(&own));
    }

    #[test]
    fn what_happened_is_not_shown_for_a_push_that_was_not_done() {
        let session = fixture::session(1);
        // Before the push of step 4.
        let side = Side::of(&session, 3);
        let done = push_of(&session.moments[4]).expect("step 4 is a push");
        let candidates = &side.decision.as_ref().expect("weighed").candidates;
        let other = candidates
            .iter()
            .map(|candidate| candidate.manipulation)
            .find(|other| *other != done)
            .expect("another one");
        assert!(happened(&side, Some(other)).is_none());
        assert_eq!(note(&side, Some(other)), "This push was not done");
        assert_eq!(happened(&side, Some(done)).map(|moment| moment.step), Some(4));
        // After it, with none that is looked at, the one that led here.
        assert_eq!(happened(&Side::of(&session, 4), None).map(|moment| moment.step), Some(4));
        assert!(happened(&Side::of(&session, 1), None).is_none());
    }
}
