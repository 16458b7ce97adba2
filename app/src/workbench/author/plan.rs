//! The floor plan of a scene in the making: where every object stands, what is wrong with it, and where there is room.

use nudge_core::scene::{Catalog, Problem, Scene, outline};
use std::collections::BTreeMap;

/// Gap that is left around an object that is put where there is room, metres.
const ROOM_M: f32 = 0.002;
/// Distance of the places that are tried, metres.
const STEP_M: f32 = 0.01;

/// Outlines and problems of a scene's objects, by position in its list.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Footprints where they stand, metres; empty where an object has no shape.
    pub outlines: Vec<Vec<[f32; 2]>>,
    /// What is wrong, in words, by object.
    pub problems: BTreeMap<usize, Vec<String>>,
    /// What is wrong with the scene as a whole.
    pub error: Option<String>,
}

impl Plan {
    /// The plan of a scene, sound or not.
    pub fn of(scene: &Scene, catalog: &Catalog) -> Self {
        let bodies = match scene.bodies(catalog) {
            Ok(bodies) => bodies,
            Err(error) => {
                let outlines = vec![Vec::new(); scene.objects.len()];
                return Self { outlines, problems: BTreeMap::new(), error: Some(error.to_string()) };
            }
        };
        let outlines = bodies
            .iter()
            .zip(&scene.objects)
            .map(|(body, object)| outline::placed(&body.solid.footprint(), object.position, object.yaw_deg))
            .collect();
        let mut plan = Self { outlines, ..Self::default() };
        let mut add = |at: u16, words: String| plan.problems.entry(at.into()).or_default().push(words);
        for problem in scene.problems(catalog).unwrap_or_default() {
            match problem {
                Problem::Outside { object, message } => add(object, message),
                Problem::Overlap { object, other, depth_m } => {
                    let by = format!("by {:.1} mm", 1000.0 * depth_m);
                    add(object, format!("overlaps {} {by}", name(scene, other.into())));
                    add(other, format!("overlaps {} {by}", name(scene, object.into())));
                }
            }
        }
        plan
    }

    /// The object at a point of the board; of several the one that is in `preferred`, else the one drawn last.
    pub fn at(&self, point: [f32; 2], preferred: impl Fn(usize) -> bool) -> Option<usize> {
        let mut there = (0..self.outlines.len()).rev().filter(|at| contains(&self.outlines[*at], point));
        let top = there.next()?;
        Some(if preferred(top) { top } else { there.find(|at| preferred(*at)).unwrap_or(top) })
    }

    /// The objects whose footprints lie within a rectangle between two corners.
    pub fn within(&self, a: [f32; 2], b: [f32; 2]) -> impl Iterator<Item = usize> {
        let inside =
            move |p: &[f32; 2]| (0..2).all(|axis| (a[axis].min(b[axis])..=a[axis].max(b[axis])).contains(&p[axis]));
        let found = self
            .outlines
            .iter()
            .enumerate()
            .filter(move |(_, outline)| !outline.is_empty() && outline.iter().all(inside));
        found.map(|(at, _)| at)
    }

    /// The place nearest to `near` where a footprint (at yaw 0 about the origin) has room when turned by `yaw_deg`.
    pub fn room_for(&self, scene: &Scene, footprint: &[[f32; 2]], yaw_deg: f32, near: [f32; 2]) -> Option<[f32; 2]> {
        let turned = outline::placed(footprint, [0.0, 0.0], yaw_deg);
        let reach = radius(&turned, [0.0, 0.0]);
        let (min, max) = (scene.shelf.min(), scene.shelf.max());
        let others: Vec<_> = self
            .outlines
            .iter()
            .zip(&scene.objects)
            .map(|(outline, object)| (object.position, radius(outline, object.position), outline))
            .collect();
        let has_room = |at: &[f32; 2]| {
            let placed = outline::placed(&turned, *at, 0.0);
            let inside = placed.iter().all(|[x, y]| *x >= min.x && *x <= max.x && *y >= min.y && *y <= max.y);
            inside
                && others.iter().all(|(position, radius, outline)| {
                    let apart = (position[0] - at[0]).hypot(position[1] - at[1]) > radius + reach + ROOM_M;
                    apart || outline.is_empty() || outline::separation(&placed, outline) > ROOM_M
                })
        };
        let count = |low: f32, high: f32| ((high - low) / STEP_M) as usize;
        let mut places: Vec<[f32; 2]> = (0..=count(min.x, max.x))
            .flat_map(|i| {
                (0..=count(min.y, max.y)).map(move |j| [min.x + i as f32 * STEP_M, min.y + j as f32 * STEP_M])
            })
            .collect();
        let distance = |p: &[f32; 2]| (p[0] - near[0]).hypot(p[1] - near[1]);
        places.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        places.into_iter().map(|p| p.map(super::snap::rounded)).find(has_room)
    }
}

/// An object's name as scorers and messages write it: `tomato_can#3`.
pub fn name(scene: &Scene, at: usize) -> String {
    let class = scene.objects.get(at).map_or("object", |object| object.class.as_str());
    format!("{class}#{at}")
}

fn radius(outline: &[[f32; 2]], about: [f32; 2]) -> f32 {
    outline.iter().map(|[x, y]| (x - about[0]).hypot(y - about[1])).fold(0.0, f32::max)
}

fn contains(outline: &[[f32; 2]], [x, y]: [f32; 2]) -> bool {
    outline.len() > 2
        && (0..outline.len()).all(|i| {
            let ([ax, ay], [bx, by]) = (outline[i], outline[(i + 1) % outline.len()]);
            (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0.0
        })
}
