//! Training data from the command line: made, resumed, shared between processes, read from Python; and bad directories.

use nudge_tests::{nudge, nudge_fails, nudge_ok, root, text, venv_tool};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn make(kind: &str, out: &Path, count: usize, more: &[&str]) -> Value {
    let (out, count) = (out.to_str().expect("utf-8"), count.to_string());
    let mut args = vec!["data", kind, "--count", &count, "--seed", "9", "--out", out, "--json"];
    args.extend(more);
    serde_json::from_str(&nudge_ok(&args)).expect("JSON on stdout")
}

#[test]
fn maps_repeat_extend_and_stay_small() {
    let dir = tempfile::tempdir().expect("tempdir");
    let (one, two) = (dir.path().join("one"), dir.path().join("two"));
    let made = make("maps", &one, 2, &[]);
    assert_eq!((made["samples"].as_u64(), made["made"].as_u64()), (Some(2), Some(2)));
    assert!(made["bytes_per_sample"].as_f64().expect("bytes") < 200_000.0);
    assert_eq!(make("maps", &one, 2, &[])["made"].as_u64(), Some(0), "what is there is not made again");
    make("maps", &two, 2, &[]);
    let shard = |dir: &Path| std::fs::read(dir.join("shard-00000.zst")).expect("a shard");
    assert_eq!(shard(&one), shard(&two));
    // A shard of another length is made anew: the same samples first.
    assert_eq!(make("maps", &one, 3, &[])["made"].as_u64(), Some(3));
    assert!(shard(&one).starts_with(&shard(&two)));
    let line = nudge_fails(2, &["data", "maps", "--count", "3", "--seed", "8", "--out", one.to_str().expect("utf-8")]);
    assert!(line.contains("seed 9, not 8"), "{line}");
    let line =
        nudge_fails(2, &["data", "pushes", "--count", "3", "--seed", "9", "--out", one.to_str().expect("utf-8")]);
    assert!(line.contains("kind maps, not pushes"), "{line}");
}

#[test]
fn pushes_are_made_and_small() {
    let dir = tempfile::tempdir().expect("tempdir");
    let made = make("pushes", &dir.path().join("p"), 2, &[]);
    assert_eq!(made["samples"].as_u64(), Some(2));
    assert!(made["bytes_per_sample"].as_f64().expect("bytes") < 200_000.0);
}

#[test]
fn python_reads_maps() {
    let Some(python) = venv_tool("python") else { return };
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("d");
    make("maps", &out, 2, &["--noise", "0"]);
    let script = root().join("scripts/read_data.py");
    let said = Command::new(python).arg(script).arg(&out).output().expect("python starts");
    let (lines, errors) = (text(&said.stdout), text(&said.stderr));
    assert!(said.status.success(), "{errors}");
    assert_eq!(lines.lines().count(), 2, "{lines}");
    for line in lines.lines() {
        let share: f64 = line.split(' ').nth(2).and_then(|word| word.parse().ok()).expect("a share");
        assert!((0.05..0.30).contains(&share), "{line}");
    }
}

#[test]
fn a_damaged_shard_is_skipped_and_named_and_a_directory_without_data_is_refused() {
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("d");
    make("maps", &out, 51, &[]);
    let shard = out.join("shard-00001.zst");
    let mut bytes = std::fs::read(&shard).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x40;
    std::fs::write(&shard, &bytes).expect("written");
    let out = out.to_str().expect("utf-8");
    let said = nudge(&["calibrate", "--data", out, "--scenes", "1", "--beliefs", "classical"]);
    assert!(said.status.success(), "{}", text(&said.stderr));
    let warning = text(&said.stderr);
    assert!(
        warning.contains("skipped") && warning.contains("shard-00001.zst") && warning.contains("checksum"),
        "{warning}"
    );
    // Making again repairs it.
    let made: Value =
        serde_json::from_str(&nudge_ok(&["data", "maps", "--count", "51", "--seed", "9", "--out", out, "--json"]))
            .expect("JSON on stdout");
    assert_eq!((made["samples"].as_u64(), made["made"].as_u64()), (Some(51), Some(1)));

    let empty = dir.path().join("empty");
    std::fs::create_dir(&empty).expect("made");
    let line = nudge_fails(2, &["calibrate", "--data", empty.to_str().expect("utf-8"), "--beliefs", "classical"]);
    assert!(line.contains("empty") && line.contains("no data"), "{line}");
    // The command line's own parser adds where to find help.
    let said = nudge(&["data", "maps", "--count", "2", "--shard", "3/3", "--out", out]);
    assert_eq!(said.status.code(), Some(2));
    assert!(text(&said.stderr).contains("3/3"), "{}", text(&said.stderr));
}

#[test]
fn a_log_tells_how_long_making_and_scoring_still_take() {
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("d");
    let out = out.to_str().expect("utf-8");
    let told = |args: &[&str], what: &str| {
        let said = nudge(args);
        let lines = text(&said.stderr);
        assert!(said.status.success(), "{lines}");
        let of_work: Vec<&str> = lines.lines().filter(|line| line.starts_with(what)).collect();
        let (first, last) = (of_work.first().expect("a line for the first unit"), of_work[of_work.len() - 1]);
        assert!(first.starts_with(&format!("{what}: ")) && first.ends_with(" left"), "{lines}");
        assert!(last.starts_with(&format!("{what}: 3/3 in ")), "{lines}");
        assert!(lines.lines().all(nudge_tests::is_progress), "{lines}");
    };
    told(&["data", "maps", "--count", "3", "--seed", "9", "--out", out], "data maps");
    told(&["calibrate", "--data", out, "--beliefs", "classical", "--json"], "classical on views");
}

#[test]
fn what_pushes_are_worth_is_made_summed_up_and_refused_in_one_line() {
    let dir = tempfile::tempdir().expect("tempdir");
    let out = dir.path().join("w");
    let out = out.to_str().expect("utf-8");
    let quick = ["--belief", "classical", "--views", "real75", "--pushes", "2", "--families", "walls"];
    let made = [&["data", "worth", "--count", "1", "--seed", "9", "--out", out, "--json"][..], &quick].concat();
    let said = nudge(&made);
    assert!(said.status.success(), "{}", text(&said.stderr));
    let document: serde_json::Value = serde_json::from_slice(&said.stdout).expect("json");
    assert_eq!((&document["samples"], &document["made"]), (&1.into(), &1.into()));
    assert!(document["bytes_per_sample"].as_f64().is_some_and(|bytes| bytes < 300e3), "{document}");
    let said = nudge(&["data", "worth", "--summary", out, "--json"]);
    let document: serde_json::Value = serde_json::from_slice(&said.stdout).expect("json");
    assert_eq!((&document["summaries"][0]["states"], &document["summaries"][1]["of"]), (&1.into(), &"walls".into()));

    let refused = |args: &[&str], words: &str| {
        let said = nudge(&[&["data", "worth"], args].concat());
        let message = text(&said.stderr);
        assert_eq!(said.status.code(), Some(2), "{message}");
        assert!(message.contains(words), "{message}");
        message
    };
    let one_line = |message: String| assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    one_line(refused(&["--count", "0", "--out", out], "--count must be at least 1"));
    one_line(refused(&["--count", "2", "--seed", "8", "--out", out, "--belief", "classical"], "seed"));
    one_line(refused(&["--summary", dir.path().to_str().expect("utf-8")], "holds no data"));
    refused(&["--count", "1", "--out", out, "--families", "wall"], "unknown family \"wall\"");
}
