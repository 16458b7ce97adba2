//! Menus, help, themes, and what every control says of itself.

use super::window::Window;
use egui_kittest::kittest::{NodeT, Queryable};
use nudge::workbench::command::Command;
use nudge::workbench::model::{LayoutKind, Picked};
use re_viewer::external::egui::accesskit::Role;
use re_viewer::external::egui::{Key, Modifiers};

#[test]
fn an_empty_window_says_what_to_do() {
    let mut window = Window::new();
    window.harness.run_steps(3);
    assert!(window.sees("Open path") && window.sees("Choose a scene"));
    assert!(window.sees("No episode is open"));
}

#[test]
fn help_and_about_open_and_close() {
    let mut window = Window::new();
    window.key(Modifiers::NONE, Key::F1);
    assert!(window.sees("Keyboard shortcuts") && window.sees("Branch from here"));
    window.key(Modifiers::NONE, Key::Escape);
    assert!(!window.sees("Branch from here"), "the sheet is closed");
    window.press("Help");
    window.press("About Nudge");
    assert!(window.sees("Rerun viewer") && window.sees("0.36.3") && window.sees("rustc"));
    window.key(Modifiers::NONE, Key::Escape);
    assert!(!window.sees("Rerun viewer"));
}

#[test]
fn the_theme_changes_and_shifted_shortcuts_are_not_taken_for_plain_ones() {
    let mut window = Window::with_episode(2);
    let light = window.model().kept.light;
    window.key(Modifiers::COMMAND, Key::L);
    assert_ne!(window.model().kept.light, light);
    window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::E);
    assert!(window.sees("Write scores, decisions and verdicts as CSV"), "not the export of the episode");
    window.key(Modifiers::NONE, Key::Escape);
    assert!(window.app().dialog().is_none());
}

#[test]
fn a_letter_typed_into_a_note_is_no_shortcut() {
    let mut window = Window::with_episode(2);
    window.type_into(Role::MultilineTextInput, "Note on the prior", "d");
    window.key(Modifiers::NONE, Key::D);
    assert!(window.session().pending.is_none());
    assert_eq!(window.session().annotations.notes[&0], "d");
}

/// Roles of what a person can operate.
const CONTROLS: [Role; 7] = [
    Role::Button,
    Role::CheckBox,
    Role::ComboBox,
    Role::MultilineTextInput,
    Role::Slider,
    Role::SpinButton,
    Role::TextInput,
];

#[test]
fn every_control_of_every_layout_has_a_name() {
    let mut window = Window::with_pushes(3);
    window.click("Decide");
    window.click("Do it");
    window.app().ask(Command::Branch);
    window.wait();
    let first = window.model().sessions[0].id;
    window.app().model.other = Some(first);
    window.app().model.picked = Some(Picked::Cell(5_000));
    let mut nameless = Vec::new();
    for layout in LayoutKind::ALL {
        window.app().ask(Command::Layout(layout));
        window.wait();
        for node in window.harness.query_all_by(|node| CONTROLS.contains(&node.role())) {
            let node = node.accesskit_node();
            let label = node.label().or_else(|| node.placeholder().map(str::to_owned)).unwrap_or_default();
            let is_named = label.chars().any(char::is_alphanumeric);
            if !is_named && node.labelled_by().next().is_none() {
                nameless.push(format!("{layout:?}: {:?} {label:?} {:?}", node.role(), node.value()));
            }
        }
    }
    assert!(nameless.is_empty(), "{nameless:#?}");
}

/// Shorthand that nobody can look up on the window.
const SHORTHAND: [&str; 6] = ["A|B", "·IGV", "vacuity", "ρ", "worn", "gone on with"];

#[test]
fn no_text_on_the_window_is_shorthand() {
    let mut window = Window::with_quick_episode(2);
    window.click("Run");
    window.click("Branch from here");
    window.app().model.picked = Some(Picked::Cell(5_000));
    let mut found = Vec::new();
    for layout in LayoutKind::ALL {
        window.app().ask(Command::Layout(layout));
        window.wait();
        for node in window.harness.query_all_by(|_| true) {
            let label = node.accesskit_node().label().unwrap_or_default();
            found
                .extend(SHORTHAND.iter().filter(|word| label.contains(**word)).map(|_| format!("{layout:?}: {label}")));
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}
