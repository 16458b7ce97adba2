//! How much room an arm has in a configuration, and what is in its way.

use super::model::{Part, Role};
use super::space::{Gripper, MAP_MARGIN_M, MapObstacles, PANELS, SHELF_MARGIN_M, Space};
use super::{Ball, Frame, Joints};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// Room beyond this is not told apart, metres.
const PLENTY_M: f64 = 0.06;
/// The balls of two links stick out of them by about this much together, metres, which the arm's own links need not keep
/// from each other.
const OVERSHOOT_M: f64 = 0.010;

/// What an arm meets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "with", rename_all = "snake_case")]
pub enum Obstacle {
    /// A voxel that is believed to be occupied.
    Map {
        /// Its centre, metres.
        at: [f32; 3],
    },
    /// A panel of the shelf.
    Shelf {
        /// Which: `board`, `back`, `left wall`, `right wall`, `ceiling`, or `inside` where nothing of it may be entered.
        panel: String,
    },
    /// The table that the arm stands on.
    Table,
    /// The arm itself.
    Arm {
        /// The other link. In files it has a name of its own: a [`Hit`] has a link beside it.
        #[serde(rename = "other_link")]
        link: String,
    },
}

/// A part of the arm that has too little room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hit {
    /// The link.
    pub link: String,
    /// What it meets.
    #[serde(flatten)]
    pub obstacle: Obstacle,
}

impl std::fmt::Display for Hit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.obstacle {
            Obstacle::Map { at: [x, y, z] } => {
                write!(f, "{} would meet what is believed to stand at ({x:.3}, {y:.3}, {z:.3})", self.link)
            }
            Obstacle::Shelf { panel } => write!(f, "{} would meet the shelf's {panel}", self.link),
            Obstacle::Table => write!(f, "{} would meet the table", self.link),
            Obstacle::Arm { link } => write!(f, "{} would meet the arm's own {link}", self.link),
        }
    }
}

/// A ball where it is, with what it belongs to.
#[derive(Clone, Copy)]
struct Placed {
    center: Point3<f64>,
    radius_m: f64,
}

impl Placed {
    fn of(ball: &Ball, world_from_body: &Frame) -> Self {
        Self { center: world_from_body * ball.center, radius_m: ball.radius_m }
    }

    fn gap_m(&self, other: &Self) -> f64 {
        (self.center - other.center).norm() - self.radius_m - other.radius_m
    }
}

impl Space<'_> {
    /// How far every point of the arm may at least move before anything is touched or a margin is broken, metres, at
    /// most 6 cm. Zero or less where the arm may not be.
    pub fn room_m(&self, joints: &Joints) -> f64 {
        self.measure(joints, PLENTY_M, |_, _| ())
    }

    /// Whether the arm may be in this configuration.
    pub fn is_free(&self, joints: &Joints) -> bool {
        self.arm.within_limits(joints) && self.measure(joints, 0.0, |_, _| ()) >= 0.0
    }

    /// What is in the arm's way most, if anything is.
    pub fn hit(&self, joints: &Joints) -> Option<Hit> {
        let mut worst: Option<(usize, Met)> = None;
        let room = self.measure(joints, 0.0, |part, met| worst = Some((part, met)));
        let (part, met) = worst.filter(|_| room < 0.0)?;
        let name = |part: usize| self.arm.parts().nth(part).map_or_else(String::new, |(_, part)| part.link.clone());
        let obstacle = match met {
            Met::Map(at) => Obstacle::Map { at: self.voxel_near(at) },
            Met::Panel(panel) => Obstacle::Shelf { panel: PANELS[panel].to_owned() },
            Met::Table => Obstacle::Table,
            Met::Part(other) => Obstacle::Arm { link: name(other) },
        };
        Some(Hit { link: name(part), obstacle })
    }

    /// The least room of any part, starting from `room`; `closer` hears of every part that has less than all before.
    fn measure(&self, joints: &Joints, mut room: f64, mut closer: impl FnMut(usize, Met)) -> f64 {
        let poses = self.arm.body_poses(joints);
        for (at, (body, part)) in self.arm.parts().enumerate() {
            let whole = Placed::of(&part.around, &poses[body]);
            let balls = || part.balls.iter().map(|ball| Placed::of(ball, &poses[body]));
            let mut note = |value: f64, met: Met| {
                if value < room {
                    room = value;
                    closer(at, met);
                }
                room
            };
            let mut least = note(f64::INFINITY, Met::Table);
            // The base stands on the table.
            let above = |ball: &Placed| ball.center.z - ball.radius_m - self.table_z - SHELF_MARGIN_M;
            if body > 0 && above(&whole) < least {
                for ball in balls() {
                    least = note(above(&ball), Met::Table);
                }
            }
            // Most of the arm is far before the shelf most of the time.
            let beside = |ball: &Placed, least: f64| {
                self.outer.distance_m(&ball.center) - ball.radius_m - MAP_MARGIN_M.max(SHELF_MARGIN_M) < least
            };
            if !beside(&whole, least) {
                continue;
            }
            let map = self.map.as_ref().filter(|map| part.role == Role::Link || map.gripper == Gripper::KeepsAway);
            for ball in balls() {
                if !beside(&ball, least) {
                    continue;
                }
                for (panel, slab) in self.panels.iter().enumerate() {
                    let gap = slab.distance_m(&ball.center) - ball.radius_m - SHELF_MARGIN_M;
                    least = note(gap, Met::Panel(panel));
                }
                if let Some(map) = map {
                    let gap = map.field.distance_m(&ball.center) - ball.radius_m - MAP_MARGIN_M;
                    least = note(gap, Met::Map(ball.center));
                }
            }
        }
        for &[a, b] in &self.arm.self_pairs {
            // Both sides may move, so each may use half of the gap.
            let ([body_a, part_a], [body_b, part_b]) =
                (self.arm.places[usize::from(a)], self.arm.places[usize::from(b)]);
            let (first, second): (&Part, &Part) = (&self.arm.bodies[body_a][part_a], &self.arm.bodies[body_b][part_b]);
            let whole = Placed::of(&second.around, &poses[body_b]);
            if Placed::of(&first.around, &poses[body_a]).gap_m(&whole) >= 2.0 * room {
                continue;
            }
            for of_a in first.balls.iter().map(|ball| Placed::of(ball, &poses[body_a])) {
                if of_a.gap_m(&whole) >= 2.0 * room {
                    continue;
                }
                for of_b in second.balls.iter().map(|ball| Placed::of(ball, &poses[body_b])) {
                    let value = 0.5 * (of_a.gap_m(&of_b) + OVERSHOOT_M);
                    if value < room {
                        room = value;
                        closer(usize::from(a), Met::Part(usize::from(b)));
                    }
                }
            }
        }
        room
    }

    /// Centre of the occupied voxel that is nearest to a point, or the point itself.
    fn voxel_near(&self, point: Point3<f64>) -> [f32; 3] {
        let near = self.map.as_ref().and_then(|map| nearest_voxel(map, &point, map.field.cap_m().min(PLENTY_M)));
        near.unwrap_or_else(|| point.map(|v| v as f32).coords.into())
    }
}

/// What a ball met.
#[derive(Clone, Copy)]
enum Met {
    Map(Point3<f64>),
    Panel(usize),
    Table,
    Part(usize),
}

/// Centre of the nearest occupied voxel within `reach_m`.
fn nearest_voxel(map: &MapObstacles<'_>, point: &Point3<f64>, reach_m: f64) -> Option<[f32; 3]> {
    let grid = map.field.grid();
    let voxel_m = f64::from(grid.voxel_m);
    let reach = reach_m + 0.5 * voxel_m;
    let range = |axis: usize| {
        let at = |v: f64| ((v - f64::from(grid.origin[axis])) / voxel_m).clamp(0.0, grid.dims[axis] as f64);
        at(point[axis] - reach).floor() as usize..at(point[axis] + reach).ceil() as usize
    };
    let center = |axis: usize, i: usize| f64::from(grid.origin[axis]) + (i as f64 + 0.5) * voxel_m;
    let mut best = None;
    let mut limit = reach * reach;
    for x in range(0) {
        let dx = (center(0, x) - point.x).powi(2);
        for y in range(1) {
            let on_plan = dx + (center(1, y) - point.y).powi(2);
            let cell = x * grid.dims[1] + y;
            if on_plan > limit {
                continue;
            }
            for z in range(2) {
                let squared = on_plan + (center(2, z) - point.z).powi(2);
                if squared < limit && map.occupied.contains(cell * grid.dims[2] + z) {
                    limit = squared;
                    let at = [center(0, x) as f32, center(1, y) as f32, center(2, z) as f32];
                    best = Some(at);
                }
            }
        }
    }
    best
}
