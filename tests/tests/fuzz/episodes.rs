//! Episodes: the document, what it says of other files, and going through its steps again.

use super::as_text;
use super::engine::Target;
use nudge_core::belief::Classical;
use nudge_core::episode::{EpisodeDir, EpisodeRecord, review};
use nudge_core::scene::Catalog;
use nudge_tests::{Folder, TIN, nudge_ok, small_scene};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const WORDS: [&str; 14] = [
    "null",
    "[]",
    "{}",
    "true",
    "NaN",
    "1e400",
    "{\"kind\":\"look\",\"view\":0},",
    "\"urdf\":{\"source\":\"a.urdf\",\"text\":\"<robot/>\"},",
    "\"steps\": [],",
    "\"mesh\":\"a\",",
    "\"budget\":0,",
    "\\u0000",
    "\"views\":\"nowhere.toml\",",
    "\"noise\":null,",
];

/// An array of two views.
const VIEWS: &str = "format = 1\nname = \"two\"\n\
    camera = { width = 64, height = 48, focal_px = 60.0, depth_range_m = [0.07, 1.5] }\nlayout = [2, 1, 1]\nviews = [\n\
    { position = [0.0, -0.3, 0.3], target = [0.0, 0.1, 0.05], slot = [0, 0, 0] },\n\
    { position = [0.1, -0.3, 0.3], target = [0.0, 0.1, 0.05], slot = [1, 0, 0] },\n]\n";

/// The directory of a short episode, in a folder of its own.
pub fn episode() -> (Folder, PathBuf) {
    let folder = Folder::new();
    let objects = format!("{TIN}[[object]]\nclass = \"gelatin_box\"\nposition = [0.0, 0.04]\n");
    let scene = folder.write("scene.toml", small_scene(&objects));
    // Few views, since getting ready takes the arm to each.
    let views = folder.write("views.toml", VIEWS);
    let policy = ["--policy", "random", "--belief", "classical", "--seed", "3", "--budget", "4"];
    nudge_ok(&[&["run", &scene, "--views", &views, "--out", &folder.name("e")], &policy[..]].concat());
    let path = folder.path("e");
    (folder, path)
}

#[test]
fn documents() {
    let (_folder, path) = episode();
    let document = path.join("episode.json");
    let sound = std::fs::read(&document).expect("a document");
    let target = Target { name: "episode.json", sound: vec![sound], words: &WORDS, inputs: 300 };
    target.run(|file| {
        if EpisodeRecord::from_json(&as_text(file), Path::new("episode.json")).is_err() {
            return false;
        }
        std::fs::write(&document, file).expect("written");
        let _ = EpisodeDir::state(&path);
        let Ok(directory) = EpisodeDir::open(&path) else { return false };
        let record = directory.record().expect("it was opened");
        for done in 0..=record.steps.len() {
            let _ = (directory.read_belief(done), directory.read_truth(done));
        }
        true
    });
}

#[test]
fn reviews() {
    let (_folder, path) = episode();
    let document = path.join("episode.json");
    let sound = std::fs::read(&document).expect("a document");
    let catalog = Arc::new(Catalog::standard());
    Target { name: "review", sound: vec![sound], words: &WORDS, inputs: 12 }.run(|file| {
        if EpisodeRecord::from_json(&as_text(file), Path::new("episode.json")).is_err() {
            return false;
        }
        std::fs::write(&document, file).expect("written");
        let absent = review(&path, catalog.clone(), None, &mut |_, _| Ok(()));
        let repeated = review(&path, catalog.clone(), Some(Arc::new(Classical)), &mut |_, _| Ok(()));
        absent.is_ok() && repeated.is_ok()
    });
}
