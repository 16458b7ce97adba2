//! An episode: scene, policy and seed, and the sequence of decisions, observations, beliefs and scores.
//!
//! [`Episode`] is a state machine that the command line and the window drive one action at a time: [`Episode::decide`]
//! says what the policy would do and changes nothing, [`Episode::act`] does it. A clone is a branch. The directory that
//! an episode is written to, step by step, is [`EpisodeDir`].

use crate::Result;
use crate::belief::{Belief, BeliefUpdate, PushPrediction, SweptPush};
use crate::camera::{Image, MapObservation, ViewArray};
use crate::plan::{Action, Decision, History, PlannerSettings, PolicyKind};
use crate::scene::{Body, Catalog, Scene};
use crate::score::{ObjectVerdict, Scores};
use crate::world::{PushOutcome, TruthMap};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What an episode is run with, beside its scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeConfig {
    /// The rule that chooses actions.
    pub policy: PolicyKind,
    /// Name of the belief update: `classical` or `cnabu`.
    pub belief: String,
    /// Seed of every random choice.
    pub seed: u64,
    /// Number of actions.
    pub budget: usize,
    /// Name of the view array.
    pub views: String,
    /// The planner's numbers.
    pub planner: PlannerSettings,
}

/// Wall-clock seconds of one step, by what they went into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepSeconds {
    /// Deciding.
    pub decide: f64,
    /// Taking the image or simulating the push.
    pub act: f64,
    /// Updating belief, truth and scores.
    pub update: f64,
    /// Writing files and recording.
    pub record: f64,
}

/// One step as `episode.json` keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// 1 for the first action; the belief after it is `beliefs/001.npz`.
    pub index: usize,
    /// What was done.
    pub action: Action,
    /// What was weighed.
    pub decision: Decision,
    /// Scores of the belief after the step.
    pub scores: Scores,
    /// Verdict per object of the scene, and hallucinated ones.
    pub objects: Vec<ObjectVerdict>,
    /// Names of objects that this step dropped, `class#id`.
    pub dropped: Vec<String>,
    /// Sum of object displacements of this step, metres.
    pub displacement_m: f64,
    /// Where the time went.
    pub seconds: StepSeconds,
}

/// `episode.json`, and what `nudge run --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRecord {
    /// Format number, 1.
    pub format: u32,
    /// Version of the program that wrote it.
    pub version: String,
    /// The scene, embedded with its meshes.
    pub scene: Scene,
    /// Policy, belief, seed, budget, views and planner settings.
    #[serde(flatten)]
    pub config: EpisodeConfig,
    /// Scores of the prior.
    pub prior: Scores,
    /// The steps so far.
    pub steps: Vec<StepRecord>,
}

/// Everything that one action brought, for recorders and windows.
#[derive(Clone, Debug)]
pub struct StepOutcome {
    /// The step as it is filed.
    pub record: StepRecord,
    /// The image, after a look.
    pub image: Option<Image>,
    /// The image projected into the grid, after a look.
    pub observation: Option<MapObservation>,
    /// The push with its swept volume, after a push.
    pub swept: Option<SweptPush>,
    /// The belief that was predicted for the push, after a push that was predicted.
    pub prediction: Option<PushPrediction>,
    /// What the push did.
    pub push_outcome: Option<PushOutcome>,
}

/// A running episode. A clone is a branch: both go on independently from the same state.
#[derive(Clone)]
pub struct Episode {
    // private fields -- to come
}

impl Episode {
    /// Sets the scene up (settled), with the uniform belief.
    pub fn new(
        _scene: Scene,
        _catalog: Arc<Catalog>,
        _config: EpisodeConfig,
        _update: Arc<dyn BeliefUpdate>,
    ) -> Result<Self> {
        todo!()
    }

    /// What the policy would do now, and what it weighed. Changes nothing; the same state decides the same.
    pub fn decide(&self) -> Decision {
        todo!()
    }

    /// Does `decision.action`, updates belief, truth and scores, and returns everything that it brought.
    pub fn act(&mut self, _decision: Decision) -> Result<StepOutcome> {
        todo!()
    }

    /// Whether the budget is used up.
    pub fn is_finished(&self) -> bool {
        todo!()
    }

    /// The record so far, as `episode.json` keeps it.
    pub fn record(&self) -> &EpisodeRecord {
        todo!()
    }

    /// The belief now.
    pub fn belief(&self) -> &Belief {
        todo!()
    }

    /// The truth now.
    pub fn truth(&self) -> &TruthMap {
        todo!()
    }

    /// The bodies where they are now.
    pub fn bodies(&self) -> Vec<Body> {
        todo!()
    }

    /// The candidate views.
    pub fn views(&self) -> &ViewArray {
        todo!()
    }

    /// The catalogue.
    pub fn catalog(&self) -> &Catalog {
        todo!()
    }

    /// What the planner remembers.
    pub fn history(&self) -> &History {
        todo!()
    }
}
