//! The policies by name, and what each of them does.

use super::PlannerSettings;
use crate::arm::Arm;
use crate::belief::{CLASSICAL, CNABU};
use crate::named;
use crate::skill::{SkillKind, SkillSet};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A rule that turns a belief and a history into the next action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PolicyKind {
    /// Best view or best push, by the rule of [`look_or_push`](super::look_or_push).
    Mem,
    /// Best view, never a push.
    MemNoPush,
    /// Random views on the classical belief, never a push.
    Random,
    /// Random views on the network belief, never a push.
    RandomCnabu,
    /// Best views; a random push, predicted, every 5th step.
    #[serde(rename = "random-push-5")]
    RandomPush5,
    /// Best views; a random push, not predicted, every 5th step.
    #[serde(rename = "random-push-5-blind")]
    RandomPush5Blind,
    /// Random views; a random push, not predicted, every 5th step.
    #[serde(rename = "random-view-push-5")]
    RandomViewPush5,
    /// Best views; a random push when two consecutive gains differ by less than 2 %.
    Saturation,
    /// As [`Self::Mem`], and the arm may also pick: it takes objects by suction and sets them down elsewhere.
    MemPick,
    /// Best views; a random pick, predicted, every 5th step.
    #[serde(rename = "random-pick-5")]
    RandomPick5,
    /// Best views; every 5th step it picks what stands nearest to the entrance.
    GreedyFrontPick,
    /// Clairvoyant: the view whose real observation cuts the entropy most; never a push.
    Oracle,
    /// Clairvoyant: as [`Self::Mem`], but pushes are carried out in copies of the world beforehand, and the one that really
    /// brings most objects into sight is made.
    ClairvoyantPush,
}

impl PolicyKind {
    /// Every policy, in the order of the table in METHOD.md.
    pub const ALL: [Self; 13] = [
        Self::Mem,
        Self::MemNoPush,
        Self::RandomCnabu,
        Self::Random,
        Self::RandomPush5,
        Self::RandomPush5Blind,
        Self::RandomViewPush5,
        Self::Saturation,
        Self::MemPick,
        Self::RandomPick5,
        Self::GreedyFrontPick,
        Self::Oracle,
        Self::ClairvoyantPush,
    ];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mem => "mem",
            Self::MemNoPush => "mem-no-push",
            Self::RandomCnabu => "random-cnabu",
            Self::Random => "random",
            Self::RandomPush5 => "random-push-5",
            Self::RandomPush5Blind => "random-push-5-blind",
            Self::RandomViewPush5 => "random-view-push-5",
            Self::Saturation => "saturation",
            Self::MemPick => "mem-pick",
            Self::RandomPick5 => "random-pick-5",
            Self::GreedyFrontPick => "greedy-front-pick",
            Self::Oracle => "oracle",
            Self::ClairvoyantPush => "clairvoyant-push",
        }
    }

    /// Whether a push is predicted into the belief (sigma_m) or leaves it as it is until the next look.
    pub fn predicts_pushes(self) -> bool {
        !matches!(self, Self::RandomPush5Blind | Self::RandomViewPush5)
    }

    /// Whether the policy asks what a look or a push would really bring, which only a simulation can tell.
    pub fn knows_the_future(self) -> bool {
        matches!(self, Self::Oracle | Self::ClairvoyantPush)
    }

    /// Whether the policy draws at random (views, pushes, push candidates). The others do the same for every seed.
    pub fn is_seeded(self) -> bool {
        !matches!(self, Self::MemNoPush | Self::Oracle)
    }

    /// Whether it takes objects by suction, so that the hand needs a cup.
    pub fn picks(self) -> bool {
        matches!(self, Self::MemPick | Self::RandomPick5 | Self::GreedyFrontPick)
    }

    /// Whether an arm has the hand that the policy needs.
    ///
    /// # Errors
    /// One line that names the arm, for a policy that picks with a hand without a suction cup.
    pub fn check_hand(self, arm: &Arm) -> Result<()> {
        if !self.picks() || arm.cup.is_some() {
            return Ok(());
        }
        let message = format!(
            "policy {self} takes objects by suction, and the hand of {} has no cup; choose --arm suction",
            arm.name
        );
        Err(Error::Usage(message))
    }

    /// The settings with the skills that the policy is about.
    pub fn settings(self, settings: &PlannerSettings) -> PlannerSettings {
        let skills = match self {
            Self::MemPick => SkillSet::of(&[SkillKind::Push, SkillKind::Pick]),
            Self::RandomPick5 | Self::GreedyFrontPick => SkillSet::of(&[SkillKind::Pick]),
            _ => settings.skills,
        };
        PlannerSettings { skills, ..*settings }
    }

    /// Name of the belief update that the policy is published with.
    pub fn default_belief(self) -> &'static str {
        match self {
            Self::Random => CLASSICAL,
            _ => CNABU,
        }
    }
}

impl fmt::Display for PolicyKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for PolicyKind {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        named::parse(&Self::ALL, name).map_err(|known| Error::Usage(format!("unknown policy \"{name}\"; {known}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_same_on_the_command_line_and_in_files() {
        for policy in PolicyKind::ALL {
            assert_eq!(policy.to_string().parse::<PolicyKind>().expect("its own name"), policy);
            assert_eq!(serde_json::to_string(&policy).expect("json"), format!("\"{policy}\""));
        }
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let error = "mems".parse::<PolicyKind>().expect_err("unknown");
        assert_eq!(error.exit_code(), 2);
        let message = error.to_string();
        assert!(message.contains("\"mems\""), "{message}");
        assert!(PolicyKind::ALL.iter().all(|policy| message.contains(policy.name())), "{message}");
        assert!(!message.contains('\n'));
    }

    #[test]
    fn what_the_table_says_of_beliefs() {
        let blind: Vec<PolicyKind> = PolicyKind::ALL.into_iter().filter(|policy| !policy.predicts_pushes()).collect();
        assert_eq!(blind, [PolicyKind::RandomPush5Blind, PolicyKind::RandomViewPush5]);
        let classical: Vec<PolicyKind> =
            PolicyKind::ALL.into_iter().filter(|policy| policy.default_belief() == CLASSICAL).collect();
        assert_eq!(classical, [PolicyKind::Random]);
    }
}
