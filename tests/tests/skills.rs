//! Skills beside the push, from the command line: chosen by name, carried out, filed, repeated.

use nudge_tests::{nudge_fails, nudge_ok};
use serde_json::Value;
use std::path::Path;

/// Two low tins with room behind them.
const SCENE: &str = "format = 1\nname = \"tins\"\n[shelf]\nsize = [0.8, 0.4, 0.4]\nvoxel_m = 0.01\n\
    [[object]]\nclass = \"meat_can\"\nposition = [-0.08, 0.14]\n\
    [[object]]\nclass = \"gum_tin\"\nposition = [0.12, 0.16]\n";

fn text(path: &Path) -> &str {
    path.to_str().expect("utf-8")
}

#[test]
fn a_drag_runs_is_filed_and_is_repeated_bit_for_bit() {
    let folder = tempfile::tempdir().expect("tempdir");
    let (scene, out) = (folder.path().join("tins.toml"), folder.path().join("e"));
    std::fs::write(&scene, SCENE).expect("written");
    let run =
        ["run", text(&scene), "--belief", "classical", "--policy", "random-push-5", "--budget", "6", "--seed", "1"];
    let said = nudge_ok(&[&run[..], &["--skills", "drag", "--closing-steps", "1", "--out", text(&out)]].concat());
    assert!(said.contains("drag ") && said.contains(" mm at "), "{said}");
    let file = out.join("episode.json");
    let record: Value = serde_json::from_slice(&std::fs::read(&file).expect("a document")).expect("JSON");
    assert_eq!(record["planner"]["skills"], serde_json::json!(["drag"]));
    let step = &record["steps"][4];
    assert_eq!(step["action"]["kind"], "drag", "{step}");
    assert!(step["action"]["pitch_deg"].is_number() && step["displacement_m"].as_f64().expect("metres") > 0.0);
    assert!(out.join("episode.rrd").is_file());
    assert!(nudge_ok(&["replay", text(&out)]).contains("bit for bit"));

    // A program that lacks the skill says so in one line.
    let other = String::from_utf8(std::fs::read(&file).expect("a document")).expect("utf-8");
    std::fs::write(&file, other.replace("\"kind\": \"drag\"", "\"kind\": \"juggle\"")).expect("written");
    let line = nudge_fails(2, &["replay", text(&out)]);
    assert!(
        line.contains("episode.json: line ") && line.ends_with("no skill `juggle`; it has push, drag, pick"),
        "{line}"
    );
}

#[test]
fn candidates_of_both_skills_are_weighed_together() {
    let folder = tempfile::tempdir().expect("tempdir");
    let (scene, out) = (folder.path().join("tins.toml"), folder.path().join("e"));
    std::fs::write(&scene, SCENE).expect("written");
    let run = ["run", text(&scene), "--belief", "classical", "--budget", "5", "--candidates", "3", "--out", text(&out)];
    nudge_ok(&[&run[..], &["--skills", "drag,push"]].concat());
    let text = std::fs::read(out.join("episode.json")).expect("a document");
    let record: Value = serde_json::from_slice(&text).expect("JSON");
    assert_eq!(record["planner"]["skills"], serde_json::json!(["push", "drag"]));
    let candidates = record["steps"][3]["decision"]["candidates"].as_array().expect("candidates");
    for kind in ["push", "drag"] {
        let of: Vec<&Value> = candidates.iter().filter(|candidate| candidate["kind"] == kind).collect();
        assert!(of.iter().any(|candidate| candidate["gain"].is_number()), "{kind}: {of:?}");
    }
}

#[test]
fn a_pick_runs_with_the_hand_that_it_needs_is_filed_and_is_repeated_bit_for_bit() {
    let folder = tempfile::tempdir().expect("tempdir");
    let (scene, out) = (folder.path().join("tins.toml"), folder.path().join("e"));
    std::fs::write(&scene, SCENE).expect("written");
    for (place, end) in [("shelf", "set_down"), ("tray", "stowed")] {
        let run = ["run", text(&scene), "--belief", "classical", "--policy", "greedy-front-pick", "--budget", "6"];
        let said = nudge_ok(&[&run[..], &["--place", place, "--force", "--out", text(&out)]].concat());
        assert!(said.contains("pick at ("), "{said}");
        let record: Value =
            serde_json::from_slice(&std::fs::read(out.join("episode.json")).expect("there")).expect("JSON");
        assert_eq!(record["scene"]["robot"]["urdf"]["source"], "ur5_suction.urdf");
        let step = &record["steps"][4];
        assert_eq!((&step["action"]["kind"], &step["push"]["grip"]["end"]), (&"pick".into(), &end.into()), "{step}");
        let verdicts = record["steps"][5]["verdicts"].as_array().map_or(0, Vec::len);
        assert!(verdicts == 0 || verdicts == if place == "tray" { 1 } else { 2 }, "{verdicts}");
        assert!(nudge_ok(&["replay", text(&out)]).contains("bit for bit"));
        assert!(nudge_ok(&["replay", "--infer", text(&out)]).contains("bit for bit"));
    }
}

#[test]
fn a_policy_that_picks_with_a_hand_without_a_cup_is_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("tempdir");
    let scene = folder.path().join("tins.toml");
    std::fs::write(&scene, SCENE).expect("written");
    let run = ["run", text(&scene), "--belief", "classical", "--policy", "mem-pick", "--arm"];
    let line = nudge_fails(2, &[&run[..], &["gripper"]].concat());
    assert!(line.contains("ur5_2f85 has no cup; choose --arm suction"), "{line}");
    let line = nudge_fails(2, &[&run[..], &["no-such-arm.urdf"]].concat());
    assert!(line.contains("no-such-arm.urdf"), "{line}");
}

#[test]
fn a_report_tells_how_picks_ended_and_counts_each_as_two_actions() {
    let folder = tempfile::tempdir().expect("tempdir");
    let (scene, out) = (folder.path().join("tins.toml"), folder.path().join("b"));
    std::fs::write(&scene, SCENE).expect("written");
    let bench = ["bench", text(&scene), "--belief", "classical", "--budget", "6", "--seeds", "1", "--place", "tray"];
    let said = nudge_ok(&[&bench[..], &["--policies", "greedy-front-pick,mem-no-push", "--out", text(&out)]].concat());
    assert!(said.lines().any(|line| line.ends_with("pushes   picks")), "{said}");
    let report = nudge_ok(&["report", "--markdown", text(&out)]);
    let row = |after: &str| -> Vec<String> {
        let table = report.split(after).nth(1).unwrap_or_else(|| panic!("no {after} in {report}"));
        let row = table.lines().find(|line| line.contains("greedy-front-pick")).expect("a row");
        row.split('|').map(|cell| cell.trim().to_owned()).filter(|cell| !cell.is_empty()).collect()
    };
    let ends = row("Picks.");
    assert_eq!(ends[1], "1.0", "{ends:?}");
    assert!(ends[2].starts_with("100 %") && ends[3].starts_with("0 %"), "{ends:?}");
    // The pick is the 5th of six actions: counted twice, the 6th no longer fits, and the map is that of before the last look.
    let (once, twice) = (row("Maps:"), row("counts as two actions"));
    assert_eq!(twice.len(), 5, "{twice:?}");
    assert_ne!(once[2].split(' ').next(), Some(&*twice[2]), "{once:?} {twice:?}");
}
