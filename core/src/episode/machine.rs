//! The episode as a state machine.

use super::estimate::{Estimate, Told, sense};
use super::judgement::{Judgement, Prior, entropy_nats};
use super::record::{EpisodeConfig, EpisodeRecord, FORMAT, PushReport, StepOutcome, StepRecord, StepSeconds};
use super::stopwatch::Stopwatch;
use crate::arm::{Arm, ArmTool, HandPose, Motion, PhasedMotion};
use crate::belief::{Belief, BeliefUpdate};
use crate::camera::{Frame, MapObservation, Sensed, View, ViewArray, ViewId, project};
use crate::environment::{Environment, Simulated};
use crate::grid::{Grid, VoxelSet};
use crate::made_by::{Build, MadeBy};
use crate::plan::{self, Action, Decision, History, Situation};
use crate::rng::stream;
use crate::scene::{Body, Catalog, ObjectId, Scene};
use crate::skill::{ArmClearance, Manipulation};
use crate::world::TruthMap;
use crate::{Error, Result};
use check::{check, sound};
use std::sync::Arc;
use std::time::Instant;

mod candidates;
mod check;
mod log;

/// A running episode.
pub struct Episode {
    catalog: Arc<Catalog>,
    update: Arc<dyn BeliefUpdate>,
    views: Arc<ViewArray>,
    arm: Arc<ArmTool>,
    /// How the hand gets to each view; `None` where it cannot be.
    hands: Arc<Vec<Option<HandPose>>>,
    /// Where the hand is, if the arm can wait anywhere.
    hand: Option<HandPose>,
    /// Views that are not offered.
    unreachable: Arc<Vec<ViewId>>,
    /// Where images come from and pushes go.
    environment: Box<dyn Environment>,
    /// The truth of a log that stands in place of the environment's until the next push.
    filed_truth: Option<Arc<TruthMap>>,
    estimate: Estimate,
    history: History,
    record: EpisodeRecord,
    deciding: Stopwatch,
    /// What the last belief update was told.
    told: Option<Told>,
}

impl Episode {
    /// Sets the scene up in simulation (settled), with the uniform belief.
    ///
    /// # Errors
    /// Those of [`Episode::within`], and for a scene that gives no bodies.
    pub fn new(
        scene: Scene,
        catalog: Arc<Catalog>,
        config: EpisodeConfig,
        update: Arc<dyn BeliefUpdate>,
    ) -> Result<Self> {
        let scene = scene.with_hand_for(config.policy.picks());
        // Before the scene is given the time to settle.
        check(&scene, &config, &*update)?;
        ViewArray::named(&config.views)?;
        let environment = Box::new(Simulated::new(&scene, &catalog)?);
        Self::within(environment, scene, catalog, config, update)
    }

    /// An episode in any environment, with the uniform belief; `scene` says which shelf and robot it is about.
    ///
    /// # Errors
    /// For a belief update that is not the one the configuration names or not made for the scene's grid, an unknown view
    /// array, a budget of zero, and a policy that knows the future where nothing is simulated.
    pub fn within(
        environment: Box<dyn Environment>,
        scene: Scene,
        catalog: Arc<Catalog>,
        config: EpisodeConfig,
        update: Arc<dyn BeliefUpdate>,
    ) -> Result<Self> {
        check(&scene, &config, &*update)?;
        let own = environment.views().cloned();
        let views = own.clone().map_or_else(|| ViewArray::named(&config.views), Ok)?;
        let policy = config.policy;
        if policy.knows_the_future() && environment.simulated().is_none() {
            let message = format!("policy {policy} asks what would really happen, which only a simulated shelf tells");
            return Err(Error::Usage(message));
        }
        let arm = Arc::new(ArmTool::new(Arm::placed(&scene.robot)?, scene.shelf));
        policy.check_hand(&arm.arm)?;
        let hands = Arc::new(if own.is_some() { vec![None; views.views.len()] } else { views.hand_poses(&arm) });
        let unreachable = Arc::new(views.unreachable(&hands));
        let estimate = Estimate::uniform(&scene.grid());
        let threads = rayon::current_num_threads();
        let record = EpisodeRecord {
            format: FORMAT,
            version: crate::VERSION.to_owned(),
            made_by: Some(MadeBy::new(Build::default(), update.networks_used(), config.planner, threads)),
            also_made_by: Vec::new(),
            scene,
            config,
            recorded_views: own,
            prior: Prior::of(&estimate.belief, environment.truth()),
            steps: Vec::new(),
        };
        Ok(Self {
            catalog,
            update,
            views: Arc::new(views),
            hand: arm.ready.map(HandPose::waiting),
            arm,
            hands,
            unreachable,
            environment,
            filed_truth: None,
            estimate,
            history: History::default(),
            record,
            deciding: Stopwatch::default(),
            told: None,
        })
    }

    /// A copy that goes on independently from the same state, where the environment can have one.
    pub fn branch(&self) -> Option<Self> {
        Some(Self {
            catalog: self.catalog.clone(),
            update: self.update.clone(),
            views: self.views.clone(),
            arm: self.arm.clone(),
            hands: self.hands.clone(),
            hand: self.hand.clone(),
            unreachable: self.unreachable.clone(),
            environment: self.environment.branch()?,
            filed_truth: self.filed_truth.clone(),
            estimate: self.estimate.clone(),
            history: self.history.clone(),
            record: self.record.clone(),
            deciding: self.deciding.clone(),
            told: self.told.clone(),
        })
    }

    /// Names the build of the program that makes the steps to come; to be called once, after [`Episode::new`] or
    /// [`resume`](super::resume), before the first action.
    pub fn built_from(&mut self, build: Build) {
        let threads = rayon::current_num_threads();
        let planner = self.record.config.planner;
        self.record.go_on_with(MadeBy::new(build, self.update.networks_used(), planner, threads));
    }

    /// What the policy would do now, and what it weighed. Changes nothing; the same state decides the same.
    pub fn decide(&self) -> Decision {
        let started = Instant::now();
        let really_look = |view: ViewId| {
            let mut after = self.estimate.clone();
            if let (Some(view), Some(shelf)) = (self.views.view(view), self.environment.simulated()) {
                let shoot = |view: &View| Ok(shelf.frame_from(view, &self.views.intrinsics));
                if let Ok((_, frame)) = sense(&self.record, view, shoot) {
                    after.look(&*self.update, &project(&frame, &self.record.scene.shelf));
                }
            }
            (*after.belief).clone()
        };
        let really_push = |motions: &[PhasedMotion]| {
            self.counterfactual().map_or_else(Vec::new, |known| known.of_each(motions, &|| ()))
        };
        let situation = Situation {
            belief: &self.estimate.belief,
            update: &*self.update,
            views: &self.views,
            arm: &self.arm,
            unreachable: &self.unreachable,
            history: &self.history,
            seen: self.seen(),
            budget: self.record.config.budget,
            seed: self.record.config.seed,
            really_look: &really_look,
            really_push: &really_push,
        };
        let decision = plan::decide(self.record.config.policy, &self.record.config.planner, &situation);
        self.deciding.set(started.elapsed().as_secs_f64());
        decision
    }

    /// Does `decision.action`, updates belief, truth and scores, and returns everything that it brought. The decision
    /// may be another than the policy's (of [`Reason::Manual`](crate::plan::Reason::Manual)). Its `decide` seconds are those of the last
    /// [`Episode::decide`] before.
    ///
    /// # Errors
    /// [`Error::Usage`] past the budget, for a view that the array does not have, for a manipulation that is no finite motion
    /// or that the arm cannot carry out, and for one after an object was dropped: the episode is then as it was. What is
    /// wrong with the belief update ([`BeliefUpdate::fault`]): the log is then as it was, and nothing is done any more.
    pub fn act(&mut self, mut decision: Decision) -> Result<StepOutcome> {
        if self.is_finished() {
            return Err(Error::Usage(format!("the budget of {} actions is used up", self.record.config.budget)));
        }
        sound(&*self.update)?;
        decision.rule.get_or_insert(self.record.config.rule());
        let seconds = StepSeconds { decide: self.deciding.take(), ..StepSeconds::default() };
        let action = decision.action;
        match action {
            Action::Look { view } => self.look(decision, view, seconds),
            Action::Manipulate(manipulation) => self.manipulate(decision, manipulation, seconds),
        }
    }

    fn look(&mut self, decision: Decision, view: ViewId, mut seconds: StepSeconds) -> Result<StepOutcome> {
        let Some(view) = self.views.view(view).cloned() else {
            let views = self.views.views.len();
            return Err(Error::Usage(format!("view {} of {views} in {}", view.0, self.views.name)));
        };
        let started = Instant::now();
        let (sensed, frame, observation) = self.observe(&view)?;
        let motion = self.carry(self.hands.get(usize::from(view.id.0)).cloned().flatten());
        seconds.act = started.elapsed().as_secs_f64();

        let started = Instant::now();
        self.estimate.look(&*self.update, &observation);
        sound(&*self.update)?;
        self.told = Some(Told::Frame(sensed));
        let motion_s = motion.as_ref().map_or(0.0, Motion::duration_s);
        let happened = Happened { motion_s, ..Happened::default() };
        let record = self.file(decision, happened, started, seconds);
        Ok(StepOutcome {
            record,
            frame: Some(frame),
            observation: Some(observation),
            swept: None,
            prediction: None,
            manipulated: None,
            motion,
        })
    }

    fn manipulate(
        &mut self,
        mut decision: Decision,
        manipulation: Manipulation,
        mut seconds: StepSeconds,
    ) -> Result<StepOutcome> {
        let name = manipulation.kind().name();
        if self.history.dropped {
            return Err(Error::Usage(format!(
                "an object was dropped: this episode {} no more",
                manipulation.kind().plural()
            )));
        }
        if !manipulation.skill().is_finite() {
            return Err(Error::Usage(format!("a {name} must be a finite motion, not {manipulation:?}")));
        }
        let started = Instant::now();
        let arm = self.arm.clone();
        let motion = self.motion_for(&arm, &mut decision, &manipulation)?;
        let outcome = self.environment.carry_out(&arm.arm, &motion)?;
        let to_wait = self.carry(arm.ready.map(HandPose::waiting)).unwrap_or_default();
        seconds.act = started.elapsed().as_secs_f64();

        let started = Instant::now();
        // The arm knows how far it came: what it did not sweep is not believed to be free.
        let swept = manipulation.done(&outcome, &arm.arm, &self.grid());
        let is_predicted = self.record.config.is_predicted(decision.reason);
        let prediction = self.estimate.manipulate(&*self.update, &swept, is_predicted);
        sound(&*self.update)?;
        self.told = Some(Told::Manipulation(swept.clone()));
        self.filed_truth = None;
        let happened = Happened {
            dropped: outcome.dropped.clone(),
            displacement_m: outcome.disturbed_m(),
            motion_s: to_wait.duration_s() + f64::from(outcome.arm_s),
            push: Some(PushReport::of(&outcome, |id| self.name(id))),
        };
        let record = self.file(decision, happened, started, seconds);
        Ok(StepOutcome {
            record,
            frame: None,
            observation: None,
            swept: Some(swept),
            prediction,
            manipulated: Some(outcome),
            motion: Some(to_wait.then(&motion.whole(&arm.arm))),
        })
    }

    /// The arm's motion for a manipulation: the decision's if it is for this one, else a new one, which the decision then
    /// keeps.
    fn motion_for(&self, arm: &ArmTool, decision: &mut Decision, wanted: &Manipulation) -> Result<PhasedMotion> {
        let skill = wanted.skill();
        let kept = decision
            .motion
            .take()
            .filter(|motion| arm.ready.is_some_and(|ready| skill.is_done_by(motion, &arm.arm, &ready)));
        let motion = match kept {
            Some(motion) => motion,
            None => {
                let clearance = ArmClearance::new(arm, &self.estimate.belief);
                let mut rng = stream(self.record.config.seed, "push by hand", self.record.steps.len() as u64);
                skill.plan(&clearance, &mut rng).map_err(|reason| {
                    let (name, reason) = (wanted.kind().name(), wanted.against(&reason));
                    Error::Usage(format!("the arm cannot carry this {name} out: {reason}"))
                })?
            }
        };
        decision.motion = Some(motion.clone());
        Ok(motion)
    }

    /// Moves the hand, if there is an arm that can be there.
    fn carry(&mut self, to: Option<HandPose>) -> Option<Motion> {
        let (from, to) = (self.hand.as_ref()?, to?);
        let mut rng = stream(self.record.config.seed, "ways of the hand", self.record.steps.len() as u64);
        let motion = self.arm.carry(from, &to, &mut rng);
        self.hand = Some(to);
        Some(motion)
    }

    /// `class#id`.
    pub(crate) fn name(&self, id: ObjectId) -> String {
        let object = self.record.scene.objects.get(usize::from(id.0));
        format!("{}#{}", object.map_or("object", |object| object.class.as_str()), id.0)
    }

    /// What a view gives now, without noise in its pixels; what the belief is told of it; and what that says of the grid.
    fn observe(&mut self, view: &View) -> Result<(Sensed, Frame, MapObservation)> {
        let shoot = |view: &View| self.environment.frame(view, &self.views.intrinsics);
        let (sensed, frame) = sense(&self.record, view, shoot)?;
        let observation = project(&frame, &self.record.scene.shelf);
        Ok((sensed, frame, observation))
    }

    /// Scores the new state and files the step.
    fn file(
        &mut self,
        decision: Decision,
        happened: Happened,
        updating: Instant,
        mut seconds: StepSeconds,
    ) -> StepRecord {
        let grip = happened.push.as_ref().and_then(|push| push.grip.as_ref()).map(|grip| grip.end);
        self.history.record(&decision, !happened.dropped.is_empty(), grip);
        let judge = |truth: &TruthMap| {
            let dropped = happened.dropped.iter().map(|id| self.name(*id)).collect();
            Judgement::of(&self.estimate.belief, truth, &self.catalog, dropped, happened.displacement_m)
        };
        let judgement = self.truth().map(judge);
        let scored = judgement.as_ref().map(|judgement| judgement.scores.entropy_nats);
        let entropy_nats = scored.unwrap_or_else(|| entropy_nats(&self.estimate.belief));
        seconds.update = updating.elapsed().as_secs_f64();
        let step = StepRecord {
            index: self.record.steps.len() + 1,
            action: decision.action,
            decision,
            entropy_nats,
            judgement,
            motion_s: happened.motion_s,
            push: happened.push,
            seconds,
        };
        self.record.steps.push(step.clone());
        step
    }

    /// Adds to the `record` seconds of the last step: for whoever records it.
    pub fn add_record_seconds(&mut self, seconds: f64) {
        if let Some(step) = self.record.steps.last_mut() {
            step.seconds.record += seconds;
        }
    }

    /// Whether the budget is used up.
    pub fn is_finished(&self) -> bool {
        self.record.steps.len() >= self.record.config.budget
    }

    /// The voxels that looks have seen and that no push has probably changed since: where only unseen ones count as a
    /// gain, these do not.
    pub fn seen(&self) -> &VoxelSet {
        self.estimate.sightings.seen()
    }

    /// The record so far, as `episode.json` keeps it.
    pub fn record(&self) -> &EpisodeRecord {
        &self.record
    }

    /// The belief now.
    pub fn belief(&self) -> &Belief {
        &self.estimate.belief
    }

    /// The truth now, if it is known.
    pub fn truth(&self) -> Option<&TruthMap> {
        self.filed_truth.as_deref().or_else(|| self.environment.truth())
    }

    /// The bodies where they are now, dropped ones left out; none where nobody knows.
    pub fn bodies(&self) -> Vec<Body> {
        self.simulated().map_or_else(Vec::new, |shelf| shelf.bodies().to_vec())
    }

    /// The simulation, where it is one.
    pub fn simulated(&self) -> Option<&Simulated> {
        self.environment.simulated()
    }

    pub(super) fn estimate(&self) -> &Estimate {
        &self.estimate
    }

    /// What the last belief update was told; `None` before the first action.
    pub fn told(&self) -> Option<&Told> {
        self.told.as_ref()
    }

    /// The grid of belief and truth.
    pub fn grid(&self) -> Grid {
        self.estimate.belief.grid
    }

    /// The candidate views.
    pub fn views(&self) -> &ViewArray {
        &self.views
    }

    /// The arm before the shelf.
    pub fn arm(&self) -> &Arc<ArmTool> {
        &self.arm
    }

    /// Per view, how the hand gets there; `None` where it cannot be.
    pub fn hand_poses(&self) -> &[Option<HandPose>] {
        &self.hands
    }

    /// The views that are not offered, because the hand cannot be there; none where the hand can be nowhere, so that an
    /// episode without a fitting arm still looks.
    pub fn unreachable_views(&self) -> &[ViewId] {
        &self.unreachable
    }

    /// Why this episode will never push, if that is known from the start.
    pub fn why_no_push(&self) -> Option<String> {
        let name = &self.arm.arm.name;
        let words = || format!("{name} reaches no place before the shelf from where it stands, so nothing is pushed");
        self.arm.ready.is_none().then(words)
    }

    /// The catalogue.
    pub fn catalog(&self) -> &Catalog {
        &self.catalog
    }

    /// How the belief changes.
    pub fn update(&self) -> &dyn BeliefUpdate {
        &*self.update
    }

    /// What the planner remembers.
    pub fn history(&self) -> &History {
        &self.history
    }
}

/// What an action brought beside its belief.
#[derive(Default)]
struct Happened {
    dropped: Vec<ObjectId>,
    displacement_m: f64,
    motion_s: f64,
    push: Option<PushReport>,
}

#[cfg(test)]
#[path = "machine_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "environment_tests.rs"]
mod environment_tests;
