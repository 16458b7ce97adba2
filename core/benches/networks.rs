//! What the networks cost, beside their targets: `cargo bench --bench networks --features cnabu`, with libtorch.
//!
//! Medians of wall-clock time with all threads; a target is for two idle cores.

#[path = "support/median.rs"]
mod median;

use median::median;
use nudge_core::arm::ArmTool;
use nudge_core::belief::{Belief, FloorPlan, Intervention, SOLID};
use nudge_core::camera::{ViewArray, project, render};
use nudge_core::cnabu;
use nudge_core::rng::stream;
use nudge_core::scene::{Catalog, Scene};
use nudge_core::skill::push::{PushSampler, sample};
use std::path::Path;

/// Candidates that a decision weighs.
const CANDIDATES: usize = 80;

fn main() {
    let catalog = Catalog::standard();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/high/key-blocker.toml");
    let (scene, _) = Scene::load(&file, &catalog).expect("scene");
    let bodies = scene.bodies(&catalog).expect("bodies");
    let views = ViewArray::named("standard300").expect("views");
    cnabu::compute_beside_rayon();
    let update = cnabu::load(&cnabu::models_dir().expect("models/")).expect("weights");

    let observations: Vec<_> = (views.views.iter().step_by(37))
        .map(|view| project(&render(&scene.shelf, &bodies, view, &views.intrinsics).frame, &scene.shelf))
        .collect();
    let belief = observations.iter().fold(Belief::uniform(scene.grid()), |belief, seen| update.observe(&belief, seen));
    row("sigma_o, one observation", median(31, || update.observe(&belief, &observations[0])), 0.06);

    let tool = ArmTool::standard(scene.shelf);
    let drawn = sample(PushSampler::Frontier, &belief, None, &tool, CANDIDATES, &mut stream(1, "pushes", 0));
    let solid = FloorPlan::new(&belief, SOLID);
    let feasible: Vec<Intervention> = drawn
        .into_iter()
        .filter(|c| c.rejection.is_none())
        .map(|c| c.manipulation.skill().intervention(&belief, &solid, c.swept))
        .collect();
    assert!(!feasible.is_empty(), "no candidate of {} is feasible", scene.name);
    // As many as a decision weighs, whatever this belief offers: what one costs does not depend on which it is.
    let pushes: Vec<Intervention> = feasible.iter().cycle().take(CANDIDATES).cloned().collect();
    row(
        &format!("sigma_m, {CANDIDATES} candidates ({} different)", feasible.len()),
        median(7, || update.predict(&belief, &pushes)),
        0.8,
    );
}

fn row(what: &str, seconds: f64, target: f64) {
    println!("{what:<50} {seconds:>8.3} s (target {target})");
}
