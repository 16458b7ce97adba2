//! Pictures of the panels, for a person to look at: `cargo test ... panels -- --ignored pictures`, into the directory
//! that `NUDGE_PICTURES` names.

use super::Stage;
use crate::workbench::fixture::{self, Script};
use crate::workbench::model::{LayoutKind, Model, Picked};
use crate::workbench::panels::{camera, compare, curves, decision, episode, gains, maps, push, why};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use nudge_core::camera::ViewId;
use nudge_core::episode::EpisodeConfig;
use nudge_core::plan::{PlannerSettings, PolicyKind};
use nudge_core::scene::{Catalog, Scene};
use re_viewer::external::egui;
use re_viewer::external::re_ui;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A crowded shelf at full resolution, and a second episode that parts from it.
fn crowded() -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/high/tunnel.toml");
    let scene = Scene::load(&path, &Catalog::standard()).expect("scene").0;
    let config = EpisodeConfig {
        policy: PolicyKind::Mem,
        belief: "classical".to_owned(),
        seed: 3,
        budget: 12,
        views: "standard300".to_owned(),
        planner: PlannerSettings::default(),
        noise: None,
    };
    let script = |push_at: usize, stray_at: usize| {
        let (scene, config) = (scene.clone(), config.clone());
        Script { scene, config, steps: 8, push_at, stray_at }.play()
    };
    let mut model = fixture::model_of(vec![script(6, 0).session(1), script(0, 4).session(2)]);
    model.other = Some(model.sessions[1].id);
    model
}

#[test]
#[ignore = "writes pictures; needs a wgpu adapter"]
fn pictures() {
    let out =
        std::env::var_os("NUDGE_PICTURES").map_or_else(|| std::env::temp_dir().join("nudge-panels"), PathBuf::from);
    std::fs::create_dir_all(&out).expect("directory");
    let shots: [(&str, super::Make, [f32; 2], usize); 11] = [
        ("maps", || Box::new(maps::State::default()), [520.0, 640.0], 8),
        ("camera", || Box::new(camera::State::default()), [520.0, 260.0], 8),
        ("curves", || Box::new(curves::show), [900.0, 190.0], 7),
        ("decision", || Box::new(decision::State::default()), [330.0, 860.0], 5),
        ("why-voxel", || Box::<why::State>::default(), [460.0, 860.0], 8),
        ("why-cell", || Box::<why::State>::default(), [460.0, 860.0], 8),
        ("gains", || Box::new(gains::State::default()), [560.0, 640.0], 5),
        ("push", || Box::new(push::State::default()), [620.0, 1150.0], 5),
        ("push-done", || Box::new(push::State::default()), [620.0, 900.0], 6),
        ("compare", || Box::new(compare::State::default()), [900.0, 640.0], 8),
        ("new-episode", || Box::new(episode::show), [236.0, 900.0], 8),
    ];
    let only = std::env::var("NUDGE_ONLY").unwrap_or_default();
    let mut model = crowded();
    for (name, panel, size, cursor) in shots.into_iter().filter(|(name, ..)| name.contains(&only)) {
        for theme in [egui::Theme::Dark, egui::Theme::Light] {
            prepare(&mut model, name, cursor);
            let stage = Stage { model, asked: Vec::new(), panel: panel() };
            let mut styled = 0;
            let mut spent = Vec::new();
            let draw = |ui: &mut egui::Ui, stage: &mut Stage| {
                if styled == 0 {
                    re_ui::apply_style_and_install_loaders(ui.ctx());
                    ui.ctx().set_theme(theme);
                }
                styled += 1;
                let started = Instant::now();
                egui::Frame::central_panel(ui.style()).inner_margin(8).show(ui, |ui| {
                    stage.panel.show(ui, &mut stage.model, &mut stage.asked);
                });
                spent.push(started.elapsed().as_secs_f64() * 1e3);
            };
            let mut harness =
                Harness::builder().with_size(size).with_pixels_per_point(2.0).wgpu().build_ui_state(draw, stage);
            harness.run_steps(8);
            if name == "new-episode" {
                for section in ["New episode", "Thresholds"] {
                    harness.get_by_label(section).click();
                    harness.run_steps(20);
                }
            }
            let theme = if theme == egui::Theme::Dark { "dark" } else { "light" };
            harness.render().expect("rendered").save(out.join(format!("{name}-{theme}.png"))).expect("written");
            let stage = harness.into_state();
            model = stage.model;
            let steady = spent.iter().skip(4).copied().fold(f64::INFINITY, f64::min);
            println!(
                "{name} {theme}: first {:.2} ms, then {steady:.2} ms a frame",
                spent.iter().copied().fold(0.0, f64::max)
            );
        }
    }
}

/// What a person would have chosen before the picture.
fn prepare(model: &mut Model, name: &str, cursor: usize) {
    model.cursor = cursor;
    model.kept.layout = if name == "compare" { LayoutKind::Compare } else { LayoutKind::Episode };
    let session = &model.sessions[0];
    let swept = session.moments[6].outcome.as_ref().and_then(|outcome| outcome.swept.as_ref());
    let middle = swept.and_then(|swept| swept.swept.iter().nth(swept.swept.len() * 3 / 4));
    let height = session.moments[0].belief.grid().dims[2];
    model.picked = match (name, middle) {
        ("why-cell", Some(voxel)) => Some(Picked::Cell(voxel / height)),
        (_, Some(voxel)) => Some(Picked::Voxel(voxel)),
        _ => Some(Picked::Cell(2000)),
    };
    let decision = session.decision_after(cursor);
    model.view = decision.and_then(|decision| decision.pair.first().copied()).or(Some(ViewId(140)));
    model.candidate = decision.and_then(|decision| decision.pushed().or(decision.best_push));
    fixture::answer(model);
}
