//! The planner: look or push?
//!
//! Look (first view of IGV) if `IGV > IGM + gamma Reg`, else push; `Reg = min(0, H_s(belief) - H_s(predicted))` over the
//! semantic map and `gamma` is [`GAMMA`] unless a user says otherwise ([`SETTINGS`]). A [`Decision`] keeps everything that was
//! weighed, and by what: whoever shows it prints its [`Comparison`] and its [ranked candidates](Decision::ranked_candidates).

mod ahead;
mod because;
mod comparison;
mod counted;
mod decide;
mod gain;
mod policy;
mod rule;
mod settings;
mod weigh;
mod worth;

pub use comparison::{Comparison, DISTURBANCE, Rule, Term, TermKind, Winner, ranked};
pub use counted::Counted;
pub use decide::decide;
pub use gain::Gain;
pub use policy::PolicyKind;
pub use rule::{PUSH_EVERY, look_or_push, push_guard, saturated, still_closing};
pub use settings::{Choice, GAMMA, Place, PlannerSettings, SETTINGS, Setting, Values};
pub use weigh::{disturbance, draw_candidates};
pub(crate) use worth::coarse;
pub use worth::{COARSE_VIEWS, Sources};

use crate::arm::{ArmTool, PhasedMotion};
use crate::belief::{Belief, BeliefUpdate};
use crate::camera::{ViewArray, ViewId};
use crate::grid::VoxelSet;
use crate::skill::{Ground, Manipulation, PushTruth, Rejection};
use crate::world::GripEnd;
use serde::{Deserialize, Serialize};

/// What the robot does at one step. In files `kind` is `look` or the name of a skill.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Action {
    /// Take an image from a view.
    Look {
        /// The view's id in the array.
        view: ViewId,
    },
    /// Move something, by one of the skills.
    #[serde(untagged)]
    Manipulate(Manipulation),
}

impl<'de> Deserialize<'de> for Action {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        use serde::de::Error as _;
        let fields = serde_json::Map::<String, serde_json::Value>::deserialize(deserializer)?;
        match fields.get("kind").and_then(serde_json::Value::as_str) {
            None => Err(D::Error::missing_field("kind")),
            Some("look") => {
                let view = fields.get("view").cloned().ok_or_else(|| D::Error::missing_field("view"))?;
                Ok(Self::Look { view: serde_json::from_value(view).map_err(D::Error::custom)? })
            }
            Some(_) => {
                let manipulation = Manipulation::deserialize(serde_json::Value::Object(fields));
                manipulation.map(Self::Manipulate).map_err(D::Error::custom)
            }
        }
    }
}

/// Why an action was chosen, in one of the planner's own cases.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// Looking tells more: `IGV > IGM + gamma Reg`.
    LookTellsMore,
    /// The best push promises more than looking, but less than the floor ([`PlannerSettings::push_floor`]).
    PushTellsLittle,
    /// Pushing tells more: `IGV <= IGM + gamma Reg`.
    PushTellsMore,
    /// The push really brings objects into sight: of the clairvoyant policy alone.
    PushReveals,
    /// Right after a push: the view for which the push was chosen.
    ViewOfPush,
    /// No push in the first steps.
    TooEarly,
    /// No push in the last step, or the last steps.
    LastStep,
    /// No push right after a push, nor (policy `mem`) before enough looks followed it
    /// ([`PlannerSettings::closing_steps`]).
    JustPushed,
    /// The map is complete: only looks.
    MapComplete,
    /// An object was dropped: only looks.
    Dropped,
    /// No feasible push candidate.
    NoCandidate,
    /// The policy's schedule or random choice.
    Schedule,
    /// Chosen by a person in the workbench, against the planner.
    Manual,
}

/// One candidate to move something as the planner saw it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CandidateRecord {
    /// The manipulation.
    #[serde(flatten)]
    pub manipulation: Manipulation,
    /// Why it was not a candidate, if it was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rejection: Option<Rejection>,
    /// What the push is worth, nats; `None` if rejected or not weighed. Where all voxels count it is the best single-view
    /// gain under the predicted belief: the best push's is exact, the others' come from fewer views and rays and are
    /// scaled to the same number of rays. Where only unseen voxels count it is what the push opens.
    pub gain: Option<f32>,
    /// The best view after it. Where all voxels count every candidate has one, else only the best candidate.
    pub view: Option<ViewId>,
    /// `min(0, H_s(belief) - H_s(predicted))`, nats.
    pub reg: Option<f32>,
    /// How long the arm's motion takes, in, along and back, seconds; `None` if rejected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion_s: Option<f64>,
    /// What it makes way for, where that is what it is worth: half of what both open together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub then: Option<Manipulation>,
}

impl CandidateRecord {
    /// A manipulation that was neither weighed nor rejected.
    pub fn of(manipulation: impl Into<Manipulation>) -> Self {
        let manipulation = manipulation.into();
        Self { manipulation, rejection: None, gain: None, view: None, reg: None, motion_s: None, then: None }
    }

    /// What it makes way for, in words, where that is what it is worth.
    pub fn makes_way_for(&self) -> Option<String> {
        self.then.map(|then| format!("a {} {}", then.kind().name(), then.skill().describe().short))
    }

    /// What stood against it, in words; `None` for a feasible candidate.
    pub fn against(&self) -> Option<String> {
        self.rejection.as_ref().map(|rejection| self.manipulation.against(rejection))
    }
}

/// Everything that was weighed at one step and what was chosen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Decision {
    /// What to do.
    pub action: Action,
    /// Why.
    pub reason: Reason,
    /// Gain of the best pair of views, nats ([`Counted`] says of what).
    pub igv: f32,
    /// Worth of the best push, nats; 0 when none was weighed. Of a clairvoyant policy what is unknown of the space that it
    /// really opens, not what it promises.
    pub igm: f32,
    /// Disturbance of the best push, nats, at most 0; 0 of a clairvoyant policy.
    pub reg: f32,
    /// First and second view of the best pair.
    pub pair: Vec<ViewId>,
    /// Gain of every view under the belief before the step, nats, used views included.
    pub gains: Vec<f32>,
    /// The push candidates, in the order drawn.
    #[serde(default)]
    pub candidates: Vec<CandidateRecord>,
    /// Position of the best push in `candidates`: best by what it promises, of a clairvoyant policy by what it really does.
    #[serde(default)]
    pub best_push: Option<usize>,
    /// The arm's motion for the push that is the action, else for the best one; `None` where none was weighed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<PhasedMotion>,
    /// The policy and the thresholds of its comparison; `None` until an episode takes it down.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rule: Option<Rule>,
}

/// What the episode remembers for the planner.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    /// Actions so far, in order.
    pub actions: Vec<Action>,
    /// Views used since the last push.
    pub used_views: Vec<ViewId>,
    /// Right after a push: the view for which the push was chosen.
    pub view_of_push: Option<ViewId>,
    /// Best single-view gains of the look steps so far, for saturation.
    pub best_gains: Vec<f32>,
    /// Whether an object was dropped.
    pub dropped: bool,
    /// Where a cup touched and did not seal, metres: it is not tried there again.
    pub unsealed: Vec<[f32; 3]>,
}

impl Decision {
    /// An action for which nothing was weighed.
    pub fn unweighed(action: Action, reason: Reason) -> Self {
        Self {
            action,
            reason,
            igv: 0.0,
            igm: 0.0,
            reg: 0.0,
            pair: Vec::new(),
            gains: Vec::new(),
            candidates: Vec::new(),
            best_push: None,
            motion: None,
            rule: None,
        }
    }

    /// Gain of the best single view that was not used yet, nats.
    pub fn best_gain(&self) -> Option<f32> {
        self.pair.first().and_then(|view| self.gains.get(usize::from(view.0))).copied()
    }
}

impl History {
    /// Records that `decision.action` was done, whether it dropped an object, and how holding one ended.
    ///
    /// A look uses its view up; a push clears the used views and, unless it dropped something, keeps the view for which
    /// it was chosen for the next step.
    pub fn record(&mut self, decision: &Decision, dropped: bool, grip: Option<GripEnd>) {
        self.actions.push(decision.action);
        self.dropped |= dropped;
        if let (Action::Manipulate(Manipulation::Pick(pick)), Some(GripEnd::NoSeal)) = (decision.action, grip) {
            self.unsealed.push(pick.contact);
        }
        self.view_of_push = None;
        match decision.action {
            Action::Look { view } => {
                self.used_views.push(view);
                self.best_gains.extend(decision.best_gain());
            }
            Action::Manipulate(done) => {
                self.used_views.clear();
                if !dropped {
                    let best = decision.best_push.and_then(|at| decision.candidates.get(at));
                    self.view_of_push = best.filter(|best| best.manipulation == done).and_then(|best| best.view);
                }
            }
        }
    }

    /// Looks since the last push; `None` before the first one.
    pub fn looks_since_push(&self) -> Option<usize> {
        self.actions.iter().rev().position(|action| matches!(action, Action::Manipulate(_)))
    }

    /// The last action that was no look.
    pub fn last_manipulation(&self) -> Option<&Manipulation> {
        self.actions.iter().rev().find_map(|action| match action {
            Action::Manipulate(manipulation) => Some(manipulation),
            Action::Look { .. } => None,
        })
    }

    /// Whether the last action was a push.
    pub fn just_pushed(&self) -> bool {
        self.looks_since_push() == Some(0)
    }
}

/// What a decision is made from.
pub struct Situation<'a> {
    /// The belief before the step.
    pub belief: &'a Belief,
    /// How beliefs change.
    pub update: &'a dyn BeliefUpdate,
    /// The candidate views.
    pub views: &'a ViewArray,
    /// The arm that pushes.
    pub arm: &'a ArmTool,
    /// Views that are not offered: the hand cannot be there.
    pub unreachable: &'a [ViewId],
    /// What happened so far.
    pub history: &'a History,
    /// Voxels that looks have seen and that no push has probably changed since: no gain for [`Counted::Unseen`].
    pub seen: &'a VoxelSet,
    /// Number of actions in all.
    pub budget: usize,
    /// Seed of the episode.
    pub seed: u64,
    /// The belief after really looking from a view: for the clairvoyant oracle only.
    pub really_look: &'a (dyn Fn(ViewId) -> Belief + Sync),
    /// What manipulations would really do, one answer per motion: for clairvoyant policies only.
    pub really_push: &'a (dyn Fn(&[PhasedMotion]) -> Vec<PushTruth> + Sync),
}

impl Situation<'_> {
    /// What candidates are drawn from.
    fn ground(&self, settings: &PlannerSettings) -> Ground<'_> {
        Ground {
            belief: self.belief,
            seen: settings.counted.left_out(self.seen),
            arm: self.arm,
            sampler: settings.push_sampler,
            place: settings.place,
            unsealed: &self.history.unsealed,
        }
    }

    /// The views that are offered, by id.
    pub fn offered(&self) -> Vec<ViewId> {
        self.views.views.iter().map(|view| view.id).filter(|view| !self.unreachable.contains(view)).collect()
    }
}

#[cfg(test)]
mod tests;
