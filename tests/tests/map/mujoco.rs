//! The shelf in MuJoCo: episodes in physics and images that share no code with the built-in simulator.

use super::written::{SCENE, beliefs};
use nudge_core::scene::{Catalog, Scene};
use nudge_tests::{Folder, argument, nudge_fails, nudge_ok, root, text, venv_tool};
use serde_json::{Value, json};
use std::f32::consts::FRAC_1_SQRT_2;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A Python with MuJoCo, and the world's script; `None` where there shall be no Python.
struct World {
    python: PathBuf,
    script: String,
}

impl World {
    fn new() -> Option<Self> {
        let python = venv_tool("python")?;
        Some(Self { python, script: argument(&root().join("examples/worlds/mujoco_shelf.py")) })
    }

    /// The command that starts it.
    fn command(&self) -> String {
        format!("{} {}", self.python.display(), self.script)
    }

    /// The command that starts one that crashes at a look.
    fn crashing_at(&self, look: usize) -> String {
        let bad = root().join("tests/python/bad_world.py");
        format!("{} {} {} --renderer=rays crash {look}", self.python.display(), bad.display(), self.script)
    }

    /// What it answers to requests, with its exit code.
    fn answers(&self, python_options: &[&str], requests: &[Value]) -> (Vec<Value>, Option<i32>) {
        let mut child = Command::new(&self.python)
            .args(python_options)
            .arg(&self.script)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("python starts");
        let lines = requests.iter().map(|request| format!("{request}\n")).collect::<Vec<_>>().concat();
        child.stdin.take().expect("an input").write_all(lines.as_bytes()).expect("written");
        let output = child.wait_with_output().expect("ends");
        assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
        let answers = text(&output.stdout).lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
        (answers, output.status.code())
    }
}

fn run<'a>(scene: &'a str, world: &'a str, out: &'a str) -> Vec<&'a str> {
    let settings = ["--policy", "random-push-5", "--belief", "classical", "--budget", "7", "--world-timeout", "120"];
    [&["run", scene, "--world", world, "--out", out][..], &settings].concat()
}

/// The motion of a step of `episode.json` in the protocol's words.
fn motion(step: &Value) -> Value {
    let phase = |kind: &Value, filed: &Value| {
        let stops = filed["stops"].as_array().expect("stops");
        let column = |name: &str| stops.iter().map(|stop| stop[name].clone()).collect::<Vec<Value>>();
        json!({ "kind": kind, "opening_m": 0.0, "at_s": column("at_s"), "joints": column("joints") })
    };
    let filed = &step["decision"]["motion"];
    let phases: Vec<Value> = match filed["phases"].as_array() {
        Some(phases) => phases.iter().map(|filed| phase(&filed["kind"], &filed["motion"])).collect(),
        None => vec![phase(&json!("approach"), &filed["way_in"]), phase(&json!("contact"), &filed["push"])],
    };
    json!({ "phases": phases })
}

fn begin(scene: &str, folder: &Path, done: &[Value]) -> Value {
    let (scene, _) = Scene::load(Path::new(scene), &Catalog::standard()).expect("a scene");
    let scene = serde_json::to_value(&scene).expect("JSON");
    json!({ "protocol": 1, "folder": argument(folder), "seed": 0, "scene": scene, "done": done })
}

#[test]
fn an_episode_in_mujoco_has_no_truth_pushes_something_and_goes_on_after_a_crash() {
    let Some(world) = World::new() else { return };
    let folder = Folder::new();
    let (scene, whole, broken) = (folder.write("small.toml", SCENE), folder.name("whole"), folder.name("broken"));
    let said = nudge_ok(&run(&scene, &world.command(), &whole));
    assert!(said.contains("no ground truth"), "{said}");
    let document = std::fs::read(Path::new(&whole).join("episode.json")).expect("a document");
    let record: Value = serde_json::from_slice(&document).expect("JSON");
    assert_eq!(record["scene"]["objects"], json!([]), "what stands in the shelf is not known");
    assert!(record["steps"].as_array().expect("steps").iter().all(|step| step["scores"].is_null()));
    let push = &record["steps"][4];
    assert_eq!((&push["action"]["kind"], &push["push"]["stalled"]), (&json!("push"), &json!(false)), "{push}");

    // The same view in a world where nothing was done and in one where that push was.
    let camera = json!({ "width": 160, "height": 120, "fx": 108.0, "fy": 108.0, "cx": 79.5, "cy": 59.5 });
    let quaternion = json!([-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2]);
    let look = json!({ "view": 0, "position": [0.0, -0.25, 0.15], "quaternion": quaternion, "camera": camera });
    let seen = |done: &[Value]| -> [Vec<u8>; 2] {
        let images = Folder::new();
        let requests =
            [json!({ "id": 0, "begin": begin(&scene, &images.path(""), done) }), json!({ "id": 1, "look": look })];
        let (answers, code) = world.answers(&[], &requests);
        assert_eq!(answers[0], json!({ "id": 0, "ready": { "protocol": 1 } }));
        assert_eq!(answers[1], json!({ "id": 1, "frame": { "depth": "depth.npy", "labels": "labels.npy" } }));
        assert_eq!((answers.len(), code), (2, Some(0)));
        ["depth.npy", "labels.npy"].map(|name| std::fs::read(images.path(name)).expect("an image"))
    };
    let (before, again, after) = (seen(&[]), seen(&[]), seen(&[motion(push)]));
    assert!(before == again, "the same world looks the same");
    let changed = before[1].iter().zip(&after[1]).filter(|(a, b)| a != b).count();
    assert!(changed > 50 && before[0] != after[0], "{changed} pixels show another class after the push");

    // A world that crashes after the push, and comes back.
    let line = nudge_fails(2, &run(&scene, &world.crashing_at(5), &broken));
    assert!(line.contains("the world ended (looking from view"), "{line}");
    assert_eq!(beliefs(Path::new(&broken)).len(), 6, "five actions before the crash");
    nudge_ok(&[&run(&scene, &world.command(), &broken)[..], &["--resume"]].concat());
    let (whole, broken) = (beliefs(Path::new(&whole)), beliefs(Path::new(&broken)));
    let same = whole.iter().zip(&broken).all(|(a, b)| a.occupancy == b.occupancy && a.semantics == b.semantics);
    assert!(whole.len() == broken.len() && same, "the beliefs differ");
}

#[test]
fn a_pick_in_mujoco_takes_the_object_out_of_the_shelf_and_finds_no_seal_where_it_is_not() {
    let Some(world) = World::new() else { return };
    let folder = Folder::new();
    let (scene, out, truth) = (folder.write("small.toml", SCENE), folder.name("out"), folder.name("truth.jsonl"));
    let command = format!("{} --truth {truth}", world.command());
    let settings = ["--policy", "random-pick-5", "--place", "tray", "--belief", "classical", "--budget", "6"];
    let run = ["run", &scene, "--world", &command, "--out", &out, "--world-timeout", "120"];
    nudge_ok(&[&run[..], &settings].concat());
    let read = |path: PathBuf| text(&std::fs::read(path).expect("a file"));
    let record: Value = serde_json::from_str(&read(Path::new(&out).join("episode.json"))).expect("JSON");
    let pick = &record["steps"][4];
    assert_eq!((&pick["action"]["kind"], &pick["push"]["grip"]["end"]), (&json!("pick"), &json!("stowed")), "{pick}");

    // What the world says of where the objects are: one is beside the robot, no other has moved.
    let standing: Vec<Value> =
        read(truth.into()).lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let [before, after] = [0, 1].map(|line: usize| standing[line].as_array().expect("objects"));
    let place = |object: &Value| [0, 1, 2].map(|axis: usize| object["position"][axis].as_f64().expect("a number"));
    let mut taken = Vec::new();
    for (at, (before, after)) in before.iter().zip(after).enumerate() {
        if after["stowed"] == json!(true) {
            taken.push(at);
        } else {
            let ways = place(before).into_iter().zip(place(after)).map(|(a, b)| (a - b).abs());
            assert!(ways.fold(0.0, f64::max) < 0.001, "{before} moved to {after}");
        }
    }
    let [taken] = taken[..] else { panic!("objects {taken:?} were taken") };

    // The same motion where that object stands 40 mm aside.
    let good = begin(&scene, &folder.path(""), &[]);
    let mut aside = good.clone();
    let x = aside["scene"]["objects"][taken]["position"][0].as_f64().expect("a number");
    aside["scene"]["objects"][taken]["position"][0] = json!(x + 0.04);
    let ends = [good, aside].map(|begin| {
        let requests =
            [json!({ "id": 0, "begin": with_robot(begin, &record) }), json!({ "id": 1, "move": motion(pick) })];
        let (answers, _) = world.answers(&[], &requests);
        answers[1]["moved"]["grip"].clone()
    });
    assert_eq!(ends, [json!("stowed"), json!("no_seal")]);
}

/// A beginning with the arm of an episode.
fn with_robot(mut begin: Value, record: &Value) -> Value {
    begin["scene"]["robot"] = record["scene"]["robot"].clone();
    begin
}

#[test]
fn what_mujoco_cannot_do_is_told_in_one_line() {
    let Some(world) = World::new() else { return };
    let folder = Folder::new();
    let scene = folder.write("small.toml", SCENE);
    let good = begin(&scene, &folder.path(""), &[]);
    let with = |name: &str, value: Value| {
        let mut begin = good.clone();
        begin[name] = value;
        json!({ "id": 0, "begin": begin })
    };
    let mut unknown = good["scene"].clone();
    unknown["objects"][1]["class"] = json!("teapot");
    let held = json!({ "kind": "carry", "opening_m": 0.0, "at_s": [0.0], "joints": [[0, 0, 0, 0, 0, 0]] });
    let carry = json!({ "phases": [held] });
    let cases = [
        (with("protocol", json!(7)), "this world speaks protocol 1, asked was 7"),
        (with("scene", unknown), "object 1 is of the unknown class `teapot`"),
        (with("done", json!([carry])), "a phase `carry`: nothing can be held in this world"),
        (json!({ "id": 0, "look": {} }), "a request without 'begin'"),
    ];
    for (request, said) in cases {
        let (answers, _) = world.answers(&[], &[request]);
        assert_eq!((answers.len(), &answers[0]["id"]), (1, &json!(0)));
        assert!(answers[0]["error"].as_str().is_some_and(|error| error.starts_with(said)), "{answers:?}");
    }
    // Without the packages of the environment.
    let (answers, code) = world.answers(&["-S"], &[json!({ "id": 0, "begin": good })]);
    assert_eq!((answers.len(), code), (1, Some(2)));
    assert!(answers[0]["error"].as_str().is_some_and(|error| error.contains("pip install mujoco")), "{answers:?}");
}
