//! Keys and files act on what is in sight, and what cannot be shown leaves everything where it was.

use super::window::Window;
use nudge::workbench::model::LayoutKind;
use re_viewer::external::egui::{Key, Modifiers};
use std::path::PathBuf;

/// A window with an episode behind the scenes to choose from.
fn browsing() -> Window {
    let mut window = Window::with_quick_episode(3);
    window.key(Modifiers::COMMAND, Key::N);
    window.wait_for_label("behind-the-boxes");
    assert!(window.model().browsing);
    window
}

#[test]
fn keys_do_not_act_on_an_episode_behind_the_browser() {
    let mut window = browsing();
    for (modifiers, key) in [
        (Modifiers::NONE, Key::D),
        (Modifiers::NONE, Key::Enter),
        (Modifiers::NONE, Key::Enter),
        (Modifiers::COMMAND, Key::R),
        (Modifiers::COMMAND, Key::B),
        (Modifiers::COMMAND, Key::W),
    ] {
        window.key(modifiers, key);
    }
    assert_eq!((window.model().sessions.len(), window.steps()), (1, 0));
    assert!(window.session().pending.is_none() && window.model().browsing);
    assert!(!window.path().join("beliefs/001.npz").exists(), "nothing was written");
    // Back in sight it listens again.
    window.key(Modifiers::NONE, Key::Escape);
    window.key(Modifiers::NONE, Key::D);
    assert!(window.session().pending.is_some());
    window.key(Modifiers::NONE, Key::Enter);
    assert_eq!(window.steps(), 1);
}

#[test]
fn a_broken_file_opened_from_the_browser_leaves_one_there_and_is_not_recent() {
    let mut window = browsing();
    let recent = window.model().kept.recent.clone();
    let folder = window.folder.path().to_owned();
    let episode = folder.join("cut");
    std::fs::create_dir(&episode).expect("made");
    std::fs::write(episode.join("episode.json"), "{ \"format\": 1, \"sce").expect("written");
    let recording: PathBuf = folder.join("cut.rrd");
    let whole = std::fs::read(window.path().join("episode.rrd")).expect("the episode's recording");
    std::fs::write(&recording, &whole[..300]).expect("written");
    for (path, words) in [(&episode, "episode.json"), (&recording, "cut.rrd: is cut short after")] {
        window.open(path);
        assert!(window.told(words), "{:?}", window.toasts());
        assert!(window.model().browsing && window.sees("behind-the-boxes"), "{}", path.display());
        assert_eq!(window.model().recording, None);
    }
    assert_eq!(window.model().kept.recent, recent);
    // What can be opened is, and becomes recent.
    let path = window.path();
    window.open(&path);
    assert!(!window.model().browsing);
    assert_eq!(window.model().kept.recent[0], path);
}

#[test]
fn the_browser_can_be_reached_from_a_recording() {
    let mut window = Window::with_quick_episode(2);
    for key in [Key::N, Key::Escape] {
        // As if there were a graphics driver to show it; opening it closes the browser.
        window.app().model.recording = Some("some.rrd".into());
        window.app().model.browsing = false;
        window.harness.run_steps(2);
        assert!(window.sees("Back to the episode") && window.sees("press Esc to see it"));
        window.key(if key == Key::N { Modifiers::COMMAND } else { Modifiers::NONE }, key);
        assert_eq!(window.model().recording, None, "{key:?}");
        assert_eq!(window.model().browsing, key == Key::N);
    }
    window.app().model.recording = Some("some.rrd".into());
    window.harness.run_steps(2);
    window.layout(LayoutKind::Why);
    assert_eq!(window.model().recording, None);
}

#[test]
fn left_and_right_step_through_the_episode() {
    let mut window = Window::with_quick_episode(2);
    window.click("Run");
    assert_eq!(window.model().cursor, 2);
    window.key(Modifiers::NONE, Key::ArrowLeft);
    window.key(Modifiers::NONE, Key::ArrowLeft);
    window.key(Modifiers::NONE, Key::ArrowLeft);
    assert_eq!(window.model().cursor, 0);
    window.key(Modifiers::NONE, Key::ArrowRight);
    assert_eq!(window.model().cursor, 1);
    // Not while something is typed.
    window.type_into(re_viewer::external::egui::accesskit::Role::MultilineTextInput, "Note on step 1", "ab");
    window.key(Modifiers::NONE, Key::ArrowLeft);
    assert_eq!(window.model().cursor, 1);
}

#[test]
fn a_comparison_begins_with_the_only_other_episode() {
    let mut window = Window::with_quick_episode(2);
    let first = window.session().id;
    window.click("Branch from here");
    assert_eq!(window.model().other, None);
    window.layout(LayoutKind::Compare);
    assert_eq!(window.model().other, Some(first));
    assert!(window.sees("The actions so far are the same"));
}
