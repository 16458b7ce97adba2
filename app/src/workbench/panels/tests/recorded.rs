//! The panels on an episode whose truth nobody knows.

use super::*;

#[test]
fn a_recording_offers_no_truth_and_names_no_policy_that_chose_nothing() {
    let mut model = fixture::model();
    let mut record = crate::fixture::without_truth(&model.sessions[0].record);
    record.config.views = nudge_core::camera::ViewArray::RECORDED.to_owned();
    record.steps.iter_mut().for_each(|step| step.decision.reason = nudge_core::plan::Reason::Manual);
    let policy = record.config.policy.to_string();
    let has_policy = harness(episode::show, fixture::model()).query_by_label(&policy).is_some();
    assert!(has_policy, "of a simulated shelf the policy is named");
    model.sessions[0].record = record;
    let episode = harness(episode::show, model);
    assert!(episode.query_by_label("in recorded order").is_some() && episode.query_by_label(&policy).is_none());
    let Stage { model, .. } = episode.into_state();
    let display = |ui: &mut egui::Ui, model: &mut Model, ask: &mut Vec<Command>| display::show(ui, model, 0, ask);
    assert!(harness(display, fixture::model()).query_by_label("truth").is_some());
    assert!(harness(display, model).query_by_label("truth").is_none());
}
