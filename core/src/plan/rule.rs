//! The rule and its guards, as functions of plain numbers.

use super::{History, PlannerSettings, Reason};
use crate::skill::SkillKind;

/// The scheduled policies push at every step whose number, counted from 1, is a multiple of this.
pub const PUSH_EVERY: usize = 5;

/// The rule: look if `max(IGV, floor) > IGM + gamma Reg`, else push. The paper's rule has no floor: 0.
///
/// `reg` is at most 0, so a push that makes labels less certain has to promise more.
pub fn look_or_push(igv: f32, floor: f32, igm: f32, reg: f32, gamma: f32) -> Reason {
    match igm + gamma * reg {
        push if igv > push => Reason::LookTellsMore,
        push if floor > push => Reason::PushTellsLittle,
        _ => Reason::PushTellsMore,
    }
}

/// Why no push is allowed in the next step of `budget`, or `None` if one is. Of several reasons, those that last are
/// named first.
pub fn push_guard(history: &History, budget: usize, map_complete: bool, settings: &PlannerSettings) -> Option<Reason> {
    let step = history.actions.len();
    let guards = [
        (history.dropped, Reason::Dropped),
        (map_complete, Reason::MapComplete),
        (step < settings.quiet_steps, Reason::TooEarly),
        (history.just_pushed(), Reason::JustPushed),
        (step + settings.closing_steps >= budget, Reason::LastStep),
    ];
    guards.into_iter().find(|(holds, _)| *holds).map(|(_, reason)| reason)
}

/// Whether the last push still needs looks: fewer than [`PlannerSettings::closing_steps`] followed it, so the map does
/// not yet show what it moved and what it opened.
pub fn still_closing(history: &History, settings: &PlannerSettings) -> bool {
    let closing = history.last_manipulation().map_or(0, |last| closing_steps(last.kind(), settings));
    history.looks_since_push().is_some_and(|looks| looks < closing)
}

/// Looks that close a manipulation: [`PlannerSettings::closing_steps`] after a push; one after a pick, whose outcome the cup
/// tells, so that nothing but what it opens has to be looked at.
pub fn closing_steps(kind: SkillKind, settings: &PlannerSettings) -> usize {
    if kind == SkillKind::Pick { 1 } else { settings.closing_steps }
}

/// Whether looking no longer gets better or worse: two consecutive best gains differ by less than `share` of the larger
/// one ([`PlannerSettings::saturation`]).
pub fn saturated(previous: f32, current: f32, share: f32) -> bool {
    let larger = previous.max(current);
    larger <= 0.0 || (current - previous).abs() < share * larger
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::ViewId;
    use crate::plan::{Action, Counted};
    use crate::skill::{Manipulation, Push};

    const LOOK: Action = Action::Look { view: ViewId(0) };
    const PUSH: Action =
        Action::Manipulate(Manipulation::Push(Push { start: [0.0, 0.1, 0.06], direction_deg: 90.0, length_m: 0.1 }));

    fn after(actions: &[Action]) -> History {
        History { actions: actions.to_vec(), ..History::default() }
    }

    #[test]
    fn the_rule_on_hand_made_numbers() {
        assert_eq!(look_or_push(100.0, 0.0, 90.0, 0.0, 0.2), Reason::LookTellsMore);
        assert_eq!(look_or_push(90.0, 0.0, 100.0, 0.0, 0.2), Reason::PushTellsMore);
        assert_eq!(look_or_push(100.0, 0.0, 100.0, 0.0, 0.2), Reason::PushTellsMore, "looking has to be better");
        // 90 > 100 + 0.2 * -60 = 88: the disturbance turns the choice.
        assert_eq!(look_or_push(90.0, 0.0, 100.0, -60.0, 0.2), Reason::LookTellsMore);
        assert_eq!(look_or_push(90.0, 0.0, 100.0, -60.0, 0.1), Reason::PushTellsMore);
        assert_eq!(look_or_push(90.0, 0.0, 100.0, -40.0, 0.2), Reason::PushTellsMore);
        // Below the floor nothing is pushed, and that is the reason where looking is not.
        assert_eq!(look_or_push(90.0, 95.0, 100.0, -40.0, 0.2), Reason::PushTellsLittle);
        assert_eq!(look_or_push(90.0, 92.0, 100.0, -40.0, 0.2), Reason::PushTellsMore);
        assert_eq!(look_or_push(93.0, 95.0, 100.0, -40.0, 0.2), Reason::LookTellsMore);
    }

    /// The guard of 20 steps after some actions.
    fn guard(actions: &[Action], settings: &PlannerSettings) -> Option<Reason> {
        push_guard(&after(actions), 20, false, settings)
    }

    #[test]
    fn no_push_in_the_first_three_steps_and_none_in_the_last() {
        let settings = PlannerSettings::default();
        for step in 0..3 {
            assert_eq!(guard(&vec![LOOK; step], &settings), Some(Reason::TooEarly));
        }
        for step in 3..19 {
            assert_eq!(guard(&vec![LOOK; step], &settings), None);
        }
        assert_eq!(guard(&[LOOK; 19], &settings), Some(Reason::LastStep));
        let unseen = settings.counting(Counted::Unseen);
        assert_eq!(guard(&[LOOK; 15], &unseen), None);
        assert_eq!(guard(&[LOOK; 16], &unseen), Some(Reason::LastStep), "looks that make good what a push disturbs");
        assert_eq!(guard(&[LOOK, PUSH, LOOK, LOOK], &unseen), None, "whoever has no rule but a schedule keeps to it");
        let quiet = PlannerSettings { quiet_steps: 4, ..settings };
        assert_eq!(guard(&[LOOK; 3], &quiet), Some(Reason::TooEarly), "a longer quiet time");
    }

    #[test]
    fn no_push_twice_in_a_row() {
        let settings = PlannerSettings::default();
        assert_eq!(guard(&[LOOK, LOOK, LOOK, PUSH], &settings), Some(Reason::JustPushed));
        assert_eq!(guard(&[LOOK, LOOK, LOOK, PUSH, LOOK], &settings), None);
    }

    #[test]
    fn a_push_is_closed_by_so_many_looks() {
        let settings = PlannerSettings::default();
        let unseen = settings.counting(Counted::Unseen);
        let closing = |looks: usize, settings| {
            let actions: Vec<Action> = [LOOK, PUSH].into_iter().chain(vec![LOOK; looks]).collect();
            still_closing(&after(&actions), settings)
        };
        assert!(closing(0, &settings) && !closing(1, &settings));
        assert!(closing(3, &unseen) && !closing(4, &unseen));
        assert!(!still_closing(&after(&[LOOK; 3]), &unseen), "no push, nothing to close");
        assert!(still_closing(&after(&[PUSH, LOOK, LOOK, LOOK, LOOK, PUSH]), &unseen), "the last push counts");
    }

    #[test]
    fn no_push_on_a_complete_map_nor_after_a_drop() {
        let settings = PlannerSettings::default();
        assert_eq!(push_guard(&after(&[LOOK; 5]), 20, true, &settings), Some(Reason::MapComplete));
        let dropped = History { dropped: true, ..after(&[LOOK; 5]) };
        assert_eq!(push_guard(&dropped, 20, false, &settings), Some(Reason::Dropped));
        assert_eq!(push_guard(&dropped, 20, true, &settings), Some(Reason::Dropped), "the lasting reason is named");
    }

    #[test]
    fn saturation_is_two_percent() {
        let share = PlannerSettings::default().saturation;
        assert!(saturated(100.0, 98.5, share) && saturated(98.5, 100.0, share) && saturated(0.0, 0.0, share));
        assert!(saturated(100.0, 97.0, 0.05), "a wider threshold");
        assert!(!saturated(100.0, 97.0, share) && !saturated(97.0, 100.0, share) && !saturated(0.0, 1.0, share));
    }
}
