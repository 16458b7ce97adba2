//! Random changes of every kind of file that the program reads: whatever stands in it, it is read or refused, soon and in
//! little memory.
//!
//! An ordinary run gives each reader the same few hundred inputs; `make fuzz` many more, and prints how many were taken,
//! refused and read a second. What was found once has a test of its own, named after what was seen.

#[path = "fuzz/archives.rs"]
mod archives;
#[path = "fuzz/benches.rs"]
mod benches;
#[path = "fuzz/change.rs"]
mod change;
#[path = "fuzz/engine.rs"]
mod engine;
#[path = "fuzz/episodes.rs"]
mod episodes;
#[path = "fuzz/foreign.rs"]
mod foreign;
#[path = "fuzz/maps.rs"]
mod maps;
#[path = "fuzz/meshes.rs"]
mod meshes;
#[cfg(feature = "workbench")]
#[path = "fuzz/recordings.rs"]
mod recordings;
#[path = "fuzz/texts.rs"]
mod texts;

/// A file as text; what is no UTF-8 is replaced, since these readers are given text.
fn as_text(file: &[u8]) -> std::borrow::Cow<'_, str> {
    String::from_utf8_lossy(file)
}

/// The shipped scenes, as files have them.
fn shipped_scenes() -> Vec<Vec<u8>> {
    let mut scenes = Vec::new();
    for folder in ["demo", "high", "low", "ood"] {
        let folder = nudge_tests::root().join("scenes").join(folder);
        let entries = std::fs::read_dir(&folder).expect("the shipped scenes");
        let mut paths: Vec<_> = entries.map(|entry| entry.expect("listed").path()).collect();
        paths.retain(|path| path.extension().is_some_and(|kind| kind == "toml"));
        paths.sort();
        scenes.extend(paths.iter().map(|path| std::fs::read(path).expect("a scene")));
    }
    scenes
}
