//! What pushes would do: the candidates on the floor, and for a chosen one the prediction beside now and what happened.

use super::arrows::{Look, arrow, ends, lines, nearest, tag};
use super::decision;
use super::facts::{self, fact};
use super::floor::{Drawn, FloorMap, Line, Outlines, in_window};
use super::legend::{self, Bar};
use super::motion;
use super::push_review::{self, Review};
use super::table::Sort;
use super::textures::{self, Textures};
use super::{NO_EPISODE, Touched, empty, heading, maps, words};
use crate::colors::Colormap;
use crate::picture;
use crate::workbench::command::Command;
use crate::workbench::derive::{Derived, MapKind};
use crate::workbench::model::{Hovered, Model, Picked, Preview, Scrubbed};
use crate::workbench::session::{Session, SessionId};
use nudge_core::belief::{MOST_SURPRISING, Prediction};
use nudge_core::grid::Grid;
use nudge_core::plan::{Action, CandidateRecord, DISTURBANCE, Decision};
use nudge_core::skill::Manipulation;
use re_viewer::external::egui::{self, Color32, Pos2, RichText, TextureHandle, Tooltip, Ui};
use std::sync::Arc;

/// How much of the robot's side is shown, metres.
const APRON_M: f32 = 0.05;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shown {
    Now,
    Predicted(Manipulation),
    Change(Manipulation),
    After,
    Surprise,
}

/// What the panel remembers.
pub struct State {
    last: Option<Arc<Derived>>,
    textures: Textures<(SessionId, usize, Shown)>,
    outlines: Outlines,
    outlines_after: Outlines,
    sort: Sort,
    rejected: bool,
    hovering: bool,
    review: Option<Review>,
    /// The model's, while the panel is drawn.
    scrubbed: Scrubbed,
}

impl Default for State {
    fn default() -> Self {
        Self {
            last: None,
            textures: Textures::default(),
            outlines: Outlines::default(),
            outlines_after: Outlines::default(),
            sort: Sort::as_given(),
            rejected: false,
            hovering: false,
            review: None,
            scrubbed: Scrubbed::default(),
        }
    }
}

impl super::Panel for State {
    /// Draws the candidates and what the chosen one would do.
    fn show(&mut self, ui: &mut Ui, model: &mut Model, ask: &mut Vec<Command>) {
        self.scrubbed = model.scrubbed;
        let touched = draw(self, ui, model, ask);
        model.scrubbed = self.scrubbed;
        touched.apply(model, &mut self.hovering);
    }
}

fn draw(state: &mut State, ui: &mut Ui, model: &Model, ask: &mut Vec<Command>) -> Touched {
    let mut touched = Touched::default();
    let Some(session) = model.session() else {
        empty(ui, NO_EPISODE);
        return touched;
    };
    let step = model.cursor.min(session.steps());
    if let Some(derived) = model.derived() {
        state.last = Some(derived.clone());
    }
    let decision = session.decision_after(model.cursor);
    let here = Here { session, model, step, grid: *session.moment(step).belief.grid() };
    egui::ScrollArea::vertical().id_salt("push").auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        match decision.filter(|decision| !decision.candidates.is_empty()) {
            Some(decision) => here.candidates(state, ui, decision, &mut touched, ask),
            None => {
                heading(ui, "Push candidates", "");
                match decision {
                    None => decision::nothing(ui, session, "what pushes would do", ask),
                    Some(_) => {
                        ui.weak(format!("No push was weighed before step {}", step + 1));
                    }
                }
                here.way_to_push(ui, ask);
            }
        }
        here.review(state, ui);
    });
    touched
}

/// The state at the cursor.
struct Here<'a> {
    session: &'a Session,
    model: &'a Model,
    step: usize,
    grid: Grid,
}

impl Here<'_> {
    fn candidates(
        &self,
        state: &mut State,
        ui: &mut Ui,
        decision: &Decision,
        touched: &mut Touched,
        ask: &mut Vec<Command>,
    ) {
        let title = format!("Push candidates before step {}", self.step + 1);
        heading(ui, title, "Every arrow is the path of the tool's tip; the colour is its value, gain + γ·Reg in nats");
        self.floor(state, ui, decision, touched, ask);
        let State { sort, rejected, .. } = state;
        let table = decision::push_table(ui, sort, rejected, self.model, decision, 190.0);
        decision::apply_push(table, decision, touched, ask);
        decision::push_button(ui, self.session, self.model, decision, ask);
        ui.add_space(6.0);
        match self.model.candidate.and_then(|at| Some((at, decision.candidates.get(at)?))) {
            Some((at, candidate)) => self.chosen(state, ui, decision, at, candidate, ask),
            None => {
                ui.weak("Click a push to see what it would do");
            }
        }
    }

    /// The belief at the cursor, if it is painted.
    fn now(&self, state: &mut State, ctx: &egui::Context) -> Option<TextureHandle> {
        let derived = state.last.clone().filter(|last| last.of == (self.session.id, self.step))?;
        let map = derived.maps.get(&MapKind::Semantics)?;
        Some(state.textures.get(ctx, (self.session.id, self.step, Shown::Now), || textures::of_rgb(map)))
    }

    /// The candidates as arrows on the floor.
    fn floor(
        &self,
        state: &mut State,
        ui: &mut Ui,
        decision: &Decision,
        touched: &mut Touched,
        ask: &mut Vec<Command>,
    ) {
        let picture = self.now(state, ui.ctx());
        let outlines = state.outlines.of(&self.session.moment(self.step).bodies);
        let map = FloorMap {
            grid: &self.grid,
            picture: picture.as_ref(),
            outlines: &outlines,
            picked: None,
            apron_m: APRON_M,
            name: "Push candidates on the floor",
        };
        let width = ui.available_width().min(620.0);
        let drawn = map.show(ui, width);
        let range = value_range(decision);
        let arrows: Vec<(usize, &CandidateRecord, [Pos2; 2])> = decision
            .candidates
            .iter()
            .enumerate()
            .filter(|(_, candidate)| state.rejected || candidate.rejection.is_none())
            .map(|(at, candidate)| (at, candidate, ends(&drawn.frame, &candidate.manipulation.arrow())))
            .filter(|(_, _, ends)| ends.iter().all(|end| end.x.is_finite() && end.y.is_finite()))
            .collect();
        let over = drawn.response.hover_pos().and_then(|pointer| nearest(&arrows, pointer));
        let hovered = match self.model.hovered {
            Hovered::Manipulation(manipulation) => Some(manipulation),
            _ => None,
        };
        let painter = ui.painter_at(drawn.response.rect);
        // The rejected below, the best on top.
        let ranked = decision.ranked_candidates();
        let order = ranked.iter().rev().filter_map(|at| arrows.iter().find(|arrow| arrow.0 == *at));
        let pushed = decision.pushed();
        for (at, candidate, ends) in order {
            let picked =
                self.model.candidate == Some(*at) || over == Some(*at) || hovered == Some(candidate.manipulation);
            if picked {
                lines(&painter, &drawn.frame, &candidate.manipulation.outline());
            }
            let look = match decision.value_of(candidate) {
                _ if candidate.rejection.is_some() => Look::Rejected,
                Some(value) => Look::Weighed(legend::ink(Colormap::Cividis.of(value, range))),
                None => Look::Weighed(Color32::WHITE),
            };
            arrow(&painter, *ends, look, picked);
            if pushed == Some(*at) || (pushed.is_none() && decision.best_push == Some(*at)) {
                let text = if pushed.is_some() { "chosen" } else { "best" };
                tag(ui, &painter, ends[1], text);
            }
        }
        if let Some((at, candidate)) = over.and_then(|at| Some((at, decision.candidates.get(at)?))) {
            touched.over = Some(Hovered::Manipulation(candidate.manipulation));
            let text = describe(at, decision, candidate);
            Tooltip::for_widget(&drawn.response).at_pointer().gap(12.0).show(|ui| ui.label(text));
            if drawn.response.clicked() {
                touched.candidate = Some(at);
                ask.push(Command::Preview(candidate.manipulation));
            }
        }
        if decision.candidates.iter().all(|candidate| decision.value_of(candidate).is_none()) {
            ui.label(RichText::new("white: not weighed, this policy pushes at random").small().weak());
        } else {
            ui.scope(|ui| {
                ui.set_max_width(width.min(420.0));
                let ends = range.map(|nats| words::significant(f64::from(nats), 3));
                let hint = "Gain + γ·Reg, nats: what is compared with looking";
                legend::bar(ui, &Bar { name: "value", ends, unit: "value, nats", hint }, |t| Colormap::Cividis.rgb(t));
            });
        }
        let note = if state.rejected { "grey, dashed: rejected" } else { "rejected pushes are hidden" };
        ui.label(RichText::new(format!("front edge at the bottom; {note}")).small().weak());
    }

    /// What a push would do: now, predicted, the change, and what happened if it was done.
    fn chosen(
        &self,
        state: &mut State,
        ui: &mut Ui,
        decision: &Decision,
        at: usize,
        candidate: &CandidateRecord,
        ask: &mut Vec<Command>,
    ) {
        let name = words::capital(candidate.manipulation.kind().name());
        heading(ui, format!("{name} {at}"), "What is looked at; click another one in the table or on the map");
        let nats = |value: Option<f32>| value.map_or("not weighed".to_owned(), words::nats);
        let view = candidate.view.map_or("n/a".to_owned(), |view| view.0.to_string());
        let mut facts = vec![
            fact("value", nats(decision.value_of(candidate)), "Gain + γ·Reg"),
            fact("gain", nats(candidate.gain), decision.counted().of_a_push()),
            fact("γ·Reg", nats(decision.disturbance_of(candidate)), DISTURBANCE),
            fact("best view", view, "The view with the largest gain under the predicted belief"),
        ];
        let told = candidate.manipulation.describe();
        facts.extend(candidate.makes_way_for().map(|then| {
            let hint = "It opens less itself: the gain is half of what both open together";
            fact("makes way for", then.replace('-', "−"), hint)
        }));
        facts.extend(told.facts.into_iter().map(|told| fact(told.name, told.text.replace('-', "−"), told.hint)));
        facts::show(ui, "push numbers", 2, &facts);
        if let Some(rejection) = &candidate.rejection {
            ui.label(format!("Rejected: {}", candidate.manipulation.against(rejection)));
        }
        let asked = |preview: &&Preview| {
            preview.of == (self.session.id, self.step) && preview.manipulation == candidate.manipulation
        };
        match self.model.preview.as_ref().filter(asked) {
            Some(preview) => self.prediction(state, ui, preview, ask),
            None if self.session.setup.update.is_none() => {
                ui.weak("What it would do cannot be predicted: this program lacks the networks of the episode");
            }
            None => {
                ui.weak("Click the push to predict what it would do");
            }
        }
    }

    fn prediction(&self, state: &mut State, ui: &mut Ui, preview: &Preview, ask: &mut Vec<Command>) {
        let Some(derived) = state.last.clone().filter(|last| last.of == (self.session.id, self.step)) else {
            ui.weak("Painting the maps");
            return;
        };
        let (prediction, done) = (&preview.prediction, preview.manipulation);
        let (grid, catalog) = (self.grid, &self.session.setup.catalog);
        let key = |shown: Shown| (self.session.id, self.step, shown);
        let ctx = ui.ctx().clone();
        let now = self.now(state, &ctx);
        let predicted = state.textures.get(&ctx, key(Shown::Predicted(done)), || {
            textures::of_rgb(&picture::paint(&grid, |cell| {
                let at = in_window(&prediction.window, &grid, cell);
                let after = at.and_then(|at| prediction.semantics.get(at));
                picture::semantics_rgb(after.unwrap_or(&derived.belief.semantics[cell]), catalog)
            }))
        });
        let change = state.textures.get(&ctx, key(Shown::Change(done)), || {
            textures::of_rgb(&picture::paint(&grid, |cell| Colormap::Viridis.rgb(change_at(prediction, &grid, cell))))
        });
        let after = self.session.moments.get(self.step + 1).filter(|moment| {
            moment.outcome.as_ref().is_some_and(|outcome| outcome.record.action == Action::Manipulate(done))
        });
        let happened = after.and_then(|moment| Some((moment, moment.truth.as_ref()?))).map(|(moment, truth)| {
            let labels = || textures::of_rgb(&picture::paint_labels(&grid, &truth.labels, catalog));
            (state.textures.get(&ctx, key(Shown::After), labels), state.outlines_after.of(&moment.bodies))
        });
        let outlines = state.outlines.of(&self.session.moment(self.step).bodies);
        let gap = 10.0;
        let width = (0.5 * (ui.available_width() - gap)).floor().clamp(40.0, 420.0);
        let mut one = |ui: &mut Ui, title: &str, hint: &str, picture: Option<&TextureHandle>, outlines: &[Line]| {
            ui.vertical(|ui| {
                ui.set_width(width);
                heading(ui, title, hint);
                let name = format!("Map of the push: {}", title.to_lowercase());
                let picked = maps::picked_cell(self.model.picked, &grid);
                let map = FloorMap { grid: &grid, picture, outlines, picked, apron_m: 0.0, name: &name };
                let drawn: Drawn = map.show(ui, width);
                let painter = ui.painter_at(drawn.response.rect);
                lines(&painter, &drawn.frame, &done.outline());
                for way in done.outline().arrows {
                    arrow(&painter, ends(&drawn.frame, &way), Look::Weighed(Color32::WHITE), false);
                }
                drawn.tell(|cell| {
                    let change = words::probability(change_at(prediction, &grid, cell));
                    format!("{}\nchanges with probability {change}", words::cell_place(&grid, grid.cell(cell)))
                });
                if let Some(cell) = drawn.chosen {
                    ask.push(Command::Pick(Some(Picked::Cell(cell))));
                }
            });
        };
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = gap;
            one(ui, "Now", "The likeliest classes before the push", now.as_ref(), &outlines);
            one(
                ui,
                "Predicted",
                "The likeliest classes that the push is predicted to leave",
                Some(&predicted),
                &outlines,
            );
        });
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = gap;
            one(ui, "Change", "Probability that the push changes a floor cell, 0 to 1", Some(&change), &outlines);
            if let Some((picture, outlines)) = &happened {
                one(ui, "What happened", "The true classes after the push", Some(picture), outlines);
            }
        });
        ui.scope(|ui| {
            ui.set_max_width(width);
            let texts = Bar {
                name: "change",
                ends: ["0".to_owned(), "1".to_owned()],
                unit: "probability of change",
                hint: "Viridis, the colours of probabilities",
            };
            legend::bar(ui, &texts, |t| Colormap::Viridis.rgb(t));
        });
        let swept = preview.swept.len() as f32 * grid.voxel_m.powi(3) * 1e3;
        let expected: f32 = prediction.change.iter().filter(|change| change.is_finite()).sum();
        let cell_cm2 = grid.voxel_m * grid.voxel_m * 1e4;
        let text = format!(
            "the tool sweeps {} litres; about {} cm² of the floor are expected to change",
            words::significant(f64::from(swept), 2),
            words::significant(f64::from(expected * cell_cm2), 2)
        );
        ui.label(RichText::new(text).small());
    }

    /// Offers the way to the state before the nearest push.
    fn way_to_push(&self, ui: &mut Ui, ask: &mut Vec<Command>) {
        let steps = self.session.record.steps.iter();
        let mut pushes =
            steps.filter(|step| matches!(step.action, Action::Manipulate(_))).map(|step| step.index).peekable();
        if pushes.peek().is_none() {
            ui.weak("No push was done in this episode");
        }
        let elsewhere = pushes.filter(|step| step - 1 != self.step);
        let Some(nearest) = elsewhere.min_by_key(|step| (step - 1).abs_diff(self.step)) else { return };
        let hint = "Shows the pushes that were weighed before that step, and what became of the one that was done";
        ui.scope(|ui| {
            super::framed(ui);
            if ui.button(format!("Go to the push of step {nearest}")).on_hover_text(hint).clicked() {
                ask.push(Command::GoTo(nearest - 1));
            }
        });
    }

    /// What the push that led to the state at the cursor did.
    fn review(&self, state: &mut State, ui: &mut Ui) {
        let moment = self.session.moment(self.step);
        let pushed = moment.outcome.as_ref().is_some_and(|outcome| outcome.manipulated.is_some());
        if self.step == 0 || !pushed {
            return;
        }
        let key = (self.session.id, self.step);
        let known = state.review.filter(|review| review.of == key);
        let review = known.unwrap_or_else(|| Review::of(self.session.id, self.session.moment(self.step - 1), moment));
        state.review = Some(review);
        ui.add_space(8.0);
        push_review::show(ui, &review, &self.session.record, moment);
        self.surprise(state, ui);
        motion::show(ui, &mut state.scrubbed, self.session.id, moment);
    }

    /// Where the push that led to the state at the cursor did what was not expected of it.
    fn surprise(&self, state: &mut State, ui: &mut Ui) {
        let (before, after) = (self.session.moment(self.step - 1), self.session.moment(self.step));
        let Some(prediction) = after.outcome.as_ref().and_then(|outcome| outcome.prediction.as_ref()) else { return };
        let Some((truth_before, truth_after)) = before.truth.as_ref().zip(after.truth.as_ref()) else { return };
        let (grid, ctx) = (self.grid, ui.ctx().clone());
        let picture = state.textures.get(&ctx, (self.session.id, self.step, Shown::Surprise), || {
            let surprise = prediction.surprise(&grid, &truth_before.changed_cells(truth_after));
            textures::of_rgb(&picture::paint_surprise(&grid, &surprise))
        });
        let outlines = state.outlines_after.of(&after.bodies);
        heading(ui, "Surprise", "How improbable the prediction held what happened to each floor cell");
        let width = ui.available_width().clamp(40.0, 420.0);
        let picked = maps::picked_cell(self.model.picked, &grid);
        let name = "Map of the push: surprise";
        FloorMap { grid: &grid, picture: Some(&picture), outlines: &outlines, picked, apron_m: 0.0, name }
            .show(ui, width);
        ui.scope(|ui| {
            ui.set_max_width(width);
            let texts = Bar {
                name: "surprise",
                ends: ["0".to_owned(), format!("{MOST_SURPRISING:.1}")],
                unit: "nats of surprise",
                hint: "−ln of the probability given to the cell's changing or staying as it did",
            };
            legend::bar(ui, &texts, |t| Colormap::Magma.rgb(t));
        });
    }
}

/// From the least to the largest value of the feasible candidates.
fn value_range(decision: &Decision) -> [f32; 2] {
    let values = decision.candidates.iter().filter_map(|candidate| decision.value_of(candidate));
    let [low, high] =
        values.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    if low <= high { [low, high] } else { [0.0, 0.0] }
}

/// The probability that a push changes a cell; 0 outside the window of its prediction.
fn change_at(prediction: &Prediction, grid: &Grid, cell: usize) -> f32 {
    let at = in_window(&prediction.window, grid, cell);
    at.and_then(|at| prediction.change.get(at)).copied().unwrap_or(0.0)
}

/// A candidate in words, for the tooltip.
fn describe(at: usize, decision: &Decision, candidate: &CandidateRecord) -> String {
    let name = words::capital(candidate.manipulation.kind().name());
    match (&candidate.rejection, decision.value_of(candidate)) {
        (Some(rejection), _) => format!("{name} {at}, rejected: {}", candidate.manipulation.against(rejection)),
        (None, None) => format!("{name} {at}: not weighed"),
        (None, Some(value)) => {
            let gain = words::nats(candidate.gain.unwrap_or(0.0));
            let reg = words::nats(decision.disturbance_of(candidate).unwrap_or(0.0));
            format!("{name} {at}: {}\ngain {gain}, γ·Reg {reg}", words::nats(value))
        }
    }
}
