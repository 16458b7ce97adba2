//! The networks from the command line: training, resuming, weights, and what is refused. Needs a binary built with the
//! feature `cnabu`, as every build has unless told.

use nudge_tests::{nudge_bin, nudge_fails, nudge_ok, root, text};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn utf8(path: &Path) -> &str {
    path.to_str().expect("utf-8")
}

/// A folder with 50 map samples in `d`.
fn with_data() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().expect("tempdir");
    let data = dir.path().join("d");
    nudge_ok(&["data", "maps", "--count", "50", "--seed", "9", "--out", utf8(&data)]);
    (dir, data)
}

/// Runs `nudge` with weights from `models`.
fn nudge_with(models: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(nudge_bin());
    command.args(args).current_dir(root()).env("NUDGE_MODELS", models).env_remove("LD_LIBRARY_PATH");
    command.output().expect("nudge starts")
}

fn losses(curve: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(curve).expect("a curve");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("a JSON line"))
        .filter(|l: &Value| l["kind"] == "loss")
        .collect()
}

#[test]
fn training_runs_and_the_loss_falls_and_resuming_goes_on() {
    let (dir, data) = with_data();
    let (one, two) = (dir.path().join("one"), dir.path().join("two"));
    let train = |out: &Path, updates: &str, more: &[&str]| {
        let mut args = vec!["train", "observe", "--data", utf8(&data), "--out", utf8(out), "--updates", updates];
        args.extend(["--width", "16", "--batch", "2", "--threads", "1", "--max-views", "1"]);
        args.extend(more);
        nudge_ok(&args)
    };
    train(&one, "40", &[]);
    train(&one, "160", &["--resume"]);
    train(&two, "160", &[]);
    let bytes = |run: &Path| std::fs::read(run.with_extension("safetensors")).expect("a checkpoint");
    assert!(bytes(&one) == bytes(&two), "a resumed run is the run that was not stopped");
    let curve = losses(&one.with_extension("jsonl"));
    let total = |line: &Value| line["occupancy"].as_f64().expect("loss") + line["semantics"].as_f64().expect("loss");
    let (first, last) = (total(&curve[0]), total(&curve[curve.len() - 1]));
    assert!(last < 0.9 * first, "{first} to {last}");

    let line = nudge_fails(2, &["train", "observe", "--data", utf8(&data), "--out", utf8(&one)]);
    assert!(line.contains("is there already"), "{line}");
    let other = ["train", "observe", "--data", utf8(&data), "--out", utf8(&one), "--resume", "--batch", "3"];
    let line = nudge_fails(2, &other);
    assert!(line.contains("one.toml") && line.contains("batch") || line.contains("width"), "{line}");
    let nowhere = dir.path().join("nowhere");
    let line = nudge_fails(2, &["train", "observe", "--data", utf8(&nowhere), "--out", utf8(&two)]);
    assert!(line.contains("nowhere"), "{line}");

    // The checkpoint becomes weights, and an episode runs on them; damaged weights are told.
    let models = dir.path().join("models");
    let weights = models.join("sigma_o.safetensors");
    nudge_ok(&[
        "train",
        "export",
        "observe",
        utf8(&one),
        "--test",
        utf8(&data),
        "--scenes",
        "1",
        "--out",
        utf8(&models),
        "--half",
    ]);
    // Weights of one network alone are not enough to run on: no other prediction stands in for the missing one.
    let alone = nudge_with(&models, &["run", "scenes/demo/first-look.toml", "--out", utf8(&dir.path().join("alone"))]);
    let said = text(&alone.stderr);
    assert!(
        alone.status.code() == Some(2) && said.contains("sigma_m.safetensors") && said.contains("nudge train push"),
        "{said}"
    );
    for file in ["sigma_m.safetensors", "sigma_m.toml"] {
        std::fs::copy(root().join("models").join(file), models.join(file)).expect("copied");
    }
    let out = dir.path().join("episode");
    let scene = "scenes/demo/first-look.toml";
    let run = |more: &[&str]| {
        let mut args =
            vec!["run", scene, "--policy", "random-cnabu", "--budget", "2", "--force", "--json", "--out", utf8(&out)];
        args.extend(more);
        nudge_with(&models, &args)
    };
    let said = run(&[]);
    assert!(said.status.success() && said.stderr.is_empty(), "{}", text(&said.stderr));
    let record: Value = serde_json::from_str(&text(&said.stdout)).expect("JSON");
    assert_eq!(record["belief"], "cnabu");
    let said = nudge_with(&models, &["replay", utf8(&out)]);
    assert!(text(&said.stdout).contains("bit for bit"), "{} {}", text(&said.stdout), text(&said.stderr));
    let whole = std::fs::read(&weights).expect("read");
    std::fs::write(&weights, &whole[..whole.len() / 3]).expect("written");
    let said = run(&[]);
    let error = text(&said.stderr);
    assert!(
        said.status.code() == Some(2) && error.contains("sigma_o.safetensors") && error.lines().count() == 1,
        "{error}"
    );
}

/// Runs `nudge` in `folder`, where the folder of weights that it is told of does not exist.
fn far_from_weights(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(nudge_bin());
    command.args(args).current_dir(folder).env("NUDGE_MODELS", folder.join("no-models")).output().expect("nudge starts")
}

#[test]
fn without_weights_the_program_stops_and_says_how_to_get_them() {
    let dir = tempfile::tempdir().expect("tempdir");
    let scene = root().join("scenes/demo/first-look.toml");
    let out = dir.path().join("episode");
    let runs: [&[&str]; 3] = [
        &["run", utf8(&scene), "--budget", "1", "--out", utf8(&out)],
        &["run", utf8(&scene), "--budget", "1", "--belief", "cnabu", "--out", utf8(&out)],
        &["bench", utf8(&scene), "--policies", "mem,random-cnabu", "--budget", "1", "--out", utf8(&out)],
    ];
    for args in runs {
        let said = far_from_weights(dir.path(), args);
        let error = text(&said.stderr);
        assert_eq!(said.status.code(), Some(2), "{args:?}: {error}");
        assert!(error.contains("no-models") && error.contains("sigma_o.safetensors"), "{args:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{args:?}: {error}");
        assert!(!out.exists(), "{args:?} leaves nothing half-written");
    }
    // The classical belief is asked for by name, and needs no weights.
    let classical = ["run", utf8(&scene), "--budget", "1", "--belief", "classical", "--json", "--out", utf8(&out)];
    let said = far_from_weights(dir.path(), &classical);
    assert!(said.status.success(), "{}", text(&said.stderr));
    let record: Value = serde_json::from_str(&text(&said.stdout)).expect("JSON");
    assert_eq!(record["belief"], "classical");

    let nothing = dir.path().join("no-models");
    let line = nudge_fails(2, &["calibrate", "--data", utf8(&nothing), "--models", utf8(&nothing)]);
    assert!(line.contains("no-models"), "{line}");
}

#[test]
fn what_is_run_without_a_word_runs_on_the_networks() {
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("episode");
    let said = nudge_ok(&["run", "scenes/demo/first-look.toml", "--budget", "1", "--json", "--out", utf8(&out)]);
    let record: Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!((&record["belief"], &record["policy"]), (&Value::from("cnabu"), &Value::from("mem")));
    let made_by = &record["made_by"];
    for network in ["sigma_o", "sigma_m"] {
        let file = root().join("models").join(network).with_extension("safetensors");
        assert_eq!(made_by["weights"][network], nudge_core::files::sha256_of_file(&file).expect("read"), "{made_by}");
    }
    assert!(made_by["libtorch"].is_string() && made_by["device"].is_string(), "{made_by}");
    let said = nudge_ok(&[
        "run",
        "scenes/demo/first-look.toml",
        "--budget",
        "1",
        "--policy",
        "random",
        "--json",
        "--force",
        "--out",
        utf8(&out),
    ]);
    let record: Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!(record["belief"], "classical", "the policy random is defined on the classical belief");
}

#[test]
fn an_episode_of_other_weights_is_not_resumed_and_a_replay_says_which() {
    let dir = tempfile::tempdir().expect("tempdir");
    let (out, models) = (dir.path().join("episode"), dir.path().join("models"));
    let words = ["run", "scenes/demo/first-look.toml", "--policy", "random-cnabu", "--budget", "2", "--json", "--out"];
    let run = |models: &Path, more: &[&str]| nudge_with(models, &[&words[..], &[utf8(&out)], more].concat());
    assert!(run(&root().join("models"), &[]).status.success());
    let document = out.join("episode.json");
    let mut record: Value = serde_json::from_slice(&std::fs::read(&document).expect("read")).expect("JSON");
    record["steps"].as_array_mut().expect("steps").pop();
    std::fs::write(&document, record.to_string()).expect("written");
    // The last bit of one weight.
    std::fs::create_dir(&models).expect("folder");
    for file in ["sigma_o.safetensors", "sigma_o.toml", "sigma_m.safetensors", "sigma_m.toml"] {
        let mut bytes = std::fs::read(root().join("models").join(file)).expect("read");
        let at = bytes.len() - 2;
        if file == "sigma_o.safetensors" {
            bytes[at] ^= 1;
        }
        std::fs::write(models.join(file), bytes).expect("written");
    }
    let said = run(&models, &["--resume"]);
    let error = text(&said.stderr);
    assert!(said.status.code() == Some(2) && error.contains("cannot be resumed: the weights sigma_o were "), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    let said = nudge_with(&models, &["replay", utf8(&out)]);
    assert!(text(&said.stderr).contains("warning: ") && text(&said.stderr).contains("the weights sigma_o were "));
    let said = run(&root().join("models"), &["--resume"]);
    assert!(said.status.success(), "{}", text(&said.stderr));
}

/// A processor that this process may run on.
fn one_processor() -> String {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).expect("processors");
    list.trim().split([',', '-']).next().expect("one").to_owned()
}

#[test]
fn the_networks_believe_and_decide_the_same_on_any_number_of_threads_and_pinned_to_one_core() {
    let dir = tempfile::tempdir().expect("tempdir");
    let processor = one_processor();
    let with_threads = |threads: &'static str| vec!["env", threads];
    let ways = [
        ("1", with_threads("RAYON_NUM_THREADS=1")),
        ("2", with_threads("RAYON_NUM_THREADS=2")),
        ("4", with_threads("RAYON_NUM_THREADS=4")),
        ("pinned", vec!["taskset", "-c", &processor]),
        ("pinned-4", vec!["taskset", "-c", &processor, "env", "RAYON_NUM_THREADS=4"]),
    ];
    let episode = |(name, way): &(&str, Vec<&str>)| {
        let out = dir.path().join(name);
        let output = Command::new(way[0])
            .args(&way[1..])
            .arg(nudge_bin())
            .args(["run", "scenes/demo/behind-the-boxes.toml", "--policy", "mem", "--belief", "cnabu", "--budget", "3"])
            // Pushes are weighed from the first step on, so that both networks have a part in every decision.
            .args(["--quiet-steps", "0", "--closing-steps", "1", "--candidates", "8", "--seed", "2", "--json", "--out"])
            .arg(&out)
            .current_dir(root())
            .output()
            .expect("it starts");
        assert!(output.status.success(), "{name}: {}", text(&output.stderr));
        let mut record: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        record["made_by"]["threads"] = Value::Null;
        for step in record["steps"].as_array_mut().expect("steps") {
            step["seconds"] = Value::Null;
        }
        let belief = |n: usize| std::fs::read(out.join(format!("beliefs/{n:03}.npz"))).expect("a belief");
        (record, (0..=3).map(belief).collect::<Vec<_>>())
    };
    let (record, beliefs) = episode(&ways[0]);
    let weighed = record["steps"]
        .as_array()
        .expect("steps")
        .iter()
        .filter(|step| step["decision"]["candidates"].as_array().is_some_and(|pushes| !pushes.is_empty()));
    assert!(weighed.count() > 0, "no push was weighed");
    for way in &ways[1..] {
        let (other, others) = episode(way);
        for (n, (one, other)) in beliefs.iter().zip(&others).enumerate() {
            assert!(one == other, "{}: belief {n} differs", way.0);
        }
        assert!(record == other, "{}: the records differ", way.0);
    }
}
