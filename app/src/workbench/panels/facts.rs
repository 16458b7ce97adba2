//! Numbers with their names, in columns.

use super::words;
use re_viewer::external::egui::{Grid, RichText, Ui};

/// A number or a word with its name.
pub struct Fact {
    /// Its name.
    pub name: &'static str,
    /// As it is written, with its unit.
    pub value: String,
    /// What it is, with formula and range.
    pub hint: &'static str,
}

/// A fact in one line of code.
pub fn fact(name: &'static str, value: impl Into<String>, hint: &'static str) -> Fact {
    Fact { name, value: value.into(), hint }
}

/// Draws facts, that many side by side.
pub fn show(ui: &mut Ui, id: &str, side_by_side: usize, facts: &[Fact]) {
    Grid::new(id).num_columns(2 * side_by_side).spacing([12.0, 2.0]).show(ui, |ui| {
        for row in facts.chunks(side_by_side.max(1)) {
            for fact in row {
                ui.label(RichText::new(fact.name).small().weak()).on_hover_text(fact.hint);
                ui.label(words::figure(&fact.value)).on_hover_text(fact.hint);
            }
            ui.end_row();
        }
    });
}
