//! Two episodes on one clock.

use super::window::Window;
use egui_kittest::kittest::Queryable;
use nudge::workbench::command::Command;
use nudge::workbench::model::LayoutKind;
use nudge_core::plan::PolicyKind;

#[test]
fn two_policies_run_side_by_side_on_one_clock() {
    let mut window = Window::new();
    window.wait_for_label("first-look, ");
    window.click_first("first-look, ");
    let form = &mut window.app().model.kept.form;
    (form.budget, form.against) = (3, Some(PolicyKind::Random));
    window.harness.run_steps(2);
    window.press("Start both");
    window.wait_for("both have run", |app| {
        app.model.sessions.len() == 2 && app.model.sessions.iter().all(|session| session.is_finished())
    });
    window.wait();
    let model = window.model();
    assert_eq!(model.kept.layout, LayoutKind::Compare);
    let (a, b) = (model.session().expect("A"), model.other_session().expect("B"));
    assert_eq!((a.record.config.policy, b.record.config.policy), (PolicyKind::Mem, PolicyKind::Random));
    assert_eq!((a.record.config.seed, model.cursor), (b.record.config.seed, 3), "the clock followed both");
    assert_ne!(a.path, b.path);
    assert!(window.sees("First difference at step 1: "));
    for words in ["Floor map of A", "Floor map of B", "Floor map of A − B", "A solid, B dashed"] {
        assert!(window.sees(words), "{words}");
    }
    window.click("Go to step 0");
    assert_eq!(window.model().cursor, 0);
}

#[test]
fn a_comparison_goes_on_to_the_end_of_the_longer_episode() {
    let mut window = Window::with_episode(3);
    window.click("Decide");
    window.click("Do it");
    let short = window.session().id;
    window.click("Branch from here");
    window.click("Run");
    let long = window.session().id;
    window.app().ask(Command::Show(short));
    window.wait();
    window.click_first("Compare with first-look");
    assert_eq!((window.model().shown, window.model().other), (Some(short), Some(long)));
    window.click("Step 3");
    assert_eq!(window.model().cursor, 3);
    assert!(window.sees("A ends after step 1"));
    // Showing B as A changes the two over; another layout clamps the clock.
    window.app().ask(Command::Show(long));
    window.wait();
    assert_eq!(window.model().other, Some(short));
    window.app().ask(Command::Show(short));
    window.app().ask(Command::GoTo(3));
    window.wait();
    window.layout(LayoutKind::Episode);
    assert_eq!(window.model().cursor, 1);
    assert!(window.harness.query_by_label("Run both").is_none());
    window.layout(LayoutKind::Compare);
    window.click("Run both");
    assert_eq!(window.steps(), 3);
}
