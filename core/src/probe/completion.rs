//! The ceiling of knowledge: what a push is worth to whoever knows all that shows, and of the rest only where it may be.
//!
//! A *completion* of a shelf keeps the objects that some view shows where they truly stand, takes out those that none shows,
//! and stands others in their place: objects of the catalogue, each class as likely as another, upright, where no look has
//! seen, as densely as what shows stands where looks have seen. The worth of a push to such a judge is the mean over completions of the
//! objects that it wins minus those that it loses. No value that is computed from a belief can be expected to choose better.

use crate::arm::PhasedMotion;
use crate::episode::Episode;
use crate::grid::{Grid, Voxel, VoxelSet};
use crate::rng::{ChaCha8Rng, stream};
use crate::scene::{Body, ObjectId, PlacedBody, outline};
use crate::skill::Counterfactual;
use crate::world::World;
use crate::{Point, Pose, Vector};
use nalgebra::UnitQuaternion;
use rand::Rng;
use rayon::prelude::*;
use std::sync::Arc;

/// Share of an object's voxels that no look may have seen.
const UNSEEN_SHARE: f32 = 0.95;
/// Draws of a class and a place in a row that do not fit, after which what no look has seen counts as full.
const MAX_FAILURES: usize = 400;

/// For each motion, the mean over `count` completions of the objects that it wins minus those that it loses; nothing where
/// nothing is simulated. `done` is called after each motion in each completion, from any thread. The result does not
/// depend on the number of threads.
pub(super) fn worths(
    episode: &Episode,
    hidden: &[ObjectId],
    motions: &[PhasedMotion],
    count: usize,
    done: &(dyn Fn() + Sync),
) -> Vec<f64> {
    let Some(simulated) = episode.simulated() else { return Vec::new() };
    let shown: Vec<Body> = simulated.bodies().iter().filter(|body| !hidden.contains(&body.id)).cloned().collect();
    let balances = |index: usize| -> Vec<i32> {
        let config = &episode.record().config;
        let step = episode.record().steps.len() as u64;
        let mut rng = stream(config.seed, "completion", (step << 32) + index as u64);
        let world = completed(episode, &shown, &mut rng);
        let known = Counterfactual::new(&world, episode.arm(), episode.views(), episode.seen());
        known.of_each(motions, done).iter().map(|truth| truth.balance()).collect()
    };
    let each: Vec<Vec<i32>> = (0..count).into_par_iter().with_max_len(1).map(balances).collect();
    let mean = |at: usize| each.iter().map(|balances| f64::from(balances[at])).sum::<f64>() / count.max(1) as f64;
    (0..motions.len()).map(mean).collect()
}

/// A completion around what is shown, settled.
pub(super) fn completed(episode: &Episode, shown: &[Body], rng: &mut ChaCha8Rng) -> World {
    let (grid, seen) = (episode.grid(), episode.seen());
    let mut bodies: Vec<Body> = shown.to_vec();
    let mut placed: Vec<PlacedBody> = bodies.iter().map(PlacedBody::new).collect();
    let mut room_m2 = room_m2(&grid, shown, seen);
    let mut failures = 0;
    while failures < MAX_FAILURES {
        let body = drawn(episode, rng);
        let footprint_m2 = outline::area(&body.solid.footprint());
        // Of the last one the share for which there is room is its chance.
        let is_wanted = footprint_m2 <= room_m2 || rng.random::<f32>() * footprint_m2 < room_m2;
        if !fits(episode, &body, seen) {
            failures += 1;
            continue;
        }
        if !is_wanted {
            break;
        }
        let stands = PlacedBody::new(&body);
        if placed.iter().any(|other| stands.overlap(other).is_some()) {
            failures += 1;
            continue;
        }
        room_m2 -= footprint_m2;
        failures = 0;
        placed.push(stands);
        bodies.push(body);
    }
    for (id, body) in (0..).zip(&mut bodies) {
        body.id = ObjectId(id);
    }
    let mut world = World::new(*simulated_shelf(episode), bodies);
    world.settle();
    world
}

fn simulated_shelf(episode: &Episode) -> &crate::scene::Shelf {
    &episode.record().scene.shelf
}

/// The floor that objects may cover where no look has seen, square metres: the share that footprints have of the floor that
/// looks have seen, of the rest.
fn room_m2(grid: &Grid, shown: &[Body], seen: &VoxelSet) -> f32 {
    let covered: f32 = shown.iter().map(|body| outline::area(&body.solid.footprint())).sum();
    let is_known = |cell: usize| {
        let point = grid.center(grid.voxel(grid.column(cell).start));
        seen.contains(grid.column(cell).start) || shown.iter().any(|body| covers(body, point))
    };
    let cell_m2 = grid.voxel_m * grid.voxel_m;
    let unknown = (0..grid.cell_count()).filter(|cell| !is_known(*cell)).count() as f32 * cell_m2;
    let known = grid.cell_count() as f32 * cell_m2 - unknown;
    if known > 0.0 { unknown * (covered / known).min(1.0) } else { 0.0 }
}

fn covers(body: &Body, point: Point) -> bool {
    body.solid.contains(body.world_from_body.inverse_transform_point(&point))
}

/// An object of the catalogue upright somewhere on the board.
fn drawn(episode: &Episode, rng: &mut ChaCha8Rng) -> Body {
    let classes = &episode.catalog().classes;
    let class = &classes[rng.random_range(0..classes.len())];
    let shelf = simulated_shelf(episode);
    let [low, high] = [shelf.min(), shelf.max()];
    let (x, y) = (rng.random_range(low.x..high.x), rng.random_range(low.y..high.y));
    let yaw = UnitQuaternion::from_axis_angle(&Vector::z_axis(), rng.random_range(0.0..std::f32::consts::TAU));
    Body {
        id: ObjectId(0),
        class: class.id,
        solid: Arc::clone(&class.solid),
        world_from_body: Pose::from_parts(Vector::new(x, y, 0.0).into(), yaw),
        mass_kg: class.mass_kg,
        friction: class.friction,
    }
}

/// Whether a body stands inside the shelf, and nearly all of it where no look has seen.
fn fits(episode: &Episode, body: &Body, seen: &VoxelSet) -> bool {
    let (shelf, grid) = (simulated_shelf(episode), episode.grid());
    let bounds = body.solid.bounds_at(&body.world_from_body);
    let [low, high] = [shelf.min(), shelf.max()];
    if (0..2).any(|axis| bounds.min[axis] < low[axis] || bounds.max[axis] > high[axis]) || bounds.max.z > high.z {
        return false;
    }
    let [from, to] = [bounds.min, bounds.max].map(|corner| {
        [0, 1, 2].map(|axis| {
            let at = (corner[axis] - grid.origin[axis]) / grid.voxel_m;
            (at.floor().max(0.0) as usize).min(grid.dims[axis] - 1)
        })
    });
    let [mut inside, mut unseen] = [0_usize; 2];
    for x in from[0]..=to[0] {
        for y in from[1]..=to[1] {
            for z in from[2]..=to[2] {
                let voxel = Voxel { x: x as u16, y: y as u16, z: z as u16 };
                if covers(body, grid.center(voxel)) {
                    inside += 1;
                    unseen += usize::from(!seen.contains(grid.index(voxel)));
                }
            }
        }
    }
    inside > 0 && unseen as f32 >= UNSEEN_SHARE * inside as f32
}
