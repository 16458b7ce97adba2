//! TorchScript modules of one's own: they update the belief as the contract says, are named in what they made, and are
//! refused in one line where they answer something else. `tests/python/write_models.py` wrote the modules.

use nudge_core::belief::{Belief, BeliefUpdate, Classical};
use nudge_core::cnabu;
use nudge_core::episode::{Episode, EpisodeConfig};
use nudge_core::files::sha256_of_file;
use nudge_core::plan::{PlannerSettings, PolicyKind};
use nudge_core::scene::{CLASS_COUNT, Catalog, Scene};
use nudge_tests::{Folder, TIN, argument, nudge, nudge_fails, nudge_ok, root, small_scene, text, venv_tool};
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;

fn module(name: &str) -> PathBuf {
    root().join("tests/models").join(name).with_extension("pt")
}

fn named(name: &str) -> String {
    argument(&module(name))
}

/// The largest differences of probabilities, and of evidence relative to its size.
fn far(a: &Belief, b: &Belief) -> [f32; 2] {
    let voxels = (0..a.occupancy.len()).map(|at| (a.probability(at) - b.probability(at)).abs());
    let cells = (0..a.semantics.len()).flat_map(|cell| {
        let [p, q] = [a, b].map(|belief| belief.class_probabilities(cell));
        (0..CLASS_COUNT).map(move |class| (p[class] - q[class]).abs())
    });
    let evidence = |belief: &Belief| -> Vec<f32> {
        let both = belief.occupancy.as_flattened().iter().chain(belief.semantics.as_flattened());
        both.copied().collect()
    };
    let (a, b) = (evidence(a), evidence(b));
    let relative = a.iter().zip(&b).map(|(a, b)| (a - b).abs() / a.max(1.0));
    [voxels.chain(cells).fold(0.0, f32::max), relative.fold(0.0, f32::max)]
}

/// Both halves of the classical update as modules, beside the classical update, in one episode: the same actions, and after
/// each the differences of the beliefs.
fn beside_classical(sigma_o: PathBuf, sigma_m: PathBuf, scene: &str, budget: usize) -> (usize, [f32; 2]) {
    let catalog = Arc::new(Catalog::standard());
    let (scene, _) = Scene::load(&root().join(scene), &catalog).expect("a scene");
    let own = cnabu::load_own(Some(&sigma_o), Some(&sigma_m), Arc::new(Classical)).expect("modules");
    let config = |update: &Arc<dyn BeliefUpdate>| EpisodeConfig {
        policy: PolicyKind::RandomPush5,
        belief: update.name().to_owned(),
        seed: 3,
        budget,
        views: "standard300".to_owned(),
        planner: PlannerSettings::of_belief(update.name()),
        noise: None,
    };
    let begin = |update: Arc<dyn BeliefUpdate>| {
        Episode::new(scene.clone(), catalog.clone(), config(&update), update).expect("begins")
    };
    let (mut one, mut other) = (begin(Arc::new(Classical)), begin(own));
    let (mut pushes, mut farthest) = (0, [0.0_f32; 2]);
    while !one.is_finished() {
        let decision = one.decide();
        let outcome = one.act(decision.clone()).expect("done");
        pushes += usize::from(outcome.prediction.is_some());
        other.act(decision).expect("done");
        let far = far(one.belief(), other.belief());
        farthest = [0, 1].map(|which| farthest[which].max(far[which]));
    }
    (pushes, farthest)
}

#[test]
fn the_classical_update_as_modules_agrees_with_the_classical_belief() {
    let (pushes, [probability, evidence]) =
        beside_classical(module("classical_o"), module("classical_m"), "scenes/demo/first-look.toml", 13);
    println!("{pushes} pushes, probabilities {probability:.1e}, evidence {evidence:.1e}");
    assert!(pushes >= 2, "an episode without pushes shows nothing of sigma_m");
    assert!(probability < 1e-4 && evidence < 1e-4, "probabilities {probability}, evidence {evidence}");
}

/// What `nudge` says from the program that the script makes is what the tests have.
#[test]
fn the_script_writes_the_modules_where_torch_is() {
    let Some(python) = venv_tool("python") else { return };
    let has_torch = Command::new(&python).args(["-c", "import torch"]).output().expect("python starts");
    if !has_torch.status.success() {
        eprintln!("not checked: this Python has no torch, so scripts/export_model.py was not run");
        return;
    }
    let folder = Folder::new();
    let script = root().join("scripts/export_model.py");
    let made = Command::new(&python).arg(script).arg(folder.path("made")).output().expect("python starts");
    assert!(made.status.success(), "{}", text(&made.stderr));
    let (sigma_o, sigma_m) = (folder.path("made/classical_o.pt"), folder.path("made/classical_m.pt"));
    let (_, [probability, _]) = beside_classical(sigma_o, sigma_m, "scenes/demo/first-look.toml", 6);
    assert!(probability < 1e-4, "{probability}");
}

fn record(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn a_run_on_modules_makes_the_decisions_of_the_classical_one_and_names_them() {
    let folder = Folder::new();
    let run = |out: &str, more: &[&str]| {
        let out = folder.name(out);
        let words = ["run", "scenes/demo/first-look.toml", "--budget", "6", "--json", "--out", &out];
        record(&nudge_ok(&[&words[..], more].concat()))
    };
    let classical = run("classical", &["--belief", "classical"]);
    let (sigma_o, sigma_m) = (named("classical_o"), named("classical_m"));
    let own = run("own", &["--sigma-o", &sigma_o]);
    let both = run("both", &["--sigma-o", &sigma_o, "--sigma-m", &sigma_m]);
    assert_eq!((own["belief"].as_str(), both["belief"].as_str()), (Some("own+classical"), Some("own+own")));
    for record in [&own, &both] {
        let steps = record["steps"].as_array().expect("steps");
        for (step, like) in steps.iter().zip(classical["steps"].as_array().expect("steps")) {
            assert_eq!(step["action"], like["action"], "step {}", step["index"]);
            let score = |step: &Value| step["scores"]["occupancy_iou"].as_f64().expect("a score");
            assert!((score(step) - score(like)).abs() < 1e-4, "step {}", step["index"]);
        }
    }
    let hash = |name: &str| Value::from(sha256_of_file(&module(name)).expect("a module"));
    let made_by = &both["made_by"];
    assert_eq!(made_by["weights"]["sigma_o"], hash("classical_o"));
    assert_eq!(made_by["weights"]["sigma_m"], hash("classical_m"));
    assert_eq!(made_by["modules"]["sigma_o"], "classical_o.pt");
    assert_eq!(own["made_by"]["modules"].get("sigma_m"), None);
    assert!(classical["made_by"].get("modules").is_none() && classical["made_by"].get("weights").is_none());

    // Repeated with the module it is the same; without it, or with another, that is said.
    let out = folder.name("own");
    assert!(nudge_ok(&["replay", &out, "--sigma-o", &sigma_o]).contains("bit for bit"));
    assert!(nudge_ok(&["replay", &out, "--infer", "--sigma-o", &sigma_o]).contains("bit for bit"));
    let line = nudge_fails(2, &["replay", &out]);
    assert!(line.contains("own+classical is not there") && line.contains("--sigma-o"), "{line}");
    let other = text(&nudge(&["replay", &out, "--sigma-o", &named("late")]).stderr);
    assert!(other.contains("the weights sigma_o were"), "{other}");
}

#[test]
fn resuming_with_another_module_is_refused_and_with_the_same_under_another_name_it_goes_on() {
    let folder = Folder::new();
    let scene = folder.write("small.toml", small_scene(TIN));
    let out = folder.name("out");
    let run = ["run", &scene, "--policy", "random", "--budget", "4", "--out", &out];
    // It ends in the middle: where a voxel was seen twice, the module answers no numbers any more.
    let line = nudge_fails(2, &[&run[..], &["--sigma-o", &named("late")]].concat());
    assert!(line.contains("late.pt: its semantics holds NaN: evidence is at least 0.001 and finite"), "{line}");
    let done = |out: &str| {
        let document = std::fs::read_to_string(format!("{out}/episode.json")).expect("a document");
        record(&document)["steps"].as_array().expect("steps").len()
    };
    let kept = done(&out);
    assert!((1..4).contains(&kept), "what was done before is kept: {kept} steps");
    let resume = |module: &str| [&run[..], &["--resume", "--sigma-o", module]].concat().join("\n");
    let line = nudge_fails(2, &resume(&named("classical_o")).split('\n').collect::<Vec<_>>());
    assert!(line.contains("cannot be resumed: the weights sigma_o were"), "{line}");
    let renamed = folder.name("renamed.pt");
    std::fs::copy(module("late"), &renamed).expect("copied");
    let line = nudge_fails(2, &resume(&renamed).split('\n').collect::<Vec<_>>());
    assert!(line.contains("renamed.pt: its semantics holds NaN"), "the same numbers, the same end: {line}");
    let line = nudge_fails(2, &[&run[..], &["--resume", "--belief", "classical"]].concat());
    assert!(line.contains("was run with --belief own+classical, not classical"), "{line}");
    assert_eq!(done(&out), kept);
}

#[test]
fn modules_that_answer_something_else_are_refused_in_one_line_before_anything_is_written() {
    let folder = Folder::new();
    let scene = folder.write("small.toml", small_scene(TIN));
    let no_module = folder.write("text.pt", "years of work");
    let cut = std::fs::read(module("classical_o")).expect("a module");
    let cut = folder.write("cut.pt", &cut[..cut.len() / 2]);
    let out = folder.name("out");
    for (option, file, words) in [
        ("--sigma-o", named("shapes"), "its occupancy has shape [30, 20, 20, 1], and [30, 20, 20, 2] is wanted"),
        ("--sigma-o", named("nan"), "its semantics holds NaN: evidence is at least 0.001 and finite"),
        ("--sigma-o", named("one"), "answers 1 tensors, and 2 are wanted (occupancy, semantics)"),
        ("--sigma-o", named("inputs"), "fails on (occupancy, semantics, seen, labels): "),
        ("--sigma-o", named("fails"), "must match the size of tensor"),
        ("--sigma-o", named("classical_m"), "fails on (occupancy, semantics, seen, labels): "),
        ("--sigma-m", named("change"), "its change holds 2: probabilities are from 0 to 1"),
        ("--sigma-m", named("classical_o"), "fails on (occupancy, semantics, swept, flow, stroke): "),
        ("--sigma-o", named("weights"), "is no TorchScript module that can be read ("),
        ("--sigma-o", no_module, "is no TorchScript module that can be read ("),
        ("--sigma-o", cut, "is no TorchScript module that can be read ("),
        ("--sigma-m", folder.name("nowhere.pt"), "nowhere.pt: No such file or directory"),
    ] {
        let line = nudge_fails(2, &["run", &scene, "--budget", "2", "--out", &out, option, &file]);
        assert!(line.contains(&file) && line.contains(words), "{line}");
        assert!(!line.contains("Traceback") && line.len() < 700, "{line}");
        assert!(!folder.path("out").exists(), "half-written");
        let bench = ["bench", &scene, "--policies", "random", "--budget", "1", "--out", &out, option, &file];
        assert!(nudge_fails(2, &bench).contains(words));
    }
}

#[test]
fn bench_report_and_calibrate_name_the_modules() {
    let folder = Folder::new();
    let scene = folder.write("small.toml", small_scene(TIN));
    let (out, data) = (folder.name("bench"), folder.name("data"));
    let (sigma_o, hash) = (named("classical_o"), sha256_of_file(&module("classical_o")).expect("a module"));
    let bench = ["bench", &scene, "--policies", "random,random-push-5", "--seeds", "1", "--budget", "2", "--out", &out];
    nudge_ok(&[&bench[..], &["--sigma-o", &sigma_o]].concat());
    let document = record(&std::fs::read_to_string(folder.path("bench/bench.json")).expect("bench.json"));
    assert_eq!(document["made_by"]["modules"]["sigma_o"], "classical_o.pt");
    assert_eq!(document["made_by"]["weights"]["sigma_o"], hash.as_str());
    assert_eq!(document["policies"][1]["belief"], "own+classical");
    let line = nudge_fails(2, &[&bench[..], &["--sigma-o", &named("late")]].concat());
    assert!(line.contains("sigma_o"), "{line}");
    let page = nudge_ok(&["report", &out]);
    let page = std::fs::read_to_string(page.trim()).expect("a page");
    assert!(page.contains(&format!("{hash}, classical_o.pt")));

    nudge_ok(&["data", "maps", "--count", "50", "--seed", "9", "--out", &data]);
    let calibrate = ["calibrate", "--data", &data, "--scenes", "1", "--beliefs", "classical", "--json"];
    let found = record(&nudge_ok(&[&calibrate[..], &["--sigma-o", &sigma_o]].concat()));
    assert_eq!(found["networks"][0]["modules"]["sigma_o"], "classical_o.pt");
    assert_eq!(found["networks"][0]["weights"]["sigma_o"], hash.as_str());
    let (classical, own) = (&found["results"][0], &found["results"][1]);
    assert_eq!((classical["belief"].as_str(), own["belief"].as_str()), (Some("classical"), Some("own+classical")));
    let score = |result: &Value| result["scores"][3]["semantic_miou"].as_f64().expect("a score");
    assert!((score(classical) - score(own)).abs() < 1e-4);
}
