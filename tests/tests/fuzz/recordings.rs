//! Recordings, as far as the window looks at them before the viewer does; and what it keeps beside them.

use super::engine::Target;
use super::episodes::episode;
use nudge::annotations::Annotations;
use nudge::workbench::recording_file;

#[test]
fn recordings() {
    let (folder, path) = episode();
    let sound = std::fs::read(path.join("episode.rrd")).expect("a recording");
    let file = folder.path("changed.rrd");
    let words = ["RRF2", "ARROW", "END"];
    Target { name: "recording", sound: vec![sound], words: &words, inputs: 60 }.run(|bytes| {
        std::fs::write(&file, bytes).expect("written");
        recording_file::check(&file).is_ok()
    });
}

#[test]
fn notes() {
    let folder = nudge_tests::Folder::new();
    let sound =
        br#"{"format":1,"notes":{"0":"a","3":"b"},"verdicts":{"2":{"object 1 (tomato_can)":"found"}}}"#.to_vec();
    let target =
        Target { name: "notes.json", sound: vec![sound], words: &["null", "{}", "\"not_found\""], inputs: 200 };
    target.run(|bytes| {
        std::fs::write(folder.path("notes.json"), bytes).expect("written");
        Annotations::read(folder.path("notes.json").parent().expect("a folder")).is_ok()
    });
}
