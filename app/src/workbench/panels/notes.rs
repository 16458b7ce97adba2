//! What a person says about an episode: a note on the step at the cursor, all notes, and the verdict on every object.

#[cfg(test)]
mod tests;

use crate::annotations::{Judged, VERDICTS, verdict_title};
use crate::workbench::command::Command;
use crate::workbench::model::Model;
use crate::workbench::session::Session;
use nudge_core::score::Verdict;
use re_viewer::external::egui::{self, Align, Color32, Layout, RichText};

/// How much of a note the list shows.
const EXCERPT: usize = 80;

/// Draws notes and verdicts of the episode that is shown.
pub fn show(ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>) {
    let Some(session) = model.session() else {
        ui.weak("Open an episode to write notes on it");
        return;
    };
    let step = model.cursor.min(session.steps());
    note(ui, session, step, ask);
    list(ui, session, step, ask);
    ui.add_space(6.0);
    ui.separator();
    verdicts(ui, session, step, ask);
}

fn note(ui: &mut egui::Ui, session: &Session, step: usize, ask: &mut Vec<Command>) {
    let title = if step == 0 { "Note on the prior".to_owned() } else { format!("Note on step {step}") };
    ui.strong(&title);
    let before = session.annotations.notes.get(&step).map_or("", String::as_str);
    let mut text = before.to_owned();
    let edit = egui::TextEdit::multiline(&mut text)
        .id_salt(("note", session.id, step))
        .hint_text("What is worth knowing about this step?")
        .desired_rows(3)
        .desired_width(f32::INFINITY);
    let response = named(ui.add(edit), &title);
    if response.changed() && text != before {
        ask.push(Command::Note(step, text));
    }
}

fn list(ui: &mut egui::Ui, session: &Session, step: usize, ask: &mut Vec<Command>) {
    let notes = &session.annotations.notes;
    if notes.is_empty() {
        return;
    }
    ui.add_space(4.0);
    ui.weak(if notes.len() == 1 { "1 note".to_owned() } else { format!("{} notes", notes.len()) });
    for (at, note) in notes {
        let words = excerpt(note);
        let row = ui.selectable_label(*at == step, format!("{at:>3}   {words}"));
        let row = named(row, &format!("Go to the note on step {at}: {words}"));
        if row.on_hover_text(note.as_str()).clicked() {
            ask.push(Command::GoTo(*at));
        }
    }
}

/// The beginning of a note, on one line.
fn excerpt(note: &str) -> String {
    let flat = note.split_whitespace().collect::<Vec<_>>().join(" ");
    match flat.char_indices().nth(EXCERPT) {
        Some((end, _)) => format!("{}…", &flat[..end]),
        None => flat,
    }
}

fn verdicts(ui: &mut egui::Ui, session: &Session, step: usize, ask: &mut Vec<Command>) {
    ui.strong("Verdicts").on_hover_text(
        "Found: most of an object's cells are occupied with the right class. Misclassified: most are occupied, but with \
         another class. Not found: most are believed free or unknown. Hallucinated: predicted, but not there.",
    );
    let Some(outcome) = &session.moment(step).outcome else {
        ui.weak("Objects are judged after the first step");
        return;
    };
    if !session.record.has_truth() {
        return super::untold(ui, &session.record);
    }
    let judged = session.annotations.judge(step, outcome.record.objects());
    totals(ui, &judged);
    ui.add_space(4.0);
    ui.spacing_mut().item_spacing.y = 0.0;
    for (at, judged) in judged.iter().enumerate() {
        let fill = if at % 2 == 1 { ui.visuals().faint_bg_color } else { Color32::TRANSPARENT };
        egui::Frame::new().fill(fill).inner_margin(egui::vec2(0.0, 1.0)).show(ui, |ui| {
            ui.horizontal(|ui| row(ui, step, judged, ask));
        });
    }
}

fn totals(ui: &mut egui::Ui, judged: &[Judged]) {
    let count = |verdict: Verdict| judged.iter().filter(|judged| judged.verdict() == verdict).count();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (at, verdict) in VERDICTS.into_iter().enumerate() {
            if at > 0 {
                ui.weak("·");
            }
            // A number and its words stay on one line.
            ui.label(format!("{} {}", count(verdict), verdict_title(verdict)).replace(' ', "\u{a0}"));
        }
        let overruled = judged.iter().filter(|judged| judged.overruled.is_some()).count();
        if overruled > 0 {
            ui.weak("·");
            ui.label(RichText::new(format!("{overruled} overruled")).strong());
        }
    });
}

fn row(ui: &mut egui::Ui, step: usize, judged: &Judged, ask: &mut Vec<Command>) {
    let name = if judged.overruled.is_some() {
        RichText::new(format!("{} ✏", judged.name)).strong()
    } else {
        RichText::new(judged.name.as_str())
    };
    let [x, y] = judged.proposed.position.map(|v| 1000.0 * v);
    ui.label(name).on_hover_text(format!("Middle of its cells: x {x:.0} mm, y {y:.0} mm"));
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let proposed = judged.proposed.verdict;
        let text = RichText::new(format!("{}  {}", symbol(judged.verdict()), verdict_title(judged.verdict())));
        let text = if judged.overruled.is_some() { text.strong() } else { text };
        let combo = egui::ComboBox::from_id_salt(("verdict", step, &judged.name)).selected_text(text).width(132.0);
        let mut wanted = judged.overruled;
        let combo = combo.show_ui(ui, |ui| {
            ui.selectable_value(&mut wanted, None, format!("as the scorer says: {}", verdict_title(proposed)));
            for verdict in VERDICTS {
                ui.selectable_value(&mut wanted, Some(verdict), verdict_title(verdict));
            }
        });
        let response = named(combo.response, &format!("Verdict on {}", judged.name));
        response.on_hover_text(match judged.overruled {
            Some(_) => format!("Overruled by hand; the scorer says {}", verdict_title(proposed)),
            None => "As the scorer says; choose another to overrule it".to_owned(),
        });
        if wanted != judged.overruled {
            // The same as the scorer's is no other verdict.
            let wanted = wanted.filter(|verdict| *verdict != proposed);
            ask.push(Command::Overrule(step, judged.name.clone(), wanted));
        }
    });
}

/// A sign beside the word, so that a column can be read at a glance.
fn symbol(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Found => "✔",
        Verdict::Misclassified => "≠",
        Verdict::NotFound => "✖",
        Verdict::Hallucinated => "?",
    }
}

/// Gives a widget the name that it is told by.
fn named(response: egui::Response, name: &str) -> egui::Response {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_label(name));
    response
}
