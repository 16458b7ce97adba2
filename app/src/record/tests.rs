use super::*;
use crate::fixture;
use nudge_core::arm::ArmTool;
use nudge_core::gain::{Openings, RayDensity};
use nudge_core::grid::VoxelSet;
use nudge_core::plan::{self, Counted};

/// Where a test keeps its output: `NUDGE_KEEP` if that is set, else a directory that goes with the guard.
fn output() -> (PathBuf, Option<tempfile::TempDir>) {
    match std::env::var_os("NUDGE_KEEP") {
        Some(kept) => (kept.into(), None),
        None => {
            let directory = tempfile::tempdir().expect("temporary directory");
            (directory.path().to_owned(), Some(directory))
        }
    }
}

#[test]
fn a_recording_stays_small_and_names_its_entities() {
    let steps = 14;
    let played = fixture::play(steps);
    let (directory, _guard) = output();
    let path = directory.join("episode.rrd");
    let arm = ArmTool::standard(played.record.scene.shelf);
    let setting = Setting {
        shelf: &played.record.scene.shelf,
        catalog: &played.catalog,
        views: &played.views,
        budget: steps,
        planner: &PlannerSettings::default(),
        arm: &arm,
        unreachable: &[],
    };
    let mut recorder = Recorder::begin(&path, "test", &setting).expect("file");
    let mut sizes = Vec::new();
    for step in 0..=steps {
        let scores = played.record.scores_after(step);
        let state = State {
            step,
            bodies: &played.bodies[step],
            belief: &played.beliefs[step],
            seen: &VoxelSet::empty(&played.beliefs[step].grid),
            truth: Some(&played.truths[step]),
            scores,
            entropy_nats: played.record.entropy_after(step),
        };
        recorder.state(&setting, &state).expect("state");
        if let Some(outcome) = step.checked_sub(1).map(|at| &played.outcomes[at]) {
            let gain = gain::Gain { nats: vec![(5, 1.0), (80, 2.0)], words: "a gain: 3 nats".to_owned() };
            recorder.outcome(&setting, &played.beliefs[step], outcome, Some(&gain)).expect("outcome");
        }
        recorder.flush().expect("flushed");
        sizes.push(std::fs::metadata(&path).expect("file").len());
    }
    recorder.finish().expect("finished");
    let total = std::fs::metadata(&path).expect("file").len();
    let growth: Vec<u64> = sizes.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(growth.iter().all(|bytes| *bytes > 10_000), "every step reaches the file at once: {growth:?}");
    assert!(total / steps as u64 <= 1_500_000, "{total} bytes in {steps} steps: {growth:?}");
    let bytes = std::fs::read(&path).expect("file");
    assert!(bytes.starts_with(b"RRF2"));
}
#[test]
fn entities_are_named_as_the_contract_says() {
    let names = [
        (paths::SHELF, "world/shelf"),
        (paths::CAMERA_VIEWS, "camera/views"),
        (paths::CAMERA_REACH, "camera/reach"),
        (paths::CAMERA_CURRENT, "camera/current"),
        (paths::ROBOT_PATH, "robot/path"),
        (paths::OBSERVATION_DEPTH, "observation/depth"),
        (paths::OBSERVATION_LABELS, "observation/labels"),
        (paths::BELIEF_OCCUPANCY, "belief/occupancy"),
        (paths::BELIEF_SEMANTICS, "belief/semantics"),
        (paths::BELIEF_ENTROPY, "belief/entropy"),
        (paths::BELIEF_CERTAINTY, "belief/certainty"),
        (paths::GAIN_VIEWS, "gain/views"),
        (paths::GAIN_VOXELS, "gain/voxels"),
        (paths::GAIN_LABEL, "gain/voxels/label"),
        (paths::PUSH_CANDIDATES, "push/candidates"),
        (paths::PUSH_CHOSEN, "push/chosen"),
        (paths::PUSH_SWEPT, "push/swept"),
        (paths::PREDICTED_OCCUPANCY, "predicted/occupancy"),
        (paths::PREDICTED_SEMANTICS, "predicted/semantics"),
        (paths::PREDICTED_CHANGE, "predicted/change"),
        (paths::PREDICTED_SURPRISE, "predicted/surprise"),
        (paths::DECISION, "decision"),
        (paths::NOTES, "notes"),
        (paths::VERDICTS, "verdicts"),
        (paths::LOG, "log"),
    ];
    for (name, contract) in names {
        assert_eq!(name, contract);
    }
    assert_eq!(paths::object(ObjectId(7)), "world/objects/7");
    assert_eq!(paths::robot_body(2), "robot/bodies/2");
    assert_eq!(paths::score("entropy_nats"), "scores/entropy_nats");
    let (stream, _storage) = RecordingStreamBuilder::new(APPLICATION).memory().expect("stream");
    assert_eq!(Recorder::bare(stream.clone(), "", Path::new(""), Fault::default()).at(paths::LOG).to_string(), "/log");
    assert_eq!(Recorder::bare(stream, "b", Path::new(""), Fault::default()).at(paths::LOG).to_string(), "/b/log");
}

#[test]
fn a_directory_that_is_not_there_is_named() {
    let error = file_stream(Path::new("/nowhere/at/all/episode.rrd"), "x").map(|_| ()).expect_err("no such directory");
    assert!(error.to_string().starts_with("/nowhere/at/all/episode.rrd: "), "{error}");
}

#[test]
fn a_pushs_gain_is_drawn_as_its_own_worth_and_not_as_that_of_the_view_after_it() {
    let played = fixture::play(4);
    let arm = ArmTool::standard(played.record.scene.shelf);
    let (outcome, before) = (&played.outcomes[3], &played.beliefs[3]);
    let Action::Manipulate(push) = outcome.record.action else { panic!("the fourth action is a push") };
    let none = VoxelSet::empty(&before.grid);
    let counting = |counted| plan::Gain::new(counted, before, &none);
    let drawn = |counted| {
        let setting = Setting {
            shelf: &played.record.scene.shelf,
            catalog: &played.catalog,
            views: &played.views,
            budget: 4,
            planner: &PlannerSettings { counted, ..PlannerSettings::default() },
            arm: &arm,
            unreachable: &[],
        };
        gain::of(&setting, &counting(counted), outcome).expect("a gain")
    };
    let ids: Vec<ViewId> = played.views.views.iter().map(|view| view.id).step_by(5).collect();
    let unseen = counting(Counted::Unseen);
    let openings = Openings::new(unseen.field(), &played.views, &ids, RayDensity::COARSE);
    let opened = openings.under_each(outcome.prediction.as_slice())[0];
    let gain = drawn(Counted::Unseen);
    let sum: f32 = gain.nats.iter().map(|(_, nats)| nats).sum();
    assert!(opened > 0.0 && (sum - opened).abs() < 1e-2 * opened, "{sum} drawn, {opened} opened");
    assert!(gain.words.starts_with("Worth of the push, what it opens to all views together: "), "{}", gain.words);
    let view = outcome.record.decision.candidates.iter().find(|candidate| candidate.manipulation == push).expect("it");
    let view = view.view.expect("a view").0;
    let gain = drawn(Counted::All);
    assert!(gain.words.contains(&format!("the best view after it, view {view}: ")), "{}", gain.words);
}
