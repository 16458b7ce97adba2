//! The clock at the bottom: the step that everything is shown at, and where it is written.

use crate::workbench::command::{Command, MenuCommand};
use crate::workbench::model::{LayoutKind, Model};
use nudge_core::plan::Action;
use re_viewer::external::egui;

/// Draws the clock.
pub fn show(ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        let buttons = [
            (MenuCommand::First, "⏮"),
            (MenuCommand::StepBack, "⏴"),
            (MenuCommand::StepForward, "⏵"),
            (MenuCommand::Last, "⏭"),
        ];
        for (entry, icon) in buttons {
            let button = ui.add_enabled(entry.is_available(model), egui::Button::new(icon));
            let enabled = entry.is_available(model);
            button.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, enabled, entry.title()));
            if button.on_hover_text(entry.tooltip()).clicked() {
                ask.push(Command::Menu(entry));
            }
        }
        let Some(session) = model.session() else {
            ui.weak("No episode is open");
            return;
        };
        if !model.shows_episode() {
            let authoring = model.kept.layout == LayoutKind::Author;
            let way = if authoring { "choose a layout at the top right" } else { "press Esc" };
            let words = format!("{} is open: {way} to see it", session.title());
            ui.add(egui::Label::new(egui::RichText::new(words).weak()).truncate());
            return;
        }
        ui.label("step");
        let branch = MenuCommand::Branch;
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let path = session.path.display().to_string();
            let (dot, words) = match &session.read_only {
                None => ("●", "Every step is written here as it is done".to_owned()),
                Some(reason) => ("○", format!("Read only: {reason}")),
            };
            ui.weak(&path).on_hover_text(&words);
            let color =
                if session.read_only.is_none() { ui.visuals().error_fg_color } else { ui.visuals().text_color() };
            ui.colored_label(color, dot).on_hover_text(&words);
            ui.separator();
            if ui.button(branch.title()).on_hover_text(branch.tooltip()).clicked() {
                ask.push(Command::Branch);
            }
            ui.separator();
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                egui::ScrollArea::horizontal().id_salt("steps").show(ui, |ui| {
                    let last = model.last_step();
                    let other = model.on_show().nth(1);
                    let parting = other.and_then(|other| super::compare::first_difference(session, other));
                    for step in 0..=last {
                        // In a comparison the longer episode goes on.
                        let mut moments = model.on_show().filter_map(|session| session.moments.get(step));
                        let Some(moment) = moments.next() else { break };
                        let pushed = matches!(
                            moment.outcome.as_ref().map(|outcome| outcome.record.action),
                            Some(Action::Manipulate(_))
                        );
                        // The first step at which the two of a comparison differ.
                        let parts = if parting == Some(step) { "≠" } else { "" };
                        let text = if pushed { format!("▲{parts}{step}") } else { format!("{parts}{step}") };
                        let words = match &moment.outcome {
                            None => "Before the first action".to_owned(),
                            Some(outcome) => crate::record::decision::line(&outcome.record),
                        };
                        let chip = ui.selectable_label(model.cursor == step, egui::RichText::new(text).monospace());
                        chip.widget_info(|| {
                            let name = format!("Step {step}");
                            egui::WidgetInfo::selected(egui::WidgetType::Button, true, model.cursor == step, name)
                        });
                        if model.cursor == step && ui.ctx().input(|input| input.events.is_empty()) {
                            chip.scroll_to_me(None);
                        }
                        if chip.on_hover_text(words).clicked() {
                            ask.push(Command::GoTo(step));
                        }
                    }
                    for step in last + 1..=session.record.config.budget {
                        ui.label(egui::RichText::new(step.to_string()).monospace().weak())
                            .on_hover_text("Not done yet");
                    }
                });
            });
        });
    });
}
