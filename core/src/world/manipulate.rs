//! A manipulation by the arm: its links follow the motion as kinematic bodies, and the objects that they touch are recorded.

use super::physics::{BLOCKING_FORCE_N, TIME_STEP_S, Touch};
use super::{ManipulationOutcome, World};
use crate::arm::{Arm, CARRY_M_S, Joints, Motion, PhaseKind, PhasedMotion, follow_line};
use crate::scene::{Body, ObjectId};
use serde::{Deserialize, Serialize};

/// An object that a link of the arm touched.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkContact {
    /// The link.
    pub link: String,
    /// The object.
    pub object: ObjectId,
}

/// What became of what the cup was to hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Grip {
    /// The object that it sealed on, if it did.
    pub object: Option<ObjectId>,
    /// How it ended.
    pub end: GripEnd,
}

/// How holding an object ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GripEnd {
    /// The cup did not seal: an edge, a gap, too small a face, or nothing there.
    NoSeal,
    /// It came off on the way, pulled or bent with more than the cup bears, or the arm was blocked.
    CameOff,
    /// It was set down where it was to be.
    SetDown,
    /// It was laid down beside the robot.
    Stowed,
}

impl GripEnd {
    /// Whether the object was held until it was where it was to be.
    pub fn is_held(self) -> bool {
        matches!(self, Self::SetDown | Self::Stowed)
    }
}

impl std::fmt::Display for GripEnd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NoSeal => "no seal",
            Self::CameOff => "came off",
            Self::SetDown => "set down",
            Self::Stowed => "laid down beside the robot",
        })
    }
}

/// How a motion ended.
struct Ride {
    /// The last configuration.
    joints: Joints,
    /// When the arm stopped, since it was blocked, lost what it held or felt what it was to touch, seconds since the motion
    /// began.
    stopped_s: Option<f64>,
    /// What the cup of an arm that feels met when it stopped.
    touch: Option<Touch>,
}

impl World {
    /// Carries out a motion of the arm, phase by phase, and back: as planned, or the same way; then the bodies settle.
    ///
    /// An arm that is blocked stops there, goes back the way it came and reports a stall. It is planned clear of the shelf
    /// and does not feel it; how deep it got into a panel is in the outcome all the same.
    pub fn execute(&mut self, arm: &Arm, motion: &PhasedMotion) -> ManipulationOutcome {
        let before = self.poses();
        let dropped_before = self.dropped.clone();
        self.physics.begin();
        let steps_before = self.physics.steps();
        let mut notes = Notes::default();
        let Some(first) = motion.start() else { return self.outcome(&before, &dropped_before, steps_before) };
        self.physics.insert_arm(arm, &first);

        let tip = |joints: &Joints| arm.world_from_tool(joints).translation.vector;
        let (mut stalled, mut way_m, mut last) = (false, 0.0, first);
        let mut back: Vec<Joints> = Vec::new();
        let mut grip: Option<Grip> = None;
        let mut holds_from: Option<Joints> = None;
        for phase in motion.outward() {
            let start = phase.motion.at(0.0).unwrap_or(last);
            if phase.kind == PhaseKind::Stow {
                self.stow();
                grip = grip.map(|grip| Grip { end: GripEnd::Stowed, ..grip });
            }
            let feels = phase.kind == PhaseKind::Contact && motion.carries();
            // The way with what it holds begins where the cup sealed.
            let carried = holds_from.take().map(|from| lifted_from(arm, &from, &phase.motion));
            let phase_motion = carried.as_ref().unwrap_or(&phase.motion);
            let ride = self.ride(arm, phase_motion, feels, &mut notes);
            back.extend(before_time(phase_motion, ride.stopped_s));
            if feels {
                let sealed = if let Some(Touch::Sealed(at)) = ride.touch { Some(at) } else { None };
                let object = sealed.and_then(|at| self.bodies.get(at)).map(|body| body.id);
                grip = Some(Grip { object, end: sealed.map_or(GripEnd::NoSeal, |_| GripEnd::SetDown) });
                last = ride.joints;
                let Some(at) = sealed else { break };
                self.physics.hold(at);
                holds_from = Some(last);
                continue;
            }
            last = ride.joints;
            if matches!(phase.kind, PhaseKind::Contact | PhaseKind::Carry) {
                way_m += (tip(&last) - tip(&start)).norm() as f32;
            }
            if ride.stopped_s.is_some() {
                match &mut grip {
                    Some(grip) => grip.end = GripEnd::CameOff,
                    None => stalled = true,
                }
                break;
            }
        }
        self.physics.let_go();
        let is_done = !stalled && grip.is_none_or(|grip| grip.end.is_held());
        back.push(last);
        let passed = back.clone();
        back.reverse();
        let planned = motion.retreat().filter(|_| is_done);
        let way_back = planned.unwrap_or_else(|| Motion::along(arm, &back, crate::arm::WAY_BACK_M_S));
        // An arm that cannot even go back is taken away where it is: a real one would give way.
        self.ride(arm, &way_back, false, &mut notes);
        self.physics.remove_arm();
        self.come_to_rest();
        self.read_back();

        let mut outcome = self.outcome(&before, &dropped_before, steps_before);
        outcome.stalled = stalled;
        outcome.way_m = way_m;
        outcome.link_contacts = notes.contacts;
        outcome.against_wall = notes.against_wall;
        outcome.arm_in_shelf_m = notes.arm_in_shelf_m;
        outcome.grip = grip;
        outcome.passed = passed;
        outcome.arm_s = notes.steps as f32 * TIME_STEP_S;
        outcome
    }

    /// What happened since `before`, for an arm that has not moved yet.
    fn outcome(&self, before: &[crate::Pose], dropped_before: &[bool], steps_before: u64) -> ManipulationOutcome {
        let ids = self.bodies.iter().zip(self.dropped.iter().zip(dropped_before));
        ManipulationOutcome {
            displacement_m: self.displacements(before),
            dropped: ids.filter(|(_, (now, before))| **now && !**before).map(|(body, _)| body.id).collect(),
            duration_s: (self.physics.steps() - steps_before) as f32 * TIME_STEP_S,
            ..ManipulationOutcome::default()
        }
    }

    /// Moves the arm along a motion; stops when it is blocked, and an arm that feels as soon as its cup seals or its bellows
    /// gives way no farther.
    fn ride(&mut self, arm: &Arm, motion: &Motion, feels: bool, notes: &mut Notes) -> Ride {
        let steps = (motion.duration_s() / f64::from(TIME_STEP_S)).ceil() as usize;
        let mut joints = motion.at(0.0).unwrap_or_else(|| Joints::zero(arm.joints.len()));
        for step in 1..=steps {
            let at_s = step as f64 * f64::from(TIME_STEP_S);
            joints = motion.at(at_s).unwrap_or(joints);
            let blocked = self.physics.step_arm(arm, &joints) || self.physics.comes_off(arm, &joints);
            notes.steps += 1;
            self.take_notes(notes);
            let touch = feels.then(|| self.physics.touch(arm, &joints)).filter(|touch| *touch != Touch::Open);
            if touch.is_some() || (blocked && step < steps) {
                return Ride { joints, stopped_s: Some(at_s), touch };
            }
            self.note_drops();
        }
        Ride { joints, stopped_s: None, touch: None }
    }

    fn take_notes(&self, notes: &mut Notes) {
        let id = |at: usize| self.bodies.get(at).map(|body: &Body| body.id);
        for (link, at) in self.physics.link_contacts() {
            let known = |contact: &LinkContact| contact.link == link && Some(contact.object) == id(at);
            if let Some(object) = id(at)
                && !notes.contacts.iter().any(known)
            {
                notes.contacts.push(LinkContact { link: link.to_owned(), object });
            }
        }
        for at in self.physics.pressed_against_walls(0.25 * BLOCKING_FORCE_N) {
            if let Some(object) = id(at)
                && !notes.against_wall.contains(&object)
            {
                notes.against_wall.push(object);
            }
        }
        notes.arm_in_shelf_m = notes.arm_in_shelf_m.max(self.physics.arm_in_shelf_m());
    }
}

/// What was seen on the way.
#[derive(Default)]
struct Notes {
    contacts: Vec<LinkContact>,
    against_wall: Vec<ObjectId>,
    arm_in_shelf_m: f32,
    /// Time steps in which the arm moved.
    steps: u32,
}

/// The first motion with something in hand, from where the cup sealed: the same way, straight and without turning, and then to
/// where that motion ends.
fn lifted_from(arm: &Arm, from: &Joints, motion: &Motion) -> Motion {
    let Some([first, last]) = motion.stops.first().zip(motion.stops.last()).map(|(a, b)| [a.joints, b.joints]) else {
        return motion.clone();
    };
    let tip = |joints: &Joints| arm.world_from_tool(joints).translation.vector;
    let lift = follow_line(arm, from, &(tip(&last) - tip(&first)), |_| true).path;
    let lifted = lift.last().copied().unwrap_or(*from);
    let drawn = Motion::along(arm, &[lifted, last], CARRY_M_S);
    Motion::along(arm, &lift, CARRY_M_S).then(&drawn)
}

/// The stops of a motion that were passed before it stopped.
fn before_time(motion: &Motion, stopped_s: Option<f64>) -> Vec<Joints> {
    let until = stopped_s.unwrap_or(f64::INFINITY);
    motion.stops.iter().filter(|stop| stop.at_s < until).map(|stop| stop.joints).collect()
}
