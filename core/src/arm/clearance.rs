//! The clearance of an arm in a configuration, and the nearest obstacle.

use super::model::{Part, Role};
use super::space::{Gripper, MAP_MARGIN_M, MapObstacles, PANELS, SHELF_MARGIN_M, Space};
use super::{Ball, BodyPoses, Frame, Joints};
use nalgebra::{Matrix3, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// Clearance above this is not distinguished, metres.
const PLENTY_M: f64 = 0.06;
/// The balls of two links stick out of them by about this much together, metres, which the arm's own links need not keep
/// from each other.
const OVERSHOOT_M: f64 = 0.010;

/// What an arm collides with.
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
        /// Which: `board`, `back`, `left wall`, `right wall`, `ceiling`, or `inside` where the whole interior is
        /// forbidden.
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

/// A part of the arm that has too little clearance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hit {
    /// The link.
    pub link: String,
    /// The obstacle.
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

/// A body's pose in the form that is fastest for many points.
struct Moved {
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
}

impl Moved {
    fn by(world_from_body: &Frame) -> Self {
        Self {
            rotation: world_from_body.rotation.to_rotation_matrix().into_inner(),
            translation: world_from_body.translation.vector,
        }
    }

    fn ball(&self, ball: &Ball) -> Placed {
        let center = Point3::from(self.rotation * ball.center.coords + self.translation);
        Placed { center, radius_m: ball.radius_m }
    }
}

impl Placed {
    fn gap_m(&self, other: &Self) -> f64 {
        (self.center - other.center).norm() - self.radius_m - other.radius_m
    }
}

impl Space<'_> {
    /// The clearance of the arm: every point may move this far before it touches anything or violates a margin, metres,
    /// at most 6 cm. Zero or less in a forbidden configuration.
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

    /// The smallest clearance of any part, starting from `room`; `closer` is called for every part that has less than
    /// all before.
    fn measure(&self, joints: &Joints, mut room: f64, mut closer: impl FnMut(usize, Met)) -> f64 {
        let poses = self.arm.body_poses(joints);
        for part in 0..self.arm.places.len() {
            room = self.part_room(part, &poses, room, &mut |met| closer(part, met));
        }
        for &[a, b] in &self.arm.self_pairs {
            let closer = &mut || closer(usize::from(a), Met::Part(usize::from(b)));
            room = self.pair_room([a, b], &poses, room, closer);
        }
        room
    }

    /// How far a part (by position in [`super::Arm::parts`]) may move before it meets shelf, table or map, metres, at
    /// most `least`; `closer` is called for everything that has less than all before.
    pub(super) fn part_room(
        &self,
        part: usize,
        poses: &BodyPoses,
        mut least: f64,
        closer: &mut impl FnMut(Met),
    ) -> f64 {
        let [body, at] = self.arm.places[part];
        let part: &Part = &self.arm.bodies[body][at];
        let pose = Moved::by(&poses[body]);
        let whole = pose.ball(&part.around);
        let mut note = |value: f64, met: Met, least: &mut f64| {
            if value < *least {
                *least = value;
                closer(met);
            }
        };
        // The base stands on the table.
        let above = |ball: &Placed| ball.center.z - ball.radius_m - self.table_z - SHELF_MARGIN_M;
        if body > 0 && above(&whole) < least {
            part.balls.iter().for_each(|ball| note(above(&pose.ball(ball)), Met::Table, &mut least));
        }
        // Most of the arm is far before the shelf most of the time.
        let beside = |ball: &Placed, least: f64| {
            self.outer.distance_m(&ball.center) - ball.radius_m - MAP_MARGIN_M.max(SHELF_MARGIN_M) < least
        };
        if !beside(&whole, least) {
            return least;
        }
        let to_map =
            |map: &MapObstacles<'_>, ball: &Placed| map.field.distance_m(&ball.center) - ball.radius_m - MAP_MARGIN_M;
        let map = self.map.as_ref().filter(|map| part.role == Role::Link || map.gripper == Gripper::KeepsAway);
        let map = map.filter(|map| to_map(map, &whole) < least);
        for ball in part.balls.iter().map(|ball| pose.ball(ball)) {
            if !beside(&ball, least) {
                continue;
            }
            if self.to_panels_m(&ball.center) - ball.radius_m - SHELF_MARGIN_M < least {
                for (panel, slab) in self.panels.iter().enumerate() {
                    note(slab.distance_m(&ball.center) - ball.radius_m - SHELF_MARGIN_M, Met::Panel(panel), &mut least);
                }
            }
            if let Some(map) = map {
                note(to_map(map, &ball), Met::Map(ball.center), &mut least);
            }
        }
        least
    }

    /// How far two parts of the arm may both move before they meet, metres, at most `least`: each may use half of the gap.
    pub(super) fn pair_room(
        &self,
        [a, b]: [u16; 2],
        poses: &BodyPoses,
        mut least: f64,
        closer: &mut impl FnMut(),
    ) -> f64 {
        let ([body_a, part_a], [body_b, part_b]) = (self.arm.places[usize::from(a)], self.arm.places[usize::from(b)]);
        let (first, second): (&Part, &Part) = (&self.arm.bodies[body_a][part_a], &self.arm.bodies[body_b][part_b]);
        let (of_a, of_b) = (Moved::by(&poses[body_a]), Moved::by(&poses[body_b]));
        let whole = of_b.ball(&second.around);
        let room = |gap: f64| 0.5 * (gap + OVERSHOOT_M);
        if room(of_a.ball(&first.around).gap_m(&whole)) >= least {
            return least;
        }
        for ball_a in first.balls.iter().map(|ball| of_a.ball(ball)) {
            if room(ball_a.gap_m(&whole)) >= least {
                continue;
            }
            for ball_b in second.balls.iter().map(|ball| of_b.ball(ball)) {
                let value = room(ball_a.gap_m(&ball_b));
                if value < least {
                    least = value;
                    closer();
                }
            }
        }
        least
    }

    /// Centre of the occupied voxel that is nearest to a point, or the point itself.
    fn voxel_near(&self, point: Point3<f64>) -> [f32; 3] {
        let near = self.map.as_ref().and_then(|map| nearest_voxel(map, &point, map.field.cap_m().min(PLENTY_M)));
        near.unwrap_or_else(|| point.map(|v| v as f32).coords.into())
    }
}

/// What a ball met.
#[derive(Clone, Copy)]
pub(super) enum Met {
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
