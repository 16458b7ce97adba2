use super::*;
use crate::fixture;
use nudge_core::arm::ArmTool;

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
        let scores = step.checked_sub(1).map_or(&played.record.prior, |at| &played.record.steps[at].scores);
        let state = State {
            step,
            bodies: &played.bodies[step],
            belief: &played.beliefs[step],
            seen: None,
            truth: &played.truths[step],
            scores,
        };
        recorder.state(&setting, &state).expect("state");
        if let Some(outcome) = step.checked_sub(1).map(|at| &played.outcomes[at]) {
            recorder.outcome(&setting, &played.beliefs[step], outcome, &[(5, 1.0), (80, 2.0)]).expect("outcome");
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
