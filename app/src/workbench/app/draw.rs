//! The window's frame: menus and tabs on top, the episode at the left, the clock at the bottom, and the layout's panels
//! around the three-dimensional views.

use super::App;
use crate::workbench::command::{Command, Level, MenuCommand};
use crate::workbench::menu::MENUS;
use crate::workbench::model::LayoutKind;
use crate::workbench::panels;
use crate::workbench::panels::tour::{self, Move, Spot};
use crate::workbench::part::Part;
use re_viewer::external::re_ui::RecordingCommandKind;
use re_viewer::external::{eframe, egui};
use std::time::Instant;

impl App {
    /// Draws the window; without a frame of eframe's the viewer is left out.
    pub fn draw(&mut self, ui: &mut egui::Ui, frame: Option<&mut eframe::Frame>) {
        let started = Instant::now();
        let ctx = ui.ctx().clone();
        self.before(&ctx);
        self.model.window = ctx.content_rect().size().into();
        let mut ask = Vec::new();
        egui::Panel::top("menus").show(ui, |ui| self.menus(ui, &mut ask));
        let clock = egui::Panel::bottom("clock").show(ui, |ui| panels::clock::show(ui, &mut self.model, &mut ask));
        tour::mark(&ctx, Spot::Clock, clock.response.rect);
        let openings: Vec<_> =
            self.openings.iter().map(|(id, opening)| (*id, opening.title.clone(), opening.activity)).collect();
        self.parts.clear();
        if self.model.recording.is_some() {
            egui::Panel::top("recording").show(ui, |ui| {
                self.recording_bar(ui, &mut ask);
                panels::episode::openings(ui, &openings, &mut ask);
            });
            self.space_view(ui, frame);
        } else if self.model.kept.layout == LayoutKind::Author {
            egui::CentralPanel::default().show(ui, |ui| panels::author::show(ui, &mut self.model, &mut ask));
        } else if self.model.sessions.is_empty() || self.model.browsing {
            egui::CentralPanel::default().show(ui, |ui| {
                panels::episode::openings(ui, &openings, &mut ask);
                panels::scenes::show(ui, &mut self.model, &mut ask);
            });
        } else {
            self.episode(ui, &openings, &mut ask);
            self.layout(ui, frame, &mut ask);
        }
        if let Some(ray) = self.ray.take() {
            self.point(ray);
        }
        self.over(&ctx, &mut ask);
        for command in ask {
            self.carry_out(command);
        }
        let viewer_ms = std::mem::take(&mut self.viewer_ms);
        self.last_viewer_ms = viewer_ms;
        if let Some(taken) = &mut self.frame_ms {
            *taken += started.elapsed().as_secs_f32() * 1e3 - viewer_ms;
        }
    }

    /// What only a frame can do: theme, zoom, pictures, the end.
    fn before(&mut self, ctx: &egui::Context) {
        if self.theme_set != Some(self.model.kept.light) {
            self.theme_set = Some(self.model.kept.light);
            ctx.set_theme(if self.model.kept.light { egui::Theme::Light } else { egui::Theme::Dark });
        }
        if let Some(factor) = self.zoom_asked.take() {
            ctx.set_zoom_factor((ctx.zoom_factor() * factor).clamp(0.5, 3.0));
        }
        if std::mem::take(&mut self.reset_asked) {
            ctx.memory_mut(|memory| memory.reset_areas());
            ctx.data_mut(|data| data.clear());
            self.tell_graphics(ctx);
        }
        if std::mem::take(&mut self.picture_asked) {
            ctx.send_viewport_cmd(egui::ViewportCommand::Screenshot(egui::UserData::default()));
        }
        if std::mem::take(&mut self.quit_asked) {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    fn menus(&mut self, ui: &mut egui::Ui, ask: &mut Vec<Command>) {
        egui::MenuBar::new().ui(ui, |ui| {
            for (name, entries) in MENUS {
                ui.menu_button(name, |ui| {
                    for entry in entries {
                        match entry {
                            None => {
                                ui.separator();
                            }
                            Some(entry) => {
                                if self.entry(ui, *entry).clicked() {
                                    ask.push(Command::Menu(*entry));
                                    ui.close();
                                }
                            }
                        }
                    }
                    if name == "File" {
                        self.recent(ui, ask);
                    }
                });
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                for layout in LayoutKind::ALL.into_iter().rev() {
                    let entry = MenuCommand::Layout(layout);
                    let is_shown = self.model.kept.layout == layout;
                    let tab = ui.selectable_label(is_shown, layout.title());
                    // A menu has the same name as one of them.
                    tab.widget_info(|| {
                        let name = format!("Layout {}", layout.title());
                        egui::WidgetInfo::selected(egui::WidgetType::Button, true, is_shown, name)
                    });
                    if tab.on_hover_text(tooltip(ui.ctx(), entry)).clicked() {
                        ask.push(Command::Layout(layout));
                    }
                }
                tour::mark(ui.ctx(), Spot::Layouts, ui.min_rect());
                if let Some(port) = self.model.serving {
                    ui.separator();
                    ui.label(format!("● serving 127.0.0.1:{port}")).on_hover_text(format!(
                        "Programs on this machine can look on: rerun --connect rerun+http://127.0.0.1:{port}/proxy"
                    ));
                }
            });
        });
    }

    fn entry(&self, ui: &mut egui::Ui, entry: MenuCommand) -> egui::Response {
        let is_open = matches!(entry, MenuCommand::Panel(column) if self.model.shows(column));
        let mut button = egui::Button::new(entry.title()).selected(is_open);
        if let Some(keys) = entry.shortcut() {
            button = button.shortcut_text(ui.ctx().format_shortcut(&keys));
        }
        ui.add_enabled(entry.is_available(&self.model), button).on_hover_text(entry.tooltip())
    }

    fn recent(&self, ui: &mut egui::Ui, ask: &mut Vec<Command>) {
        if self.model.kept.recent.is_empty() {
            return;
        }
        ui.separator();
        ui.menu_button("Open recent", |ui| {
            for path in &self.model.kept.recent {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                if ui.button(name).on_hover_text(path.display().to_string()).clicked() {
                    ask.push(Command::Open(path.clone()));
                    ui.close();
                }
            }
        });
    }

    /// The three-dimensional views, or why there are none.
    pub(super) fn space_view(&mut self, ui: &mut egui::Ui, frame: Option<&mut eframe::Frame>) {
        let started = Instant::now();
        self.parts.push((Part::Space, ui.available_rect_before_wrap()));
        tour::mark(ui.ctx(), Spot::Space, ui.available_rect_before_wrap());
        match (&mut self.viewer, frame) {
            (Some(viewer), Some(frame)) => {
                let (ctx, space) = (ui.ctx().clone(), ui.available_rect_before_wrap());
                viewer.ui(ui, frame);
                self.ray = viewer.clicked_ray(&ctx, space);
            }
            _ => {
                egui::CentralPanel::default().show(ui, |ui| {
                    ui.centered_and_justified(|ui| {
                        let reason = self.no_viewer.as_deref().unwrap_or("no window");
                        ui.weak(format!("No three-dimensional views: {reason}"));
                    });
                });
            }
        }
        self.viewer_ms = started.elapsed().as_secs_f32() * 1e3;
    }

    /// What lies over everything: dropped files, dialogs, toasts.
    fn over(&mut self, ctx: &egui::Context, ask: &mut Vec<Command>) {
        let hovering = ctx.input(|input| !input.raw.hovered_files.is_empty());
        if hovering {
            let painter = ctx.layer_painter(egui::LayerId::new(egui::Order::Foreground, egui::Id::new("drop")));
            let screen = ctx.content_rect();
            painter.rect_filled(screen, 0.0, egui::Color32::from_black_alpha(160));
            painter.text(
                screen.center(),
                egui::Align2::CENTER_CENTER,
                "Drop a scene, an episode or a recording",
                egui::FontId::proportional(22.0),
                egui::Color32::WHITE,
            );
        }
        if let Some(dialog) = &mut self.dialog
            && let Some(reply) = panels::windows::show(ctx, dialog)
        {
            self.reply(reply);
        }
        self.lead(ctx);
        panels::windows::tasks(ctx, self.tasks.under_way(), ask);
        panels::windows::toasts(ctx, &mut self.model.toasts, ask);
    }

    /// The tour: shown to whoever is new as soon as an episode has something to show.
    fn lead(&mut self, ctx: &egui::Context) {
        let is_ready =
            self.dialog.is_none() && self.model.shows_episode() && self.model.kept.layout == LayoutKind::Episode;
        let has_steps = self.model.session().is_some_and(|session| session.steps() > 0);
        if self.is_new && is_ready && has_steps {
            (self.is_new, self.tour) = (false, Some(0));
        }
        let Some(at) = self.tour.filter(|_| is_ready) else { return };
        match panels::tour::show(ctx, at, |spot| tour::marked(ctx, spot)) {
            Some(Move::To(stop)) => self.tour = Some(stop),
            Some(Move::End) => (self.tour, self.model.kept.toured) = (None, true),
            None => (),
        }
    }

    /// The recording that is looked at, and its clock.
    fn recording_bar(&mut self, ui: &mut egui::Ui, ask: &mut Vec<Command>) {
        ui.horizontal(|ui| {
            let name = self.model.recording.as_ref().map(|path| path.display().to_string());
            ui.label(format!("Recording {}", name.unwrap_or_default()));
            let steps = [
                ("⏮", "Beginning of the recording", RecordingCommandKind::PlaybackBeginning),
                ("⏴", "A step back in the recording", RecordingCommandKind::PlaybackStepBack),
                ("⏯", "Play or pause the recording", RecordingCommandKind::PlaybackTogglePlayPause),
                ("⏵", "A step on in the recording", RecordingCommandKind::PlaybackStepForward),
                ("⏭", "End of the recording", RecordingCommandKind::PlaybackEndAndFollow),
            ];
            for (icon, words, kind) in steps {
                let button = ui.button(icon);
                button.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, words));
                if let Some(viewer) = self.viewer.as_mut().filter(|_| button.on_hover_text(words).clicked()) {
                    viewer.play(kind);
                }
            }
            let back = if self.model.sessions.is_empty() { "Back to the scenes" } else { "Back to the episode" };
            if ui.button(back).on_hover_text("Closes the recording (Esc); its file stays as it is").clicked() {
                ask.push(Command::CloseRecording);
            }
        });
    }

    /// Keeps the name of the graphics driver where the box about versions finds it.
    pub(super) fn tell_graphics(&self, ctx: &egui::Context) {
        let name = self.graphics.clone();
        ctx.data_mut(|data| data.insert_temp(panels::windows::graphics_id(), name));
    }

    /// Adds a message.
    pub fn say(&mut self, level: Level, text: &str) {
        self.model.toasts.tell(level, text);
    }
}

/// A tooltip with the entry's keys.
fn tooltip(ctx: &egui::Context, entry: MenuCommand) -> String {
    match entry.shortcut() {
        Some(keys) => format!("{} ({})", entry.tooltip(), ctx.format_shortcut(&keys)),
        None => entry.tooltip().to_owned(),
    }
}
