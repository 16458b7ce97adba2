//! What only happens when something breaks, driven through the window. The rest is tested from outside, in `tests/`.

use super::{App, Chosen, ChosenFor, FormOptions, Options};
use crate::workbench::command::{Command, MenuCommand};
use crate::workbench::dialog::Dialog;
use crate::workbench::model::{LayoutKind, StartForm};
use crate::workbench::part::Part;
use crate::workbench::session::Activity;
use crate::workbench::worker::Order;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use nudge_core::belief::CLASSICAL;
use nudge_core::camera::NoiseModel;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A window whose episodes go to `folder`, with the first-look scene of the demonstration opened for `budget` actions.
fn window(folder: &Path, budget: usize) -> Harness<'static, App> {
    let options = Options { out: folder.join("out"), ..Options::default() };
    let mut harness = Harness::builder()
        .with_size([1440.0, 900.0])
        .build_eframe(move |cc| App::without_viewer(&cc.egui_ctx, options.clone()));
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/demo/first-look.toml");
    let form = &mut harness.state_mut().model.kept.form;
    *form = StartForm { budget, ..form.clone().with_belief(CLASSICAL) };
    harness.state_mut().ask(Command::Open(scene));
    wait(&mut harness);
    harness
}

/// Runs the episode to its end, closes it, changes its log, and opens it again; returns its directory.
fn reopened(harness: &mut Harness<'_, App>, change: impl FnOnce(&mut serde_json::Value)) -> PathBuf {
    harness.state_mut().ask(Command::Run);
    wait(harness);
    let (id, path) = harness.state().model.session().map(|session| (session.id, session.path.clone())).expect("open");
    harness.state_mut().ask(Command::Close(id));
    harness.run_steps(3);
    let document = path.join("episode.json");
    let mut record = serde_json::from_slice(&std::fs::read(&document).expect("read")).expect("JSON");
    change(&mut record);
    std::fs::write(&document, record.to_string()).expect("written");
    harness.state_mut().ask(Command::Open(path.clone()));
    harness.run_steps(3);
    wait(harness);
    path
}

fn wait(harness: &mut Harness<'_, App>) {
    let started = Instant::now();
    loop {
        harness.step();
        if !harness.state().is_busy() {
            break;
        }
        assert!(started.elapsed() < Duration::from_secs(300), "the window never came to rest");
        std::thread::sleep(Duration::from_millis(5));
    }
    harness.run_steps(3);
}

/// What was chosen before the window opened, and what the form says, is what episodes are started with.
#[test]
fn views_and_noise_of_the_command_line_reach_the_episode() {
    let folder = tempfile::tempdir().expect("folder");
    let form = FormOptions {
        views: Some("real75".to_owned()),
        noise: Some(Some(NoiseModel::STANDARD)),
        budget: Some(1),
        ..FormOptions::default()
    };
    let open = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/demo/first-look.toml");
    let options = Options { out: folder.path().join("out"), form, open: Some(open), ..Options::default() };
    let mut harness = Harness::builder()
        .with_size([1440.0, 900.0])
        .build_eframe(move |cc| App::without_viewer(&cc.egui_ctx, options.clone()));
    wait(&mut harness);
    let session = harness.state().model.session().expect("open");
    let config = &session.record.config;
    assert_eq!((config.views.as_str(), config.noise, config.budget), ("real75", Some(NoiseModel::STANDARD), 1));
    assert_eq!(session.setup.views.views.len(), 75);
    let sees = |text: &str| harness.query_all_by_label(text).next().is_some();
    assert!(sees("real75") && sees("standard"), "told beside the policy");
    // A file that is none is told, and nothing is left over.
    harness.state_mut().model.kept.form.views = "nowhere.toml".to_owned();
    let scene = harness.state().model.kept.form.scene.clone().expect("a scene");
    harness.state_mut().ask(Command::Open(scene));
    wait(&mut harness);
    assert_eq!(harness.state().model.sessions.len(), 1);
    let left = std::fs::read_dir(folder.path().join("out")).expect("listed").count();
    assert_eq!(left, 1, "only the first episode has a directory");
}

#[test]
fn a_worker_that_panics_leaves_the_window_and_a_way_to_go_on() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 3);
    for _ in 0..2 {
        harness.state_mut().ask(Command::DoIt);
        wait(&mut harness);
    }
    let (id, path) = harness.state().model.session().map(|session| (session.id, session.path.clone())).expect("open");
    harness.state_mut().ask(Command::Note(1, "before it broke".to_owned()));
    harness.state_mut().model.session_of_mut(id).expect("open").activity = Activity::Acting;
    harness.state().workers[&id].order(Order::Break);
    wait(&mut harness);
    let dialog = harness.state().dialog().cloned();
    assert!(matches!(&dialog, Some(Dialog::Broke { words, steps: 1, .. }) if words == "a broken order"), "{dialog:?}");
    assert!(harness.query_by_label("The episode stopped").is_some());
    assert!(harness.state().model.session().expect("still shown").read_only.is_some());

    // A copy can be written, notes and all.
    harness.get_by_label("Export episode…").click();
    harness.run_steps(3);
    harness.get_by_label("Write").click();
    wait(&mut harness);
    let name = path.file_name().expect("name");
    let export = folder.path().join("out/exports").join(name);
    for file in ["episode.json", "notes.json", "episode.rrd", "beliefs/001.npz"] {
        assert!(export.join(file).exists(), "{file}");
    }

    // And the episode can be opened again, to go on.
    harness.state_mut().dialog = dialog;
    harness.run_steps(3);
    harness.get_by_label("Open it again").click();
    harness.run_steps(3);
    wait(&mut harness);
    let session = harness.state().model.session().expect("open again");
    assert!(session.id != id && session.path == path && session.steps() == 1 && session.read_only.is_none());
    assert_eq!(session.annotations.notes[&1], "before it broke");
    harness.state_mut().ask(Command::Run);
    wait(&mut harness);
    assert_eq!(harness.state().model.session().expect("open").steps(), 3);
}

#[test]
fn an_episode_of_another_version_is_shown_as_it_is_filed() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 2);
    // As if another version had written it.
    let path = reopened(&mut harness, |record| record["steps"][0]["scores"]["semantic_miou"] = 0.125.into());
    let session = harness.state().model.session().expect("shown all the same");
    let reason = session.read_only.as_deref().expect("read only");
    assert!(reason.contains("step 1: scores.semantic_miou: 0.125 in the log"), "{reason}");
    assert_eq!((session.path.clone(), session.steps()), (path, 2));
    assert_eq!(session.moments[1].scores.expect("a truth").semantic_miou, 0.125);
}

#[test]
fn panels_stay_as_wide_as_they_were_made() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 2);
    let widths = |harness: &Harness<'_, App>| -> Vec<(Part, f32)> {
        harness.state().parts.iter().map(|(part, rect)| (*part, rect.width())).collect()
    };
    let opened = widths(&harness);
    harness.state_mut().ask(Command::Run);
    wait(&mut harness);
    assert_eq!(widths(&harness), opened, "after a run");
    for layout in LayoutKind::ALL {
        harness.state_mut().model.kept.layout = layout;
        harness.run_steps(1);
        let first = widths(&harness);
        for step in [2, 1, 0] {
            harness.state_mut().model.cursor = step;
            harness.run_steps(40);
            assert_eq!(widths(&harness), first, "{layout:?}, step {step}");
        }
    }
}

#[test]
fn an_episode_of_the_networks_opens_in_a_build_without_them() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 1);
    reopened(&mut harness, |record| {
        record["belief"] = "cnabu".into();
        // As programs wrote it that did not tell what made an episode.
        record.as_object_mut().expect("an object").remove("made_by");
    });
    let session = harness.state().model.session().expect("shown all the same");
    let reason = session.read_only.as_deref().expect("read only");
    assert!(reason.contains("shown is what it holds"), "{reason}");
    assert_eq!((session.steps(), session.setup.update.is_some()), (1, nudge_core::cnabu::AVAILABLE));
}

#[test]
fn an_episode_of_other_weights_opens_to_be_looked_at_and_says_so() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 2);
    reopened(&mut harness, |record| {
        record["belief"] = "cnabu".into();
        record["made_by"]["weights"] = serde_json::json!({ "sigma_o": "0".repeat(64), "sigma_m": "1".repeat(64) });
    });
    let session = harness.state().model.session().expect("shown all the same");
    let reason = session.read_only.as_deref().expect("to look at only");
    assert!(reason.contains("shown is what it holds") && reason.lines().count() == 1, "{reason}");
    let is_told = reason.contains("the weights sigma_o were 000000000000, now they are ");
    assert_eq!(is_told, nudge_core::cnabu::AVAILABLE, "{reason}");
    // Nothing is repeated with weights that it was not made with, and no push predicted.
    assert!(session.steps() == 2 && session.setup.update.is_none());
}

/// Reopens the episode of a window, and stops as soon as it is shown.
fn shown_again(harness: &mut Harness<'_, App>) -> PathBuf {
    let (id, path) = harness.state().model.session().map(|session| (session.id, session.path.clone())).expect("open");
    harness.state_mut().ask(Command::Close(id));
    harness.run_steps(3);
    harness.state_mut().ask(Command::Open(path.clone()));
    let started = Instant::now();
    while harness.state().model.session().is_none() {
        assert!(started.elapsed() < Duration::from_secs(60), "it is not shown");
        std::thread::sleep(Duration::from_millis(1));
        harness.step();
    }
    path
}

#[test]
fn a_finished_episode_is_shown_before_its_log_is_repeated() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 3);
    harness.state_mut().ask(Command::Run);
    wait(&mut harness);
    let before = harness.state().model.session().expect("open").moments.clone();
    shown_again(&mut harness);
    let session = harness.state().model.session().expect("shown").clone();
    assert!(matches!(session.activity, Activity::Checking { .. }), "{:?}", session.activity);
    assert_eq!(session.moments.len(), before.len());
    for (moment, was) in session.moments.iter().zip(&before) {
        assert!(moment.belief == was.belief, "step {}", was.step);
        assert_eq!((moment.scores, moment.entropy_nats), (was.scores, was.entropy_nats));
        let same = moment.frame.as_ref().map(|frame| frame.frame()) == was.frame.as_ref().map(|frame| frame.frame());
        assert!(same, "the image of step {}", was.step);
    }
    wait(&mut harness);
    let session = harness.state().model.session().expect("shown");
    assert!(session.read_only.is_none() && session.activity == Activity::Idle);
    for (moment, was) in session.moments.iter().zip(&before) {
        assert!(moment.is_whole && moment.belief == was.belief && moment.bodies.len() == was.bodies.len());
        assert!(moment.seen.iter().eq(was.seen.iter()), "step {}", was.step);
    }
    assert!(session.setup.hidden.is_some() && session.setup.update.is_some());
}

#[test]
fn who_goes_on_with_a_reopened_episode_is_heard_once_its_log_is_checked() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 3);
    for _ in 0..2 {
        harness.state_mut().ask(Command::DoIt);
        wait(&mut harness);
    }
    shown_again(&mut harness);
    assert!(matches!(harness.state().model.session().expect("shown").activity, Activity::Checking { .. }));
    // What is decided now would be another state's: only a decision or a run waits.
    harness.state_mut().ask(Command::Decide);
    assert!(harness.state().model.session().expect("shown").queued);
    assert!(!MenuCommand::Run.is_available(&harness.state().model), "one order waits");
    wait(&mut harness);
    let session = harness.state().model.session().expect("shown");
    assert!(session.pending.is_some() && !session.queued && session.steps() == 1);
    // And what waits is left when a person says so.
    shown_again(&mut harness);
    harness.state_mut().ask(Command::Run);
    harness.state_mut().ask(Command::Cancel);
    wait(&mut harness);
    let session = harness.state().model.session().expect("shown");
    assert_eq!((session.steps(), session.queued), (1, false));
}

#[test]
fn without_a_file_dialog_a_path_is_typed() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 1);
    let open = MenuCommand::OpenScene;
    harness.state().chosen.0.send(Chosen::NoDialog(ChosenFor::Opening, open)).expect("sent");
    harness.run_steps(3);
    assert!(harness.query_by_label_contains("No file dialog of the system answered here").is_some());
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/demo/behind-the-boxes.toml");
    harness.get_by_label("Path").focus();
    harness.run_steps(2);
    harness.get_by_label("Path").type_text(&scene.to_string_lossy());
    harness.run_steps(2);
    harness.get_by_label("Open").click();
    harness.run_steps(2);
    wait(&mut harness);
    assert!(harness.state().dialog().is_none());
    assert_eq!(harness.state().model.session().expect("open").record.scene.name, "behind-the-boxes");
}

#[test]
fn what_is_on_the_window_is_shared_as_a_page_with_notes_that_are_not_saved() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 2);
    harness.state_mut().ask(Command::DoIt);
    wait(&mut harness);
    harness.state_mut().ask(Command::Note(1, "not saved".to_owned()));
    harness.state_mut().ask(Command::Menu(MenuCommand::Share));
    harness.run_steps(3);
    harness.get_by_label("Write").click();
    wait(&mut harness);
    let session = harness.state().model.session().expect("open");
    let mut page = folder.path().join("out/exports").join(session.path.file_name().expect("name")).into_os_string();
    page.push(".html");
    let html = std::fs::read_to_string(page).expect("a page");
    assert!(html.starts_with("<!DOCTYPE html>") && html.contains("id=\"part-a-states\""));
    assert!(session.unsaved, "sharing saves nothing");
}

#[test]
#[ignore = "the tour does not come up in this harness; not yet found out why"]
fn whoever_is_new_is_shown_around_once_and_its_keys_reach_nothing_else() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path(), 2);
    harness.state_mut().is_new = true;
    harness.run_steps(2);
    assert_eq!(harness.state().tour, None, "nothing is shown before there is a step to show");
    harness.state_mut().ask(Command::DoIt);
    wait(&mut harness);
    assert!(harness.query_by_label("The belief").is_some());
    // Enter goes to the next stop, and does no step of the episode behind it.
    for title in ["The decision", "Step by step", "The clock", "Other questions"] {
        harness.key_press(re_viewer::external::egui::Key::Enter);
        harness.run_steps(2);
        assert!(harness.query_by_label(title).is_some(), "{title}");
    }
    harness.get_by_label("Done").click();
    harness.run_steps(2);
    let app = harness.state();
    assert!((app.tour, app.is_new, app.model.kept.toured) == (None, false, true));
    assert!(app.model.session().is_some_and(|session| session.steps() == 1 && session.activity == Activity::Idle));
    harness.state_mut().ask(Command::Menu(MenuCommand::Tour));
    harness.run_steps(2);
    assert!(harness.query_by_label("The belief").is_some(), "the help menu shows it again");
    harness.key_press(re_viewer::external::egui::Key::Escape);
    harness.run_steps(2);
    assert!(harness.state().tour.is_none() && harness.state().model.session().is_some());
}
