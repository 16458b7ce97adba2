//! Push candidates under a belief: sampling and collision checks.
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

mod clearance;
mod counterfactual;
mod frontier;
mod hidden;

pub use clearance::{AVOIDED, ArmClearance};
pub use counterfactual::{Counterfactual, PushTruth, REACH_DENSITY};
pub use frontier::frontier;

use crate::arm::{ArmTool, Hit, Obstacle, Push, PushMotion, level_tool};
use crate::belief::{Belief, SweptPush};
use crate::grid::{Grid, Voxel, VoxelSet};
use crate::named;
use crate::rng::{ChaCha8Rng, stream};
use frontier::{Frontier, start_of};
use hidden::Contacts;
use rand::Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Occupancy probability from which a voxel counts as surely occupied (high confidence).
pub const CONFIDENT: f32 = 0.85;
/// Occupancy probability from which a voxel counts as likely occupied: more than that of an unknown voxel.
pub const LIKELY: f32 = 0.6;
/// How far before the frontier point the tip starts, metres.
pub const STANDOFF_M: f32 = 0.02;
/// Height of the tip above the board, metres.
pub const TOOL_HEIGHT_M: f32 = 0.06;
/// How far from the frontier point the voxel may be that gives the direction, metres.
pub const REACH_M: f32 = 0.06;
/// Shortest and longest push, metres.
pub const LENGTH_M: [f32; 2] = [0.05, 0.15];
/// At most this many frontier points are tried for each feasible candidate asked for: each takes the arm a while to
/// check.
pub const DRAWS_PER_CANDIDATE: usize = 4;

/// Why a sampled push is not feasible.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Rejection {
    /// No likely occupied voxel within reach of the frontier point.
    NoTarget,
    /// The arm does not reach, in any of its configurations.
    Unreachable {
        /// Which part of the push.
        stage: Stage,
    },
    /// The arm reaches, but something is in its way.
    ArmBlocked {
        /// On which part of the push.
        stage: Stage,
        /// What meets what.
        #[serde(flatten)]
        hit: Hit,
    },
    /// The arm could be there, but no path from the waiting configuration was found.
    NoWay,
}

impl Rejection {
    /// The reason without the place: for counting what keeps pushes from being candidates.
    pub fn kind_words(&self) -> String {
        match self {
            Self::ArmBlocked { stage, hit } => {
                let met = match &hit.obstacle {
                    Obstacle::Map { .. } => "what is believed to stand there".to_owned(),
                    Obstacle::Shelf { panel } => format!("the shelf's {panel}"),
                    Obstacle::Table => "the table".to_owned(),
                    Obstacle::Arm { link } => format!("the arm's own {link}"),
                };
                format!("{stage}, {} would meet {met}", hit.link)
            }
            other => other.to_string(),
        }
    }
}

/// A part of a push.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// The pose in which it starts.
    Start,
    /// The way to the start.
    WayIn,
    /// The push itself.
    Push,
}

impl std::fmt::Display for Stage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Start => "at the start",
            Self::WayIn => "on the way in",
            Self::Push => "along the push",
        })
    }
}

impl std::fmt::Display for Rejection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoTarget => write!(f, "nothing likely to push is near"),
            Self::Unreachable { stage } => write!(f, "out of the arm's reach {stage}"),
            Self::ArmBlocked { stage, hit } => write!(f, "{stage}, {hit}"),
            Self::NoWay => write!(f, "no free way to the start was found"),
        }
    }
}

/// A sampled push with where it came from and why it was rejected, if it was.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The voxel that it is aimed at: of the frontier, or where something is to be touched.
    pub contact: Voxel,
    /// The push and what the arm sweeps on its way there and along it; of a rejected one, what the gripper would along it.
    pub swept: SweptPush,
    /// `None` for a feasible candidate.
    pub rejection: Option<Rejection>,
    /// The arm's motion for a feasible candidate.
    pub motion: Option<PushMotion>,
}

/// The voxels that a push proposed by a person would sweep: by the arm's motion for it, or by the gripper alone where
/// the arm cannot carry it out.
pub fn swept_by(arm: &ArmTool, belief: &Belief, push: &Push) -> VoxelSet {
    let clearance = ArmClearance::new(arm, belief);
    match clearance.motion(push, &clearance.target_of(push), &mut stream(0, "push to look at", 0)) {
        Ok(motion) => motion.swept_volume(&arm.arm, &belief.grid),
        Err(_) => gripper_along(arm, push, &belief.grid),
    }
}

/// Every voxel that the gripper touches along a push when it points straight into the shelf.
fn gripper_along(arm: &ArmTool, push: &Push, grid: &Grid) -> VoxelSet {
    let mut swept = VoxelSet::empty(grid);
    let travel = push.direction().map(f64::from) * f64::from(push.length_m);
    arm.arm.sweep_gripper(&level_tool(&push.start_point().map(f64::from), 0.0), &travel, grid, &mut swept);
    swept
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
    /// Draws that are checked together; fixed, so that it never matters who checks them.
    const BATCH: usize = 32;
    let (seed, clearance) = (rng.random(), ArmClearance::new(arm, belief));
    let mut source = Source::new(sampler, belief, seen);
    let draws = source.draws(count);
    let mut candidates = Vec::new();
    let mut feasible = 0;
    for first in (0..draws).step_by(BATCH) {
        if feasible == count {
            break;
        }
        let drawn: Vec<(u64, Voxel, Option<Push>)> = (first..draws.min(first + BATCH))
            .map(|number| {
                let (point, push) = source.draw(rng);
                (number as u64, point, push)
            })
            .collect();
        let checked: Vec<Candidate> = drawn
            .into_par_iter()
            .map(|(number, point, push)| candidate(belief, &clearance, stream(seed, "arm", number), point, push))
            .collect();
        for candidate in checked {
            if feasible < count {
                feasible += usize::from(candidate.rejection.is_none());
                candidates.push(candidate);
            }
        }
    }
    candidates
}

/// Checks a drawn push. One without a target is kept as the straight push that it would have been.
fn candidate(
    belief: &Belief,
    clearance: &ArmClearance<'_>,
    mut rng: ChaCha8Rng,
    contact: Voxel,
    drawn: Option<Push>,
) -> Candidate {
    let aimless = Push { start: start_of(belief, contact), direction_deg: 90.0, length_m: LENGTH_M[0] };
    let push = drawn.unwrap_or(aimless);
    let motion = match drawn {
        Some(_) => clearance.motion(&push, &clearance.target(contact), &mut rng),
        None => Err(Rejection::NoTarget),
    };
    let arm = clearance.tool();
    let swept = match &motion {
        Ok(motion) => motion.swept_volume(&arm.arm, &belief.grid),
        Err(_) => gripper_along(arm, &push, &belief.grid),
    };
    let swept = SweptPush { push, swept };
    Candidate { contact, swept, rejection: motion.as_ref().err().cloned(), motion: motion.ok() }
}

#[cfg(test)]
mod tests;
