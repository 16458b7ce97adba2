//! Dialogs and toasts.

use crate::workbench::command::{Command, Level, MenuCommand};
use crate::workbench::dialog::{Dialog, Reply};
use crate::workbench::part::Part;
use crate::workbench::session::SessionId;
use crate::workbench::tasks::Task;
use crate::workbench::toasts::Toasts;
use re_viewer::external::egui;
use std::path::{Path, PathBuf};

/// Draws an open question; the answer, once there is one.
pub fn show(ctx: &egui::Context, dialog: &mut Dialog) -> Option<Reply> {
    let mut reply = None;
    let modal = egui::Modal::new(egui::Id::new("dialog")).show(ctx, |ui| match dialog {
        Dialog::WriteTo { what, path, part } => reply = write_to(ui, *what, path, part),
        Dialog::OpenPath { what, path } => reply = open_path(ui, *what, path),
        Dialog::Broke { id, words, path, steps } => reply = broke(ui, *id, words, path, *steps),
        Dialog::Quit { lost } => reply = quit(ui, lost),
        Dialog::Shortcuts => shortcuts(ui),
        Dialog::About => about(ui),
    });
    if matches!(dialog, Dialog::Shortcuts | Dialog::About) {
        let closed = modal.response.ctx.input(|input| input.key_pressed(egui::Key::Escape));
        if closed {
            reply = Some(Reply::Close);
        }
    }
    if modal.should_close() {
        reply = Some(Reply::Close);
    }
    reply
}

fn write_to(ui: &mut egui::Ui, what: MenuCommand, path: &mut String, part: &mut Part) -> Option<Reply> {
    ui.set_width(520.0);
    ui.heading(what.title().trim_end_matches('…'));
    ui.label(what.tooltip());
    ui.add_space(6.0);
    let mut reply = None;
    if what == MenuCommand::ExportPicture {
        ui.horizontal(|ui| {
            let label = ui.label("Picture of");
            let combo = egui::ComboBox::from_id_salt("picture of").selected_text(part.title()).width(240.0);
            let combo = combo.show_ui(ui, |ui| {
                for choice in Part::ALL {
                    ui.selectable_value(part, choice, choice.title());
                }
            });
            combo.response.labelled_by(label.id).on_hover_text("Which part of the window the picture shows");
        });
    }
    ui.horizontal(|ui| {
        let label = ui.label("Write to");
        ui.add(egui::TextEdit::singleline(path).desired_width(340.0))
            .labelled_by(label.id)
            .on_hover_text("A path; folders on the way are made");
        if ui.button("Browse…").on_hover_text("Choose a place in the system's dialog").clicked() {
            reply = Some(Reply::Browse(what));
        }
    });
    ui.add_space(6.0);
    ui.horizontal(|ui| {
        if ui
            .add_enabled(!path.trim().is_empty(), egui::Button::new("Write"))
            .on_hover_text("Write it there")
            .on_disabled_hover_text("Type a path first")
            .clicked()
        {
            reply = Some(Reply::Write(what, PathBuf::from(path.trim()), *part));
        }
        if ui.button("Do not write").on_hover_text("Nothing is written").clicked() {
            reply = Some(Reply::Close);
        }
    });
    reply
}

fn open_path(ui: &mut egui::Ui, what: MenuCommand, path: &mut String) -> Option<Reply> {
    ui.set_width(520.0);
    ui.heading(what.title().trim_end_matches('…'));
    ui.label("No file dialog of the system answered here. Type the path, or drop the file on the window.");
    ui.add_space(6.0);
    let typed = ui
        .horizontal(|ui| {
            let label = ui.label("Path");
            let field = egui::TextEdit::singleline(path).desired_width(400.0).hint_text("scenes/high/key-blocker.toml");
            let field = ui.add(field).labelled_by(label.id).on_hover_text(what.tooltip());
            if path.is_empty() && !field.has_focus() && !field.lost_focus() {
                field.request_focus();
            }
            field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter))
        })
        .inner;
    ui.add_space(6.0);
    let mut reply = None;
    ui.horizontal(|ui| {
        let is_there = !path.trim().is_empty();
        let open = ui.add_enabled(is_there, egui::Button::new("Open")).on_disabled_hover_text("Type a path first");
        if open.on_hover_text("Opens it").clicked() || (typed && is_there) {
            reply = Some(Reply::Open(PathBuf::from(path.trim())));
        }
        if ui.button("Open nothing").on_hover_text("Goes back to the window").clicked() {
            reply = Some(Reply::Close);
        }
    });
    reply
}

fn broke(ui: &mut egui::Ui, id: SessionId, words: &str, path: &Path, steps: usize) -> Option<Reply> {
    ui.set_width(460.0);
    ui.heading("The episode stopped");
    ui.label(format!("The program met a fault in it: {words}"));
    let actions = if steps == 1 { "1 action is".to_owned() } else { format!("All {steps} actions are") };
    ui.label(format!("{actions} saved in {}. The window and other episodes are as they were.", path.display()));
    ui.add_space(6.0);
    let mut reply = None;
    ui.horizontal(|ui| {
        let export = ui.button("Export episode…").on_hover_text("Write a copy with its notes and one recording");
        if export.clicked() {
            reply = Some(Reply::Export(id));
        }
        let reopen = ui.button("Open it again").on_hover_text("Close it, and resume from what is saved");
        if reopen.clicked() {
            reply = Some(Reply::Reopen(id));
        }
        if ui.button("Keep it as it is").on_hover_text("It can still be looked at and branched from").clicked() {
            reply = Some(Reply::Close);
        }
    });
    reply
}

fn quit(ui: &mut egui::Ui, lost: &[String]) -> Option<Reply> {
    ui.set_width(420.0);
    ui.heading("Quit with unsaved work?");
    ui.label("Episodes are written as they run. Not saved yet:");
    for what in lost {
        ui.label(format!("•  {what}"));
    }
    ui.add_space(6.0);
    let mut reply = None;
    ui.horizontal(|ui| {
        if ui.button("Save and quit").on_hover_text("Writes the notes and the scene, then ends").clicked() {
            reply = Some(Reply::SaveAndQuit);
        }
        if ui.button("Quit without saving").on_hover_text("What is listed is lost").clicked() {
            reply = Some(Reply::Quit);
        }
        if ui.button("Stay").on_hover_text("Goes back to the window").clicked() {
            reply = Some(Reply::Close);
        }
    });
    reply
}

fn shortcuts(ui: &mut egui::Ui) {
    ui.heading("Keyboard shortcuts");
    let entries: Vec<MenuCommand> = MenuCommand::all().filter(|entry| entry.shortcut().is_some()).collect();
    let half = entries.len().div_ceil(2);
    ui.horizontal_top(|ui| {
        for (at, part) in entries.chunks(half).enumerate() {
            egui::Grid::new(("shortcuts", at)).num_columns(2).spacing([16.0, 4.0]).striped(true).show(ui, |ui| {
                for entry in part {
                    let keys = entry.shortcut().map(|keys| ui.ctx().format_shortcut(&keys)).unwrap_or_default();
                    ui.monospace(keys);
                    ui.label(entry.title()).on_hover_text(entry.tooltip());
                    ui.end_row();
                }
            });
            ui.add_space(20.0);
        }
    });
    ui.weak("← and → step through the episode; in the editor, arrows move and R turns objects. Esc closes this.");
}

fn about(ui: &mut egui::Ui) {
    ui.set_width(380.0);
    ui.heading("Nudge");
    ui.label("A workbench for manipulation-enhanced mapping: look, push, and know how sure you are.");
    ui.add_space(6.0);
    egui::Grid::new("versions").num_columns(2).spacing([16.0, 2.0]).show(ui, |ui| {
        let viewer = re_viewer::build_info();
        let graphics = ui.data(|data| data.get_temp::<String>(graphics_id())).unwrap_or_else(|| "none".to_owned());
        for (name, version) in [
            ("Nudge", nudge_core::VERSION.to_owned()),
            ("Rerun viewer", viewer.version.to_string()),
            ("compiled by", format!("rustc {}", viewer.rustc_version)),
            ("for", viewer.target_triple.to_string()),
            ("graphics", graphics),
        ] {
            ui.weak(name);
            ui.monospace(version);
            ui.end_row();
        }
    });
    ui.add_space(6.0);
    ui.label("MIT or Apache-2.0, as you like. No network access, no analytics, no open port.");
    ui.weak("Esc closes this.");
}

/// Where the name of the graphics driver is kept for the box about versions.
pub fn graphics_id() -> egui::Id {
    egui::Id::new("graphics driver")
}

/// Draws the tasks under way at the lower left, each with its progress.
pub fn tasks(ctx: &egui::Context, tasks: &[Task], ask: &mut Vec<Command>) {
    if tasks.is_empty() {
        return;
    }
    egui::Area::new(egui::Id::new("tasks")).anchor(egui::Align2::LEFT_BOTTOM, [12.0, -40.0]).show(ctx, |ui| {
        for (at, task) in tasks.iter().enumerate() {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.set_max_width(420.0);
                ui.label(&task.title);
                ui.horizontal(|ui| {
                    ui.add(egui::ProgressBar::new(task.share()).desired_width(240.0).show_percentage());
                    let cancel = ui.add_enabled(!task.is_cancelled(), egui::Button::new("Cancel").small());
                    cancel.widget_info(|| {
                        let name = format!("Cancel: {}", task.title);
                        egui::WidgetInfo::labeled(egui::WidgetType::Button, !task.is_cancelled(), name)
                    });
                    if cancel.on_hover_text("Stop; nothing half-written is left").clicked() {
                        ask.push(Command::CancelTask(at));
                    }
                });
            });
        }
    });
}

/// Draws the messages at the lower right.
pub fn toasts(ctx: &egui::Context, toasts: &mut Toasts, _ask: &mut Vec<Command>) {
    let shown = toasts.shown().to_vec();
    if shown.is_empty() {
        return;
    }
    // They fade by themselves.
    ctx.request_repaint_after(std::time::Duration::from_millis(500));
    let mut closed = None;
    egui::Area::new(egui::Id::new("toasts")).anchor(egui::Align2::RIGHT_BOTTOM, [-12.0, -40.0]).show(ctx, |ui| {
        for toast in &shown {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.set_max_width(420.0);
                ui.horizontal_wrapped(|ui| {
                    let (mark, color) = match toast.level {
                        Level::Info => ("ℹ", ui.visuals().hyperlink_color),
                        Level::Warning => ("⚠ Warning:", ui.visuals().warn_fg_color),
                        Level::Error => ("✖ Error:", ui.visuals().error_fg_color),
                    };
                    ui.colored_label(color, mark);
                    ui.label(&toast.text);
                    let close = ui.small_button("×");
                    close.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, "Close message"));
                    if close.on_hover_text("Close this message").clicked() {
                        closed = Some(toast.text.clone());
                    }
                });
            });
        }
    });
    if let Some(text) = closed {
        toasts.close(&text);
    }
}
