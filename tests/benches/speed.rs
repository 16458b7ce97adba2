//! The speed of the parts that matter, beside their targets. `make bench` prints it.
//!
//! Each figure is the median of a few runs on this machine as it is; a target is for two idle cores.

#[path = "../../core/benches/support/median.rs"]
mod median;

use median::median;
use nudge_core::arm::{ArmTool, PhasedMotion};
use nudge_core::belief::{Belief, BeliefUpdate, Classical};
use nudge_core::camera::{ViewArray, ViewId, project, render};
use nudge_core::episode::{Episode, EpisodeConfig};
use nudge_core::plan::{PlannerSettings, PolicyKind};
use nudge_core::rng::stream;
use nudge_core::scene::{Body, Catalog, GenerateConfig, Scene, generate};
use nudge_core::skill::{ArmClearance, Push, Skill};
use nudge_core::world::{TruthMap, World};
use nudge_tests::{nudge_bin, root};
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

fn main() {
    let catalog = Arc::new(Catalog::standard());
    let (scene, _) = Scene::load(&root().join("scenes/high/box-wall.toml"), &catalog).expect("scene");
    let array = ViewArray::named("standard300").expect("views");
    println!("{:<58} {:>10}  {:>10}", "two cores, median", "measured", "target");

    let bodies = scene.bodies(&catalog).expect("bodies");
    let grid = scene.grid();
    let view = array.view(ViewId(145)).expect("view");
    let image = median(9, || render(&scene.shelf, &bodies, view, &array.intrinsics));
    row("image, depth and labels, 640 x 480", image, None);
    let picture = render(&scene.shelf, &bodies, view, &array.intrinsics).frame;
    let projection = median(9, || project(&picture, &scene.shelf));
    row("observation: image and projection", image + projection, Some(0.15));
    row("truth map", median(9, || TruthMap::of(&grid, &bodies)), Some(0.05));
    let belief = nudge_core::belief::Belief::uniform(grid);
    let observation = project(&picture, &scene.shelf);
    row("classical belief update", median(9, || Classical.observe(&belief, &observation)), None);

    let fifteen = fifteen_objects(&catalog);
    row(&format!("push with {} objects simulated", fifteen.len()), push(&scene, &fifteen), Some(0.5));

    let config = EpisodeConfig {
        policy: PolicyKind::Mem,
        belief: "classical".into(),
        seed: 1,
        budget: 20,
        views: "standard300".into(),
        planner: PlannerSettings::default(),
        noise: None,
    };
    let mut episode = Episode::new(scene, catalog, config, Arc::new(Classical)).expect("episode");
    for _ in 0..5 {
        let decision = episode.decide();
        episode.act(decision).expect("step");
    }
    row("decision after 5 steps: 300 views, pairs, 80 pushes", median(5, || episode.decide()), None);

    whole_episode();
}

fn row(what: &str, seconds: f64, target: Option<f64>) {
    let time = |seconds: f64| {
        if seconds < 1.0 { format!("{:.1} ms", seconds * 1e3) } else { format!("{seconds:.2} s") }
    };
    println!("{what:<58} {:>10}  {:>10}", time(seconds), target.map_or(String::new(), time));
}

/// The first generated scene with fifteen objects.
fn fifteen_objects(catalog: &Catalog) -> Vec<Body> {
    let scene = (0..)
        .map(|seed| generate(catalog, &GenerateConfig::default(), seed).expect("scene"))
        .find(|scene| scene.objects.len() == 15)
        .expect("a scene with fifteen objects");
    scene.bodies(catalog).expect("bodies")
}

/// A push by the arm into a shelf with fifteen objects, by the median over where it goes in.
fn push(scene: &Scene, bodies: &[Body]) -> f64 {
    let mut world = World::new(scene.shelf, bodies.to_vec());
    world.settle();
    let (arm, belief) = (ArmTool::standard(scene.shelf), Belief::uniform(scene.grid()));
    let clearance = ArmClearance::new(&arm, &belief);
    let motions: Vec<PhasedMotion> = (0..9)
        .filter_map(|at| {
            let push = Push { start: [-0.2 + 0.05 * at as f32, 0.05, 0.06], direction_deg: 90.0, length_m: 0.15 };
            push.plan(&clearance, &mut stream(1, "bench", at)).ok()
        })
        .collect();
    let mut at = 0;
    median(motions.len(), || {
        at += 1;
        world.clone().execute(&arm.arm, &motions[at - 1])
    })
}

/// A classical 20-step episode with recording, as a user runs it: time and memory of the process.
fn whole_episode() {
    let dir = tempfile::tempdir().expect("tempdir");
    let started = Instant::now();
    let output = Command::new("/usr/bin/env")
        .args([
            "bash",
            "-c",
            "\"$@\" >/dev/null & pid=$!; peak=0; while kill -0 $pid 2>/dev/null; do \
            now=$(awk '/VmHWM/{print $2}' /proc/$pid/status 2>/dev/null || true); \
            [ -n \"$now\" ] && peak=$now; sleep 0.05; done; wait $pid; echo $peak",
            "bash",
        ])
        .arg(nudge_bin())
        .args(["run", "scenes/high/box-wall.toml", "--policy", "mem", "--belief", "classical", "--seed", "1", "--out"])
        .arg(dir.path().join("e"))
        .current_dir(root())
        .output()
        .expect("nudge starts");
    row("classical 20-step episode, files and recording", started.elapsed().as_secs_f64(), Some(30.0));
    let kib: f64 = String::from_utf8_lossy(&output.stdout).trim().parse().unwrap_or(f64::NAN);
    println!("{:<58} {:>7.0} MB  {:>7} MB", "its memory at the peak", kib / 1024.0, 1024);
    let recording = std::fs::metadata(dir.path().join("e/episode.rrd")).map_or(0, |file| file.len());
    println!("{:<58} {:>7.2} MB  {:>7} MB", "its recording, per step", recording as f64 / 20.0 / 1e6, 1.5);
    let steps = std::fs::read_to_string(dir.path().join("e/episode.json")).unwrap_or_default();
    let pushes = steps.matches("\"kind\": \"push\"").count().max(steps.matches("\"kind\":\"push\"").count());
    println!("{:<58} {pushes:>10}", "its pushes");
}
