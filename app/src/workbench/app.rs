//! The window: takes in what workers, jobs and the viewer tell, draws the panels, and carries out what they ask.

mod carry_out;
mod draw;
mod take_in;

use super::command::{Command, Level};
use super::derive::Derived;
use super::dialog::Dialog;
use super::jobs::Jobs;
use super::model::{GainSource, LayoutKind, Model, Preview, Remembered};
use super::session::{Activity, SessionId};
use super::space::{Drawn, Painter};
use super::viewer::Viewer;
use super::worker::{Event, Wake, Worker};
use nudge_core::scene::Catalog;
use rerun::external::{eframe, egui};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

/// Where eframe keeps what outlasts the program.
const STORAGE_KEY: &str = "nudge workbench";

/// With what the window is opened.
#[derive(Clone, Debug)]
pub struct Options {
    /// A scene, an episode or a recording to open.
    pub open: Option<PathBuf>,
    /// The folder that new episodes go to.
    pub out: PathBuf,
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
            out: PathBuf::from("out"),
            remember: false,
            light: None,
            layout: None,
            look_only: false,
            script: None,
        }
    }
}

/// What a job answers.
enum Answer {
    Maps(Derived),
    Preview(Preview),
    Gain(GainSource),
    Tell(Level, String),
    Chosen(ChosenFor, PathBuf),
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
}

/// The window's state around the [`Model`].
pub struct App {
    /// What is shown.
    pub model: Model,
    options: Options,
    catalog: Arc<Catalog>,
    workers: BTreeMap<SessionId, Worker>,
    openings: BTreeMap<SessionId, Opening>,
    events: (Sender<(SessionId, Event)>, Receiver<(SessionId, Event)>),
    answers: (Sender<Answer>, Receiver<Answer>),
    jobs: Jobs,
    viewer: Option<Viewer>,
    /// Why there is no viewer.
    no_viewer: Option<String>,
    painter: Option<Arc<Mutex<Painter>>>,
    drawn: Drawn,
    /// What the three-dimensional views were last asked to show.
    asked_space: String,
    wake: Wake,
    next_id: u32,
    errands: u64,
    dialog: Option<Dialog>,
    /// Whether a person has said that unsaved work may go.
    may_quit: bool,
    /// Milliseconds that the window's own part of the last frame took.
    frame_ms: Option<f32>,
    /// Milliseconds that the viewer took of the last frame.
    viewer_ms: f32,
    picture_to: Option<PathBuf>,
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
        match Viewer::new(cc) {
            Ok((viewer, stream)) => {
                app.viewer = Some(viewer);
                app.painter = Some(Arc::new(Mutex::new(Painter::new(stream, app.drawn.clone()))));
            }
            Err(reason) => app.no_viewer = Some(reason),
        }
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
        let answers = channel();
        let (tell, repaint) = (answers.0.clone(), ctx.clone());
        let broke = move |words: String| {
            let _ = tell.send(Answer::Tell(Level::Error, format!("A background job broke down: {words}")));
            repaint.request_repaint();
        };
        let repaint = ctx.clone();
        Self {
            model: Model::default(),
            options,
            catalog: Arc::new(Catalog::standard()),
            workers: BTreeMap::new(),
            openings: BTreeMap::new(),
            events: channel(),
            answers,
            jobs: Jobs::start(broke),
            viewer: None,
            no_viewer: None,
            painter: None,
            drawn: Drawn::default(),
            asked_space: String::new(),
            wake: Arc::new(move || repaint.request_repaint()),
            next_id: 0,
            errands: 0,
            dialog: None,
            may_quit: false,
            frame_ms: None,
            viewer_ms: 0.0,
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
        self.model.author.wake_with(self.wake.clone());
        if let Some(path) = self.options.open.clone() {
            self.carry_out(Command::Open(path));
        }
    }

    /// Whether anything is under way.
    pub fn is_busy(&self) -> bool {
        !self.openings.is_empty()
            || self.model.sessions.iter().any(|session| session.activity != Activity::Idle)
            || !self.jobs.is_idle()
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
        lost
    }

    fn errand(&mut self, work: impl FnOnce(&Sender<Answer>) + Send + 'static) {
        self.errands += 1;
        let (answers, wake) = (self.answers.0.clone(), self.wake.clone());
        self.jobs.add(super::jobs::JobKind::Errand(self.errands), move || {
            work(&answers);
            wake();
        });
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
