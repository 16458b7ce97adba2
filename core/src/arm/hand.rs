//! Which views the hand can reach, and how it moves from one to the next.
//!
//! A view is offered only if the camera in hand can be there: there is a configuration within the joints' limits, clear
//! of table, shelf and the arm itself (upright, or upside down), and a path to it from the waiting configuration. While
//! the arm looks, it stays outside of the shelf, whatever stands in it.

use super::plan::{PlanSettings, plan, turned};
use super::segment::is_segment_free;
use super::shortcut::shortcut;
use super::tool::ArmTool;
use super::{Hit, Joints, Motion, Space, frame_of};
use crate::Pose;
use crate::rng::{ChaCha8Rng, stream};
use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

/// Speed of the tool between two views, metres per second.
pub const HAND_M_S: f64 = 0.50;
/// Attempts to shorten the way between two views.
const SHORTCUTS: usize = 30;
/// Number of configurations already reached from which a straight path to a view is tried, the nearest first.
const NEIGHBOURS: usize = 4;
/// Work of the search for a view that no straight way leads to, and how many such searches may fail.
const QUERY: PlanSettings = PlanSettings { rounds: 300, shortcuts: 20 };
const SEARCHES: usize = 4;
/// How often the views that were not reached are tried again from what has been reached since.
const PASSES: usize = 3;

/// A configuration with the hand at a view, and the path there from the waiting configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct HandPose {
    /// Configurations from the waiting one to this one, straight in between; never empty.
    way: Vec<Joints>,
}

impl HandPose {
    /// Where the arm waits.
    pub fn waiting(ready: Joints) -> Self {
        Self { way: vec![ready] }
    }

    /// The configuration.
    pub fn joints(&self) -> Joints {
        self.way[self.way.len() - 1]
    }
}

/// Why the hand cannot reach a view.
#[derive(Clone, Debug, PartialEq)]
pub enum HandFault {
    /// No configuration within the limits has the camera there.
    OutOfReach,
    /// Something is in the way of the configuration that comes closest.
    Blocked(Hit),
    /// The configuration is free, but no path to it was found.
    NoWay,
}

impl std::fmt::Display for HandFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::OutOfReach => write!(f, "out of reach"),
            Self::Blocked(hit) => write!(f, "{hit}"),
            Self::NoWay => write!(f, "no free way there"),
        }
    }
}

impl ArmTool {
    /// Per camera pose, how the hand gets there; `None` where it cannot be.
    ///
    /// The views lie close together, so their configurations make a roadmap: from where the arm waits the hand goes on to
    /// the next view wherever the straight way is free. The result depends on arm, shelf and poses alone, not on threads.
    pub fn hand_poses(&self, world_from_camera: &[Pose]) -> Vec<Option<HandPose>> {
        let mut reached: Vec<Option<HandPose>> = vec![None; world_from_camera.len()];
        let Some(ready) = self.ready else { return reached };
        let space = Space::closed(&self.arm, &self.shelf);
        let places = |pose: &Pose| -> Vec<Joints> {
            let branches = self.branches(pose, &ready).into_iter();
            branches.filter(|joints| space.room_m(joints) >= 0.0).collect()
        };
        let places: Vec<Vec<Joints>> = world_from_camera.par_iter().map(places).collect();
        let travel =
            |view: usize| places[view].iter().map(|q| self.arm.travel_m(q, &ready)).fold(f64::INFINITY, f64::min);
        let mut order: Vec<usize> = (0..places.len()).filter(|view| !places[*view].is_empty()).collect();
        order.sort_by(|a, b| travel(*a).total_cmp(&travel(*b)).then(a.cmp(b)));
        let mut roadmap = vec![HandPose::waiting(ready)];
        let mut failed = 0;
        for pass in 0..PASSES * (1 + SEARCHES) {
            let before = roadmap.len();
            order.retain(|&view| {
                let hand = places[view].iter().find_map(|joints| go_on(&space, &roadmap, joints));
                roadmap.extend(hand.clone());
                reached[view] = hand;
                reached[view].is_none()
            });
            if roadmap.len() > before {
                continue;
            }
            // None of the rest is a straight way away: a search for one of them may bring its neighbours too.
            let Some(view) = order.get(failed * order.len() / SEARCHES).copied().filter(|_| failed < SEARCHES) else {
                break;
            };
            let goals: Vec<Vec<Joints>> =
                places[view].iter().flat_map(|joints| turned(&self.arm, &[*joints])).collect();
            match plan(&space, &ready, &goals, QUERY, &mut stream(0, "ways of the hand", pass as u64)) {
                Some(planned) => {
                    let hand = HandPose { way: planned.path };
                    roadmap.push(hand.clone());
                    reached[view] = Some(hand);
                    order.retain(|other| *other != view);
                }
                None => failed += 1,
            }
        }
        reached
    }

    /// Configurations that have the camera at a pose: upright first, then upside down, since a picture is easily turned.
    fn branches(&self, pose: &Pose, ready: &Joints) -> Vec<Joints> {
        let half_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let camera = frame_of(pose);
        let tools = [camera, camera * half_turn].into_iter().filter_map(|camera| self.arm.tool_for_camera(&camera));
        tools.flat_map(|tool| self.arm.inverse(&tool, ready)).collect()
    }

    /// Why the hand cannot be at a camera pose for which [`ArmTool::hand_poses`] finds no way.
    pub fn hand_fault(&self, pose: &Pose) -> HandFault {
        let Some(ready) = self.ready else { return HandFault::OutOfReach };
        let space = Space::closed(&self.arm, &self.shelf);
        let closest =
            self.branches(pose, &ready).into_iter().max_by(|a, b| space.room_m(a).total_cmp(&space.room_m(b)));
        match closest {
            None => HandFault::OutOfReach,
            Some(joints) => space.hit(&joints).map_or(HandFault::NoWay, HandFault::Blocked),
        }
    }

    /// The hand's motion from one place to another, outside the shelf: straight if that is free, else a shortened way past
    /// where the arm waits. The same stream gives the same motion.
    pub fn carry(&self, from: &HandPose, to: &HandPose, rng: &mut ChaCha8Rng) -> Motion {
        let space = Space::closed(&self.arm, &self.shelf);
        let mut path: Vec<Joints> = from.way.iter().rev().chain(to.way.iter().skip(1)).copied().collect();
        path.dedup();
        Motion::along(&self.arm, &shortcut(&space, path, SHORTCUTS, rng), HAND_M_S)
    }
}

/// The way to a configuration from the nearest place of the roadmap from which the straight way is free.
fn go_on(space: &Space<'_>, roadmap: &[HandPose], to: &Joints) -> Option<HandPose> {
    let mut near: Vec<(f64, usize)> =
        roadmap.iter().enumerate().map(|(at, place)| (space.arm.travel_m(&place.joints(), to), at)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut near = near.into_iter().take(NEIGHBOURS).map(|(_, at)| &roadmap[at]);
    let from = near.find(|place| is_segment_free(space, &place.joints(), to))?;
    Some(HandPose { way: from.way.iter().chain([to]).copied().collect() })
}
