use super::*;
use crate::annotations::object_name;
use crate::workbench::fixture;
use crate::workbench::panels::photo;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

const FIELD: egui::accesskit::Role = egui::accesskit::Role::MultilineTextInput;

/// A model whose orders are carried out as the window does.
struct Stage {
    model: Model,
    asked: Vec<Command>,
}

fn draw(ui: &mut egui::Ui, stage: &mut Stage) {
    let mut ask = Vec::new();
    show(ui, &mut stage.model, &mut ask);
    let shown = stage.model.shown.expect("an episode");
    for command in &ask {
        let session = stage.model.session_of_mut(shown).expect("an episode");
        match command {
            Command::Note(step, text) => drop(session.annotations.notes.insert(*step, text.clone())),
            Command::Overrule(step, name, Some(verdict)) => {
                session.annotations.verdicts.entry(*step).or_default().insert(name.clone(), *verdict);
            }
            Command::GoTo(step) => stage.model.cursor = *step,
            _ => {}
        }
    }
    stage.asked.extend(ask);
}

fn harness() -> Harness<'static, Stage> {
    let stage = Stage { model: fixture::model(), asked: Vec::new() };
    let mut harness = Harness::builder().with_size([360.0, 900.0]).build_ui_state(draw, stage);
    harness.run_steps(3);
    harness
}

fn has(harness: &Harness<'_, Stage>, text: &str) -> bool {
    harness.query_all_by_label_contains(text).next().is_some()
}

#[test]
fn a_note_is_kept_letter_by_letter_and_listed() {
    let mut harness = harness();
    harness.get_by_role_and_label(FIELD, "Note on step 5").focus();
    harness.run_steps(2);
    harness.get_by_role_and_label(FIELD, "Note on step 5").type_text("the can behind");
    harness.run_steps(2);
    harness.get_by_role_and_label(FIELD, "Note on step 5").type_text(" the box");
    harness.run_steps(3);
    let session = harness.state().model.session().expect("an episode");
    assert_eq!(session.annotations.notes.get(&5).map(String::as_str), Some("the can behind the box"));
    harness.state_mut().model.cursor = 2;
    harness.run_steps(3);
    assert!(has(&harness, "Note on step 2"));
    harness.get_by_label("Go to the note on step 5: the can behind the box").click();
    harness.run_steps(3);
    assert_eq!(harness.state().model.cursor, 5);
}

#[test]
fn an_overruled_verdict_is_marked_and_counted() {
    let mut harness = harness();
    let objects = harness
        .state()
        .model
        .moment()
        .and_then(|moment| moment.outcome.clone())
        .expect("a step")
        .record
        .objects()
        .to_vec();
    let wrong = objects.iter().find(|object| object.verdict != Verdict::Found).expect("one that was not found");
    let found = objects.iter().filter(|object| object.verdict == Verdict::Found).count();
    assert!(has(&harness, &format!("{found}\u{a0}found")));
    harness.get_by_label(&format!("Verdict on {}", object_name(wrong))).click();
    harness.run_steps(3);
    let choices: Vec<_> = harness.query_all_by_label("found").collect();
    choices.last().expect("a choice").click();
    drop(choices);
    harness.run_steps(3);
    assert!(has(&harness, &format!("{}\u{a0}found", found + 1)), "{:?}", harness.state().asked);
    assert!(has(&harness, "1 overruled") && has(&harness, "✏"));
}

#[test]
fn the_prior_has_a_note_and_no_verdicts() {
    let mut harness = harness();
    harness.state_mut().model.cursor = 0;
    harness.run_steps(3);
    assert!(has(&harness, "Note on the prior") && has(&harness, "Objects are judged after the first step"));
}

#[test]
#[ignore = "writes pictures; needs a wgpu adapter"]
fn pictures() {
    let mut model = fixture::model();
    let session = &mut model.sessions[0];
    let objects = session.moments[5].outcome.as_ref().expect("a step").record.objects().to_vec();
    session.annotations.notes.insert(0, "Nothing is known yet.".to_owned());
    session.annotations.notes.insert(5, "The push uncovered the tin; the box is still a guess.".to_owned());
    session.annotations.verdicts.entry(5).or_default().insert(object_name(&objects[0]), Verdict::Found);
    photo::take("notes", [330.0, 620.0], Stage { model, asked: Vec::new() }, draw, |_| true);
}
