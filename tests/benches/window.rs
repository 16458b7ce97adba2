//! What the window costs, beside its targets. `make bench-window` prints it.
//!
//! The window is drawn off-screen on whatever graphics driver there is. Of a frame only what the processor does is
//! counted, the window's own part and the viewer's apart, and not what the driver does: without a graphics card that is
//! software and takes what it takes. Memory is the real program's, under a virtual display.

use egui_kittest::Harness;
use nudge::workbench::app::{App, Options};
use nudge::workbench::command::Command;
use nudge::workbench::half_belief::HalfBelief;
use nudge::workbench::model::{LayoutKind, Picked, StartForm};
use nudge::workbench::session::Moment;
use nudge_core::belief::CLASSICAL;
use nudge_tests::{nudge_bin, root};
use re_viewer::external::egui;
use std::process::Stdio;
use std::sync::Arc;
use std::time::{Duration, Instant};

const SCENE: &str = "scenes/high/key-blocker.toml";
const BUDGET: usize = 40;

fn main() {
    let folder = tempfile::tempdir().expect("folder");
    let options = Options { out: folder.path().join("out"), scenes: root().join("scenes"), ..Options::default() };
    let setup = re_viewer::native::eframe_options(None).wgpu_options.wgpu_setup;
    let mut harness = Harness::<App>::builder()
        .with_size(egui::vec2(1600.0, 900.0))
        .wgpu_setup(setup)
        .build_eframe(move |cc| App::new(cc, options.clone()));
    println!("{:<62} {:>10}  {:>10}", "the window at 1600 x 900", "measured", "target");
    // The networks would be most of what is measured.
    let form = &mut harness.state_mut().model.kept.form;
    *form = StartForm { budget: BUDGET, ..form.clone().with_belief(CLASSICAL) };
    harness.state_mut().ask(Command::Open(root().join(SCENE)));
    step_until(&mut harness, |app| !app.is_busy());
    run(&mut harness);
    pictures(&mut harness);
    reopen(&mut harness);
    many_voxels(&mut harness);
    memory(&folder.path().join("real"));
}

/// An episode runs to its budget while the window draws one frame after the other.
fn run(harness: &mut Harness<'_, App>) {
    harness.state_mut().ask(Command::Run);
    let (mut host, mut viewer, mut shown) = (Vec::new(), Vec::new(), Vec::new());
    let (mut steps, mut arrived) = (0, None);
    let mut before = Instant::now();
    loop {
        let began = Instant::now();
        harness.step();
        let app = harness.state();
        host.extend(app.last_frame_ms());
        viewer.push(app.last_viewer_ms());
        let now = app.model.session().map_or(0, |session| session.steps());
        if now > steps {
            // Ready at some time since the frame before began.
            (steps, arrived) = (now, Some(before));
        }
        if let Some(since) = arrived.filter(|_| app.is_shown()) {
            shown.push(since.elapsed().as_secs_f32() * 1e3);
            arrived = None;
        }
        if !app.is_busy() && arrived.is_none() {
            break;
        }
        before = began;
        // As fast as a screen shows frames.
        std::thread::sleep(Duration::from_millis(16).saturating_sub(began.elapsed()));
    }
    row("its own part of a frame while an episode runs, median", median(&mut host), 8.0, "ms");
    row("the same, 95 of 100 frames", share(&host, 95), 8.0, "ms");
    row("the viewer's part of a frame on the processor, median", median(&mut viewer), f32::NAN, "ms");
    row("from a step's belief to maps and views that show it, median", median(&mut shown), 100.0, "ms");
    row("the same, 95 of 100 steps", share(&shown, 95), 100.0, "ms");
}

/// From a command to its picture, with what this machine's graphics driver takes: on software graphics most of it.
fn pictures(harness: &mut Harness<'_, App>) {
    let push = harness.state().model.session().and_then(|session| {
        let pushed = |moment: &Arc<Moment>| moment.decision().is_some_and(|decision| !decision.candidates.is_empty());
        session.moments.iter().find(|moment| pushed(moment)).map(|moment| moment.step - 1)
    });
    picture_of(harness, Command::GoTo(push.unwrap_or(10)));
    for layout in [LayoutKind::Why, LayoutKind::Gains, LayoutKind::Push, LayoutKind::Episode] {
        let ms = picture_of(harness, Command::Layout(layout));
        row(&format!("from the tab of {} to its picture", layout.title()), ms, 500.0, "ms");
    }
    let steps: Vec<f32> = (1..=9).map(|step| picture_of(harness, Command::GoTo(4 * step))).collect();
    row("from a step of the clock to its picture, median of 9", median(&mut steps.clone()), 300.0, "ms");
    picture_of(harness, Command::Layout(LayoutKind::Why));
    let voxels: Vec<f32> =
        (1..=9).map(|at| picture_of(harness, Command::Pick(Some(Picked::Voxel(90_000 * at))))).collect();
    row("from a voxel that is picked to its picture, median of 9", median(&mut voxels.clone()), 500.0, "ms");
}

/// Milliseconds until a picture shows what was asked for.
fn picture_of(harness: &mut Harness<'_, App>, command: Command) -> f32 {
    let began = Instant::now();
    harness.state_mut().ask(command);
    loop {
        // What a frame asks for in the background is drawn by a later one.
        harness.step();
        let at_rest = !harness.state().is_busy();
        harness.render().expect("a picture");
        if at_rest && !harness.state().is_busy() {
            return began.elapsed().as_secs_f32() * 1e3;
        }
    }
}

/// The episode is closed and opened again: until its first picture, and until its log is repeated.
fn reopen(harness: &mut Harness<'_, App>) {
    let (id, path) = harness.state().model.session().map(|session| (session.id, session.path.clone())).expect("open");
    harness.state_mut().ask(Command::Close(id));
    (0..3).for_each(|_| harness.step());
    // Its thread ends the recording.
    std::thread::sleep(Duration::from_secs(5));
    let began = Instant::now();
    harness.state_mut().ask(Command::Open(path));
    step_until(harness, |app| app.model.session().is_some() && app.is_shown());
    harness.render().expect("a picture");
    row("from opening the 40-step episode to its first picture", began.elapsed().as_secs_f32() * 1e3, 1500.0, "ms");
    step_until(harness, |app| !app.is_busy());
    row("until its log is checked", began.elapsed().as_secs_f32() * 1e3, f32::NAN, "ms");
}

/// A state whose belief is as ragged as can be, so that as many voxels are drawn as ever are.
fn many_voxels(harness: &mut Harness<'_, App>) {
    let session = &mut harness.state_mut().model.sessions[0];
    let last = session.moments.last().expect("a state").clone();
    let mut belief = last.belief.belief();
    let [_, depth, height] = belief.grid.dims;
    for (voxel, a) in belief.occupancy.iter_mut().enumerate() {
        let (x, y, z) = (voxel / (depth * height), voxel / height % depth, voxel % height);
        *a = if (x + y + z) % 2 == 0 { [9.0, 1.0] } else { [1.0, 9.0] };
    }
    let step = session.moments.len();
    session.moments.push(Arc::new(Moment { step, belief: HalfBelief::of(&belief), ..(*last).clone() }));
    harness.state_mut().ask(Command::GoTo(step));
    step_until(harness, |app| !app.is_busy());
    (0..20).for_each(|_| harness.step());
    let (mut host, mut viewer) = (Vec::new(), Vec::new());
    for _ in 0..60 {
        harness.step();
        host.extend(harness.state().last_frame_ms());
        viewer.push(harness.state().last_viewer_ms());
    }
    let drawn = harness.state().drawn_voxels();
    row(&format!("the viewer's part with {drawn} voxels, median"), median(&mut viewer), 33.0, "ms");
    row("the window's own part then, median", median(&mut host), 8.0, "ms");
    let began = Instant::now();
    harness.render().expect("a picture");
    row("drawing that frame with this machine's graphics driver", began.elapsed().as_secs_f32() * 1e3, f32::NAN, "ms");
}

/// The real program under a virtual display, with an episode of 40 steps; drawn by software OpenGL, because Debian 12's
/// software Vulkan keeps 6 MB more every second for itself.
fn memory(out: &std::path::Path) {
    let picture = out.with_extension("png");
    let child = std::process::Command::new("xvfb-run")
        .args(["-a", "-s", "-screen 0 1600x900x24"])
        .env("WGPU_BACKEND", "gl")
        .arg(nudge_bin())
        .args(["open", SCENE, "--policy", "mem", "--budget", &BUDGET.to_string(), "--steps", &BUDGET.to_string()])
        .arg("--out")
        .arg(out)
        .arg("--picture")
        .arg(&picture)
        .current_dir(root())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    let Ok(mut child) = child else { return println!("no xvfb-run: the real program's memory was not measured") };
    let mut peak = f32::NAN;
    while child.try_wait().expect("waited").is_none() {
        for process in windows_of(&picture) {
            let status = std::fs::read_to_string(process.join("status")).unwrap_or_default();
            let line = status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or_default();
            peak = peak.max(line.split_whitespace().nth(1).and_then(|kib| kib.parse().ok()).unwrap_or(f32::NAN));
        }
        std::thread::sleep(Duration::from_millis(200));
    }
    row("memory of the program with a 40-step episode, at the peak", peak / 1024.0, 700.0, "MB");
}

/// Processes of the program that were started to write this picture.
fn windows_of(picture: &std::path::Path) -> Vec<std::path::PathBuf> {
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten().map(|entry| entry.path());
    let name = picture.to_string_lossy().into_owned();
    let is = |path: &std::path::PathBuf| {
        let comm = std::fs::read_to_string(path.join("comm")).unwrap_or_default();
        let line = std::fs::read(path.join("cmdline")).unwrap_or_default();
        comm.trim() == "nudge-program" && String::from_utf8_lossy(&line).contains(&name)
    };
    processes.filter(is).collect()
}

fn step_until(harness: &mut Harness<'_, App>, done: impl Fn(&App) -> bool) {
    loop {
        harness.step();
        if done(harness.state()) {
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The median; sorts on the way.
fn median(values: &mut [f32]) -> f32 {
    values.sort_by(f32::total_cmp);
    share(values, 50)
}

/// The value that so many of 100 stay below, of sorted values.
fn share(values: &[f32], percent: usize) -> f32 {
    values.get((values.len() * percent / 100).min(values.len().saturating_sub(1))).copied().unwrap_or(f32::NAN)
}

fn row(what: &str, measured: f32, target: f32, unit: &str) {
    let target = if target.is_nan() { String::new() } else { format!("{target:>7.0} {unit}") };
    println!("{what:<62} {measured:>7.1} {unit}  {target}");
}
