//! The window under test: its logic and all of its panels, without a graphics driver, driven by what a person sees.

use egui_kittest::kittest::{NodeT, Queryable, by};
use egui_kittest::{Harness, Node};
use nudge::workbench::app::{App, Options};
use nudge::workbench::command::Command;
use nudge::workbench::model::{LayoutKind, Model};
use nudge::workbench::session::Session;
use nudge_core::belief::CLASSICAL;
use nudge_core::plan::PolicyKind;
use nudge_tests::root;
use re_viewer::external::egui::{self, Key, Modifiers, vec2};
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::time::{Duration, Instant};

/// The scene of most tests.
pub const SCENE: &str = "scenes/demo/first-look.toml";
/// How long anything may take.
const PATIENCE: Duration = Duration::from_secs(300);

/// The window with its episodes in a folder of its own.
pub struct Window {
    pub harness: Harness<'static, App>,
    pub folder: tempfile::TempDir,
    threads: nudge::workbench::threads::Threads,
}

impl Window {
    pub fn new() -> Self {
        Self::with_scenes(&root().join("scenes/demo"))
    }

    /// With the scenes of a folder to choose from; of none, for a window that may write where it likes.
    pub fn with_scenes(scenes: &Path) -> Self {
        // What is typed at random into a field for paths shall not land in the repository.
        static ELSEWHERE: Once = Once::new();
        ELSEWHERE.call_once(|| {
            let elsewhere = tempfile::tempdir().expect("folder").keep();
            std::env::set_current_dir(elsewhere).expect("a folder to be in");
        });
        let folder = tempfile::tempdir().expect("folder");
        let options = Options { out: folder.path().join("out"), scenes: scenes.to_owned(), ..Options::default() };
        let threads = options.threads.clone();
        let mut harness = Harness::builder()
            .with_size(vec2(1440.0, 900.0))
            .build_eframe(move |cc| App::without_viewer(&cc.egui_ctx, options.clone()));
        // The networks take longer, and not every build has them.
        let form = &mut harness.state_mut().model.kept.form;
        *form = form.clone().with_belief(CLASSICAL);
        Self { harness, folder, threads }
    }

    /// A window with an episode of a small budget.
    pub fn with_episode(budget: usize) -> Self {
        let mut window = Self::new();
        window.app().model.kept.form.budget = budget;
        window.open(&root().join(SCENE));
        window
    }

    /// A window with an episode of the policy that decides fastest.
    pub fn with_quick_episode(budget: usize) -> Self {
        let mut window = Self::new();
        let form = &mut window.app().model.kept.form;
        (form.budget, form.policy) = (budget, PolicyKind::MemNoPush);
        window.open(&root().join(SCENE));
        window
    }

    /// A window with an episode in which pushes are weighed from the first step on, a few at a time.
    pub fn with_pushes(budget: usize) -> Self {
        let mut window = Self::new();
        let form = &mut window.app().model.kept.form;
        form.budget = budget;
        (form.planner.quiet_steps, form.planner.candidates) = (0, 12);
        window.open(&root().join("scenes/demo/behind-the-boxes.toml"));
        window
    }

    pub fn app(&mut self) -> &mut App {
        self.harness.state_mut()
    }

    pub fn model(&self) -> &Model {
        &self.harness.state().model
    }

    /// The episode that is shown.
    pub fn session(&self) -> &Session {
        self.model().session().expect("an episode is shown")
    }

    pub fn steps(&self) -> usize {
        self.session().steps()
    }

    pub fn open(&mut self, path: &Path) {
        self.app().ask(Command::Open(path.to_owned()));
        self.wait();
    }

    /// Draws frames until nothing is under way.
    pub fn wait(&mut self) {
        self.wait_for("rest", |app| !app.is_busy());
        self.harness.run_steps(2);
    }

    /// Draws frames until something is so.
    pub fn wait_for(&mut self, what: &str, is: impl Fn(&App) -> bool) {
        let started = Instant::now();
        loop {
            self.harness.step();
            if is(self.harness.state()) {
                return;
            }
            assert!(started.elapsed() < PATIENCE, "the window never came to this: {what}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Draws frames until something with this in its label is on the window.
    pub fn wait_for_label(&mut self, label: &str) {
        let started = Instant::now();
        while !self.sees(label) {
            assert!(started.elapsed() < PATIENCE, "{label} never came on the window");
            self.harness.step();
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Whether something with this in its label is on the window.
    pub fn sees(&self, label: &str) -> bool {
        self.harness.query_all_by_label_contains(label).next().is_some()
    }

    /// Clicks on what has exactly this label, and waits until all that follows is done.
    pub fn click(&mut self, label: &str) {
        self.press(label);
        self.wait();
    }

    /// Clicks on what has exactly this label, and waits for nothing.
    pub fn press(&mut self, label: &str) {
        self.control(label).scroll_to_me();
        self.settle(|window| window.control(label).rect());
        click_on(&self.control(label));
        self.harness.run_steps(2);
    }

    /// Draws frames until something has come to rest where it was scrolled to: scrolling takes a few of them.
    fn settle(&mut self, place: impl Fn(&Self) -> egui::Rect) {
        let mut before = egui::Rect::NOTHING;
        for _ in 0..120 {
            self.harness.run_steps(2);
            let now = place(self);
            if now == before {
                return;
            }
            before = now;
        }
    }

    /// The one control of this name; text that says the same does not count.
    fn control<'a>(&'a self, label: &'a str) -> Node<'a> {
        let is_text = |node: &Node<'_>| node.accesskit_node().role() == egui::accesskit::Role::Label;
        let mut controls: Vec<Node<'_>> = Vec::new();
        controls.extend(self.harness.query_all(by().label(label)).filter(|node| !is_text(node)));
        assert_eq!(controls.len(), 1, "controls of the name {label}");
        controls.remove(0)
    }

    /// Clicks on the first of what has this in its label.
    pub fn click_first(&mut self, label: &str) {
        let first = |window: &Self, then: &dyn Fn(&Node<'_>)| {
            let node = window.harness.query_all_by_label_contains(label).next();
            then(&node.unwrap_or_else(|| panic!("nothing on the window has {label} in its label")));
        };
        first(self, &|node| node.scroll_to_me());
        self.settle(|window| {
            window.harness.query_all_by_label_contains(label).next().map_or(egui::Rect::NOTHING, |node| node.rect())
        });
        first(self, &click_on);
        self.harness.run_steps(2);
        self.wait();
    }

    /// Points at the first of what has this in its label.
    pub fn hover_first(&mut self, label: &str) {
        self.harness.query_all_by_label_contains(label).next().expect("on the window").hover();
        self.harness.run_steps(3);
    }

    /// Types into the field of this name.
    pub fn type_into(&mut self, role: egui::accesskit::Role, name: &str, text: &str) {
        self.harness.get(by().role(role).label(name)).focus();
        self.harness.run_steps(2);
        self.harness.get(by().role(role).label(name)).type_text(text);
        self.harness.run_steps(2);
    }

    pub fn key(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.run_steps(2);
        self.wait();
    }

    pub fn layout(&mut self, layout: LayoutKind) {
        self.click(&format!("Layout {}", layout.title()));
        assert_eq!(self.model().kept.layout, layout);
    }

    pub fn toasts(&mut self) -> Vec<String> {
        self.app().model.toasts.shown().iter().map(|toast| toast.text.clone()).collect()
    }

    pub fn told(&mut self, words: &str) -> bool {
        self.toasts().iter().any(|text| text.contains(words))
    }

    pub fn path(&self) -> PathBuf {
        self.session().path.clone()
    }

    /// Closes the window and waits until its episodes have ended; their folder stays.
    pub fn close(self) -> tempfile::TempDir {
        let Self { harness, folder, threads } = self;
        drop(harness);
        threads.join();
        folder
    }

    /// What a click on the window's cross leads to: whether it closes.
    pub fn closes(&mut self) -> bool {
        self.harness.run_steps(1);
        let root = egui::ViewportId::ROOT;
        self.harness.input_mut().viewports.entry(root).or_default().events.push(egui::ViewportEvent::Close);
        self.harness.step();
        self.harness.input_mut().viewports.entry(root).or_default().events.clear();
        !self.commands().contains(&egui::ViewportCommand::CancelClose)
    }

    /// What the window told the system in its last frame.
    pub fn commands(&self) -> Vec<egui::ViewportCommand> {
        self.harness.output().viewport_output[&egui::ViewportId::ROOT].commands.clone()
    }
}

/// A click with the pointer; by the accessibility interface on what is scrolled out of sight.
fn click_on(node: &Node<'_>) {
    let window = egui::Rect::from_min_size(egui::Pos2::ZERO, vec2(1440.0, 900.0));
    let disabled = node.accesskit_node().is_disabled();
    assert!(!disabled, "{:?} is disabled", node.accesskit_node().label());
    if window.contains(node.rect().center()) { node.click() } else { node.click_accesskit() }
}
