//! What comes in every frame: events of workers, answers of jobs, clicks in the viewer, keys, dropped files.

use super::{App, Chosen, ChosenFor};
use crate::annotations::Annotations;
use crate::workbench::command::{Command, Level, MenuCommand};
use crate::workbench::derive::Derived;
use crate::workbench::dialog::Dialog;
use crate::workbench::model::{LayoutKind, Picked};
use crate::workbench::part::Part;
use crate::workbench::ray::Ray;
use crate::workbench::session::{Activity, Session, SessionId};
use crate::workbench::space::{Side, Space, at, hit};
use crate::workbench::viewer::{Clicked, Viewer};
use crate::workbench::worker::{Checked, Event, Opened};
use re_viewer::external::egui;
use std::sync::{Arc, PoisonError};

/// Frames after everything is done before a script's picture is taken, so that what was logged is drawn.
const CALM_FRAMES: usize = 20;
/// How many states keep their maps and full beliefs.
const DERIVED_KEPT: usize = 6;

impl App {
    pub(super) fn take_in(&mut self, ctx: &egui::Context) {
        while let Ok((id, event)) = self.events.1.try_recv() {
            self.hear(id, event);
        }
        self.answers();
        if let Some(clicked) = self.viewer.as_mut().and_then(|viewer| viewer.clicked()) {
            self.click(&clicked);
        }
        self.keys(ctx);
        self.dropped(ctx);
        self.picture(ctx);
        self.pair_up();
        self.follow_gain();
        self.follow_push();
        self.follow_changes();
        self.derive();
        self.space();
        self.quitting(ctx);
        self.script();
    }

    fn hear(&mut self, id: SessionId, event: Event) {
        match event {
            // One that was closed meanwhile has no worker any more.
            Event::Opened(opened) if self.workers.contains_key(&id) => self.opened(id, *opened),
            Event::Opened(_) => {}
            Event::Repeated(moment) => {
                let session = self.model.session_of_mut(id);
                if let Some(shown) = session.and_then(|session| session.moments.get_mut(moment.step)) {
                    *shown = moment;
                }
            }
            Event::Checked(checked) => self.checked(id, *checked),
            Event::Unchecked(words) => {
                if let Some(session) = self.model.session_of_mut(id) {
                    session.read_only = Some(words.clone());
                }
                self.model.toasts.tell(Level::Error, words);
            }
            Event::Activity(activity) => {
                if let Some(opening) = self.openings.get_mut(&id) {
                    opening.activity = activity;
                } else if let Some(session) = self.model.session_of_mut(id) {
                    session.queued &= !matches!(activity, Activity::Deciding | Activity::Running);
                    session.pausing &= activity != Activity::Idle;
                    session.activity = activity;
                }
            }
            Event::Decided(decision) => {
                if let Some(session) = self.model.session_of_mut(id) {
                    session.pending = Some(decision);
                }
            }
            Event::Stepped(moment) => {
                // Who looks at the latest state goes on looking at the latest.
                let followed = self.model.cursor >= self.model.last_step();
                let Some(session) = self.model.session_of_mut(id) else { return };
                if let Some(outcome) = &moment.outcome {
                    session.record.steps.push(outcome.record.clone());
                }
                session.moments.push(moment);
                session.pending = None;
                if followed {
                    self.model.go_to(self.model.last_step());
                }
            }
            Event::Failed(words) => {
                self.openings.remove(&id);
                match self.model.session_of_mut(id) {
                    Some(session) => session.queued = false,
                    None => drop(self.workers.remove(&id)),
                }
                if words != "cancelled" {
                    self.model.toasts.tell(Level::Error, words);
                }
            }
            Event::Panicked(words) => {
                self.openings.remove(&id);
                self.workers.remove(&id);
                if let Some(session) = self.model.session_of_mut(id) {
                    (session.activity, session.queued) = (Activity::Idle, false);
                    session.read_only = Some("a fault of the program stopped it".to_owned());
                    let (path, steps) = (session.path.clone(), session.steps());
                    self.dialog = Some(Dialog::Broke { id, words, path, steps });
                } else {
                    self.model.toasts.tell(Level::Error, format!("The episode could not be opened: {words}"));
                }
            }
        }
    }

    /// Takes over what repeating the log of an opened episode brought.
    fn checked(&mut self, id: SessionId, checked: Checked) {
        let reason = checked.read_only.clone().filter(|_| !self.options.look_only);
        let Some(session) = self.model.session_of_mut(id) else { return };
        (session.record, session.setup, session.read_only) = (checked.record, checked.setup, checked.read_only);
        if let Some(reason) = reason {
            self.model.toasts.tell(Level::Warning, format!("Opened read only: {reason}"));
        }
    }

    fn opened(&mut self, id: SessionId, opened: Opened) {
        let opening = self.openings.remove(&id);
        if let Some(path) = opening.as_ref().and_then(|opening| opening.remember.as_ref()) {
            self.remember(path);
        }
        let annotations = match Annotations::read(&opened.path) {
            Ok(annotations) => annotations,
            Err(error) => {
                self.model.toasts.tell(Level::Warning, format!("{error}; its notes are left out"));
                Annotations::default()
            }
        };
        let steps = opened.moments.len() - 1;
        let is_whole = opened.moments.iter().all(|moment| moment.is_whole);
        let activity = if is_whole {
            Activity::Opening { done: steps, of: steps }
        } else {
            Activity::Checking { done: 0, of: steps }
        };
        self.model.sessions.push(Session {
            id,
            path: opened.path,
            record: opened.record,
            setup: opened.setup,
            moments: opened.moments,
            pending: opening.as_ref().and_then(|opening| opening.kept.as_ref()?.decision.clone()),
            activity,
            queued: false,
            pausing: false,
            read_only: opened.read_only,
            annotations,
            unsaved: false,
        });
        // Only what could be opened takes the place of what was in sight.
        self.show(id);
        if let Some(kept) = opening.and_then(|opening| opening.kept) {
            let model = &mut self.model;
            (model.picked, model.view, model.candidate) = (kept.picked, kept.view, kept.candidate);
        }
        if self.model.kept.layout == LayoutKind::Compare {
            self.choose_other();
        }
    }

    /// What was made in the background, what tasks have to say, and what was chosen in the system's dialogs.
    fn answers(&mut self) {
        let background = &self.background;
        for (_, derived) in background.maps.take().into_iter().chain(background.other_maps.take()) {
            self.model.derived.insert(derived.of, Arc::new(derived));
        }
        if let Some((_, preview)) = background.preview.take() {
            self.model.preview = Some(preview);
        }
        if let Some((_, (of, largest))) = background.changes.take() {
            self.model.largest = Some((of, Arc::new(largest)));
        }
        if let Some((_, source)) = background.gain.take() {
            self.model.gain_source = Some(source);
        }
        for words in background.broke() {
            self.model.toasts.tell(Level::Error, format!("A computation in the background failed: {words}"));
        }
        for (level, words) in self.tasks.ended() {
            self.model.toasts.tell(level, words);
        }
        while let Ok(chosen) = self.chosen.1.try_recv() {
            match (chosen, &mut self.dialog) {
                (Chosen::Path(ChosenFor::Opening, path), _) => self.carry_out(Command::Open(path)),
                (Chosen::Path(ChosenFor::Dialog, path), Some(dialog)) => dialog.chosen(&path),
                (Chosen::Path(ChosenFor::Dialog, _), None) => {}
                (Chosen::NoDialog(ChosenFor::Opening, what), _) => {
                    self.dialog = Some(Dialog::OpenPath { what, path: String::new() });
                }
                (Chosen::NoDialog(ChosenFor::Dialog, _), _) => {
                    let words = "No file dialog of the system answered here: type the path";
                    self.model.toasts.tell(Level::Warning, words);
                }
            }
        }
    }

    /// A click in three dimensions asks about the voxel under the pointer, or, in Why, about the floor cell where no voxel is.
    pub(super) fn point(&mut self, ray: Ray) {
        let layout = self.model.kept.layout;
        let Some(moment) = self.model.moment() else { return };
        let found = hit::first(moment.belief.grid(), &self.drawn, at::BELIEF, ray);
        let voxel = found.filter(|found| matches!(found, Picked::Voxel(_)));
        match layout {
            LayoutKind::Why if found.is_some() => self.carry_out(Command::Pick(found)),
            // What lies in front of the voxel may be meant: the viewer tells in a later frame.
            LayoutKind::Episode if self.model.kept.display.views || self.model.kept.display.pushes => {
                self.pointed = voxel;
            }
            LayoutKind::Episode if voxel.is_some() => self.carry_out(Command::Pick(voxel)),
            _ => {}
        }
    }

    /// A click in three dimensions, as the viewer tells it.
    fn click(&mut self, clicked: &Clicked) {
        let pointed = self.pointed.take();
        if self.model.recording.is_some() || self.model.kept.layout == LayoutKind::Why {
            // Of a foreign recording nothing is known but what the viewer shows; in Why only voxels and cells are asked about.
            return;
        }
        if clicked.entity == at::VIEWS
            && let Some(view) = clicked.instance
        {
            self.carry_out(Command::GainOf(nudge_core::camera::ViewId(view as u16)));
        } else if clicked.entity == at::CANDIDATES {
            self.model.candidate = clicked.instance;
            let decision = self.model.session().and_then(|session| session.decision_after(self.model.cursor));
            let candidate = clicked.instance.and_then(|at| decision?.candidates.get(at));
            if let Some(push) = candidate.map(|candidate| candidate.manipulation) {
                self.carry_out(Command::Preview(push));
            }
        } else if pointed.is_some() {
            self.carry_out(Command::Pick(pointed));
        }
    }

    /// Shortcuts are taken before the viewer sees them, and mean what is in sight: a text field, an open menu and a question
    /// keep their keys.
    fn keys(&mut self, ctx: &egui::Context) {
        let (typing, focused) = (ctx.text_edit_focused(), ctx.memory(|memory| memory.focused().is_some()));
        let menu = egui::Popup::is_any_open(ctx);
        let authoring = self.model.kept.layout == LayoutKind::Author;
        // The longer ones first: a shortcut also answers to more modifiers than its own.
        let mut entries: Vec<_> = MenuCommand::all().filter_map(|entry| Some((entry, entry.shortcut()?))).collect();
        entries.sort_by_key(|(_, keys)| !keys.modifiers.shift);
        for (entry, keys) in entries {
            let plain = keys.modifiers.is_none();
            // Undo and the keys without a modifier belong to whatever is typed in, and the editor has its own.
            let edits =
                matches!(entry, MenuCommand::Undo | MenuCommand::Redo | MenuCommand::Duplicate | MenuCommand::Delete);
            if (self.dialog.is_some() || self.tour.is_some()) && entry != MenuCommand::Quit {
                continue;
            }
            if (plain && (typing || menu)) || (edits && (typing || authoring)) {
                continue;
            }
            if plain && entry != MenuCommand::Cancel && entry != MenuCommand::Shortcuts && authoring {
                continue;
            }
            // Enter presses the button that has the focus.
            if keys.logical_key == egui::Key::Enter && focused {
                continue;
            }
            let back = if entry == MenuCommand::Cancel { self.way_back() } else { None };
            let available = back.is_some() || entry.is_available(&self.model);
            // The viewer has meanings of its own for some of them.
            let taken = (available || !plain) && ctx.input_mut(|input| input.consume_shortcut(&keys));
            if taken && available {
                self.carry_out(back.unwrap_or(Command::Menu(entry)));
            }
        }
        // Left and right scrub the clock, unless something has the focus that they move in.
        for (key, entry) in
            [(egui::Key::ArrowLeft, MenuCommand::StepBack), (egui::Key::ArrowRight, MenuCommand::StepForward)]
        {
            let asked = self.dialog.is_some() || self.tour.is_some();
            let free = !typing && !focused && !menu && !asked && self.model.shows_episode();
            if free
                && ctx.input_mut(|input| input.consume_key(egui::Modifiers::NONE, key))
                && entry.is_available(&self.model)
            {
                self.carry_out(Command::Menu(entry));
            }
        }
    }

    /// Where Escape goes back to from what is in an episode's place.
    fn way_back(&self) -> Option<Command> {
        if self.model.recording.is_some() {
            Some(Command::CloseRecording)
        } else {
            (self.model.browsing && !self.model.sessions.is_empty()).then_some(Command::Browse(false))
        }
    }

    fn dropped(&mut self, ctx: &egui::Context) {
        let files = ctx.input_mut(|input| std::mem::take(&mut input.raw.dropped_files));
        for path in files.iter().map(|file| file.path().to_path_buf()) {
            self.carry_out(Command::Open(path));
        }
    }

    /// Writes the picture of the window that was asked for, once it is there.
    fn picture(&mut self, ctx: &egui::Context) {
        let taken = ctx.input(|input| {
            input.events.iter().find_map(|event| match event {
                egui::Event::Screenshot { image, .. } => Some(image.clone()),
                _ => None,
            })
        });
        if let (Some(image), true) = (taken, self.picture_to.is_some())
            && let Some((part, path)) = self.picture_to.take()
        {
            self.write_picture(image, part, path, ctx.pixels_per_point());
        }
    }

    /// Asks for the maps of the states that are shown.
    fn derive(&mut self) {
        let wanted: Vec<_> = self
            .model
            .on_show()
            .map(|session| (session.id, session.moment(self.model.cursor).clone(), session.setup.catalog.clone()))
            .collect();
        for ((id, moment, catalog), other) in wanted.into_iter().zip([false, true]) {
            let key = (id, moment.step);
            if self.model.derived.contains_key(&key) || !self.model.deriving.insert(key) {
                continue;
            }
            let maps = if other { &mut self.background.other_maps } else { &mut self.background.maps };
            maps.ask(move |_| Some(Derived::of(id, &moment, &catalog)));
        }
        // A request that was replaced while it waited must be made again when its state is shown again.
        let wanted: Vec<_> = [self.model.shown, self.model.other]
            .into_iter()
            .flatten()
            .filter_map(|id| Some((id, self.model.session_of(id)?.moment(self.model.cursor).step)))
            .collect();
        self.model.deriving.retain(|key| wanted.contains(key));
        while self.model.derived.len() > DERIVED_KEPT {
            let Some(far) = self.model.derived.keys().find(|key| !wanted.contains(key)).copied() else { break };
            self.model.derived.remove(&far);
        }
    }

    /// Asks for the three-dimensional views, if something about them has changed. Not while a foreign recording is looked
    /// at: the viewer goes to where a layout is sent.
    fn space(&mut self) {
        let Some(painter) = self.painter.as_ref().filter(|_| self.model.recording.is_none()) else { return };
        // Where the views are is known once they were drawn.
        let place = self.parts.iter().find(|(part, _)| *part == Part::Space).map(|(_, rect)| rect.aspect_ratio());
        let Some(aspect) = place.filter(|aspect| aspect.is_finite()) else { return };
        let model = &self.model;
        let side = |session: &Session| Side::of(session, model.cursor);
        let kept = &model.kept;
        let motion_s =
            model.session().and_then(|session| model.scrubbed.at_s((session.id, model.cursor.min(session.steps()))));
        // What repeating an opened episode's actions brings is drawn once it is there.
        let is_whole = |session: Option<&Session>| {
            session.map(|session| {
                let from = model.cursor.saturating_sub(1).min(session.steps());
                session.moments[from..].iter().take(3).map(|moment| moment.is_whole).collect::<Vec<_>>()
            })
        };
        let whole = [is_whole(model.session()), is_whole(model.other_session())];
        let key = format!(
            "{motion_s:?} {whole:?} {:?} {aspect:.2} {} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?}",
            kept.layout,
            kept.light,
            model.session().map(|session| (session.id, session.steps(), session.pending.is_some())),
            model.other_session().map(|session| (session.id, session.steps())),
            model.cursor,
            kept.display,
            model.hovered,
            model.picked,
            model.view,
            model.candidate,
            model.preview.as_ref().map(|preview| (preview.of, preview.manipulation)),
            model.gain_source.as_ref().map(|source| (source.of, source.view)),
        );
        if key == self.asked_space {
            return;
        }
        self.asked_space = key;
        let space = Space {
            layout: kept.layout,
            aspect,
            light: kept.light,
            side: model.session().map(side),
            other: model.other_session().filter(|_| kept.layout == LayoutKind::Compare).map(side),
            display: kept.display.clone(),
            hovered: model.hovered,
            picked: model.picked,
            view: model.view,
            candidate: model.candidate,
            preview: model.preview.clone(),
            gain: model.gain_source.clone(),
            motion_s,
        };
        let painter = painter.clone();
        self.background.space.ask(move |_| {
            painter.lock().unwrap_or_else(PoisonError::into_inner).paint(&space);
            Some(())
        });
    }

    /// Goes on with what shall be done without a person.
    fn script(&mut self) {
        let Some(script) = self.options.script.clone() else { return };
        (self.wake)();
        if self.is_busy() || self.viewer.as_ref().is_some_and(Viewer::is_loading) {
            return;
        }
        let done = self.model.session().map_or(0, Session::steps);
        if self.model.sessions.is_empty() {
            // Nothing was opened; the toast that says why is on the picture.
        } else if done < script.steps && self.model.session().is_some_and(|session| !session.is_finished()) {
            return self.carry_out(Command::DoIt);
        }
        self.script_frames += 1;
        match self.script_frames {
            CALM_FRAMES => (self.picture_to, self.picture_asked) = (Some((Part::Window, script.picture)), true),
            frames if frames > CALM_FRAMES && self.picture_to.is_none() => {
                (self.may_quit, self.quit_asked) = (true, true);
            }
            _ => {}
        }
    }

    fn quitting(&mut self, ctx: &egui::Context) {
        if !ctx.input(|input| input.viewport().close_requested()) || self.may_quit {
            return;
        }
        let lost = self.unsaved();
        if !lost.is_empty() {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.dialog = Some(Dialog::Quit { lost });
        }
    }
}
