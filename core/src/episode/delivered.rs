//! What each action promised, and what it then brought.
//!
//! A look brings what it changes at once. A push or a pick moves what was known and brings nothing until somebody looks: it
//! brings what changes over it and the looks after it, until the next manipulation or the end.

use super::EpisodeRecord;
use crate::plan::Action;
use crate::score::Verdict;

/// mIoU that an action has to lose, with the looks after it, to have lowered the map.
pub const LOWERED: f64 = 0.01;

/// The state of a map, as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapState {
    /// Its entropy, nats.
    pub entropy_nats: f64,
    /// Mean IoU of free and occupied, mean IoU over the classes, and objects found, where the truth is known.
    pub judged: Option<(f64, f64, usize)>,
}

/// An action and the state that it led to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Acted {
    /// Whether it moved something, and was no look.
    pub is_manipulation: bool,
    /// What it promised, nats; `None` where that was not weighed.
    pub promised: Option<f32>,
    /// The map after it.
    pub after: MapState,
}

/// What an action promised and brought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delivered {
    /// The step, 1 for the first.
    pub step: usize,
    /// Whether it moved something, and was no look.
    pub is_manipulation: bool,
    /// The last step that counts: the step itself, or the last look after a manipulation.
    pub until: usize,
    /// What it promised, nats; `None` where that was not weighed.
    pub promised: Option<f32>,
    /// By how much the map's entropy fell, nats.
    pub entropy_nats: f64,
    /// What changed of the map, where the truth is known.
    pub judged: Option<Gained>,
}

/// What changed of a map whose truth is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gained {
    /// Change of the mean IoU of free and occupied.
    pub occupancy_iou: f64,
    /// Change of the mean IoU over the classes.
    pub semantic_miou: f64,
    /// Change of the number of objects found.
    pub found: i64,
}

impl Delivered {
    /// Whether it lowered the map: lost more than [`LOWERED`] mIoU.
    pub fn lowered(&self) -> bool {
        self.judged.is_some_and(|gained| gained.semantic_miou < -LOWERED)
    }
}

/// What the actions of an episode promised and brought, in their order; `prior` is the map before the first one.
pub fn delivered(prior: MapState, acted: &[Acted]) -> Vec<Delivered> {
    let state = |actions: usize| actions.checked_sub(1).map_or(prior, |at| acted[at].after);
    let until = |at: usize| {
        let looks = acted[at + 1..].iter().take_while(|next| !next.is_manipulation).count();
        if acted[at].is_manipulation { at + 1 + looks } else { at + 1 }
    };
    let of = |(at, action): (usize, &Acted)| {
        let (before, after) = (state(at), state(until(at)));
        let judged = before.judged.zip(after.judged).map(|(before, after)| Gained {
            occupancy_iou: after.0 - before.0,
            semantic_miou: after.1 - before.1,
            found: after.2 as i64 - before.2 as i64,
        });
        Delivered {
            step: at + 1,
            is_manipulation: action.is_manipulation,
            until: until(at),
            promised: action.promised,
            entropy_nats: before.entropy_nats - after.entropy_nats,
            judged,
        }
    };
    acted.iter().enumerate().map(of).collect()
}

impl EpisodeRecord {
    /// What its actions promised and brought, in their order.
    pub fn delivered(&self) -> Vec<Delivered> {
        let state = |actions: usize| MapState {
            entropy_nats: self.entropy_after(actions),
            judged: self.scores_after(actions).map(|scores| {
                let objects = actions.checked_sub(1).map_or(&[][..], |at| self.steps[at].objects());
                let found = objects.iter().filter(|object| object.verdict == Verdict::Found).count();
                (scores.occupancy_iou, scores.semantic_miou, found)
            }),
        };
        let acted: Vec<Acted> = (self.steps.iter())
            .map(|step| Acted {
                is_manipulation: matches!(step.action, Action::Manipulate(_)),
                promised: step.decision.promised(),
                after: state(step.index),
            })
            .collect();
        delivered(state(0), &acted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(entropy_nats: f64, miou: f64, found: usize) -> MapState {
        MapState { entropy_nats, judged: Some((0.5 + 0.5 * miou, miou, found)) }
    }

    #[test]
    fn a_push_is_credited_with_the_looks_after_it_and_a_look_with_itself() {
        let look = |after| Acted { is_manipulation: false, promised: Some(10.0), after };
        let push = |after| Acted { is_manipulation: true, promised: None, after };
        let acted = [
            look(state(80.0, 0.25, 2)),
            push(state(90.0, 0.125, 1)),
            look(state(60.0, 0.5, 3)),
            look(state(50.0, 0.5, 4)),
            push(state(70.0, 0.375, 4)),
        ];
        let told = delivered(state(100.0, 0.0, 0), &acted);
        let brought: Vec<(usize, f64, f64, i64)> = (told.iter())
            .map(|one| {
                let judged = one.judged.expect("a truth");
                (one.until, one.entropy_nats, judged.semantic_miou, judged.found)
            })
            .collect();
        let expected =
            [(1, 20.0, 0.25, 2), (4, 30.0, 0.25, 2), (3, 30.0, 0.375, 2), (4, 10.0, 0.0, 1), (5, -20.0, -0.125, 0)];
        assert_eq!(brought, expected);
        assert_eq!(told.iter().map(Delivered::lowered).collect::<Vec<_>>(), [false, false, false, false, true]);
        assert_eq!((told[0].promised, told[1].promised, told[1].is_manipulation), (Some(10.0), None, true));
    }

    #[test]
    fn without_a_truth_entropy_alone_is_told() {
        let after = MapState { entropy_nats: 3.0, judged: None };
        let acted = [Acted { is_manipulation: true, promised: Some(1.0), after }];
        let told = delivered(MapState { entropy_nats: 5.0, judged: None }, &acted);
        assert_eq!((told[0].entropy_nats, told[0].judged, told[0].lowered()), (2.0, None, false));
        assert!(delivered(after, &[]).is_empty());
    }
}
