//! Push candidates under a belief: frontier, sampling, collision checks.
//!
//! The frontier is the first surely occupied voxel ([`CONFIDENT`]) seen from the shelf's entrance in each (x, z) column.
//! A candidate starts [`STANDOFF_M`] before a random frontier point, at the tool's height [`TOOL_HEIGHT_M`] above the
//! board, goes towards a random likely occupied voxel within [`REACH_M`] of the point, never back towards the entrance
//! (that would pull objects over the edge), and is 50 to 150 mm long. It is feasible if the tool touches neither the
//! shelf nor a confident voxel that is not the target's, all the way in and along the push; see [`Clearance`].

mod by_arm;
mod clearance;
mod frontier;

pub use by_arm::{AVOIDED, ArmClearance};
pub use clearance::Clearance;
pub use frontier::frontier;

use crate::arm::{Hit, Obstacle, PushMotion, Pusher};
use crate::belief::{Belief, SweptPush};
use crate::grid::{Voxel, VoxelSet};
use crate::rng::{ChaCha8Rng, stream};
use crate::tool::{Push, Tool};
use frontier::likely_targets;
use rand::Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Occupancy probability from which a voxel is a high-confidence one.
pub const CONFIDENT: f32 = 0.85;
/// Occupancy probability from which a voxel is a likely one: more than a voxel that nothing is known of.
pub const LIKELY: f32 = 0.6;
/// How far before the frontier point the tip starts, metres.
pub const STANDOFF_M: f32 = 0.02;
/// Height of the tip above the board, metres.
pub const TOOL_HEIGHT_M: f32 = 0.06;
/// How far from the frontier point the voxel may be that gives the direction, metres.
pub const REACH_M: f32 = 0.06;
/// Shortest and longest push, metres.
pub const LENGTH_M: [f32; 2] = [0.05, 0.15];
/// At most this many frontier points are tried for each feasible candidate asked for.
pub const DRAWS_PER_CANDIDATE: usize = 10;
/// The same where an arm pushes: each takes longer to check, and more of them fail.
pub const ARM_DRAWS_PER_CANDIDATE: usize = 4;

/// Why a candidate is no candidate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Rejection {
    /// No likely occupied voxel within reach of the frontier point.
    NoTarget,
    /// The tool's start pose touches a high-confidence voxel.
    StartBlocked {
        /// Centre of the first such voxel, metres.
        at: [f32; 3],
    },
    /// The way in or the push touches a high-confidence voxel that is not the target's.
    PathBlocked {
        /// Centre of the first such voxel, metres.
        at: [f32; 3],
    },
    /// The tool would touch board, walls or ceiling.
    Shelf,
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
    /// The arm could be there, but no way from where it waits was found.
    NoWay,
}

impl Rejection {
    /// The reason without the place: for counting what keeps pushes from being candidates.
    pub fn kind_words(&self) -> String {
        match self {
            Self::StartBlocked { .. } => "the start is blocked by what is believed to stand there".to_owned(),
            Self::PathBlocked { .. } => "the path is blocked by what is believed to stand there".to_owned(),
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
            Self::StartBlocked { at: [x, y, z] } => {
                write!(f, "the start is blocked by what is believed to stand at ({x:.3}, {y:.3}, {z:.3})")
            }
            Self::PathBlocked { at: [x, y, z] } => {
                write!(f, "the path is blocked by what is believed to stand at ({x:.3}, {y:.3}, {z:.3})")
            }
            Self::Shelf => write!(f, "the tool would touch the shelf"),
            Self::Unreachable { stage } => write!(f, "out of the arm's reach {stage}"),
            Self::ArmBlocked { stage, hit } => write!(f, "{stage}, {hit}"),
            Self::NoWay => write!(f, "no free way to the start was found"),
        }
    }
}

/// A sampled push with where it came from and why it was rejected, if it was.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The frontier voxel it starts from.
    pub frontier: Voxel,
    /// The push and what it sweeps.
    pub swept: SweptPush,
    /// `None` for a feasible candidate.
    pub rejection: Option<Rejection>,
    /// The arm's motion for a feasible candidate, when an arm pushes.
    pub motion: Option<PushMotion>,
}

/// Draws candidates for a tool that needs no arm; as [`sample_by`].
pub fn sample(belief: &Belief, tool: &Tool, count: usize, rng: &mut ChaCha8Rng) -> Vec<Candidate> {
    sample_checked(belief, &Check::Free { tool, clearance: Clearance::new(belief) }, count, rng)
}

/// Draws candidates until `count` of them are feasible, and returns all of them, rejected ones too, in the order drawn.
///
/// Frontier points are drawn without replacement. Drawing ends early when there are no more of them or after
/// [`DRAWS_PER_CANDIDATE`] times `count`, so that there may be fewer feasible candidates than asked for, or none. The
/// result depends on the belief and on the stream alone, not on the number of threads.
pub fn sample_by(belief: &Belief, pusher: &Pusher, count: usize, rng: &mut ChaCha8Rng) -> Vec<Candidate> {
    match pusher {
        Pusher::Free(tool) => sample(belief, tool, count, rng),
        Pusher::Arm(arm) => {
            let check = Check::Arm {
                // What a rejected candidate would have swept is shown with the free tool's shape.
                tool: Tool::standard(),
                arm: ArmClearance::new(arm, belief),
                seed: rng.random(),
            };
            sample_checked(belief, &check, count, rng)
        }
    }
}

/// What a push that a person thinks of would sweep: by the arm's motion for it, or in the shape of the free tool where
/// there is no arm or it cannot carry the push out.
pub fn swept_by(pusher: &Pusher, belief: &Belief, push: &Push) -> VoxelSet {
    let motion = pusher.arm().and_then(|arm| {
        let clearance = ArmClearance::new(arm, belief);
        clearance.motion(push, &clearance.target_of(push), &mut stream(0, "push to look at", 0)).ok()
    });
    match (pusher, motion) {
        (Pusher::Arm(arm), Some(motion)) => motion.swept_volume(&arm.arm, &belief.grid),
        (Pusher::Free(tool), _) => tool.swept_volume(push, &belief.grid),
        (Pusher::Arm(_), None) => Tool::standard().swept_volume(push, &belief.grid),
    }
}

/// How candidates are checked.
#[allow(clippy::large_enum_variant, reason = "there is one of it at a time, on the stack of one call")]
enum Check<'a> {
    Free { tool: &'a Tool, clearance: Clearance },
    Arm { tool: Tool, arm: ArmClearance<'a>, seed: u64 },
}

impl Check<'_> {
    /// How many frontier points are tried for each feasible candidate asked for.
    fn draws_per_candidate(&self) -> usize {
        match self {
            Self::Free { .. } => DRAWS_PER_CANDIDATE,
            Self::Arm { .. } => ARM_DRAWS_PER_CANDIDATE,
        }
    }

    /// The tool whose shape a rejected candidate is shown with.
    fn tool(&self) -> &Tool {
        match self {
            Self::Free { tool, .. } => tool,
            Self::Arm { tool, .. } => tool,
        }
    }
}

fn sample_checked(belief: &Belief, check: &Check<'_>, count: usize, rng: &mut ChaCha8Rng) -> Vec<Candidate> {
    /// Draws that are checked together; fixed, so that it never matters who checks them.
    const BATCH: usize = 32;
    let mut points = frontier(belief);
    let draws = points.len().min(count * check.draws_per_candidate());
    let mut candidates = Vec::new();
    let mut feasible = 0;
    for first in (0..draws).step_by(BATCH) {
        if feasible == count {
            break;
        }
        let drawn: Vec<(u64, Voxel, Option<Push>)> = (first..draws.min(first + BATCH))
            .map(|i| {
                let j = rng.random_range(i..points.len());
                points.swap(i, j);
                (i as u64, points[i], draw_push(belief, points[i], rng))
            })
            .collect();
        let checked: Vec<Candidate> =
            drawn.into_par_iter().map(|(number, point, push)| candidate(belief, check, number, point, push)).collect();
        for candidate in checked {
            if feasible < count {
                feasible += usize::from(candidate.rejection.is_none());
                candidates.push(candidate);
            }
        }
    }
    candidates
}

/// Where a push from a frontier point starts: before the point, at the tool's height.
fn start_of(belief: &Belief, frontier: Voxel) -> [f32; 3] {
    let point = belief.grid.center(frontier);
    [point.x, point.y - STANDOFF_M, belief.grid.origin[2] + TOOL_HEIGHT_M]
}

/// A push from a frontier point towards something likely; `None` when nothing likely is near. Always draws as much.
fn draw_push(belief: &Belief, frontier: Voxel, rng: &mut ChaCha8Rng) -> Option<Push> {
    let (which, length_m) = (rng.random::<f64>(), rng.random_range(LENGTH_M[0]..LENGTH_M[1]));
    let start = start_of(belief, frontier);
    let targets = likely_targets(belief, frontier, start[1]);
    let target = belief.grid.center(*targets.get((which * targets.len() as f64) as usize)?);
    let direction_deg = (target.y - start[1]).atan2(target.x - start[0]).to_degrees();
    Some(Push { start, direction_deg, length_m })
}

/// Checks a drawn push. One without a target is kept as the straight push that it would have been.
fn candidate(belief: &Belief, check: &Check<'_>, number: u64, frontier: Voxel, push: Option<Push>) -> Candidate {
    let aimless = Push { start: start_of(belief, frontier), direction_deg: 90.0, length_m: LENGTH_M[0] };
    let straight = push.unwrap_or(aimless);
    let of = |swept, rejection, motion| Candidate {
        frontier,
        swept: SweptPush { push: straight, swept },
        rejection,
        motion,
    };
    match (check, push) {
        (check, None) => of(check.tool().swept_volume(&straight, &belief.grid), Some(Rejection::NoTarget), None),
        (Check::Free { tool, clearance }, Some(push)) => {
            let swept = tool.swept_volume(&push, &belief.grid);
            let rejection = clearance.check(tool, &push, &swept, &clearance.target(frontier));
            of(swept, rejection, None)
        }
        (Check::Arm { tool, arm, seed }, Some(push)) => {
            let mut rng = stream(*seed, "arm", number);
            match arm.motion(&push, &arm.target(frontier), &mut rng) {
                Ok(motion) => of(motion.swept_volume(arm.arm(), &belief.grid), None, Some(motion)),
                Err(rejection) => of(tool.swept_volume(&push, &belief.grid), Some(rejection), None),
            }
        }
    }
}

#[cfg(test)]
mod tests;
