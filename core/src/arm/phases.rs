//! A motion of the arm in phases: to the contact, in contact, and away from it.

use super::{Arm, Joints, Motion};
use crate::grid::{Grid, VoxelSet};
use crate::{Error, Point};
use serde::{Deserialize, Serialize};

/// Speed of the tip on the way to the contact, metres per second.
pub const WAY_IN_M_S: f64 = 0.25;
/// Speed of the tip in contact, metres per second.
pub const CONTACT_M_S: f64 = 0.10;
/// Speed of the tip on the way back, metres per second.
pub const WAY_BACK_M_S: f64 = 0.50;

/// Speed of the tip with an object in hand, metres per second.
pub const CARRY_M_S: f64 = 0.15;

/// What a phase of a motion is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PhaseKind {
    /// To where the tool touches; nothing is to be touched on the way.
    Approach,
    /// While the tool touches what it is to move. Before a [`Carry`](Self::Carry) the arm feels its way: it stops as soon as
    /// the cup seals, lifts from there as the carry begins, and then goes to where that first phase of it ends.
    Contact,
    /// While the cup holds what it has taken: suction is on from its beginning to its end.
    Carry,
    /// What is held is laid down beside the robot; the arm is away from the shelf.
    Stow,
    /// Back to where the arm waits.
    Retreat,
}

/// A part of a motion: a timed path of the joints, and how wide the gripper is open on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Phase {
    /// What it is for.
    pub kind: PhaseKind,
    /// Distance of the gripper's fingers, metres; 0 is closed.
    pub opening_m: f32,
    /// The path.
    pub motion: Motion,
}

impl Phase {
    /// A phase with the gripper closed.
    pub fn closed(kind: PhaseKind, motion: Motion) -> Self {
        Self { kind, opening_m: 0.0, motion }
    }
}

/// The arm's motion for one manipulation, the same for planner, world and robot. It begins and ends where the arm waits.
///
/// A motion without a retreat goes back the way it came, as far as it came ([`PhasedMotion::way_back`]): that is known
/// only once it is carried out, because an arm that is blocked turns round where it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Filed", into = "Filed")]
pub struct PhasedMotion {
    /// The phases, each from where the one before it ended.
    pub phases: Vec<Phase>,
}

/// A motion as files have it: in phases, or, where there are but an approach and a contact with the gripper closed, as the
/// way in and the way along that pushes had before there were phases.
#[derive(Serialize, Deserialize)]
struct Filed {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    phases: Option<Vec<Phase>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    way_in: Option<Motion>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    push: Option<Motion>,
}

impl From<PhasedMotion> for Filed {
    fn from(motion: PhasedMotion) -> Self {
        use PhaseKind::{Approach, Contact};
        let plain =
            motion.phases.iter().map(|phase| (phase.kind, phase.opening_m)).eq([(Approach, 0.0), (Contact, 0.0)]);
        if !plain {
            return Self { phases: Some(motion.phases), way_in: None, push: None };
        }
        let mut motions = motion.phases.into_iter().map(|phase| phase.motion);
        Self { phases: None, way_in: motions.next(), push: motions.next() }
    }
}

impl TryFrom<Filed> for PhasedMotion {
    type Error = Error;

    fn try_from(filed: Filed) -> Result<Self, Error> {
        match filed {
            Filed { phases: Some(phases), .. } => Ok(Self { phases }),
            Filed { way_in: Some(way_in), push: Some(contact), .. } => Ok(Self {
                phases: vec![Phase::closed(PhaseKind::Approach, way_in), Phase::closed(PhaseKind::Contact, contact)],
            }),
            _ => Err(Error::Usage("a motion has `phases`, or `way_in` and `push`".to_owned())),
        }
    }
}

impl PhasedMotion {
    /// The motion with the gripper closed through these configurations: to the contact and along it, then back the same way.
    pub fn new(arm: &Arm, approach: &[Joints], contact: &[Joints]) -> Self {
        let approach = Phase::closed(PhaseKind::Approach, Motion::along(arm, approach, WAY_IN_M_S));
        let contact = Phase::closed(PhaseKind::Contact, Motion::along(arm, contact, CONTACT_M_S));
        Self { phases: vec![approach, contact] }
    }

    /// The phases before the retreat.
    pub fn outward(&self) -> impl DoubleEndedIterator<Item = &Phase> {
        self.phases.iter().filter(|phase| phase.kind != PhaseKind::Retreat)
    }

    /// The phases of a kind.
    pub(crate) fn of_kind(&self, kind: PhaseKind) -> impl DoubleEndedIterator<Item = &Phase> {
        self.phases.iter().filter(move |phase| phase.kind == kind)
    }

    /// The retreat that was planned; `None` for a motion that goes back the way it came.
    pub fn retreat(&self) -> Option<Motion> {
        let mut retreats = self.of_kind(PhaseKind::Retreat).map(|phase| &phase.motion);
        let first = retreats.next()?.clone();
        Some(retreats.fold(first, Motion::then))
    }

    /// Where it begins.
    pub fn start(&self) -> Option<Joints> {
        self.phases.first()?.motion.at(0.0)
    }

    /// The way back from the end of the contact: as planned, else the same way, faster.
    pub fn way_back(&self, arm: &Arm) -> Motion {
        let retrace = || {
            let mut path: Vec<Joints> = Vec::new();
            for phase in self.outward().rev() {
                let skip = usize::from(!path.is_empty());
                path.extend(phase.motion.path().rev().skip(skip));
            }
            Motion::along(arm, &path, WAY_BACK_M_S)
        };
        self.retreat().unwrap_or_else(retrace)
    }

    /// How long it takes, way back included, seconds.
    pub fn duration_s(&self, arm: &Arm) -> f64 {
        self.outward().map(|phase| phase.motion.duration_s()).sum::<f64>() + self.way_back(arm).duration_s()
    }

    /// The whole motion: in, in contact, back.
    pub fn whole(&self, arm: &Arm) -> Motion {
        let outward = self.outward().fold(Motion::default(), |whole, phase| whole.then(&phase.motion));
        outward.then(&self.way_back(arm))
    }

    /// Whether something is to be held on the way.
    pub fn carries(&self) -> bool {
        self.of_kind(PhaseKind::Carry).next().is_some()
    }

    /// From when to when something is in hand, seconds since the motion began; `None` where nothing is carried.
    pub fn carry_s(&self) -> Option<[f64; 2]> {
        let (mut at_s, mut carry_s) = (0.0, None);
        for phase in self.outward() {
            let end_s = at_s + phase.motion.duration_s();
            if phase.kind == PhaseKind::Carry {
                carry_s = Some([carry_s.map_or(at_s, |[from_s, _]: [f64; 2]| from_s), end_s]);
            }
            at_s = end_s;
        }
        carry_s
    }

    /// Whether `arm` can carry it out from `ready`, with its tip at `from` and `to` at both ends of the contact, to within a
    /// tenth of a millimetre.
    pub fn leads(&self, arm: &Arm, ready: &Joints, from: Point, to: Point) -> bool {
        self.leads_in(PhaseKind::Contact, arm, ready, from, Some(to))
    }

    /// The same for the phases of a kind; where no end is named any will do.
    pub fn leads_in(&self, kind: PhaseKind, arm: &Arm, ready: &Joints, from: Point, to: Option<Point>) -> bool {
        const SAME_M: f64 = 1e-4;
        let tip = |joints: Option<Joints>| joints.map(|joints| arm.world_from_tool(&joints).translation.vector);
        let at = |joints: Option<Joints>, point: Point| {
            tip(joints).is_some_and(|tip| (tip - point.coords.map(f64::from)).norm() < SAME_M)
        };
        let fits = |motion: &Motion| motion.stops.iter().all(|stop| stop.joints.len() == arm.joints.len());
        let of_kind = || self.of_kind(kind).map(|phase| &phase.motion);
        self.phases.iter().all(|phase| fits(&phase.motion) && phase.opening_m == 0.0)
            && self.start() == Some(*ready)
            && at(of_kind().next().and_then(|first| first.at(0.0)), from)
            && to.is_none_or(|to| at(of_kind().next_back().and_then(|last| last.at(last.duration_s())), to))
    }

    /// Every voxel that the arm touches on the way in or in contact.
    pub fn swept_volume(&self, arm: &Arm, grid: &Grid) -> VoxelSet {
        let mut swept = VoxelSet::empty(grid);
        let mut path: Vec<Joints> = Vec::new();
        for phase in self.outward() {
            let skip = usize::from(!path.is_empty());
            path.extend(phase.motion.path().skip(skip));
        }
        arm.sweep(&path, grid, &mut swept);
        swept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::ArmTool;
    use crate::scene::Shelf;

    /// Three configurations in, two along.
    fn motion() -> (ArmTool, PhasedMotion) {
        let arm = ArmTool::standard(Shelf::new([0.80, 0.40, 0.40]));
        let ready = arm.ready.expect("within reach");
        let turned = |by: f64| {
            let mut joints = ready;
            joints[0] += by;
            joints
        };
        let motion = PhasedMotion::new(&arm.arm, &[ready, turned(0.05), turned(0.1)], &[turned(0.1), turned(0.15)]);
        (arm, motion)
    }

    #[test]
    fn a_push_of_before_there_were_phases_is_the_same_motion() {
        let (arm, motion) = motion();
        let [way_in, along] = [0, 1].map(|at: usize| serde_json::to_value(&motion.phases[at].motion).expect("JSON"));
        let old = serde_json::json!({ "way_in": way_in, "push": along });
        let read: PhasedMotion = serde_json::from_value(old.clone()).expect("an old motion");
        assert_eq!(read, motion);
        assert_eq!(serde_json::to_value(&motion).expect("JSON"), old, "and is written as it was");
        let mut with_retreat = motion.clone();
        with_retreat.phases.push(Phase::closed(PhaseKind::Retreat, motion.way_back(&arm.arm)));
        let text = serde_json::to_string(&with_retreat).expect("JSON");
        assert!(text.contains("\"phases\"") && !text.contains("way_in"), "{text}");
        assert_eq!(serde_json::from_str::<PhasedMotion>(&text).expect("a motion"), with_retreat);
        assert_eq!(read.whole(&arm.arm), motion.whole(&arm.arm));
        let error = serde_json::from_str::<PhasedMotion>(r#"{"way_in": {"stops": []}}"#).expect_err("no motion");
        assert!(error.to_string().contains("`phases`"), "{error}");
    }

    #[test]
    fn a_motion_goes_back_the_way_it_came_unless_a_retreat_is_planned() {
        let (arm, mut motion) = motion();
        let whole = motion.whole(&arm.arm);
        assert_eq!(whole.at(0.0), motion.start());
        assert_eq!(whole.at(whole.duration_s()), motion.start(), "it ends where it began");
        assert!((whole.duration_s() - motion.duration_s(&arm.arm)).abs() < 1e-9);
        let end = motion.phases[1].motion.stops.last().expect("a stop").joints;
        let planned = Motion::along(&arm.arm, &[end, motion.start().expect("a start")], WAY_BACK_M_S);
        motion.phases.push(Phase::closed(PhaseKind::Retreat, planned.clone()));
        assert_eq!(motion.way_back(&arm.arm), planned);
        assert_eq!(motion.outward().count(), 2);
    }

    #[test]
    fn a_motion_with_the_fingers_open_does_not_lead_an_arm_whose_fingers_are_closed() {
        let (arm, mut motion) = motion();
        let tip = |at: f64| {
            let joints = motion.phases[1].motion.at(at).expect("a stop");
            Point::from(arm.arm.world_from_tool(&joints).translation.vector.map(|v| v as f32))
        };
        let (from, to) = (tip(0.0), tip(motion.phases[1].motion.duration_s()));
        let ready = arm.ready.expect("within reach");
        assert!(motion.leads(&arm.arm, &ready, from, to) && !motion.leads(&arm.arm, &ready, to, from));
        motion.phases[1].opening_m = 0.04;
        assert!(!motion.leads(&arm.arm, &ready, from, to));
    }
}
