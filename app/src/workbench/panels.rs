//! The panels: each draws a part of the window from the model and returns commands ([`Panel`]).
//!
//! What a panel remembers from frame to frame (textures, the order of a table) is its own `State`, which the window keeps
//! beside the model; the model knows no panel.

pub mod author;
pub mod camera;
pub mod clock;
pub mod compare;
pub mod curves;
pub mod decision;
pub mod display;
pub mod episode;
pub mod gains;
pub mod maps;
pub mod notes;
#[cfg(test)]
mod photo;
pub mod promises;
pub mod push;
pub mod scenes;
pub mod tour;
pub mod why;
pub mod windows;

mod arrows;
pub(super) mod causes;
mod facts;
mod floor;
mod legend;
mod motion;
mod push_review;
mod spark;
mod table;
mod textures;
pub(super) mod weighed;
mod words;

#[cfg(test)]
mod tests;

use super::command::Command;
use super::model::{Hovered, Model};
use nudge_core::camera::ViewId;
use nudge_core::episode::{EpisodeRecord, NO_TRUTH};
use re_viewer::external::egui;

/// A part of the window that draws itself, and owns what it remembers from frame to frame.
///
/// A panel that remembers nothing is a function `show(ui, model, ask)`; every such function is a panel.
pub trait Panel {
    /// Draws it. It reads the model, writes only what belongs to looking (what the pointer is over, which row is chosen),
    /// and pushes onto `ask` what shall be done.
    fn show(&mut self, ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>);
}

impl<F: FnMut(&mut egui::Ui, &mut Model, &mut Vec<Command>)> Panel for F {
    fn show(&mut self, ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>) {
        self(ui, model, ask);
    }
}

/// What a person did in a panel that is only about looking; it goes into the model once the panel is drawn.
#[derive(Default)]
struct Touched {
    /// What the pointer is over.
    over: Option<Hovered>,
    /// A view that was chosen.
    view: Option<ViewId>,
    /// A push candidate that was chosen.
    candidate: Option<usize>,
}

impl Touched {
    /// Writes it into the model. `hovering` is whether the panel had put something under the pointer before: only then
    /// is it the panel's to take that back.
    fn apply(self, model: &mut Model, hovering: &mut bool) {
        if let Some(over) = self.over {
            model.hovered = over;
        } else if *hovering {
            model.hovered = Hovered::Nothing;
        }
        *hovering = self.over.is_some();
        model.view = self.view.or(model.view);
        model.candidate = self.candidate.or(model.candidate);
    }
}

/// What a panel says that has nothing to show, with what to do next.
fn empty(ui: &mut egui::Ui, text: &str) {
    ui.vertical_centered(|ui| {
        ui.add_space((0.35 * ui.available_height()).clamp(8.0, 120.0));
        ui.weak(text);
    });
}

/// Which way an arrow key was pressed on a widget that has the keyboard's focus: to the right and up are positive; by ten
/// with shift.
fn arrow_keys(ui: &egui::Ui, response: &egui::Response) -> Option<[i32; 2]> {
    if !response.has_focus() {
        return None;
    }
    let filter = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let ways = [
        (egui::Key::ArrowLeft, [-1, 0]),
        (egui::Key::ArrowRight, [1, 0]),
        (egui::Key::ArrowDown, [0, -1]),
        (egui::Key::ArrowUp, [0, 1]),
    ];
    ui.input_mut(|input| {
        let by = if input.modifiers.shift { 10 } else { 1 };
        let pressed = ways.into_iter().find(|(key, _)| input.consume_key(egui::Modifiers::NONE, *key));
        pressed.map(|(_, [x, y])| [x * by, y * by])
    })
}

/// How far something is: words above a bar, for on the bar they could be read on one of its two grounds only.
fn progress(ui: &mut egui::Ui, share: f32, words: &str) -> egui::Response {
    let words = ui.label(words);
    words | ui.add(egui::ProgressBar::new(share).desired_height(6.0))
}

/// Gives the buttons that follow in `ui` a ground, so that what can be pressed looks like it.
fn framed(ui: &mut egui::Ui) {
    let visuals = ui.visuals_mut();
    let ground = visuals.text_color().gamma_multiply(0.14);
    for state in [&mut visuals.widgets.inactive, &mut visuals.widgets.noninteractive] {
        state.weak_bg_fill = ground;
        state.bg_fill = ground;
    }
}

/// The heading of a part of a panel; the tooltip says what it is.
fn heading(ui: &mut egui::Ui, title: impl Into<String>, hint: &str) -> egui::Response {
    let heading = ui.label(egui::RichText::new(title).strong());
    if hint.is_empty() { heading } else { heading.on_hover_text(hint) }
}

/// Says of an episode without truth why something is not shown.
fn untold(ui: &mut egui::Ui, record: &EpisodeRecord) {
    if !record.has_truth() {
        ui.weak(NO_TRUTH).on_hover_text("Nobody knows what really stands there, so nothing is scored");
    }
}

/// The empty state of every panel without an episode.
const NO_EPISODE: &str = "Open a scene, or drop one here";
