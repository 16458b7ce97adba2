//! The episode at the left: its scene, how it is run, what can be done next, and the other open episodes.

use crate::driver::{BELIEFS, belief_title, belief_update};
use crate::workbench::command::{Command, MenuCommand};
use crate::workbench::model::{Model, StartForm};
use crate::workbench::session::{Activity, Session, SessionId};
use nudge_core::plan::{Counted, PlannerSettings, PolicyKind};
use nudge_core::push::PushSampler;
use re_viewer::external::egui;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Why belief updates are not there, by name; looked up once, since networks are read for it.
static MISSING: LazyLock<BTreeMap<&str, String>> = LazyLock::new(|| {
    let reason = |name| belief_update(Some(name), PolicyKind::Mem).err().map(|error| error.to_string());
    BELIEFS.into_iter().filter_map(|name| Some((name, reason(name)?))).collect()
});

/// Draws the episodes that are being opened, each with its progress.
pub fn openings(ui: &mut egui::Ui, openings: &[(SessionId, String, Activity)], ask: &mut Vec<Command>) {
    for (id, title, activity) in openings {
        ui.label(format!("Opening {title}"));
        match activity {
            Activity::Opening { done, of } if *of > 0 => {
                ui.add(egui::ProgressBar::new(*done as f32 / *of as f32).text(format!("step {done} of {of}")));
            }
            _ => {
                ui.add(egui::Spinner::new());
            }
        }
        let hint = "Stop repeating its actions; its directory stays as it is";
        if ui.button("Cancel opening").on_hover_text(hint).clicked() {
            ask.push(Command::CancelOpening(*id));
        }
        ui.separator();
    }
}

/// Draws the episode.
pub fn show(ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>) {
    if let Some(session) = model.session() {
        scene(ui, session);
        ui.separator();
        ui.scope(|ui| doing(ui, model, session, ask));
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
        format!("No candidate view shows 25 pixels or more of: {}", session.setup.hidden.join(", "))
    });
    egui::Grid::new("config").num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (name, value) in [
            ("policy", config.policy.to_string()),
            ("belief", belief_title(&config.belief).to_owned()),
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
    super::framed(ui);
    // While it runs, the button that began the run pauses it.
    let runs = session.activity == Activity::Running;
    let run = if runs { MenuCommand::Pause } else { MenuCommand::Run };
    for row in [[MenuCommand::Decide, MenuCommand::DoIt], [run, MenuCommand::Cancel]] {
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
        Activity::Idle if session.read_only.is_some() => "read only",
        Activity::Idle if session.pending.is_some() => "decided",
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
    super::framed(ui);
    let form = &mut model.kept.form;
    let name = form.scene.as_ref().and_then(|path| path.file_stem()).map(|stem| stem.to_string_lossy().into_owned());
    ui.horizontal(|ui| {
        ui.label("scene");
        ui.add(egui::Label::new(name.as_deref().unwrap_or("none yet")).truncate());
    });
    choices(ui, form);
    ui.horizontal(|ui| {
        let start = ui.add_enabled(form.scene.is_some(), egui::Button::new(start_title(form)));
        let hint = "Start an episode of this scene with these choices";
        if start.on_hover_text(hint).on_disabled_hover_text("Choose a scene first").clicked() {
            ask.push(Command::Start);
        }
        let scenes = MenuCommand::Scenes;
        if ui.button("Scenes…").on_hover_text(scenes.tooltip()).clicked() {
            ask.push(Command::Menu(scenes));
        }
    });
}

/// What the button says that starts an episode.
pub fn start_title(form: &StartForm) -> &'static str {
    if form.against.is_some() { "Start both" } else { "Start" }
}

/// Draws with what an episode is started.
pub fn choices(ui: &mut egui::Ui, form: &mut StartForm) {
    egui::Grid::new("form").num_columns(2).spacing([10.0, 4.0]).show(ui, |ui| {
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
        let label = ui.label("against");
        egui::ComboBox::from_id_salt("against")
            .selected_text(form.against.map_or("none".to_owned(), |policy| policy.to_string()))
            .show_ui(ui, |ui| {
                ui.selectable_value(&mut form.against, None, "none");
                for policy in PolicyKind::ALL {
                    ui.selectable_value(&mut form.against, Some(policy), policy.to_string());
                }
            })
            .response
            .labelled_by(label.id)
            .on_hover_text("A second policy that runs side by side, to compare with");
        ui.end_row();
        let label = ui.label("belief");
        egui::ComboBox::from_id_salt("belief")
            .selected_text(belief_title(&form.belief))
            .show_ui(ui, |ui| {
                for belief in &BELIEFS {
                    let missing = MISSING.get(belief);
                    let choice = egui::Button::selectable(form.belief == *belief, belief_title(belief));
                    let choice = ui.add_enabled(missing.is_none(), choice);
                    if choice.on_disabled_hover_text(missing.map_or("", String::as_str)).clicked() {
                        *form = form.clone().with_belief(belief);
                    }
                }
            })
            .response
            .labelled_by(label.id)
            .on_hover_text("How the belief is updated");
        ui.end_row();
        let label = ui.label("budget");
        ui.add(egui::DragValue::new(&mut form.budget).range(1..=200).suffix(" actions"))
            .labelled_by(label.id)
            .on_hover_text("Number of actions, 1 to 200; 20 for a robot, 40 in simulation");
        ui.end_row();
        let label = ui.label("seed");
        ui.add(egui::DragValue::new(&mut form.seed))
            .labelled_by(label.id)
            .on_hover_text("Seed of every random choice, any whole number from 0");
        ui.end_row();
        let label = ui.label("gain of");
        egui::ComboBox::from_id_salt("gain of")
            .selected_text(gain_of(form.planner.counted))
            .show_ui(ui, |ui| {
                for counted in Counted::ALL {
                    if ui.selectable_label(form.planner.counted == counted, gain_of(counted)).clicked() {
                        form.planner = form.planner.counting(counted);
                    }
                }
            })
            .response
            .labelled_by(label.id)
            .on_hover_text(
                "Which voxels a view's gain counts: those that no look has seen yet, or all as in the paper",
            );
        ui.end_row();
        let label = ui.label("candidates");
        ui.add(egui::DragValue::new(&mut form.planner.candidates).range(0..=1000))
            .labelled_by(label.id)
            .on_hover_text("Push candidates drawn per decision, 0 to 1000; k = 80 in the paper");
        ui.end_row();
        let label = ui.label("drawn");
        egui::ComboBox::from_id_salt("drawn")
            .selected_text(drawn_at(form.planner.push_sampler))
            .show_ui(ui, |ui| {
                for sampler in PushSampler::ALL {
                    ui.selectable_value(&mut form.planner.push_sampler, sampler, drawn_at(sampler));
                }
            })
            .response
            .labelled_by(label.id)
            .on_hover_text(
                "Where push candidates are drawn: at the frontier as in the paper, or before what no look has seen",
            );
        ui.end_row();
        let label = ui.label("γ");
        ui.add(egui::DragValue::new(&mut form.planner.gamma).range(0.0..=10.0).speed(0.01))
            .labelled_by(label.id)
            .on_hover_text("Weight of the disturbance term, 0 to 10: look if IGV > IGM + γ Reg");
        ui.end_row();
    });
    ui.collapsing("Thresholds", |ui| thresholds(ui, &mut form.planner));
}

/// Which voxels count, in words.
fn gain_of(counted: Counted) -> &'static str {
    match counted {
        Counted::All => "all voxels",
        Counted::Unseen => "unseen voxels",
    }
}

/// Where push candidates are drawn, in words.
fn drawn_at(sampler: PushSampler) -> &'static str {
    match sampler {
        PushSampler::Frontier => "at the frontier",
        PushSampler::Hidden => "before the hidden",
    }
}

/// A share between 0 and 1.
fn share(value: &mut f32) -> egui::DragValue<'_> {
    egui::DragValue::new(value).range(0.0..=1.0).speed(0.005).fixed_decimals(2)
}

/// The planner's thresholds.
fn thresholds(ui: &mut egui::Ui, planner: &mut PlannerSettings) {
    egui::Grid::new("thresholds").num_columns(2).spacing([10.0, 4.0]).show(ui, |ui| {
        let label = ui.label("certain above");
        ui.add(share(&mut planner.certain))
            .labelled_by(label.id)
            .on_hover_text("A floor cell is certain if max p is above this, 0 to 1; 0.85 in the paper");
        ui.end_row();
        let label = ui.label("complete at");
        ui.add(share(&mut planner.complete))
            .labelled_by(label.id)
            .on_hover_text("Nothing is pushed once this share of the floor is certain, 0 to 1; 0.95 in the paper");
        ui.end_row();
        let label = ui.label("no push before");
        ui.add(egui::DragValue::new(&mut planner.quiet_steps).range(0..=50).suffix(" looks"))
            .labelled_by(label.id)
            .on_hover_text("The first steps, in which nothing is pushed, 0 to 50; 3 in the paper");
        ui.end_row();
        let label = ui.label("looks after a push");
        ui.add(egui::DragValue::new(&mut planner.closing_steps).range(1..=50))
            .labelled_by(label.id)
            .on_hover_text("So many looks follow a push before the next one, and at the end, 1 to 50; 1 in the paper");
        ui.end_row();
        let label = ui.label("patience");
        ui.add(egui::DragValue::new(&mut planner.patience).range(0.1..=100.0).speed(0.1))
            .labelled_by(label.id)
            .on_hover_text("Look if patience IGV > IGM + γ Reg, 0.1 to 100; 1 in the paper");
        ui.end_row();
        let label = ui.label("a push promises");
        ui.add(egui::DragValue::new(&mut planner.push_floor).range(0.0..=1e5).speed(10.0).prefix("≥ ").suffix(" nats"))
            .labelled_by(label.id)
            .on_hover_text("A push has to promise at least this, 0 to 100000 nats; 0 in the paper");
        ui.end_row();
        let label = ui.label("saturated below");
        ui.add(share(&mut planner.saturation))
            .labelled_by(label.id)
            .on_hover_text("The policy saturation pushes if two best gains differ by less than this share; 0.02");
        ui.end_row();
        if ui.small_button("As in the paper").on_hover_text("Puts all numbers of the planner back").clicked() {
            *planner = PlannerSettings::default();
        }
        ui.end_row();
    });
}

fn others(ui: &mut egui::Ui, model: &Model, ask: &mut Vec<Command>) {
    ui.separator();
    ui.weak("Open episodes");
    for session in &model.sessions {
        let is_shown = model.shown == Some(session.id);
        let busy = if session.activity == Activity::Idle { "" } else { " …" };
        // In full: a branch is told from its origin by the end of its name.
        let title = format!("{} ({}/{}){busy}", session.title(), session.steps(), session.record.config.budget);
        let row = ui.add(egui::Button::selectable(is_shown, title).wrap());
        if row.on_hover_text(session.path.display().to_string()).clicked() {
            ask.push(Command::Show(session.id));
        }
        if !is_shown {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Min), |ui| {
                let compare = ui.small_button("Compare");
                compare.widget_info(|| {
                    let name = format!("Compare with {}", session.title());
                    egui::WidgetInfo::labeled(egui::WidgetType::Button, true, name)
                });
                if compare.on_hover_text("Compare the shown episode with this one").clicked() {
                    ask.push(Command::CompareWith(Some(session.id)));
                }
            });
        }
    }
}
