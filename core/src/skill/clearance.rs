//! Whether the arm can carry a straight contact out: it reaches the start, follows the line, and there is a free way there.
//!
//! The gripper points into the shelf, level or inclined, straight or turned a little ([`YAWS_DEG`]). For each turn and each
//! branch of the inverse: the start pose must be free, the line is followed without leaving the branch, then the arm
//! backs out of the shelf, straight or lifted first; where that is not free all the way, the planner looks for a way from
//! where the arm waits to where backing out ended. Contact is allowed only between the gripper and the object that is moved.

use super::{CONFIDENT, Rejection, Stage};
use crate::arm::{
    Arm, ArmTool, DistanceField, Follow, Frame, Hit, Joints, Obstacle, PhasedMotion, PlanSettings, Space, YAWS_DEG,
    follow_line, inclined_tool, plan, turned,
};
use crate::belief::{Belief, FloorPlan, OBJECT_RADIUS_M, Patch, beta_mean};
use crate::grid::{Cell, Grid, Voxel, VoxelSet};
use crate::rng::ChaCha8Rng;
use crate::{Point, Vector};
use nalgebra::{Point3, Translation3, Vector3};

/// How far before the shelf's front edge (y = 0) the finger tip must come for the arm to be out of it, metres.
const CLEARANCE_M: f32 = 0.02;
/// Occupancy probability above which the arm keeps away from a voxel.
pub const AVOIDED: f32 = 0.7;
/// Ways from the waiting place that the planner searches for, per manipulation, where none is straight.
const QUERIES: usize = 1;
/// Distance of the gripper's poses that are checked along a line, metres: two voxels of the standard grid.
const GRIPPER_STEP_M: f64 = 0.01;
/// Branches of the inverse that are tried per turn, those nearest to where the arm waits first.
const BRANCHES: usize = 3;
/// Ways in that are tried per manipulation.
const ATTEMPTS: usize = 3;
/// A query that only tries straight ways.
const STRAIGHT: PlanSettings = PlanSettings { rounds: 0, shortcuts: 0 };
/// Work of one query: what takes long to plan is what another manipulation can replace.
const QUERY: PlanSettings = PlanSettings { rounds: 40, shortcuts: 10 };

/// A straight contact that the arm is to carry out.
pub struct Approach<'a> {
    /// Poses of the tool at its start, those to be tried first first.
    pub poses: &'a [Frame],
    /// The way of the tip in contact, metres.
    pub travel: Vector3<f64>,
    /// How far the tool is drawn back along its own axis before it is drawn straight out of the shelf, metres.
    pub lift_m: f64,
    /// What the gripper may touch at the start and on the way out, if anything.
    pub touches: Option<&'a Patch>,
    /// What the gripper may touch in contact.
    pub target: &'a Patch,
}

/// The poses of the gripper with its tip at a place: pointing into the shelf, downwards by `pitch_rad`, and turned to
/// either side ([`YAWS_DEG`]).
pub fn gripper_poses(tip: &Point3<f64>, pitch_rad: f64) -> [Frame; YAWS_DEG.len()] {
    YAWS_DEG.map(|yaw| inclined_tool(tip, yaw.to_radians(), pitch_rad))
}

/// A belief prepared for checking many manipulations by an arm.
pub struct ArmClearance<'a> {
    tool: &'a ArmTool,
    grid: Grid,
    plan: FloorPlan,
    avoided: VoxelSet,
    field: DistanceField,
    confident: VoxelSet,
    confident_field: DistanceField,
    ready: Option<Joints>,
}

impl<'a> ArmClearance<'a> {
    /// Collects the voxels that the arm keeps away from and the distances to them.
    pub fn new(tool: &'a ArmTool, belief: &Belief) -> Self {
        let mut avoided = VoxelSet::empty(&belief.grid);
        let mut confident = VoxelSet::empty(&belief.grid);
        for (index, a) in belief.occupancy.iter().enumerate() {
            let probability = beta_mean(*a);
            if probability > AVOIDED {
                avoided.insert(index);
            }
            if probability >= CONFIDENT {
                confident.insert(index);
            }
        }
        let field = DistanceField::new(&belief.grid, &avoided);
        let confident_field = DistanceField::new(&belief.grid, &confident);
        let plan = FloorPlan::new(belief, AVOIDED);
        Self { tool, grid: belief.grid, plan, avoided, field, confident, confident_field, ready: tool.ready }
    }

    /// The object that a frontier voxel belongs to; the gripper may touch what stands on its cells.
    pub fn target(&self, frontier: Voxel) -> Patch {
        self.plan.patch(self.grid.cell_index(Cell { x: frontier.x, y: frontier.y }), OBJECT_RADIUS_M)
    }

    /// The object that the tip meets first on a straight way: the first cell over which something is believed to stand, as
    /// high as the tip; the cell `ahead_m` before the start where there is none.
    pub fn target_of(&self, start: Point, direction: Vector, length_m: f32, ahead_m: f32) -> Patch {
        let step = 0.5 * self.grid.voxel_m;
        let steps = (length_m / step).ceil() as usize;
        let track = (0..=steps).map(|i| start + direction * (step * i as f32));
        let met =
            track.filter_map(|point| self.grid.voxel_at(point)).find(|v| self.avoided.contains(self.grid.index(*v)));
        let ahead = start + direction * ahead_m;
        let voxel = met.or_else(|| self.grid.voxel_at(ahead)).unwrap_or(Voxel { x: 0, y: 0, z: 0 });
        self.target(voxel)
    }

    /// Where something stands that the arm keeps away from.
    pub fn plan(&self) -> &FloorPlan {
        &self.plan
    }

    /// The belief's grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The arm.
    pub fn tool(&self) -> &'a ArmTool {
        self.tool
    }

    /// The arm among what the belief is sure of.
    pub fn space(&self) -> Space<'_> {
        self.tool.space().with_map(&self.avoided, &self.field)
    }

    /// The arm's motion for a straight contact, or why there is none.
    ///
    /// The gripper may touch what it is allowed to and nothing else that the belief is sure of ([`CONFIDENT`]); that is asked first,
    /// since it does not depend on how the arm bends. All other links keep away from what is likely ([`AVOIDED`]). Of the
    /// turns and branches that fail, the one that came farthest gives the reason.
    pub fn motion(&self, approach: &Approach<'_>, rng: &mut ChaCha8Rng) -> Result<PhasedMotion, Rejection> {
        let Some(ready) = self.ready else { return Err(Rejection::Unreachable { stage: Stage::Start }) };
        let arm = &self.tool.arm;
        let space = self.space();
        let pushing = space.pushing();
        let Approach { poses, travel, lift_m, touches, target } = approach;
        let Some(tip) = poses.first().map(|pose| pose.translation.vector) else { return Err(Rejection::NoWay) };
        // Straight out of the shelf, and on until the tip is as far before it as where the arm waits.
        let least = tip.y + f64::from(CLEARANCE_M);
        let whole_out = least.max(tip.y - arm.world_from_tool(&ready).translation.y).max(0.0);
        let mut reason = Reason { depth: 0, rejection: Rejection::Unreachable { stage: Stage::Start } };
        let mut goals: Vec<Attempt> = Vec::new();
        for pose in poses.iter() {
            if let Some(hit) = self.gripper_hit(pose, &Vector3::zeros(), *touches).1 {
                reason.deeper(1, blocked(Stage::Start, hit));
                continue;
            }
            if let Some(hit) = self.gripper_hit(pose, travel, Some(*target)).1 {
                reason.deeper(2, blocked(Stage::Contact, hit));
                continue;
            }
            let lift = pose.rotation * Vector3::new(0.0, 0.0, -lift_m);
            let mut lifted = *pose;
            if *lift_m > 0.0 {
                if let Some(hit) = self.gripper_hit(pose, &lift, *touches).1 {
                    reason.deeper(2, blocked(Stage::WayIn, hit));
                    continue;
                }
                lifted.translation.vector += lift;
            }
            let out = (whole_out + lift.y).max(0.0);
            let (free, out_hit) = self.gripper_hit(&lifted, &Vector3::new(0.0, -out, 0.0), *touches);
            for start in arm.inverse(pose, &ready).into_iter().take(BRANCHES) {
                if goals.len() == ATTEMPTS {
                    break;
                }
                if let Some(hit) = pushing.hit(&start) {
                    reason.deeper(1, blocked(Stage::Start, hit));
                    continue;
                }
                let (line, hit) = self.follow(&pushing, &start, travel);
                if !line.complete {
                    let unreachable = Rejection::Unreachable { stage: Stage::Contact };
                    reason.deeper(2, hit.map_or(unreachable, |hit| blocked(Stage::Contact, hit)));
                    continue;
                }
                let (up, hit) = self.follow(&pushing, &start, &lift);
                let Some(top) = up.path.last().filter(|_| up.complete) else {
                    let unreachable = Rejection::Unreachable { stage: Stage::WayIn };
                    reason.deeper(2, hit.map_or(unreachable, |hit| blocked(Stage::WayIn, hit)));
                    continue;
                };
                let (mut back, hit) = self.follow(&pushing, top, &Vector3::new(0.0, -out * free, 0.0));
                drop(back.path.splice(0..1, up.path));
                let ended = back.path.last().map_or(tip.y, |last| arm.world_from_tool(last).translation.y);
                let is_out = tip.y - ended >= least - 1e-6;
                let hit = hit.or_else(|| out_hit.clone());
                let blocker = (!is_out).then(|| hit.map_or(Rejection::NoWay, |hit| blocked(Stage::WayIn, hit)));
                goals.push(Attempt { contact: line.path, chain: back.path, blocker });
                // A way that leads straight out and on is as good as it gets; the planner need not search for others.
                if is_out && let Some(motion) = self.finish(&space, &ready, &goals[goals.len() - 1..], STRAIGHT, rng) {
                    return Ok(motion);
                }
            }
        }
        goals.sort_by_key(|attempt| attempt.blocker.is_some());
        for attempt in goals.into_iter().take(QUERIES) {
            if let Some(motion) = self.finish(&space, &ready, &attempt.turned(arm), QUERY, rng) {
                return Ok(motion);
            }
            reason.deeper(3, attempt.blocker.unwrap_or(Rejection::NoWay));
        }
        Err(reason.rejection)
    }

    /// What the gripper meets that it may not touch when it is moved along `travel`, and the share of the way until there.
    fn gripper_hit(&self, from: &Frame, travel: &Vector3<f64>, touches: Option<&Patch>) -> (f64, Option<Hit>) {
        let height = self.grid.dims[2];
        let may_touch = |index: usize| touches.is_some_and(|patch| patch.contains(index / height));
        let blocks = |index: usize| self.confident.contains(index) && !may_touch(index);
        let steps = (travel.norm() / GRIPPER_STEP_M).ceil().max(1.0) as usize;
        let first = usize::from(travel.norm() > 0.0);
        for step in first..=steps {
            let share = step as f64 / steps as f64;
            let pose = Frame::from_parts(Translation3::from(from.translation.vector + travel * share), from.rotation);
            if let Some(index) = self.tool.arm.gripper_touches(&pose, &self.confident_field, blocks) {
                let at = self.grid.center(self.grid.voxel(index)).coords.into();
                let link = self.tool.arm.gripper_name().to_owned();
                return ((step - first) as f64 / steps as f64, Some(Hit { link, obstacle: Obstacle::Map { at } }));
            }
            if first == 0 {
                break;
            }
        }
        (1.0, None)
    }

    /// Follows a line as far as it is free; what stopped it, if something did.
    fn follow(&self, space: &Space<'_>, start: &Joints, travel: &Vector3<f64>) -> (Follow, Option<Hit>) {
        let mut hit = None;
        let follow = follow_line(&self.tool.arm, start, travel, |joints| {
            hit = space.hit(joints);
            hit.is_none()
        });
        (follow, hit)
    }

    /// A way from where the arm waits to the start of one of the attempts.
    fn finish(
        &self,
        space: &Space<'_>,
        ready: &Joints,
        attempts: &[Attempt],
        settings: PlanSettings,
        rng: &mut ChaCha8Rng,
    ) -> Option<PhasedMotion> {
        let chains: Vec<Vec<Joints>> = attempts.iter().map(|attempt| attempt.chain.clone()).collect();
        let planned = plan(space, ready, &chains, settings, rng)?;
        let start = planned.path.last()?;
        let attempt = attempts.iter().find(|attempt| attempt.contact.first() == Some(start))?;
        Some(PhasedMotion::new(&self.tool.arm, &planned.path, &attempt.contact))
    }
}

/// A contact that lacks its way in.
struct Attempt {
    /// Configurations in contact.
    contact: Vec<Joints>,
    /// Configurations from its start out of the shelf, as far as they are free.
    chain: Vec<Joints>,
    /// What kept it from backing out all the way.
    blocker: Option<Rejection>,
}

impl Attempt {
    /// The same contact, and the same with one joint turned by a whole turn.
    fn turned(&self, arm: &Arm) -> Vec<Self> {
        let whole: Vec<Joints> = self.chain.iter().chain(&self.contact).copied().collect();
        let split = |whole: Vec<Joints>| {
            let (chain, contact) = whole.split_at(self.chain.len());
            Self { contact: contact.to_vec(), chain: chain.to_vec(), blocker: self.blocker.clone() }
        };
        turned(arm, &whole).into_iter().map(split).collect()
    }
}

/// The reason of the attempt that came farthest.
struct Reason {
    depth: u8,
    rejection: Rejection,
}

impl Reason {
    fn deeper(&mut self, depth: u8, rejection: Rejection) {
        if depth > self.depth {
            *self = Self { depth, rejection };
        }
    }
}

fn blocked(stage: Stage, hit: Hit) -> Rejection {
    Rejection::ArmBlocked { stage, hit }
}
