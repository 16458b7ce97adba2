//! Collision-free paths: straight if that is free, else by two trees that grow towards each other (RRT-Connect), then
//! shortened.

use super::Joints;
use super::line::follow_line;
use super::model::{Arm, JointKind};
use super::rrt::Trees;
use super::segment::{Probe, is_span_free};
use super::shortcut::shortcut;
use super::space::Space;
use crate::rng::ChaCha8Rng;
use std::f64::consts::TAU;

/// How much work a planning query may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanSettings {
    /// Rounds of the trees, each one extension and one attempt to connect, before the query is given up.
    pub rounds: usize,
    /// Attempts to shorten what was found.
    pub shortcuts: usize,
}

impl Default for PlanSettings {
    fn default() -> Self {
        Self { rounds: 1500, shortcuts: 40 }
    }
}

/// A path that was found.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Configurations from the start to the goal, straight in between.
    pub path: Vec<Joints>,
    /// Rounds that the trees took; 0 when the straight path was free.
    pub rounds: usize,
}

/// A collision-free path from `start` to one of `goals`, or `None` when there is none or it was not found in time.
///
/// Each goal is a chain: its first configuration is the goal, and from any later one the chain back to the goal is
/// known to be free (an arm backs out of a shelf along the path by which it would go in). The same stream finds the
/// same path.
pub fn plan(
    space: &Space<'_>,
    start: &Joints,
    goals: &[Vec<Joints>],
    settings: PlanSettings,
    rng: &mut ChaCha8Rng,
) -> Option<Planned> {
    let from = Probe::free(space, start).filter(|_| space.arm.within_limits(start))?;
    // Straight to a goal, or to where its chain ends.
    for chain in goals {
        let (Some(goal), Some(last)) = (chain.first(), chain.last()) else { continue };
        if Probe::free(space, last).is_some_and(|last| is_span_free(space, &from, &last)) {
            let path: Vec<Joints> = std::iter::once(*start).chain(chain.iter().rev().copied()).collect();
            return Some(Planned { path: shortcut(space, path, settings.shortcuts, rng), rounds: 0 });
        }
        if chain.len() > 1 && Probe::free(space, goal).is_some_and(|goal| is_span_free(space, &from, &goal)) {
            return Some(Planned { path: vec![*start, *goal], rounds: 0 });
        }
    }
    let mut trees = Trees::new(space, start, goals);
    let path = trees.connect(settings.rounds, rng)?;
    Some(Planned { path: shortcut(space, path, settings.shortcuts, rng), rounds: trees.rounds() })
}

/// A goal as a chain for [`plan`]: the configuration, then the tool drawn straight back as far as that is free, at most
/// `out_m` metres: out of the shelf or along the tool's own axis, whichever leads farther.
pub fn retreat(space: &Space<'_>, goal: &Joints, out_m: f64) -> Vec<Joints> {
    let axis = space.arm.world_from_tool(goal).rotation * nalgebra::Vector3::z();
    let back = |way: nalgebra::Vector3<f64>| follow_line(space.arm, goal, &(way * out_m), |q| space.is_free(q)).path;
    let (straight, own) = (back(-nalgebra::Vector3::y()), back(-axis));
    if own.len() > straight.len() { own } else { straight }
}

/// The same chain and what is the same to the eye: one turning joint turned by a whole turn, where its limits allow that.
/// Some places are reached one way round only, because the arm would meet itself on the other.
pub fn turned(arm: &Arm, chain: &[Joints]) -> Vec<Vec<Joints>> {
    let mut chains = vec![chain.to_vec()];
    for at in (0..arm.joints.len()).filter(|at| arm.joints[*at].kind == JointKind::Turning) {
        for turn in [-TAU, TAU] {
            let whole = |joints: &Joints| {
                let mut joints = *joints;
                joints[at] += turn;
                joints
            };
            let turned: Vec<Joints> = chain.iter().map(whole).collect();
            if turned.iter().all(|joints| arm.within_limits(joints)) {
                chains.push(turned);
            }
        }
    }
    chains
}
