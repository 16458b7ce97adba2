//! RRT-Connect (Kuffner and LaValle 2000): one tree from the start, one from the goals, each step grows one towards a
//! random configuration and the other towards what came of it.
//!
//! Samples are drawn from the joints' limits around start and goals, and every third one near a configuration that
//! already failed to grow, where the passages are narrow.

use super::Joints;
use super::segment::{Probe, is_span_free};
use super::space::Space;
use crate::rng::ChaCha8Rng;
use rand::Rng;
use std::f64::consts::PI;

/// Longest growth of a tree in one step, metres of [`super::Arm::travel_m`].
const STEP_M: f64 = 0.35;
/// A growth shorter than this is none.
const SHORTEST_M: f64 = 0.02;

struct Node {
    probe: Probe,
    parent: usize,
}

/// A tree whose roots are their own parents.
#[derive(Default)]
struct Tree {
    nodes: Vec<Node>,
}

impl Tree {
    fn add(&mut self, probe: Probe, parent: Option<usize>) -> usize {
        let index = self.nodes.len();
        self.nodes.push(Node { probe, parent: parent.unwrap_or(index) });
        index
    }

    fn nearest(&self, space: &Space<'_>, to: &Joints) -> usize {
        let mut best = (0, f64::INFINITY);
        for (index, node) in self.nodes.iter().enumerate() {
            let travel = space.arm.travel_m(&node.probe.at, to);
            if travel < best.1 {
                best = (index, travel);
            }
        }
        best.0
    }

    /// From a node to its root.
    fn branch(&self, mut index: usize) -> Vec<Joints> {
        let mut branch = vec![self.nodes[index].probe.at];
        while self.nodes[index].parent != index {
            index = self.nodes[index].parent;
            branch.push(self.nodes[index].probe.at);
        }
        branch
    }
}

/// What came of growing towards a configuration.
enum Growth {
    Blocked,
    Grown(usize),
    Reached(usize),
}

pub(super) struct Trees<'s, 'a> {
    space: &'s Space<'a>,
    trees: [Tree; 2],
    low: Joints,
    high: Joints,
    rounds: usize,
}

impl<'s, 'a> Trees<'s, 'a> {
    pub(super) fn new(space: &'s Space<'a>, start: &Joints, goals: &[Vec<Joints>]) -> Self {
        let mut trees = [Tree::default(), Tree::default()];
        trees[0].add(Probe::trusted(space, start), None);
        let (mut low, mut high) = (*start, *start);
        for chain in goals {
            let mut parent = None;
            for joints in chain {
                parent = Some(trees[1].add(Probe::trusted(space, joints), parent));
            }
            for joints in chain {
                for at in 0..joints.len() {
                    low[at] = low[at].min(joints[at]);
                    high[at] = high[at].max(joints[at]);
                }
            }
        }
        // Half a turn beyond start and goals: more turns of a joint lead to no new place.
        for (at, joint) in space.arm.joints.iter().enumerate() {
            low[at] = (low[at] - PI).max(joint.lower);
            high[at] = (high[at] + PI).min(joint.upper);
        }
        Self { space, trees, low, high, rounds: 0 }
    }

    pub(super) fn rounds(&self) -> usize {
        self.rounds
    }

    /// Grows until the trees meet; the way from the start to a goal.
    pub(super) fn connect(&mut self, rounds: usize, rng: &mut ChaCha8Rng) -> Option<Vec<Joints>> {
        if self.trees.iter().any(|tree| tree.nodes.is_empty()) {
            return None;
        }
        for round in 0..rounds {
            self.rounds = round + 1;
            let side = round % 2;
            let target = self.sample(side, rng);
            let from = self.trees[side].nearest(self.space, &target);
            let (Growth::Grown(grown) | Growth::Reached(grown)) = self.grow(side, from, &target) else { continue };
            let meeting = self.trees[side].nodes[grown].probe.at;
            let mut other = self.trees[1 - side].nearest(self.space, &meeting);
            loop {
                match self.grow(1 - side, other, &meeting) {
                    Growth::Blocked => break,
                    Growth::Grown(next) => other = next,
                    Growth::Reached(next) => return Some(self.way(side, grown, next)),
                }
            }
        }
        None
    }

    /// Most samples are anywhere; some are near a node of the tree, which finds the way out of narrow places.
    fn sample(&self, side: usize, rng: &mut ChaCha8Rng) -> Joints {
        let mut joints = self.low;
        let local = rng.random_range(0..3) == 0;
        let nodes = &self.trees[side].nodes;
        let around = nodes[rng.random_range(0..nodes.len())].probe.at;
        for at in 0..joints.len() {
            joints[at] = if local {
                (around[at] + rng.random_range(-0.4..0.4)).clamp(self.low[at], self.high[at])
            } else {
                rng.random_range(self.low[at]..=self.high[at])
            };
        }
        joints
    }

    /// Grows a tree from one of its nodes towards `target` by one step; less than half of one where a whole one is not
    /// free.
    fn grow(&mut self, side: usize, from: usize, target: &Joints) -> Growth {
        let node = &self.trees[side].nodes[from].probe;
        let travel = self.space.arm.travel_m(&node.at, target);
        let tries = if travel <= SHORTEST_M { 1 } else { 2 };
        let mut share = (STEP_M / travel.max(SHORTEST_M)).min(1.0);
        for _ in 0..tries {
            let next = if share >= 1.0 { *target } else { node.at.toward(target, share) };
            if let Some(probe) = Probe::free(self.space, &next).filter(|probe| is_span_free(self.space, node, probe)) {
                let added = self.trees[side].add(probe, Some(from));
                return if share >= 1.0 { Growth::Reached(added) } else { Growth::Grown(added) };
            }
            share *= 0.4;
        }
        Growth::Blocked
    }

    fn way(&self, side: usize, here: usize, there: usize) -> Vec<Joints> {
        let (start, goal) = if side == 0 { (here, there) } else { (there, here) };
        let mut way = self.trees[0].branch(start);
        way.reverse();
        // Both trees hold the configuration where they met.
        way.extend(self.trees[1].branch(goal).into_iter().skip(1));
        way
    }
}
