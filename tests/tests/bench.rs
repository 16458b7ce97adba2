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

/// Changes a JSON document.
fn edit(path: &Path, change: impl FnOnce(&mut Value)) {
    let mut document = document(path);
    change(&mut document);
    std::fs::write(path, document.to_string()).expect("written");
}

fn document(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("read")).expect("JSON")
}

#[test]
fn a_bench_names_what_made_it_and_is_not_gone_on_with_otherwise() {
    let bench = Bench::new();
    let out = bench.name("b");
    bench.run("b", &[]);
    let file = bench.path("b/bench.json");
    let whole = document(&file);
    let made_by = &whole["made_by"];
    assert_eq!((&made_by["version"], &made_by["planner"]), (&whole["version"], &whole["planner"]));
    assert!(made_by["commit"].as_str().is_some_and(|commit| commit.len() == 40 || commit == "unknown"), "{made_by}");
    assert_eq!(made_by["method"].as_str().map(str::len), Some(64));
    assert!(made_by["threads"].as_u64().is_some_and(|threads| threads > 0) && made_by.get("weights").is_none());
    let episode = "b/episodes/small/left/mem-0.json";
    assert_eq!(document(&bench.path(episode))["made_by"], made_by["fingerprint"]);

    // An unfinished bench of other weights, of other code, or with other settings.
    std::fs::remove_file(bench.path(episode)).expect("removed");
    let refused = |more: &[&str], words: &str| {
        let before = std::fs::read(&file).expect("read");
        let line = nudge_fails(2, &bench.args(&out, more));
        assert!(line.contains(words) && line.contains("--allow-mixed"), "{line}");
        assert!(std::fs::read(&file).expect("read") == before && !bench.path(episode).exists());
    };
    refused(&["--patience", "3"], "--patience was 1, now it is 3");
    edit(&file, |bench| bench["made_by"]["method"] = "0".repeat(64).into());
    refused(&[], "the method's source was 000000000000, now it is ");
    edit(&file, |bench| {
        *bench = whole.clone();
        bench["made_by"]["weights"] = serde_json::json!({ "sigma_o": "0".repeat(64) });
    });
    refused(&[], "the weights sigma_o were 000000000000, now they are absent");
    edit(&file, |bench| drop(bench.as_object_mut().expect("an object").remove("made_by")));
    refused(&[], "some of the results do not tell what made them");

    // Another commit with the same code of the method goes on, and threads are nobody's business.
    edit(&file, |bench| {
        *bench = whole.clone();
        bench["made_by"]["commit"] = "0".repeat(40).into();
        bench["made_by"]["threads"] = 99.into();
    });
    nudge_ok(&bench.args(&out, &[]));
    let also = document(&file)["also_made_by"].clone();
    assert!(also[0]["mixed"] == false && also.as_array().map(Vec::len) == Some(1), "{also}");

    // Who insists is noted, in bench.json, in the result and in the report.
    edit(&file, |bench| *bench = whole.clone());
    std::fs::remove_file(bench.path(episode)).expect("removed");
    let said = nudge(&bench.args(&out, &["--patience", "3", "--allow-mixed"]));
    let warning = text(&said.stderr);
    let words = "--patience was 1, now it is 3";
    assert!(said.status.success() && warning.starts_with("warning: ") && warning.contains(words), "{warning}");
    let also = document(&file)["also_made_by"][0].clone();
    assert!(also["mixed"] == true && also["differs"][0] == words, "{also}");
    assert_eq!(document(&bench.path(episode))["made_by"], also["made_by"]["fingerprint"]);
    assert_ne!(also["made_by"]["fingerprint"], made_by["fingerprint"]);
    let markdown = nudge_ok(&["report", &out, "--markdown"]);
    assert!(markdown.contains("**Mixed: ") && markdown.contains(words), "{markdown}");
    nudge_ok(&["report", &out]);
    let page = std::fs::read_to_string(bench.path("b/report/index.html")).expect("page");
    assert!(page.contains("class=\"warning\">Mixed: "));
    // A result of a maker that the bench does not know belongs to another bench.
    edit(&bench.path(episode), |result| result["made_by"] = "0123456789abcdef".into());
    assert!(nudge_fails(2, &["report", &out]).contains("mem-0.json"));
}

#[test]
fn shards_made_otherwise_merge_only_when_told() {
    let bench = Bench::new();
    for shard in ["0/2", "1/2"] {
        bench.run(&format!("part-{}", &shard[..1]), &["--shard", shard]);
    }
    let parts = ["part-0", "part-1"].map(|part| bench.name(part));
    // Other threads, and a checkout with changes: as one run all the same.
    edit(&bench.path("part-1/bench.json"), |plan| {
        plan["made_by"]["threads"] = 99.into();
        plan["made_by"]["dirty"] = Value::from(plan["made_by"]["dirty"] != true);
    });
    bench.run("whole", &[]);
    nudge_ok(&["bench", "merge", &parts[1], &parts[0], "--out", &bench.name("merged")]);
    let read = |name: &str| std::fs::read(bench.path(name)).expect("bench.json");
    assert!(read("merged/bench.json") == read("whole/bench.json"));

    edit(&bench.path("part-1/bench.json"), |plan| plan["made_by"]["method"] = "0".repeat(64).into());
    let mixed = bench.name("mixed");
    let words = ["bench", "merge", &parts[0], &parts[1], "--out", &mixed];
    let line = nudge_fails(2, &words);
    let difference = "the method's source was ";
    assert!(line.contains("part-1") && line.contains(difference) && line.contains("--allow-mixed"), "{line}");
    assert!(!bench.path("mixed").exists());
    nudge_ok(&[&words[..], &["--allow-mixed"]].concat());
    let also = document(&bench.path("mixed/bench.json"))["also_made_by"].clone();
    assert!(also[0]["mixed"] == true && also[0]["made_by"]["method"] == "0".repeat(64), "{also}");
    assert_eq!(files(&bench.path("mixed/episodes")), files(&bench.path("whole/episodes")));
}

/// The rows of the Markdown table whose header has a title, by their first cell, as a map of titles to cells.
fn table(markdown: &str, title: &str) -> BTreeMap<String, BTreeMap<String, String>> {
    let cells = |line: &str| -> Vec<String> {
        line.trim_matches('|').split('|').map(|cell| cell.trim().replace(['*', '`'], "")).collect()
    };
    let mut lines =
        markdown.lines().skip_while(|line| !(line.starts_with('|') && cells(line).iter().any(|c| c == title)));
    let titles = cells(lines.next().unwrap_or_else(|| panic!("no table with {title} in {markdown}")));
    let rule = lines.next().expect("a rule");
    assert_eq!(rule, format!("|{}", "---|".repeat(titles.len())));
    let rows = lines.take_while(|line| line.starts_with('|')).map(cells);
    rows.map(|row| {
        assert_eq!(row.len(), titles.len(), "{row:?}");
        (row[0].clone(), titles.iter().cloned().zip(row).collect())
    })
    .collect()
}

/// The number that a cell begins with.
fn number(cell: &str) -> f64 {
    cell.split(' ').next().and_then(|word| word.parse().ok()).unwrap_or_else(|| panic!("no number: {cell}"))
}

#[test]
fn markdown_tells_the_figures_of_json_and_of_the_page() {
    let bench = Bench::new();
    bench.run("b", &[]);
    let out = bench.name("b");
    let summary: Value = serde_json::from_str(&nudge_ok(&bench.args(&out, &["--json"]))).expect("JSON");
    let markdown = nudge_ok(&["report", &out, "--markdown"]);
    assert!(!bench.path("b/report").exists(), "Markdown is printed, not written");
    let (scores, actions) = (table(&markdown, "IoU at 4"), table(&markdown, "revealed"));
    let differences = table(&markdown, "mem against");
    let rows = summary["summary"].as_array().expect("rows");
    assert_eq!((rows.len(), scores.len(), actions.len(), differences.len()), (2, 2, 2, 1));
    let near = |cell: &str, value: &Value, within: f64| {
        let value = value.as_f64().expect("a number");
        assert!((number(cell) - value).abs() <= within, "{cell} is not {value}");
    };
    for row in rows {
        let policy = row["policy"].as_str().expect("policy");
        near(&scores[policy]["IoU at 4"], &row["occupancy_iou"], 0.000_51);
        near(&scores[policy]["mIoU at 4"], &row["semantic_miou"], 0.000_51);
        near(&actions[policy]["pushes per episode"], &row["pushes"], 0.051);
        near(&actions[policy]["episodes"], &row["episodes"], 0.0);
        match row["revealed"].as_f64() {
            Some(share) => near(&actions[policy]["revealed"], &Value::from(100.0 * share), 0.51),
            None => assert_eq!(actions[policy]["revealed"], "-"),
        }
        assert!(scores[policy]["IoU at 2"].contains('[') && actions[policy].contains_key("drops"));
    }
    let of = |at: usize, score: &str| rows[at][score].as_f64().expect("a score");
    assert_eq!(rows[0]["policy"], "mem");
    near(&differences["random"]["IoU at 4"], &Value::from(of(0, "occupancy_iou") - of(1, "occupancy_iou")), 0.000_51);
    near(&differences["random"]["mIoU at 4"], &Value::from(of(0, "semantic_miou") - of(1, "semantic_miou")), 0.000_51);

    // The page has the same cells, and both say what made them.
    let said = nudge(&["report", &out]);
    assert!(said.status.success());
    let page = std::fs::read_to_string(text(&said.stdout).trim()).expect("the page that was named");
    let cells = [&scores, &actions, &differences].into_iter().flat_map(BTreeMap::values).flat_map(BTreeMap::values);
    for cell in cells {
        let figure = cell.split(' ').next().unwrap_or_default();
        let note = cell.find(['(', '[']).map_or("", |at| &cell[at..]);
        assert!(page.contains(&format!(">{figure}")) && page.contains(note), "{cell} is not on the page");
    }
    let made_by = document(&bench.path("b/bench.json"))["made_by"].clone();
    let told = text(&said.stderr);
    for fact in [&made_by["commit"], &made_by["method"], &made_by["version"]] {
        let fact = fact.as_str().expect("text");
        for place in [&page, &markdown, &told] {
            assert!(place.contains(fact), "{fact} is not in {place}");
        }
    }
    let settings = table(&markdown, "made by")["settings"].clone();
    assert!(settings.values().any(|cell| cell.contains("candidates 10, ") && cell.contains("patience 1, ")));
    assert!(told.contains("candidates 10, ") && page.contains("candidates 10, "), "{told}");
}
