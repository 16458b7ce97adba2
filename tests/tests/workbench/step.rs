//! Opening, stepping, going back and branching.

use super::window::{SCENE, Window};
use egui_kittest::kittest::Queryable;
use nudge::workbench::command::Command;
use nudge::workbench::session::Activity;
use nudge_core::camera::ViewId;
use nudge_core::plan::{Action, Reason};
use nudge_tests::root;
use re_viewer::external::egui::{self, Key, Modifiers};
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[test]
fn a_scene_is_chosen_by_its_card_and_started() {
    let mut window = Window::new();
    window.wait_for_label("first-look, ");
    // The number of hidden objects is counted in the background.
    window.wait_for_label("hidden");
    window.click_first("first-look, ");
    window.app().model.kept.form.budget = 3;
    window.click("Start");
    assert_eq!((window.session().record.scene.name.as_str(), window.steps()), ("first-look", 0));
    // Back to the scenes, and from there to the episode.
    window.key(Modifiers::COMMAND, Key::N);
    assert!(window.sees("behind-the-boxes"));
    window.key(Modifiers::NONE, Key::Escape);
    assert!(!window.sees("behind-the-boxes") && window.sees("Decide"));
}

#[test]
fn open_decide_do_and_run() {
    let mut window = Window::with_episode(4);
    assert_eq!(window.steps(), 0);
    assert!(window.harness.query_by_label("first-look").is_some());
    window.click("Decide");
    let decision = window.session().pending.clone().expect("a decision");
    assert_eq!(decision.gains.len(), 300);
    assert!(window.sees("Look (IGV)") && window.sees("Best views"));
    window.click("Do it");
    assert_eq!((window.steps(), window.model().cursor), (1, 1));
    assert_eq!(window.session().record.steps[0].action, decision.action);
    window.click("Run");
    assert_eq!(window.steps(), 4);
    let session = window.session();
    assert!(session.is_finished() && session.activity == Activity::Idle);
    assert!(session.moments[4].entropy_nats < session.moments[0].entropy_nats);
    let written = window.path();
    assert!(written.join("episode.json").exists() && written.join("beliefs/004.npz").exists());
    // The window closes the episode's recording and draws its figure before it is gone.
    let folder = window.close();
    assert!(written.starts_with(folder.path()) && written.join("summary.png").exists());
}

#[test]
fn tables_are_sorted_rows_light_up_and_another_view_is_looked_from() {
    let mut window = Window::with_episode(3);
    window.click("Decide");
    let best = window.session().pending.clone().expect("a decision").action;
    window.hover_first(", gain ");
    let hovered = window.model().hovered;
    assert!(matches!(hovered, nudge::workbench::model::Hovered::View(_)), "{hovered:?}");
    // Falling by gain at first; by number after a click on that heading, the largest first.
    let listed = |window: &Window| -> Vec<String> {
        let rows = window.harness.query_all_by_label_contains(", gain ");
        rows.filter_map(|row| egui_kittest::kittest::NodeT::accesskit_node(&row).label()).collect()
    };
    let by_gain = listed(&window);
    assert!(by_gain.len() >= 3, "{by_gain:?}");
    window.click_first("Sort by View");
    let numbers: Vec<u32> = listed(&window)
        .iter()
        .map(|row| row.trim_start_matches("View ").split(',').next().and_then(|n| n.parse().ok()).expect("a number"))
        .collect();
    assert!(numbers.is_sorted_by(|a, b| a >= b), "{numbers:?}");
    let other = numbers.iter().copied().map(|n| ViewId(n as u16)).find(|view| best != Action::Look { view: *view });
    let other = other.expect("another view");
    window.click_first(&format!("View {}, gain", other.0));
    window.click("Look from here");
    let step = &window.session().record.steps[0];
    assert_eq!((step.action, step.decision.reason), (Action::Look { view: other }, Reason::Manual));
    assert_eq!(step.decision.gains.len(), 300, "what was weighed is kept");
}

#[test]
fn a_run_is_paused_and_cancelled_and_goes_on() {
    let mut window = Window::with_quick_episode(30);
    window.press("Run");
    window.wait_for("a step", |app| app.model.session().is_some_and(|session| session.steps() >= 1));
    assert!(window.sees("running"));
    window.click("Pause");
    let paused = window.steps();
    assert!((1..30).contains(&paused) && window.session().pending.is_none(), "a pause comes after an action");
    window.press("Run");
    window.wait_for("a step", |app| app.model.session().is_some_and(|session| session.steps() > paused));
    window.click("Cancel");
    let done = window.steps();
    assert!(done > paused && done < 30, "the run was not cancelled");
    window.app().ask(Command::Decide);
    window.wait();
    window.click("Do it");
    assert_eq!(window.steps(), done + 1);
}

#[test]
fn rewind_and_branch_keep_both_open() {
    let mut window = Window::with_episode(4);
    window.click("Run");
    window.click("Step 2");
    assert_eq!(window.model().cursor, 2);
    window.key(Modifiers::NONE, Key::Comma);
    assert_eq!(window.model().cursor, 1);
    window.key(Modifiers::NONE, Key::Home);
    assert_eq!(window.model().cursor, 0);
    window.key(Modifiers::NONE, Key::End);
    window.key(Modifiers::NONE, Key::Comma);
    window.key(Modifiers::NONE, Key::Comma);
    assert_eq!(window.model().cursor, 2);
    window.click("Branch from here");
    let model = window.model();
    assert_eq!(model.sessions.len(), 2);
    let (old, new) = (&model.sessions[0], &model.sessions[1]);
    assert_eq!((old.steps(), new.steps()), (4, 2));
    assert_eq!(model.shown, Some(new.id));
    assert_eq!(old.record.steps[1].action, new.record.steps[1].action);
    assert!(old.moments[2].belief == new.moments[2].belief, "the shared prefix is the same to the bit");
    assert_ne!(old.path, new.path);
    window.click("Decide");
    window.click("Do it");
    assert_eq!(window.steps(), 3);
}

#[test]
fn an_episode_reopens_where_it_was_left_and_goes_on() {
    let mut window = Window::with_episode(3);
    window.click("Decide");
    window.click("Do it");
    let path = window.path();
    let folder = window.close();
    let mut again = Window::new();
    again.open(&path);
    assert_eq!((again.steps(), again.session().read_only.as_deref()), (1, None));
    // Closing it and opening it again from the recent files waits for its recording to be whole.
    again.key(Modifiers::COMMAND, Key::W);
    assert!(again.model().sessions.is_empty());
    again.app().ask(Command::Open(path.clone()));
    again.wait();
    assert_eq!(again.session().read_only.as_deref(), None);
    // Opening what is open shows it.
    again.open(&path.join("episode.json"));
    assert_eq!(again.model().sessions.len(), 1);
    again.click("Run");
    assert_eq!(again.steps(), 3);
    drop(folder);
}

#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

#[test]
fn a_scene_is_dropped_on_the_window_and_remembered() {
    let mut window = Window::new();
    let scene = root().join(SCENE);
    window.harness.input_mut().dropped_files.push(Arc::new(Dropped(scene.clone())));
    window.wait();
    assert_eq!(window.session().record.scene.name, "first-look");
    assert_eq!(window.model().kept.recent, [scene]);
    window.click("File");
    window.harness.get_by_label_contains("Open recent").hover();
    window.wait_for_label("first-look.toml");
}

#[test]
fn broken_files_become_messages_that_name_them() {
    let mut window = Window::new();
    let broken = window.folder.path().join("broken.toml");
    std::fs::write(&broken, "format = 1\nname = \"x\n").expect("written");
    window.open(&broken);
    assert!(window.told("broken.toml") && window.told("line 2"), "{:?}", window.toasts());
    window.open(Path::new("/nowhere/at/all"));
    assert!(window.told("/nowhere/at/all"));
    let episode = window.folder.path().join("cut");
    std::fs::create_dir(&episode).expect("made");
    std::fs::write(episode.join("episode.json"), "{ \"format\": 1, \"sce").expect("written");
    window.open(&episode);
    assert!(window.told("episode.json"), "{:?}", window.toasts());
    assert!(window.model().sessions.is_empty());
    assert!(window.sees("Error:"), "a message is not told by colour alone");
}

#[test]
fn an_order_that_cannot_be_carried_out_leaves_the_episode_as_it_was() {
    let mut window = Window::with_episode(3);
    window.click("Decide");
    window.app().ask(Command::DoInstead(Action::Look { view: ViewId(9_999) }));
    window.wait();
    assert!(window.told("9999"), "{:?}", window.toasts());
    assert_eq!(window.steps(), 0);
    window.click("Run");
    assert_eq!(window.steps(), 3);
}
