//! What a bench keeps of an episode.

use super::plan::{EpisodeId, Plan};
use nudge_core::episode::{EpisodeRecord, NO_TRUTH, StepRecord, StepSeconds};
use nudge_core::plan::{Action, PolicyKind, Reason};
use nudge_core::score::{ObjectVerdict, Scores, Tally, Verdict};
use nudge_core::skill::SkillKind;
use nudge_core::world::GripEnd;
use nudge_core::{Error, Result};
use serde::{Deserialize, Serialize};

/// The format number of results.
pub const FORMAT: u32 = 1;

/// An episode's result: everything that reports are made of, and nothing that depends on the clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeResult {
    /// Format number.
    pub format: u32,
    /// Version of the program that ran it.
    pub version: String,
    /// The fingerprint of what made it, as `bench.json` tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_by: Option<String>,
    /// Name of its set.
    pub set: String,
    /// Its scene's name in the set.
    pub scene: String,
    /// The policy.
    pub policy: PolicyKind,
    /// Name of the belief update.
    pub belief: String,
    /// The seed.
    pub seed: u64,
    /// Number of actions.
    pub budget: usize,
    /// Number of objects in the scene.
    pub objects: usize,
    /// Objects that no view of the array shows at the start.
    pub hidden: Vec<u16>,
    /// Scores of the prior.
    pub prior: Scores,
    /// The steps.
    pub steps: Vec<StepResult>,
    /// The verdicts on the objects at the end.
    pub verdicts: Vec<ObjectVerdict>,
    /// The counts behind the scores after half of the budget and at the end, by number of actions.
    pub tallies: Vec<(usize, Tally)>,
}

/// One step of a result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepResult {
    /// What was done.
    pub action: Action,
    /// Why.
    pub reason: Reason,
    /// Gain of the best pair of views, nats.
    pub igv: f32,
    /// Gain of the best push, nats.
    pub igm: f32,
    /// Disturbance of the best push, nats.
    pub reg: f32,
    /// Gain that was expected of the chosen view, nats; `None` for a push.
    pub gain: Option<f32>,
    /// Scores after the step.
    pub scores: Scores,
    /// How many objects had which verdict.
    pub verdicts: VerdictCounts,
    /// Objects that the step dropped.
    pub dropped: Vec<String>,
    /// Sum of object displacements, metres, without those of objects that were held until they were set down.
    pub displacement_m: f64,
    /// How a pick ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grip: Option<GripEnd>,
}

/// How many objects have which verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct VerdictCounts {
    /// Found.
    pub found: usize,
    /// Misclassified.
    pub misclassified: usize,
    /// Not found.
    pub not_found: usize,
    /// Hallucinated.
    pub hallucinated: usize,
}

impl VerdictCounts {
    /// Counts verdicts.
    pub fn of(verdicts: &[ObjectVerdict]) -> Self {
        let count = |verdict: Verdict| verdicts.iter().filter(|v| v.verdict == verdict).count();
        Self {
            found: count(Verdict::Found),
            misclassified: count(Verdict::Misclassified),
            not_found: count(Verdict::NotFound),
            hallucinated: count(Verdict::Hallucinated),
        }
    }
}

/// Where the time of an episode went.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeSeconds {
    /// Threads that the episode had.
    pub threads: usize,
    /// Wall-clock seconds from its start to its end.
    pub total: f64,
    /// By step.
    pub steps: Vec<StepSeconds>,
}

/// The number of actions after which tallies are kept.
pub fn tallied_steps(budget: usize) -> [usize; 2] {
    [budget.div_ceil(2), budget]
}

impl EpisodeResult {
    /// The result of a finished episode.
    ///
    /// # Errors
    /// For an episode without truth: benches compare scores.
    pub fn new(
        plan: &Plan,
        id: EpisodeId,
        record: &EpisodeRecord,
        hidden: Vec<u16>,
        tallies: Vec<(usize, Tally)>,
    ) -> Result<Self> {
        let set = &plan.sets[id.set];
        let without = || Error::Usage(format!("{NO_TRUTH}: a bench compares scores"));
        Ok(Self {
            format: FORMAT,
            version: record.version.clone(),
            made_by: plan.made_by.as_ref().map(|maker| maker.fingerprint.clone()),
            set: set.name.clone(),
            scene: set.scenes[id.scene].id.clone(),
            policy: record.config.policy,
            belief: record.config.belief.clone(),
            seed: record.config.seed,
            budget: record.config.budget,
            objects: record.scene.objects.len(),
            hidden,
            prior: record.prior.scores.ok_or_else(without)?,
            steps: record.steps.iter().map(StepResult::new).collect::<Option<_>>().ok_or_else(without)?,
            verdicts: record.steps.last().map(|step| step.objects().to_vec()).unwrap_or_default(),
            tallies,
        })
    }

    /// Whether this is the result of an episode of a plan, whole and of one of its makers.
    pub fn belongs_to(&self, plan: &Plan, id: EpisodeId) -> bool {
        let (set, policy) = (&plan.sets[id.set], &plan.policies[id.policy]);
        self.format == FORMAT
            && plan.knows(&self.version, self.made_by.as_deref())
            && (&self.set, &self.scene) == (&set.name, &set.scenes[id.scene].id)
            && (self.policy, &self.belief, self.seed) == (policy.policy, &policy.belief, id.seed)
            && (self.budget, self.steps.len()) == (plan.budget, plan.budget)
    }

    /// Scores after a number of actions; 0 is the prior.
    pub fn scores(&self, actions: usize) -> &Scores {
        actions.checked_sub(1).and_then(|at| self.steps.get(at)).map_or(&self.prior, |step| &step.scores)
    }

    /// A score over the steps, the prior first.
    pub fn curve(&self, score: impl Fn(&Scores) -> f64) -> Vec<f64> {
        (0..=self.steps.len()).map(|actions| score(self.scores(actions))).collect()
    }

    /// Number of pushes: of manipulations that hold nothing.
    pub fn pushes(&self) -> usize {
        let moved = self.steps.iter().filter(|step| matches!(step.action, Action::Manipulate(_))).count();
        moved - self.picks()
    }

    /// Number of picks.
    pub fn picks(&self) -> usize {
        self.steps.iter().filter(|step| step.is_pick()).count()
    }

    /// Number of picks that ended in some way.
    pub fn picks_ended(&self, is: fn(GripEnd) -> bool) -> usize {
        self.steps.iter().filter(|step| step.grip.is_some_and(is)).count()
    }

    /// Number of picks that dropped something.
    pub fn picks_that_dropped(&self) -> usize {
        self.steps.iter().filter(|step| step.is_pick() && !step.dropped.is_empty()).count()
    }

    /// Number of steps that fit in a number of actions where a pick counts as two.
    pub fn steps_within(&self, actions: usize) -> usize {
        let mut cost = 0;
        let fits = self.steps.iter().take_while(|step| {
            cost += if step.is_pick() { 2 } else { 1 };
            cost <= actions
        });
        fits.count()
    }

    /// Number of pushes that dropped something.
    pub fn drops(&self) -> usize {
        self.steps.iter().filter(|step| !step.dropped.is_empty()).count()
    }

    /// Sum of all displacements, metres.
    pub fn displacement_m(&self) -> f64 {
        self.steps.iter().map(|step| step.displacement_m).sum()
    }

    /// How many of the objects that were hidden at the start were found in the end.
    pub fn revealed(&self) -> usize {
        let found = |id: &&u16| self.verdicts.iter().any(|v| v.object == Some(**id) && v.verdict == Verdict::Found);
        self.hidden.iter().filter(found).count()
    }
}

impl StepResult {
    fn is_pick(&self) -> bool {
        matches!(self.action, Action::Manipulate(manipulation) if manipulation.kind() == SkillKind::Pick)
    }

    fn new(step: &StepRecord) -> Option<Self> {
        let judgement = step.judgement.as_ref()?;
        let gain = match step.action {
            Action::Look { .. } => step.decision.promised(),
            Action::Manipulate(_) => None,
        };
        Some(Self {
            action: step.action,
            reason: step.decision.reason,
            igv: step.decision.igv,
            igm: step.decision.igm,
            reg: step.decision.reg,
            gain,
            scores: judgement.scores,
            verdicts: VerdictCounts::of(&judgement.objects),
            dropped: judgement.dropped.clone(),
            displacement_m: judgement.displacement_m,
            grip: step.grip(),
        })
    }
}
