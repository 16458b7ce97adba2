//! Drags: the closed gripper reaches over an object, down behind it, and pulls it towards the entrance.
//!
//! It is the mirror of a push: contact from behind, where the belief has room. The gripper points into the shelf and down,
//! so that it stands over the object with its tip behind it; it comes and goes along its own axis, lifted clear of the
//! object before it is drawn out of the shelf. What is low and has free space behind it can be dragged; in a crowd little.

use super::clearance::{Approach, gripper_poses};
use super::push::{LENGTH_M, STANDOFF_M};
use super::sampling::draw_until;
use super::{
    AVOIDED, ArmClearance, Arrow, Candidate, DRAWS_PER_CANDIDATE, Description, Fact, Ground, Manipulation, Outline,
    Parameter, Rejection, Skill, SkillKind, Stage, Unit,
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
/// Lowest and highest place of the tip above the board, metres.
const HEIGHT_M: [f32; 2] = [0.03, 0.08];
/// Occupancy probability up to which the space behind an object counts as free.
const FREE: f32 = 0.4;
/// How far behind the contact there must be free space, and how far to either side of it: the finger, metres.
const ROOM_M: [f32; 2] = [0.045, 0.015];
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

    /// The object that it pulls: what stands on the first floor cell along its way.
    fn target(&self, plan: &FloorPlan, grid: &Grid) -> Option<(usize, Patch)> {
        let (stroke, step) = (self.stroke(), 0.5 * grid.voxel_m);
        let steps = (self.length_m / step).ceil() as usize;
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

/// The floor cells at the back of what stands, behind which the belief has room for the tip.
fn backs(belief: &Belief, plan: &FloorPlan) -> Vec<usize> {
    let grid = &belief.grid;
    let [width, depth, height] = grid.dims;
    let cells = |m: f32| (m / grid.voxel_m).ceil() as usize;
    let [behind, beside] = ROOM_M.map(cells);
    let level = |m: f32| (((m - grid.origin[2]) / grid.voxel_m) as usize).min(height - 1);
    let levels = level(HEIGHT_M[0])..level(HEIGHT_M[1]) + 1;
    let free = |x: usize, y: usize| {
        let column = grid.column(x * depth + y);
        levels.clone().all(|z| belief.probability(column.start + z) <= FREE)
    };
    let has_room = |cell: &usize| {
        let (x, y) = (cell / depth, cell % depth);
        let inside = x >= beside && x + beside < width && y + behind < depth;
        let mut room = (x.saturating_sub(beside)..=x + beside).flat_map(|x| (y + 1..=y + behind).map(move |y| (x, y)));
        inside && room.all(|(x, y)| free(x, y))
    };
    (0..grid.cell_count()).filter(|cell| plan.stands(*cell)).filter(has_room).collect()
}

impl Skill for Drag {
    fn sample(ground: &Ground<'_>, count: usize, rng: &mut ChaCha8Rng) -> Vec<Candidate> {
        let (belief, arm, grid) = (ground.belief, ground.arm, &ground.belief.grid);
        let (clearance, plan) = (ArmClearance::new(arm, belief), FloorPlan::new(belief, AVOIDED));
        let mut backs = backs(belief, &plan);
        let draws = backs.len().min(count * DRAWS_PER_CANDIDATE);
        let draw = |rng: &mut ChaCha8Rng| {
            let Cell { x, y } = grid.cell(backs.swap_remove(rng.random_range(0..backs.len())));
            let mut between = |[low, high]: [f32; 2]| rng.random_range(low..high);
            let (direction_deg, length_m) = (between(DIRECTIONS_DEG), between(LENGTH_M));
            let (pitch_deg, height_m) = (between(PITCHES_DEG), between(HEIGHT_M));
            let at = grid.cell_center(Cell { x, y });
            let (sin, cos) = direction_deg.to_radians().sin_cos();
            let start = [at.x - cos * STANDOFF_M, at.y - sin * STANDOFF_M, grid.origin[2] + height_m];
            let z = (height_m / grid.voxel_m) as u16;
            (Voxel { x, y, z }, Self { start, direction_deg, length_m, pitch_deg })
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
    fn intervention(&self, belief: &Belief, solid: &FloorPlan, _arm: &Arm, mut swept: VoxelSet) -> Intervention {
        let (grid, stroke) = (&belief.grid, self.stroke());
        let Some((first, target)) = self.target(solid, grid) else {
            return Intervention { swept, flow: Flow::nothing(), stroke };
        };
        let before = stroke.along(grid.cell_center(grid.cell(first)));
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
