//! The arm: its links, the path of its tip, and the views that its hand can reach.

use super::shapes::{self, REJECTED_RGB};
use super::{Recorder, Setting, paths};
use crate::colors::Rgb;
use nudge_core::arm::{ArmTool, Joints, Motion, Part, Role, pose_of};
use nudge_core::camera::{ViewArray, ViewId};
use nudge_core::episode::StepOutcome;
use nudge_core::plan::{Action, Decision};
use nudge_core::scene::ObjectId;
use nudge_core::{Pose, Result};

pub(crate) const LINK_RGB: Rgb = [150, 164, 180];
pub(crate) const TOOL_RGB: Rgb = [72, 74, 80];
const REACHED_RGB: Rgb = [86, 196, 132];
const PATH_RGB: Rgb = [120, 200, 255];
/// Time between two poses of a motion, seconds, for motions that are not long.
const FRAME_S: f64 = 0.1;
/// Most poses of a motion.
const MOST_FRAMES: usize = 60;

/// A body of the arm in its own frame; `None` for one without shapes.
pub fn body(parts: &[Part]) -> Option<rerun::Mesh3D> {
    let convex: Vec<_> = parts.iter().map(|part| part.shape.clone()).collect();
    let tool = parts.iter().any(|part| part.role == Role::Tool);
    let [r, g, b] = if tool { TOOL_RGB } else { LINK_RGB };
    (!convex.is_empty())
        .then(|| shapes::mesh(&convex).with_albedo_factor(rerun::Rgba32::from_unmultiplied_rgba(r, g, b, 255)))
}

/// The transforms of all bodies in a configuration.
pub fn transforms(arm: &ArmTool, joints: &Joints) -> Vec<rerun::Transform3D> {
    arm.arm.body_poses(joints).iter().map(|pose| shapes::transform(&pose_of(pose))).collect()
}

/// The poses of a motion that are recorded: seconds since it began, and the configuration.
pub fn frames(motion: &Motion) -> Vec<(f64, Joints)> {
    let end = motion.duration_s();
    let count = ((end / FRAME_S).ceil() as usize).clamp(1, MOST_FRAMES);
    let at = |i: usize| end * i as f64 / count as f64;
    (0..=count).filter_map(|i| Some((at(i), motion.at(at(i))?))).collect()
}

/// When in a step's motion the arm is at the end of its push, seconds; the motion's end where it does not push.
pub fn shown_at_s(arm: &ArmTool, motion: &Motion, decision: &Decision, pushes: bool) -> f64 {
    let back = match (&decision.motion, pushes) {
        (Some(push), true) => push.way_back(&arm.arm).duration_s(),
        _ => 0.0,
    };
    motion.duration_s() - back
}

/// What the cup holds in a step's motion.
pub struct Held<'a> {
    /// The object.
    pub object: ObjectId,
    arm: &'a ArmTool,
    motion: &'a Motion,
    /// From when to when, seconds since the motion began.
    span_s: [f64; 2],
}

impl<'a> Held<'a> {
    /// Of a step whose object was held until it was where it was to be.
    pub fn in_step(arm: &'a ArmTool, outcome: &'a StepOutcome) -> Option<Self> {
        let grip = outcome.record.push.as_ref()?.grip.as_ref().filter(|grip| grip.end.is_held())?;
        let number = grip.object.as_ref()?.rsplit('#').next()?.parse().ok()?;
        let (motion, planned) = (outcome.motion.as_ref()?, outcome.record.decision.motion.as_ref()?);
        // First the arm goes to where it waits.
        let before_s = (motion.duration_s() - planned.duration_s(&arm.arm)).max(0.0);
        let span_s = planned.carry_s()?.map(|s| before_s + s);
        Some(Self { object: ObjectId(number), arm, motion, span_s })
    }

    /// Where it is at a time of the motion, when it stood at `before`: it moves with the hand, and stays where it is set down.
    pub fn pose_at(&self, at_s: f64, before: &Pose) -> Option<Pose> {
        let [from_s, to_s] = self.span_s;
        let hand = |at_s: f64| Some(pose_of(&self.arm.arm.world_from_tool(&self.motion.at(at_s)?)));
        Some(hand(at_s.clamp(from_s, to_s))? * hand(from_s)?.inverse() * before)
    }
}

/// The path of the tip.
pub fn path(arm: &ArmTool, motion: &Motion) -> rerun::LineStrips3D {
    let tip = |(_, joints): (f64, Joints)| -> [f32; 3] {
        arm.arm.world_from_tool(&joints).translation.vector.map(|v| v as f32).into()
    };
    let stops = motion.stops.iter().map(|stop| (stop.at_s, stop.joints));
    // Between stops the joints move straight, the tip does not.
    let mut fine: Vec<(f64, Joints)> = frames(motion).into_iter().chain(stops).collect();
    fine.sort_by(|a, b| a.0.total_cmp(&b.0));
    rerun::LineStrips3D::new([fine.into_iter().map(tip).collect::<Vec<_>>()])
        .with_colors([rerun::Color::from(PATH_RGB)])
        .with_radii([rerun::Radius::new_ui_points(1.8)])
}

/// The camera positions of all views: green if the hand can reach them, grey if not.
pub fn reachable(array: &ViewArray, unreachable: &[ViewId]) -> rerun::Points3D {
    let reached = |id: &ViewId| !unreachable.contains(id);
    rerun::Points3D::new(array.views.iter().map(|view| <[f32; 3]>::from(view.position().coords)))
        .with_colors(
            array
                .views
                .iter()
                .map(|view| rerun::Color::from(if reached(&view.id) { REACHED_RGB } else { REJECTED_RGB })),
        )
        .with_radii(array.views.iter().map(|view| if reached(&view.id) { 0.005_f32 } else { 0.003 }))
}

impl Recorder {
    /// Records how the arm moved in a step: pose by pose on the robot's own clock, and on the steps' timeline where it
    /// looked, or the end of its push.
    pub(super) fn robot(&mut self, setting: &Setting<'_>, step: usize, outcome: Option<&StepOutcome>) -> Result<()> {
        self.stream.set_time_sequence(paths::TIMELINE, step as i64);
        self.stream.set_duration_secs(paths::ROBOT_TIMELINE, self.robot_s);
        let arm = setting.arm;
        let pose = |joints: &Joints| {
            let transforms = transforms(arm, joints);
            transforms
                .iter()
                .enumerate()
                .try_for_each(|(number, transform)| self.log(&paths::robot_body(number), transform))
        };
        let moved = outcome.and_then(|outcome| Some((outcome, outcome.motion.as_ref()?)));
        let Some((outcome, motion)) = moved else {
            if let (None, Some(ready)) = (outcome, &arm.ready) {
                pose(ready)?;
            }
            return self.log(paths::ROBOT_PATH, &rerun::Clear::flat());
        };
        self.log(paths::ROBOT_PATH, &path(arm, motion))?;
        let held = Held::in_step(arm, outcome).and_then(|held| Some((*self.shown.get(&held.object)?, held)));
        for (at_s, joints) in frames(motion) {
            self.stream.set_duration_secs(paths::ROBOT_TIMELINE, self.robot_s + at_s);
            pose(&joints)?;
            // What is in hand goes with it.
            if let Some((before, held)) = &held
                && let Some(pose) = held.pose_at(at_s, before)
            {
                self.log(&paths::object(held.object), &shapes::transform(&pose))?;
            }
        }
        // The last row of a step is the one that its timeline shows.
        let pushes = matches!(outcome.record.action, Action::Manipulate(_));
        let shown_s = shown_at_s(arm, motion, &outcome.record.decision, pushes);
        if let Some(joints) = motion.at(shown_s) {
            self.stream.set_duration_secs(paths::ROBOT_TIMELINE, self.robot_s + shown_s);
            pose(&joints)?;
        }
        self.robot_s += motion.duration_s();
        self.stream.set_duration_secs(paths::ROBOT_TIMELINE, self.robot_s);
        Ok(())
    }
}
