//! Benches, their shards, their report, and the regression gate. Scenes are small and coarse: what is tested is the
//! machinery.

use nudge_tests::{nudge, nudge_bin, nudge_fails, nudge_ok, text};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

struct Bench {
    folder: tempfile::TempDir,
    set: String,
}

impl Bench {
    /// A folder with a set `small` of two scenes.
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("tempdir");
        let set = folder.path().join("small");
        std::fs::create_dir(&set).expect("folder");
        for (name, x) in [("left", -0.06), ("right", 0.06)] {
            let scene = format!(
                "format = 1\nname = {name:?}\n[shelf]\nsize = [0.3, 0.2, 0.2]\nvoxel_m = 0.01\n\
                 [[object]]\nclass = \"baking_powder\"\nposition = [{x}, 0.04]\n\
                 [[object]]\nclass = \"gelatin_box\"\nposition = [{x}, 0.1]\n\
                 [[object]]\nclass = \"tomato_can\"\nposition = [{}, 0.14]\n",
                -x
            );
            std::fs::write(set.join(format!("{name}.toml")), scene).expect("scene");
        }
        let set = set.to_str().expect("utf-8").to_owned();
        Self { folder, set }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn name(&self, name: &str) -> String {
        self.path(name).to_str().expect("utf-8").to_owned()
    }

    /// The arguments of a bench of eight episodes.
    fn args<'a>(&'a self, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
        let mut args = vec!["bench", &self.set, "--policies", "mem,random", "--belief", "classical"];
        args.extend(["--seeds", "2", "--budget", "4", "--candidates", "10", "--jobs", "1", "--out", out]);
        args.extend(more);
        args
    }

    fn run(&self, out: &str, more: &[&str]) -> String {
        nudge_ok(&self.args(&self.name(out), more))
    }
}

/// All files below a folder with their content.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in std::fs::read_dir(&at).expect("folder") {
            let path = entry.expect("entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below").to_owned();
                found.insert(name, std::fs::read(&path).expect("file"));
            }
        }
    }
    found
}

#[test]
fn a_killed_bench_and_merged_shards_equal_one_run() {
    let bench = Bench::new();
    let said = bench.run("whole", &[]);
    assert!(said.contains("8 of 8 episodes to run") && said.contains("left"), "{said}");
    let whole = files(&bench.path("whole/episodes"));
    assert_eq!(whole.len(), 8);

    let cut = bench.name("cut");
    let mut child = Command::new(nudge_bin())
        .args(bench.args(&cut, &[]))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("nudge starts");
    let episodes = bench.path("cut/episodes");
    let started = Instant::now();
    while finished(&episodes) == 0 {
        assert!(started.elapsed() < Duration::from_secs(300), "no episode was ever finished");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("SIGKILL");
    child.wait().expect("gone");
    let kept = finished(&episodes);
    assert!(kept < 8, "killed too late to test anything");
    let said = bench.run("cut", &[]);
    assert!(said.contains(&format!("{} of 8 episodes to run", 8 - kept)), "{said}");
    assert_eq!(files(&episodes), whole);

    for shard in ["0/3", "1/3", "2/3"] {
        bench.run(&format!("shard-{}", &shard[..1]), &["--shard", shard]);
    }
    let parts = ["shard-2", "shard-0", "shard-1"].map(|part| bench.name(part));
    let merged = bench.name("merged");
    nudge_ok(&["bench", "merge", &parts[0], &parts[1], &parts[2], "--out", &merged]);
    assert_eq!(files(&bench.path("merged/episodes")), whole);
    let read = |name: &str| std::fs::read_to_string(bench.path(name)).expect("bench.json");
    assert_eq!(read("merged/bench.json"), read("whole/bench.json"));
    assert_eq!(files(&bench.path("merged/seconds")).len(), 8);

    // Shards that are missing, overlap, are unfinished, or of another version.
    let refuses = |parts: &[&str], words: &[&str]| {
        let out = bench.name("refused");
        let mut args = vec!["bench", "merge", "--out", &out];
        args.extend(parts);
        let line = nudge_fails(2, &args);
        for word in words {
            assert!(line.contains(word), "{word:?} is not in: {line}");
        }
        assert!(!bench.path("refused").exists());
    };
    let [two, zero, one] = &parts;
    refuses(&[zero, two], &["1/3", "missing"]);
    refuses(&[zero, one, two, one], &["1/3", "overlap"]);
    refuses(&[zero, &bench.name("whole")], &["whole", "not a shard"]);
    let json = read("shard-1/bench.json");
    std::fs::write(bench.path("shard-1/bench.json"), json.replace("\"version\":\"", "\"version\":\"9."))
        .expect("write");
    refuses(&[zero, one, two], &["shard-1", "version", "9."]);
    std::fs::write(bench.path("shard-1/bench.json"), json).expect("restore");
    let first = files(&bench.path("shard-0/episodes")).into_keys().next().expect("an episode");
    std::fs::remove_file(bench.path("shard-0/episodes").join(first)).expect("remove");
    refuses(&[zero, one, two], &["shard-0", "1 of 3", "missing"]);
}

/// Number of results below a folder, whole ones, while they are being written.
fn finished(folder: &Path) -> usize {
    let Ok(entries) = std::fs::read_dir(folder) else { return 0 };
    let paths = entries.flatten().map(|entry| entry.path());
    let of = |path: PathBuf| {
        let is_whole = path.extension().is_some_and(|ext| ext == "json")
            && !path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if path.is_dir() { finished(&path) } else { usize::from(is_whole) }
    };
    paths.map(of).sum()
}

#[test]
fn a_report_is_one_page_with_everything_in_it() {
    let bench = Bench::new();
    bench.run("b", &["--record"]);
    let out = bench.name("b");
    let said = nudge_ok(&["report", &out]);
    let page = std::fs::read_to_string(said.trim()).expect("the page that was named");
    assert!(page.matches("<svg").count() >= 5 + 2 && page.contains("Paired differences"), "parts are missing");
    assert!(page.contains("A perfect map that lacks them"), "no word of what looking can reach");
    let foreign = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!foreign.contains("http://") && !foreign.contains("https://") && !foreign.contains("<script"));
    let png = bench.path("b/report/small-semantic-miou.png");
    assert!(png.metadata().expect("png").len() > 10_000);
    let link = page.split("href=\"").find(|rest| rest.starts_with("../recordings")).expect("a link to a recording");
    assert!(bench.path("b/report").join(link.split('"').next().expect("its end")).exists());

    let episode = files(&bench.path("b/episodes")).into_keys().next().expect("an episode");
    std::fs::remove_file(bench.path("b/episodes").join(episode)).expect("remove");
    let line = nudge_fails(2, &["report", &out, "--out", &bench.name("r")]);
    assert!(line.contains("1 of 8 episodes") && line.contains("small/left"), "{line}");
    assert!(!bench.path("r").exists());
    nudge_ok(&["report", &out, "--out", &bench.name("r"), "--partial"]);
    assert!(std::fs::read_to_string(bench.path("r/index.html")).expect("page").contains("1 of 8 episodes"));
    assert!(nudge_fails(2, &["report", &bench.set]).contains("no bench"));
}

#[test]
fn benches_that_cannot_be() {
    let bench = Bench::new();
    let out = bench.name("b");
    let refuses = |args: &[&str], words: &[&str]| {
        let line = nudge_fails(2, args);
        for word in words {
            assert!(line.contains(word), "{word:?} is not in: {line}");
        }
    };
    let empty = bench.name("empty");
    std::fs::create_dir(&empty).expect("folder");
    refuses(&["bench", &empty, "--out", &out], &["empty"]);
    refuses(&["bench", "/nowhere", "--out", &out], &["/nowhere"]);
    refuses(&["bench", &bench.set, "--policies", "mem,mems", "--out", &out], &["mems", "mem-no-push", "saturation"]);
    refuses(&["bench", &bench.set, &bench.set, "--belief", "classical", "--out", &out], &["small", "another set"]);
    assert!(!bench.path("b").exists(), "nothing was written");
    assert_eq!(nudge(&["bench", &bench.set, "--shard", "2/2", "--out", &out]).status.code(), Some(2));

    // One scene that is none: named, and the rest runs.
    std::fs::write(bench.path("small/torn.toml"), "format = 1\nname = \"torn\n").expect("write");
    let args = bench.args(&out, &["--seeds", "1"]);
    let args: Vec<&str> = args.iter().enumerate().filter(|(at, _)| ![6, 7].contains(at)).map(|(_, arg)| *arg).collect();
    let output = nudge(&args);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.lines().count() == 2 && stderr.lines().all(|line| line.contains("torn.toml: line 2")), "{stderr}");
    assert_eq!(files(&bench.path("b/episodes")).len(), 4);
    // Mended, it joins.
    std::fs::copy(bench.path("small/left.toml"), bench.path("small/torn.toml")).expect("mend");
    nudge_ok(&args);
    assert_eq!(files(&bench.path("b/episodes")).len(), 6);

    // The directory of another bench, and a result that is none.
    let mut other = args.clone();
    let at = other.iter().position(|arg| *arg == "--budget").expect("there");
    other[at + 1] = "5";
    refuses(&other, &[&out, "budget was 4, now it is 5"]);
    let episode = bench.path("b/episodes/small/left/mem-0.json");
    std::fs::write(&episode, "{").expect("tamper");
    refuses(&args, &["mem-0.json"]);
    let foreign = bench.name("foreign");
    std::fs::create_dir(&foreign).expect("folder");
    std::fs::write(bench.path("foreign/thesis.tex"), "years of work").expect("write");
    refuses(&bench.args(&foreign, &[]), &["foreign", "thesis.tex"]);
}

#[test]
fn the_gate_holds_what_was_blessed_and_trips_on_what_changed() {
    let bench = Bench::new();
    let golden = bench.name("golden.json");
    let document = serde_json::json!({
        "format": 1, "scenes": ["small/left.toml"], "policies": ["mem-no-push", "random"], "belief": "classical", "budget": 3,
    });
    std::fs::write(&golden, document.to_string()).expect("write");
    let gate = |more: &[&str]| {
        let mut args = vec!["regress", "--golden", &golden];
        args.extend(more);
        nudge(&args)
    };
    assert_eq!(gate(&[]).status.code(), Some(1), "nothing is expected yet");
    let said = text(&gate(&["--bless"]).stdout);
    assert!(said.contains("random semantic_miou") && said.contains("new"), "{said}");
    let output = gate(&[]);
    assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));

    let mut changed: Value = serde_json::from_str(&std::fs::read_to_string(&golden).expect("read")).expect("JSON");
    let score = &mut changed["scores"][0];
    let (name, tolerance) =
        (score["name"].as_str().expect("name").to_owned(), score["tolerance"].as_f64().expect("number"));
    score["golden"] = Value::from(score["golden"].as_f64().expect("number") + 1.5 * tolerance);
    std::fs::write(&golden, changed.to_string()).expect("write");
    let line = nudge_fails(1, &["regress", "--golden", &golden]);
    assert!(line.contains("1 of 20") && line.contains(&name), "{line}");
    let said = text(&gate(&["--bless"]).stdout);
    assert!(said.contains("was ") && gate(&[]).status.success(), "{said}");

    std::fs::write(&golden, "{ \"format\": 1,\n \"scene\": [] }").expect("write");
    assert!(nudge_fails(2, &["regress", "--golden", &golden]).contains("golden.json: line 2"));
    assert!(nudge_fails(2, &["regress", "--golden", "/nowhere.json"]).contains("/nowhere.json"));
}
