//! What is done with the commands that panels, menus and shortcuts give.

use super::{Answer, App, ChosenFor, Opening};
use crate::workbench::command::{Command, Level, MenuCommand};
use crate::workbench::dialog::{Dialog, Reply};
use crate::workbench::export;
use crate::workbench::jobs::JobKind;
use crate::workbench::model::{GainSource, LayoutKind, Preview};
use crate::workbench::session::{Activity, SessionId};
use crate::workbench::worker::{Begin, Order, Worker};
use nudge_core::belief::SweptPush;
use nudge_core::camera::ViewId;
use nudge_core::episode::EpisodeConfig;
use nudge_core::gain::{GainField, RayDensity, gain_per_voxel};
use nudge_core::plan::{Action, Decision, Reason};
use nudge_core::scene::Scene;
use nudge_core::score::Verdict;
use nudge_core::tool::Push;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How many paths are remembered.
const RECENT: usize = 12;

impl App {
    pub(super) fn carry_out(&mut self, command: Command) {
        match command {
            Command::Menu(entry) => self.menu(entry),
            Command::Open(path) => self.open(&path),
            Command::Start => self.start_chosen(),
            Command::Show(id) => self.model.show(id),
            Command::Close(id) => self.close(id),
            Command::CompareWith(other) => {
                self.model.other = other;
                if other.is_some() {
                    self.model.kept.layout = LayoutKind::Compare;
                }
            }
            Command::GoTo(step) => {
                let last = self.model.session().map_or(0, |session| session.steps());
                self.model.cursor = step.min(last);
                self.model.candidate = None;
            }
            Command::Layout(layout) => self.model.kept.layout = layout,
            Command::Decide => self.order(|_| Some(Order::Decide), Activity::Deciding),
            Command::DoIt => self.order(
                |pending| Some(pending.map_or(Order::Decide, |decision| Order::Act(decision.clone()))),
                Activity::Acting,
            ),
            Command::DoInstead(action) => self.do_instead(action),
            Command::Act(decision) => self.order(move |_| Some(Order::Act(decision.clone())), Activity::Acting),
            Command::Run => self.order(|_| Some(Order::Run), Activity::Running),
            Command::Cancel => self.cancel(),
            Command::Branch => self.branch(),
            Command::Preview(push) => self.preview(push),
            Command::GainOf(view) => self.gain_of(view),
            Command::Pick(picked) => {
                self.model.picked = picked;
                if picked.is_some() && self.model.kept.layout == LayoutKind::Episode {
                    self.model.kept.layout = LayoutKind::Why;
                }
            }
            Command::Note(step, text) => self.note(step, text),
            Command::Overrule(step, object, verdict) => self.overrule(step, object, verdict),
            Command::CloseRecording => {
                self.model.recording = None;
                if let Some(viewer) = &mut self.viewer {
                    viewer.close_recording();
                }
            }
            Command::TryScene => self.try_scene(),
            Command::Tell(level, text) => self.model.toasts.tell(level, text),
        }
    }

    fn tell(&mut self, level: Level, text: impl Into<String>) {
        self.model.toasts.tell(level, text);
    }

    fn menu(&mut self, entry: MenuCommand) {
        match entry {
            MenuCommand::OpenScene | MenuCommand::OpenEpisode => self.browse(entry, ChosenFor::Opening),
            MenuCommand::Save => self.save(),
            MenuCommand::SaveSceneAs
            | MenuCommand::ExportEpisode
            | MenuCommand::ExportTables
            | MenuCommand::ExportPicture => {
                let proposal = self.proposal(entry);
                self.dialog = Some(Dialog::write_to(entry, &proposal));
            }
            MenuCommand::CloseEpisode => self.model.shown.into_iter().for_each(|id| self.close(id)),
            MenuCommand::Quit => self.quit_asked = true,
            MenuCommand::Undo => self.model.author.undo(),
            MenuCommand::Redo => self.model.author.redo(),
            MenuCommand::Duplicate => self.model.author.duplicate(),
            MenuCommand::Delete => self.model.author.delete(),
            MenuCommand::StepBack => self.carry_out(Command::GoTo(self.model.cursor.saturating_sub(1))),
            MenuCommand::StepForward => self.carry_out(Command::GoTo(self.model.cursor + 1)),
            MenuCommand::First => self.carry_out(Command::GoTo(0)),
            MenuCommand::Last => self.carry_out(Command::GoTo(usize::MAX)),
            MenuCommand::Decide => self.carry_out(Command::Decide),
            MenuCommand::DoIt => self.carry_out(Command::DoIt),
            MenuCommand::Run => self.carry_out(Command::Run),
            MenuCommand::Cancel => {
                if self.dialog.take().is_none() {
                    self.cancel();
                }
            }
            MenuCommand::Branch => self.branch(),
            MenuCommand::Layout(layout) => self.model.kept.layout = layout,
            MenuCommand::ToggleTheme => self.model.kept.light = !self.model.kept.light,
            MenuCommand::ZoomIn => self.zoom_asked = Some(1.1),
            MenuCommand::ZoomOut => self.zoom_asked = Some(1.0 / 1.1),
            MenuCommand::ResetLayout => self.reset_asked = true,
            MenuCommand::Shortcuts => self.dialog = Some(Dialog::Shortcuts),
            MenuCommand::About => self.dialog = Some(Dialog::About),
        }
    }

    /// The answer to a question.
    pub(super) fn reply(&mut self, reply: Reply) {
        match reply {
            Reply::Close => self.dialog = None,
            Reply::Browse(what) => self.browse(what, ChosenFor::Dialog),
            Reply::Quit => {
                self.may_quit = true;
                self.quit_asked = true;
                self.dialog = None;
            }
            Reply::SaveAndQuit => {
                self.dialog = None;
                if self.save_all() {
                    self.may_quit = true;
                    self.quit_asked = true;
                }
            }
            Reply::Write(what, path) => {
                self.dialog = None;
                self.write(what, path);
            }
        }
    }

    /// Opens the system's dialog on a thread of its own, since it blocks.
    fn browse(&mut self, what: MenuCommand, purpose: ChosenFor) {
        let (answers, wake) = (self.answers.0.clone(), self.wake.clone());
        let started = std::thread::Builder::new().name("file dialog".to_owned()).spawn(move || {
            let dialog = rfd::FileDialog::new().set_title(what.title().trim_end_matches('…'));
            let chosen = match what {
                MenuCommand::OpenScene => dialog.add_filter("Scene", &["toml"]).pick_file(),
                MenuCommand::OpenEpisode | MenuCommand::ExportTables | MenuCommand::ExportEpisode => {
                    dialog.pick_folder()
                }
                MenuCommand::SaveSceneAs => dialog.add_filter("Scene", &["toml"]).save_file(),
                _ => dialog.add_filter("Picture", &["png"]).save_file(),
            };
            if let Some(path) = chosen {
                let _ = answers.send(Answer::Chosen(purpose, path));
                wake();
            }
        });
        if let Err(error) = started {
            self.tell(Level::Error, format!("No file dialog: {error}"));
        }
    }

    fn open(&mut self, path: &Path) {
        let is = |extension: &str| path.extension().is_some_and(|other| other.eq_ignore_ascii_case(extension));
        if is("toml") {
            if self.start(path) {
                self.remember(path);
            }
        } else if is("rrd") {
            match (&mut self.viewer, path.is_file()) {
                (_, false) => self.tell(Level::Error, format!("{}: no such file", path.display())),
                (None, true) => {
                    self.tell(Level::Error, format!("{}: recordings need a graphics driver", path.display()));
                }
                (Some(viewer), true) => {
                    viewer.open_recording(path);
                    self.model.recording = Some(path.to_owned());
                    self.remember(path);
                }
            }
        } else {
            let directory = if path.is_file() { path.parent().unwrap_or(path) } else { path };
            if directory.join("episode.json").is_file() {
                let title = directory.display().to_string();
                let begin = Begin::Open { path: directory.to_owned(), look_only: self.options.look_only };
                self.spawn(title, begin);
                self.remember(directory);
            } else {
                let message = "is neither a scene (.toml), nor an episode's directory, nor a recording (.rrd)";
                self.tell(Level::Error, format!("{}: {message}", path.display()));
            }
        }
    }

    fn remember(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let recent = &mut self.model.kept.recent;
        recent.retain(|other| *other != path);
        recent.insert(0, path);
        recent.truncate(RECENT);
    }

    fn spawn(&mut self, title: String, begin: Begin) {
        let id = SessionId(self.next_id);
        self.next_id += 1;
        self.openings.insert(id, Opening { title, activity: Activity::Opening { done: 0, of: 0 } });
        self.model.recording = None;
        let worker = Worker::spawn(id, begin, self.catalog.clone(), self.events.0.clone(), self.wake.clone());
        self.workers.insert(id, worker);
    }

    fn start_chosen(&mut self) {
        match self.model.kept.form.scene.clone() {
            Some(path) => {
                if self.start(&path) {
                    self.remember(&path);
                }
            }
            None => self.tell(Level::Warning, "Choose a scene first"),
        }
    }

    /// Starts an episode of a scene's file; false if it is none.
    fn start(&mut self, path: &Path) -> bool {
        match Scene::load(path, &self.catalog) {
            Ok((scene, warnings)) => {
                for warning in warnings {
                    self.tell(Level::Warning, format!("{}: {warning}", path.display()));
                }
                self.model.kept.form.scene = Some(path.to_owned());
                self.start_scene(scene);
                true
            }
            Err(error) => {
                self.tell(Level::Error, error.to_string());
                false
            }
        }
    }

    fn start_scene(&mut self, scene: Scene) {
        let form = self.model.kept.form.clone();
        let config = EpisodeConfig {
            policy: form.policy,
            belief: form.belief.clone(),
            seed: form.seed,
            budget: form.budget.max(1),
            views: "standard300".to_owned(),
            planner: form.planner,
            noise: None,
        };
        let out = self.free_directory(&scene, &config);
        let title = format!("{}, {}, seed {}", scene.name, config.policy, config.seed);
        self.spawn(title, Begin::Start { scene: Box::new(scene), config: Box::new(config), out });
    }

    /// `out/<scene>-<policy>-<seed>`, with a number behind it if that is taken.
    fn free_directory(&self, scene: &Scene, config: &EpisodeConfig) -> PathBuf {
        let plain = crate::driver::default_out(scene, config.policy, config.seed);
        let name = plain.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let taken = |path: &PathBuf| path.exists() || self.model.sessions.iter().any(|session| session.path == *path);
        let numbered = (2..).map(|n| self.options.out.join(format!("{name}-{n}")));
        std::iter::once(self.options.out.join(&name)).chain(numbered).find(|path| !taken(path)).unwrap_or(plain)
    }

    fn close(&mut self, id: SessionId) {
        if let Some(session) = self.model.session_of(id)
            && session.unsaved
            && let Err(error) = session.annotations.write(&session.path)
        {
            return self.tell(Level::Error, format!("{error}; the episode stays open"));
        }
        self.workers.remove(&id);
        self.openings.remove(&id);
        self.model.forget(id);
    }

    /// Gives the shown episode's worker an order, unless it is busy.
    fn order(&mut self, order: impl Fn(Option<&Arc<Decision>>) -> Option<Order>, activity: Activity) {
        let Some(id) = self.model.shown else { return self.tell(Level::Warning, "Open a scene first") };
        let Some(worker) = self.workers.get(&id) else {
            return self.tell(Level::Warning, "This episode takes no more orders; branch from it to go on");
        };
        let Some(session) = self.model.session_of_mut(id) else { return };
        if session.activity != Activity::Idle {
            return self.tell(Level::Info, "The episode is busy; cancel first");
        }
        if session.is_finished() {
            return self.tell(Level::Info, "The budget is used up; branch from an earlier step to go on");
        }
        if let Some(order) = order(session.pending.as_ref()) {
            session.activity = if matches!(order, Order::Decide) { Activity::Deciding } else { activity };
            worker.order(order);
            self.model.cursor = self.model.session().map_or(0, |session| session.steps());
        }
    }

    /// Does what a person chose: the decision keeps what was weighed, and says who chose.
    fn do_instead(&mut self, action: Action) {
        let weighed = self.model.session().and_then(|session| session.pending.clone());
        let decision = match weighed {
            Some(weighed) => Decision { action, reason: Reason::Manual, ..(*weighed).clone() },
            None => Decision {
                action,
                reason: Reason::Manual,
                igv: 0.0,
                igm: 0.0,
                reg: 0.0,
                pair: Vec::new(),
                gains: Vec::new(),
                candidates: Vec::new(),
                best_push: None,
                motion: None,
            },
        };
        self.carry_out(Command::Act(Arc::new(decision)));
    }

    fn cancel(&mut self) {
        let opening: Vec<SessionId> = self.openings.keys().copied().collect();
        for id in self.model.shown.into_iter().chain(opening) {
            if let Some(worker) = self.workers.get(&id) {
                worker.cancel();
            }
        }
        self.model.author.cancel_generating();
    }

    fn branch(&mut self) {
        let Some(session) = self.model.session() else { return };
        let (of, steps) = (session.record.clone(), self.model.cursor.min(session.steps()));
        let title = format!("{} from step {steps}", session.title());
        let out = self.free_directory(&of.scene, &of.config);
        self.spawn(title, Begin::Branch { of: Box::new(of), steps, out });
    }

    fn preview(&mut self, push: Push) {
        let Some(session) = self.model.session() else { return };
        let moment = session.moment(self.model.cursor).clone();
        let (of, setup) = ((session.id, moment.step), session.setup.clone());
        let (answers, wake) = (self.answers.0.clone(), self.wake.clone());
        self.jobs.add(JobKind::Preview, move || {
            let belief = moment.belief.belief();
            let swept = setup.tool.swept_volume(&push, &belief.grid);
            let swept = SweptPush { push, swept };
            if let Some(prediction) = setup.update.predict_pushes(&belief, std::slice::from_ref(&swept)).pop() {
                let (prediction, swept) = (Arc::new(prediction), Arc::new(swept.swept));
                let _ = answers.send(Answer::Preview(Preview { of, push, prediction, swept }));
            }
            wake();
        });
    }

    fn gain_of(&mut self, view: ViewId) {
        self.model.view = Some(view);
        let Some(session) = self.model.session() else { return };
        let moment = session.moment(self.model.cursor).clone();
        let (of, views) = ((session.id, moment.step), session.setup.views.clone());
        let (answers, wake) = (self.answers.0.clone(), self.wake.clone());
        self.jobs.add(JobKind::Gain, move || {
            let field = GainField::new(&moment.belief.belief());
            let nats = Arc::new(gain_per_voxel(&field, &views, view, RayDensity::FULL));
            let _ = answers.send(Answer::Gain(GainSource { of, view, nats }));
            wake();
        });
    }

    fn note(&mut self, step: usize, text: String) {
        let Some(session) = self.model.shown.and_then(|id| self.model.session_of_mut(id)) else { return };
        if text.trim().is_empty() {
            session.annotations.notes.remove(&step);
        } else {
            session.annotations.notes.insert(step, text);
        }
        session.unsaved = true;
    }

    fn overrule(&mut self, step: usize, object: String, verdict: Option<Verdict>) {
        let Some(session) = self.model.shown.and_then(|id| self.model.session_of_mut(id)) else { return };
        let verdicts = session.annotations.verdicts.entry(step).or_default();
        match verdict {
            Some(verdict) => verdicts.insert(object, verdict),
            None => verdicts.remove(&object),
        };
        session.annotations.verdicts.retain(|_, verdicts| !verdicts.is_empty());
        session.unsaved = true;
    }

    fn try_scene(&mut self) {
        if !self.model.author.is_sound() {
            return self.tell(Level::Warning, "The scene has problems; mend what is red first");
        }
        let scene = self.model.author.scene().clone();
        self.start_scene(scene);
    }

    /// Writes notes and verdicts, or the scene in the making.
    fn save(&mut self) {
        if self.model.kept.layout == LayoutKind::Author {
            if self.model.author.path().is_none() {
                return self.menu(MenuCommand::SaveSceneAs);
            }
            let saved = self.model.author.save();
            return self.saved(saved.map_err(|error| error.to_string()));
        }
        if let Some(id) = self.model.shown {
            let saved = self.save_notes(id);
            self.saved(saved);
        }
    }

    fn save_notes(&mut self, id: SessionId) -> Result<PathBuf, String> {
        let Some(session) = self.model.session_of_mut(id) else { return Err("no episode is open".to_owned()) };
        session.annotations.write(&session.path).map_err(|error| error.to_string())?;
        session.unsaved = false;
        Ok(session.path.join(crate::workbench::annotations::FILE))
    }

    fn saved(&mut self, saved: Result<PathBuf, String>) {
        match saved {
            Ok(path) => self.tell(Level::Info, format!("Wrote {}", path.display())),
            Err(words) => self.tell(Level::Error, words),
        }
    }

    /// Saves everything that is unsaved; false if something could not be.
    fn save_all(&mut self) -> bool {
        let unsaved: Vec<SessionId> =
            self.model.sessions.iter().filter(|session| session.unsaved).map(|session| session.id).collect();
        for id in unsaved {
            if let Err(words) = self.save_notes(id) {
                self.tell(Level::Error, words);
                return false;
            }
        }
        if self.model.author.is_unsaved() {
            if self.model.author.path().is_none() {
                self.menu(MenuCommand::SaveSceneAs);
                return false;
            }
            if let Err(error) = self.model.author.save() {
                self.tell(Level::Error, error.to_string());
                return false;
            }
        }
        true
    }

    /// Where something would go unless a person says otherwise.
    fn proposal(&self, what: MenuCommand) -> PathBuf {
        let name = self.model.session().map_or_else(
            || "window".to_owned(),
            |session| session.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        );
        let exports = self.options.out.join("exports");
        match what {
            MenuCommand::ExportEpisode => exports.join(&name),
            MenuCommand::ExportTables => exports.join(format!("{name}-tables")),
            MenuCommand::SaveSceneAs => {
                Path::new("scenes").join("mine").join(format!("{}.toml", self.model.author.scene().name))
            }
            _ => exports.join(format!("{name}-{}.png", self.model.kept.layout.title().to_lowercase())),
        }
    }

    fn write(&mut self, what: MenuCommand, path: PathBuf) {
        if what == MenuCommand::SaveSceneAs {
            if let Some(folder) = path.parent() {
                let _ = std::fs::create_dir_all(folder);
            }
            let saved = self.model.author.save_as(&path);
            return self.saved(saved.map_err(|error| error.to_string()));
        }
        if what == MenuCommand::ExportPicture {
            if let Some(folder) = path.parent() {
                let _ = std::fs::create_dir_all(folder);
            }
            self.picture_to = Some(path);
            self.picture_asked = true;
            return;
        }
        let Some(session) = self.model.session().cloned() else { return };
        self.tell(Level::Info, format!("Exporting to {}", path.display()));
        self.errand(move |answers| {
            let written = if what == MenuCommand::ExportTables {
                export::write_tables(&session, &path).map(|_| ())
            } else {
                let recording = path.with_extension("rrd");
                export::write_episode(&session, &path, &|_| true)
                    .and_then(|()| export::write_recording(&session, &recording, &|_| true))
            };
            let _ = answers.send(match written {
                Ok(()) => Answer::Tell(Level::Info, format!("Exported to {}", path.display())),
                Err(error) => Answer::Tell(Level::Error, error.to_string()),
            });
        });
    }
}
