//! Benches: the plan, and the result of an episode in the report.

use super::engine::Target;
use nudge::bench::BenchDir;
use nudge::report::{Results, markdown};
use nudge_tests::{Folder, TIN, nudge_ok, small_scene};
use std::path::PathBuf;

const WORDS: [&str; 10] = [
    "null",
    "[]",
    "{}",
    "\"shard\":{\"index\":0,\"count\":0},",
    "\"seeds\":1,",
    "\"name\":\"../../a\",",
    "\"id\":\"..\",",
    "\"broken\":[{\"set\":\"a\",\"id\":\"b\",\"error\":\"c\"}],",
    "\"tallies\":[],",
    "\"steps\":[],",
];

/// The directory of a small bench, in a folder of its own.
fn bench() -> (Folder, PathBuf) {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("set")).expect("folder");
    folder.write("set/tin.toml", small_scene(TIN));
    let set = folder.name("set");
    let out = folder.name("bench");
    let settings = ["--policies", "mem-no-push,random", "--belief", "classical", "--budget", "2", "--views", "real75"];
    nudge_ok(&[&["bench", &set, "--seeds", "1", "--jobs", "1", "--out", &out], &settings[..]].concat());
    let path = folder.path("bench");
    (folder, path)
}

#[test]
fn plans() {
    let (_folder, path) = bench();
    let document = path.join("bench.json");
    let sound = std::fs::read(&document).expect("a plan");
    Target { name: "bench.json", sound: vec![sound], words: &WORDS, inputs: 150 }.run(|file| {
        std::fs::write(&document, file).expect("written");
        let Ok((directory, plan)) = BenchDir::open(&path) else { return false };
        let _ = directory.missing(&plan);
        if let Ok(results) = Results::read(&path, true) {
            let _ = markdown(&results);
        }
        true
    });
}

#[test]
fn results() {
    let (_folder, path) = bench();
    let file = path.join("episodes/set/tin/random-0.json");
    let sound = std::fs::read(&file).expect("a result");
    Target { name: "result", sound: vec![sound], words: &WORDS, inputs: 150 }.run(|bytes| {
        std::fs::write(&file, bytes).expect("written");
        let Ok(results) = Results::read(&path, true) else { return false };
        markdown(&results).is_ok()
    });
}
