//! An episode from the command line: run, repeat, replay, resume, and what other tools make of its files.

use nudge_tests::{nudge, nudge_bin, nudge_fails, nudge_ok, root, text, venv_tool};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const SCENE: &str = "scenes/high/box-wall.toml";

/// What is typed to run the episode of these tests.
fn words<'a>(out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let out = out.to_str().expect("utf-8");
    let mut words =
        vec!["run", SCENE, "--policy", "mem", "--belief", "classical", "--seed", "1", "--out", out, "--json"];
    words.extend(more);
    words
}

fn run(out: &Path, more: &[&str]) -> Value {
    serde_json::from_str(&nudge_ok(&words(out, more))).expect("JSON on stdout")
}

/// The record without what the clock says, and without the number of threads.
fn timeless(mut record: Value) -> Value {
    assert!(record["made_by"]["threads"].as_u64().expect("threads") > 0);
    record["made_by"]["threads"] = Value::Null;
    for step in record["steps"].as_array_mut().expect("steps") {
        step["seconds"] = Value::Null;
    }
    record
}

#[test]
fn two_runs_agree_and_replay_verifies_them() {
    let dir = tempfile::tempdir().expect("tempdir");
    let (one, two) = (dir.path().join("e1"), dir.path().join("e2"));
    let first = run(&one, &["--budget", "6"]);
    let second = run(&two, &["--budget", "6"]);
    assert_eq!(timeless(first.clone()), timeless(second));
    for n in 0..=6 {
        let file = format!("beliefs/{n:03}.npz");
        assert_eq!(
            std::fs::read(one.join(&file)).expect(&file),
            std::fs::read(two.join(&file)).expect(&file),
            "{file}"
        );
    }

    let steps = first["steps"].as_array().expect("steps");
    assert_eq!(steps.len(), 6);
    assert_eq!((first["format"].as_u64(), first["policy"].as_str()), (Some(2), Some("mem")));
    for (at, step) in steps.iter().enumerate() {
        assert_eq!(step["index"].as_u64(), Some(at as u64 + 1));
        assert_eq!(step["decision"]["gains"].as_array().map(Vec::len), Some(300));
        assert!(step["scores"]["occupancy_iou"].as_f64().expect("score") > 0.0);
        // To weigh 300 views takes time on any machine, and no step of this scene takes a minute.
        let decided_s = step["seconds"]["decide"].as_f64().expect("seconds");
        assert!(decided_s > 1e-4 && decided_s < 60.0, "step {}: {decided_s} s", at + 1);
        assert_eq!(step["action"], step["decision"]["action"]);
        let kind = step["action"]["kind"].as_str().expect("kind");
        // Nothing is pushed in the first three steps and in the last, and one look at least follows a push.
        let may_push = at >= 3 && at + 1 < 6 && steps[at - 1]["action"]["kind"] == "look";
        assert!(kind == "look" || (kind == "push" && may_push), "step {}: {kind}", at + 1);
    }
    let made_by = &first["made_by"];
    let is_hash = |value: &Value, digits: usize| {
        value.as_str().is_some_and(|text| text.len() == digits && text.chars().all(|c| c.is_ascii_hexdigit()))
    };
    assert_eq!(made_by["version"], first["version"]);
    assert!(is_hash(&made_by["method"], 64), "{made_by}");
    assert_eq!(is_hash(&made_by["commit"], 40), made_by["dirty"].is_boolean(), "{made_by}");
    assert!(is_hash(&made_by["commit"], 40) || made_by["commit"] == "unknown", "{made_by}");
    assert_eq!(made_by["planner"], first["planner"]);
    assert!(made_by.get("weights").is_none() && made_by.get("libtorch").is_none(), "the classical belief has none");

    let entropy = |at: usize| steps[at]["scores"]["entropy_nats"].as_f64().expect("entropy");
    assert!(entropy(2) < first["prior"]["entropy_nats"].as_f64().expect("prior"));

    let said = nudge_ok(&["replay", one.to_str().expect("utf-8")]);
    assert!(said.contains("bit for bit"), "{said}");
    let file = one.join("beliefs/004.npz");
    std::fs::copy(one.join("beliefs/003.npz"), &file).expect("tamper");
    let line = nudge_fails(1, &["replay", one.to_str().expect("utf-8")]);
    assert!(line.contains("step 4"), "{line}");
}

#[test]
fn frames_are_filed_and_every_belief_is_inferred_from_them_to_the_bit() {
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("e");
    let typed = |out: &Path, more: &[&str]| {
        let out = out.to_str().expect("utf-8");
        let words = ["run", "scenes/demo/behind-the-boxes.toml", "--belief", "classical", "--policy", "random-push-5"];
        nudge_ok(&[&words[..], &["--budget", "6", "--out", out], more].concat())
    };
    typed(&out, &["--noise", "l515", "--frames"]);
    let (mut frames, mut pushes) = (0, 0);
    for entry in std::fs::read_dir(out.join("frames")).expect("frames") {
        let path = entry.expect("entry").path();
        if path.extension().is_some_and(|extension| extension == "push") {
            pushes += 1;
            continue;
        }
        frames += 1;
        let bytes = std::fs::metadata(&path).expect("a file").len();
        assert!(bytes <= 150_000, "{}: {bytes} bytes", path.display());
    }
    assert_eq!((frames, pushes), (5, 1));
    assert!(!out.join("checkpoints").exists(), "a finished run needs none");
    let said = nudge_ok(&["replay", out.to_str().expect("utf-8"), "--infer"]);
    assert!(said.contains("6 of 6 steps inferred again, the same bit for bit"), "{said}");
    std::fs::copy(out.join("frames/001.frame"), out.join("frames/003.frame")).expect("tamper");
    let line = nudge_fails(1, &["replay", out.to_str().expect("utf-8"), "--infer"]);
    assert!(line.contains("the replay differs: step 3: beliefs/003.npz"), "{line}");
    let bytes = std::fs::read(out.join("frames/002.frame")).expect("read");
    std::fs::write(out.join("frames/002.frame"), &bytes[..bytes.len() / 2]).expect("cut");
    let line = nudge_fails(2, &["replay", out.to_str().expect("utf-8"), "--infer"]);
    assert!(line.contains("frames/002.frame: is cut short"), "{line}");

    let bare = dir.path().join("bare");
    typed(&bare, &["--no-frames"]);
    assert!(!bare.join("frames").exists());
    let line = nudge_fails(2, &["replay", bare.to_str().expect("utf-8"), "--infer"]);
    assert!(line.contains("holds no frames to infer from"), "{line}");
    let refused = nudge(&["run", SCENE, "--verify"]);
    let said = text(&refused.stderr);
    assert!(refused.status.code() == Some(2) && said.contains("--resume"), "{said}");
}

#[test]
fn a_killed_run_opens_and_resumes_to_the_same_end() {
    let dir = tempfile::tempdir().expect("tempdir");
    let (whole, cut) = (dir.path().join("whole"), dir.path().join("cut"));
    let expected = run(&whole, &["--budget", "5"]);

    let mut child = Command::new(nudge_bin())
        .current_dir(root())
        .args(["run", SCENE, "--policy", "mem", "--belief", "classical", "--seed", "1", "--budget", "5", "--out"])
        .arg(&cut)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("nudge starts");
    let started = Instant::now();
    while !cut.join("beliefs/002.npz").exists() {
        assert!(started.elapsed() < Duration::from_secs(300), "the run never wrote its second belief");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("SIGKILL");
    child.wait().expect("gone");

    let record: Value = serde_json::from_str(&std::fs::read_to_string(cut.join("episode.json")).expect("episode.json"))
        .expect("a killed run leaves whole JSON");
    assert!(record["steps"].as_array().expect("steps").len() < 5);
    let again = nudge_fails(2, &["run", SCENE, "--belief", "classical", "--out", cut.to_str().expect("utf-8")]);
    assert!(again.contains("--resume") && again.contains("--force"), "{again}");

    let resumed = run(&cut, &["--budget", "5", "--resume"]);
    assert_eq!(timeless(resumed), timeless(expected));
    for n in 0..=5 {
        let file = format!("beliefs/{n:03}.npz");
        assert_eq!(
            std::fs::read(whole.join(&file)).expect(&file),
            std::fs::read(cut.join(&file)).expect(&file),
            "{file}"
        );
    }
}

#[test]
fn an_episode_that_cannot_be_resumed_stays_as_it_is() {
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("e");
    run(&out, &["--budget", "3"]);
    let document = out.join("episode.json");
    let mut record: Value = serde_json::from_slice(&std::fs::read(&document).expect("read")).expect("JSON");
    record["steps"][1]["displacement_m"] = 0.5.into();
    std::fs::write(&document, record.to_string()).expect("as if another version had written it");
    let files = || -> Vec<(std::path::PathBuf, Vec<u8>)> {
        let mut paths: Vec<_> =
            std::fs::read_dir(&out).expect("listed").map(|entry| entry.expect("entry").path()).collect();
        paths.sort();
        paths
            .into_iter()
            .filter(|path| path.is_file())
            .map(|path| (path.clone(), std::fs::read(path).expect("read")))
            .collect()
    };
    let before = files();
    let line = nudge_fails(1, &words(&out, &["--budget", "3", "--resume"]));
    assert!(line.contains("cannot be resumed: step 2: displacement_m: 0.5 in the log, 0.0 now"), "{line}");
    assert!(files() == before, "recording, figure and log are those of before, and nothing is left over");
}

/// An episode with one step left, whose record is changed.
fn with_a_step_left(out: &Path, change: impl FnOnce(&mut Value)) {
    run(out, &["--budget", "3"]);
    let document = out.join("episode.json");
    let mut record: Value = serde_json::from_slice(&std::fs::read(&document).expect("read")).expect("JSON");
    record["steps"].as_array_mut().expect("steps").pop();
    change(&mut record);
    std::fs::write(&document, record.to_string()).expect("written");
}

#[test]
fn an_episode_of_other_weights_or_settings_is_not_resumed_and_says_which() {
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("e");
    with_a_step_left(&out, |record| record["made_by"]["weights"] = serde_json::json!({ "sigma_o": "0".repeat(64) }));
    let before = std::fs::read(out.join("episode.json")).expect("read");
    let line = nudge_fails(2, &words(&out, &["--budget", "3", "--resume"]));
    assert!(line.contains("cannot be resumed: the weights sigma_o were 000000000000, now they are absent"), "{line}");
    let line = nudge_fails(2, &words(&out, &["--budget", "3", "--resume", "--patience", "3"]));
    assert!(line.contains("--patience 1, not 3"), "{line}");
    assert!(std::fs::read(out.join("episode.json")).expect("read") == before);
    // A replay says so first, and then what came of it: here nothing, since the classical belief has no weights.
    let said = nudge_tests::nudge(&["replay", out.to_str().expect("utf-8")]);
    let warning = text(&said.stderr);
    assert!(said.status.success() && warning.contains("warning: ") && warning.contains("sigma_o"), "{warning}");
}

#[test]
fn steps_of_another_program_say_so() {
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("e");
    let other = "0".repeat(40);
    with_a_step_left(&out, |record| record["made_by"]["commit"] = other.clone().into());
    let resumed = run(&out, &["--budget", "3", "--resume"]);
    assert_eq!(resumed["made_by"]["commit"], other);
    let later = resumed["also_made_by"].as_array().expect("another program");
    assert_eq!((later.len(), later[0]["from_step"].as_u64()), (1, Some(3)));
    assert_ne!(later[0]["made_by"]["commit"], other);
    // Episodes of programs that did not tell go on all the same.
    let old = dir.path().join("old");
    with_a_step_left(&old, |record| drop(record.as_object_mut().expect("an object").remove("made_by")));
    let resumed = run(&old, &["--budget", "3", "--resume"]);
    assert!(resumed.get("made_by").is_none() && resumed["steps"].as_array().map(Vec::len) == Some(3));
    assert_eq!(resumed["also_made_by"][0]["from_step"], 3);
    assert!(nudge_ok(&["replay", old.to_str().expect("utf-8")]).contains("bit for bit"));
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let dir = tempfile::tempdir().expect("tempdir");
    let of = |threads: &str| {
        let out = dir.path().join(threads);
        let output = Command::new(nudge_bin())
            .current_dir(root())
            .env("RAYON_NUM_THREADS", threads)
            .args(["run", SCENE, "--belief", "classical", "--seed", "7", "--budget", "5", "--json", "--out"])
            .arg(out)
            .output()
            .expect("nudge starts");
        assert!(output.status.success(), "{}", text(&output.stderr));
        timeless(serde_json::from_slice(&output.stdout).expect("JSON"))
    };
    assert_eq!(of("1"), of("3"));
}

#[test]
fn the_stock_tools_read_the_files() {
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("e");
    run(&out, &["--budget", "2"]);
    assert!(out.join("summary.png").metadata().expect("summary.png").len() > 20_000);

    if let Some(rerun) = venv_tool("rerun") {
        let verify = Command::new(rerun).args(["rrd", "verify"]).arg(out.join("episode.rrd")).output().expect("rerun");
        assert!(verify.status.success(), "{}{}", text(&verify.stdout), text(&verify.stderr));
    }
    if let Some(python) = venv_tool("python") {
        let script = "\
import sys, numpy as np
b = np.load(sys.argv[1] + '/beliefs/002.npz'); t = np.load(sys.argv[1] + '/truth/000.npz')
assert b['occupancy'].shape == (160, 80, 80, 2) and b['occupancy'].dtype == np.float16
assert b['semantics'].shape == (160, 80, 15)
assert t['occupancy'].shape == (160, 80, 80) and t['labels'].shape == (160, 80) and t['labels'].dtype == np.uint8
a = b['occupancy'].astype(np.float32); p = a[..., 0] / a.sum(-1)
assert 0 < p.min() < 0.3 and 0.7 < p.max() < 1, (p.min(), p.max())
seen = p > 0.6; assert t['occupancy'][seen].mean() > 0.6, t['occupancy'][seen].mean()
";
        let check = Command::new(python).args(["-c", script]).arg(&out).output().expect("python");
        assert!(check.status.success(), "{}", text(&check.stderr));
    }
}
