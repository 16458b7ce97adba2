//! What manipulations are worth: beside what the planner promised of each candidate, what it really does.
//!
//! An episode is gone through again up to a decision, so that the world stands as it stood; there every feasible push
//! candidate is carried out in a copy of the world ([`crate::skill::Counterfactual`]). Over the candidates of a decision
//! two questions are answered, once for the objects that pushes bring into sight (won minus lost) and once for the space that
//! they open ([`Measure`]):
//!
//! * Does the promise order pushes as the truth does? Spearman's rank correlation of candidate gain and truth.
//! * What does the choice cost? The regret: the best candidate's truth minus that of the one with the largest promise.
//!
//! The mean over the candidates stands for a push at random. Beside them stands how well the belief predicts each: the
//! cross-entropy of what is occupied afterwards, by the prediction and by the belief as it is.
//!
//! Two other judges are asked the same first question, to tell what a poor choice is due to: the space that each candidate truly
//! opens, and the mean over completions of the shelf (`completion`), which is the most that a belief can know.

mod completion;
mod predicted;
mod summary;

pub use summary::{Measure, MeasureSummary, StepSummary};

use crate::arm::PhasedMotion;
use crate::belief::BeliefUpdate;
use crate::episode::{Difference, Episode, EpisodeDir, EpisodeRecord, NO_TRUTH, StepRecord, StoredTruth, revisit};
use crate::plan::{Action, CandidateRecord, Reason, ranked};
use crate::rng::stream;
use crate::scene::Catalog;
use crate::skill::{ArmClearance, Manipulation, PushTruth};
use crate::world::{GripEnd, TruthMap};
use crate::{Error, Result};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// Difference of the sums of displacements up to which a push did the same as in the episode, metres.
const SAME_M: f64 = 1e-6;

/// A push candidate with what was promised of it and what it really does.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProbedPush {
    /// Its position among the decision's candidates.
    pub candidate: usize,
    /// The manipulation.
    #[serde(flatten)]
    pub manipulation: Manipulation,
    /// What the planner promised, nats; `None` where it weighed none (pushes at random).
    pub promised_gain: Option<f32>,
    /// What it expected to blur, nats, at most 0.
    pub promised_reg: Option<f32>,
    /// Voxels that it opens: that no look has seen, no view reached before it and one reaches after it.
    pub opened_voxels: usize,
    /// Their volume, litres.
    pub opened_l: f64,
    /// Objects that it brings into sight, `class#id`.
    pub won: Vec<String>,
    /// Objects that it takes out of sight, dropped ones included, `class#id`.
    pub lost: Vec<String>,
    /// How far the tip came along the push, metres.
    pub pushed_m: f32,
    /// Whether the arm was blocked and gave up before the push's end.
    pub jammed: bool,
    /// Objects that left the board, `class#id`.
    pub dropped: Vec<String>,
    /// Objects that stood and lie then, `class#id`.
    pub toppled: Vec<String>,
    /// Sum of the objects' displacements, metres.
    pub displacement_m: f64,
    /// How holding an object ended, of a pick.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grip: Option<GripEnd>,
    /// How well the belief's prediction tells what is occupied after it: cross-entropy over all voxels, nats.
    pub predicted_nats: f64,
    /// The same of the belief as it is, as if nothing changed.
    pub unchanged_nats: f64,
    /// Mean over completions of the shelf of the objects that it wins minus those that it loses; `None` where none was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub completed: Option<f64>,
}

/// The pushes of one decision.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepProbe {
    /// The step, 1 for the first.
    pub step: usize,
    /// Why the decision was what it was.
    pub reason: Reason,
    /// Gain of the best pair of views, nats.
    pub igv: f32,
    /// Objects that no view shows before the step, `class#id`.
    pub hidden: Vec<String>,
    /// The feasible candidates, in the order drawn.
    pub pushes: Vec<ProbedPush>,
    /// Position in `pushes` of the one that the planner held to be best, whether or not it was made.
    pub chosen: Option<usize>,
    /// Position in `pushes` of the one that was made, if it is one of them.
    pub made: Option<usize>,
    /// Whether that one did here what it did in the episode: its objects came equally far.
    pub agrees: Option<bool>,
    /// Feasible candidates for which the arm has no motion now; none where the belief is that of the log.
    pub left_out: usize,
}

impl StepProbe {
    /// Positions in `pushes` as the planner ranks them: the best one first.
    pub fn ranked(&self) -> Vec<usize> {
        ranked(self.chosen, self.pushes.iter().map(|push| push.promised_gain))
    }
}

/// The steps of a record whose decisions have feasible push candidates, with how many: what can be probed.
pub fn probable_steps(record: &EpisodeRecord) -> Vec<(usize, usize)> {
    let counted = record.steps.iter().map(|step| (step.index, feasible(step).count()));
    counted.filter(|(_, count)| *count > 0).collect()
}

/// Checks that the decision at a step can be probed; says how many candidates it has.
///
/// # Errors
/// [`Error::Input`] for a step before the first or beyond the last, and for one without a feasible push candidate: names the
/// episode and the step.
pub fn check_step(path: &Path, record: &EpisodeRecord, step: usize) -> Result<usize> {
    let place = format!("step {step}");
    let Some(logged) = step.checked_sub(1).and_then(|at| record.steps.get(at)) else {
        let message = format!("is not in the episode, which has steps 1 to {}", record.steps.len());
        return Err(Error::input(path, place, message.replace("steps 1 to 0", "no steps")));
    };
    match (feasible(logged).count(), logged.decision.candidates.len()) {
        (0, 0) => Err(Error::input(path, place, "has no push candidates: none was weighed there")),
        (0, drawn) => {
            Err(Error::input(path, place, format!("has no feasible push candidate: all {drawn} were rejected")))
        }
        (count, _) => Ok(count),
    }
}

/// Goes through the episode in a directory again and probes the decisions at some steps, with so many completions of the shelf each.
/// `carried_out` is called after every push, in a completion or not, from any thread; `each` is shown every step when it is done. Nothing is written. The second value is the
/// first place where repeating the episode did not lead where the log says: the candidates are those of the log even so.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// Those of [`check_step`], of reading the directory and of setting up the episode, of a scene that cannot be simulated
/// ([`Error::Input`], which names the directory); [`Error::Check`] where bodies do not stand as they stood in the episode.
pub fn probe(
    directory: &EpisodeDir,
    catalog: Arc<Catalog>,
    update: Arc<dyn BeliefUpdate>,
    steps: &BTreeSet<usize>,
    completions: usize,
    carried_out: &(dyn Fn() + Sync),
    each: &mut dyn FnMut(&StepProbe),
) -> Result<(Vec<StepProbe>, Option<Difference>)> {
    let (record, path) = (directory.record()?, directory.path());
    if !record.has_truth() {
        let message = format!("cannot be probed: {NO_TRUTH}, only a simulated shelf tells what pushes would really do");
        return Err(Error::input(path, "", message));
    }
    for step in steps {
        check_step(path, &record, *step)?;
    }
    record.scene.bodies(&catalog).map_err(|error| {
        let message = format!("its scene cannot be simulated: {error}");
        Error::input(path, "", message)
    })?;
    let actions = steps.last().map_or(0, |last| last - 1);
    let mut probes = Vec::new();
    let difference = revisit(directory, catalog, update, actions, &mut |episode, _| {
        let done = episode.record().steps.len();
        if steps.contains(&(done + 1)) {
            stands_as_filed(directory, episode, done)?;
            if let Some(probe) = probe_step(episode, &record.steps[done], completions, carried_out) {
                each(&probe);
                probes.push(probe);
            }
        }
        Ok(())
    })?;
    Ok((probes, difference))
}

/// Probes the decision of a step of the log, of which `episode` has done all before; `None` where nothing is simulated.
pub fn probe_step(
    episode: &Episode,
    logged: &StepRecord,
    completions: usize,
    carried_out: &(dyn Fn() + Sync),
) -> Option<StepProbe> {
    let decision = &logged.decision;
    let known = episode.counterfactual()?;
    let (at, motions): (Vec<usize>, Vec<PhasedMotion>) = motions(episode, logged).into_iter().unzip();
    let truths = known.of_each(&motions, carried_out);
    let chosen: Vec<Manipulation> = at.iter().map(|&at| decision.candidates[at].manipulation).collect();
    let nats = predicted::nats(episode, &chosen, &motions, &truths);
    let mut pushes: Vec<ProbedPush> = (at.iter().zip(truths).zip(nats))
        .map(|((&at, truth), nats)| probed(episode, at, &decision.candidates[at], truth, nats))
        .collect();
    if completions > 0 {
        let worths = completion::worths(episode, known.hidden(), &motions, completions, carried_out);
        pushes.iter_mut().zip(worths).for_each(|(push, worth)| push.completed = Some(worth));
    }
    let position = |candidate: Option<usize>| pushes.iter().position(|push| Some(push.candidate) == candidate);
    let made = match logged.action {
        Action::Look { .. } => None,
        Action::Manipulate(done) => pushes.iter().position(|probed| probed.manipulation == done),
    };
    Some(StepProbe {
        step: logged.index,
        reason: decision.reason,
        igv: decision.igv,
        hidden: known.hidden().iter().map(|id| episode.name(*id)).collect(),
        chosen: position(decision.best_push),
        made,
        agrees: made
            .zip(logged.displacement_m())
            .map(|(at, moved_m)| (pushes[at].displacement_m - moved_m).abs() <= SAME_M),
        left_out: feasible(logged).count() - pushes.len(),
        pushes,
    })
}

/// The feasible candidates of a step's decision, with their positions.
fn feasible(step: &StepRecord) -> impl Iterator<Item = (usize, &CandidateRecord)> {
    step.decision.candidates.iter().enumerate().filter(|(_, candidate)| candidate.rejection.is_none())
}

/// The arm's motion for every feasible candidate: the one that the log keeps; else the one with which the candidate is
/// drawn again; else, where the belief is not quite that of the log, one planned anew. Candidates without any are left out.
fn motions(episode: &Episode, logged: &StepRecord) -> Vec<(usize, PhasedMotion)> {
    let (tool, seed) = (episode.arm(), episode.record().config.seed);
    let drawn = episode.draw_candidates();
    let clearance = ArmClearance::new(tool, episode.belief());
    let of = |(at, candidate): (usize, &CandidateRecord)| {
        let skill = candidate.manipulation.skill();
        let kept = |motion: &&PhasedMotion| tool.ready.is_some_and(|ready| skill.is_done_by(motion, &tool.arm, &ready));
        let again = || {
            let drawn = drawn.get(at).filter(|drawn| drawn.manipulation == candidate.manipulation);
            drawn.and_then(|drawn| drawn.motion.clone())
        };
        let anew = || skill.plan(&clearance, &mut stream(seed, "probe", at as u64)).ok();
        let motion = logged.decision.motion.as_ref().filter(kept).cloned().or_else(again).or_else(anew)?;
        Some((at, motion))
    };
    feasible(logged).filter_map(of).collect()
}

fn probed(
    episode: &Episode,
    candidate: usize,
    promised: &CandidateRecord,
    truth: PushTruth,
    [predicted_nats, unchanged_nats]: [f64; 2],
) -> ProbedPush {
    let names = |ids: &[crate::scene::ObjectId]| ids.iter().map(|id| episode.name(*id)).collect();
    let opened_voxels = truth.opened.len();
    ProbedPush {
        candidate,
        manipulation: promised.manipulation,
        promised_gain: promised.gain,
        promised_reg: promised.reg,
        opened_voxels,
        opened_l: 1e3 * opened_voxels as f64 * f64::from(episode.grid().voxel_m).powi(3),
        won: names(&truth.won),
        lost: names(&truth.lost),
        pushed_m: truth.pushed_m,
        jammed: truth.jammed,
        dropped: names(&truth.dropped),
        toppled: names(&truth.toppled),
        displacement_m: truth.displacement_m,
        grip: truth.grip,
        predicted_nats,
        unchanged_nats,
        completed: None,
    }
}

/// Makes sure that the bodies stand as they stood after so many actions.
fn stands_as_filed(directory: &EpisodeDir, episode: &Episode, actions: usize) -> Result<()> {
    let now = StoredTruth::from(&TruthMap::of(&episode.grid(), &episode.bodies()));
    let filed = directory.read_truth(actions)?;
    let same_objects = filed.objects.is_none() || filed.objects == now.objects;
    if (&filed.occupancy, &filed.labels) == (&now.occupancy, &now.labels) && same_objects {
        return Ok(());
    }
    let path = directory.path().display();
    Err(Error::Check(format!(
        "{path}: cannot be probed: before step {} the objects do not stand as they stood (written by another version, or on \
         another machine)",
        actions + 1
    )))
}

#[cfg(test)]
mod tests;
