//! What is kept of an episode: its configuration, its steps, and `episode.json` as a whole.

use super::judgement::{Judgement, Prior, RawJudgement};
use crate::arm::Motion;
use crate::belief::{BeliefUpdate, Prediction};
use crate::camera::{Frame, MapObservation, NoiseModel, ViewArray};
use crate::made_by::MadeBy;
use crate::plan::{Action, Decision, PlannerSettings, PolicyKind, Reason, Rule};
use crate::scene::{ObjectId, Scene};
use crate::score::{ObjectVerdict, Scores};
use crate::skill::SweptManipulation;
use crate::world::{GripEnd, LinkContact, ManipulationOutcome};
use serde::{Deserialize, Serialize};

/// The format number of `episode.json`. In format 1, which is still read, every episode had a truth, and `entropy_nats`
/// stood in its scores alone.
pub const FORMAT: u32 = 2;

/// What an episode is run with, beside its scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeConfig {
    /// The rule that chooses actions.
    pub policy: PolicyKind,
    /// Name of the belief update: `classical`, `cnabu`, or that of one with modules of the user's own
    /// ([`mixed_name`](crate::belief::mixed_name)).
    pub belief: String,
    /// Seed of every random choice.
    pub seed: u64,
    /// Number of actions.
    pub budget: usize,
    /// Name of the view array.
    pub views: String,
    /// The planner's numbers.
    pub planner: PlannerSettings,
    /// What the camera gets wrong; nothing unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseModel>,
}

impl EpisodeConfig {
    /// What its decisions follow.
    pub fn rule(&self) -> Rule {
        Rule { policy: self.policy, settings: self.planner }
    }

    /// Whether a push that was chosen for a reason is predicted into the belief: that of a policy that predicts pushes, and
    /// whatever a person chose. After the others the belief stays as it is.
    pub(super) fn is_predicted(&self, reason: Reason) -> bool {
        self.policy.predicts_pushes() || reason == Reason::Manual
    }
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

impl StepSeconds {
    /// All parts together.
    pub fn total(&self) -> f64 {
        self.decide + self.act + self.update + self.record
    }
}

/// One step as `episode.json` keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawStep")]
pub struct StepRecord {
    /// 1 for the first action; the belief after it is `beliefs/001.npz`.
    pub index: usize,
    /// What was done.
    pub action: Action,
    /// What was weighed.
    pub decision: Decision,
    /// Entropy of the map after the step, nats.
    pub entropy_nats: f64,
    /// Scores, verdicts, drops and displacements, where the truth is known; its members stand beside the others.
    #[serde(flatten)]
    pub judgement: Option<Judgement>,
    /// How long the robot moved in this step, seconds of its own time; 0 where no arm could be there.
    pub motion_s: f64,
    /// What the arm met, after a manipulation of whatever skill.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub push: Option<PushReport>,
    /// Where the time went.
    pub seconds: StepSeconds,
}

impl StepRecord {
    /// Scores of the belief after the step, where the truth is known.
    pub fn scores(&self) -> Option<&Scores> {
        self.judgement.as_ref().map(|judgement| &judgement.scores)
    }

    /// The verdicts on the objects; none without a truth.
    pub fn objects(&self) -> &[ObjectVerdict] {
        self.judgement.as_ref().map_or(&[], |judgement| &judgement.objects)
    }

    /// Names of the objects that this step is known to have dropped.
    pub fn dropped(&self) -> &[String] {
        self.judgement.as_ref().map_or(&[], |judgement| &judgement.dropped)
    }

    /// How holding an object ended, after a pick.
    pub fn grip(&self) -> Option<GripEnd> {
        self.push.as_ref().and_then(|push| push.grip.as_ref()).map(|grip| grip.end)
    }

    /// Sum of object displacements, metres, where it is known.
    pub fn displacement_m(&self) -> Option<f64> {
        self.judgement.as_ref().map(|judgement| judgement.displacement_m)
    }
}

/// A step as it is read.
#[derive(Deserialize)]
struct RawStep {
    index: usize,
    action: Action,
    decision: Decision,
    entropy_nats: Option<f64>,
    scores: Option<Scores>,
    objects: Option<Vec<ObjectVerdict>>,
    dropped: Option<Vec<String>>,
    displacement_m: Option<f64>,
    #[serde(default)]
    motion_s: f64,
    push: Option<PushReport>,
    seconds: StepSeconds,
}

impl TryFrom<RawStep> for StepRecord {
    type Error = String;

    fn try_from(raw: RawStep) -> Result<Self, String> {
        let RawStep {
            index, action, decision, scores, objects, dropped, displacement_m, motion_s, push, seconds, ..
        } = raw;
        let judgement = RawJudgement { scores, objects, dropped, displacement_m }.checked()?;
        let scored = judgement.as_ref().map(|judgement| judgement.scores.entropy_nats);
        let entropy_nats = raw.entropy_nats.or(scored).ok_or("missing field `entropy_nats`")?;
        Ok(Self { index, action, decision, entropy_nats, judgement, motion_s, push, seconds })
    }
}

/// What became of a manipulation by the arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PushReport {
    /// How far the tip really moved in contact, metres.
    pub pushed_m: f32,
    /// Whether the arm was blocked and gave up before the contact's end.
    pub stalled: bool,
    /// Links (not the gripper) that touched an object, each with the object as `class#id`.
    pub contacts: Vec<LinkTouch>,
    /// Objects that were pressed against a wall of the shelf, `class#id`.
    pub against_wall: Vec<String>,
    /// How deep the arm got into a panel of the shelf at most, metres.
    pub arm_in_shelf_m: f32,
    /// What became of what the cup was to hold; `None` of a manipulation without suction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grip: Option<GripReport>,
}

/// What became of what the cup was to hold.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GripReport {
    /// The object that it sealed on, `class#id`, if it did.
    pub object: Option<String>,
    /// How it ended.
    pub end: GripEnd,
}

impl PushReport {
    /// Of an outcome; `name` gives an object as `class#id`.
    pub(super) fn of(outcome: &ManipulationOutcome, name: impl Fn(ObjectId) -> String) -> Self {
        let touch = |contact: &LinkContact| LinkTouch { link: contact.link.clone(), object: name(contact.object) };
        Self {
            pushed_m: outcome.way_m,
            stalled: outcome.stalled,
            contacts: outcome.link_contacts.iter().map(touch).collect(),
            against_wall: outcome.against_wall.iter().map(|id| name(*id)).collect(),
            arm_in_shelf_m: outcome.arm_in_shelf_m,
            grip: outcome.grip.map(|grip| GripReport { object: grip.object.map(&name), end: grip.end }),
        }
    }
}

/// A link that touched an object.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkTouch {
    /// The link.
    pub link: String,
    /// The object, `class#id`.
    pub object: String,
}

/// A program that went on with an episode of another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LaterMaker {
    /// The first step that it made.
    pub from_step: usize,
    /// The program.
    pub made_by: MadeBy,
}

/// `episode.json`, and what `nudge run --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRecord {
    /// Format number, [`FORMAT`].
    pub format: u32,
    /// Version of the program that wrote it.
    pub version: String,
    /// What made it; not there in episodes of programs that did not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_by: Option<MadeBy>,
    /// What made its later steps, where other programs went on with it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub also_made_by: Vec<LaterMaker>,
    /// The scene, embedded with its meshes.
    pub scene: Scene,
    /// Policy, belief, seed, budget, views and planner settings.
    #[serde(flatten)]
    pub config: EpisodeConfig,
    /// The views of a recording, which no other file describes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded_views: Option<ViewArray>,
    /// Scores of the prior, or its entropy alone.
    pub prior: Prior,
    /// The steps so far.
    pub steps: Vec<StepRecord>,
}

impl EpisodeRecord {
    /// What keeps this program from repeating the episode: weights of other hashes than those it was made with, in words.
    /// `None` where they are the same, and where the episode does not tell.
    pub fn other_weights(&self, update: &dyn BeliefUpdate) -> Option<String> {
        let before = self.made_by.as_ref()?.weights.clone().unwrap_or_default();
        let now = update.networks_used().map(|used| used.weights).unwrap_or_default();
        Some(now.differences(&before).join(", ")).filter(|words| !words.is_empty())
    }

    /// Notes what makes the steps to come, if there are any.
    pub(super) fn go_on_with(&mut self, maker: MadeBy) {
        let last = self.also_made_by.last().map(|later| &later.made_by).or(self.made_by.as_ref());
        if self.steps.is_empty() {
            self.made_by = Some(maker);
        } else if self.steps.len() < self.config.budget && !last.is_some_and(|last| maker.is_same_maker(last)) {
            self.also_made_by.push(LaterMaker { from_step: self.steps.len() + 1, made_by: maker });
        }
    }

    /// The views of the episode: its own, or those of the array that its configuration names.
    ///
    /// # Errors
    /// Those of [`ViewArray::named`].
    pub fn view_array(&self) -> crate::Result<ViewArray> {
        self.recorded_views.as_ref().map_or_else(|| ViewArray::named(&self.config.views), |views| Ok(views.clone()))
    }

    /// Whether the truth is known, so that beliefs are scored.
    pub fn has_truth(&self) -> bool {
        self.prior.scores.is_some()
    }

    /// Scores after a number of actions, 0 for the prior, where the truth is known.
    pub fn scores_after(&self, actions: usize) -> Option<&Scores> {
        match actions.checked_sub(1) {
            Some(at) => self.steps.get(at)?.scores(),
            None => self.prior.scores.as_ref(),
        }
    }

    /// Entropy of the map after a number of actions, 0 for the prior, nats.
    pub fn entropy_after(&self, actions: usize) -> f64 {
        let step = actions.checked_sub(1).and_then(|at| self.steps.get(at));
        step.map_or(self.prior.entropy_nats, |step| step.entropy_nats)
    }

    /// The numbers of actions after which a truth is filed: 0 and every push; none where the truth is not known.
    pub fn truth_indices(&self) -> impl Iterator<Item = usize> + '_ {
        let pushes =
            self.steps.iter().filter(|step| matches!(step.action, Action::Manipulate(_))).map(|step| step.index);
        std::iter::once(0).chain(pushes).filter(|_| self.has_truth())
    }

    /// Whether there is another truth after `actions` actions than before the last of them.
    pub fn has_new_truth(&self, actions: usize) -> bool {
        self.truth_indices().any(|index| index == actions)
    }
}

/// Everything that one action brought, for recorders and windows.
#[derive(Clone, Debug)]
pub struct StepOutcome {
    /// The step as it is filed.
    pub record: StepRecord,
    /// The frame as the belief update saw it, noise included, after a look.
    pub frame: Option<Frame>,
    /// The frame projected into the grid, after a look.
    pub observation: Option<MapObservation>,
    /// The manipulation as far as it came, with what it swept, after one.
    pub swept: Option<SweptManipulation>,
    /// The belief that was predicted, after a manipulation that was predicted.
    pub prediction: Option<Prediction>,
    /// What the manipulation did.
    pub manipulated: Option<ManipulationOutcome>,
    /// How the arm moved as it was planned: to the view, or to the contact, along it and back.
    pub motion: Option<Motion>,
}

impl StepOutcome {
    /// What the log alone tells of a step.
    pub fn of_log(record: StepRecord) -> Self {
        Self { record, frame: None, observation: None, swept: None, prediction: None, manipulated: None, motion: None }
    }
}
