//! Pictures of panels, for a person to look at: `cargo test ... -- --ignored pictures`, into the directory that
//! `NUDGE_PICTURES` names. In the window's style, at twice the resolution.

use egui_kittest::Harness;
use re_viewer::external::egui;
use re_viewer::external::re_ui;
use std::path::PathBuf;

/// Draws `stage` in both themes until `is_ready` (or two minutes have gone), and writes `NAME-dark.png` and
/// `NAME-light.png`.
pub fn take<S>(
    name: &str,
    size: [f32; 2],
    mut stage: S,
    mut draw: impl FnMut(&mut egui::Ui, &mut S),
    is_ready: impl Fn(&S) -> bool,
) -> S {
    let out =
        std::env::var_os("NUDGE_PICTURES").map_or_else(|| std::env::temp_dir().join("nudge-panels"), PathBuf::from);
    std::fs::create_dir_all(&out).expect("directory");
    for (theme, suffix) in [(egui::Theme::Dark, "dark"), (egui::Theme::Light, "light")] {
        let mut is_styled = false;
        let draw = |ui: &mut egui::Ui, stage: &mut S| {
            if !is_styled {
                re_ui::apply_style_and_install_loaders(ui.ctx());
                ui.ctx().set_theme(theme);
                is_styled = true;
            }
            let ground = ui.visuals().panel_fill;
            egui::Frame::NONE.fill(ground).show(ui, |ui| draw(ui, stage));
        };
        let mut harness =
            Harness::builder().with_size(size).with_pixels_per_point(2.0).wgpu().build_ui_state(draw, stage);
        for _ in 0..2_400 {
            harness.run_steps(1);
            if is_ready(harness.state()) {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        harness.run_steps(6);
        harness.render().expect("rendered").save(out.join(format!("{name}-{suffix}.png"))).expect("written");
        stage = harness.into_state();
    }
    stage
}
