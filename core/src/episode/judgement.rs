//! What is said of a state by comparing it with the truth, and how files keep it where there is none.

use crate::belief::Belief;
use crate::scene::Catalog;
use crate::score::{ObjectVerdict, SCORED_HEIGHT_M, Scores, object_verdicts};
use crate::world::TruthMap;
use serde::{Deserialize, Serialize, Serializer};

/// Said once wherever an episode without truth is shown.
pub const NO_TRUTH: &str = "no ground truth";

/// What only somebody who knows the truth can say of a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judgement {
    /// Scores of the belief after the step.
    pub scores: Scores,
    /// Verdict per object of the scene, and hallucinated ones.
    pub objects: Vec<ObjectVerdict>,
    /// Names of objects that this step dropped, `class#id`.
    pub dropped: Vec<String>,
    /// Sum of object displacements of this step, metres.
    pub displacement_m: f64,
}

impl Judgement {
    /// Judges a belief.
    pub(super) fn of(
        belief: &Belief,
        truth: &TruthMap,
        catalog: &Catalog,
        dropped: Vec<String>,
        displacement_m: f64,
    ) -> Self {
        let objects = object_verdicts(belief, truth, catalog);
        Self { scores: Scores::of(belief, truth), objects, dropped, displacement_m }
    }
}

/// Entropy of a belief as the scores have it, for beliefs that are not scored: occupancy in the scored volume and semantics
/// together, nats.
pub(super) fn entropy_nats(belief: &Belief) -> f64 {
    belief.occupancy_entropy(belief.grid.levels_below(SCORED_HEIGHT_M)) + belief.semantic_entropy()
}

/// The state before the first action: its scores, or without a truth its entropy alone.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawPrior")]
pub struct Prior {
    /// Entropy of the map, nats.
    pub entropy_nats: f64,
    /// Scores of the prior, where the truth is known.
    pub scores: Option<Scores>,
}

impl Prior {
    /// Judges the prior.
    pub(super) fn of(belief: &Belief, truth: Option<&TruthMap>) -> Self {
        match truth {
            Some(truth) => Scores::of(belief, truth).into(),
            None => Self { entropy_nats: entropy_nats(belief), scores: None },
        }
    }
}

impl From<Scores> for Prior {
    fn from(scores: Scores) -> Self {
        Self { entropy_nats: scores.entropy_nats, scores: Some(scores) }
    }
}

impl Serialize for Prior {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Entropy {
            entropy_nats: f64,
        }
        match &self.scores {
            Some(scores) => scores.serialize(serializer),
            None => Entropy { entropy_nats: self.entropy_nats }.serialize(serializer),
        }
    }
}

/// A prior as it is read: all of its scores, or none.
#[derive(Deserialize)]
struct RawPrior {
    entropy_nats: f64,
    occupancy_iou: Option<f64>,
    occupied_iou: Option<f64>,
    semantic_miou: Option<f64>,
    mece_occupancy: Option<f64>,
    mece_semantics: Option<f64>,
}

impl TryFrom<RawPrior> for Prior {
    type Error = String;

    fn try_from(raw: RawPrior) -> Result<Self, String> {
        let entropy_nats = raw.entropy_nats;
        let numbers = [
            ("occupancy_iou", raw.occupancy_iou),
            ("occupied_iou", raw.occupied_iou),
            ("semantic_miou", raw.semantic_miou),
            ("mece_occupancy", raw.mece_occupancy),
            ("mece_semantics", raw.mece_semantics),
        ];
        if numbers.iter().all(|(_, number)| number.is_none()) {
            return Ok(Self { entropy_nats, scores: None });
        }
        let mut values = [0.0; 5];
        for (value, (name, number)) in values.iter_mut().zip(numbers) {
            *value = number.ok_or_else(|| missing(name))?;
        }
        let [occupancy_iou, occupied_iou, semantic_miou, mece_occupancy, mece_semantics] = values;
        let scores =
            Scores { occupancy_iou, occupied_iou, semantic_miou, entropy_nats, mece_occupancy, mece_semantics };
        Ok(scores.into())
    }
}

/// The members of a step that make up its judgement, as they are read.
pub(super) struct RawJudgement {
    pub(super) scores: Option<Scores>,
    pub(super) objects: Option<Vec<ObjectVerdict>>,
    pub(super) dropped: Option<Vec<String>>,
    pub(super) displacement_m: Option<f64>,
}

impl RawJudgement {
    /// The judgement, if all of it is there; nothing, if nothing of it is.
    pub(super) fn checked(self) -> Result<Option<Judgement>, String> {
        let Self { scores, objects, dropped, displacement_m } = self;
        let there = [scores.is_some(), objects.is_some(), dropped.is_some(), displacement_m.is_some()];
        if there == [false; 4] {
            return Ok(None);
        }
        Ok(Some(Judgement {
            scores: scores.ok_or_else(|| missing("scores"))?,
            objects: objects.ok_or_else(|| missing("objects"))?,
            dropped: dropped.ok_or_else(|| missing("dropped"))?,
            displacement_m: displacement_m.ok_or_else(|| missing("displacement_m"))?,
        }))
    }
}

fn missing(name: &str) -> String {
    format!("missing field `{name}`")
}
