//! Rerun's viewer inside the window: the only place that touches `re_viewer`.
//!
//! It is fed in memory by a [`rerun::RecordingStream`] and opens no port, unless it is asked to serve: then other viewers
//! on this machine can look on, at 127.0.0.1 only. Its own panels are hidden; what a person
//! clicks on comes back through [`Viewer::clicked`].

mod linked;
mod sight;

use super::ray::Ray;
use re_viewer::external::re_ui::{RecordingCommand, RecordingCommandKind, RecordingCommandSender as _};
use re_viewer::external::re_viewer_context::{SystemCommand, SystemCommandSender as _};
use re_viewer::external::{eframe, egui, re_log_channel, re_log_types, tokio};
use rerun::external::re_sdk_types::blueprint::components::PanelState;
use rerun::grpc_server::GrpcServerSink;
use rerun::sink::LogSink as _;
use rerun::{RecordingStream, RecordingStreamBuilder};
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The application id of the window's own recording; layouts of shared recordings go by another.
pub const APPLICATION: &str = "nudge_workbench";

/// Where it serves: this machine and no other.
pub const LOOPBACK: &str = "127.0.0.1";

/// What was clicked on in three dimensions.
#[derive(Clone, Debug, PartialEq)]
pub struct Clicked {
    /// The entity's path.
    pub entity: String,
    /// Which of its instances.
    pub instance: Option<usize>,
}

/// How long a recording may take until it is shown.
const LOADING: Duration = Duration::from_secs(60);

/// The embedded viewer.
pub struct Viewer {
    app: re_viewer::App,
    clicked: Rc<RefCell<Option<Clicked>>>,
    /// Whether a foreign recording is shown, which the viewer's own keys play.
    is_foreign: Arc<AtomicBool>,
    /// When the foreign recording was asked for.
    asked: Option<Instant>,
    /// Dropped last: the viewer's own tasks run on it.
    _runtime: tokio::runtime::Runtime,
}

impl Viewer {
    /// Sets the viewer up in a window that draws with wgpu, and gives back the stream that it shows. With a port, what is
    /// shown is served there as well.
    ///
    /// # Errors
    /// When there is no graphics driver that it can use.
    pub fn new(cc: &eframe::CreationContext<'_>, serve: Option<u16>) -> Result<(Self, RecordingStream), String> {
        re_viewer::customize_eframe_and_setup_renderer(cc).map_err(|error| error.to_string())?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .map_err(|error| error.to_string())?;
        let clicked = Rc::new(RefCell::new(None));
        let mut options = re_viewer::StartupOptions {
            persist_state: false,
            hide_welcome_screen: true,
            ..re_viewer::StartupOptions::default()
        };
        options.panel_state_overrides.top = Some(PanelState::Hidden);
        options.panel_state_overrides.blueprint = Some(PanelState::Hidden);
        options.panel_state_overrides.selection = Some(PanelState::Hidden);
        options.panel_state_overrides.time = Some(PanelState::Hidden);
        let heard = clicked.clone();
        options.on_event = Some(Rc::new(move |event: re_viewer::ViewerEvent| {
            if let re_viewer::ViewerEventKind::SelectionChange { items } = event.kind
                && let Some(clicked) = items.iter().find_map(clicked_of)
            {
                *heard.borrow_mut() = Some(clicked);
            }
        }));
        // The viewer takes the space bar, arrows, Home and End as soon as a frame begins. Around its hook, so in the order
        // in which they are made, two of ours take the keys away and give them back.
        let is_foreign = Arc::new(AtomicBool::new(false));
        let held: Arc<Mutex<Vec<egui::Event>>> = Arc::default();
        let (hold, foreign) = (held.clone(), is_foreign.clone());
        cc.egui_ctx.on_begin_pass(
            "nudge holds its keys",
            Arc::new(move |ctx| {
                if !foreign.load(Ordering::Relaxed) {
                    let keys = ctx.input_mut(|input| std::mem::take(&mut input.events));
                    *hold.lock().unwrap_or_else(PoisonError::into_inner) = keys;
                }
            }),
        );
        let _entered = runtime.enter();
        let mut app = re_viewer::App::new(
            re_viewer::MainThreadToken::i_promise_i_am_on_the_main_thread(),
            re_viewer::build_info(),
            re_viewer::AppEnvironment::Custom("Nudge".to_owned()),
            options,
            cc,
            None,
            re_viewer::AsyncRuntimeHandle::new_native(runtime.handle().clone()),
        );
        cc.egui_ctx.on_begin_pass(
            "nudge has its keys back",
            Arc::new(move |ctx| {
                let mut held = std::mem::take(&mut *held.lock().unwrap_or_else(PoisonError::into_inner));
                ctx.input_mut(|input| {
                    held.append(&mut input.events);
                    input.events = held;
                });
            }),
        );
        app.app_options_mut().custom_window_decorations = false;
        app.extend_view_class(linked::class(), |registrator| {
            registrator.register_context_system::<linked::LinkedEyes>()
        })
        .map_err(|error| error.to_string())?;
        let (sender, receiver) = re_log_channel::log_channel(re_log_channel::LogSource::Sdk);
        app.add_log_receiver(receiver);
        let stream = stream_into(sender, serve).map_err(|error| error.to_string())?;
        drop(_entered);
        Ok((Self { app, clicked, is_foreign, asked: None, _runtime: runtime }, stream))
    }

    /// Takes in what was logged. To be called every frame, before [`Viewer::ui`].
    pub fn logic(&mut self, ctx: &egui::Context, frame: &mut eframe::Frame) {
        let _entered = self._runtime.handle().clone();
        let _entered = _entered.enter();
        eframe::App::logic(&mut self.app, ctx, frame);
    }

    /// Draws it into what is left of the window.
    pub fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let _entered = self._runtime.handle().clone();
        let _entered = _entered.enter();
        // Its shortcuts open panels and palettes of its own: of the keys it sees only those that are held down, by which
        // a camera moves.
        let foreign = self.is_foreign.load(Ordering::Relaxed);
        let before = ui.input_mut(|input| {
            let before = input.events.clone();
            input.events.retain(|event| foreign || !matches!(event, egui::Event::Key { .. }));
            before
        });
        eframe::App::ui(&mut self.app, ui, frame);
        ui.input_mut(|input| input.events = before);
    }

    /// What was clicked on since the last call, as the viewer tells it.
    pub fn clicked(&mut self) -> Option<Clicked> {
        let clicked = self.clicked.borrow_mut().take();
        if clicked.is_some() && !self.is_foreign.load(Ordering::Relaxed) {
            // It tells of changes alone: what stays selected could not be clicked again, and would keep its outline.
            self.app.command_sender.send_system(SystemCommand::clear_selection());
        }
        clicked
    }

    /// The ray that a click in this frame follows, if it was on one of the window's own views inside `space`.
    pub fn clicked_ray(&self, ctx: &egui::Context, space: egui::Rect) -> Option<Ray> {
        if self.is_foreign.load(Ordering::Relaxed) { None } else { sight::clicked(ctx, space) }
    }

    /// Shows a recording in place of the window's own.
    pub fn open_recording(&mut self, path: &Path) {
        self.is_foreign.store(true, Ordering::Relaxed);
        self.asked = Some(Instant::now());
        self.drop_foreign();
        self.app.open_url_or_file(&path.to_string_lossy());
    }

    /// Frees the memory of the recording that is shown, unless it is the window's own.
    fn drop_foreign(&mut self) {
        let shown = self.app.active_recording_id().map(|id| id.application_id().clone());
        if let Some(foreign) = shown.filter(|app| app.as_str() != APPLICATION) {
            self.app.command_sender.send_system(SystemCommand::CloseApp(foreign));
        }
    }

    /// Whether a recording was asked for that is not there yet. One that does not come is not waited for.
    pub fn is_loading(&self) -> bool {
        let shown = self.app.active_recording_id().is_some_and(|id| id.application_id().as_str() != APPLICATION);
        !shown && self.asked.is_some_and(|asked| asked.elapsed() < LOADING)
    }

    /// Moves the time of the recording that is shown, as the viewer's own keys would.
    pub fn play(&mut self, kind: RecordingCommandKind) {
        if let Some(recording_id) = self.app.active_recording_id().cloned() {
            self.app.command_sender.send_recording_command(RecordingCommand { recording_id, kind });
        }
    }

    /// Goes back to the window's own recording, and lets the other one go.
    pub fn close_recording(&mut self) {
        self.is_foreign.store(false, Ordering::Relaxed);
        self.asked = None;
        self.drop_foreign();
        let own = re_log_types::ApplicationId::from(APPLICATION);
        self.app.command_sender.send_system(SystemCommand::ActivateApp(own));
    }
}

fn clicked_of(item: &re_viewer::SelectionChangeItem) -> Option<Clicked> {
    match item {
        re_viewer::SelectionChangeItem::Entity { entity_path, instance_id, .. } => Some(Clicked {
            entity: entity_path.to_string().trim_start_matches('/').to_owned(),
            instance: instance_id.specific_index().map(|index| index.get() as usize),
        }),
        _ => None,
    }
}

/// A stream whose messages go straight into the viewer. Its sender may block, so nothing may be flushed on the window's
/// own thread, which is the one that takes messages out.
fn stream_into(sender: re_log_channel::LogSender, serve: Option<u16>) -> rerun::RecordingStreamResult<RecordingStream> {
    let (stream, _) = RecordingStreamBuilder::new(APPLICATION).send_properties(false).memory()?;
    stream.set_log_time_enabled(false);
    stream.set_log_tick_enabled(false);
    // The address is a constant: there is nothing in it that could not be read.
    let served = serve.and_then(|port| GrpcServerSink::new(LOOPBACK, port, rerun::ServerOptions::default()).ok());
    stream.set_sink(Box::new(rerun::sink::CallbackSink::new(move |messages: &[re_log_types::LogMsg]| {
        for message in messages {
            if let Some(served) = &served {
                served.send(message.clone());
            }
            // The viewer is gone once the window is closed.
            let _ = sender.send(message.clone().into());
        }
    })));
    Ok(stream)
}
