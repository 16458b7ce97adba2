//! What the window costs, beside its targets. `make bench` prints it.
//!
//! The window is rendered off-screen on whatever graphics driver there is; only its own part of a frame is counted,
//! not the viewer's and not the driver's.

use egui_kittest::Harness;
use nudge::workbench::app::{App, Options};
use nudge::workbench::command::Command;
use nudge_tests::root;
use rerun::external::{egui, re_viewer};
use std::time::Instant;

fn main() {
    let folder = tempfile::tempdir().expect("folder");
    let options = Options { out: folder.path().join("out"), ..Options::default() };
    let setup = re_viewer::native::eframe_options(None).wgpu_options.wgpu_setup;
    let mut harness = Harness::<App>::builder()
        .with_size(egui::vec2(1600.0, 900.0))
        .wgpu_setup(setup)
        .build_eframe(move |cc| App::new(cc, options.clone()));
    println!("{:<58} {:>10}  {:>10}", "the window at 1600 x 900", "measured", "target");
    harness.state_mut().model.kept.form.budget = 40;
    harness.state_mut().ask(Command::Open(root().join("scenes/high/key-blocker.toml")));
    step_until(&mut harness, |app| !app.is_busy());
    harness.state_mut().ask(Command::Run);
    let (mut host, mut shown) = (Vec::new(), Vec::new());
    let mut steps = 0;
    let mut arrived: Option<Instant> = None;
    loop {
        harness.step();
        let app = harness.state();
        host.extend(app.last_frame_ms());
        let now = app.model.session().map_or(0, |session| session.steps());
        if now > steps {
            (steps, arrived) = (now, Some(Instant::now()));
        }
        if let Some(since) = arrived
            && app.model.derived().is_some_and(|derived| derived.of.1 == steps)
        {
            shown.push(since.elapsed().as_secs_f32() * 1e3);
            arrived = None;
        }
        if !app.is_busy() && arrived.is_none() {
            break;
        }
    }
    row("its own part of a frame while an episode runs, median", median(&mut host), 8.0, "ms");
    row("the same, 95 of 100 frames", host[host.len() * 95 / 100], 8.0, "ms");
    row("from a step's belief to its maps on the window, median", median(&mut shown), 100.0, "ms");
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kib = |key: &str| {
        let line = status.lines().find(|line| line.starts_with(key)).unwrap_or_default();
        line.split_whitespace().nth(1).and_then(|kib| kib.parse::<f32>().ok()).unwrap_or(f32::NAN)
    };
    row("memory with a 40-step episode open, at the peak", kib("VmHWM") / 1024.0, 1024.0, "MB");
}

fn step_until(harness: &mut Harness<'_, App>, done: impl Fn(&App) -> bool) {
    loop {
        harness.step();
        if done(harness.state()) {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

/// The median; sorts on the way.
fn median(values: &mut [f32]) -> f32 {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f32::NAN)
}

fn row(what: &str, measured: f32, target: f32, unit: &str) {
    println!("{what:<58} {measured:>7.1} {unit}  {target:>7.0} {unit}");
}
