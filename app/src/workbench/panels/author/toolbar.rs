//! What can be done to the scene and to what is chosen in it.

use super::common::{DELETE, DUPLICATE, REDO, ROTATE, SAVE, UNDO, named};
use crate::workbench::author::{Author, Snap};
use crate::workbench::command::{Command, MenuCommand};
use re_viewer::external::egui::{self, KeyboardShortcut};

/// Draws the row of buttons, with the scene's name above.
pub(super) fn show(ui: &mut egui::Ui, author: &mut Author, ask: &mut Vec<Command>) {
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        title(ui, author);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| files(ui, author, ask));
    });
    ui.horizontal_wrapped(|ui| edits(ui, author));
}

fn title(ui: &mut egui::Ui, author: &Author) {
    ui.heading(author.scene().name.as_str());
    let place = match author.path() {
        Some(path) => path.display().to_string(),
        None => "not saved yet".to_owned(),
    };
    if author.is_unsaved() && author.path().is_some() {
        ui.label("● changed").on_hover_text(format!("Changed since {place} was saved"));
    } else {
        let name = author.path().and_then(|path| path.file_name());
        ui.weak(name.map_or(place.clone(), |name| name.to_string_lossy().into_owned())).on_hover_text(place);
    }
}

/// From right to left.
fn files(ui: &mut egui::Ui, author: &mut Author, ask: &mut Vec<Command>) {
    let sound = author.is_sound();
    let try_it = egui::Button::new("▶ Try it");
    let can_try = sound && !author.scene().objects.is_empty();
    let response = named(ui.add_enabled(can_try, try_it), "Try it")
        .on_hover_text("Start an episode of this scene as it is here")
        .on_disabled_hover_text(if sound { "Add an object first" } else { "Put the problems right first" });
    if response.clicked() {
        ask.push(Command::TryScene);
    }
    let response = button(ui, sound && (author.is_unsaved() || author.path().is_none()), "Save", Some(SAVE));
    let response = response.on_hover_text("Write the scene's file").on_disabled_hover_text(match sound {
        true => "Nothing has changed since the scene was saved",
        false => "Put the problems right first: a scene file has no overlaps and nothing outside",
    });
    if response.clicked() {
        ask.push(Command::Menu(MenuCommand::Save));
    }
    let response = button(ui, true, "Open…", None).on_hover_text("Open a scene to edit it");
    if response.clicked() {
        ask.push(Command::Menu(MenuCommand::OpenScene));
    }
    let is_new = author.path().is_none() && author.scene().objects.is_empty();
    let response = button(ui, !author.is_unsaved() && !is_new, "New", None)
        .on_hover_text("Begin with an empty shelf")
        .on_disabled_hover_text(if is_new { "The shelf is empty" } else { "Save or undo the changes first" });
    if response.clicked() {
        author.clear();
    }
}

fn edits(ui: &mut egui::Ui, author: &mut Author) {
    if button(ui, author.has_undo(), "Undo", Some(UNDO)).on_hover_text("Take the last change back").clicked() {
        author.undo();
    }
    if button(ui, author.has_redo(), "Redo", Some(REDO)).on_hover_text("Do it again").clicked() {
        author.redo();
    }
    ui.separator();
    let any = !author.selection().is_empty();
    if button(ui, any, "Rotate", Some(ROTATE)).on_hover_text("Turn by 15° counter-clockwise; with shift back").clicked()
    {
        author.turn(1.0);
    }
    if button(ui, any, "Duplicate", Some(DUPLICATE)).on_hover_text("Copy to the nearest place with room").clicked() {
        author.duplicate();
    }
    if button(ui, any, "Delete", Some(DELETE)).on_hover_text("Take what is chosen away").clicked() {
        author.delete();
    }
    ui.separator();
    ui.label("Snap");
    let combo = egui::ComboBox::from_id_salt("author snap").selected_text(author.snap.title()).width(96.0);
    let combo = combo.show_ui(ui, |ui| {
        for snap in Snap::ALL {
            ui.selectable_value(&mut author.snap, snap, snap.title());
        }
    });
    named(combo.response, "Snap").on_hover_text("Where dragged objects come to rest; hold Alt to drag freely");
}

fn button(ui: &mut egui::Ui, enabled: bool, text: &str, shortcut: Option<KeyboardShortcut>) -> egui::Response {
    let response = named(ui.add_enabled(enabled, egui::Button::new(text)), text);
    match shortcut {
        Some(shortcut) => {
            let keys = ui.ctx().format_shortcut(&shortcut);
            response.on_hover_text(keys)
        }
        None => response,
    }
}
