//! What the parts of the scene editor share: shortcuts, names and colours.

use crate::workbench::author::Choose;
use nudge_core::scene::ClassId;
use re_viewer::external::egui::{self, Key, KeyboardShortcut, Modifiers};

/// A class that is carried from the palette, and whether it was let go in this frame.
#[derive(Clone, Copy)]
pub(super) struct Carried {
    pub class: ClassId,
    pub at: egui::Pos2,
    pub is_let_go: bool,
}

/// A shortcut with the command key.
const fn command(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

pub(super) const SAVE: KeyboardShortcut = command(Key::S);
pub(super) const DUPLICATE: KeyboardShortcut = command(Key::D);
pub(super) const UNDO: KeyboardShortcut = command(Key::Z);
pub(super) const REDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
pub(super) const SELECT_ALL: KeyboardShortcut = command(Key::A);
pub(super) const ROTATE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::R);
pub(super) const ROTATE_BACK: KeyboardShortcut = KeyboardShortcut::new(Modifiers::SHIFT, Key::R);
pub(super) const DELETE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::Delete);

/// How a click chooses: with shift or the command key, beside what is chosen.
pub(super) fn choice(modifiers: Modifiers) -> Choose {
    if modifiers.shift || modifiers.command { Choose::Toggle } else { Choose::Only }
}

/// Gives a widget the name that it is told by.
pub(super) fn named(response: egui::Response, name: &str) -> egui::Response {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_label(name));
    response
}

/// A colour of the catalogue.
pub(super) fn colour([red, green, blue]: [u8; 3]) -> egui::Color32 {
    egui::Color32::from_rgb(red, green, blue)
}
