//! Drags: the closed gripper reaches over an object, down behind it, and pulls it towards the entrance.
//!
//! It is the mirror of a push: contact from behind, where the belief has room. The gripper points into the shelf and down,
//! so that it stands over the object with its tip behind it; it comes and goes along its own axis, lifted clear of the
//! object before it is drawn out of the shelf. What is low and has free space behind it can be dragged; in a crowd little.

use super::clearance::{Approach, gripper_poses};
use super::push::{LENGTH_M, STANDOFF_M};
use super::sampling::draw_until;
use super::{
    AVOIDED, ArmClearance, Arrow, Candidate, DRAWS_PER_CANDIDATE, Description, Fact, Ground, LIKELY, Manipulation,
    Outline, Parameter, Rejection, Skill, SkillKind, Stage, Unit,
};
use crate::arm::{Arm, ArmTool, Joints, PhasedMotion, inclined_tool};
use crate::belief::{Belief, FloorPlan, Flow, Intervention, Met, OBJECT_RADIUS_M, Patch, SOLID, Stroke};
use crate::grid::{Cell, Grid, Voxel, VoxelSet};
use crate::rng::ChaCha8Rng;
use crate::{Point, Vector};
use rand::Rng;
use serde::{Deserialize, Serialize};

/// Directions of a drag, degrees: -90 is straight towards the entrance.
const DIRECTIONS_DEG: [f32; 2] = [-120.0, -60.0];
/// How far down the gripper points, degrees.
const PITCHES_DEG: [f32; 2] = [25.0, 65.0];
/// Lowest place of the tip above the board, and how far below the object's top it is at least and at most, metres.
const LOWEST_M: f32 = 0.03;
const BELOW_TOP_M: [f32; 2] = [0.015, 0.06];
/// Half of the finger's thickness, metres. Where a gripper is thicker, the check of the arm rejects what is too near.
const FINGER_HALF_M: f32 = 0.0175;
/// How far above the object the finger is at the start, metres.
const GAP_M: f32 = 0.01;
/// How far behind the contact there must be free space, and how far to either side of it: the finger, metres.
const ROOM_M: [f32; 2] = [0.045, 0.015];
/// How far beyond its way the object may begin that the finger, reaching over it, pulls, metres.
const OVER_M: f32 = 0.10;
/// Inclinations and heights that are tried for one that has room.
const TRIES: usize = 8;
/// How far the gripper is drawn back along its own axis before it leaves the shelf, metres; each is tried.
const LIFTS_M: [f64; 2] = [0.16, 0.08];
/// Length of the line that shows how the gripper stands, metres.
const FINGER_M: f32 = 0.12;

/// One straight drag: the tip goes down behind an object to `start`, then `length_m` along `direction_deg`, then back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drag {
    /// Where the tip starts to pull, metres.
    pub start: [f32; 3],
    /// Direction in the plane of the board, degrees counter-clockwise from +x (-90 is straight towards the entrance).
    pub direction_deg: f32,
    /// How far the tip moves, metres.
    pub length_m: f32,
    /// How far down the gripper points, degrees.
    pub pitch_deg: f32,
}

impl Drag {
    fn stroke(&self) -> Stroke {
        let (sin, cos) = self.direction_deg.to_radians().sin_cos();
        Stroke { start: self.start.into(), direction: Vector::new(cos, sin, 0.0), length_m: self.length_m }
    }

    /// The object that it pulls: what stands on the first floor cell along its way, which the finger may reach over before
    /// the tip is there.
    fn target(&self, plan: &FloorPlan, grid: &Grid) -> Option<(usize, Patch)> {
        let (stroke, step) = (self.stroke(), 0.5 * grid.voxel_m);
        let steps = ((self.length_m + OVER_M) / step).ceil() as usize;
        let track = (0..=steps).filter_map(|i| grid.cell_at(stroke.start + stroke.direction * (step * i as f32)));
        let met = track.map(|cell| grid.cell_index(cell)).find(|cell| plan.stands(*cell))?;
        Some((met, plan.patch(met, OBJECT_RADIUS_M)))
    }

    fn motion(
        &self,
        clearance: &ArmClearance<'_>,
        target: &Patch,
        rng: &mut ChaCha8Rng,
    ) -> Result<PhasedMotion, Rejection> {
        let stroke = self.stroke();
        let poses = gripper_poses(&stroke.start.map(f64::from), f64::from(self.pitch_deg).to_radians());
        let travel = stroke.direction.map(f64::from) * f64::from(self.length_m);
        let mut last = Rejection::Unreachable { stage: Stage::Start };
        for lift_m in LIFTS_M {
            let approach = Approach { poses: &poses, travel, lift_m, touches: None, target };
            match clearance.motion(&approach, rng) {
                Ok(motion) => return Ok(motion),
                Err(rejection) => last = rejection,
            }
        }
        Err(last)
    }
}

/// How far the finger reaches over an object of that height when its tip is at a height, metres: the lower side of the
/// inclined finger is there as high as the object.
fn overhang_m(top_m: f32, tip_m: f32, pitch_deg: f32) -> f32 {
    let pitch = pitch_deg.to_radians();
    ((top_m - tip_m + FINGER_HALF_M / pitch.cos()) / pitch.tan()).max(0.0)
}

/// What is believed to stand, for looking for what can be reached from behind.
struct Backs<'a> {
    belief: &'a Belief,
    plan: &'a FloorPlan,
}

impl Backs<'_> {
    fn cells(&self, m: f32) -> usize {
        (m / self.belief.grid.voxel_m).ceil() as usize
    }

    /// How high what stands on a floor cell and beside it is, metres above the board.
    fn top_m(&self, cell: usize) -> f32 {
        let grid = &self.belief.grid;
        let [width, depth, _] = grid.dims;
        let (x, y, beside) = (cell / depth, cell % depth, self.cells(ROOM_M[1]));
        let near = (x.saturating_sub(beside)..(x + beside + 1).min(width))
            .flat_map(|x| (y.saturating_sub(beside)..=y).map(move |y| x * depth + y));
        let levels =
            near.filter_map(|cell| grid.column(cell).rposition(|voxel| self.belief.probability(voxel) > AVOIDED));
        levels.max().map_or(0.0, |level| (level + 1) as f32 * grid.voxel_m)
    }

    /// Whether nothing likely stands behind a floor cell (what is right behind an object no view shows), so far back, and from some height up to another.
    fn has_room(&self, cell: usize, back_m: f32, [low_m, high_m]: [f32; 2]) -> bool {
        let grid = &self.belief.grid;
        let [width, depth, height] = grid.dims;
        let level = |m: f32| ((m.max(0.0) / grid.voxel_m) as usize).min(height - 1);
        let (x, y, back, beside) = (cell / depth, cell % depth, self.cells(back_m), self.cells(ROOM_M[1]));
        if x < beside || x + beside >= width || y + back >= depth {
            return false;
        }
        let free = |x: usize, y: usize| {
            let first = grid.column(x * depth + y).start;
            (level(low_m)..=level(high_m)).all(|z| self.belief.probability(first + z) < LIKELY)
        };
        (x - beside..=x + beside).all(|x| (y + 1..=y + back).all(|y| free(x, y)))
    }

    /// The floor cells at the back of what stands, behind which the belief has room.
    fn all(&self) -> Vec<usize> {
        let cells = 0..self.belief.grid.cell_count();
        let has_room = |cell: &usize| {
            let tip_m = (self.top_m(*cell) - BELOW_TOP_M[0]).max(LOWEST_M);
            self.has_room(*cell, ROOM_M[0], [tip_m - FINGER_HALF_M, tip_m + FINGER_HALF_M])
        };
        cells.filter(|cell| self.plan.stands(*cell) && has_room(cell)).collect()
    }

    /// A drag of what stands on a floor cell: of some inclinations and heights the first one that has room, else the last.
    fn draw(&self, cell: usize, rng: &mut ChaCha8Rng) -> (Voxel, Drag) {
        let (grid, top_m) = (&self.belief.grid, self.top_m(cell));
        let Cell { x, y } = grid.cell(cell);
        let at = grid.cell_center(Cell { x, y });
        let mut between = |[low, high]: [f32; 2]| rng.random_range(low..high);
        let (direction_deg, length_m) = (between(DIRECTIONS_DEG), between(LENGTH_M));
        let (sin, cos) = direction_deg.to_radians().sin_cos();
        let tries = (0..TRIES).map(|_| {
            let (pitch_deg, below_m) = (between(PITCHES_DEG), between(BELOW_TOP_M));
            let tip_m = (top_m - below_m).max(LOWEST_M);
            let standoff_m = overhang_m(top_m + GAP_M, tip_m, pitch_deg).max(STANDOFF_M);
            (pitch_deg, tip_m, standoff_m)
        });
        let tries: Vec<(f32, f32, f32)> = tries.collect();
        let room = |(_, tip_m, standoff_m): &&(f32, f32, f32)| {
            self.has_room(cell, standoff_m + FINGER_HALF_M, [tip_m - FINGER_HALF_M, tip_m + FINGER_HALF_M])
        };
        let found = tries.iter().find(room).or(tries.last()).copied();
        let (pitch_deg, tip_m, standoff_m) = found.unwrap_or((PITCHES_DEG[1], LOWEST_M, STANDOFF_M));
        let start = [at.x - cos * standoff_m, at.y - sin * standoff_m, grid.origin[2] + tip_m];
        (Voxel { x, y, z: (tip_m / grid.voxel_m) as u16 }, Drag { start, direction_deg, length_m, pitch_deg })
    }
}

impl Skill for Drag {
    fn sample(ground: &Ground<'_>, count: usize, rng: &mut ChaCha8Rng) -> Vec<Candidate> {
        let (belief, arm, grid) = (ground.belief, ground.arm, &ground.belief.grid);
        let (clearance, plan) = (ArmClearance::new(arm, belief), FloorPlan::new(belief, AVOIDED));
        let backs = Backs { belief, plan: &plan };
        let mut left = backs.all();
        let draws = left.len().min(count * DRAWS_PER_CANDIDATE);
        let draw = |rng: &mut ChaCha8Rng| {
            let cell = left.swap_remove(rng.random_range(0..left.len()));
            backs.draw(cell, rng)
        };
        draw_until(count, draws, rng, draw, |(contact, drag), rng| {
            let motion = match drag.target(&plan, grid) {
                Some((_, target)) => drag.motion(&clearance, &target, rng),
                None => Err(Rejection::NoTarget),
            };
            Candidate::of(contact, drag.into(), motion, belief, arm)
        })
    }

    fn is_finite(&self) -> bool {
        let numbers = [self.start[0], self.start[1], self.start[2], self.direction_deg, self.length_m, self.pitch_deg];
        numbers.iter().all(|number| number.is_finite()) && self.length_m >= 0.0
    }

    fn plan(&self, clearance: &ArmClearance<'_>, rng: &mut ChaCha8Rng) -> Result<PhasedMotion, Rejection> {
        let (_, target) = self.target(clearance.plan(), clearance.grid()).ok_or(Rejection::NoTarget)?;
        self.motion(clearance, &target, rng)
    }

    fn is_done_by(&self, motion: &PhasedMotion, arm: &Arm, ready: &Joints) -> bool {
        let stroke = self.stroke();
        motion.leads(arm, ready, stroke.start, stroke.end())
    }

    fn swept_by_gripper(&self, arm: &ArmTool, belief: &Belief) -> VoxelSet {
        let (mut swept, stroke) = (VoxelSet::empty(&belief.grid), self.stroke());
        let pose = inclined_tool(&stroke.start.map(f64::from), 0.0, f64::from(self.pitch_deg).to_radians());
        let travel = stroke.direction.map(f64::from) * f64::from(self.length_m);
        arm.arm.sweep_gripper(&pose, &travel, &belief.grid, &mut swept);
        swept
    }

    /// The object comes along as a whole, without turning. It comes to stand under what the arm swept on its way over it, and
    /// leaves from under it: where the arm only passed above it, it tells nothing of what stands there afterwards.
    fn intervention(&self, belief: &Belief, solid: &FloorPlan, mut swept: VoxelSet) -> Intervention {
        let (grid, stroke) = (&belief.grid, self.stroke());
        let Some((first, target)) = self.target(solid, grid) else {
            return Intervention { swept, flow: Flow::nothing(), stroke };
        };
        let backs = Backs { belief, plan: solid };
        let over_m = overhang_m(backs.top_m(first), self.start[2] - grid.origin[2], self.pitch_deg);
        let before = (stroke.along(grid.cell_center(grid.cell(first))) - over_m).max(0.0);
        let way_m = (stroke.length_m - before + 0.5 * grid.voxel_m).max(0.0);
        let flow = Flow::rigid(grid, &target, [0, 1].map(|axis| stroke.direction[axis] * way_m));
        let (moved, met) = (flow.moved(grid), Met::of(belief, &swept));
        let over = |cell: &usize| moved.stood(*cell) && met.probability[*cell] < SOLID;
        for cell in (0..grid.cell_count()).filter(|cell| moved.source(*cell).is_some() || over(cell)) {
            grid.column(cell).for_each(|voxel| swept.remove(voxel));
        }
        Intervention { swept, flow, stroke }
    }

    fn way_m(&self) -> f32 {
        self.length_m
    }

    fn shortened(&self, way_m: f32) -> Manipulation {
        Self { length_m: way_m, ..*self }.into()
    }

    fn describe(&self) -> Description {
        let (name, down) = (SkillKind::Drag.name(), "How far down the gripper points, degrees; 0 is level");
        let mut description = Description::of_line(name, self.start, self.direction_deg, self.length_m);
        description.facts.push(Fact { name: "gripper", text: format!("{:.0}° down", self.pitch_deg), hint: down });
        description.parameters.push(Parameter {
            field: "pitch_deg",
            name: "down",
            column: Some("Down"),
            value: self.pitch_deg,
            unit: Unit::Degrees,
            hint: down,
        });
        description
    }

    /// The way of the tip, and the gripper over the object.
    fn outline(&self) -> Outline {
        let stroke = self.stroke();
        let (sin, cos) = self.pitch_deg.to_radians().sin_cos();
        let finger = |tip: Point| vec![tip, tip + Vector::new(0.0, -cos, sin) * FINGER_M];
        let arrow = Arrow { start: stroke.start, way: stroke.direction * stroke.length_m };
        Outline { arrows: vec![arrow], lines: vec![finger(stroke.start)] }
    }
}

#[cfg(test)]
#[path = "drag_tests.rs"]
mod tests;
