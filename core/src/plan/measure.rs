//! Measurements on a crowded shelf of the published size; run with `--ignored --nocapture`.

use super::*;
use crate::belief::Classical;
use crate::camera::{project, render};
use crate::scene::{Body, ClassId, ObjectId, Shelf};
use crate::solid::Solid;
use crate::world::{TruthMap, World};
use crate::{Pose, Vector};
use nalgebra::{Translation3, UnitQuaternion};
use std::sync::Arc;
use std::time::Instant;

/// Fourteen boxes of catalogue sizes: `[x, y, yaw in degrees, width, depth, height, mass]`.
const CROWD: [[f32; 7]; 14] = [
    [-0.32, 0.12, 10.0, 0.060, 0.140, 0.220, 0.411],
    [-0.22, 0.10, 0.0, 0.066, 0.066, 0.102, 0.349],
    [-0.22, 0.22, 80.0, 0.062, 0.158, 0.207, 0.411],
    [-0.30, 0.31, 0.0, 0.070, 0.070, 0.230, 0.411],
    [-0.12, 0.12, 20.0, 0.104, 0.068, 0.252, 0.100],
    [-0.10, 0.25, 0.0, 0.074, 0.074, 0.242, 0.205],
    [-0.11, 0.34, 0.0, 0.070, 0.070, 0.099, 0.404],
    [0.02, 0.10, 0.0, 0.072, 0.028, 0.087, 0.097],
    [0.04, 0.19, 5.0, 0.185, 0.087, 0.220, 0.411],
    [0.02, 0.31, 30.0, 0.103, 0.056, 0.084, 0.370],
    [0.19, 0.10, 60.0, 0.059, 0.097, 0.191, 0.603],
    [0.19, 0.26, 0.0, 0.062, 0.158, 0.207, 0.411],
    [0.31, 0.14, 0.0, 0.080, 0.051, 0.170, 0.411],
    [0.31, 0.27, 15.0, 0.119, 0.061, 0.097, 0.100],
];

fn crowd() -> World {
    let bodies = CROWD.iter().enumerate().map(|(at, &[x, y, yaw, w, d, h, mass_kg])| Body {
        id: ObjectId(at as u16),
        class: ClassId(at as u8),
        solid: Arc::new(Solid::standing_box(Vector::new(w, d, h))),
        world_from_body: Pose::from_parts(
            Translation3::new(x, y, 0.0),
            UnitQuaternion::from_axis_angle(&Vector::z_axis(), yaw.to_radians()),
        ),
        mass_kg,
        friction: 0.5,
    });
    let mut world = World::new(Shelf::new([0.80, 0.40, 0.40]), bodies.collect());
    world.settle();
    world
}

/// Seconds of processor time that this process has used: on a busy machine, a fairer measure than the clock.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    stat.split_whitespace().skip(13).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Occupied IoU and share of right labels.
fn scores(belief: &Belief, truth: &TruthMap) -> (f32, f32) {
    let (mut both, mut either, mut right) = (0, 0, 0);
    for (index, &occupied) in truth.occupancy.iter().enumerate() {
        let (a, b) = (occupied == 1, belief.probability(index) > 0.5);
        both += usize::from(a && b);
        either += usize::from(a || b);
    }
    for (cell, &label) in truth.labels.iter().enumerate() {
        right += usize::from(belief.likeliest(cell).0.0 == label);
    }
    (both as f32 / either as f32, right as f32 / truth.labels.len() as f32)
}

#[test]
#[ignore = "a measurement: prints an episode of 20 steps with the seconds of each decision"]
fn an_episode_of_decisions() {
    let policy = std::env::var("NUDGE_POLICY").ok().and_then(|name| name.parse().ok()).unwrap_or(PolicyKind::Mem);
    let (tool, views) = (Tool::standard(), ViewArray::named("standard300").expect("shipped"));
    let mut world = crowd();
    let grid = world.shelf().grid();
    let mut belief = Belief::uniform(grid);
    let mut history = History::default();
    let budget = 20;
    for step in 0..budget {
        let look = |belief: &Belief, view: ViewId| {
            let view = views.view(view).expect("a view");
            let image = render(world.shelf(), &world.bodies(), view, &views.intrinsics);
            Classical.observe(belief, &project(&image, view, &views.intrinsics, world.shelf()))
        };
        let really_look = |view: ViewId| look(&belief, view);
        let situation = Situation {
            belief: &belief,
            update: &Classical,
            views: &views,
            tool: &tool,
            history: &history,
            budget,
            seed: 1,
            really_look: &really_look,
        };
        let (start, cpu) = (Instant::now(), cpu_seconds());
        let decision = decide(policy, &PlannerSettings::default(), &situation);
        let (seconds, cpu) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
        let mut dropped = false;
        let next = match decision.action {
            Action::Look { view } => look(&belief, view),
            Action::Push(push) => {
                let swept = tool.swept_volume(&push, &grid);
                let mut next = belief.clone();
                if policy.predicts_pushes() {
                    let push = crate::belief::SweptPush { push, swept };
                    next.apply(&Classical.predict_pushes(&belief, &[push])[0]);
                }
                let truth_before = TruthMap::of(&grid, &world.bodies());
                let outcome = world.execute(&tool, &push);
                let truth = TruthMap::of(&grid, &world.bodies());
                let [before, blind, predicted] =
                    [(&belief, &truth_before), (&belief, &truth), (&next, &truth)].map(|(b, t)| scores(b, t).0);
                println!("   IoU {before:.3} before, {blind:.3} after, {predicted:.3} with the prediction");
                dropped = !outcome.dropped.is_empty();
                println!(
                    "   {push:?} moved {:.3} m in all, stalled {}, dropped {dropped}",
                    outcome.displacement_m.iter().sum::<f32>(),
                    outcome.stalled
                );
                next
            }
        };
        belief = next;
        history.record(&decision, dropped);
        let (iou, labels) = scores(&belief, &TruthMap::of(&grid, &world.bodies()));
        println!(
            "{:2} {:28} igv {:7.0} igm {:7.0} reg {:7.2} best gain {:6.0}, {:2} of {:3} feasible; IoU {iou:.3} labels {labels:.3} entropy {:8.0}: {seconds:.3} s, {cpu:.2} s of processors",
            step + 1,
            format!("{:?}", decision.reason),
            decision.igv,
            decision.igm,
            decision.reg,
            decision.best_gain().unwrap_or(0.0),
            decision.candidates.iter().filter(|c| c.rejection.is_none()).count(),
            decision.candidates.len(),
            belief.entropy(),
        );
    }
}
