//! A scene in the making.

use super::window::{SCENE, Window};
use egui_kittest::kittest::{NodeT, Queryable};
use nudge::workbench::model::LayoutKind;
use nudge_core::scene::{Catalog, Scene};
use nudge_tests::root;
use re_viewer::external::egui::{Key, Modifiers};
use std::path::Path;

/// A window whose scenes are an empty folder of its own.
fn window() -> Window {
    let scenes = tempfile::tempdir().expect("folder").keep();
    let mut window = Window::with_scenes(&scenes);
    window.layout(LayoutKind::Author);
    window
}

fn objects(window: &Window) -> usize {
    window.model().author.scene().objects.len()
}

#[test]
fn a_scene_is_authored_with_undo_and_redo_saved_and_tried() {
    let mut window = window();
    window.click("Add tomato can");
    window.click("Add cracker box");
    assert_eq!(objects(&window), 2);
    window.click("Undo");
    assert_eq!(objects(&window), 1);
    window.click("Redo");
    window.key(Modifiers::COMMAND, Key::Z);
    window.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(objects(&window), 0);
    window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(objects(&window), 2);
    // The keyboard's focus on an object chooses it.
    let board = |node: &egui_kittest::Node<'_>| node.accesskit_node().toggled().is_some();
    window.harness.query_all_by_label_contains("cracker_box#1").find(board).expect("on the board").focus();
    window.harness.run_steps(3);
    window.click("Rotate");
    window.click("Duplicate");
    assert_eq!(objects(&window), 3);
    window.click("Delete");
    assert_eq!(objects(&window), 2);
    window.wait_for_label("hidden of 2");

    window.key(Modifiers::COMMAND, Key::S);
    window.click("Write");
    let path = window.model().author.path().expect("saved").to_owned();
    let (scene, _) = Scene::load(&path, &Catalog::standard()).expect("a sound scene");
    assert_eq!(scene.objects.len(), 2);
    let text = std::fs::read_to_string(&path).expect("text");
    assert_eq!(text.matches("[[object]]").count(), 2, "{text}");

    window.app().model.kept.form.budget = 2;
    window.click("Try it");
    assert_eq!(window.session().record.scene.objects.len(), 2);
    window.click("Run");
    assert_eq!(window.steps(), 2);
}

#[test]
fn a_scene_is_opened_in_the_editor_generated_around_and_kept_from_loss() {
    let mut window = window();
    window.open(&root().join(SCENE));
    let before = objects(&window);
    assert!(before > 0 && window.model().sessions.is_empty(), "in the editor a scene is opened to edit");
    window.click("Generate");
    window.wait_for("generated", |app| !app.model.author.is_generating());
    window.harness.run_steps(3);
    assert!(objects(&window) > before && window.model().author.is_sound());
    assert!(window.told("objects added"), "{:?}", window.toasts());
    window.open(Path::new(&root().join("scenes/demo/mixed-shelf.toml")));
    assert!(window.told("has changes"), "{:?}", window.toasts());
    assert!(!window.closes(), "a changed scene is unsaved work");
    window.harness.run_steps(2);
    assert!(window.sees("the scene first-look"));
    window.press("Stay");
    window.click("Undo");
    assert_eq!(objects(&window), before);
    assert!(window.closes());
}

#[test]
fn overlaps_are_named_at_once_and_an_episodes_scene_is_edited_as_a_copy() {
    let mut window = Window::with_episode(2);
    window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::D);
    assert_eq!(window.model().kept.layout, LayoutKind::Author);
    let count = window.session().record.scene.objects.len();
    assert_eq!((objects(&window), window.model().author.path()), (count, None));
    let author = &mut window.app().model.author;
    let first = author.scene().objects[0].clone();
    author.add_at(&first.class, first.position);
    window.wait();
    assert!(window.sees("overlaps ") && !window.model().author.is_sound());
    assert!(window.harness.get_by_label("Try it").rect().width() > 0.0);
    assert_eq!(window.session().record.scene.objects.len(), count, "the episode's own scene stays");
}
