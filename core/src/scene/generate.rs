//! Random scenes: crowded shelves whose neighbours belong together.
//!
//! After Marques et al., "Dataset Generation Details": until the floor is filled to a target share, draw a yaw in 0 to
//! 180 degrees for every class, a point of a fine floor grid where some class can stand, and a class among those that can
//! (affinities of the objects within whose radius of influence the point lies). Where a class can stand is what remains
//! of the floor after the Minkowski sums of its mirrored footprint and every placed one ([`placeable`]). The regularity
//! `rho` makes points in front of and behind placed objects likelier. Before that a [`Family`] may place a structure.

mod family;
mod placeable;
mod structure;

pub use family::Family;

use super::lines::Places;
use super::{
    Catalog, Class, ClassId, MeshShape, OBJECT_CLASS_COUNT, Object, RobotPlacement, Scene, Shelf, check, outline,
};
use crate::rng::{ChaCha8Rng, stream};
use crate::{Error, Result};
use placeable::{FloorGrid, FloorMask};
use rand::Rng;
use std::collections::BTreeMap;

/// Gap that is kept between objects and to the walls, metres.
const GAP_M: f32 = 0.002;
/// Floor share by which a target may be exceeded when smaller classes are left.
const OVERSHOOT: f32 = 0.005;
/// Weight of large classes against others, before affinities.
const LARGE_WEIGHT: f64 = 1.25;
/// How far `rho = 1` prefers a point exactly in line with a placed object.
const ALIGNED_WEIGHT: f64 = 200.0;
/// Spread of "in line", metres.
const ALIGNED_SPREAD_M: f32 = 0.006;
/// Draws of a free position about a grid point, before the point itself is taken.
const FREE_DRAWS: usize = 4;
/// Draws of yaws in a row for which nothing has room, before the shelf counts as full.
const MAX_FAILURES: usize = 16;

/// What scenes to generate.
#[derive(Clone, Debug)]
pub struct GenerateConfig {
    /// Range of the floor share that footprints shall cover; a scene's target is drawn from it uniformly.
    pub fill: [f32; 2],
    /// Regularity in 0 to 1: how strongly objects line up behind placed ones.
    pub rho: f32,
    /// What is placed before the rest is filled at random.
    pub family: Family,
    /// The shelf.
    pub shelf: Shelf,
    /// Classes to place; empty for all.
    pub classes: Vec<ClassId>,
    /// Objects that are there already and stay; they come first in the scene.
    pub keep: Vec<Object>,
    /// Meshes of the kept objects, and of classes that have one.
    pub meshes: BTreeMap<String, MeshShape>,
}

impl Default for GenerateConfig {
    /// The published training distribution: 30 to 45 % of the design's shelf, no regularity, all classes.
    fn default() -> Self {
        Self {
            fill: [0.30, 0.45],
            rho: 0.0,
            family: Family::Mixed,
            shelf: Shelf::new([0.80, 0.40, 0.40]),
            classes: Vec::new(),
            keep: Vec::new(),
            meshes: BTreeMap::new(),
        }
    }
}

impl GenerateConfig {
    /// Shelves of a family with its usual fill and regularity.
    pub fn of_family(family: Family) -> Self {
        Self { family, fill: family.fill(), rho: family.rho(), ..Self::default() }
    }

    /// Generates around what a scene holds.
    pub fn around(scene: &Scene) -> Self {
        Self { shelf: scene.shelf, keep: scene.objects.clone(), meshes: scene.meshes.clone(), ..Self::default() }
    }

    /// The floor share that [`generate`] aims at for `seed`. A scene whose [`Scene::fill`] stays below it by more than a
    /// hundredth could not be filled: nothing more had room.
    pub fn target_fill(&self, seed: u64) -> f32 {
        let share: f32 = stream(seed, "scene fill", 0).random();
        self.fill[0] + share * (self.fill[1] - self.fill[0])
    }

    fn check(&self, catalog: &Catalog) -> Result<()> {
        let [low, high] = self.fill;
        if !(low > 0.0 && low <= high && high <= 0.9) {
            return Err(Error::Usage(format!("fill {low} to {high}: must be a rising range within 0 to 0.9")));
        }
        if !(0.0..=1.0).contains(&self.rho) {
            return Err(Error::Usage(format!("rho {}: must be between 0 and 1", self.rho)));
        }
        if let Some(id) = self.classes.iter().find(|id| id.index() >= catalog.classes.len()) {
            return Err(Error::Usage(format!("class {} cannot be placed", id.0)));
        }
        check::check_shelf(&self.shelf, &Places::without_file("generated scene"))
    }
}

/// A class with the footprint that it has here, and where it could stand at the yaw that was drawn for it.
struct Candidate<'a> {
    class: &'a Class,
    /// Outline grown by half the gap, at yaw 0 about the origin.
    footprint: Vec<[f32; 2]>,
    /// Share of the floor that the bare footprint covers.
    share: f32,
    /// Whether a turn changes nothing, so that `blocked` stays good from one draw to the next.
    is_round: bool,
    yaw_deg: f32,
    blocked: FloorMask,
    /// How many of the standing objects are in `blocked`.
    blocked_by: usize,
}

/// An object that stands.
struct Standing {
    class: ClassId,
    position: [f32; 2],
    /// Outline grown by half the gap, in place.
    outline: Vec<[f32; 2]>,
}

/// Generates a scene; the same configuration and seed give the same scene. It may stay below its target when nothing
/// more has room: compare [`Scene::fill`] with [`GenerateConfig::target_fill`].
pub fn generate(catalog: &Catalog, config: &GenerateConfig, seed: u64) -> Result<Scene> {
    config.check(catalog)?;
    let mut scene = Scene {
        name: format!("generated-{seed}"),
        description: String::new(),
        shelf: config.shelf,
        objects: config.keep.clone(),
        meshes: config.meshes.clone(),
        robot: RobotPlacement::default(),
    };
    let mut standing: Vec<Standing> = Vec::new();
    for (body, object) in scene.bodies(catalog)?.iter().zip(&scene.objects) {
        let grown = outline::grown(&body.solid.footprint(), 0.5 * GAP_M);
        let outline = outline::placed(&grown, object.position, object.yaw_deg);
        standing.push(Standing { class: body.class, position: object.position, outline });
    }
    let structured = stream(seed, "scene structure", 0);
    structure::Builder::new(catalog, config, &mut scene.objects, &mut standing, structured).build(config.family);
    let mut fill = scene.fill(catalog)?;
    let target = config.target_fill(seed);
    let mut rng = stream(seed, "scene objects", 0);
    let grid = FloorGrid::new(config.shelf.size);
    let mut candidates = candidates(catalog, config, &grid);
    let mut failures = 0;
    while scene.objects.len() < super::MAX_OBJECTS && failures < MAX_FAILURES {
        let mut fitting = nearer_to_target(&mut candidates, fill, target);
        if fitting.is_empty() {
            break;
        }
        for candidate in &mut fitting {
            candidate.turn(&grid, &standing, &mut rng);
        }
        let Some((chosen, position)) = draw(catalog, &grid, &fitting, &standing, config.rho, &mut rng) else {
            failures += 1;
            continue;
        };
        failures = 0;
        fill += chosen.share;
        let outline = outline::placed(&chosen.footprint, position, chosen.yaw_deg);
        scene.objects.push(Object::new(chosen.class.name.clone(), position, chosen.yaw_deg));
        standing.push(Standing { class: chosen.class.id, position, outline });
    }
    Ok(scene)
}

/// The classes that may be placed.
fn candidates<'a>(catalog: &'a Catalog, config: &GenerateConfig, grid: &FloorGrid) -> Vec<Candidate<'a>> {
    let floor = config.shelf.size[0] * config.shelf.size[1];
    let mut candidates = Vec::with_capacity(OBJECT_CLASS_COUNT);
    for class in &catalog.classes {
        let mesh = config.meshes.get(&class.name).map(MeshShape::solid);
        let solid = mesh.as_ref().unwrap_or(&class.solid);
        let listed = config.classes.is_empty() || config.classes.contains(&class.id);
        if !listed || solid.bounds().max.z > config.shelf.size[2] {
            continue;
        }
        let bare = solid.footprint();
        let footprint = outline::grown(&bare, 0.5 * GAP_M);
        candidates.push(Candidate {
            class,
            share: outline::area(&bare) / floor,
            is_round: mesh.is_none() && class.shape.is_round(),
            yaw_deg: 0.0,
            blocked: grid.outside(&footprint, 0.5 * GAP_M),
            blocked_by: 0,
            footprint,
        });
    }
    candidates
}

/// Only what brings the fill nearer to the target, and beyond it by no more than a hair when there is a choice.
fn nearer_to_target<'a, 'b>(candidates: &'b mut [Candidate<'a>], fill: f32, target: f32) -> Vec<&'b mut Candidate<'a>> {
    let nearer = |candidate: &Candidate| (fill + candidate.share - target).abs() < (fill - target).abs();
    let below = |candidate: &Candidate| fill + candidate.share < target + OVERSHOOT;
    let choice = candidates.iter().any(|candidate| nearer(candidate) && below(candidate));
    candidates.iter_mut().filter(|candidate| nearer(candidate) && (below(candidate) || !choice)).collect()
}

impl Candidate<'_> {
    /// Draws a yaw, and finds where the class could stand at it.
    fn turn(&mut self, grid: &FloorGrid, standing: &[Standing], rng: &mut ChaCha8Rng) {
        // Tenths of a degree, which files keep.
        self.yaw_deg = f32::from(rng.random_range(0..1800_u16)) / 10.0;
        let turned = if self.is_round {
            self.footprint.clone()
        } else {
            let turned = outline::placed(&self.footprint, [0.0, 0.0], self.yaw_deg);
            self.blocked = grid.outside(&turned, 0.5 * GAP_M);
            self.blocked_by = 0;
            turned
        };
        for other in &standing[self.blocked_by..] {
            grid.block(&mut self.blocked, &outline::obstacle(&other.outline, &turned));
        }
        self.blocked_by = standing.len();
    }
}

/// Draws a point where something fits, a class that does, and a position about the point.
fn draw<'a, 'b>(
    catalog: &Catalog,
    grid: &FloorGrid,
    candidates: &'b [&mut Candidate<'a>],
    standing: &[Standing],
    rho: f32,
    rng: &mut ChaCha8Rng,
) -> Option<(&'b Candidate<'a>, [f32; 2])> {
    let blocked = grid.common(candidates.iter().map(|candidate| &candidate.blocked))?;
    let column_weights: Vec<f64> = (0..grid.columns()).map(|x| alignment(grid.x(x), standing, rho)).collect();
    let (column, row) = grid.draw_free(&blocked, &column_weights, rng)?;
    let point = [grid.x(column), grid.y(row)];
    let all = candidates.iter().map(|candidate| &**candidate);
    let fitting: Vec<&Candidate> = all.filter(|c| !grid.is_blocked(&c.blocked, column, row)).collect();
    let affinity = class_weights(catalog, standing, point);
    let weights: Vec<f64> = fitting.iter().map(|candidate| affinity[candidate.class.id.index()]).collect();
    let chosen = fitting[draw_weighted(&weights, rng)?];

    // The grid is only where to look: take a position about its point where that is free.
    for _ in 0..FREE_DRAWS {
        let position = point.map(|v| ((v + grid.step_m() * (rng.random::<f32>() - 0.5)) * 1e4).round() / 1e4);
        let outline = outline::placed(&chosen.footprint, position, chosen.yaw_deg);
        let inside = grid.contains(&outline, 0.5 * GAP_M);
        if inside && standing.iter().all(|other| outline::separation(&outline, &other.outline) >= 0.0) {
            return Some((chosen, position));
        }
    }
    Some((chosen, point))
}

/// How likely a column of points is against one that is in line with nothing.
fn alignment(x: f32, standing: &[Standing], rho: f32) -> f64 {
    let nearest = standing.iter().map(|other| (x - other.position[0]).abs()).fold(f32::INFINITY, f32::min);
    let aligned = (-0.5 * (nearest / ALIGNED_SPREAD_M).powi(2)).exp();
    1.0 + f64::from(rho) * ALIGNED_WEIGHT * f64::from(aligned)
}

/// Weight of every class at a point: the base, times `(1 - s) * doubled + s * own` of each object within whose radius of
/// influence the point lies. `doubled` and `own` are distributions: the class's own chance `s` is what it says.
fn class_weights(catalog: &Catalog, standing: &[Standing], point: [f32; 2]) -> [f64; OBJECT_CLASS_COUNT] {
    let mut weights = [1.0; OBJECT_CLASS_COUNT];
    for class in &catalog.classes {
        if class.large {
            weights[class.id.index()] = LARGE_WEIGHT;
        }
    }
    for other in standing {
        let class = catalog.class(other.class);
        let [dx, dy] = [other.position[0] - point[0], other.position[1] - point[1]];
        if dx.hypot(dy) > class.influence_m {
            continue;
        }
        let own = f64::from(class.own_chance);
        let all = (OBJECT_CLASS_COUNT + class.doubles.len()) as f64;
        let mut total = 0.0;
        for (k, weight) in weights.iter_mut().enumerate() {
            let doubled = if class.doubles.iter().any(|id| id.index() == k) { 2.0 } else { 1.0 };
            *weight *= (1.0 - own) * doubled / all + if k == class.id.index() { own } else { 0.0 };
            total += *weight;
        }
        // Normalised each time: a hundred neighbours would underflow.
        weights.iter_mut().for_each(|weight| *weight /= total);
    }
    weights
}

/// Position drawn with probability proportional to its weight.
fn draw_weighted(weights: &[f64], rng: &mut ChaCha8Rng) -> Option<usize> {
    let total: f64 = weights.iter().sum();
    let mut at = rng.random::<f64>() * total;
    let last = weights.iter().rposition(|weight| *weight > 0.0)?;
    for (i, weight) in weights.iter().enumerate().take(last) {
        at -= weight;
        if at < 0.0 {
            return Some(i);
        }
    }
    Some(last)
}

#[cfg(test)]
mod tests;
