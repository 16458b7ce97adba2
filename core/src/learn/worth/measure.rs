//! Finds out what there is to know of a state and of the pushes from it.

use super::blocks;
use super::considered::Considered;
use super::follow;
use super::rollout::Rollout;
use super::state::{BeliefMap, FloorFacts, Followed, ObjectOutcome, ObjectState, Promise, WorthPush, WorthState};
use crate::arm::PhasedMotion;
use crate::belief::{Belief, dirichlet_entropy, dirichlet_vacuity};
use crate::gain::{RayDensity, TrueReach};
use crate::grid::VoxelSet;
use crate::learn::maps::occupied;
use crate::rng::stream;
use crate::scene::{Body, CLASS_COUNT};
use crate::skill::{Candidate, Counterfactual, Manipulation, Push, PushTruth};
use crate::world::TruthMap;
use rand::Rng;

/// Carries out all pushes from a state in copies of its world; `done` is called after each, from any thread.
pub(super) fn measure(rollout: &Rollout<'_>, leg: u8, considered: &Considered, done: &(dyn Fn() + Sync)) -> WorthState {
    let (base, belief) = (&rollout.recipe.base, &rollout.belief);
    let grid = belief.grid;
    let motions: Vec<PhasedMotion> = considered.pushes.iter().filter_map(|push| push.motion.clone()).collect();
    let known = Counterfactual::new(&rollout.world, &base.arm, &base.views, rollout.sightings.seen());
    let truths = known.of_each(&motions, done);
    let objects: Vec<ObjectState> = known
        .bodies()
        .iter()
        .zip(known.shown())
        .map(|(body, shown)| object(body, known.hidden().contains(&body.id), *shown))
        .collect();
    let mut pushes: Vec<WorthPush> =
        truths.iter().enumerate().map(|(at, truth)| push(belief, &objects, considered, at, truth)).collect();
    let follows =
        stream(rollout.seed, "worth followed", u64::from(leg)).random::<f32>() < rollout.recipe.followed_share;
    if follows {
        for at in follow::followed(considered, &truths) {
            pushes[at].followed = Some(Followed { scores: follow::after_push(rollout, considered, at) });
        }
    }
    let truth = TruthMap::of(&grid, known.bodies());
    WorthState {
        seed: rollout.seed,
        leg,
        family: rollout.family,
        noisy: rollout.noise != crate::camera::NoiseModel::OFF,
        looks: rollout.looks.clone(),
        earlier_pushes: rollout.pushes,
        igv: rollout.best_views().1,
        scores: follow::scores(belief, &rollout.world),
        looked_on: follows.then(|| follow::after_looks(rollout)),
        map: map(rollout),
        floor: floor(belief),
        truth: occupied(&grid, &truth),
        labels: truth.labels,
        objects,
        pushes,
    }
}

/// The believed occupancy, what looks have seen, and what views reach through the likeliest map.
fn map(rollout: &Rollout<'_>) -> BeliefMap {
    let belief = &rollout.belief;
    let grid = belief.grid;
    let [occupancy, deviation] = blocks::occupancy(belief);
    let likeliest = TruthMap {
        dims: grid.dims,
        occupancy: (0..grid.voxel_count()).map(|voxel| u8::from(belief.probability(voxel) >= 0.5)).collect(),
        labels: vec![0; grid.cell_count()],
        objects: vec![u16::MAX; grid.cell_count()],
    };
    let reached: VoxelSet = TrueReach::new(&grid, &likeliest, &rollout.recipe.base.views, RayDensity::COARSE).reached();
    BeliefMap {
        occupancy,
        deviation,
        seen: blocks::counts(&grid, rollout.sightings.seen()),
        reached: blocks::counts(&grid, &reached),
    }
}

fn floor(belief: &Belief) -> FloorFacts {
    let byte = |share: f32| (255.0 * share).round().clamp(0.0, 255.0) as u8;
    let likeliest = || (0..belief.grid.cell_count()).map(|cell| belief.likeliest(cell));
    let most = (CLASS_COUNT as f32).ln();
    FloorFacts {
        class: likeliest().map(|(class, _)| class.0).collect(),
        certainty: likeliest().map(|(_, certainty)| byte(certainty)).collect(),
        entropy: belief.semantics.iter().map(|a| byte(dirichlet_entropy(a) / most)).collect(),
        vacuity: belief.semantics.iter().map(|a| byte(dirichlet_vacuity(a))).collect(),
    }
}

fn object(body: &Body, hidden: bool, shown: u32) -> ObjectState {
    let (at, turn) = (body.world_from_body.translation.vector, body.world_from_body.rotation.coords);
    let pose = [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w];
    ObjectState { id: body.id, class: body.class.0, hidden, shown, pose }
}

/// The push of a candidate: pushes alone are considered.
fn pushed(candidate: &Candidate) -> Push {
    match candidate.manipulation {
        Manipulation::Push(push) => push,
        _ => Push { start: [0.0; 3], direction_deg: 0.0, length_m: 0.0 },
    }
}

fn push(belief: &Belief, objects: &[ObjectState], considered: &Considered, at: usize, truth: &PushTruth) -> WorthPush {
    let (candidate, prediction) = (&considered.pushes[at], &considered.predictions[at]);
    let outcome = |(object, shown): (&ObjectState, &u32)| {
        let dropped = truth.dropped.contains(&object.id);
        let changes = truth.won.contains(&object.id) || (truth.lost.contains(&object.id) && !dropped);
        ObjectOutcome { hidden: object.hidden != changes, dropped, shown: *shown }
    };
    WorthPush {
        push: pushed(candidate),
        contact: candidate.contact,
        sampler: considered.samplers[at],
        motion_s: considered.motions_s[at],
        swept: blocks::bits(&belief.grid, &candidate.swept),
        promise: Promise {
            gain: considered.gains[at],
            reg: considered.regs[at],
            change: blocks::change(&belief.grid, prediction),
            occupancy: blocks::occupancy_change(belief, prediction),
        },
        pushed_m: truth.pushed_m,
        jammed: truth.jammed,
        displacement_m: truth.displacement_m as f32,
        opened: truth.opened.len() as u32,
        opened_nats: truth.opened_nats(belief),
        toppled: truth.toppled.len().min(255) as u8,
        objects: objects.iter().zip(&truth.shown).map(outcome).collect(),
        followed: None,
    }
}
