//! The episode at the left: its scene, how it is run, what can be done next, and the other open episodes.

use crate::workbench::command::{Command, MenuCommand};
use crate::workbench::model::Model;
use crate::workbench::session::{Activity, Session};
use nudge_core::plan::PolicyKind;
use rerun::external::egui;

/// Draws the episodes that are being opened, each with its progress.
pub fn openings(ui: &mut egui::Ui, openings: &[(String, Activity)], ask: &mut Vec<Command>) {
    for (title, activity) in openings {
        ui.label(format!("Opening {title}"));
        match activity {
            Activity::Opening { done, of } if *of > 0 => {
                ui.add(egui::ProgressBar::new(*done as f32 / *of as f32).text(format!("step {done} of {of}")));
            }
            _ => {
                ui.add(egui::Spinner::new());
            }
        }
        if ui.button("Cancel opening").clicked() {
            ask.push(Command::Cancel);
        }
        ui.separator();
    }
}

/// Draws the episode.
pub fn show(ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>) {
    if let Some(session) = model.session() {
        scene(ui, session);
        ui.separator();
        doing(ui, model, session, ask);
    }
    ui.separator();
    egui::CollapsingHeader::new("New episode").default_open(false).show(ui, |ui| form(ui, model, ask));
    others(ui, model, ask);
}

fn scene(ui: &mut egui::Ui, session: &Session) {
    let (scene, config) = (&session.record.scene, &session.record.config);
    ui.heading(&scene.name);
    if !scene.description.is_empty() {
        ui.weak(&scene.description);
    }
    let hidden = session.setup.hidden.len();
    ui.label(format!("{} objects, {hidden} hidden", scene.objects.len())).on_hover_text(if hidden == 0 {
        "Every object shows in at least one of the candidate views".to_owned()
    } else {
        format!("No candidate view shows 25 pixels of: {}", session.setup.hidden.join(", "))
    });
    egui::Grid::new("config").num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (name, value) in [
            ("policy", config.policy.to_string()),
            ("belief", config.belief.clone()),
            ("seed", config.seed.to_string()),
            ("budget", format!("{} actions", config.budget)),
        ] {
            ui.weak(name);
            ui.monospace(value);
            ui.end_row();
        }
    });
}

fn doing(ui: &mut egui::Ui, model: &Model, session: &Session, ask: &mut Vec<Command>) {
    for row in [[MenuCommand::Decide, MenuCommand::DoIt], [MenuCommand::Run, MenuCommand::Cancel]] {
        ui.columns(2, |columns| {
            for (ui, entry) in columns.iter_mut().zip(row) {
                let size = egui::vec2(ui.available_width(), 24.0);
                let button = ui.add_enabled(entry.is_available(model), egui::Button::new(entry.title()).min_size(size));
                if button.on_hover_text(entry.tooltip()).on_disabled_hover_text(entry.tooltip()).clicked() {
                    ask.push(Command::Menu(entry));
                }
            }
        });
    }
    let (steps, budget) = (session.steps(), session.record.config.budget);
    let doing = match session.activity {
        Activity::Idle if session.is_finished() => "the budget is used up",
        Activity::Idle if session.read_only.is_some() => "to look at only",
        Activity::Idle if session.pending.is_some() => "decided; do it, or something else",
        Activity::Idle => "ready",
        Activity::Opening { .. } => "opening",
        Activity::Deciding => "deciding…",
        Activity::Acting => "acting…",
        Activity::Running => "running…",
    };
    let bar = egui::ProgressBar::new(steps as f32 / budget.max(1) as f32).text(format!("{steps}/{budget}  {doing}"));
    ui.add(bar).on_hover_text("Actions done of the budget");
}

fn form(ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>) {
    let form = &mut model.kept.form;
    let name = form.scene.as_ref().and_then(|path| path.file_stem()).map(|stem| stem.to_string_lossy().into_owned());
    egui::Grid::new("form").num_columns(2).spacing([10.0, 4.0]).show(ui, |ui| {
        ui.label("scene");
        ui.label(name.as_deref().unwrap_or("none yet"));
        ui.end_row();
        let label = ui.label("policy");
        egui::ComboBox::from_id_salt("policy")
            .selected_text(form.policy.to_string())
            .show_ui(ui, |ui| {
                for policy in PolicyKind::ALL {
                    ui.selectable_value(&mut form.policy, policy, policy.to_string());
                }
            })
            .response
            .labelled_by(label.id)
            .on_hover_text("The rule that chooses actions");
        ui.end_row();
        let label = ui.label("belief");
        egui::ComboBox::from_id_salt("belief")
            .selected_text(&form.belief)
            .show_ui(ui, |ui| {
                for belief in ["classical"] {
                    ui.selectable_value(&mut form.belief, belief.to_owned(), belief);
                }
            })
            .response
            .labelled_by(label.id)
            .on_hover_text("How the belief is updated");
        ui.end_row();
        let label = ui.label("budget");
        ui.add(egui::DragValue::new(&mut form.budget).range(1..=200).suffix(" actions"))
            .labelled_by(label.id)
            .on_hover_text("Number of actions, 20 for a robot, 40 in simulation");
        ui.end_row();
        let label = ui.label("seed");
        ui.add(egui::DragValue::new(&mut form.seed)).labelled_by(label.id).on_hover_text("Seed of every random choice");
        ui.end_row();
        let label = ui.label("candidates");
        ui.add(egui::DragValue::new(&mut form.planner.candidates).range(0..=1000))
            .labelled_by(label.id)
            .on_hover_text("Push candidates drawn per decision, k = 80");
        ui.end_row();
        let label = ui.label("γ");
        ui.add(egui::DragValue::new(&mut form.planner.gamma).range(0.0..=10.0).speed(0.01))
            .labelled_by(label.id)
            .on_hover_text("Weight of the disturbance term: look if IGV > IGM + γ Reg");
        ui.end_row();
    });
    ui.horizontal(|ui| {
        let start = ui.add_enabled(form.scene.is_some(), egui::Button::new("Start"));
        if start.on_hover_text("Start an episode of this scene with these choices").clicked() {
            ask.push(Command::Start);
        }
        if ui.button("Open scene…").on_hover_text(MenuCommand::OpenScene.tooltip()).clicked() {
            ask.push(Command::Menu(MenuCommand::OpenScene));
        }
    });
}

fn others(ui: &mut egui::Ui, model: &Model, ask: &mut Vec<Command>) {
    ui.separator();
    ui.weak("Open episodes");
    for session in &model.sessions {
        ui.horizontal(|ui| {
            let is_shown = model.shown == Some(session.id);
            let busy = if session.activity == Activity::Idle { "" } else { " …" };
            let title = format!("{} ({}/{}){busy}", session.title(), session.steps(), session.record.config.budget);
            let row = ui.add(egui::Button::selectable(is_shown, title).truncate());
            if row.on_hover_text(session.path.display().to_string()).clicked() {
                ask.push(Command::Show(session.id));
            }
            if !is_shown {
                let compare = ui.small_button("A|B");
                compare.widget_info(|| {
                    let name = format!("Compare with {}", session.title());
                    egui::WidgetInfo::labeled(egui::WidgetType::Button, true, name)
                });
                if compare.on_hover_text("Compare the shown episode with this one").clicked() {
                    ask.push(Command::CompareWith(Some(session.id)));
                }
            }
        });
    }
}
