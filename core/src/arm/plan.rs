//! Ways through a space: straight if that is free, else by two trees that grow towards each other, then shortened.

use super::Joints;
use super::rrt::Trees;
use super::shortcut::shortcut;
use super::space::Space;
use crate::rng::ChaCha8Rng;

/// Gaps smaller than this between what two configurations are known to have free are taken for free, metres: half of
/// it may be lost of a margin of 5 mm or more.
const GAP_M: f64 = 0.004;

/// How much work a query may be.
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

/// A way that was found.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Configurations from the start to the goal, straight in between.
    pub path: Vec<Joints>,
    /// Rounds that the trees took; 0 when the straight way was free.
    pub rounds: usize,
}

/// A free way from `start` to one of `goals`, or `None` when there is none or it was not found in time.
///
/// Each goal is a chain: its first configuration is the goal, and from any later one the chain back to the goal is known
/// to be free (an arm backs out of a shelf the way it would go in). The same stream finds the same way.
pub fn plan(
    space: &Space<'_>,
    start: &Joints,
    goals: &[Vec<Joints>],
    settings: PlanSettings,
    rng: &mut ChaCha8Rng,
) -> Option<Planned> {
    let start_room = space.room_m(start);
    if start_room < 0.0 || !space.arm.within_limits(start) {
        return None;
    }
    // Straight to a goal, or to where its chain ends.
    for chain in goals {
        let (Some(goal), Some(last)) = (chain.first(), chain.last()) else { continue };
        if is_segment_free(space, start, last) {
            let path: Vec<Joints> = std::iter::once(*start).chain(chain.iter().rev().copied()).collect();
            return Some(Planned { path: shortcut(space, path, settings.shortcuts, rng), rounds: 0 });
        }
        if chain.len() > 1 && is_segment_free(space, start, goal) {
            return Some(Planned { path: vec![*start, *goal], rounds: 0 });
        }
    }
    let mut trees = Trees::new(space, start, goals);
    let path = trees.connect(settings.rounds, rng)?;
    Some(Planned { path: shortcut(space, path, settings.shortcuts, rng), rounds: trees.rounds() })
}

/// Whether the straight way between two configurations is free.
///
/// The room at a configuration tells how far around it every configuration is free, so a segment is free once the room
/// at both ends spans it; if not, it is halved (Schwarzer, Saha and Latombe 2005).
pub(super) fn is_segment_free(space: &Space<'_>, a: &Joints, b: &Joints) -> bool {
    let (room_a, room_b) = (space.room_m(a), space.room_m(b));
    room_a >= 0.0 && room_b >= 0.0 && is_span_free(space, a, b, room_a, room_b)
}

/// The same for ends whose room is known.
#[allow(clippy::if_same_then_else, reason = "the order in which the halves are asked is the point")]
pub(super) fn is_span_free(space: &Space<'_>, a: &Joints, b: &Joints, room_a: f64, room_b: f64) -> bool {
    let travel = space.arm.travel_m(a, b);
    if travel <= room_a + room_b + GAP_M {
        return true;
    }
    let middle = a.toward(b, 0.5);
    let room = space.room_m(&middle);
    // The half with less room is the likelier to fail, so it goes first.
    room >= 0.0
        && if room_a < room_b {
            is_span_free(space, a, &middle, room_a, room) && is_span_free(space, &middle, b, room, room_b)
        } else {
            is_span_free(space, &middle, b, room, room_b) && is_span_free(space, a, &middle, room_a, room)
        }
}
