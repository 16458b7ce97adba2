//! Picks: a suction cup takes an object by its front, pulls it straight out of the shelf, and sets it down elsewhere.
//!
//! What can be taken is read from the belief alone. The object is a patch of one class on the floor ([`FloorPlan`]) that is
//! surely there, or the part of one that an object of its class covers (`instances`); its front is what its cells show to
//! the entrance. The cup touches where that front is flat enough over the cup's circle, and the object can leave where
//! everything before its own outline is believed free (`fronts`). It is set down where the board is seen free, or beside
//! the robot (`room`). The arm carries it lifted by a centimetre (`carry`).

mod carry;
mod fronts;
mod instances;
mod room;

use super::sampling::draw_until;
use super::{
    ArmClearance, Arrow, Candidate, Description, Fact, Ground, LIKELY, Manipulation, Outline, Parameter, Rejection,
    Skill, Stage, Unit,
};
use crate::arm::{Arm, ArmTool, Joints, PhaseKind, PhasedMotion, level_tool};
use crate::belief::{Belief, FloorPlan, Flow, Intervention, Patch, Stroke};
use crate::grid::{Grid, VoxelSet};
use crate::named;
use crate::rng::ChaCha8Rng;
use crate::world::{GripEnd, ManipulationOutcome};
use crate::{Point, Vector};
use room::Room;
use serde::{Deserialize, Serialize};

/// The chance that a pick succeeds, for weighing it: what the cup reports afterwards takes its place.
pub const HOLDS: f32 = 0.9;
/// The chance that an object that came off on the way no longer stands where it stood.
const LEFT: f32 = 0.5;
/// Side of the square that shows where an object is set down, metres.
const PLACE_MARK_M: f32 = 0.05;

/// One pick: the cup goes straight in and touches, the object comes straight out and is set down.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pick {
    /// The middle of the cup's rim where it touches, metres.
    pub contact: [f32; 3],
    /// Where the cup points, in the plane of the board, degrees counter-clockwise from +x (90 is straight into the shelf).
    pub direction_deg: f32,
    /// How far from where it stood the object is set down, along x and y, metres; `None` for beside the robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[f32; 2]>,
    /// How it ended, of one that was carried out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub end: Option<GripEnd>,
}

/// Where objects that are taken are set down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PickPlace {
    /// In the shelf, where it is seen free.
    #[default]
    Shelf,
    /// On a table beside the robot: it is out of the shelf for good.
    Tray,
}

impl PickPlace {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Shelf, Self::Tray];
}

impl std::fmt::Display for PickPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Shelf => "shelf",
            Self::Tray => "tray",
        })
    }
}

impl std::str::FromStr for PickPlace {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        named::parse(&Self::ALL, text)
    }
}

impl Pick {
    fn touch(&self) -> Point {
        self.contact.into()
    }

    /// Where the cup points, unit.
    fn ahead(&self) -> Vector {
        let (sin, cos) = self.direction_deg.to_radians().sin_cos();
        Vector::new(cos, sin, 0.0)
    }

    /// How far it is turned from pointing straight in, radians.
    fn yaw_rad(&self) -> f64 {
        (f64::from(self.direction_deg) - 90.0).to_radians()
    }

    /// The object that it takes: what surely stands where the cup touches, or just behind.
    fn target(&self, plan: &FloorPlan, grid: &Grid) -> Option<Patch> {
        let step = 0.5 * grid.voxel_m;
        let behind = (0..8).map(|i| self.touch() + self.ahead() * (step * i as f32));
        let met = behind.filter_map(|point| grid.cell_at(point)).map(|cell| grid.cell_index(cell));
        met.into_iter().find(|cell| plan.stands(*cell)).map(|cell| instances::object(plan, grid, cell))
    }

    /// Its straight way of the tip: how far in the cup reaches over the object is none of it.
    fn stroke(&self) -> Stroke {
        let out_m = self.contact[1].max(0.0);
        Stroke { start: self.touch(), direction: Vector::new(0.0, -1.0, 0.0), length_m: out_m }
    }
}

impl Skill for Pick {
    /// Every pick that the belief offers, those of the objects nearest to the entrance first, up to `count` feasible ones.
    fn sample(ground: &Ground<'_>, count: usize, rng: &mut ChaCha8Rng) -> Vec<Candidate> {
        let Some(cup) = ground.arm.arm.cup else { return Vec::new() };
        let clearance = ArmClearance::new(ground.arm, ground.belief);
        let shelf = fronts::Shelf::new(ground);
        let offers = fronts::offers(&shelf, cup.radius_m as f32, ground.place);
        let mut offered = offers.into_iter();
        draw_until(
            count,
            offered.len(),
            rng,
            |_| offered.next(),
            |offer, rng| {
                let Some(offer) = offer else { unreachable!("as many draws as offers") };
                let motion = match offer.against {
                    Some(against) => Err(against),
                    None => carry::motion(&offer.pick, &clearance, &offer.target, rng),
                };
                Candidate::of(offer.contact, offer.pick.into(), motion, ground.belief, ground.arm)
            },
        )
    }

    fn is_finite(&self) -> bool {
        let place = self.place.unwrap_or_default();
        self.contact.iter().chain(&place).chain([&self.direction_deg]).all(|number| number.is_finite())
    }

    fn plan(&self, clearance: &ArmClearance<'_>, rng: &mut ChaCha8Rng) -> Result<PhasedMotion, Rejection> {
        let target = self.target(clearance.plan(), clearance.grid()).ok_or(Rejection::NoTarget)?;
        let (blocks, nothing) = (|voxel: usize| clearance.is_avoided(voxel), |_: usize| false);
        let room = Room { grid: clearance.grid(), blocks: &blocks, is_taken: &blocks, is_unknown: &nothing };
        room.way_out(&target)?;
        if let Some(place) = self.place {
            room.place(&target, place)?;
        }
        carry::motion(self, clearance, &target, rng)
    }

    fn is_done_by(&self, motion: &PhasedMotion, arm: &Arm, ready: &Joints) -> bool {
        let from = self.touch() - self.ahead() * carry::FEEL_M;
        let to = self.place.map(|[x, y]| self.touch() + Vector::new(x, y, carry::GAP_M));
        motion.leads_in(PhaseKind::Carry, arm, ready, from, to)
    }

    fn swept_by_gripper(&self, arm: &ArmTool, belief: &Belief) -> VoxelSet {
        let mut swept = VoxelSet::empty(&belief.grid);
        let touch = level_tool(&self.touch().map(f64::from), self.yaw_rad());
        let out = nalgebra::Vector3::new(0.0, -f64::from(self.contact[1].max(0.0)), 0.0);
        arm.arm.sweep_gripper(&touch, &out, &belief.grid, &mut swept);
        swept
    }

    /// What is held moves as a whole; nothing else does.
    fn intervention(&self, belief: &Belief, _solid: &FloorPlan, swept: VoxelSet) -> Intervention {
        let (grid, stroke) = (&belief.grid, self.stroke());
        let nothing = |swept| Intervention { swept, flow: Flow::nothing(), stroke, held: Some(0.0) };
        let Some(target) = self.target(&FloorPlan::new(belief, LIKELY), grid) else { return nothing(swept) };
        let away = || Flow::away(grid, &target);
        let (flow, held) = match (self.end, self.place) {
            (Some(GripEnd::NoSeal), _) => return nothing(swept),
            (Some(GripEnd::CameOff), _) => (away(), LEFT),
            (end, Some(place)) => (Flow::rigid(grid, &target, place), end.map_or(HOLDS, |_| 1.0)),
            (end, None) => (away(), end.map_or(HOLDS, |_| 1.0)),
        };
        Intervention { swept, flow, stroke, held: Some(held) }
    }

    fn way_m(&self) -> f32 {
        self.stroke().length_m
    }

    fn shortened(&self, _way_m: f32) -> Manipulation {
        (*self).into()
    }

    fn done(&self, outcome: &ManipulationOutcome) -> Manipulation {
        let end = outcome.grip.map_or(GripEnd::NoSeal, |grip| grip.end);
        Self { end: Some(end), ..*self }.into()
    }

    fn describe(&self) -> Description {
        let [x, y, z] = self.contact;
        let mm = |m: f32| format!("{:.0} mm", m.abs() * 1e3);
        let to = match self.place {
            None => "beside the robot".to_owned(),
            Some([dx, dy]) => {
                let aside = format!("{} {}", mm(dx), if dx < 0.0 { "left" } else { "right" });
                format!("{aside}, {} {}", mm(dy), if dy < 0.0 { "nearer" } else { "deeper" })
            }
        };
        let parameter = |field, name, column, value, unit, hint| Parameter { field, name, column, value, unit, hint };
        let touched = "Where the cup touches";
        let mut parameters = vec![
            parameter("start_x_m", "from x", None, x, Unit::Metres, touched),
            parameter("start_y_m", "from y", None, y, Unit::Metres, touched),
            parameter("start_z_m", "from z", None, z, Unit::Metres, touched),
            parameter(
                "direction_deg",
                "towards",
                Some("To"),
                self.direction_deg,
                Unit::Degrees,
                "Where the cup points",
            ),
        ];
        if let Some([dx, dy]) = self.place {
            let hint = "How far from where it stood the object is set down";
            parameters.push(parameter("place_x_m", "aside", None, dx, Unit::Millimetres, hint));
            parameters.push(parameter("place_y_m", "deeper", None, dy, Unit::Millimetres, hint));
        }
        Description {
            words: format!("pick, set down {to}"),
            short: format!("at ({x:.2}, {y:.2}), set down {to}"),
            facts: vec![
                Fact { name: "at", text: format!("x {x:.2}, y {y:.2}, z {z:.2} m"), hint: touched },
                Fact {
                    name: "set down",
                    text: to,
                    hint: "Where the object is set down, from where it stood: right and deeper into the shelf, or left and \
                           nearer to the entrance",
                },
            ],
            parameters,
        }
    }

    /// The way out, and the object's way to where it is set down.
    fn outline(&self) -> Outline {
        let stroke = self.stroke();
        let mut lines = Vec::new();
        if let Some([dx, dy]) = self.place {
            let (out, to) = (stroke.end(), stroke.start + Vector::new(dx, dy, 0.0));
            let before = Point::new(to.x, out.y, to.z);
            lines.push(vec![out, before, to]);
            let half = 0.5 * PLACE_MARK_M;
            let corner = |x: f32, y: f32| Point::new(to.x + x * half, to.y + (y + 1.0) * half, 0.002);
            lines.push(
                [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(x, y)| corner(x, y)).into(),
            );
        }
        Outline { arrows: vec![Arrow { start: stroke.start, way: stroke.direction * stroke.length_m }], lines }
    }
}

/// A stage of a pick as rejections name it.
const OUT: Stage = Stage::Contact;

#[cfg(test)]
#[path = "pick_tests.rs"]
mod tests;
