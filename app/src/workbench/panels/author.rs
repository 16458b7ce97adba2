//! The scene editor: classes at the left, the board from above in the middle, what is chosen and what is wrong at the
//! right.

mod canvas;
mod common;
mod palette;
mod properties;
#[cfg(test)]
mod tests;
mod toolbar;

use crate::workbench::author::Author;
use crate::workbench::command::{Command, Level, MenuCommand};
use crate::workbench::model::Model;
use common::{DELETE, DUPLICATE, REDO, ROTATE, ROTATE_BACK, SAVE, SELECT_ALL, UNDO};
use re_viewer::external::egui::{self, Key, KeyboardShortcut, Modifiers};
use std::sync::Arc;

/// Draws the editor over the whole of `ui`.
pub fn show(ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>) {
    let author = &mut model.author;
    let context = ui.ctx().clone();
    author.wake_with(Arc::new(move || context.request_repaint()));
    author.poll();
    match author.poll_generated() {
        Some(Ok(0)) => {
            ask.push(Command::Tell(Level::Warning, "Nothing was added: the shelf is full enough".to_owned()))
        }
        Some(Ok(count)) => ask.push(Command::Tell(Level::Info, format!("{count} objects added"))),
        Some(Err(error)) => ask.push(Command::Tell(Level::Error, error.to_string())),
        None => {}
    }
    let carried = egui::Panel::left("author palette")
        .default_size(176.0)
        .size_range(150.0..=260.0)
        .show(ui, |ui| palette::show(ui, author))
        .inner;
    egui::Panel::right("author properties")
        .default_size(268.0)
        .size_range(240.0..=380.0)
        .show(ui, |ui| properties::show(ui, author));
    let board = egui::CentralPanel::default().show(ui, |ui| {
        toolbar::show(ui, author, ask);
        ui.separator();
        canvas::show(ui, author, carried)
    });
    if !ui.ctx().text_edit_focused() {
        keys(ui, author, ask);
        // Arrow keys and letters belong to whatever has the focus; without any, to the board.
        if board.inner || ui.memory(|memory| memory.focused().is_none()) {
            keys_on_board(ui, author);
        }
    }
}

/// What the keyboard asks for wherever the focus is.
fn keys(ui: &egui::Ui, author: &mut Author, ask: &mut Vec<Command>) {
    let pressed = |shortcut: &KeyboardShortcut| ui.input_mut(|input| input.consume_shortcut(shortcut));
    // The longer one first: a shortcut also answers to more modifiers than its own.
    if pressed(&REDO) {
        author.redo();
    }
    if pressed(&UNDO) {
        author.undo();
    }
    if pressed(&SAVE) {
        ask.push(Command::Menu(MenuCommand::Save));
    }
    if pressed(&DUPLICATE) {
        author.duplicate();
    }
}

/// What the keyboard does to what is chosen on the board.
fn keys_on_board(ui: &egui::Ui, author: &mut Author) {
    let pressed = |shortcut: &KeyboardShortcut| ui.input_mut(|input| input.consume_shortcut(shortcut));
    if pressed(&SELECT_ALL) {
        author.choose_all(0..author.scene().objects.len());
    }
    if pressed(&ROTATE_BACK) {
        author.turn(-1.0);
    }
    if pressed(&ROTATE) {
        author.turn(1.0);
    }
    if pressed(&DELETE) || ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Backspace)) {
        author.delete();
    }
    if ui.input(|input| input.key_pressed(Key::Escape)) {
        if author.gesture().is_some() {
            author.cancel_gesture();
        } else {
            author.choose_none();
        }
    }
    if author.selection().is_empty() {
        return;
    }
    let arrows = [
        (Key::ArrowLeft, [-1.0, 0.0]),
        (Key::ArrowRight, [1.0, 0.0]),
        (Key::ArrowDown, [0.0, -1.0]),
        (Key::ArrowUp, [0.0, 1.0]),
    ];
    for (key, by) in arrows {
        if ui.input_mut(|input| input.consume_key(Modifiers::NONE, key)) {
            author.nudge(by);
        }
        if ui.input(|input| input.key_released(key)) {
            author.settle();
        }
    }
}
