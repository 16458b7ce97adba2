//! What is done with the commands that panels, menus and shortcuts give.

use super::{App, ChosenFor, Kept, Opening, Pair};
use crate::workbench::columns::Columns;
use crate::workbench::command::{Command, Level, MenuCommand};
use crate::workbench::dialog::{Dialog, Reply};
use crate::workbench::model::LayoutKind;
use crate::workbench::session::{Activity, Session, SessionId, branch_suffix};
use crate::workbench::worker::{Begin, Order, Worker};
use nudge_core::episode::EpisodeConfig;
use nudge_core::plan::{Action, Decision, PolicyKind, Reason};
use nudge_core::scene::Scene;
use nudge_core::score::Verdict;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl App {
    pub(super) fn carry_out(&mut self, command: Command) {
        match command {
            Command::Menu(entry) => self.menu(entry),
            Command::Open(path) => self.open(&path),
            Command::Start => self.start_chosen(),
            Command::Show(id) => self.show(id),
            Command::Close(id) => self.close(id),
            Command::CompareWith(other) => {
                self.model.other = other;
                if other.is_some() {
                    self.lay_out(LayoutKind::Compare);
                }
            }
            Command::GoTo(step) => self.model.go_to(step.min(self.model.last_step())),
            Command::Layout(layout) => self.lay_out(layout),
            Command::Decide => self.order(Order::Decide, Activity::Deciding),
            Command::DoIt => match self.model.session().and_then(|session| session.pending.clone()) {
                Some(decision) => self.order(Order::Act(decision), Activity::Acting),
                None => self.order(Order::Decide, Activity::Deciding),
            },
            Command::DoInstead(action) => self.do_instead(action),
            Command::Act(decision) => self.order(Order::Act(decision), Activity::Acting),
            Command::Run => self.order(Order::Run, Activity::Running),
            Command::RunBoth => self.run_both(),
            Command::Pause => {
                self.stop(Worker::pause);
                let shown: Vec<SessionId> = self.model.on_show().map(|session| session.id).collect();
                for id in shown {
                    if let Some(session) = self.model.session_of_mut(id) {
                        session.pausing = session.activity == Activity::Running;
                    }
                }
            }
            Command::Cancel => self.cancel(),
            Command::CancelOpening(id) => self.workers.get(&id).into_iter().for_each(Worker::cancel),
            Command::CancelTask(at) => self.tasks.under_way().get(at).into_iter().for_each(|task| task.cancel()),
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
            Command::CloseRecording => self.close_recording(),
            Command::TryScene => self.try_scene(),
            Command::EditScene => self.edit_scene(),
            Command::Browse(browsing) => self.model.browsing = browsing,
            Command::Tell(level, text) => self.model.toasts.tell(level, text),
        }
    }

    pub(super) fn tell(&mut self, level: Level, text: impl Into<String>) {
        self.model.toasts.tell(level, text);
    }

    /// Shows an open episode, in place of the scenes to choose from, a recording or the editor.
    pub(super) fn show(&mut self, id: SessionId) {
        if self.model.kept.layout == LayoutKind::Author {
            self.model.kept.layout = LayoutKind::Episode;
        }
        self.model.browsing = false;
        self.close_recording();
        self.model.show(id);
    }

    /// Shows another layout; only a comparison goes on after the shown episode's end.
    pub(super) fn lay_out(&mut self, layout: LayoutKind) {
        self.model.kept.layout = layout;
        self.model.browsing = false;
        self.close_recording();
        if layout == LayoutKind::Compare {
            self.choose_other();
        }
        self.model.go_to(self.model.cursor.min(self.model.last_step()));
    }

    /// Compares with the only other episode there is, unless another one was chosen.
    pub(super) fn choose_other(&mut self) {
        let mut others =
            self.model.sessions.iter().map(|session| session.id).filter(|id| Some(*id) != self.model.shown);
        if let (None, Some(only), None) = (self.model.other_session(), others.next(), others.next()) {
            self.model.other = Some(only);
        }
    }

    fn close_recording(&mut self) {
        if self.model.recording.take().is_some()
            && let Some(viewer) = &mut self.viewer
        {
            viewer.close_recording();
        }
    }

    pub(super) fn menu(&mut self, entry: MenuCommand) {
        match entry {
            MenuCommand::Scenes => {
                if self.model.kept.layout == LayoutKind::Author {
                    self.lay_out(LayoutKind::Episode);
                }
                self.close_recording();
                self.model.browsing = true;
            }
            MenuCommand::OpenScene | MenuCommand::OpenEpisode => self.browse(entry, ChosenFor::Opening),
            MenuCommand::Save => self.save(),
            MenuCommand::SaveSceneAs
            | MenuCommand::ExportEpisode
            | MenuCommand::ExportTables
            | MenuCommand::ExportPicture
            | MenuCommand::Share => self.ask_where(entry),
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
            MenuCommand::RunBoth => self.carry_out(Command::RunBoth),
            MenuCommand::Pause => self.carry_out(Command::Pause),
            MenuCommand::Cancel => {
                if self.dialog.take().is_none() {
                    self.cancel();
                }
            }
            MenuCommand::Branch => self.branch(),
            MenuCommand::EditScene => self.edit_scene(),
            MenuCommand::Layout(layout) => self.lay_out(layout),
            MenuCommand::ToggleTheme => self.model.kept.light = !self.model.kept.light,
            MenuCommand::ZoomIn => self.zoom_asked = Some(1.1),
            MenuCommand::ZoomOut => self.zoom_asked = Some(1.0 / 1.1),
            MenuCommand::ResetLayout => {
                self.model.kept.columns = Columns::default();
                self.reset_asked = true;
            }
            MenuCommand::Panel(column) => self.model.kept.columns.toggle(column, self.model.window),
            MenuCommand::Tour => {
                self.lay_out(LayoutKind::Episode);
                self.tour = Some(0);
            }
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
            Reply::Write(what, path, part) => {
                self.dialog = None;
                self.write(what, path, part);
            }
            Reply::Open(path) => {
                self.dialog = None;
                self.carry_out(Command::Open(path));
            }
            Reply::Export(id) => {
                self.carry_out(Command::Show(id));
                self.ask_where(MenuCommand::ExportEpisode);
            }
            Reply::Reopen(id) => {
                self.dialog = None;
                if let Some(path) = self.model.session_of(id).map(|session| session.path.clone()) {
                    self.close(id);
                    self.open(&path);
                }
            }
        }
    }

    /// Opens an episode on a thread of its own; what is in sight stays there until it is open.
    pub(super) fn spawn(&mut self, opening: Opening, begin: Begin) -> SessionId {
        let id = SessionId(self.next_id);
        self.next_id += 1;
        self.openings.insert(id, opening);
        self.begun.insert(begin.path().to_owned());
        let (events, wake) = (self.events.0.clone(), self.wake.clone());
        let worker = Worker::spawn(id, begin, self.catalog.clone(), events, wake, &self.options.threads);
        self.workers.insert(id, worker);
        id
    }

    fn start_chosen(&mut self) {
        let against = self.model.kept.form.against;
        match self.model.kept.form.scene.clone() {
            Some(path) => {
                if self.start(&path, against) {
                    self.remember(&path);
                }
            }
            None => self.tell(Level::Warning, "Choose a scene first"),
        }
    }

    /// Starts an episode of a scene's file, or two that run side by side; false if it is none.
    pub(super) fn start(&mut self, path: &Path, against: Option<PolicyKind>) -> bool {
        match Scene::load(path, &self.catalog) {
            Ok((scene, warnings)) => {
                for warning in warnings {
                    self.tell(Level::Warning, format!("{}: {warning}", path.display()));
                }
                self.model.kept.form.scene = Some(path.to_owned());
                let policy = self.model.kept.form.policy;
                match against {
                    None => {
                        self.start_scene(scene, policy);
                    }
                    Some(against) => {
                        let ids = [self.start_scene(scene.clone(), policy), self.start_scene(scene, against)];
                        self.pairs.push(Pair { ids });
                    }
                }
                true
            }
            Err(error) => {
                self.tell(Level::Error, error.to_string());
                false
            }
        }
    }

    fn start_scene(&mut self, scene: Scene, policy: PolicyKind) -> SessionId {
        let form = self.model.kept.form.clone();
        let config = EpisodeConfig {
            policy,
            belief: form.belief.clone(),
            seed: form.seed,
            budget: form.budget.max(1),
            views: form.views.trim().to_owned(),
            planner: form.planner,
            noise: form.noise,
        };
        let out = self.free_directory(&scene, &config, "");
        let title = format!("{}, {}, seed {}", scene.name, config.policy, config.seed);
        let begin = Begin::Start { scene: Box::new(scene), config: Box::new(config), out };
        self.spawn(Opening::of(title), begin)
    }

    /// Compares and runs two episodes that were started side by side, once both are open.
    pub(super) fn pair_up(&mut self) {
        let open = |model: &crate::workbench::model::Model, pair: &Pair| {
            pair.ids.iter().all(|id| model.session_of(*id).is_some_and(|session| session.activity == Activity::Idle))
        };
        // One that could not be opened leaves the other alone.
        self.pairs.retain(|pair| pair.ids.iter().all(|id| self.workers.contains_key(id)));
        if let Some(at) = self.pairs.iter().position(|pair| open(&self.model, pair)) {
            let [a, b] = self.pairs.remove(at).ids;
            self.carry_out(Command::Show(a));
            self.carry_out(Command::CompareWith(Some(b)));
            self.run_both();
        }
    }

    /// `out/<scene>-<policy>-<seed><suffix>`, with a number behind it if that is taken.
    fn free_directory(&self, scene: &Scene, config: &EpisodeConfig, suffix: &str) -> PathBuf {
        let plain = crate::driver::default_out(scene, config.policy, config.seed);
        let name = format!("{}{suffix}", plain.file_name().unwrap_or_default().to_string_lossy());
        let taken = |path: &PathBuf| path.exists() || self.begun.contains(path);
        let numbered = (2..).map(|n| self.options.out.join(format!("{name}-{n}")));
        std::iter::once(self.options.out.join(&name)).chain(numbered).find(|path| !taken(path)).unwrap_or(plain)
    }

    pub(super) fn close(&mut self, id: SessionId) {
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

    /// Gives the shown episode's worker an order, unless it is busy or done; says why not.
    fn order(&mut self, order: Order, activity: Activity) {
        let Some(id) = self.model.shown else { return self.tell(Level::Warning, "Open a scene first") };
        match self.order_to(id, order, activity) {
            Ok(()) => self.model.go_to(self.model.session().map_or(0, Session::steps)),
            Err((level, words)) => self.tell(level, words),
        }
    }

    fn order_to(&mut self, id: SessionId, order: Order, activity: Activity) -> Result<(), (Level, &'static str)> {
        let worker = self.workers.get(&id);
        let worker =
            worker.ok_or((Level::Warning, "This episode takes no more actions; branch from it to continue"))?;
        let session = self.model.session_of_mut(id).ok_or((Level::Warning, "The episode is not open"))?;
        if session.read_only.is_some() {
            return Err((Level::Warning, "This episode is read only; branch from it to continue"));
        }
        if session.is_finished() {
            return Err((Level::Info, "The budget is used up; branch from an earlier step to continue"));
        }
        match session.activity {
            Activity::Idle if !session.queued => session.activity = activity,
            // What was decided before holds for what was filed; a decision or a run can wait for the check.
            Activity::Checking { .. } if session.takes_orders() && matches!(order, Order::Decide | Order::Run) => {
                session.queued = true;
            }
            Activity::Checking { .. } => return Err((Level::Info, "Its log is still being checked; wait for that")),
            _ => return Err((Level::Info, "The episode is busy; cancel first")),
        }
        worker.order(order);
        Ok(())
    }

    /// Runs both episodes of the comparison, as far as they can be.
    fn run_both(&mut self) {
        let ids: Vec<SessionId> = self.model.shown.into_iter().chain(self.model.other).collect();
        let done: Vec<_> = ids.into_iter().map(|id| self.order_to(id, Order::Run, Activity::Running)).collect();
        if done.iter().all(Result::is_err) {
            if let Some(Err((level, words))) = done.into_iter().next() {
                self.tell(level, words);
            }
        } else {
            self.model.go_to(self.model.last_step());
        }
    }

    /// Does what a person chose: the decision keeps what was weighed, and says who chose.
    fn do_instead(&mut self, action: Action) {
        let weighed = self.model.session().and_then(|session| session.pending.clone());
        let decision = match weighed {
            Some(weighed) => Decision { action, reason: Reason::Manual, ..(*weighed).clone() },
            None => Decision::unweighed(action, Reason::Manual),
        };
        self.carry_out(Command::Act(Arc::new(decision)));
    }

    /// Puts the brake on what is on the window.
    fn stop(&mut self, brake: impl Fn(&Worker)) {
        let shown: Vec<SessionId> = self.model.on_show().map(|session| session.id).collect();
        for id in shown {
            // The check of a log goes on; what waits behind it is left.
            let checks = self.model.session_of(id).map(|session| matches!(session.activity, Activity::Checking { .. }));
            match self.workers.get(&id) {
                Some(worker) if checks == Some(true) => worker.forget(),
                Some(worker) => brake(worker),
                None => {}
            }
            if let Some(session) = self.model.session_of_mut(id) {
                session.queued = false;
            }
        }
    }

    fn cancel(&mut self) {
        self.stop(Worker::cancel);
        self.openings.keys().filter_map(|id| self.workers.get(id)).for_each(Worker::cancel);
        self.model.author.cancel_generating();
    }

    /// Starts an episode that shares the actions up to the cursor. What was decided there, and what was chosen to be looked
    /// at, holds in it as well.
    fn branch(&mut self) {
        let Some(session) = self.model.session() else { return };
        let (of, steps) = (session.record.clone(), self.model.cursor.min(session.steps()));
        let kept = Kept {
            decision: session.decision_after(steps).cloned().map(Arc::new),
            picked: self.model.picked,
            view: self.model.view,
            candidate: self.model.candidate,
        };
        let out = self.free_directory(&of.scene, &of.config, &branch_suffix(steps));
        let title = format!("{} from step {steps}", session.title());
        self.spawn(Opening { kept: Some(kept), ..Opening::of(title) }, Begin::Branch { of: Box::new(of), steps, out });
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
            return self.tell(Level::Warning, "The scene has problems; correct what is red first");
        }
        let scene = self.model.author.scene().clone();
        self.start_scene(scene, self.model.kept.form.policy);
    }
}
