use super::super::synthetic;
use super::*;
use crate::belief::CHANGED;
use crate::camera::NoiseModel;
use crate::plan::{Counted, PlannerSettings, PolicyKind, Reason};
use crate::score::{Scores, Verdict};
use crate::skill::Push;

/// What a step is but for its seconds.
fn timeless(step: &StepRecord) -> StepRecord {
    StepRecord { seconds: StepSeconds::default(), ..step.clone() }
}

/// A decision of a person's.
fn manual(action: Action) -> Decision {
    Decision { gains: vec![0.0; 300], ..Decision::unweighed(action, Reason::Manual) }
}

/// A push into the front of the pasta box.
const HEAD_ON: Push = Push { start: [0.02, 0.11, 0.06], direction_deg: 90.0, length_m: 0.08 };

#[test]
fn looking_tells_what_is_there() {
    let mut episode = synthetic::episode(PolicyKind::Random, 6);
    let prior = episode.record().prior.scores.expect("a truth");
    while !episode.is_finished() {
        let outcome = episode.act(episode.decide()).expect("an action");
        assert!(outcome.frame.is_some() && outcome.observation.is_some());
        assert!(outcome.swept.is_none() && outcome.prediction.is_none() && outcome.manipulated.is_none());
        assert_eq!(&outcome.record, episode.record().steps.last().expect("a step"));
        let scores = Scores::of(episode.belief(), episode.truth().expect("a truth"));
        assert_eq!((outcome.record.scores(), outcome.record.entropy_nats), (Some(&scores), scores.entropy_nats));
        let seconds = outcome.record.seconds;
        assert!(seconds.decide > 0.0 && seconds.act > 0.0 && seconds.update > 0.0, "{seconds:?}");
    }
    let indices: Vec<usize> = episode.record().steps.iter().map(|step| step.index).collect();
    assert_eq!(indices, [1, 2, 3, 4, 5, 6]);
    let last = episode.record().steps.last().expect("a step");
    let scores = last.scores().expect("a truth");
    assert!(scores.entropy_nats < 0.7 * prior.entropy_nats, "{scores:?}");
    assert!(scores.semantic_miou > 5.0 * prior.semantic_miou, "{scores:?}");
    assert!(last.objects().iter().any(|verdict| verdict.verdict == Verdict::Found), "{:?}", last.objects());
    assert_eq!(last.objects().iter().filter(|verdict| verdict.object.is_some()).count(), 6);
}

#[test]
fn a_push_moves_objects_and_is_predicted_into_the_belief() {
    let mut episode = synthetic::episode(PolicyKind::Mem, 4);
    for view in [45, 147] {
        episode.act(manual(Action::Look { view: ViewId(view) })).expect("a look");
    }
    let (belief, truth) = (episode.belief().clone(), episode.truth().cloned());
    let outcome = episode.act(manual(Action::Manipulate(HEAD_ON.into()))).expect("a push");
    assert!(outcome.record.displacement_m().is_some_and(|m| m > 0.01), "{:?}", outcome.record.displacement_m());
    assert!(outcome.record.dropped().is_empty());
    assert_ne!(episode.truth().cloned(), truth);
    let mut predicted = belief.clone();
    predicted.apply(&outcome.prediction.expect("a prediction"));
    assert!(*episode.belief() == predicted && predicted != belief);
    assert!(outcome.frame.is_none() && outcome.swept.is_some_and(|swept| !swept.swept.is_empty()));
    assert_eq!(episode.history().used_views, []);
    assert_eq!(episode.history().actions.len(), 3);
}

#[test]
fn what_looks_have_seen_counts_no_more_until_a_push_changes_it() {
    let decided = |episode: &Episode, view: u16| episode.decide().gains[usize::from(view)];
    let mut episode = counting_unseen(PolicyKind::MemNoPush, 6);
    assert!(episode.seen().is_empty());
    let first = decided(&episode, 145);
    let outcome = episode.act(manual(Action::Look { view: ViewId(145) })).expect("a look");
    let observation = outcome.observation.expect("of a look");
    let seen = episode.seen().clone();
    assert_eq!(seen.len(), observation.free.len() + observation.occupied.len());
    // Only what its rays, which are denser than the gain's, did not reach is left to gain from the same place.
    let again = decided(&episode, 145);
    assert!(again < 0.05 * first, "{again} of {first}");

    let outcome = episode.act(manual(Action::Manipulate(HEAD_ON.into()))).expect("a push");
    let (grid, prediction) = (episode.grid(), outcome.prediction.expect("a person's push is predicted"));
    let now = episode.seen();
    let changed = prediction.window.cells(&grid).zip(&prediction.change).filter(|(_, chance)| **chance > CHANGED);
    let changed: Vec<usize> = changed.map(|(cell, _)| cell).collect();
    assert!(!changed.is_empty());
    for cell in 0..grid.cell_count() {
        let kept = grid.column(cell).all(|voxel| now.contains(voxel) == seen.contains(voxel));
        let forgotten = grid.column(cell).all(|voxel| !now.contains(voxel));
        assert!(if changed.contains(&cell) { forgotten } else { kept }, "cell {cell}");
    }
    assert!(decided(&episode, 145) > again, "the push is worth a look");
}

#[test]
fn all_voxels_count_as_they_are_and_a_blind_push_makes_everything_unseen() {
    let mut episode = synthetic::episode(PolicyKind::MemNoPush, 3);
    let before = episode.decide().gains[145];
    episode.act(manual(Action::Look { view: ViewId(145) })).expect("a look");
    assert!(!episode.seen().is_empty() && episode.decide().gains[145] > 0.05 * before);

    let mut blind = counting_unseen(PolicyKind::RandomPush5Blind, 6);
    blind.act(manual(Action::Look { view: ViewId(145) })).expect("a look");
    let unpredicted = Decision { reason: Reason::Schedule, ..manual(Action::Manipulate(HEAD_ON.into())) };
    blind.act(unpredicted).expect("a push");
    assert!(blind.seen().is_empty());
}

/// An episode in which only unseen voxels count as a gain.
fn counting_unseen(policy: PolicyKind, budget: usize) -> Episode {
    let plain = synthetic::config(policy, budget);
    let planner = PlannerSettings { counted: Counted::Unseen, ..plain.planner };
    synthetic::episode_with(EpisodeConfig { planner, ..plain })
}

#[test]
fn a_blind_policy_leaves_the_belief_as_it_is_after_its_push() {
    let mut episode = synthetic::episode(PolicyKind::RandomPush5Blind, 4);
    episode.act(manual(Action::Look { view: ViewId(45) })).expect("a look");
    let (belief, truth) = (episode.belief().clone(), episode.truth().cloned());
    let decision = Decision { reason: Reason::Schedule, ..manual(Action::Manipulate(HEAD_ON.into())) };
    let outcome = episode.act(decision).expect("a push");
    assert!(outcome.prediction.is_none());
    assert!(*episode.belief() == belief && episode.truth().cloned() != truth);
}

#[test]
fn deciding_changes_nothing_and_a_branch_goes_its_own_way() {
    let mut episode = synthetic::episode(PolicyKind::Mem, 5);
    episode.act(episode.decide()).expect("a look");
    let decision = episode.decide();
    assert_eq!(decision, episode.decide());
    let before = (episode.record().clone(), episode.belief().clone(), episode.truth().cloned());
    let mut branch = episode.branch().expect("a simulated shelf branches");
    let push = branch.act(manual(Action::Manipulate(HEAD_ON.into()))).expect("a push");
    assert!(push.record.displacement_m() > Some(0.0));
    assert!(before == (episode.record().clone(), episode.belief().clone(), episode.truth().cloned()));
    assert_eq!(decision, episode.decide());
    let mut twin = episode.branch().expect("a simulated shelf branches");
    let (one, other) = (episode.act(decision.clone()).expect("a look"), twin.act(decision).expect("a look"));
    assert_eq!(timeless(&one.record), timeless(&other.record));
    assert!(episode.belief() == twin.belief());
    // The same push after the same look leads to the same truth.
    let again = episode.act(manual(Action::Manipulate(HEAD_ON.into()))).expect("a push");
    assert_eq!(again.manipulated, push.manipulated);
}

#[test]
fn what_cannot_be_done_is_refused_and_changes_nothing() {
    let mut episode = synthetic::episode_with(synthetic::config(PolicyKind::Random, 1));
    let before = episode.record().clone();
    let push = |push: Push| manual(Action::Manipulate(push.into()));
    let refused = [
        (manual(Action::Look { view: ViewId(300) }), "view 300 of 300 in standard300"),
        (push(Push { length_m: f32::NAN, ..HEAD_ON }), "a push must be a finite motion"),
        (push(Push { start: [f32::INFINITY; 3], ..HEAD_ON }), "a push must be a finite motion"),
        (push(Push { length_m: -0.1, ..HEAD_ON }), "a push must be a finite motion"),
        (push(Push { start: [0.38, 0.11, 0.06], ..HEAD_ON }), "the arm cannot carry this push out: "),
        (push(Push { start: [0.0, 2.0, 0.06], ..HEAD_ON }), "out of the arm's reach at the start"),
    ];
    for (decision, words) in refused {
        let error = episode.act(decision).expect_err("refused");
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains(words), "{error}");
    }
    assert_eq!(*episode.record(), before);
    episode.act(manual(Action::Look { view: ViewId(0) })).expect("a look");
    let error = episode.act(manual(Action::Look { view: ViewId(0) })).expect_err("refused").to_string();
    assert_eq!(error, "the budget of 1 actions is used up");

    let new = |config| {
        let catalog = Arc::new(Catalog::standard());
        Episode::new(synthetic::cluttered_scene(), catalog, config, Arc::new(crate::belief::Classical)).err()
    };
    let config = synthetic::config(PolicyKind::Mem, 3);
    assert!(new(EpisodeConfig { belief: "cnabu".to_owned(), ..config.clone() }).is_some());
    assert!(new(EpisodeConfig { views: "nowhere".to_owned(), ..config.clone() }).is_some());
    assert!(new(EpisodeConfig { budget: 0, ..config }).is_some());
}

/// The arm's motion for a push with the gripper turned away from where it pulls to: in from the left, around a can.
fn hook(episode: &Episode, push: &Push) -> PhasedMotion {
    let tool = episode.arm();
    let (arm, ready) = (&tool.arm, tool.ready.expect("a place to wait"));
    let tip = push.start_point().map(f64::from);
    let pose = crate::arm::level_tool(&tip, -0.9);
    let travel = push.direction().map(f64::from) * f64::from(push.length_m);
    let aside = nalgebra::Vector3::new(-0.30, -0.15, 0.0);
    let ways = arm.inverse(&pose, &ready).into_iter().filter_map(|start| {
        let along = crate::arm::follow_line(arm, &start, &travel, |_| true);
        let out = crate::arm::follow_line(arm, &start, &aside, |_| true);
        let way_in: Vec<_> = std::iter::once(ready).chain(out.path.iter().rev().copied()).collect();
        (along.complete && out.complete).then(|| PhasedMotion::new(arm, &way_in, &along.path))
    });
    ways.min_by(|a, b| a.duration_s(arm).total_cmp(&b.duration_s(arm))).expect("a way around")
}

#[test]
fn a_drop_is_recorded_and_ends_the_pushing() {
    // A can that stands over the edge, 2 cm of its radius of 3.3 cm on the board, hooked from behind and pulled out.
    let mut scene = synthetic::cluttered_scene();
    scene.objects = vec![crate::scene::Object::new("tomato_can", [0.0, 0.02], 0.0)];
    let config = synthetic::config(PolicyKind::Mem, 6);
    let catalog = Arc::new(Catalog::standard());
    let mut episode = Episode::new(scene, catalog, config, Arc::new(crate::belief::Classical)).expect("an episode");
    let push = Push { start: [0.02, 0.09, 0.06], direction_deg: -80.0, length_m: 0.15 };
    let mut hooked = manual(Action::Manipulate(push.into()));
    hooked.motion = Some(hook(&episode, &push));
    let outcome = episode.act(hooked).expect("a push");
    assert_eq!(outcome.record.dropped(), ["tomato_can#0"]);
    assert!(
        episode.bodies().is_empty()
            && episode.truth().expect("a truth").occupancy.iter().all(|occupied| *occupied == 0)
    );
    assert!(episode.history().dropped && outcome.record.objects().is_empty());
    let error = episode.act(manual(Action::Manipulate(push.into()))).expect_err("refused").to_string();
    assert_eq!(error, "an object was dropped: this episode pushes no more");
    while !episode.is_finished() {
        let decision = episode.decide();
        assert!(matches!(decision.action, Action::Look { .. }));
        episode.act(decision).expect("a look");
    }
}

#[test]
fn noise_changes_what_is_seen_and_repeats() {
    let config = synthetic::config(PolicyKind::Random, 2);
    let run = |noise| {
        let mut episode = synthetic::episode_with(EpisodeConfig { noise, ..config.clone() });
        while !episode.is_finished() {
            episode.act(episode.decide()).expect("a look");
        }
        episode.belief().clone()
    };
    let (clear, noisy) = (run(None), run(Some(NoiseModel::STANDARD)));
    assert!(clear != noisy && noisy == run(Some(NoiseModel::STANDARD)) && clear == run(Some(NoiseModel::OFF)));
}

#[test]
fn an_episode_does_not_depend_on_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| {
            let mut episode = synthetic::episode(PolicyKind::RandomPush5, 6);
            while !episode.is_finished() {
                episode.act(episode.decide()).expect("an action");
            }
            let steps: Vec<StepRecord> = episode.record().steps.iter().map(timeless).collect();
            (steps, episode.belief().clone(), episode.truth().cloned())
        })
    };
    let (one, three) = (run(1), run(3));
    assert!(matches!(one.0[4].action, Action::Manipulate(_)), "{:?}", one.0[4].decision.reason);
    assert_eq!(one.0, three.0);
    assert!(one.1 == three.1 && one.2 == three.2);
}
