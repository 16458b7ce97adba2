//! Why an action was chosen, in words.

use super::rule::PUSH_EVERY;
use super::{Action, Decision, PolicyKind, Reason, Rule};

impl Reason {
    /// In a few words, the same for all policies and thresholds; [`Comparison::because`](super::Comparison::because) tells
    /// more.
    pub fn words(self) -> &'static str {
        match self {
            Self::LookTellsMore => "looking tells more",
            Self::PushTellsLittle => "no push promises enough",
            Self::PushTellsMore => "pushing tells more",
            Self::PushReveals => "the push really brings something hidden into sight",
            Self::ViewOfPush => "the view that made the push worth it",
            Self::TooEarly => "no push in the first steps",
            Self::LastStep => "no push in the last steps",
            Self::JustPushed => "no push soon after a push",
            Self::MapComplete => "the map is complete",
            Self::Dropped => "an object was dropped, so no more pushes",
            Self::NoCandidate => "no feasible push",
            Self::Schedule => "the policy's schedule",
            Self::Manual => "chosen by hand",
        }
    }
}

impl Decision {
    /// Why, as the end of a sentence, with the thresholds that led to it.
    pub(super) fn because(&self) -> String {
        let Rule { policy, settings } = self.ruled_by();
        let steps = |which: &str, count: usize| match count {
            1 => format!("nothing is pushed in the {which} step"),
            count => format!("nothing is pushed in the {which} {count} steps"),
        };
        match self.reason {
            Reason::LookTellsMore
            | Reason::PushTellsLittle
            | Reason::PushTellsMore
            | Reason::PushReveals
            | Reason::MapComplete => self.reason.words().to_owned(),
            Reason::ViewOfPush => "it is the view that made the push worth it".to_owned(),
            Reason::TooEarly => steps("first", settings.quiet_steps),
            Reason::LastStep => steps("last", settings.closing_steps),
            Reason::JustPushed
                if matches!(policy, PolicyKind::Mem | PolicyKind::MemPick | PolicyKind::ClairvoyantPush)
                    && settings.closing_steps > 1 =>
            {
                format!("{} looks follow a push before the next one", settings.closing_steps)
            }
            Reason::JustPushed if policy == PolicyKind::MemPick => "a look follows every pick".to_owned(),
            Reason::JustPushed => "nothing is pushed right after a push".to_owned(),
            Reason::Dropped => "an object was dropped, so there are no more pushes".to_owned(),
            Reason::NoCandidate => "no push is feasible".to_owned(),
            Reason::Schedule => self.by_schedule(),
            Reason::Manual => "it was chosen by hand".to_owned(),
        }
    }

    /// What the schedule of the policy says, which is not the planner's rule.
    fn by_schedule(&self) -> String {
        let Rule { policy, settings } = self.ruled_by();
        let pushes = matches!(self.action, Action::Manipulate(_));
        match policy {
            PolicyKind::Mem | PolicyKind::MemPick | PolicyKind::ClairvoyantPush => {
                "the policy's schedule says so".to_owned()
            }
            PolicyKind::MemNoPush => "it is the best view, and the policy never pushes".to_owned(),
            PolicyKind::Random | PolicyKind::RandomCnabu => "the policy draws its views at random".to_owned(),
            PolicyKind::RandomPush5 | PolicyKind::RandomPush5Blind | PolicyKind::RandomViewPush5 if pushes => {
                format!("the policy draws a push at random in every {PUSH_EVERY}th step")
            }
            PolicyKind::RandomPush5 | PolicyKind::RandomPush5Blind => {
                format!("it is the best view, and the policy pushes in every {PUSH_EVERY}th step only")
            }
            PolicyKind::RandomPick5 if pushes => {
                format!("the policy picks something at random in every {PUSH_EVERY}th step")
            }
            PolicyKind::GreedyFrontPick if pushes => {
                format!("the policy picks what stands nearest to the entrance in every {PUSH_EVERY}th step")
            }
            PolicyKind::RandomPick5 | PolicyKind::GreedyFrontPick => {
                format!("it is the best view, and the policy picks in every {PUSH_EVERY}th step only")
            }
            PolicyKind::RandomViewPush5 => {
                format!("the policy draws its views at random, and pushes in every {PUSH_EVERY}th step only")
            }
            PolicyKind::Saturation => {
                let percent = (1000.0 * settings.saturation).round() / 10.0;
                if pushes {
                    format!("the best gains of two steps in a row differ by less than {percent} %")
                } else {
                    format!("it is the best view, and no two best gains in a row differ by less than {percent} %")
                }
            }
            PolicyKind::Oracle => "it is the view that really tells most".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::ViewId;
    use crate::plan::PlannerSettings;
    use crate::skill::{Manipulation, Push};
    use std::collections::BTreeSet;

    const LOOK: Action = Action::Look { view: ViewId(0) };
    const PUSH: Action =
        Action::Manipulate(Manipulation::Push(Push { start: [0.0, 0.1, 0.06], direction_deg: 90.0, length_m: 0.1 }));

    fn said(policy: PolicyKind, action: Action, reason: Reason) -> String {
        let settings = PlannerSettings { closing_steps: 4, ..PlannerSettings::default() };
        Decision { rule: Some(Rule { policy, settings }), ..Decision::unweighed(action, reason) }.because()
    }

    /// Only `mem` waits for all the looks that close a push; schedules keep to one.
    #[test]
    fn after_a_push_the_reason_says_what_the_policy_does() {
        let said = |policy| said(policy, LOOK, Reason::JustPushed);
        assert_eq!(said(PolicyKind::Mem), "4 looks follow a push before the next one");
        assert_eq!(said(PolicyKind::Saturation), "nothing is pushed right after a push");
    }

    #[test]
    fn guards_are_told_with_their_thresholds() {
        assert_eq!(said(PolicyKind::Mem, LOOK, Reason::TooEarly), "nothing is pushed in the first 3 steps");
        assert_eq!(said(PolicyKind::RandomPush5, LOOK, Reason::LastStep), "nothing is pushed in the last 4 steps");
    }

    #[test]
    fn every_policy_says_in_its_own_words_what_its_schedule_is() {
        let push = |policy| said(policy, PUSH, Reason::Schedule);
        assert_eq!(push(PolicyKind::RandomPush5Blind), "the policy draws a push at random in every 5th step");
        assert_eq!(push(PolicyKind::Saturation), "the best gains of two steps in a row differ by less than 2 %");
        let looks = [
            PolicyKind::MemNoPush,
            PolicyKind::Random,
            PolicyKind::RandomPush5,
            PolicyKind::RandomViewPush5,
            PolicyKind::Saturation,
            PolicyKind::Oracle,
        ];
        let words: BTreeSet<String> = looks.into_iter().map(|policy| said(policy, LOOK, Reason::Schedule)).collect();
        assert_eq!(words.len(), looks.len(), "{words:?}");
    }
}
