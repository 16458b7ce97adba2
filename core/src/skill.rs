//! What the arm can do: skills, and the manipulations that they offer.
//!
//! A [`Skill`] is a kind of manipulation: it draws candidates from a belief, finds the arm's motion for one or the reason why
//! there is none, says what a belief update is to be told of it, and puts it into words and lines. Everybody else knows
//! [`Manipulation`] alone: the planner weighs them, the world and the robot carry out their [`PhasedMotion`]s, belief updates
//! see [`Intervention`]s, and whoever shows them prints what [`Skill::describe`] and [`Skill::outline`] say.
//!
//! A new skill is a module below this one and one line in the list below.

// First, so that its macro is there.
#[macro_use]
mod registry;

mod carried;
mod clearance;
mod counterfactual;
mod drag;
mod manipulation;
pub mod pick;
pub mod push;
mod rejection;
mod sampling;
mod shown;

pub use clearance::{AVOIDED, ArmClearance};
pub use counterfactual::{Counterfactual, PushTruth, REACH_DENSITY};
pub use manipulation::{SweptManipulation, intended, random_candidate};
pub use pick::{Pick, PickPlace};
pub use push::{Push, PushSampler};
pub use registry::SkillSet;
pub use rejection::{Rejection, Stage};
pub use shown::{Arrow, Description, Fact, Outline, Parameter, Unit};

use crate::arm::{Arm, ArmTool, Joints, PhasedMotion};
use crate::belief::{Belief, FloorPlan, Intervention};
use crate::grid::{Voxel, VoxelSet};
use crate::rng::ChaCha8Rng;
use crate::world::ManipulationOutcome;
use drag::Drag;
use serde::Serialize;

skills! {
    Push(Push): "push", "pushes", "pushes";
    Drag(Drag): "drag", "drags", "drags";
    Pick(Pick): "pick", "picks", "picks";
}

/// Occupancy probability from which a voxel counts as surely occupied (high confidence).
pub const CONFIDENT: f32 = 0.85;
/// Occupancy probability from which a voxel counts as likely occupied: more than that of an unknown voxel.
pub const LIKELY: f32 = 0.6;
/// At most this many draws are checked for each feasible candidate asked for: each takes the arm a while.
pub const DRAWS_PER_CANDIDATE: usize = 4;

/// What candidates are drawn from.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    /// The belief.
    pub belief: &'a Belief,
    /// What looks have seen, where only unseen voxels count.
    pub seen: Option<&'a VoxelSet>,
    /// The arm.
    pub arm: &'a ArmTool,
    /// Where pushes are drawn.
    pub sampler: PushSampler,
    /// Where what is picked is set down.
    pub place: PickPlace,
    /// Where a cup touched and did not seal, metres.
    pub unsealed: &'a [[f32; 3]],
}

/// One thing that the arm can do. The type that implements it is what there is to choose about one such manipulation.
pub trait Skill {
    /// Draws candidates until `count` of them are feasible or no more are worth trying; all of them, rejected ones too, in
    /// the order drawn. The result depends on what is given and on the stream alone, not on the number of threads.
    fn sample(ground: &Ground<'_>, count: usize, rng: &mut ChaCha8Rng) -> Vec<Candidate>
    where
        Self: Sized;

    /// Whether all its numbers are finite and its way is not negative.
    fn is_finite(&self) -> bool;

    /// The arm's motion for it, or why there is none. The same stream finds the same motion.
    fn plan(&self, clearance: &ArmClearance<'_>, rng: &mut ChaCha8Rng) -> Result<PhasedMotion, Rejection>;

    /// Whether a motion that begins at `ready` carries it out.
    fn is_done_by(&self, motion: &PhasedMotion, arm: &Arm, ready: &Joints) -> bool;

    /// What the gripper alone would sweep: for what the arm has no motion for.
    fn swept_by_gripper(&self, arm: &ArmTool, belief: &Belief) -> VoxelSet;

    /// What a belief update is told of it. `solid` holds the floor cells on which something stands
    /// ([`SOLID`](crate::belief::SOLID)), `swept` is what the arm sweeps until it turns back.
    fn intervention(&self, belief: &Belief, solid: &FloorPlan, swept: VoxelSet) -> Intervention;

    /// How far the tip is to move in contact, metres.
    fn way_m(&self) -> f32;

    /// The same as far as the arm came, when it was blocked after `way_m`.
    fn shortened(&self, way_m: f32) -> Manipulation;

    /// It as it was carried out: as far as the arm came.
    fn done(&self, outcome: &ManipulationOutcome) -> Manipulation {
        self.shortened(if outcome.stalled { outcome.way_m.min(self.way_m()) } else { self.way_m() })
    }

    /// It in words and numbers.
    fn describe(&self) -> Description;

    /// Its shape in the shelf's frame.
    fn outline(&self) -> Outline;
}

/// A drawn manipulation with where it came from and why it was rejected, if it was.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The voxel that it is aimed at: where something is to be touched.
    pub contact: Voxel,
    /// The manipulation.
    pub manipulation: Manipulation,
    /// What the arm sweeps on its way there and in contact; of a rejected one, what the gripper would in contact.
    pub swept: VoxelSet,
    /// `None` for a feasible candidate.
    pub rejection: Option<Rejection>,
    /// The arm's motion for a feasible candidate.
    pub motion: Option<PhasedMotion>,
}

impl Candidate {
    /// What a drawn manipulation came to.
    fn of(
        contact: Voxel,
        manipulation: Manipulation,
        motion: Result<PhasedMotion, Rejection>,
        belief: &Belief,
        arm: &ArmTool,
    ) -> Self {
        let swept = match &motion {
            Ok(motion) => motion.swept_volume(&arm.arm, &belief.grid),
            Err(_) => manipulation.skill().swept_by_gripper(arm, belief),
        };
        Self { contact, manipulation, swept, rejection: motion.as_ref().err().cloned(), motion: motion.ok() }
    }
}
