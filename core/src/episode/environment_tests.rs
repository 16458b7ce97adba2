//! Episodes in an environment that knows no truth: it serves frames that were filed before.

use super::super::synthetic;
use super::super::{Agreement, EpisodeDir, Overwrite, infer, replay, resume, review};
use super::*;
use crate::arm::Arm;
use crate::belief::Classical;
use crate::camera::{Intrinsics, NoiseModel};
use crate::plan::PolicyKind;
use crate::world::ManipulationOutcome;
use std::collections::BTreeMap;
use std::path::Path;
use tempfile::tempdir;

/// Frames by view, without what the simulator knows of them, and an arm that does what it is told and meets nothing.
#[derive(Clone)]
struct Recording(Arc<BTreeMap<ViewId, Frame>>);

impl Environment for Recording {
    fn frame(&mut self, view: &View, _: &Intrinsics) -> Result<Sensed> {
        let frame = self.0.get(&view.id).ok_or_else(|| Error::Usage(format!("no frame from view {}", view.id.0)))?;
        Ok(Sensed { frame: frame.clone(), objects: None })
    }

    fn carry_out(&mut self, _: &Arm, motion: &PhasedMotion) -> Result<ManipulationOutcome> {
        Ok(ManipulationOutcome {
            passed: motion.phases.iter().flat_map(|phase| phase.motion.path()).collect(),
            ..ManipulationOutcome::default()
        })
    }

    fn truth(&self) -> Option<&TruthMap> {
        None
    }

    fn branch(&self) -> Option<Box<dyn Environment>> {
        Some(Box::new(self.clone()))
    }
}

/// What all views of a real shelf show.
fn recording() -> Recording {
    let episode = synthetic::episode(PolicyKind::Random, 1);
    let (shelf, views) = (episode.simulated().expect("simulated"), episode.views());
    let frame = |view: &View| (view.id, shelf.frame_from(view, &views.intrinsics).frame);
    Recording(Arc::new(views.views.iter().step_by(10).map(frame).collect()))
}

/// The shelf without anything that is known to stand in it.
fn bare(policy: PolicyKind, noise: Option<NoiseModel>) -> Result<Episode> {
    let scene = Scene { objects: Vec::new(), ..synthetic::cluttered_scene() };
    let config = EpisodeConfig { noise, ..synthetic::config(policy, 7) };
    let environment = Box::new(recording());
    Episode::within(environment, scene, Arc::new(Catalog::standard()), config, Arc::new(Classical))
}

fn run(path: &Path, noise: Option<NoiseModel>) -> Episode {
    let mut episode = bare(PolicyKind::RandomPush5, noise).expect("an episode");
    let mut directory = EpisodeDir::create(path, Overwrite::Refuse).expect("created");
    directory.write(&mut episode).expect("written");
    while !episode.is_finished() {
        let mut decision = episode.decide();
        if let Action::Look { view } = &mut decision.action {
            view.0 -= view.0 % 10;
        }
        episode.act(decision).expect("an action");
        directory.write(&mut episode).expect("written");
    }
    episode
}

#[test]
fn a_whole_episode_runs_is_filed_and_inferred_without_a_truth() {
    let root = tempdir().expect("a folder");
    for (name, noise) in [("clear", None), ("noisy", Some(NoiseModel::STANDARD))] {
        let path = root.path().join(name);
        let episode = run(&path, noise);
        let record = episode.record();
        assert!(record.steps.iter().any(|step| matches!(step.action, Action::Manipulate(_))), "it pushes too");
        assert!(!record.has_truth() && record.steps.iter().all(|step| step.judgement.is_none()));
        assert!(record.entropy_after(7) < 0.8 * record.entropy_after(0), "and learns");
        assert!(episode.truth().is_none() && episode.bodies().is_empty() && episode.counterfactual().is_none());

        let directory = EpisodeDir::open(&path).expect("opens");
        assert_eq!(directory.record().expect("a record"), *record);
        let text = std::fs::read_to_string(path.join("episode.json")).expect("text");
        assert!(!text.contains("occupancy_iou") && !text.contains("displacement_m") && text.contains("entropy_nats"));
        let report = infer(&directory, Arc::new(Classical), &mut |_, _| {}).expect("inferred");
        assert_eq!(report.agreement, Agreement::BitEqual, "{:?}", report.differences);

        // What is not simulated can be looked at, frames and all, and not be repeated or gone on with.
        let mut seen = Vec::new();
        let (again, difference) =
            review(&path, Arc::new(Catalog::standard()), Some(Arc::new(Classical)), &mut |episode, outcome| {
                seen.push(outcome.is_some_and(|outcome| outcome.frame.is_some() != outcome.swept.is_some()));
                assert!(episode.truth().is_none());
                Ok(())
            })
            .expect("reviewed");
        assert!(difference.is_none() && again.record() == record);
        assert_eq!(seen, [false, true, true, true, true, true, true, true]);
        let catalog = || Arc::new(Catalog::standard());
        let said = |error: Option<Error>| error.expect("refused").to_string();
        let replayed = said(replay(&directory, catalog(), Arc::new(Classical), &mut |_, _| {}).err());
        assert!(replayed.contains("cannot be simulated again: no ground truth"), "{replayed}");
        let resumed = said(resume(&path, catalog(), Arc::new(Classical), &mut |_, _| Ok(())).err());
        assert!(resumed.contains("cannot be resumed: no ground truth"), "{resumed}");
    }
}

#[test]
fn a_policy_that_knows_the_future_needs_a_simulation() {
    for policy in [PolicyKind::Oracle, PolicyKind::ClairvoyantPush] {
        let error = bare(policy, None).err().expect("refused");
        assert!(error.to_string().contains("only a simulated shelf tells") && error.exit_code() == 2, "{error}");
    }
}

#[test]
fn an_action_that_the_environment_refuses_leaves_the_episode_as_it_was() {
    let mut episode = bare(PolicyKind::Random, None).expect("an episode");
    let mut decision = episode.decide();
    decision.action = Action::Look { view: ViewId(1) };
    assert_eq!(episode.act(decision).expect_err("refused").to_string(), "no frame from view 1");
    assert!(episode.record().steps.is_empty() && episode.history().actions.is_empty() && episode.told().is_none());
    let mut branch = episode.branch().expect("recordings branch");
    let mut decision = branch.decide();
    decision.action = Action::Look { view: ViewId(10) };
    branch.act(decision).expect("there is one");
    assert_eq!((branch.record().steps.len(), episode.record().steps.len()), (1, 0));
}
