//! Probing from the command line: tables, CSV and JSON tell the same, and what cannot be probed is told in one line.

use nudge_tests::{nudge_fails, nudge_ok};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Two boxes before a can, with voxels of 1 cm.
const SCENE: &str = "format = 1\nname = \"behind boxes\"\n[shelf]\nsize = [0.8, 0.4, 0.4]\nvoxel_m = 0.01\n\
    [[object]]\nclass = \"cracker_box\"\nposition = [-0.10, 0.20]\n\
    [[object]]\nclass = \"cracker_box\"\nposition = [0.08, 0.20]\n\
    [[object]]\nclass = \"tomato_can\"\nposition = [-0.01, 0.30]\n";

/// Runs an episode with few candidates; the steps from the 4th on weigh pushes, but the last does not.
fn episode(folder: &Path, budget: &str) -> PathBuf {
    let (scene, out) = (folder.join("scene.toml"), folder.join(format!("e{budget}")));
    std::fs::write(&scene, SCENE).expect("written");
    let words =
        ["run", text(&scene), "--belief", "classical", "--candidates", "3", "--budget", budget, "--out", text(&out)];
    nudge_ok(&words);
    out
}

fn text(path: &Path) -> &str {
    path.to_str().expect("utf-8")
}

#[test]
fn tables_csv_and_json_tell_the_same_pushes() {
    let folder = tempfile::tempdir().expect("tempdir");
    let out = episode(folder.path(), "6");
    let document: Value =
        serde_json::from_str(&nudge_ok(&["probe", text(&out), "--step", "4", "--json"])).expect("JSON on stdout");
    let step = &document["episodes"][0]["steps"][0];
    let pushes = step["pushes"].as_array().expect("pushes");
    assert!(step["step"] == 4 && pushes.len() == 3, "{step}");
    assert!(pushes.iter().all(|push| push["promised_gain"].is_number() && push["displacement_m"].is_number()));
    assert_eq!(document["mean"]["pushes"].as_f64(), Some(3.0));

    let csv = folder.path().join("pushes.csv");
    let said = nudge_ok(&["probe", text(&out), "--step", "4", "--csv", text(&csv)]);
    assert!(said.contains("3 pushes carried out") && said.contains("the planner's best"), "{said}");
    let written = std::fs::read_to_string(&csv).expect("written");
    let rows: Vec<Vec<&str>> = written.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 4, "{written}");
    let column = |name: &str| rows[0].iter().position(|title| *title == name).expect(name);
    for row in &rows[1..] {
        let number = |name: &str| row[column(name)].parse::<f64>().expect(name);
        let push =
            pushes.iter().find(|push| push["candidate"].as_f64() == Some(number("candidate"))).expect("the push");
        assert_eq!(Some(number("displacement_m")), push["displacement_m"].as_f64());
        assert_eq!(Some(number("opened_l")), push["opened_l"].as_f64());
        assert_eq!(Some(number("predicted_nats")), push["predicted_nats"].as_f64());
        assert!(number("predicted_nats") > 0.0 && number("predicted_nats") != number("unchanged_nats"));
        assert_eq!(number("chosen") == 1.0, Some(number("candidate") as u64) == chosen_candidate(step));
    }

    // Over several steps a line each and their means.
    let said = nudge_ok(&["probe", text(&out), "--steps", "all"]);
    let lines: Vec<&str> = said.lines().collect();
    let decisions = lines.iter().filter(|line| line.contains(", step ")).count();
    let mean = format!("mean of {decisions} ");
    assert!(decisions >= 1 && lines.iter().any(|line| line.starts_with(&mean)), "{said}");
    assert!(lines.last().is_some_and(|line| line.starts_with("occupancy afterwards, cross-entropy")), "{said}");
}

/// The candidate that the planner held to be best.
fn chosen_candidate(step: &Value) -> Option<u64> {
    step["pushes"][step["chosen"].as_u64()? as usize]["candidate"].as_u64()
}

#[test]
fn what_cannot_be_probed_is_told_in_one_line() {
    let folder = tempfile::tempdir().expect("tempdir");
    let out = episode(folder.path(), "5");
    let path = text(&out);
    let refused = |words: &[&str], expected: &str| {
        let line = nudge_fails(2, &[&["probe"][..], words].concat());
        assert!(line.contains(expected), "{line}");
    };
    refused(&[path, "--step", "2"], "e5: step 2: has no push candidates");
    refused(&[path, "--step", "9"], "e5: step 9: is not in the episode, which has steps 1 to 5");
    refused(&[path, "--step", "4", "--csv", "/nowhere/at/all.csv"], "/nowhere/at");
    refused(&[text(folder.path()), "--step", "4"], "holds no episode");
    let csv = folder.path().join("pushes.csv");
    refused(&[path, "--steps", "4,9", "--csv", text(&csv)], "step 9");
    assert!(!csv.exists(), "nothing half-written");

    let document = out.join("episode.json");
    let written = std::fs::read_to_string(&document).expect("read");
    std::fs::write(&document, written.replacen("\"tomato_can\"", "\"teapot\"", 1)).expect("written");
    refused(&[path, "--step", "4"], "its scene cannot be simulated");
}
