//! Scenes of objects in other sizes: how does a belief that has learned the catalogue's sizes do out of distribution?
//!
//! Every object gets its own stretch on each of its axes, uniform in a range (0.8 to 1.2 in the paper). Objects that now
//! overlap are moved apart as little as that takes. Where there is no room, for example in a row from wall to wall, the
//! objects that are stuck draw another stretch and all are placed anew from where they stood.

use super::outline;
use super::{CONTACT_DEPTH_M, Catalog, Object, Scene, Shelf};
use crate::rng::{ChaCha8Rng, stream};
use crate::{Error, Result};
use rand::Rng;

/// Gap that objects are moved apart to, metres: more than positions lose by rounding.
const GAP_M: f32 = 0.000_3;
/// Rounds of moving apart before what still overlaps counts as stuck.
const MOVES: usize = 150;
/// Draws of stretches for stuck objects before a scene is given up.
const DRAWS: usize = 400;
/// What is left of an overlap that counts as stuck, metres: well below what a scene's check refuses.
const STUCK_M: f32 = 0.4 * CONTACT_DEPTH_M;

/// The scene with every object stretched by a factor of its own per axis, uniform in `range`, and moved no further than
/// it takes to stand free. The same seed gives the same scene.
///
/// # Errors
/// [`Error::Usage`] for a range that is none, and for a scene so full that no draw has room; what [`Scene::check`] says
/// of the result.
pub fn rescale(scene: &Scene, catalog: &Catalog, range: [f32; 2], seed: u64) -> Result<Scene> {
    let no_room = || Error::Usage(format!("scene {}: no draw of {DRAWS} leaves room for every object", scene.name));
    rescale_if_room(scene, catalog, range, seed)?.ok_or_else(no_room)
}

/// [`rescale`], or `None` for a scene so full that no draw has room.
///
/// # Errors
/// [`Error::Usage`] for a range that is none; what [`Scene::check`] says of the result.
pub fn rescale_if_room(scene: &Scene, catalog: &Catalog, range: [f32; 2], seed: u64) -> Result<Option<Scene>> {
    let [low, high] = range;
    if !(low > 0.0 && low <= high && high.is_finite()) {
        return Err(Error::Usage(format!("scale {low} to {high}: must be a rising range of factors above 0")));
    }
    let mut rng = stream(seed, "object scales", 0);
    let mut factors: Vec<[f32; 3]> = scene.objects.iter().map(|_| draw(range, &mut rng)).collect();
    for _ in 0..DRAWS {
        let mut stretched = scene.clone();
        for (object, factor) in stretched.objects.iter_mut().zip(&factors) {
            object.scale = std::array::from_fn(|axis| rounded(object.scale[axis] * factor[axis], 1e3));
        }
        let stuck = move_apart(&mut stretched, catalog)?;
        if stuck.is_empty() && stretched.problems(catalog)?.is_empty() {
            stretched.check(catalog)?;
            return Ok(Some(stretched));
        }
        let redrawn = if stuck.is_empty() { (0..factors.len()).collect() } else { stuck };
        for at in redrawn {
            factors[at] = draw(range, &mut rng);
        }
    }
    Ok(None)
}

fn draw([low, high]: [f32; 2], rng: &mut ChaCha8Rng) -> [f32; 3] {
    std::array::from_fn(|_| low + (high - low) * rng.random::<f32>())
}

fn rounded(value: f32, per_unit: f32) -> f32 {
    (value * per_unit).round() / per_unit
}

/// An object in the floor plan.
struct Footprint {
    /// At yaw 0 about the origin.
    outline: Vec<[f32; 2]>,
    position: [f32; 2],
    yaw_deg: f32,
    /// How far it reaches from its position.
    reach: f32,
    /// How hard it is to move.
    weight: f32,
}

impl Footprint {
    fn placed(&self) -> Vec<[f32; 2]> {
        outline::placed(&self.outline, self.position, self.yaw_deg)
    }

    fn shift(&mut self, by: [f32; 2], share: f32) {
        self.position[0] += share * by[0];
        self.position[1] += share * by[1];
    }
}

/// Moves overlapping objects apart; returns those that found no room.
fn move_apart(scene: &mut Scene, catalog: &Catalog) -> Result<Vec<usize>> {
    let bodies = scene.bodies(catalog)?;
    let footprint = |object: &Object, solid: &crate::solid::Solid| {
        let outline = outline::grown(&solid.footprint(), 0.5 * GAP_M);
        let reach = outline.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f32::max);
        let weight = outline::area(&outline) * solid.bounds().size().z;
        Footprint { outline, position: object.position, yaw_deg: object.yaw_deg, reach, weight }
    };
    let mut all: Vec<Footprint> =
        scene.objects.iter().zip(&bodies).map(|(object, body)| footprint(object, &body.solid)).collect();
    for _ in 0..MOVES {
        let mut moved = false;
        for at in 0..all.len() {
            let out = sticking_out(&scene.shelf, &all[at]);
            moved |= out != [0.0, 0.0];
            all[at].shift(out, -1.0);
            for before in 0..at {
                let Some(way) = overlap(&all[before], &all[at]) else { continue };
                let share = all[before].weight / (all[before].weight + all[at].weight);
                all[at].shift(way, share);
                all[before].shift(way, share - 1.0);
                moved = true;
            }
        }
        if !moved {
            break;
        }
    }
    for (object, footprint) in scene.objects.iter_mut().zip(&all) {
        object.position = footprint.position.map(|v| rounded(v, 1e4));
    }
    let is_stuck = |at: usize| {
        let [x, y] = sticking_out(&scene.shelf, &all[at]);
        let deep = |other: usize| {
            other != at && overlap(&all[other], &all[at]).is_some_and(|[dx, dy]| dx.hypot(dy) > GAP_M + STUCK_M)
        };
        x.abs().max(y.abs()) > STUCK_M || (0..all.len()).any(deep)
    };
    Ok((0..all.len()).filter(|at| is_stuck(*at)).collect())
}

/// The move of `b` that takes it out of `a`.
fn overlap(a: &Footprint, b: &Footprint) -> Option<[f32; 2]> {
    let [dx, dy] = [b.position[0] - a.position[0], b.position[1] - a.position[1]];
    if dx.hypot(dy) > a.reach + b.reach {
        return None;
    }
    outline::way_out(&a.placed(), &b.placed())
}

/// How far an object sticks out of the shelf along x and y.
fn sticking_out(shelf: &Shelf, footprint: &Footprint) -> [f32; 2] {
    let placed = footprint.placed();
    std::array::from_fn(|axis| {
        let (low, high) = (shelf.min()[axis], shelf.max()[axis]);
        let [first, last] =
            placed.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |[lo, hi], p| [lo.min(p[axis]), hi.max(p[axis])]);
        (last - high).max(0.0) + (first - low).min(0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{GenerateConfig, generate};

    fn crowded() -> (Scene, Catalog) {
        let catalog = Catalog::standard();
        let config = GenerateConfig { fill: [0.45, 0.45], ..GenerateConfig::default() };
        (generate(&catalog, &config, 11).expect("scene"), catalog)
    }

    #[test]
    fn stretched_scenes_are_sound_and_the_same_for_a_seed() {
        let (scene, catalog) = crowded();
        let one = rescale(&scene, &catalog, [0.8, 1.2], 5).expect("rescaled");
        assert_eq!(one, rescale(&scene, &catalog, [0.8, 1.2], 5).expect("again"));
        assert_ne!(one, rescale(&scene, &catalog, [0.8, 1.2], 6).expect("another seed"));
        one.check(&catalog).expect("sound");
        let scales: Vec<f32> = one.objects.iter().flat_map(|object| object.scale).collect();
        assert!(scales.iter().all(|s| (0.8..=1.2).contains(s)), "{scales:?}");
        let mean = scales.iter().sum::<f32>() / scales.len() as f32;
        let spread = scales.iter().map(|s| (s - mean).powi(2)).sum::<f32>() / scales.len() as f32;
        assert!((0.9..1.1).contains(&mean) && spread.sqrt() > 0.06, "mean {mean}, spread {}", spread.sqrt());
        for (before, after) in scene.objects.iter().zip(&one.objects) {
            let [dx, dy] = [0, 1].map(|axis| after.position[axis] - before.position[axis]);
            assert!(dx.hypot(dy) < 0.06, "{} went {dx} {dy}", before.class);
        }
    }

    #[test]
    fn a_row_from_wall_to_wall_draws_until_it_fits() {
        let (mut scene, catalog) = crowded();
        scene.objects = (0..4).map(|k| Object::new("pasta_box", [-0.2985 + 0.199 * k as f32, 0.1], 0.0)).collect();
        for seed in 0..20 {
            let row = rescale(&scene, &catalog, [1.0, 1.2], seed).expect("fits");
            let width: f32 = row.objects.iter().map(|object| 0.185 * object.scale[0]).sum();
            assert!(width <= 0.801, "{width}");
        }
        let refused = rescale(&scene, &catalog, [1.2, 1.1], 0).expect_err("no range");
        assert_eq!(refused.exit_code(), 2);
    }
}
