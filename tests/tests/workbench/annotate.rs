//! Notes, verdicts, and what leaves the program.

use super::window::Window;
use nudge::workbench::command::Command;
use nudge_core::score::Verdict;
use re_viewer::external::egui::accesskit::Role;
use re_viewer::external::egui::{Key, Modifiers, ViewportCommand};
use std::path::PathBuf;

/// What was exported, by its ending.
fn exported(window: &Window, is: impl Fn(&PathBuf) -> bool) -> PathBuf {
    let exports = window.folder.path().join("out/exports");
    let found = std::fs::read_dir(&exports).expect("exports").map(|entry| entry.expect("entry").path()).find(is);
    found.unwrap_or_else(|| panic!("nothing like that in {}", exports.display()))
}

#[test]
fn notes_and_verdicts_survive_export_and_reopening() {
    let mut window = Window::with_episode(2);
    window.click("Run");
    window.click("Step 1");
    window.type_into(Role::MultilineTextInput, "Note on step 1", "the box hides the can");
    window.click("Step 2");
    let object = window.session().record.steps[1].objects()[0].clone();
    let name = nudge::verdicts::object_name(&object);
    let other = if object.verdict == Verdict::NotFound { "found" } else { "not found" };
    window.click(&format!("Verdict on {name}"));
    window.click(other);
    let overruled = if other == "found" { Verdict::Found } else { Verdict::NotFound };
    assert_eq!(window.session().annotations.verdicts[&2][&name], overruled);
    assert!(window.sees("1 overruled") && window.session().unsaved);

    window.key(Modifiers::COMMAND, Key::E);
    window.click("Write");
    assert!(window.told("Exported to"), "{:?}", window.toasts());
    let directory = exported(&window, |path| path.is_dir());
    assert!(directory.with_extension("rrd").exists() && directory.join("notes.json").exists());
    let mut again = Window::new();
    again.open(&directory);
    let session = again.session();
    assert_eq!(session.annotations.notes[&1], "the box hides the can");
    assert_eq!(session.annotations.verdicts[&2][&name], overruled);
    assert_eq!(session.steps(), 2);
    assert!(again.sees("1 overruled"));
    // A second export proposes another place, and the first stays.
    window.key(Modifiers::COMMAND, Key::E);
    window.click("Write");
    assert!(directory.with_file_name(format!("{}-2", directory.file_name().expect("name").display())).exists());
}

#[test]
fn tables_are_written_as_csv() {
    let mut window = Window::with_episode(2);
    window.click("Run");
    window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::E);
    window.click("Write");
    let tables = exported(&window, |path| path.is_dir());
    for (name, rows) in [("scores.csv", 3), ("decisions.csv", 2)] {
        let text = std::fs::read_to_string(tables.join(name)).expect("a table");
        assert_eq!(text.lines().count(), rows + 1, "{name}");
    }
    let verdicts = std::fs::read_to_string(tables.join("verdicts.csv")).expect("a table");
    let objects = window.session().record.steps.iter().map(|step| step.objects().len()).sum::<usize>();
    assert_eq!(verdicts.lines().count(), objects + 1);
}

#[test]
fn an_export_is_cancelled_and_leaves_nothing() {
    let mut window = Window::with_quick_episode(12);
    window.click("Run");
    window.key(Modifiers::COMMAND, Key::E);
    window.press("Write");
    window.wait_for_label("Cancel: Exporting to");
    assert!(!window.closes(), "an export under way is unsaved work");
    window.press("Stay");
    window.click_first("Cancel: Exporting to");
    assert!(window.told("cancelled"), "{:?}", window.toasts());
    let left = std::fs::read_dir(window.folder.path().join("out/exports")).map_or(0, |entries| entries.count());
    assert_eq!(left, 0);
}

#[test]
fn quitting_with_unsaved_notes_asks_first() {
    let mut window = Window::with_episode(2);
    assert!(window.closes(), "nothing to lose");
    window.app().ask(Command::Note(0, "worth keeping".to_owned()));
    window.wait();
    assert!(!window.closes());
    window.harness.run_steps(2);
    assert!(window.sees("notes and verdicts of first-look"));
    window.press("Stay");
    assert!(window.app().dialog().is_none());
    assert!(!window.closes());
    window.harness.run_steps(2);
    window.press("Save and quit");
    let closed = (0..3).any(|_| {
        window.harness.step();
        window.commands().contains(&ViewportCommand::Close)
    });
    assert!(closed || window.closes());
    let notes = std::fs::read_to_string(window.path().join("notes.json")).expect("saved");
    assert!(notes.contains("worth keeping"));
}
