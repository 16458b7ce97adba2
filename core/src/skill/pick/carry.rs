//! The arm's motion for a pick: in, out with the object, to where it is set down, and back.

use super::{OUT, Pick};
use crate::arm::{
    CARRY_M_S, Follow, Frame, Joints, Motion, Phase, PhaseKind, PhasedMotion, Space, WAY_BACK_M_S, follow_line,
    level_tool, plan,
};
use crate::belief::Patch;
use crate::rng::ChaCha8Rng;
use crate::skill::clearance::{Approach, ArmClearance, QUERY};
use crate::skill::{Rejection, Stage};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

pub use super::room::LIFT_M;

/// How far before and behind where a front is expected the cup feels for it, metres: three voxels of the standard grid.
pub const FEEL_M: f32 = 0.015;
/// Speed of the cup while it feels, metres per second: a vacuum sensor takes some milliseconds.
const FEEL_M_S: f64 = 0.05;
/// How far above the board an object is let go, metres: what is lowered farther would be pressed on the board.
pub const GAP_M: f32 = 0.001;
/// How far the cup goes along its own axis at the end of its way in, metres.
const ALONG_AXIS_M: f64 = 0.03;
/// How far before the front edge the back of an object must come to be out of the shelf, metres.
const OUT_M: f64 = 0.05;
/// How finely a turn of the whole arm is checked, radians.
const TURN_STEP_RAD: f64 = 0.05;

/// Turns of the hand about the cup's axis that are tried, degrees.
const TURNS_DEG: [f64; 4] = [0.0, 180.0, 90.0, -90.0];

/// A pose turned about its own axis ahead.
fn turned(pose: &Frame, turn_deg: f64) -> Frame {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_deg.to_radians());
    Frame::from_parts(pose.translation, pose.rotation * turn)
}

/// A pick being planned.
struct Carrying<'a> {
    clearance: &'a ArmClearance<'a>,
    space: Space<'a>,
    target: &'a Patch,
    /// Where the arm is.
    at: Joints,
    /// The way of the object in hand: the arm comes to rest at every corner, so that nothing is torn off the cup.
    way: Motion,
}

/// The arm's motion for a pick of an object, or why there is none.
///
/// A cup is round, so the hand may be turned about it: of the turns that fail, the first gives the reason.
pub(super) fn motion(
    pick: &Pick,
    clearance: &ArmClearance<'_>,
    target: &Patch,
    rng: &mut ChaCha8Rng,
) -> Result<PhasedMotion, Rejection> {
    let mut against = Rejection::NoWay;
    for (number, turn_deg) in TURNS_DEG.into_iter().enumerate() {
        match motion_turned(pick, turn_deg, clearance, target, rng) {
            Ok(motion) => return Ok(motion),
            Err(rejection) if number == 0 => against = rejection,
            Err(_) => (),
        }
    }
    Err(against)
}

fn motion_turned(
    pick: &Pick,
    turn_deg: f64,
    clearance: &ArmClearance<'_>,
    target: &Patch,
    rng: &mut ChaCha8Rng,
) -> Result<PhasedMotion, Rejection> {
    let tool = clearance.tool();
    let arm = &tool.arm;
    let Some(ready) = tool.ready else { return Err(Rejection::Unreachable { stage: Stage::Start }) };
    if arm.cup.is_none() {
        return Err(Rejection::NoCup);
    }
    let feel = pick.ahead().map(f64::from) * f64::from(FEEL_M);
    let before = pick.touch().map(f64::from) - feel;
    let touch = turned(&level_tool(&before, pick.yaw_rad()), turn_deg);
    let up = f64::from(LIFT_M);
    let approach =
        Approach { poses: &[touch], travel: 2.0 * feel, lift_m: ALONG_AXIS_M, touches: Some(target), target };
    let mut phases = clearance.motion(&approach, rng)?.phases;
    let felt = phases.pop().ok_or(Rejection::NoWay)?.motion;
    let start = felt.at(0.0).ok_or(Rejection::NoWay)?;
    let felt: Vec<Joints> = felt.path().collect();
    phases.push(Phase::closed(PhaseKind::Contact, Motion::along(arm, &felt, FEEL_M_S)));
    let space = clearance.space().pushing();
    let mut carrying = Carrying { clearance, space, target, at: start, way: Motion::default() };
    // Out until the object's back is before the front edge.
    let grid = clearance.grid();
    let back = target.cells().iter().map(|cell| cell % grid.dims[1]).max().unwrap_or(0);
    let out = f64::from((back + 1) as f32 * grid.voxel_m + grid.origin[1]) + OUT_M - feel.y;
    carrying.go(Vector3::new(0.0, 0.0, up))?;
    // A phase of its own: it begins where the cup has sealed.
    phases.push(Phase::closed(PhaseKind::Carry, std::mem::take(&mut carrying.way)));
    carrying.go(Vector3::new(0.0, -out, 0.0))?;
    match pick.place {
        Some([dx, dy]) => {
            let [dx, dy] = [dx, dy].map(f64::from);
            let inwards = out + feel.y + dy;
            carrying.go(Vector3::new(feel.x + dx, 0.0, 0.0))?;
            carrying.go(Vector3::new(0.0, inwards, 0.0))?;
            carrying.go(Vector3::new(0.0, 0.0, -(up - f64::from(GAP_M))))?;
            let back = carrying.back(&ready, inwards, rng)?;
            phases.push(Phase::closed(PhaseKind::Carry, carrying.way));
            phases.push(Phase::closed(PhaseKind::Retreat, back));
        }
        None => {
            let turned = carrying.aside()?;
            carrying.moved(&[carrying.at, turned]);
            phases.push(Phase::closed(PhaseKind::Carry, carrying.way));
            let there = Motion::along(arm, &[turned, turned], CARRY_M_S);
            phases.push(Phase::closed(PhaseKind::Stow, there));
            let free = clearance.space();
            let planned = plan(&free, &ready, &[vec![turned]], QUERY, rng).ok_or(Rejection::NoWay)?;
            let path: Vec<Joints> = planned.path.into_iter().rev().collect();
            phases.push(Phase::closed(PhaseKind::Retreat, Motion::along(arm, &path, WAY_BACK_M_S)));
        }
    }
    Ok(PhasedMotion { phases })
}

impl Carrying<'_> {
    /// Moves along a path and comes to rest.
    fn moved(&mut self, path: &[Joints]) {
        let motion = Motion::along(&self.clearance.tool().arm, path, CARRY_M_S);
        self.way = std::mem::take(&mut self.way).then(&motion);
        self.at = path.last().copied().unwrap_or(self.at);
    }

    /// Moves the object straight on.
    fn go(&mut self, travel: Vector3<f64>) -> Result<(), Rejection> {
        let arm = &self.clearance.tool().arm;
        let pose = arm.world_from_tool(&self.at);
        if let (_, Some(hit)) = self.clearance.gripper_hit(&pose, &travel, Some(self.target)) {
            return Err(Rejection::ArmBlocked { stage: OUT, hit });
        }
        let mut met = None;
        let Follow { path, complete } = follow_line(arm, &self.at, &travel, |joints| {
            met = self.space.hit(joints);
            met.is_none()
        });
        if !complete {
            return Err(
                met.map_or(Rejection::Unreachable { stage: OUT }, |hit| Rejection::ArmBlocked { stage: OUT, hit })
            );
        }
        self.moved(&path);
        Ok(())
    }

    /// Turns the whole arm by a quarter about its first joint, to the side that is free: beside the robot.
    fn aside(&self) -> Result<Joints, Rejection> {
        let arm = &self.clearance.tool().arm;
        let from = self.at;
        let mut met = Rejection::Unreachable { stage: OUT };
        // First to the side where it is already: on the other one it would come past the whole shelf.
        let side =
            if arm.world_from_tool(&from).translation.x < arm.world_from_base.translation.x { 1.0 } else { -1.0 };
        for quarter in [side * FRAC_PI_2, -side * FRAC_PI_2] {
            let steps = (FRAC_PI_2 / TURN_STEP_RAD).ceil() as usize;
            let turned = |step: usize| {
                let mut joints = from;
                joints[0] += quarter * step as f64 / steps as f64;
                joints
            };
            let fault = (1..=steps).map(turned).find_map(|joints| {
                let hit = self.space.hit(&joints).map(|hit| Rejection::ArmBlocked { stage: OUT, hit });
                hit.or_else(|| (!arm.within_limits(&joints)).then_some(Rejection::Unreachable { stage: OUT }))
            });
            match fault {
                None => return Ok(turned(steps)),
                Some(fault) => met = fault,
            }
        }
        Err(met)
    }

    /// Back to where the arm waits, from where it let go: along the cup's own axis, then straight out.
    fn back(&self, ready: &Joints, out: f64, rng: &mut ChaCha8Rng) -> Result<Motion, Rejection> {
        let arm = &self.clearance.tool().arm;
        let start = self.at;
        let pose: Frame = arm.world_from_tool(&start);
        let drawn = pose.rotation * Vector3::new(0.0, 0.0, -ALONG_AXIS_M);
        let mut chain = vec![start];
        for travel in [drawn, Vector3::new(0.0, -(out + drawn.y).max(0.0), 0.0)] {
            let from = chain[chain.len() - 1];
            let follow = follow_line(arm, &from, &travel, |joints| self.space.is_free(joints));
            if !follow.complete {
                return Err(Rejection::NoWay);
            }
            chain.extend(follow.path.into_iter().skip(1));
        }
        let free = self.clearance.space();
        let planned = plan(&free, ready, &[chain], QUERY, rng).ok_or(Rejection::NoWay)?;
        let path: Vec<Joints> = planned.path.into_iter().rev().collect();
        Ok(Motion::along(arm, &path, WAY_BACK_M_S))
    }
}
