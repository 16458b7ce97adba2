//! What can be asked of a manipulation of any skill.

use super::{ArmClearance, Candidate, Ground, Manipulation, SkillSet};
use crate::arm::{Arm, ArmTool};
use crate::belief::{Belief, FloorPlan, Intervention, SOLID};
use crate::grid::{Grid, VoxelSet};
use crate::rng::stream;
use crate::world::ManipulationOutcome;
use rand::Rng;

/// A manipulation and the voxels that the arm sweeps with it: all that a belief update's [`Intervention`] is made of, in
/// whatever belief.
#[derive(Clone, Debug, PartialEq)]
pub struct SweptManipulation {
    /// The manipulation.
    pub manipulation: Manipulation,
    /// Every voxel that gripper or links touch, approach included.
    pub swept: VoxelSet,
}

impl SweptManipulation {
    /// What a belief update is told of it in a belief.
    pub fn intervention(&self, belief: &Belief) -> Intervention {
        let solid = FloorPlan::new(belief, SOLID);
        self.manipulation.skill().intervention(belief, &solid, self.swept.clone())
    }
}

impl Manipulation {
    /// It as far as the arm really came, with what the arm swept until then.
    pub fn done(&self, outcome: &ManipulationOutcome, arm: &Arm, grid: &Grid) -> SweptManipulation {
        let mut swept = VoxelSet::empty(grid);
        arm.sweep(&outcome.passed, grid, &mut swept);
        let skill = self.skill();
        let way_m = if outcome.stalled { outcome.way_m.min(skill.way_m()) } else { skill.way_m() };
        SweptManipulation { manipulation: skill.shortened(way_m), swept }
    }
}

/// What a belief update would be told of a manipulation that a person proposes: by the arm's motion for it, or by the
/// gripper alone where the arm cannot carry it out.
pub fn intended(arm: &ArmTool, belief: &Belief, manipulation: &Manipulation) -> Intervention {
    let (skill, clearance) = (manipulation.skill(), ArmClearance::new(arm, belief));
    let swept = match skill.plan(&clearance, &mut stream(0, "push to look at", 0)) {
        Ok(motion) => motion.swept_volume(&arm.arm, &belief.grid),
        Err(_) => skill.swept_by_gripper(arm, belief),
    };
    skill.intervention(belief, &FloorPlan::new(belief, SOLID), swept)
}

/// Draws one feasible manipulation at random, each of the skills as likely as the other, with those that were rejected on
/// the way; `actions` is the number of actions so far.
pub fn random_candidate(skills: SkillSet, ground: &Ground<'_>, seed: u64, actions: usize) -> Vec<Candidate> {
    let mut kinds: Vec<_> = skills.kinds().collect();
    let mut drawn = Vec::new();
    let mut choice = stream(seed, "skills", actions as u64);
    while !kinds.is_empty() {
        let kind = kinds.swap_remove(choice.random_range(0..kinds.len()));
        drawn.extend(kind.sample(ground, 1, &mut stream(seed, kind.stream(), actions as u64)));
        if drawn.last().is_some_and(|candidate| candidate.rejection.is_none()) {
            break;
        }
    }
    drawn
}
