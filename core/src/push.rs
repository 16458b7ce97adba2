//! Push candidates under a belief: frontier, sampling, collision checks.

use crate::belief::{Belief, SweptPush};
use crate::grid::Voxel;
use crate::rng::ChaCha8Rng;
use crate::tool::{Push, Tool};
use serde::{Deserialize, Serialize};

/// Occupancy probability from which a voxel is a high-confidence one.
pub const CONFIDENT: f32 = 0.85;

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
}

/// The first voxel with `p >= 0.85` seen from the shelf's entrance in every (x, z) column.
pub fn frontier(_belief: &Belief) -> Vec<Voxel> {
    todo!()
}

/// Draws `count` candidates, feasible and rejected ones, in the order drawn.
pub fn sample(_belief: &Belief, _tool: &Tool, _count: usize, _rng: &mut ChaCha8Rng) -> Vec<Candidate> {
    todo!()
}

const _: Option<Push> = None;
