//! Why a manipulation is not feasible.

use super::SkillKind;
use crate::arm::{Hit, Obstacle};
use serde::{Deserialize, Serialize};

/// Why a drawn manipulation is not feasible.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Rejection {
    /// Nothing likely occupied is within reach of where it would touch.
    NoTarget,
    /// The arm does not reach, in any of its configurations.
    Unreachable {
        /// In which part.
        stage: Stage,
    },
    /// The arm reaches, but something is in its way.
    ArmBlocked {
        /// In which part.
        stage: Stage,
        /// What meets what.
        #[serde(flatten)]
        hit: Hit,
    },
    /// The arm could be there, but no path from the waiting configuration was found.
    NoWay,
}

impl Rejection {
    /// What stood against a manipulation of a skill.
    pub fn words(&self, skill: SkillKind) -> String {
        match self {
            Self::NoTarget => format!("nothing likely to {} is near", skill.name()),
            Self::Unreachable { stage } => format!("out of the arm's reach {}", stage.words(skill)),
            Self::ArmBlocked { stage, hit } => format!("{}, {hit}", stage.words(skill)),
            Self::NoWay => "no free way to the start was found".to_owned(),
        }
    }

    /// The reason without the place: for counting what keeps manipulations from being candidates.
    pub fn kind_words(&self, skill: SkillKind) -> String {
        match self {
            Self::ArmBlocked { stage, hit } => {
                let met = match &hit.obstacle {
                    Obstacle::Map { .. } => "what is believed to stand there".to_owned(),
                    Obstacle::Shelf { panel } => format!("the shelf's {panel}"),
                    Obstacle::Table => "the table".to_owned(),
                    Obstacle::Arm { link } => format!("the arm's own {link}"),
                };
                format!("{}, {} would meet {met}", stage.words(skill), hit.link)
            }
            other => other.words(skill),
        }
    }
}

/// A part of a manipulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// The pose in which the contact begins.
    Start,
    /// The way to the start.
    WayIn,
    /// The contact itself.
    #[serde(rename = "push")]
    Contact,
}

impl Stage {
    fn words(self, skill: SkillKind) -> String {
        match self {
            Self::Start => "at the start".to_owned(),
            Self::WayIn => "on the way in".to_owned(),
            Self::Contact => format!("along the {}", skill.name()),
        }
    }
}
