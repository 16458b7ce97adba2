//! What is weighed at the cursor: looking against pushing, the verdict with its reason, and the best of both.

use super::table::{self, Sort};
use super::weighed::{self, Listed};
use super::{NO_EPISODE, Panel, Touched, empty, heading, spark, words};
use crate::colors::Colormap;
use crate::workbench::command::Command;
use crate::workbench::model::{Hovered, Model};
use crate::workbench::session::{Activity, Session};
use nudge_core::camera::ViewId;
use nudge_core::plan::{Action, Comparison, DISTURBANCE, Decision, TermKind};
use re_viewer::external::egui::{self, Button, RichText, Ui};

/// What the panel remembers.
pub struct State {
    views: Sort,
    pushes: Sort,
    /// Whether the rejected pushes are listed too.
    rejected: bool,
    hovering: bool,
}

impl Default for State {
    fn default() -> Self {
        Self { views: Sort::falling(1), pushes: Sort::as_given(), rejected: false, hovering: false }
    }
}

impl Panel for State {
    /// Draws the decision.
    fn show(&mut self, ui: &mut Ui, model: &mut Model, ask: &mut Vec<Command>) {
        let touched = draw(self, ui, model, ask);
        touched.apply(model, &mut self.hovering);
    }
}

fn draw(state: &mut State, ui: &mut Ui, model: &Model, ask: &mut Vec<Command>) -> Touched {
    let mut touched = Touched::default();
    let Some(session) = model.session() else {
        empty(ui, NO_EPISODE);
        return touched;
    };
    let Some(decision) = session.decision_after(model.cursor) else {
        nothing(ui, session, "what the policy would do", ask);
        return touched;
    };
    ui.spacing_mut().item_spacing.y = 4.0;
    header(ui, session, model.cursor);
    verdict(ui, &decision.comparison(), &decision.action);
    ui.add_space(4.0);
    views(state, ui, model, session, decision, &mut touched, ask);
    ui.add_space(4.0);
    pushes(state, ui, model, session, decision, &mut touched, ask);
    touched
}

/// Says why nothing is weighed at the cursor, and offers the way to `what`.
pub fn nothing(ui: &mut Ui, session: &Session, what: &str, ask: &mut Vec<Command>) {
    if matches!(session.activity, Activity::Deciding | Activity::Running) {
        return empty(ui, "Weighing views and pushes");
    }
    let (text, title, command) = if session.is_finished() && session.steps() > 0 {
        ("The budget is used up".to_owned(), "See the last decision", Command::GoTo(session.steps() - 1))
    } else {
        (format!("Nothing weighed yet: decide, to see {what}"), "Decide now", Command::Decide)
    };
    empty(ui, &text);
    ui.vertical_centered(|ui| {
        super::framed(ui);
        let possible = session.is_open() || session.is_finished();
        if ui.add_enabled(possible, Button::new(title)).on_hover_text("Shows what was weighed").clicked() {
            ask.push(command);
        }
        if !session.is_finished() && session.steps() > 0 {
            let hint = "Goes to the state before the last action, with what was weighed there";
            if ui.button("See the last decision").on_hover_text(hint).clicked() {
                ask.push(Command::GoTo(session.steps() - 1));
            }
        }
    });
    ui.add_space(8.0);
}

/// Which step it is and whether it is done.
fn header(ui: &mut Ui, session: &Session, cursor: usize) {
    let step = cursor.min(session.steps()) + 1;
    let done = step <= session.steps();
    ui.horizontal(|ui| {
        heading(ui, format!("Step {step} of {}", session.record.config.budget), "");
        ui.weak(if done { "done" } else { "pending" });
    });
}

/// Looking against pushing, as bars on one scale, and what follows.
fn verdict(ui: &mut Ui, comparison: &Comparison, action: &Action) {
    let nats = comparison.terms.iter().map(|term| term.nats.abs());
    let scale = nats.filter(|nats| nats.is_finite()).fold(1e-6, f32::max);
    for term in &comparison.terms {
        let (name, shade) = match term.kind {
            TermKind::Look => ("Look (IGV)", 0.85),
            TermKind::Threshold => ("Threshold", 0.7),
            TermKind::Push => ("Push (IGM)", 0.5),
            TermKind::Disturbance => ("Push: γ·Reg", 0.1),
        };
        let bar = spark::Bar {
            name: name.to_owned(),
            share: term.nats.abs() / scale,
            value: words::nats(term.nats),
            colour: super::legend::ink(Colormap::Cividis.rgb(shade)),
            strong: term.decides,
        };
        let hint = match term.kind {
            TermKind::Disturbance => DISTURBANCE.to_owned(),
            _ => format!("{name}, nats: {}", term.words),
        };
        spark::bar(ui, &bar, 82.0, 72.0).on_hover_text(hint);
    }
    if let Some(margin) = comparison.margin() {
        let name = comparison.term(TermKind::Threshold).map_or("IGV", |_| "Threshold");
        let text = format!("{name} − (IGM + γ·Reg) = {}", words::nats(margin));
        ui.label(RichText::new(text).small()).on_hover_text("The policy looks if this is above 0, and else pushes");
    } else {
        ui.label(RichText::new("No push was weighed").small().weak());
    }
    ui.add_space(2.0);
    ui.label(RichText::new(words::capital(&words::action(action))).strong().heading().size(15.0));
    ui.label(format!("because {}", comparison.because));
}

fn views(
    state: &mut State,
    ui: &mut Ui,
    model: &Model,
    session: &Session,
    decision: &Decision,
    touched: &mut Touched,
    ask: &mut Vec<Command>,
) {
    heading(
        ui,
        "Best views",
        "The ten views with the largest gain under the belief before the step, and the best pair",
    );
    if decision.gains.is_empty() {
        ui.weak("This policy weighs no views");
    } else {
        let used = weighed::used_views(&session.record, model.cursor);
        let rows = weighed::view_rows(decision, &session.setup.views, &used, model.view);
        let columns = weighed::view_columns(decision.counted());
        let table = table::show(ui, "views", &columns, rows, &mut state.views, 220.0);
        if let Some(view) = table.over {
            touched.over = Some(Hovered::View(ViewId(view as u16)));
        }
        if let Some(view) = table.clicked.map(|view| ViewId(view as u16)) {
            touched.view = Some(view);
            ask.push(Command::GainOf(view));
        }
    }
    let chosen = model.view.filter(|view| session.setup.views.view(*view).is_some());
    let title = chosen.map_or("Look from here".to_owned(), |view| format!("Look from here: view {}", view.0));
    let missing = chosen.is_none().then_some("Choose a view first");
    if do_instead(ui, session, model.cursor, "Look from here", &title, missing)
        && let Some(view) = chosen
    {
        ask.push(Command::DoInstead(Action::Look { view }));
    }
}

fn pushes(
    state: &mut State,
    ui: &mut Ui,
    model: &Model,
    session: &Session,
    decision: &Decision,
    touched: &mut Touched,
    ask: &mut Vec<Command>,
) {
    if decision.candidates.is_empty() {
        return;
    }
    let table = push_table(ui, &mut state.pushes, &mut state.rejected, model, decision, 220.0);
    apply_push(table, decision, touched, ask);
    push_button(ui, session, model, decision, ask);
}

/// The pushes as a table, rejected ones on demand.
pub fn push_table(
    ui: &mut Ui,
    sort: &mut Sort,
    rejected: &mut bool,
    model: &Model,
    decision: &Decision,
    height: f32,
) -> table::Touched {
    let (all, refused) = (
        decision.candidates.len(),
        decision.candidates.iter().filter(|candidate| candidate.rejection.is_some()).count(),
    );
    ui.horizontal(|ui| {
        heading(
            ui,
            "Best pushes",
            "The ten feasible pushes that the planner ranks first: the best, then the others by gain",
        );
        ui.label(RichText::new(format!("{} of {all} drawn are feasible", all - refused)).small().weak());
    });
    let listed = if *rejected { Listed::All } else { Listed::Best };
    let rows = weighed::push_rows(decision, listed, model.candidate);
    let touched = if rows.is_empty() {
        ui.weak("No push is feasible here");
        table::Touched::default()
    } else {
        let columns = weighed::push_columns(decision);
        table::show(ui, "pushes", &columns, rows, sort, height)
    };
    if refused > 0 {
        ui.checkbox(rejected, RichText::new(format!("List all, with {refused} rejected")).small())
            .on_hover_text("Rejected pushes are grey; their tooltip says why");
    }
    touched
}

/// What pointing at or clicking a push leads to.
pub(super) fn apply_push(table: table::Touched, decision: &Decision, touched: &mut Touched, ask: &mut Vec<Command>) {
    let push = |at: usize| decision.candidates.get(at).map(|candidate| candidate.manipulation);
    if let Some(manipulation) = table.over.and_then(push) {
        touched.over = Some(Hovered::Manipulation(manipulation));
    }
    if let Some((at, push)) = table.clicked.and_then(|at| Some((at, push(at)?))) {
        touched.candidate = Some(at);
        ask.push(Command::Preview(push));
    }
}

/// The button that does the chosen candidate.
pub fn push_button(ui: &mut Ui, session: &Session, model: &Model, decision: &Decision, ask: &mut Vec<Command>) {
    let chosen = model.candidate.and_then(|at| Some((at, decision.candidates.get(at)?)));
    let title = chosen.map_or("Do this".to_owned(), |(at, _)| format!("Do this: {at}"));
    let dropped = session.record.steps.iter().any(|step| !step.dropped().is_empty());
    let missing = match chosen {
        _ if dropped => Some("An object was dropped: this episode moves nothing more"),
        None => Some("Choose a candidate first"),
        Some((_, candidate)) if candidate.rejection.is_some() => Some("This candidate was rejected"),
        Some(_) => None,
    };
    if do_instead(ui, session, model.cursor, "Do this", &title, missing)
        && let Some((_, candidate)) = chosen
    {
        ask.push(Command::DoInstead(Action::Manipulate(candidate.manipulation)));
    }
}

/// A button that does something else than the policy would; says whether it was pressed.
fn do_instead(ui: &mut Ui, session: &Session, cursor: usize, name: &str, title: &str, missing: Option<&str>) -> bool {
    let hindrance = missing.or(match session {
        session if cursor < session.steps() => Some("Go to the last state, or branch here, to do something else"),
        session if session.is_finished() => Some("The budget is used up"),
        session if session.activity != Activity::Idle => Some("Busy: wait, or cancel"),
        _ => None,
    });
    let button = ui
        .scope(|ui| {
            super::framed(ui);
            ui.add_enabled(hindrance.is_none(), Button::new(title))
        })
        .inner;
    button.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, hindrance.is_none(), name));
    let button = button.on_hover_text("Does this in place of what the policy would do");
    button.on_disabled_hover_text(hindrance.unwrap_or_default()).clicked()
}
