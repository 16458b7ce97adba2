//! What only happens when something breaks, driven through the window. The rest is tested from outside, in `tests/`.

use super::{App, Options};
use crate::workbench::command::Command;
use crate::workbench::dialog::Dialog;
use crate::workbench::session::Activity;
use crate::workbench::worker::Order;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use std::path::Path;
use std::time::{Duration, Instant};

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

#[test]
fn a_worker_that_panics_leaves_the_window_and_a_way_to_go_on() {
    let folder = tempfile::tempdir().expect("folder");
    let options = Options { out: folder.path().join("out"), ..Options::default() };
    let mut harness = Harness::builder()
        .with_size([1440.0, 900.0])
        .build_eframe(move |cc| App::without_viewer(&cc.egui_ctx, options.clone()));
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/demo/first-look.toml");
    harness.state_mut().model.kept.form.budget = 3;
    harness.state_mut().ask(Command::Open(scene));
    wait(&mut harness);
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
