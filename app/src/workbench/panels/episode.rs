//! The episode at the left: its scene, how it is run, what can be done next, and the other open episodes.

use super::tour;
use crate::driver::{BELIEFS, belief_title, belief_update};
use crate::workbench::command::{Command, MenuCommand};
use crate::workbench::model::{Model, StartForm};
use crate::workbench::session::{Activity, Session, SessionId};
use nudge_core::camera::{NoiseModel, ViewArray};
use nudge_core::episode::{EpisodeRecord, StepRecord};
use nudge_core::plan::{Place, PlannerSettings, PolicyKind, Reason, SETTINGS, Setting, Values};
use nudge_core::skill::{SkillKind, SkillSet};
use re_viewer::external::egui;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Why belief updates are not there, by name; looked up once, since networks are read for it.
static MISSING: LazyLock<BTreeMap<&str, String>> = LazyLock::new(|| {
    let reason = |name| belief_update(Some(name), PolicyKind::Mem).err().map(|error| error.to_string());
    BELIEFS.into_iter().filter_map(|name| Some((name, reason(name)?))).collect()
});

/// What is done with an episode that was opened.
const CHECKING: &str = "Shown is what its files hold. Its actions are repeated in the background: that compares every \
                        state with the files, and brings what they do not hold (what rays met, where pushes left things)";

/// Draws the episodes that are being opened, each with its progress.
pub fn openings(ui: &mut egui::Ui, openings: &[(SessionId, String, Activity)], ask: &mut Vec<Command>) {
    for (id, title, activity) in openings {
        ui.label(format!("Opening {title}"));
        match activity {
            Activity::Opening { done, of } if *of > 0 => {
                super::progress(ui, *done as f32 / *of as f32, &format!("step {done} of {of}"));
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
    super::untold(ui, &session.record);
    if session.record.has_truth() {
        let hidden = session.setup.hidden.as_deref();
        let count = hidden.map_or("…".to_owned(), |hidden| hidden.len().to_string());
        let words = match hidden {
            None => "The objects that no candidate view shows are being counted".to_owned(),
            Some(hidden) if hidden.is_empty() => "Every object shows in at least one of the candidate views".to_owned(),
            Some(hidden) => format!("No candidate view shows 25 pixels or more of: {}", hidden.join(", ")),
        };
        ui.label(format!("{} objects, {count} hidden", scene.objects.len())).on_hover_text(words);
    }
    let mut facts = vec![
        chosen_by(&session.record),
        ("belief", belief_title(&config.belief).to_owned()),
        ("seed", config.seed.to_string()),
        ("budget", format!("{} actions", config.budget)),
    ];
    // What is as it mostly is takes no room.
    let usual = StartForm::default();
    facts.extend((config.views != usual.views).then(|| ("views", config.views.clone())));
    facts.extend((config.noise != usual.noise).then(|| ("noise", NoiseModel::name_of(config.noise))));
    egui::Grid::new("config").num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (name, value) in facts {
            ui.weak(name);
            ui.monospace(value);
            ui.end_row();
        }
    });
}

/// Who chose the views: the policy, or nobody where the frames of a recording were taken in their own order.
fn chosen_by(record: &EpisodeRecord) -> (&'static str, String) {
    let is_unweighed = |step: &StepRecord| step.decision.reason == Reason::Manual;
    let is_recorded = !record.has_truth() && record.config.views == ViewArray::RECORDED;
    if is_recorded && !record.steps.is_empty() && record.steps.iter().all(is_unweighed) {
        ("frames", "in recorded order".to_owned())
    } else {
        ("policy", record.config.policy.to_string())
    }
}

fn doing(ui: &mut egui::Ui, model: &Model, session: &Session, ask: &mut Vec<Command>) {
    super::framed(ui);
    let top = ui.cursor().min;
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
    let bottom = egui::pos2(ui.max_rect().right(), ui.cursor().top());
    tour::mark(ui.ctx(), tour::Spot::Doing, egui::Rect::from_min_max(top, bottom).expand(3.0));
    let (steps, budget) = (session.steps(), session.record.config.budget);
    let doing = match session.activity {
        Activity::Idle if session.is_finished() => "the budget is used up",
        Activity::Idle if session.read_only.is_some() => "read only",
        Activity::Idle if session.pending.is_some() => "decided",
        Activity::Idle => "ready",
        Activity::Opening { .. } => "opening",
        Activity::Checking { .. } => "checking",
        Activity::Deciding => "deciding…",
        Activity::Acting => "acting…",
        Activity::Running if session.pausing => "pauses after this action",
        Activity::Running => "running…",
    };
    let words = format!("{steps} of {budget} actions · {doing}");
    super::progress(ui, steps as f32 / budget.max(1) as f32, &words).on_hover_text("Actions done of the budget");
    if let Activity::Checking { done, of } = session.activity {
        let then = if session.queued { ", then it goes on" } else { "" };
        let words = format!("checking step {done} of {of}{then}");
        super::progress(ui, done as f32 / of.max(1) as f32, &words).on_hover_text(CHECKING);
    }
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
        views(ui, &mut form.views);
        noise(ui, &mut form.noise);
        settings(ui, &mut form.planner, Place::Form);
    });
    ui.collapsing("Thresholds", |ui| {
        egui::Grid::new("thresholds").num_columns(2).spacing([10.0, 4.0]).show(ui, |ui| {
            settings(ui, &mut form.planner, Place::Thresholds);
            let hint = "Puts all of the planner's settings back to what goes with the belief";
            if ui.small_button("Back to the defaults").on_hover_text(hint).clicked() {
                form.planner = PlannerSettings::of_belief(&form.belief);
            }
            ui.end_row();
        });
    });
}

/// The view array: one that comes with the program, or a file.
fn views(ui: &mut egui::Ui, views: &mut String) {
    let is_shipped = |name: &str| ViewArray::shipped().any(|shipped| shipped == name);
    let label = ui.label("views");
    egui::ComboBox::from_id_salt("views")
        .selected_text(if is_shipped(views) { views.as_str() } else { "a file" })
        .show_ui(ui, |ui| {
            for name in ViewArray::shipped() {
                ui.selectable_value(views, name.to_owned(), name);
            }
            if ui.selectable_label(!is_shipped(views), "a file").clicked() && is_shipped(views) {
                *views = "views.toml".to_owned();
            }
        })
        .response
        .labelled_by(label.id)
        .on_hover_text("The array of candidate camera poses");
    ui.end_row();
    if !is_shipped(views) {
        let label = ui.label("array's file");
        ui.add(egui::TextEdit::singleline(views).hint_text("views.toml").desired_width(120.0))
            .labelled_by(label.id)
            .on_hover_text("Path of a view array's file (.toml), made like assets/views/standard300.toml");
        ui.end_row();
    }
}

/// What the camera gets wrong.
fn noise(ui: &mut egui::Ui, noise: &mut Option<NoiseModel>) {
    let label = ui.label("noise");
    egui::ComboBox::from_id_salt("noise")
        .selected_text(NoiseModel::name_of(*noise))
        .show_ui(ui, |ui| {
            for (name, model) in NoiseModel::NAMED {
                let model = Some(model).filter(|model| *model != NoiseModel::OFF);
                ui.selectable_value(noise, model, name);
            }
        })
        .response
        .labelled_by(label.id)
        .on_hover_text("What the camera gets wrong: nothing, or as much as a consumer depth camera on an arm");
    ui.end_row();
}

/// The planner's settings of one place, a row each.
fn settings(ui: &mut egui::Ui, planner: &mut PlannerSettings, place: Place) {
    for setting in SETTINGS.iter().filter(|setting| setting.place == place) {
        let label = ui.label(setting.label);
        let hint = format!("{}; {}, default {}", setting.help, setting.limits(), setting.default_words());
        setting_value(ui, planner, setting).labelled_by(label.id).on_hover_text(hint);
        ui.end_row();
    }
}

fn setting_value(ui: &mut egui::Ui, planner: &mut PlannerSettings, setting: &Setting) -> egui::Response {
    let suffix = match setting.unit {
        "" | "share" | "probability" => String::new(),
        unit => format!(" {unit}"),
    };
    match &setting.values {
        Values::Whole { range: [low, high], of } => {
            ui.add(egui::DragValue::new(of(planner)).range(*low..=*high).suffix(suffix))
        }
        Values::Real { range: [low, high], step, of } => {
            let value = egui::DragValue::new(of(planner)).range(*low..=*high).speed(f64::from(*step)).suffix(suffix);
            ui.add(if *step < 0.01 { value.min_decimals(2) } else { value })
        }
        Values::Choice { choices, get, set } => {
            let chosen = get(planner);
            egui::ComboBox::from_id_salt(setting.name)
                .selected_text(choices[chosen].label)
                .show_ui(ui, |ui| {
                    for (at, choice) in choices.iter().enumerate() {
                        if ui.selectable_label(at == chosen, choice.label).clicked() {
                            set(planner, at);
                        }
                    }
                })
                .response
        }
        Values::Skills { of } => {
            let skills = of(planner);
            let row = ui.horizontal(|ui| {
                for &kind in SkillKind::ALL {
                    let mut on = skills.has(kind);
                    // One of them stays.
                    let last = on && skills.len() == 1;
                    if ui.add_enabled(!last, egui::Checkbox::new(&mut on, kind.name())).changed() {
                        let others = skills.kinds().filter(|other| *other != kind);
                        *skills = SkillSet::of(&others.chain(on.then_some(kind)).collect::<Vec<_>>());
                    }
                }
            });
            row.response
        }
    }
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
