//! Worlds of other programs: an episode in one, and what becomes of it when the program misbehaves.

use super::written::{FRAMES, Written, beliefs};
use nudge_core::belief::Belief;
use nudge_core::episode::EpisodeDir;
use nudge_core::plan::Action;
use nudge_tests::{nudge_fails, nudge_ok, root, venv_tool};
use std::path::Path;

fn same(a: &[Belief], b: &[Belief]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.occupancy == b.occupancy && a.semantics == b.semantics)
}

/// The command of a world that serves the recording `npy`, and misbehaves in one way.
fn world(written: &Written, kind: &str) -> String {
    let python = venv_tool("python").expect("a recording was written with it");
    let (replay, bad) = (root().join("examples/worlds/replay.py"), root().join("tests/python/bad_world.py"));
    let recording = written.folder.name("npy");
    if kind.is_empty() {
        return format!("{} {} {recording}", python.display(), replay.display());
    }
    format!("{} {} {} {recording} {kind}", python.display(), bad.display(), replay.display())
}

fn run<'a>(scene: &'a str, world: &'a str, out: &'a str) -> Vec<&'a str> {
    let settings = ["--policy", "mem-no-push", "--belief", "classical", "--budget", "5", "--world-timeout", "20"];
    [&["run", scene, "--world", world, "--out", out][..], &settings].concat()
}

#[test]
fn an_episode_in_a_world_that_serves_a_recording_is_the_recording_mapped() {
    let Some(written) = Written::new() else { return };
    written.map("npy", &["--policy", "mem-no-push"]);
    let (scene, out) = (written.folder.name("small.toml"), written.folder.name("there"));
    let said = nudge_ok(&run(&scene, &world(&written, ""), &out));
    assert!(said.contains("no ground truth"), "{said}");
    assert!(same(&beliefs(Path::new(&out)), &written.mapped("npy")), "the beliefs differ");
    let record = EpisodeDir::open(&out).expect("opens").record().expect("a record");
    let mapped = EpisodeDir::open(written.folder.path("npy-map")).expect("opens").record().expect("a record");
    let looks =
        |steps: &[nudge_core::episode::StepRecord]| steps.iter().map(|step| step.action).collect::<Vec<Action>>();
    assert_eq!(looks(&record.steps), looks(&mapped.steps));
    assert!(record.scene.objects.is_empty() && record.recorded_views == mapped.recorded_views);
    assert!(nudge_ok(&["replay", "--infer", &out]).contains("bit for bit"));
}

#[test]
fn a_world_that_misbehaves_ends_the_run_in_one_line_and_nothing_is_lost() {
    let Some(written) = Written::new() else { return };
    let scene = written.folder.name("small.toml");
    let whole = written.folder.name("whole");
    nudge_ok(&run(&scene, &world(&written, ""), &whole));
    let whole = beliefs(Path::new(&whole));
    let cases = [
        ("late", "the world did not answer within 5 s (looking from view"),
        ("twice", "the world spoke without being asked, or answered twice: {\"id\": 3"),
        ("crash", "the world ended (looking from view"),
        ("nonsense", "the world answered what is no answer (expected value"),
        ("other-id", "the world answered request 77 where 3 was asked"),
        ("other-answer", "the world answered `moved` where `frame` was due"),
        ("outside", "the world names the file `../secret.npy`, which is not in the shared folder"),
        ("huge", "huge.npy: has 2147483648 bytes; an image has at most"),
        ("error", "the world reports an error (looking from view"),
        ("long", "bytes in a line"),
    ];
    for (kind, said) in cases {
        let out = written.folder.name(kind);
        let bad = world(&written, kind);
        let folder = written.folder.name("images");
        let mut command = run(&scene, &bad, &out);
        if kind == "late" {
            *command.last_mut().expect("a timeout") = "5";
        }
        command.extend(["--world-folder", &folder]);
        let line = nudge_fails(2, &command);
        assert!(line.contains(said), "{kind}: {line}");
        let steps = EpisodeDir::open(&out).expect("opens").record().expect("a record").steps.len();
        // An answer that comes twice is good the first time.
        assert_eq!(steps, if kind == "twice" { 3 } else { 2 }, "{kind}");
        // The program is back, and the episode goes on as if nothing had been.
        let good = world(&written, "");
        nudge_ok(&[&run(&scene, &good, &out)[..], &["--resume"]].concat());
        assert!(same(&beliefs(Path::new(&out)), &whole), "{kind}: the beliefs differ");
        assert_eq!(EpisodeDir::open(&out).expect("opens").record().expect("a record").steps.len(), FRAMES);
    }
}

#[test]
fn a_world_that_does_not_begin_writes_nothing() {
    let Some(written) = Written::new() else { return };
    let (scene, out) = (written.folder.name("small.toml"), written.folder.name("nothing"));
    let cases = [
        ("exit 3", "the world ended (beginning): exit status: 3"),
        ("echo hello", "the world answered what is no answer"),
        ("echo '{\"id\": 0, \"ready\": {\"protocol\": 7}}'", "the world speaks protocol 7, this version speaks 1"),
    ];
    for (command, said) in cases {
        let line = nudge_fails(2, &run(&scene, command, &out).to_vec());
        let line = line.trim();
        assert!(line.contains(said), "{command}: {line}");
        assert!(!Path::new(&out).exists(), "half-written");
    }
    let line = nudge_fails(2, &[&run(&scene, "true", &out)[..], &["--resume"]].concat());
    assert!(line.contains("the world ended (beginning)") || line.contains("the world closed"), "{line}");
}
