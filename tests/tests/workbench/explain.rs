//! Asking why, gains of views, what a push would do and did.

use super::window::Window;
use egui_kittest::kittest::{Queryable, by};
use nudge::workbench::command::Command;
use nudge::workbench::model::{Hovered, LayoutKind, Picked};
use nudge_core::camera::ViewId;
use nudge_core::plan::Action;
use re_viewer::external::egui::accesskit::Role;
use re_viewer::external::egui::{Key, Modifiers};

#[test]
fn a_cell_and_a_voxel_are_asked_about_by_pointer_and_by_key() {
    let mut window = Window::with_episode(2);
    window.click("Run");
    window.click("Map of semantics");
    let Some(Picked::Cell(cell)) = window.model().picked else { panic!("{:?}", window.model().picked) };
    assert_eq!(window.model().kept.layout, LayoutKind::Why);
    assert!(window.sees("Floor cell at") && window.sees("unknown share") && window.sees("What changed it"));
    // The arrow keys walk over the map that has the focus.
    window.harness.get_by_label("Map of semantics").focus();
    window.harness.run_steps(2);
    window.key(Modifiers::NONE, Key::ArrowUp);
    assert_eq!(window.model().picked, Some(Picked::Cell(cell + 1)));
    window.click("Probability of occupancy up the column");
    assert!(matches!(window.model().picked, Some(Picked::Voxel(_))), "{:?}", window.model().picked);
    for words in ["Beta", "variance", "entropy", "truth", "Over the steps", "Class of the floor cell"] {
        assert!(window.sees(words), "{words}");
    }
    // The arrow keys walk up and down the column.
    let Some(Picked::Voxel(voxel)) = window.model().picked else { panic!("{:?}", window.model().picked) };
    window.harness.get_by_label("Probability of occupancy up the column").focus();
    window.harness.run_steps(2);
    window.key(Modifiers::NONE, Key::ArrowDown);
    assert_eq!(window.model().picked, Some(Picked::Voxel(voxel - 1)));
    window.click("Its floor cell");
    assert_eq!(window.model().picked, Some(Picked::Cell(cell + 1)));
    // History and causes lead to their steps.
    window.key(Modifiers::NONE, Key::Home);
    assert_eq!(window.model().cursor, 0);
    if window.sees("step 1, look") {
        window.click_first("step 1, look");
        assert_eq!(window.model().cursor, 1);
    }
}

#[test]
fn a_views_gain_is_explained_and_follows_the_clock() {
    let mut window = Window::with_episode(2);
    window.click("Run");
    window.layout(LayoutKind::Gains);
    window.click("Step 1");
    window.click("Gain of the views at target 2");
    let view = window.model().view.expect("a view");
    let source = window.model().gain_source.clone().expect("where its gain comes from");
    assert_eq!((source.view, source.of.1), (view, 1));
    let sum: f32 = source.nats.iter().map(|(_, nats)| nats).sum();
    let gain = window.session().record.steps[1].decision.gains[usize::from(view.0)];
    assert!((sum - gain).abs() <= 0.02 * gain.max(1.0), "the voxels' nats sum to the view's gain: {sum}, {gain}");
    assert!(window.sees("By height") && window.sees("nats from all voxels together"));
    window.click("Step 0");
    assert_eq!(window.model().gain_source.as_ref().map(|source| (source.of.1, source.view)), Some((0, view)));
    window.harness.get_by_label("Gain of the views at target 2").focus();
    window.harness.run_steps(2);
    window.key(Modifiers::NONE, Key::ArrowLeft);
    assert_ne!(window.model().view, Some(view));
}

/// A window in which pushes have been weighed after four looks.
fn with_weighed_pushes() -> Window {
    let mut window = Window::with_pushes(8);
    // Something has to be seen, three times over, before it is sure enough to be pushed.
    for view in [133, 136, 163, 166] {
        window.app().ask(Command::DoInstead(Action::Look { view: ViewId(view) }));
        window.wait();
    }
    window.click("Decide");
    window
}

#[test]
fn the_layout_of_pushes_begins_with_the_chosen_push_and_a_branch_keeps_the_one_that_was_chosen() {
    let mut window = with_weighed_pushes();
    let decision = window.session().pending.clone().expect("a decision");
    assert_eq!(window.model().candidate, None);
    window.layout(LayoutKind::Push);
    let pushed =
        decision.candidates.iter().position(|candidate| Action::Manipulate(candidate.manipulation) == decision.action);
    let first = pushed.or(decision.best_push).expect("a push was weighed");
    assert_eq!(window.model().candidate, Some(first));
    let preview = window.model().preview.clone().expect("a prediction, unasked");
    assert_eq!((preview.of, preview.manipulation), ((window.session().id, 4), decision.candidates[first].manipulation));

    // Another one is chosen, and the episode is branched.
    let other =
        decision.candidates.iter().enumerate().find(|(at, candidate)| *at != first && candidate.rejection.is_none());
    let (other, _) = other.expect("another feasible push");
    window.click_first(&format!("Push {other}, value"));
    let title = window.session().title();
    window.click("Branch from here");
    let branch = window.session();
    assert_eq!((window.model().sessions.len(), branch.steps()), (2, 4));
    assert_eq!(branch.pending.as_deref(), Some(&*decision), "what was decided holds in the branch");
    assert_eq!(window.model().candidate, Some(other));
    let preview = window.model().preview.clone().expect("a prediction");
    assert_eq!((preview.of, preview.manipulation), ((branch.id, 4), decision.candidates[other].manipulation));
    assert_eq!(branch.title(), format!("{title} from step 4"));
    assert!(branch.path.to_string_lossy().ends_with("-from-step-4"), "{}", branch.path.display());
    assert!(window.sees(&format!("{title} from step 4")));
    window.click("Do it");
    assert_eq!((window.steps(), window.session().record.steps[4].action), (5, decision.action));
}

#[test]
fn a_push_is_previewed_done_and_reviewed() {
    let mut window = with_weighed_pushes();
    let decision = window.session().pending.clone().expect("a decision");
    let feasible = decision.candidates.iter().filter(|candidate| candidate.rejection.is_none()).count();
    assert!((1..=12).contains(&feasible), "as many as the form says at most: {feasible}");
    let feasible = decision.candidates.iter().position(|candidate| candidate.rejection.is_none()).expect("feasible");
    window.layout(LayoutKind::Push);
    window.hover_first(&format!("Push {feasible}, value"));
    assert_eq!(window.model().hovered, Hovered::Manipulation(decision.candidates[feasible].manipulation));
    window.click_first(&format!("Push {feasible}, value"));
    let preview = window.model().preview.clone().expect("a prediction");
    assert_eq!((preview.of.1, preview.manipulation), (4, decision.candidates[feasible].manipulation));
    assert!(!preview.swept.is_empty());
    for map in ["Map of the push: now", "Map of the push: predicted", "Map of the push: change"] {
        assert!(window.sees(map), "{map}");
    }
    window.click("Do this");
    assert_eq!(window.steps(), 5, "{:?}", window.toasts());
    assert_eq!(window.session().record.steps[4].action, Action::Manipulate(decision.candidates[feasible].manipulation));
    // The arm can be moved along what it did.
    assert!(window.sees("The arm in step 5") && window.sees("approach"));
    let scrubbed = |window: &Window| window.model().scrubbed.at_s((window.session().id, 5));
    assert_eq!(scrubbed(&window), None);
    let slider = "Time in the arm's motion";
    window.harness.get(by().role(Role::Slider).label(slider)).focus();
    window.harness.run_steps(2);
    window.key(Modifiers::NONE, Key::ArrowRight);
    assert!(scrubbed(&window).is_some_and(|at_s| at_s > 0.0), "{:?}", scrubbed(&window));
    window.click("Hide arm");
    assert_eq!(scrubbed(&window), None);
    // One step back, the same push shows what happened beside what was predicted.
    window.click("Step 4");
    window.click_first(&format!("Push {feasible}, value"));
    assert!(window.sees("Map of the push: what happened"));
}
