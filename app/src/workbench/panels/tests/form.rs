//! The form of a new episode.

use super::*;
use nudge_core::camera::NoiseModel;
use nudge_core::plan::SETTINGS;

/// The form with everything unfolded, and no episode.
fn form() -> Harness<'static, Stage> {
    let mut harness = harness(episode::show, Model::default());
    for section in ["New episode", "Thresholds"] {
        harness.get_by_label(section).click();
        harness.run_steps(20);
    }
    harness
}

/// Opens a choice and takes one of what it offers.
fn choose(harness: &mut Harness<'_, Stage>, choice: &str, one: &str) {
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, choice).click();
    harness.run_steps(5);
    harness.get_by_role_and_label(egui::accesskit::Role::Button, one).click();
    harness.run_steps(5);
}

#[test]
fn the_form_shows_every_setting_of_the_planner() {
    let harness = form();
    for setting in SETTINGS {
        assert!(has(&harness, setting.label), "{} is not there", setting.label);
    }
}

#[test]
fn the_form_offers_view_arrays_a_file_and_noise() {
    let mut harness = form();
    assert!(!has(&harness, "array's file"));
    choose(&mut harness, "views", "real75");
    choose(&mut harness, "noise", "standard");
    let chosen = &harness.state().model.kept.form;
    assert_eq!((chosen.views.as_str(), chosen.noise), ("real75", Some(NoiseModel::STANDARD)));
    choose(&mut harness, "views", "a file");
    assert!(has(&harness, "array's file"));
    choose(&mut harness, "noise", "none");
    assert_eq!(harness.state().model.kept.form.noise, None);
}

#[test]
fn a_way_to_count_brings_its_thresholds_and_the_button_puts_them_back() {
    let mut harness = form();
    let chosen = &mut harness.state_mut().model.kept.form;
    *chosen = chosen.clone().with_belief(nudge_core::belief::CLASSICAL);
    chosen.planner.gamma = 0.5;
    choose(&mut harness, "gain of", "unseen voxels");
    let planner = harness.state().model.kept.form.planner;
    assert_eq!((planner.patience, planner.closing_steps, planner.gamma), (10.0, 4, 0.5));
    harness.get_by_label("Back to the defaults").click();
    harness.run_steps(5);
    assert_eq!(harness.state().model.kept.form.planner, nudge_core::plan::PlannerSettings::default());
}
