//! The window: takes in what workers, jobs and the viewer tell, draws the panels, and carries out what they ask.

mod around;
mod carry_out;
mod draw;
mod files;
mod follow;
mod shown;
mod take_in;
#[cfg(test)]
mod tests;

use super::browser::{Browser, Cache, Folders};
use super::changes::{self, Largest};
use super::command::{Command, Level, MenuCommand};
use super::derive::Derived;
use super::dialog::Dialog;
use super::latest::{Latest, Wake};
use super::model::{GainSource, LayoutKind, Model, Picked, Preview, Remembered};
use super::part::Part;
use super::ray::Ray;
use super::session::{Activity, SessionId};
use super::space::{Drawn, Painter};
use super::tasks::Tasks;
use super::threads::Threads;
use super::viewer::Viewer;
use super::worker::{Event, Worker};
use crate::planner_args::PlannerArgs;
use nudge_core::camera::{NoiseModel, ViewId};
use nudge_core::plan::{Decision, PolicyKind};
use nudge_core::scene::Catalog;
use nudge_core::skill::Manipulation;
use re_viewer::external::{eframe, egui};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

/// Where eframe keeps what outlasts the program.
const STORAGE_KEY: &str = "nudge workbench";
/// The scene that is chosen at the first start: what `make demo` maps.
const DEMO: &str = "high/can-phalanx.toml";

/// With what the window is opened.
#[derive(Clone, Debug)]
pub struct Options {
    /// A scene, an episode or a recording to open.
    pub open: Option<PathBuf>,
    /// With what an episode is started; what is remembered otherwise.
    pub form: FormOptions,
    /// The folder that new episodes go to.
    pub out: PathBuf,
    /// The folder of the scenes to choose from, and where new ones go.
    pub scenes: PathBuf,
    /// The folder of the scenes that came with the program, to choose from as well.
    pub shipped_scenes: Option<PathBuf>,
    /// Whether choices outlast the program.
    pub remember: bool,
    /// Light instead of dark; what is remembered otherwise.
    pub light: Option<bool>,
    /// The layout to begin with; what is remembered otherwise.
    pub layout: Option<LayoutKind>,
    /// Whether episodes are opened to look at only, so that nothing in their directories changes.
    pub look_only: bool,
    /// What to do without a person.
    pub script: Option<Script>,
    /// The port at 127.0.0.1 where other viewers on this machine may look on; none unless it is asked for.
    pub serve: Option<u16>,
    /// The threads of the episodes, to be waited for once the window is gone.
    pub threads: Threads,
}

/// Choices for the first episode that were made before the window opened.
#[derive(Clone, Debug, Default)]
pub struct FormOptions {
    /// The rule that chooses actions.
    pub policy: Option<PolicyKind>,
    /// Number of actions.
    pub budget: Option<usize>,
    /// Seed of every random choice.
    pub seed: Option<u64>,
    /// The view array.
    pub views: Option<String>,
    /// What the camera gets wrong, `Some(None)` for nothing.
    pub noise: Option<Option<NoiseModel>>,
    /// The planner's settings.
    pub planner: PlannerArgs,
}

/// Something to do before the program ends by itself.
#[derive(Clone, Debug)]
pub struct Script {
    /// Actions to do in what was opened.
    pub steps: usize,
    /// Where a picture of the window then goes.
    pub picture: PathBuf,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            open: None,
            form: FormOptions::default(),
            out: PathBuf::from("out"),
            scenes: PathBuf::from(super::browser::FOLDER),
            shipped_scenes: None,
            remember: false,
            light: None,
            layout: None,
            look_only: false,
            script: None,
            serve: None,
            threads: Threads::default(),
        }
    }
}

/// What is made in the background, each by a thread of its own that does the latest that it was asked for.
struct Background {
    maps: Latest<Derived>,
    other_maps: Latest<Derived>,
    preview: Latest<Preview>,
    gain: Latest<GainSource>,
    changes: Latest<(changes::Of, Largest)>,
    space: Latest<()>,
}

impl Background {
    fn new(wake: &Wake) -> Self {
        let background = Self {
            maps: Latest::new("floor maps"),
            other_maps: Latest::new("floor maps of the other episode"),
            preview: Latest::new("push preview"),
            gain: Latest::new("gain of a view"),
            changes: Latest::new("largest changes"),
            space: Latest::new("three-dimensional views"),
        };
        background.maps.wake_with(wake.clone());
        background.other_maps.wake_with(wake.clone());
        background.preview.wake_with(wake.clone());
        background.gain.wake_with(wake.clone());
        background.changes.wake_with(wake.clone());
        background.space.wake_with(wake.clone());
        background
    }

    fn is_busy(&self) -> bool {
        self.maps.is_busy()
            || self.other_maps.is_busy()
            || self.preview.is_busy()
            || self.gain.is_busy()
            || self.changes.is_busy()
            || self.space.is_busy()
    }

    /// Why jobs broke down since the last call.
    fn broke(&self) -> Vec<String> {
        let (maps, views) = (
            [&self.maps, &self.other_maps],
            [self.preview.broke(), self.gain.broke(), self.changes.broke(), self.space.broke()],
        );
        maps.into_iter().map(Latest::broke).chain(views).flatten().collect()
    }
}

/// What became of a file dialog.
enum Chosen {
    /// A path was chosen.
    Path(ChosenFor, PathBuf),
    /// The system has no such dialog.
    NoDialog(ChosenFor, MenuCommand),
}

/// What a file dialog was opened for.
#[derive(Clone, Copy)]
enum ChosenFor {
    Opening,
    Dialog,
}

/// An episode that is being opened.
pub struct Opening {
    /// What it will be.
    pub title: String,
    /// How far it is.
    pub activity: Activity,
    /// The path to be remembered once it is open.
    remember: Option<PathBuf>,
    /// What a branch keeps of the episode that it comes from.
    kept: Option<Kept>,
}

impl Opening {
    fn of(title: String) -> Self {
        Self { title, activity: Activity::Opening { done: 0, of: 0 }, remember: None, kept: None }
    }
}

/// What was decided and chosen in an episode where it was branched from.
struct Kept {
    decision: Option<Arc<Decision>>,
    picked: Option<Picked>,
    view: Option<ViewId>,
    candidate: Option<usize>,
}

/// Both ends of a channel; the first is cloned for every thread that tells something.
type Channel<T> = (Sender<T>, Receiver<T>);

/// Two episodes that are run side by side, once both are open.
struct Pair {
    ids: [SessionId; 2],
}

/// The window's state around the [`Model`].
pub struct App {
    /// What is shown.
    pub model: Model,
    panels: shown::Panels,
    options: Options,
    catalog: Arc<Catalog>,
    workers: BTreeMap<SessionId, Worker>,
    openings: BTreeMap<SessionId, Opening>,
    events: Channel<(SessionId, Event)>,
    /// Paths that were chosen in the system's dialogs.
    chosen: Channel<Chosen>,
    background: Background,
    tasks: Tasks,
    pairs: Vec<Pair>,
    /// Directories that episodes were begun in, whether they are there yet or not.
    begun: BTreeSet<PathBuf>,
    /// The gain that was asked for last: the state and the view.
    asked_gain: Option<((SessionId, usize), ViewId)>,
    /// The changes that were asked for last.
    asked_changes: Option<changes::Of>,
    /// The prediction that was asked for last: the state and the push.
    asked_preview: Option<((SessionId, usize), Manipulation)>,
    /// Where the parts of the window were drawn last, points.
    parts: Vec<(Part, egui::Rect)>,
    viewer: Option<Viewer>,
    /// The ray of a click on the three-dimensional views in this frame.
    ray: Option<Ray>,
    /// The voxel that a click was on, until the viewer has told whether something else was meant.
    pointed: Option<Picked>,
    /// Why there is no viewer.
    no_viewer: Option<String>,
    /// What draws.
    graphics: String,
    painter: Option<Arc<Mutex<Painter>>>,
    drawn: Drawn,
    /// What the three-dimensional views were last asked to show.
    asked_space: String,
    wake: Wake,
    next_id: u32,
    dialog: Option<Dialog>,
    /// The stop of the tour that is shown.
    tour: Option<usize>,
    /// Whether the tour is still to be shown.
    is_new: bool,
    /// Whether a person has said that unsaved work may go.
    may_quit: bool,
    /// Milliseconds that the window's own part of the last frame took.
    frame_ms: Option<f32>,
    /// Milliseconds that the viewer took of the last frame.
    viewer_ms: f32,
    last_viewer_ms: f32,
    picture_to: Option<(Part, PathBuf)>,
    /// Frames since the script has nothing more to do.
    script_frames: usize,
    /// What only the next frame can do.
    picture_asked: bool,
    quit_asked: bool,
    reset_asked: bool,
    zoom_asked: Option<f32>,
    theme_set: Option<bool>,
}

impl App {
    /// The window with the viewer inside.
    pub fn new(cc: &eframe::CreationContext<'_>, options: Options) -> Self {
        let mut app = Self::bare(&cc.egui_ctx, options);
        if app.options.remember
            && let Some(kept) = cc.storage.and_then(|storage| eframe::get_value::<Remembered>(storage, STORAGE_KEY))
        {
            app.model.kept = kept;
        }
        app.is_new = app.options.remember && app.options.script.is_none() && !app.model.kept.toured;
        if app.is_new && app.model.kept.form.scene.is_none() {
            let demo = app.options.shipped_scenes.as_ref().map(|scenes| scenes.join(DEMO));
            app.model.kept.form.scene = demo.filter(|demo| demo.is_file());
        }
        match Viewer::new(cc, app.options.serve) {
            Ok((viewer, stream)) => {
                super::theme::apply(&cc.egui_ctx);
                app.viewer = Some(viewer);
                app.model.serving = app.options.serve;
                app.painter = Some(Arc::new(Mutex::new(Painter::new(stream, app.drawn.clone()))));
            }
            Err(reason) => app.no_viewer = Some(reason),
        }
        if let Some(state) = &cc.wgpu_render_state {
            let adapter = state.adapter.get_info();
            app.graphics = format!("{} ({:?})", adapter.name, adapter.backend);
        }
        app.tell_graphics(&cc.egui_ctx);
        app.begin();
        app
    }

    /// The window without three-dimensional views: for machines without a graphics driver, and for tests.
    pub fn without_viewer(ctx: &egui::Context, options: Options) -> Self {
        let mut app = Self::bare(ctx, options);
        app.no_viewer = Some("three-dimensional views are switched off".to_owned());
        app.begin();
        app
    }

    fn bare(ctx: &egui::Context, options: Options) -> Self {
        let repaint = ctx.clone();
        let wake: Wake = Arc::new(move || repaint.request_repaint());
        Self {
            model: Model {
                browser: Browser::of(Folders {
                    scenes: options.scenes.clone(),
                    shipped: options.shipped_scenes.clone(),
                    episodes: Some(options.out.clone()),
                })
                .with_cache(if options.remember { Cache::of_user() } else { Cache::default() }),
                ..Model::default()
            },
            panels: shown::Panels::default(),
            options,
            catalog: Arc::new(Catalog::standard()),
            workers: BTreeMap::new(),
            openings: BTreeMap::new(),
            events: channel(),
            chosen: channel(),
            background: Background::new(&wake),
            tasks: Tasks::default(),
            pairs: Vec::new(),
            begun: BTreeSet::new(),
            asked_gain: None,
            asked_preview: None,
            asked_changes: None,
            parts: Vec::new(),
            viewer: None,
            ray: None,
            pointed: None,
            no_viewer: None,
            graphics: "none".to_owned(),
            painter: None,
            drawn: Drawn::default(),
            asked_space: String::new(),
            wake,
            next_id: 0,
            dialog: None,
            tour: None,
            is_new: false,
            may_quit: false,
            frame_ms: None,
            viewer_ms: 0.0,
            last_viewer_ms: 0.0,
            picture_to: None,
            script_frames: 0,
            picture_asked: false,
            quit_asked: false,
            reset_asked: false,
            zoom_asked: None,
            theme_set: None,
        }
    }

    fn begin(&mut self) {
        if let Some(light) = self.options.light {
            self.model.kept.light = light;
        }
        if let Some(layout) = self.options.layout {
            self.model.kept.layout = layout;
        }
        let (form, chosen) = (&mut self.model.kept.form, &self.options.form);
        form.policy = chosen.policy.unwrap_or(form.policy);
        form.budget = chosen.budget.unwrap_or(form.budget);
        form.seed = chosen.seed.unwrap_or(form.seed);
        form.noise = chosen.noise.unwrap_or(form.noise);
        if let Some(views) = &chosen.views {
            form.views.clone_from(views);
        }
        match chosen.planner.onto(form.planner) {
            Ok(planner) => form.planner = planner,
            Err(error) => self.model.toasts.tell(Level::Error, error.to_string()),
        }
        self.model.author.wake_with(self.wake.clone());
        if let Some(path) = self.options.open.clone() {
            if self.options.layout.is_none() && self.model.kept.layout == LayoutKind::Author {
                // Remembered from the last time; what is named on the command line is to be seen, not edited.
                self.model.kept.layout = LayoutKind::Episode;
            }
            self.carry_out(Command::Open(path));
        }
    }

    /// Whether anything is under way.
    pub fn is_busy(&self) -> bool {
        !self.openings.is_empty()
            || self.model.sessions.iter().any(|session| session.activity != Activity::Idle || session.queued)
            || self.background.is_busy()
            || self.model.author.is_counting()
            || !self.tasks.under_way().is_empty()
    }

    /// An open question in front of everything else.
    pub fn dialog(&self) -> Option<&Dialog> {
        self.dialog.as_ref()
    }

    /// Where a part of the window was drawn last, points.
    pub fn place_of(&self, part: Part) -> Option<egui::Rect> {
        self.parts.iter().find(|(of, _)| *of == part).map(|(_, rect)| *rect)
    }

    /// Voxels of the belief that are drawn in three dimensions.
    pub fn drawn_voxels(&self) -> usize {
        self.drawn.count(super::space::at::BELIEF)
    }

    /// Why there are no three-dimensional views, if there are none.
    pub fn no_viewer(&self) -> Option<&str> {
        self.no_viewer.as_deref()
    }

    /// Carries out commands as the panels would ask for them: for scripts and tests.
    pub fn ask(&mut self, command: Command) {
        self.carry_out(command);
    }

    /// Milliseconds that the window's own part of the last frame took, the viewer's left out.
    pub fn last_frame_ms(&self) -> Option<f32> {
        self.frame_ms
    }

    /// Milliseconds that the viewer's views took of the last frame, on the processor.
    pub fn last_viewer_ms(&self) -> f32 {
        self.last_viewer_ms
    }

    /// Whether maps and three-dimensional views show the state at the cursor.
    pub fn is_shown(&self) -> bool {
        let key = self.model.session().map(|session| (session.id, session.moment(self.model.cursor).step));
        key.is_none_or(|key| self.model.derived.contains_key(&key) && !self.background.space.is_busy())
    }

    /// Why the program should not end without asking: what would be lost.
    fn unsaved(&self) -> Vec<String> {
        let mut lost: Vec<String> = self
            .model
            .sessions
            .iter()
            .filter(|session| session.unsaved)
            .map(|session| format!("notes and verdicts of {}", session.title()))
            .collect();
        if self.model.author.is_unsaved() {
            lost.push(format!("the scene {}", self.model.author.scene().name));
        }
        lost.extend(self.tasks.under_way().iter().map(|task| format!("{}, which is not finished", task.title)));
        lost
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, frame: &mut eframe::Frame) {
        let started = std::time::Instant::now();
        self.take_in(ctx);
        self.frame_ms = Some(started.elapsed().as_secs_f32() * 1e3);
        if let Some(viewer) = &mut self.viewer {
            viewer.logic(ctx, frame);
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        self.draw(ui, Some(frame));
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        if self.options.remember {
            eframe::set_value(storage, STORAGE_KEY, &self.model.kept);
        }
    }
}
