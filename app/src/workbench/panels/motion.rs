//! The arm's motion of the step at the cursor: its times, what it met, and a slider along it.

use super::facts::{self, fact};
use super::{heading, words};
use crate::record::mishaps;
use crate::workbench::model::Scrubbed;
use crate::workbench::session::{Moment, SessionId};
use nudge_core::arm::PhaseKind;
use nudge_core::episode::StepOutcome;
use nudge_core::plan::Action;
use re_viewer::external::egui::{self, Ui};

/// Draws times, mishaps and slider of the motion that led to `moment`, if there was one.
pub fn show(ui: &mut Ui, scrubbed: &mut Scrubbed, id: SessionId, moment: &Moment) {
    let Some(outcome) = moment.outcome.as_deref() else { return };
    let Some(motion) = outcome.motion.as_ref() else { return };
    let end = motion.duration_s();
    heading(
        ui,
        format!("The arm in step {}", moment.step),
        "How the arm moved: to the view, or to the start of a contact, along it and back",
    );
    facts::show(ui, "arm motion", 2, &times(outcome, end));
    for mishap in mishaps(&outcome.record) {
        ui.label(mishap.replace('_', " "));
    }
    let step = (id, moment.step);
    let mut at_s = scrubbed.at_s(step).unwrap_or(0.0);
    ui.horizontal(|ui| {
        ui.spacing_mut().slider_width = (ui.available_width() - 150.0).clamp(80.0, 400.0);
        let slider = egui::Slider::new(&mut at_s, 0.0..=end).fixed_decimals(1).suffix(" s");
        let response = ui.add(slider).on_hover_text("Drag to move the arm along its motion");
        response.widget_info(|| egui::WidgetInfo::slider(true, at_s, "Time in the arm's motion"));
        if response.changed() {
            scrubbed.scrub(step, at_s);
        }
        let is_scrubbed = scrubbed.at_s(step).is_some();
        if ui
            .add_enabled(is_scrubbed, egui::Button::new("Hide arm"))
            .on_hover_text("Show the step without the arm again")
            .clicked()
        {
            scrubbed.hide();
        }
    });
}

fn times(outcome: &StepOutcome, end: f64) -> Vec<facts::Fact> {
    let seconds = |s: f64| format!("{} s", words::significant(s, 3));
    let mut facts = vec![fact("whole motion", seconds(end), "How long the arm moves, in its own time")];
    if let (Some(motion), Action::Manipulate(done)) = (&outcome.record.decision.motion, &outcome.record.action) {
        for phase in &motion.phases {
            let (name, hint) = match phase.kind {
                PhaseKind::Approach => ("approach", "From where the arm waits to where the contact begins"),
                PhaseKind::Contact => (done.kind().name(), "In contact"),
                PhaseKind::Retreat => ("retreat", "Back to where the arm waits"),
            };
            facts.push(fact(name, seconds(phase.motion.duration_s()), hint));
        }
    }
    facts
}
