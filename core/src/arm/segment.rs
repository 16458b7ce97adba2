//! Whether the straight line between two configurations is collision-free: by clearance, not by fixed steps.
//!
//! The clearance of a part of the arm at a configuration says how far the part may move from there in any direction. So
//! a segment is free for a part if its clearances at both ends add up to how far it moves in between. If not, the
//! segment is halved, and only the parts in doubt are checked again (Schwarzer, Saha and Latombe 2005, per pair of
//! bodies). Nothing thin is jumped over, and the parts that are far from everything cost nothing.

use super::model::JointKind;
use super::space::Space;
use super::{BodyPoses, Joints, MAX_JOINTS};

/// Gaps smaller than this between what two configurations are known to have free are taken for free, metres: half of
/// it may be lost of a margin of 5 mm or more.
const GAP_M: f64 = 0.004;
/// Clearance above this is not distinguished, metres.
const PLENTY_M: f64 = 0.10;

/// The arm in a configuration, with the clearance of its parts. An item is a part by its position in
/// [`super::Arm::parts`], or after them a pair of parts that may meet.
#[derive(Clone)]
pub(super) struct Probe {
    pub at: Joints,
    poses: BodyPoses,
    /// Clearance per item, metres; infinite where it was not asked for.
    room_m: Vec<f64>,
}

impl Probe {
    /// With the room of all items, none less than 0: for configurations that are known to be free.
    pub(super) fn trusted(space: &Space<'_>, at: &Joints) -> Self {
        let mut probe = Self::empty(space, at);
        for item in items(space) {
            probe.room_m[usize::from(item)] = probe.room_of(space, item).max(0.0);
        }
        probe
    }

    /// With the room of all items; `None` where the arm may not be.
    pub(super) fn free(space: &Space<'_>, at: &Joints) -> Option<Self> {
        Self::of(space, at, items(space))
    }

    /// With the room of some items; `None` where one of them has none.
    fn of(space: &Space<'_>, at: &Joints, items: impl IntoIterator<Item = u16>) -> Option<Self> {
        let mut probe = Self::empty(space, at);
        for item in items {
            let room = probe.room_of(space, item);
            if room < 0.0 {
                return None;
            }
            probe.room_m[usize::from(item)] = room;
        }
        Some(probe)
    }

    fn empty(space: &Space<'_>, at: &Joints) -> Self {
        let room_m = vec![f64::INFINITY; space.arm.places.len() + space.arm.self_pairs.len()];
        Self { at: *at, poses: space.arm.body_poses(at), room_m }
    }

    fn room_of(&self, space: &Space<'_>, item: u16) -> f64 {
        match usize::from(item).checked_sub(space.arm.places.len()) {
            None => space.part_room(usize::from(item), &self.poses, PLENTY_M, &mut |_| ()),
            Some(pair) => space.pair_room(space.arm.self_pairs[pair], &self.poses, PLENTY_M, &mut || ()),
        }
    }

    fn least_m(&self, items: &[u16]) -> f64 {
        items.iter().map(|item| self.room_m[usize::from(*item)]).fold(f64::INFINITY, f64::min)
    }
}

fn items(space: &Space<'_>) -> impl Iterator<Item = u16> {
    0..(space.arm.places.len() + space.arm.self_pairs.len()) as u16
}

/// Whether the straight way between two configurations is free.
pub(super) fn is_segment_free(space: &Space<'_>, a: &Joints, b: &Joints) -> bool {
    match (Probe::free(space, a), Probe::free(space, b)) {
        (Some(a), Some(b)) => is_span_free(space, &a, &b),
        _ => false,
    }
}

/// The same for ends that have been asked.
pub(super) fn is_span_free(space: &Space<'_>, a: &Probe, b: &Probe) -> bool {
    let items: Vec<u16> = items(space).collect();
    halve(space, a, b, &items)
}

fn halve(space: &Space<'_>, a: &Probe, b: &Probe, items: &[u16]) -> bool {
    let span = Span::between(space, a, b);
    let doubtful = |item: &u16| {
        let at = usize::from(*item);
        span.travel_m(space, a, b, at) > a.room_m[at] + b.room_m[at] + GAP_M
    };
    let doubtful: Vec<u16> = items.iter().copied().filter(doubtful).collect();
    if doubtful.is_empty() {
        return true;
    }
    let Some(middle) = Probe::of(space, &a.at.toward(&b.at, 0.5), doubtful.iter().copied()) else { return false };
    // The half with less room is the likelier to fail, so it goes first.
    let first_a = a.least_m(&doubtful) < b.least_m(&doubtful);
    let half = |of_a: bool| match of_a {
        true => halve(space, a, &middle, &doubtful),
        false => halve(space, &middle, b, &doubtful),
    };
    half(first_a) && half(!first_a)
}

/// How far bodies may move between two configurations.
struct Span {
    /// Per joint, the farthest that it alone moves anything, metres.
    by_joint_m: [f64; MAX_JOINTS],
    /// Per body, the most by which a point's way can bulge from the straight line between its ends, metres; infinite
    /// where nothing is known of it.
    bulge_m: [f64; MAX_JOINTS + 1],
}

impl Span {
    fn between(space: &Space<'_>, a: &Probe, b: &Probe) -> Self {
        let mut span = Self { by_joint_m: [0.0; MAX_JOINTS], bulge_m: [0.0; MAX_JOINTS + 1] };
        // For a chain of turning joints with constant speeds w and reaches r a point's acceleration is at most
        // sum(w) * sum(w r), and a curve leaves its chord by at most an eighth of that.
        let (mut turned, mut moved) = (0.0, 0.0);
        for (at, joint) in space.arm.joints.iter().enumerate() {
            let change = (a.at[at] - b.at[at]).abs();
            span.by_joint_m[at] = change * space.arm.reach_m[at];
            turned += if joint.kind == JointKind::Sliding && change > 0.0 { f64::INFINITY } else { change };
            moved += span.by_joint_m[at];
            span.bulge_m[at + 1] = 0.125 * turned * moved;
        }
        span
    }

    /// The most that any point of an item moves, metres, such that room at both ends that adds up to it is enough.
    fn travel_m(&self, space: &Space<'_>, a: &Probe, b: &Probe, item: usize) -> f64 {
        let parts = space.arm.places.len();
        if let Some(pair) = item.checked_sub(parts) {
            // Only the joints between two parts move them against each other; each may use half of the gap.
            let bodies = space.arm.self_pairs[pair].map(|part| space.arm.places[usize::from(part)][0]);
            let between = bodies[0].min(bodies[1])..bodies[0].max(bodies[1]);
            return 0.5 * self.by_joint_m[between].iter().sum::<f64>();
        }
        let [body, part] = space.arm.places[item];
        let along_all: f64 = self.by_joint_m[..body].iter().sum();
        let around = &space.arm.bodies[body][part].around;
        let (pose_a, pose_b) = (&a.poses[body], &b.poses[body]);
        let shift = (pose_a * around.center - pose_b * around.center).norm();
        let cosine = pose_a.rotation.coords.dot(&pose_b.rotation.coords).abs().min(1.0);
        let turn = 2.0 * (1.0 - cosine * cosine).sqrt() * around.radius_m;
        along_all.min(shift + turn + 2.0 * self.bulge_m[body])
    }
}
