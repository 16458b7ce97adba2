//! Where results go: links, pipes, devices, and disks that are full.

#![cfg(unix)]

use super::{Folder, TIN, small_scene};
use nudge_tests::{nudge_bin, nudge_fails, nudge_ok, root, text, venv_tool};
use serde_json::Value;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::os::unix::fs::{FileTypeExt, symlink};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// The arguments of a short run.
fn run<'a>(scene: &'a str, out: &'a str) -> Vec<&'a str> {
    vec!["run", scene, "--belief", "classical", "--policy", "random", "--budget", "3", "--out", out]
}

fn command(args: &[&str]) -> Command {
    let mut command = Command::new(nudge_bin());
    command.args(args).current_dir(root()).stderr(Stdio::piped());
    command
}

/// How a program ends and what it said on standard error; it must end by itself.
fn ends(mut child: Child) -> (ExitStatus, String) {
    let started = Instant::now();
    while child.try_wait().expect("waited").is_none() {
        if started.elapsed() > Duration::from_secs(90) {
            child.kill().expect("killed");
            panic!("it hangs");
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let mut said = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
    (child.wait().expect("ended"), said)
}

/// Starts `nudge` where no file may grow beyond so many kilobytes (half of it where the shell counts in blocks of 512).
fn with_small_files(kilobytes: u64, args: &[&str]) -> Child {
    let script = format!("trap '' XFSZ; ulimit -f {kilobytes}; exec \"$@\"");
    let mut shell = Command::new("bash");
    shell.args(["-c", &script, "bash"]).arg(nudge_bin()).args(args);
    shell.current_dir(root()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("starts")
}

/// What of standard error is no progress.
fn complaints(said: &str) -> Vec<&str> {
    let complains = |line: &&str| ["nudge:", "warning:", "panicked", "error"].iter().any(|word| line.contains(word));
    said.lines().filter(complains).collect()
}

/// The number of steps that the `episode.json` in a directory tells of.
fn steps(directory: &Path) -> usize {
    let text = fs::read(directory.join("episode.json")).expect("episode.json");
    let record: Value = serde_json::from_slice(&text).expect("JSON");
    record["steps"].as_array().expect("steps").len()
}

#[test]
fn an_output_that_was_a_link_or_a_pipe_became_a_regular_file() {
    let folder = Folder::new();
    let scene = folder.write("s.toml", small_scene(TIN));
    fs::create_dir(folder.path("elsewhere")).expect("created");
    symlink("elsewhere/s.png", folder.path("link.png")).expect("linked");
    for _ in 0..2 {
        nudge_ok(&["scene", "thumbnail", &scene, "--out", &folder.name("link.png")]);
        assert!(fs::symlink_metadata(folder.path("link.png")).expect("there").is_symlink());
        assert!(fs::read(folder.path("elsewhere/s.png")).expect("a picture").starts_with(b"\x89PNG"));
    }
    let pipe = folder.path("pipe.png");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let from = pipe.clone();
    let reader = std::thread::spawn(move || fs::read(from).expect("read"));
    nudge_ok(&["scene", "thumbnail", &scene, "--out", &folder.name("pipe.png")]);
    // Before the reader is waited for: whoever replaces the pipe leaves it waiting.
    assert!(fs::symlink_metadata(&pipe).expect("there").file_type().is_fifo());
    assert!(reader.join().expect("no panic").starts_with(b"\x89PNG"));
    if Path::new("/dev/full").exists() {
        let line = nudge_fails(2, &["scene", "thumbnail", &scene, "--out", "/dev/full"]);
        assert!(line.contains("/dev/full: No space left"), "{line}");
        assert!(fs::symlink_metadata("/dev/full").expect("there").file_type().is_char_device());
    }
}

#[test]
fn a_reader_that_had_seen_enough_stopped_the_run_at_its_first_step() {
    let folder = Folder::new();
    let scene = folder.write("s.toml", small_scene(TIN));
    let out = folder.name("e");
    let cases = [run(&scene, &out), vec!["replay", &out]];
    for args in cases {
        let mut child = command(&args).stdout(Stdio::piped()).spawn().expect("starts");
        if args[0] == "run" {
            let mut first = String::new();
            BufReader::new(child.stdout.take().expect("piped")).read_line(&mut first).expect("a line");
            assert!(first.starts_with("small: "), "{first}");
        }
        drop(child.stdout.take());
        let (status, said) = ends(child);
        assert!(status.success() && complaints(&said).is_empty(), "{args:?}: {status} {said}");
        assert_eq!(steps(&folder.path("e")), 3, "the work is done all the same");
    }
    fs::create_dir(folder.path("set")).expect("created");
    folder.write("set/a.toml", small_scene(TIN));
    let (set, bench) = (folder.name("set"), folder.name("bench"));
    let args = ["bench", &set, "--policies", "random", "--belief", "classical", "--seeds", "2", "--budget", "2"];
    let mut child = command(&[&args[..], &["--jobs", "1", "--out", &bench]].concat())
        .stdout(Stdio::piped())
        .spawn()
        .expect("starts");
    drop(child.stdout.take());
    let (status, said) = ends(child);
    assert!(status.success() && complaints(&said).is_empty(), "{status} {said}");
}

#[test]
fn a_full_standard_output_made_the_run_panic() {
    let Ok(full) = File::options().write(true).open("/dev/full") else { return };
    let folder = Folder::new();
    let scene = folder.write("s.toml", small_scene(TIN));
    let out = folder.name("e");
    for args in [run(&scene, &out), vec!["replay", &out], vec!["views"]] {
        let child = command(&args).stdout(full.try_clone().expect("cloned")).spawn().expect("starts");
        let (status, said) = ends(child);
        assert_eq!(status.code(), Some(2), "{args:?}: {said}");
        let complaints = complaints(&said);
        assert!(complaints.len() == 1 && complaints[0].starts_with("nudge: standard output: No space left"), "{said}");
        assert_eq!(steps(&folder.path("e")), 3, "the work is done all the same");
    }
    // There is nowhere to say what is wrong with standard error.
    let args = ["mesh", "/nowhere.obj"];
    let status = Command::new(nudge_bin()).args(args).stderr(full).status().expect("starts");
    assert_eq!(status.code(), Some(2));
}

#[test]
fn a_disk_that_filled_up_during_a_run_made_it_hang_for_ever() {
    let folder = Folder::new();
    let scene = folder.write("s.toml", small_scene(TIN));
    nudge_ok(&run(&scene, &folder.name("whole")));
    let whole = fs::metadata(folder.path("whole/episode.rrd")).expect("a recording").len();
    // No file may grow beyond some of that: the system then says no, as a full disk does. Units of 512 or 1024 bytes.
    for share in [0.15, 0.5, 0.97] {
        let out = folder.name(&format!("e{share}"));
        let limit = (share * whole as f64 / 1024.0) as u64;
        let (status, said) = ends(with_small_files(limit, &run(&scene, &out)));
        assert_eq!(status.code(), Some(2), "{share}: {said}");
        let complaints = complaints(&said);
        assert!(complaints.len() == 1 && complaints[0].contains("episode.rrd: File too large"), "{share}: {said}");
        let recording = fs::read(Path::new(&out).join("episode.rrd")).expect("a recording");
        assert!(recording.len() as u64 <= limit * 1024, "{share}");
        if !Path::new(&out).join("episode.json").exists() {
            continue;
        }
        // The rest of the file is its index.
        assert!(steps(Path::new(&out)) < 3 || share > 0.5, "{share}: it stopped before the end");
        assert!(recording.starts_with(b"RRF2"));
        nudge_ok(&["replay", &out]);
        if let Some(rerun) = venv_tool("rerun") {
            let file = Path::new(&out).join("episode.rrd");
            // It has no index, as after a kill, and is read all the same.
            let counted = Command::new(rerun).args(["rrd", "stats"]).arg(file).output().expect("rerun");
            assert!(counted.status.success(), "{share}: {}", text(&counted.stderr));
        }
    }
}

#[test]
fn a_disk_that_fills_up_ends_a_bench_and_making_data_with_one_line() {
    let folder = Folder::new();
    fs::create_dir(folder.path("set")).expect("folder");
    folder.write("set/tin.toml", small_scene(TIN));
    let (set, bench, data) = (folder.name("set"), folder.name("bench"), folder.name("data"));
    let settings = ["--policies", "random", "--belief", "classical", "--seeds", "1", "--budget", "2", "--jobs", "1"];
    let benching = [&["bench", &set, "--out", &bench], &settings[..]].concat();
    let making = ["data", "maps", "--seed", "2", "--count", "1", "--noise", "0", "--out", &data];
    for (args, file, kilobytes) in [(&benching[..], "random-0.json", 2), (&making[..], "shard-00000.zst", 4)] {
        let (status, said) = ends(with_small_files(kilobytes, args));
        let complaints = complaints(&said);
        assert_eq!(status.code(), Some(2), "{said}");
        assert!(complaints.len() == 1 && complaints[0].contains(&format!("{file}: File too large")), "{said}");
    }
    assert!(!folder.path("bench/episodes/set/tin/random-0.json").exists(), "half-written");
    assert!(!folder.path("data/shard-00000.zst").exists() && !folder.path("data/shard-00000.json").exists());
    // With room both go on.
    nudge_ok(&benching);
    nudge_ok(&making);
}

#[test]
fn the_printed_time_left_getting_ready_out() {
    let folder = Folder::new();
    let scene = folder.write("s.toml", small_scene(TIN));
    let started = Instant::now();
    let said = nudge_ok(&run(&scene, &folder.name("e")));
    let whole_s = started.elapsed().as_secs_f64();
    let line = said.lines().find(|line| line.trim_start().starts_with("time ")).expect("the time");
    let printed_s: f64 = line.split_whitespace().find_map(|word| word.parse().ok()).expect("seconds");
    let record: Value = serde_json::from_slice(&fs::read(folder.path("e/episode.json")).expect("read")).expect("JSON");
    let of_step =
        |step: &Value| step["seconds"].as_object().expect("parts").values().filter_map(Value::as_f64).sum::<f64>();
    let steps_s: f64 = record["steps"].as_array().expect("steps").iter().map(of_step).sum();
    // Seconds are printed with one decimal. Getting ready takes some of them: the arm's way to every view.
    assert!(printed_s <= whole_s + 0.06, "{line}, {whole_s:.2} s");
    assert!(printed_s > steps_s + 0.1, "{line}, of {whole_s:.2} s {steps_s:.2} were steps");
}
