//! What the map gains by pushes and looks: the best three looks without a push, and pushes with the best two looks after each.

use super::considered::Considered;
use super::rollout::Rollout;
use super::state::MapScores;
use crate::belief::Belief;
use crate::score::Scores;
use crate::skill::PushTruth;
use crate::world::{TruthMap, World};

/// Actions that are compared: looks, or a push and looks.
const ACTIONS: usize = 3;

/// How good a map of a world is.
pub(super) fn scores(belief: &Belief, world: &World) -> MapScores {
    let scores = Scores::of(belief, &TruthMap::of(&belief.grid, &world.bodies()));
    MapScores { occupancy_iou: scores.occupancy_iou as f32, semantic_miou: scores.semantic_miou as f32 }
}

/// How good the map is after three looks.
pub(super) fn after_looks(rollout: &Rollout<'_>) -> MapScores {
    let mut branch = rollout.clone();
    (0..ACTIONS).for_each(|_| branch.look_best());
    scores(&branch.belief, &branch.world)
}

/// How good the map is after a push and two looks, against where the objects stand then.
pub(super) fn after_push(rollout: &Rollout<'_>, considered: &Considered, at: usize) -> MapScores {
    let mut branch = rollout.clone();
    branch.make(considered, at);
    (1..ACTIONS).for_each(|_| branch.look_best());
    scores(&branch.belief, &branch.world)
}

/// The pushes that are followed: the one that promises most, the one that really brings most (objects, then space), and the
/// first one, which is as good as any.
pub(super) fn followed(considered: &Considered, truths: &[PushTruth]) -> Vec<usize> {
    let worth = |at: usize| (truths[at].balance(), truths[at].opened.len());
    let brings_most = (0..truths.len()).rev().max_by_key(|at| worth(*at));
    let mut followed: Vec<usize> = considered.best().into_iter().chain(brings_most).chain([0]).collect();
    followed.retain(|at| *at < truths.len());
    followed.sort_unstable();
    followed.dedup();
    followed
}
