//! The planner's settings, noise and view arrays from the command line: one list in all places.

use nudge_tests::{nudge_fails, nudge_ok};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A folder with a set `small` of one scene whose voxels are so large.
fn folder(voxel_m: f32) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("tempdir");
    let set = folder.path().join("small");
    std::fs::create_dir(&set).expect("folder");
    let scene = format!(
        "format = 1\nname = \"left\"\n[shelf]\nsize = [0.3, 0.2, 0.2]\nvoxel_m = {voxel_m}\n\
         [[object]]\nclass = \"baking_powder\"\nposition = [-0.06, 0.04]\n\
         [[object]]\nclass = \"tomato_can\"\nposition = [0.06, 0.14]\n"
    );
    std::fs::write(set.join("left.toml"), scene).expect("scene");
    let set = utf8(&set);
    (folder, set)
}

fn utf8(path: &Path) -> String {
    path.to_str().expect("utf-8").to_owned()
}

fn json(path: PathBuf) -> Value {
    serde_json::from_slice(&std::fs::read(&path).expect("a document")).expect("JSON")
}

/// Options and the words that refuse them.
const WRONG: [(&str, &str, &str); 10] = [
    ("--gamma", "nan", "--gamma nan: must be a number from 0 to 10"),
    ("--patience", "101", "--patience 101: must be a number from 0.1 to 100"),
    ("--push-floor", "-1", "--push-floor -1: must be a number of nats from 0 to 100000"),
    ("--certain", "inf", "--certain inf: must be a probability from 0 to 1"),
    ("--quiet-steps", "1.5", "--quiet-steps 1.5: must be a whole number of steps from 0 to 1000"),
    ("--saturation", "-0.1", "--saturation -0.1: must be a share from 0 to 1"),
    ("--skills", "fly", "--skills fly: must be one or more of push, drag, pick, with commas between"),
    ("--skills", "", "--skills : must be one or more of push, drag, pick, with commas between"),
    ("--gain", "some", "--gain some: must be all or unseen"),
    ("--noise", "d435", "unknown noise \"d435\"; there are none, standard, l515"),
];

#[test]
fn values_that_no_setting_takes_are_refused_in_one_line_by_run_and_bench() {
    let (dir, set) = folder(0.01);
    let (scene, out) = (format!("{set}/left.toml"), utf8(&dir.path().join("out")));
    for (option, value, said) in WRONG {
        for command in [["run", &scene], ["bench", &set]] {
            let args = [&command[..], &["--belief", "classical", option, value, "--out", &out]].concat();
            let line = nudge_fails(2, &args);
            assert!(line.ends_with(said), "{line}");
            assert!(!Path::new(&out).exists(), "half-written");
        }
    }
}

#[test]
fn the_table_of_settings_is_the_help_of_run_bench_and_open_and_stands_in_the_page_of_commands() {
    let words = |text: String| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let table: Value = serde_json::from_str(&nudge_ok(&["settings", "--json"])).expect("JSON");
    let marked = nudge_ok(&["settings", "--markdown"]);
    let [run, bench, open] = ["run", "bench", "open"].map(|command| words(nudge_ok(&[command, "--help"])));
    let rows = table.as_array().expect("rows");
    assert!(rows.len() >= 11, "{rows:?}");
    for row in rows {
        let (option, help) = (row["option"].as_str().expect("option"), row["help"].as_str().expect("help"));
        for help_of in [&run, &bench, &open] {
            assert!(help_of.contains(&format!("{option} <")) && help_of.contains(help), "{option}: {help_of}");
        }
        assert!(marked.contains(&format!("| `{option}` |")) && marked.contains(help), "{option}");
    }
    // The page of the commands holds this very table.
    if let Ok(page) = std::fs::read_to_string(nudge_tests::root().join("docs/commands.md")) {
        let begin = "<!-- the output of `nudge settings --markdown` -->\n";
        let table = page.split_once(begin).and_then(|(_, rest)| rest.split_once("<!-- end -->"));
        let (table, _) = table.expect("docs/commands.md has a place for the table of settings");
        assert_eq!(table, marked, "put what `nudge settings --markdown` prints into docs/commands.md");
    }
    assert!(run.contains("[a number from 0.1 to 100; default: 1, or 10 with --gain unseen]"), "{run}");
    assert!(run.contains("[default: all, or unseen with the cnabu belief]"), "{run}");
}

#[test]
fn every_setting_reaches_the_episode_and_resuming_compares_it() {
    let (dir, set) = folder(0.01);
    let (scene, out) = (format!("{set}/left.toml"), utf8(&dir.path().join("e")));
    let whole = ["run", &scene, "--belief", "classical", "--policy", "mem-no-push", "--budget", "2", "--out", &out];
    let asked =
        ["--gamma", "0.35", "--certain", "0.9", "--quiet-steps", "5", "--saturation", "0.1", "--noise", "standard"];
    nudge_ok(&[&whole[..], &asked].concat());
    let record = json(dir.path().join("e/episode.json"));
    let planner = &record["planner"];
    assert_eq!((planner["quiet_steps"].as_u64(), planner["gamma"].to_string().as_str()), (Some(5), "0.35"));
    assert_eq!((planner["certain"].to_string(), planner["saturation"].to_string()), ("0.9".into(), "0.1".into()));
    assert!(record["noise"]["outlier_share"].as_f64().is_some_and(|share| share > 0.0), "{}", record["noise"]);
    let said = nudge_ok(&["replay", &out]);
    assert!(said.contains("bit for bit"), "{said}");
    // The same goes on; with another gamma, or without the noise, it would be another episode.
    nudge_ok(&[&whole[..], &asked, &["--resume"]].concat());
    let line = nudge_fails(2, &[&whole[..], &["--resume"]].concat());
    assert!(line.contains("was run with --noise standard, not none"), "{line}");
    let line = nudge_fails(2, &[&whole[..], &["--noise", "standard", "--resume"]].concat());
    assert!(line.contains("was run with --gamma 0.35, not 0.2"), "{line}");
}

#[test]
fn a_bench_records_noise_and_settings_and_another_one_is_refused() {
    let (dir, set) = folder(0.01);
    let out = utf8(&dir.path().join("b"));
    let whole = ["bench", &set, "--policies", "mem-no-push", "--belief", "classical", "--seeds", "1", "--budget", "1"];
    let noisy = [&whole[..], &["--noise", "standard", "--gamma", "0.3", "--record", "--out", &out]].concat();
    nudge_ok(&noisy);
    let plan = json(dir.path().join("b/bench.json"));
    let episode = json(dir.path().join("b/recordings/small/left/mem-no-push-0/episode.json"));
    assert!(plan["noise"].is_object() && plan["noise"] == episode["noise"], "{}", plan["noise"]);
    assert_eq!(episode["planner"]["gamma"].to_string(), "0.3");
    let line = nudge_fails(2, &[&whole[..], &["--gamma", "0.3", "--out", &out]].concat());
    assert!(line.contains("the noise was standard, now it is none"), "{line}");
    let line = nudge_fails(2, &[&whole[..], &["--noise", "standard", "--out", &out]].concat());
    assert!(line.contains("--gamma was 0.3, now it is 0.2"), "{line}");
}

/// In a bench beside policies on the networks `random` was run with their gain, alone with its own.
#[test]
fn random_has_the_same_gain_alone_and_in_a_mixed_bench() {
    let (dir, set) = folder(0.005);
    let (scene, out, alone) = (format!("{set}/left.toml"), utf8(&dir.path().join("b")), utf8(&dir.path().join("e")));
    let policies = ["--policies", "mem-no-push,random", "--seeds", "1", "--budget", "1", "--record", "--out", &out];
    nudge_ok(&[&["bench", &set][..], &policies].concat());
    nudge_ok(&["run", &scene, "--policy", "random", "--budget", "1", "--out", &alone]);
    let of = |policy: &str| json(dir.path().join(format!("b/recordings/small/left/{policy}-0/episode.json")));
    let (mem, random, alone) = (of("mem-no-push"), of("random"), json(dir.path().join("e/episode.json")));
    assert_eq!(random["planner"], alone["planner"]);
    assert_eq!(random["steps"][0]["decision"], alone["steps"][0]["decision"]);
    assert_eq!((random["belief"].as_str(), random["planner"]["counted"].as_str()), (Some("classical"), Some("all")));
    if mem["belief"] == "cnabu" {
        assert_eq!(mem["planner"]["counted"], "unseen");
    } else {
        eprintln!("no networks: the bench was not a mixed one");
    }
}

#[cfg(feature = "workbench")]
#[test]
fn the_window_refuses_wrong_choices_before_it_opens() {
    for (option, value, said) in WRONG {
        assert!(nudge_fails(2, &["open", option, value]).ends_with(said));
    }
    let line = nudge_fails(2, &["open", "--views", "nowhere"]);
    assert!(line.contains("nowhere") && line.contains("standard300"), "{line}");
}
