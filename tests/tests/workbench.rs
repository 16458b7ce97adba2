//! The window's own logic, driven by what a person sees and clicks: labels, keys, the pointer. Without a graphics driver.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use nudge::workbench::app::{App, Options};
use nudge::workbench::command::Command;
use nudge::workbench::model::{LayoutKind, Picked};
use nudge::workbench::session::Activity;
use nudge_core::plan::Action;
use nudge_core::score::Verdict;
use nudge_tests::root;
use rerun::external::egui::{self, Event, Key, Modifiers, PointerButton, pos2, vec2};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const SCENE: &str = "scenes/demo/first-look.toml";

/// The window with its episodes in a folder of its own.
struct Window {
    harness: Harness<'static, App>,
    folder: tempfile::TempDir,
}

impl Window {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("folder");
        let options = Options { out: folder.path().join("out"), ..Options::default() };
        let harness = Harness::builder()
            .with_size(vec2(1440.0, 900.0))
            .build_eframe(move |cc| App::without_viewer(&cc.egui_ctx, options.clone()));
        Self { harness, folder }
    }

    /// A window with an episode of a small budget.
    fn with_episode(budget: usize) -> Self {
        let mut window = Self::new();
        window.app().model.kept.form.budget = budget;
        window.open(&root().join(SCENE));
        window
    }

    fn app(&mut self) -> &mut App {
        self.harness.state_mut()
    }

    fn open(&mut self, path: &Path) {
        self.app().ask(Command::Open(path.to_owned()));
        self.wait();
    }

    /// Draws frames until nothing is under way.
    fn wait(&mut self) {
        let started = Instant::now();
        loop {
            self.harness.step();
            if !self.harness.state().is_busy() {
                break;
            }
            assert!(started.elapsed() < Duration::from_secs(300), "the window never came to rest");
            std::thread::sleep(Duration::from_millis(5));
        }
        self.harness.run_steps(2);
    }

    fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        self.wait();
    }

    fn steps(&self) -> usize {
        self.harness.state().model.session().expect("an episode is shown").steps()
    }

    fn toasts(&mut self) -> Vec<String> {
        self.app().model.toasts.shown().iter().map(|toast| toast.text.clone()).collect()
    }

    fn path(&self) -> PathBuf {
        self.harness.state().model.session().expect("an episode is shown").path.clone()
    }
}

#[test]
fn an_empty_window_says_what_to_do() {
    let mut window = Window::new();
    window.harness.run_steps(3);
    assert!(window.harness.query_all_by_label_contains("Open").count() > 0);
    assert!(!window.harness.state().is_busy());
}

#[test]
fn open_decide_do_and_run() {
    let mut window = Window::with_episode(4);
    assert_eq!(window.steps(), 0);
    assert!(window.harness.query_by_label("first-look").is_some());
    window.click("Decide");
    let decision = window.harness.state().model.session().expect("episode").pending.clone().expect("a decision");
    assert_eq!(decision.gains.len(), 300);
    window.click("Do it");
    assert_eq!(window.steps(), 1);
    assert_eq!(window.harness.state().model.cursor, 1);
    let done = window.harness.state().model.session().expect("episode").record.steps[0].action;
    assert_eq!(done, decision.action);
    window.click("Run");
    assert_eq!(window.steps(), 4);
    let session = window.harness.state().model.session().expect("episode");
    assert!(session.is_finished() && session.activity == Activity::Idle);
    assert!(session.moments[4].scores.entropy_nats < session.moments[0].scores.entropy_nats);
    let written = window.path();
    assert!(written.join("episode.json").exists() && written.join("beliefs/004.npz").exists());
}

#[test]
fn something_else_than_the_policy_would_do() {
    let mut window = Window::with_episode(3);
    window.click("Decide");
    window.app().ask(Command::DoInstead(Action::Look { view: nudge_core::camera::ViewId(17) }));
    window.wait();
    let session = window.harness.state().model.session().expect("episode");
    assert_eq!(session.record.steps[0].action, Action::Look { view: nudge_core::camera::ViewId(17) });
    assert_eq!(session.record.steps[0].decision.gains.len(), 300, "what was weighed is kept");
}

#[test]
fn a_run_is_cancelled_and_goes_on() {
    let mut window = Window::with_episode(30);
    window.harness.get_by_label("Run").click();
    let started = Instant::now();
    while window.steps() < 1 {
        window.harness.step();
        assert!(started.elapsed() < Duration::from_secs(120), "the run never made a step");
    }
    window.harness.get_by_label("Cancel").click();
    window.wait();
    let done = window.steps();
    assert!(done < 30, "the run was not cancelled");
    window.click("Do it");
    window.click("Do it");
    assert_eq!(window.steps(), done + 1);
}

#[test]
fn rewind_and_branch_keep_both_open() {
    let mut window = Window::with_episode(4);
    window.click("Run");
    window.click("Step 2");
    assert_eq!(window.harness.state().model.cursor, 2);
    window.harness.key_press(Key::Comma);
    window.wait();
    assert_eq!(window.harness.state().model.cursor, 1);
    window.click("Step 2");
    window.click("Branch from here");
    let model = &window.harness.state().model;
    assert_eq!(model.sessions.len(), 2);
    let (old, new) = (&model.sessions[0], &model.sessions[1]);
    assert_eq!((old.steps(), new.steps()), (4, 2));
    assert_eq!(model.shown, Some(new.id));
    assert_eq!(old.record.steps[1].action, new.record.steps[1].action);
    assert_eq!(old.moments[2].belief, new.moments[2].belief);
    assert_ne!(old.path, new.path);
    window.click("Do it");
    window.click("Do it");
    assert_eq!(window.steps(), 3);
}

#[test]
fn a_voxel_and_a_cell_are_inspected_and_two_runs_compared() {
    let mut window = Window::with_episode(2);
    window.click("Run");
    window.app().ask(Command::Pick(Some(Picked::Cell(5_000))));
    window.wait();
    assert_eq!(window.harness.state().model.kept.layout, LayoutKind::Why);
    assert!(window.harness.query_all_by_label_contains("Beta").count() > 0, "the cell's column is explained");
    window.app().ask(Command::Pick(Some(Picked::Voxel(400_000))));
    window.wait();
    for layout in LayoutKind::ALL {
        window.app().ask(Command::Layout(layout));
        window.wait();
    }
    window.app().ask(Command::Layout(LayoutKind::Episode));
    window.app().model.kept.form.seed = 5;
    window.app().model.kept.form.policy = nudge_core::plan::PolicyKind::Random;
    window.open(&root().join(SCENE));
    window.click("Run");
    let first = window.harness.state().model.sessions[0].id;
    window.app().ask(Command::CompareWith(Some(first)));
    window.wait();
    assert_eq!(window.harness.state().model.kept.layout, LayoutKind::Compare);
    assert!(window.harness.state().model.other_session().is_some());
}

#[test]
fn notes_and_verdicts_survive_export_and_reopening() {
    let mut window = Window::with_episode(2);
    window.click("Run");
    window.app().ask(Command::Note(1, "the box hides the can".to_owned()));
    let object = window.harness.state().model.session().expect("episode").record.steps[1].objects[0].clone();
    let name = nudge::verdicts::object_name(&object);
    window.app().ask(Command::Overrule(2, name.clone(), Some(Verdict::Misclassified)));
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::E);
    window.wait();
    window.click("Write");
    let exports = window.folder.path().join("out/exports");
    let directory = std::fs::read_dir(&exports)
        .expect("exports")
        .map(|entry| entry.expect("entry").path())
        .find(|path| path.is_dir())
        .unwrap_or_else(|| panic!("nothing was exported"));
    assert!(directory.with_extension("rrd").exists() && directory.join("notes.json").exists());
    let mut again = Window::new();
    again.open(&directory);
    let session = again.harness.state().model.session().expect("the export opens");
    assert_eq!(session.annotations.notes[&1], "the box hides the can");
    assert_eq!(session.annotations.verdicts[&2][&name], Verdict::Misclassified);
    assert_eq!(session.steps(), 2);
}

#[test]
fn an_episode_reopens_where_it_was_left_and_goes_on() {
    let mut window = Window::with_episode(3);
    window.click("Do it");
    window.click("Do it");
    let path = window.path();
    assert_eq!(window.steps(), 1);
    drop(window.harness);
    std::thread::sleep(Duration::from_millis(300));
    let mut again = Window::new();
    again.open(&path);
    assert_eq!(again.steps(), 1);
    again.click("Run");
    assert_eq!(again.steps(), 3);
}

#[test]
fn broken_files_become_messages_that_name_them() {
    let mut window = Window::new();
    let broken = window.folder.path().join("broken.toml");
    std::fs::write(&broken, "format = 1\nname = \"x\n").expect("written");
    window.open(&broken);
    assert!(window.toasts().iter().any(|text| text.contains("broken.toml") && text.contains("line 2")));
    window.open(Path::new("/nowhere/at/all"));
    assert!(window.toasts().iter().any(|text| text.contains("/nowhere/at/all")));
    let episode = window.folder.path().join("cut");
    std::fs::create_dir(&episode).expect("made");
    std::fs::write(episode.join("episode.json"), "{ \"format\": 1, \"sce").expect("written");
    window.open(&episode);
    assert!(window.toasts().iter().any(|text| text.contains("episode.json")), "{:?}", window.toasts());
    assert!(window.harness.state().model.sessions.is_empty());
}

#[test]
fn a_worker_that_breaks_down_leaves_the_window_and_the_episode() {
    let mut window = Window::with_episode(3);
    window.click("Do it");
    window.click("Do it");
    // A view that the array does not have is refused; the episode goes on.
    window.app().ask(Command::DoInstead(Action::Look { view: nudge_core::camera::ViewId(9_999) }));
    window.wait();
    assert!(window.toasts().iter().any(|text| text.contains("9999")), "{:?}", window.toasts());
    assert_eq!(window.steps(), 1);
    window.click("Do it");
    window.click("Do it");
    assert_eq!(window.steps(), 2);
}

#[test]
fn a_scene_is_authored_with_undo_and_redo_and_tried() {
    let mut window = Window::new();
    window.app().ask(Command::Layout(LayoutKind::Author));
    window.wait();
    window.app().model.author.add("tomato_can");
    window.wait();
    window.app().model.author.add("cracker_box");
    window.wait();
    assert_eq!(window.harness.state().model.author.scene().objects.len(), 2);
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.wait();
    assert_eq!(window.harness.state().model.author.scene().objects.len(), 1);
    window.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    window.wait();
    assert_eq!(window.harness.state().model.author.scene().objects.len(), 2);
    window.click("Try it");
    let session = window.harness.state().model.session().expect("an episode of the scene");
    assert_eq!(session.record.scene.objects.len(), 2);
}

#[test]
fn help_and_about_open_and_close() {
    let mut window = Window::new();
    window.harness.key_press(Key::F1);
    window.wait();
    assert!(window.harness.query_by_label("Keyboard shortcuts").is_some());
    window.harness.key_press(Key::Escape);
    window.wait();
    assert!(window.harness.query_by_label("Branch from here").is_none(), "the sheet is closed");
}

#[test]
fn two_thousand_random_events_never_panic() {
    let mut window = Window::with_episode(3);
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut random = move |below: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state % below
    };
    // Keys that open the system's dialogs or end the program are left out.
    let keys = [
        Key::A,
        Key::D,
        Key::R,
        Key::Enter,
        Key::Escape,
        Key::Tab,
        Key::Space,
        Key::Comma,
        Key::Period,
        Key::Home,
        Key::End,
        Key::Delete,
        Key::ArrowLeft,
        Key::ArrowUp,
        Key::F1,
        Key::Num1,
        Key::Num2,
        Key::Num3,
        Key::Num4,
        Key::Num5,
        Key::Num6,
        Key::Z,
        Key::B,
        Key::L,
    ];
    for _ in 0..2_000 {
        let at = pos2(random(1440) as f32, random(900) as f32);
        let modifiers = [Modifiers::NONE, Modifiers::NONE, Modifiers::COMMAND, Modifiers::SHIFT][random(4) as usize];
        let event = match random(6) {
            0 => Event::Key {
                key: keys[random(keys.len() as u64) as usize],
                physical_key: None,
                pressed: random(2) == 0,
                repeat: false,
                modifiers,
            },
            1 => Event::Text(["7", "x", "0.3", "ü"][random(4) as usize].to_owned()),
            2 => Event::MouseWheel {
                unit: egui::MouseWheelUnit::Point,
                delta: vec2(0.0, random(200) as f32 - 100.0),
                phase: egui::TouchPhase::Move,
                modifiers,
            },
            _ => Event::PointerButton { pos: at, button: PointerButton::Primary, pressed: random(2) == 0, modifiers },
        };
        // Menus whose entries would wait for a person are at the top; the pointer keeps away from them.
        if at.y < 26.0 {
            continue;
        }
        window.harness.event(Event::PointerMoved(at));
        window.harness.event(event);
        window.harness.step();
    }
    window.app().ask(Command::Cancel);
    window.wait();
}
