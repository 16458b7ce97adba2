//! The panels on a real short episode, by what a person sees and presses; and their pictures, for a person to look at.

use super::*;
use crate::workbench::fixture;
use crate::workbench::model::{LayoutKind, Picked};
use crate::workbench::session::{Activity, Moment};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use nudge_core::plan::Action;
use nudge_core::skill::Manipulation;
use std::sync::Arc;

mod form;
mod look;
mod recorded;

/// Makes a panel that has drawn nothing yet.
type Make = fn() -> Box<dyn Panel>;

/// The panels of an episode, each as it is before it has drawn anything.
const PANELS: [(&str, Make); 8] = [
    ("maps", || Box::new(maps::State::default())),
    ("camera", || Box::new(camera::State::default())),
    ("curves", || Box::new(curves::show)),
    ("decision", || Box::new(decision::State::default())),
    ("why", || Box::<why::State>::default()),
    ("gains", || Box::new(gains::State::default())),
    ("push", || Box::new(push::State::default())),
    ("compare", || Box::new(compare::State::default())),
];

/// A model, a panel and what was asked for.
struct Stage {
    model: Model,
    asked: Vec<Command>,
    panel: Box<dyn Panel>,
}

fn harness(panel: impl Panel + 'static, model: Model) -> Harness<'static, Stage> {
    harness_of(Box::new(panel), model)
}

fn harness_of(panel: Box<dyn Panel>, model: Model) -> Harness<'static, Stage> {
    let draw = |ui: &mut egui::Ui, stage: &mut Stage| stage.panel.show(ui, &mut stage.model, &mut stage.asked);
    let stage = Stage { model, asked: Vec::new(), panel };
    let mut harness = Harness::builder().with_size([640.0, 900.0]).build_ui_state(draw, stage);
    harness.run_steps(3);
    harness
}

fn has(harness: &Harness<'_, Stage>, text: &str) -> bool {
    harness.query_all_by_label_contains(text).next().is_some()
}

/// A click at a place, after the pointer went there.
fn click_at(harness: &mut Harness<'_, Stage>, at: egui::Pos2) {
    harness.hover_at(at);
    harness.run_steps(1);
    for pressed in [true, false] {
        let modifiers = egui::Modifiers::NONE;
        harness.event(egui::Event::PointerButton { pos: at, button: egui::PointerButton::Primary, pressed, modifiers });
    }
    harness.run_steps(3);
}

/// The last thing asked for, if `is` takes it.
fn asked<T>(harness: &Harness<'_, Stage>, is: impl Fn(&Command) -> Option<T>) -> Option<T> {
    harness.state().asked.iter().rev().find_map(is)
}

#[test]
fn without_an_episode_every_panel_says_what_to_do() {
    for (name, panel) in PANELS {
        let harness = harness_of(panel(), Model::default());
        assert!(has(&harness, "Open a scene, or drop one here"), "{name}");
    }
}

#[test]
fn every_panel_draws_every_state() {
    for (name, panel) in PANELS {
        let mut model = fixture::model_of(vec![fixture::session(1), fixture::stray_session(2)]);
        model.other = Some(model.sessions[1].id);
        model.kept.layout = LayoutKind::Compare;
        (model.picked, model.view, model.candidate) = (Some(Picked::Voxel(777)), Some(ViewId(3)), Some(0));
        let mut harness = harness_of(panel(), model);
        for cursor in 0..=7 {
            harness.state_mut().model.cursor = cursor;
            harness.run_steps(2);
        }
        for picked in [Some(Picked::Cell(1)), Some(Picked::Cell(usize::MAX)), Some(Picked::Voxel(usize::MAX)), None] {
            harness.state_mut().model.picked = picked;
            harness.run_steps(1);
        }
        (harness.state_mut().model.view, harness.state_mut().model.candidate) = (Some(ViewId(9999)), Some(9999));
        harness.state_mut().model.slice_m = Some(f32::NAN);
        harness.run_steps(2);
        // Before anything is painted, and with an episode that has only its prior and nothing pending.
        harness.state_mut().panel = panel();
        let model = &mut harness.state_mut().model;
        model.derived.clear();
        model.sessions[0].moments.truncate(1);
        model.sessions[0].pending = None;
        model.sessions[0].record.steps.clear();
        harness.run_steps(2);
        assert!(harness.root().accesskit_node().children().next().is_some(), "{name} draws nothing");
    }
}

#[test]
fn numbers_that_are_none_and_other_arrays_do_no_harm() {
    for (_, panel) in PANELS {
        let mut model = fixture::model();
        let mut decision = (*model.sessions[0].pending.clone().expect("pending")).clone();
        (decision.igv, decision.igm, decision.reg) = (f32::NAN, f32::INFINITY, f32::NAN);
        decision.gains = vec![f32::NAN, 3.0];
        decision.pair = vec![ViewId(60_000)];
        for candidate in &mut decision.candidates {
            candidate.gain = Some(f32::NAN);
            if let Manipulation::Push(push) = &mut candidate.manipulation {
                push.direction_deg = f32::NAN;
            }
        }
        decision.best_push = Some(9999);
        model.sessions[0].pending = Some(Arc::new(decision));
        let mut views = (*model.sessions[0].setup.views).clone();
        views.layout = [4, 1, 7];
        views.views.truncate(2);
        model.sessions[0].setup.views = Arc::new(views);
        (model.view, model.candidate) = (Some(ViewId(1)), Some(0));
        let mut harness = harness_of(panel(), model);
        harness.run_steps(2);
    }
}

#[test]
fn a_click_on_a_map_asks_about_its_cell() {
    let mut harness = harness(maps::State::default(), fixture::model());
    for title in ["Semantics", "Certainty", "Entropy", "Truth", "Error", "Classes"] {
        assert!(harness.query_by_label(title).is_some(), "{title}");
    }
    let map = harness.get_by_label("Map of truth").rect();
    let at = map.left_bottom() + egui::vec2(0.25 * map.width() + 1.0, -0.5);
    click_at(&mut harness, at);
    let cell = asked(&harness, |command| match command {
        Command::Pick(Some(Picked::Cell(cell))) => Some(*cell),
        _ => None,
    });
    let grid = *harness.state().model.sessions[0].moments[0].belief.grid();
    let expected = grid.cell_index(nudge_core::grid::Cell { x: (grid.dims[0] / 4) as u16, y: 0 });
    assert_eq!(cell, Some(expected));
}

#[test]
fn maps_stay_until_the_next_are_painted_and_a_slice_takes_the_first_place() {
    let mut harness = harness(maps::State::default(), fixture::model());
    let model = &mut harness.state_mut().model;
    model.cursor = 2;
    model.derived.clear();
    harness.run_steps(2);
    assert!(has(&harness, "Painting step 2") && harness.query_by_label("Map of semantics").is_some());
    let model = &mut harness.state_mut().model;
    model.slice_m = Some(0.055);
    harness.run_steps(2);
    assert!(harness.query_by_label("Occupancy at 0.055 m").is_some());
    assert!(harness.query_by_label("Map of semantics").is_none());
    harness.get_by_label("Slice").click();
    harness.run_steps(2);
    assert_eq!(harness.state().model.slice_m, None);
}

#[test]
fn the_camera_shows_the_last_look() {
    let mut harness = harness(camera::State::default(), fixture::model());
    let model = &mut harness.state_mut().model;
    // The fourth action is a push: the image of the third stays.
    model.cursor = 4;
    let Action::Look { view } = model.sessions[0].record.steps[2].action else { panic!("a look") };
    harness.run_steps(2);
    assert!(has(&harness, &format!("Camera: view {} at step 3", view.0)));
    assert!(harness.query_by_label("Depth image").is_some() && harness.query_by_label("Label image").is_some());
    harness.state_mut().model.cursor = 0;
    harness.run_steps(2);
    assert!(has(&harness, "No image yet"));
}

#[test]
fn a_click_on_the_curves_moves_the_cursor() {
    let mut harness = harness(curves::show, fixture::model());
    let plot = harness.get_by_label("Scores over the steps").rect();
    let at = plot.center();
    click_at(&mut harness, at);
    let step = asked(&harness, |command| match command {
        Command::GoTo(step) => Some(*step),
        _ => None,
    });
    assert_eq!(step, Some(3), "the budget is six");
}

#[test]
fn the_decision_says_what_why_and_lets_a_person_do_something_else() {
    let mut harness = harness(decision::State::default(), fixture::model());
    assert!(has(&harness, "Step 6 of 6") && has(&harness, "because nothing is pushed in the last step"));
    // The second row of the views: pointing at it, then choosing it.
    let rows: Vec<egui::Rect> = harness.query_all_by_label_contains(", gain ").map(|row| row.rect()).collect();
    assert_eq!(rows.len(), weighed::LISTED);
    harness.hover_at(rows[1].center());
    harness.run_steps(2);
    let Hovered::View(over) = harness.state().model.hovered else { panic!("nothing under the pointer") };
    harness.hover_at(egui::pos2(1.0, 1.0));
    harness.run_steps(2);
    assert_eq!(harness.state().model.hovered, Hovered::Nothing);
    click_at(&mut harness, rows[1].center());
    assert_eq!(harness.state().model.view, Some(over));
    harness.get_by_label("Look from here").click();
    harness.run_steps(2);
    let done = asked(&harness, |command| match command {
        Command::DoInstead(action) => Some(*action),
        _ => None,
    });
    assert_eq!(done, Some(Action::Look { view: over }));
}

#[test]
fn nothing_else_can_be_done_in_the_past_or_while_busy() {
    let disabled = |harness: &Harness<'_, Stage>| harness.get_by_label("Look from here").accesskit_node().is_disabled();
    let mut model = fixture::model();
    model.view = Some(ViewId(3));
    let mut harness = harness(decision::State::default(), model);
    assert!(!disabled(&harness));
    harness.state_mut().model.sessions[0].activity = Activity::Running;
    harness.run_steps(2);
    assert!(disabled(&harness));
    harness.state_mut().model.sessions[0].activity = Activity::Idle;
    harness.state_mut().model.cursor = 2;
    harness.run_steps(2);
    assert!(disabled(&harness));
}

#[test]
fn a_click_on_a_heading_sorts() {
    let mut harness = harness(decision::State::default(), fixture::model());
    let first = |harness: &Harness<'_, Stage>| {
        let rows = harness.query_all_by_label_contains(", gain ");
        let top = rows.min_by(|a, b| a.rect().top().total_cmp(&b.rect().top())).expect("rows");
        top.accesskit_node().label().expect("named")
    };
    let best = first(&harness);
    harness.get_by_label("Sort by Gain").click();
    harness.run_steps(3);
    assert_ne!(first(&harness), best);
    harness.get_by_label("Sort by Gain").click();
    harness.run_steps(3);
    assert_eq!(first(&harness), best);
}

#[test]
fn why_tells_the_causes_of_a_swept_voxel() {
    let mut model = fixture::model();
    let outcome = model.sessions[0].moments[4].outcome.clone().expect("step 4");
    let swept = &outcome.swept.as_ref().expect("step 4 is a push").swept;
    let voxel = swept.iter().nth(swept.len() / 2).expect("sweeps something");
    model.picked = Some(Picked::Voxel(voxel));
    let mut harness = harness(why::State::default(), model);
    assert!(has(&harness, "Voxel at") && has(&harness, "step 4, push: swept"));
    harness.query_all_by_label_contains("step 4, push: swept").next().expect("cause").click();
    harness.run_steps(2);
    assert!(asked(&harness, |command| matches!(command, Command::GoTo(4)).then_some(())).is_some());
    harness.get_by_label("Its floor cell").click();
    harness.run_steps(2);
    let cell = asked(&harness, |command| match command {
        Command::Pick(Some(Picked::Cell(cell))) => Some(*cell),
        _ => None,
    });
    let height = harness.state().model.sessions[0].moments[0].belief.grid().dims[2];
    assert_eq!(cell, Some(voxel / height));
}

#[test]
fn why_tells_of_a_change_that_a_network_made_without_seeing() {
    let mut model = fixture::model();
    model.sessions[0].record.config.belief = nudge_core::belief::CNABU.to_owned();
    let moment = model.sessions[0].moments[2].clone();
    let outcome = moment.outcome.as_ref().expect("step 2");
    let Action::Look { view } = outcome.record.action else { panic!("step 2 is a look") };
    let observation = outcome.observation.as_ref().expect("a look");
    let mut belief = moment.belief.belief();
    let unseen = |voxel: &usize| !observation.free.contains(*voxel) && !observation.occupied.contains(*voxel);
    let before = model.sessions[0].moments[1].belief.belief();
    let voxel = (0..belief.occupancy.len()).filter(unseen).find(|voxel| before.probability(*voxel) < 0.7).expect("one");
    belief.occupancy[voxel] = [8.0, 2.0];
    let belief = crate::workbench::half_belief::HalfBelief::of(&belief);
    model.sessions[0].moments[2] = Arc::new(Moment { belief, ..(*moment).clone() });
    model.picked = Some(Picked::Voxel(voxel));
    let harness = harness(why::State::default(), model);
    assert!(has(&harness, &format!("step 2, look from view {}: network, not seen", view.0)));
    assert!(has(&harness, "→ 0.80"));
}

#[test]
fn the_largest_changes_of_a_step_are_sorted_and_clicked() {
    let mut model = fixture::model();
    let session = &model.sessions[0];
    let (before, after) = (&session.moments[1], &session.moments[2]);
    let cause =
        |picked| causes::of_step(&session.setup.catalog, &session.record.config.belief, [before, after], picked);
    let largest = crate::workbench::changes::largest(before, after, cause);
    let (voxel, cell) = (largest.voxels[0].clone(), largest.cells[0].clone());
    model.largest = Some(((session.id, 2, true), Arc::new(largest)));
    model.cursor = 2;
    let mut harness = harness(why::State::default(), model);
    assert!(has(&harness, "Largest changes of step 2"));
    let first = |harness: &Harness<'_, Stage>, of: &str| {
        let name = format!("Change of {of}");
        let rows = harness.query_all_by_label_contains(&name);
        let top = rows.min_by(|a, b| a.rect().top().total_cmp(&b.rect().top())).expect("rows");
        (top.accesskit_node().label().expect("named"), top.rect().center())
    };
    let (largest, at) = first(&harness, "voxel");
    let [from, to] = voxel.from_to.map(words::probability);
    assert!(largest.ends_with(&format!("{from} → {to}")), "{largest}");
    click_at(&mut harness, at);
    let picked = |command: &Command| match command {
        Command::Pick(picked) => *picked,
        _ => None,
    };
    assert_eq!(asked(&harness, picked), Some(voxel.of));
    // Of a classical look all have changed by the same, but not at the same place.
    let mut tops = Vec::new();
    for _ in 0..2 {
        harness.get_by_label("Sort by x, y, z m").click();
        harness.run_steps(3);
        tops.push(first(&harness, "voxel").0);
    }
    assert_ne!(tops[0], tops[1], "falling, then rising");
    harness.get_by_label("floor cells").click();
    harness.run_steps(3);
    let (_, at) = first(&harness, "floor cell");
    click_at(&mut harness, at);
    assert_eq!(asked(&harness, picked), Some(cell.of));
}

#[test]
fn causes_are_not_made_up_before_a_log_is_checked() {
    let mut model = fixture::model();
    let moments = &mut model.sessions[0].moments;
    let voxel = moments[1].outcome.as_ref().and_then(|outcome| outcome.observation.as_ref()).expect("a look");
    let voxel = voxel.occupied.iter().next().expect("something was seen");
    for moment in moments.iter_mut() {
        let outcome = moment.outcome.as_deref().cloned();
        let outcome =
            outcome.map(|outcome| Arc::new(nudge_core::episode::StepOutcome { observation: None, ..outcome }));
        *moment = Arc::new(Moment { is_whole: false, outcome, ..(**moment).clone() });
    }
    model.picked = Some(Picked::Voxel(voxel));
    let harness = harness(why::State::default(), model);
    assert!(has(&harness, "not known until its log is checked") && !has(&harness, "not seen"));
}

#[test]
fn a_run_that_pauses_says_so() {
    let mut model = fixture::model();
    model.sessions[0].activity = Activity::Running;
    model.sessions[0].pausing = true;
    let harness = harness(episode::show, model);
    assert!(has(&harness, "pauses after this action"));
    assert!(harness.get_by_label("Pause").accesskit_node().is_disabled());
}

#[test]
fn the_last_decision_can_be_seen_again_before_the_next_is_made() {
    let mut model = fixture::model();
    model.sessions[0].pending = None;
    let mut harness = harness(decision::State::default(), model);
    harness.get_by_label("See the last decision").click();
    harness.run_steps(2);
    assert!(asked(&harness, |command| matches!(command, Command::GoTo(4)).then_some(())).is_some());
}

#[test]
fn why_names_the_label_that_a_cell_was_given() {
    let mut model = fixture::model();
    let outcome = model.sessions[0].moments[1].outcome.clone().expect("step 1");
    let labels = &outcome.observation.as_ref().expect("a look").labels;
    let cell = labels.iter().position(|label| *label < 14).expect("something was seen");
    let name = crate::colors::class_title(&model.sessions[0].setup.catalog, nudge_core::scene::ClassId(labels[cell]));
    model.picked = Some(Picked::Cell(cell));
    let harness = harness(why::State::default(), model);
    assert!(has(&harness, "Floor cell at") && has(&harness, &format!("labelled {name}")));
}

#[test]
fn a_click_on_a_heat_map_explains_a_view() {
    let mut harness = harness(gains::State::default(), fixture::model());
    assert_eq!(harness.query_all_by_label_contains("Gain of the views at target").count(), 3);
    let map = harness.get_by_label("Gain of the views at target 2").rect();
    let at = map.left_bottom() + egui::vec2(2.0, -2.0);
    harness.hover_at(at);
    harness.run_steps(2);
    // The lowest left position of the second target is the second view.
    assert_eq!(harness.state().model.hovered, Hovered::View(ViewId(1)));
    click_at(&mut harness, at);
    assert!(asked(&harness, |command| matches!(command, Command::GainOf(ViewId(1))).then_some(())).is_some());
    fixture::answer(&mut harness.state_mut().model);
    harness.run_steps(2);
    assert!(has(&harness, "By height") && has(&harness, "nats from all voxels together"));
}

#[test]
fn a_push_is_predicted_and_then_judged() {
    let mut model = fixture::model();
    model.cursor = 3;
    let mut harness = harness(push::State::default(), model);
    let row = harness.query_all_by_label_contains(", value ").next().expect("a feasible push").rect();
    click_at(&mut harness, row.center());
    assert!(harness.state().model.candidate.is_some());
    assert!(asked(&harness, |command| matches!(command, Command::Preview(_)).then_some(())).is_some());
    let model = &mut harness.state_mut().model;
    let decision = model.sessions[0].moments[4].decision().expect("step 4").clone();
    model.candidate = decision.pushed();
    fixture::answer(model);
    harness.run_steps(2);
    for title in ["Now", "Predicted", "Change", "What happened"] {
        assert!(harness.query_by_label(title).is_some(), "{title}");
    }
    harness.state_mut().model.cursor = 4;
    harness.run_steps(2);
    assert!(has(&harness, "What the push of step 4 did") && has(&harness, "precision"));
}

#[test]
fn a_comparison_tells_where_two_episodes_part() {
    let mut model = fixture::model_of(vec![fixture::session(1), fixture::stray_session(2)]);
    model.kept.layout = LayoutKind::Compare;
    let mut harness = harness(compare::State::default(), model);
    assert!(has(&harness, "Choose a second episode"));
    harness.state_mut().model.other = Some(crate::workbench::session::SessionId(2));
    harness.run_steps(2);
    assert!(has(&harness, "First difference at step 2: A looks from view"));
    assert!(has(&harness, "B ends after step 3"));
    harness.get_by_label("Go to step 1").click();
    harness.run_steps(2);
    assert!(asked(&harness, |command| matches!(command, Command::GoTo(1)).then_some(())).is_some());
    for map in ["Floor map of A", "Floor map of B", "Floor map of A − B"] {
        assert!(harness.query_by_label(map).is_some(), "{map}");
    }
}

#[test]
fn steps_without_a_push_offer_the_way_to_the_nearest() {
    let mut model = fixture::model();
    model.cursor = 0;
    let mut harness = harness(push::State::default(), model);
    assert!(has(&harness, "No push was weighed before step 1"));
    harness.get_by_label("Go to the push of step 4").click();
    harness.run_steps(2);
    assert!(asked(&harness, |command| matches!(command, Command::GoTo(3)).then_some(())).is_some());
    harness.state_mut().model = fixture::model_of(vec![fixture::stray_session(2)]);
    harness.state_mut().model.cursor = 0;
    harness.run_steps(2);
    assert!(has(&harness, "No push was done in this episode"));
}

#[test]
fn a_push_that_was_blocked_early_tells_the_length_that_was_planned() {
    let mut model = fixture::model();
    let moment = model.sessions[0].moments[4].clone();
    let mut outcome = (**moment.outcome.as_ref().expect("step 4")).clone();
    let Action::Manipulate(Manipulation::Push(mut push)) = outcome.record.action else { panic!("step 4 is a push") };
    push.length_m = 0.14;
    outcome.record.action = Action::Manipulate(push.into());
    // What it swept ends where the arm was blocked.
    let early = nudge_core::skill::Push { length_m: 0.05, ..push };
    outcome.swept.as_mut().expect("swept").manipulation = early.into();
    let report = outcome.record.push.as_mut().expect("a report");
    (report.pushed_m, report.stalled) = (0.05, true);
    let pushed = outcome.manipulated.as_mut().expect("an outcome");
    (pushed.way_m, pushed.stalled) = (0.05, true);
    model.sessions[0].moments[4] = Arc::new(Moment { outcome: Some(Arc::new(outcome)), ..(*moment).clone() });
    model.cursor = 4;
    let harness = harness(push::State::default(), model);
    assert!(has(&harness, "What the push of step 4 did") && harness.query_by_label("50 of 140 mm").is_some());
    assert!(has(&harness, "the arm was blocked after 50 of 140 mm of its push") && !has(&harness, "50 of 50"));
}

#[test]
fn the_networks_belief_is_named_in_words() {
    let mut model = fixture::model();
    model.sessions[0].record.config.belief = nudge_core::belief::CNABU.to_owned();
    let harness = harness(episode::show, model);
    assert!(has(&harness, "networks (cnabu)"));
}
