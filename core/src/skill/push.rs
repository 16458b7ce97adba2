//! Pushes: the closed gripper goes straight in and then along a line.
//!
//! Where candidates come from is a choice, [`PushSampler`]. All start [`STANDOFF_M`] before a point of contact, at the
//! tool's height [`TOOL_HEIGHT_M`] above the board, and are 50 to 150 mm long. A candidate is feasible if the arm has a motion
//! for it that touches neither the shelf nor what is believed to stand there, the target apart; see [`ArmClearance`].
//!
//! * From the frontier, as in the paper (which leaves distances and probabilities open): that is the first surely occupied
//!   voxel ([`CONFIDENT`]) seen from the shelf's entrance in each (x, z) column. A push starts before a random point of it and goes towards a random likely occupied voxel
//!   within [`REACH_M`] of the point, never back towards the entrance.
//! * Before hidden space: a contact may be at the front or a side of what surely stands at the tool's height. A contact
//!   is the more likely the more unseen space lies behind it. Its direction is random among those that leave room for
//!   the tip before the contact, from -20 to 200 degrees (90 is straight in).

mod frontier;
mod hidden;
mod line;

pub use frontier::frontier;
pub use line::Push;

use super::carried::carried_along;
use super::clearance::{Approach, gripper_poses};
use super::sampling::draw_until;
use super::{
    ArmClearance, CONFIDENT, Candidate, DRAWS_PER_CANDIDATE, Description, Ground, LIKELY, Manipulation, Outline,
    Rejection, Skill, SkillKind,
};
use crate::arm::{Arm, ArmTool, Joints, PhasedMotion, level_tool};
use crate::belief::{Belief, FloorPlan, Intervention, Patch};
use crate::grid::{Voxel, VoxelSet};
use crate::named;
use crate::rng::ChaCha8Rng;
use frontier::{Frontier, start_of};
use hidden::Contacts;
use serde::{Deserialize, Serialize};

/// How far before the frontier point the tip starts, metres.
pub const STANDOFF_M: f32 = 0.02;
/// Height of the tip above the board, metres.
pub const TOOL_HEIGHT_M: f32 = 0.06;
/// How far from the frontier point the voxel may be that gives the direction, metres.
pub const REACH_M: f32 = 0.06;
/// Shortest and longest push, metres.
pub const LENGTH_M: [f32; 2] = [0.05, 0.15];
/// A push and the voxels that the arm sweeps with it.
#[derive(Clone, Debug)]
pub struct SweptPush {
    /// The push.
    pub push: Push,
    /// Every voxel that gripper or links touch, approach included.
    pub swept: VoxelSet,
}

impl SweptPush {
    /// What a belief update is told of it; `solid` holds the floor cells on which something stands
    /// ([`SOLID`](crate::belief::SOLID)).
    pub fn intervention(&self, belief: &Belief, solid: &FloorPlan) -> Intervention {
        let (stroke, swept) = (self.push.stroke(), self.swept.clone());
        Intervention { flow: carried_along(belief, solid, &swept, &stroke), swept, stroke }
    }
}

impl Push {
    /// The arm's motion for it against `target`, or why there is none.
    pub fn motion(
        &self,
        clearance: &ArmClearance<'_>,
        target: &Patch,
        rng: &mut ChaCha8Rng,
    ) -> Result<PhasedMotion, Rejection> {
        let tip = self.start_point().map(f64::from);
        let approach = Approach {
            poses: &gripper_poses(&tip, 0.0),
            travel: self.direction().map(f64::from) * f64::from(self.length_m),
            lift_m: 0.0,
            touches: Some(target),
            target,
        };
        clearance.motion(&approach, rng)
    }
}

impl Skill for Push {
    fn sample(ground: &Ground<'_>, count: usize, rng: &mut ChaCha8Rng) -> Vec<Candidate> {
        sample(ground.sampler, ground.belief, ground.seen, ground.arm, count, rng)
    }

    fn is_finite(&self) -> bool {
        let numbers = [self.start[0], self.start[1], self.start[2], self.direction_deg, self.length_m];
        numbers.iter().all(|number| number.is_finite()) && self.length_m >= 0.0
    }

    fn plan(&self, clearance: &ArmClearance<'_>, rng: &mut ChaCha8Rng) -> Result<PhasedMotion, Rejection> {
        self.motion(
            clearance,
            &clearance.target_of(self.start_point(), self.direction(), self.length_m, STANDOFF_M),
            rng,
        )
    }

    fn is_done_by(&self, motion: &PhasedMotion, arm: &Arm, ready: &Joints) -> bool {
        motion.leads(arm, ready, self.start_point(), self.end_point())
    }

    fn swept_by_gripper(&self, arm: &ArmTool, belief: &Belief) -> VoxelSet {
        let mut swept = VoxelSet::empty(&belief.grid);
        let travel = self.direction().map(f64::from) * f64::from(self.length_m);
        let start = level_tool(&self.start_point().map(f64::from), 0.0);
        arm.arm.sweep_gripper(&start, &travel, &belief.grid, &mut swept);
        swept
    }

    fn intervention(&self, belief: &Belief, solid: &FloorPlan, swept: VoxelSet) -> Intervention {
        SweptPush { push: *self, swept }.intervention(belief, solid)
    }

    fn way_m(&self) -> f32 {
        self.length_m
    }

    fn shortened(&self, way_m: f32) -> Manipulation {
        Self { length_m: way_m, ..*self }.into()
    }

    fn describe(&self) -> Description {
        Description::of_line(SkillKind::Push.name(), self.start, self.direction_deg, self.length_m)
    }

    fn outline(&self) -> Outline {
        Outline { arrows: vec![self.arrow()], lines: Vec::new() }
    }
}

/// Where push candidates come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PushSampler {
    /// From the frontier into the shelf, as in the paper.
    #[default]
    Frontier,
    /// At the front or a side of objects before unseen space.
    Hidden,
}

impl PushSampler {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Frontier, Self::Hidden];
}

impl std::fmt::Display for PushSampler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Frontier => "frontier",
            Self::Hidden => "hidden",
        })
    }
}

impl std::str::FromStr for PushSampler {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        named::parse(&Self::ALL, text)
    }
}

/// A sampler prepared for a belief.
enum Source<'a> {
    Frontier(Frontier<'a>),
    Hidden(Contacts),
}

impl<'a> Source<'a> {
    fn new(sampler: PushSampler, belief: &'a Belief, seen: Option<&VoxelSet>) -> Self {
        match sampler {
            PushSampler::Frontier => Self::Frontier(Frontier::new(belief)),
            PushSampler::Hidden => Self::Hidden(Contacts::new(belief, seen)),
        }
    }

    /// How often may be drawn for `count` feasible candidates.
    fn draws(&self, count: usize) -> usize {
        let most = count * DRAWS_PER_CANDIDATE;
        match self {
            Self::Frontier(frontier) => frontier.left().min(most),
            Self::Hidden(contacts) if contacts.is_empty() => 0,
            Self::Hidden(_) => most,
        }
    }

    /// The next draw, of no more than there are: a point of contact, and the push against it if there is one.
    fn draw(&mut self, rng: &mut ChaCha8Rng) -> (Voxel, Option<Push>) {
        match self {
            Self::Frontier(frontier) => frontier.draw(rng),
            Self::Hidden(contacts) => contacts.draw(rng),
        }
    }
}

/// Draws candidates until `count` of them are feasible, and returns all of them, rejected ones too, in the order drawn.
///
/// Frontier points are drawn without replacement, contacts before what no look has `seen` with it. Drawing ends early when
/// there are no more of them or after [`DRAWS_PER_CANDIDATE`] times `count`, so that there may be fewer feasible candidates
/// than asked for, or none. The result depends on what is given and on the stream alone, not on the number of threads.
pub fn sample(
    sampler: PushSampler,
    belief: &Belief,
    seen: Option<&VoxelSet>,
    arm: &ArmTool,
    count: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<Candidate> {
    let clearance = ArmClearance::new(arm, belief);
    let mut source = Source::new(sampler, belief, seen);
    let draws = source.draws(count);
    draw_until(
        count,
        draws,
        rng,
        |rng| source.draw(rng),
        |(point, push), rng| candidate(belief, &clearance, rng, point, push),
    )
}

/// Checks a drawn push. One without a target is kept as the straight push that it would have been.
fn candidate(
    belief: &Belief,
    clearance: &ArmClearance<'_>,
    rng: &mut ChaCha8Rng,
    contact: Voxel,
    drawn: Option<Push>,
) -> Candidate {
    let aimless = Push { start: start_of(belief, contact), direction_deg: 90.0, length_m: LENGTH_M[0] };
    let push = drawn.unwrap_or(aimless);
    let motion = match drawn {
        Some(_) => push.motion(clearance, &clearance.target(contact), rng),
        None => Err(Rejection::NoTarget),
    };
    Candidate::of(contact, push.into(), motion, belief, clearance.tool())
}

#[cfg(test)]
mod tests;
