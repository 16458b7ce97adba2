//! A world that another program carries: a robot, another simulator, a recording that is served.
//!
//! The program reads requests from its standard input and writes answers to its standard output, a line of JSON each
//! (`docs/world-protocol.md`); images are files in a folder that both know. What is late, out of turn or no answer ends the
//! conversation, and the episode can be gone on with when the program is back.

mod program;
mod wire;

use super::Environment;
use crate::arm::{Arm, Joints, PhaseKind, PhasedMotion};
use crate::camera::{Intrinsics, Pinhole, Sensed, View, ViewArray, ViewId, pose_from_quaternion};
use crate::recording::frame_of_files;
use crate::scene::Scene;
use crate::world::{Grip, GripEnd, ManipulationOutcome, TruthMap};
use crate::{Error, Pose, Result};
use program::Program;
use std::path::{Component, Path, PathBuf};
use wire::{Answer, Asked, Begin, Camera, FrameAnswer, Look, Move, MovedAnswer, ReadyAnswer};

/// The version of the protocol.
pub const PROTOCOL: u32 = 1;

/// How a world is begun.
#[derive(Clone, Debug)]
pub struct WorldSettings {
    /// The command, as a shell takes it.
    pub command: String,
    /// How long an answer may take, seconds.
    pub timeout_s: f64,
    /// The folder of the images.
    pub folder: PathBuf,
    /// The episode's seed, for programs that draw.
    pub seed: u64,
}

/// Another program's world.
pub struct External {
    program: Program,
    folder: PathBuf,
    views: Option<ViewArray>,
}

impl External {
    /// Starts the program and waits until it is ready. `done` are the motions that were carried out in the episode before: the
    /// world must stand as they left it.
    ///
    /// # Errors
    /// [`Error::Usage`] in one line: a program that does not start, does not answer in time, speaks another protocol, or gives
    /// views that are none.
    pub fn start(settings: &WorldSettings, scene: &Scene, done: &[PhasedMotion]) -> Result<Self> {
        let mut program = Program::start(settings)?;
        let arm = Arm::placed(&scene.robot)?;
        let scene = serde_json::to_value(scene).map_err(|error| Error::Usage(error.to_string()))?;
        let folder = settings.folder.to_string_lossy().into_owned();
        let done = done.iter().map(|motion| Move::of(motion, &names(&arm))).collect();
        let begin = Begin { protocol: PROTOCOL, folder, seed: settings.seed, scene, done };
        let ready = match program.ask(Asked::Begin(Box::new(begin)), "beginning")? {
            Answer::Ready(ready) => ready,
            other => return Err(program.wrong("ready", &other)),
        };
        if ready.protocol != PROTOCOL {
            let words = format!("speaks protocol {}, this version speaks {PROTOCOL}", ready.protocol);
            return Err(program.fail(&words));
        }
        let views = views(&ready).map_err(|words| program.fail(&words))?;
        Ok(Self { program, folder: settings.folder.clone(), views })
    }

    /// The file of an image that the program names; it lies in the folder.
    fn file(&self, name: &str) -> std::result::Result<PathBuf, String> {
        let inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        if name.is_empty() || !inside {
            return Err(format!("names the file `{}`, which is not in the shared folder", name.escape_default()));
        }
        Ok(self.folder.join(name))
    }

    fn read(&self, answer: &FrameAnswer, asked: &Look) -> std::result::Result<Sensed, String> {
        let depth = self.file(&answer.depth)?;
        let labels = answer.labels.as_ref().map(|name| self.file(name)).transpose()?;
        let camera = answer.camera.as_ref().unwrap_or(&asked.camera);
        let camera: Pinhole = camera.pinhole().map_err(|words| format!("gives a camera whose {words}"))?;
        let (position, quaternion) =
            (answer.position.unwrap_or(asked.position), answer.quaternion.unwrap_or(asked.quaternion));
        let pose = pose_from_quaternion(position, quaternion).map_err(|words| format!("gives a pose: {words}"))?;
        let frame = frame_of_files(&depth, answer.depth_unit_m, labels.as_deref(), camera, pose);
        Ok(Sensed { frame: frame.map_err(|error| format!("gives an image: {error}"))?, objects: None })
    }
}

/// The names of an arm's joints, in the order of a motion's numbers.
fn names(arm: &Arm) -> Vec<&str> {
    arm.joints.iter().map(|joint| joint.name.as_str()).collect()
}

/// The views that a program offers, if they are its own.
fn views(ready: &ReadyAnswer) -> std::result::Result<Option<ViewArray>, String> {
    let Some(offered) = &ready.views else { return Ok(None) };
    if offered.poses.is_empty() || offered.poses.len() > usize::from(u16::MAX) {
        return Err(format!("offers {} views", offered.poses.len()));
    }
    let camera = offered.camera.pinhole().map_err(|words| format!("offers views with a camera whose {words}"))?;
    let mut views = Vec::new();
    for (at, pose) in offered.poses.iter().enumerate() {
        let world_from_camera: Pose = pose_from_quaternion(pose.position, pose.quaternion)
            .map_err(|words| format!("offers views: view {at}: {words}"))?;
        let ahead = world_from_camera * crate::Point::new(0.0, 0.0, 0.45);
        let id = ViewId(at as u16);
        views.push(View { id, world_from_camera, target: ahead.coords.into(), slot: [id.0, 0, 0] });
    }
    let intrinsics = Intrinsics {
        width: camera.width,
        height: camera.height,
        focal_px: 0.5 * (camera.focal_px[0] + camera.focal_px[1]),
        depth_range_m: camera.depth_range_m,
    };
    let (name, layout) = (ViewArray::RECORDED.to_owned(), [views.len(), 1, 1]);
    Ok(Some(ViewArray { name, intrinsics, layout, views }))
}

impl Environment for External {
    fn frame(&mut self, view: &View, intrinsics: &Intrinsics) -> Result<Sensed> {
        let (pose, q) = (view.world_from_camera, view.world_from_camera.rotation);
        let look = Look {
            view: view.id.0,
            position: pose.translation.vector.into(),
            quaternion: [q.i, q.j, q.k, q.w],
            camera: Camera::of(&Pinhole::from(*intrinsics)),
        };
        let what = format!("looking from view {}", view.id.0);
        let answer = match self.program.ask(Asked::Look(Box::new(look.clone())), &what)? {
            Answer::Frame(answer) => answer,
            other => return Err(self.program.wrong("frame", &other)),
        };
        self.read(&answer, &look).map_err(|words| self.program.fail(&words))
    }

    fn carry_out(&mut self, arm: &Arm, motion: &PhasedMotion) -> Result<ManipulationOutcome> {
        match self.program.ask(Asked::Move(Move::of(motion, &names(arm))), "moving")? {
            Answer::Moved(moved) => outcome(arm, motion, &moved).map_err(|words| self.program.fail(&words)),
            other => Err(self.program.wrong("moved", &other)),
        }
    }

    fn truth(&self) -> Option<&TruthMap> {
        None
    }

    fn branch(&self) -> Option<Box<dyn Environment>> {
        None
    }

    fn views(&self) -> Option<&ViewArray> {
        self.views.as_ref()
    }
}

/// What became of a motion of which so many stops were passed.
fn outcome(arm: &Arm, motion: &PhasedMotion, moved: &MovedAnswer) -> std::result::Result<ManipulationOutcome, String> {
    let outward: Vec<Joints> = motion.outward().flat_map(|phase| phase.motion.path()).collect();
    let passed = moved.passed.unwrap_or(outward.len());
    if passed > outward.len() || passed == 0 {
        return Err(format!("passed {passed} of the {} stops before the retreat", outward.len()));
    }
    let in_contact = |phase: &&crate::arm::Phase| phase.kind != PhaseKind::Approach;
    let before: usize = motion.outward().filter(|phase| !in_contact(phase)).map(|phase| phase.motion.stops.len()).sum();
    let tip = |joints: &Joints| arm.world_from_tool(joints).translation.vector;
    let way_m = match (outward.get(before), outward[..passed].last()) {
        (Some(first), Some(last)) if passed > before => (tip(last) - tip(first)).norm() as f32,
        _ => 0.0,
    };
    let stalled = moved.stalled.unwrap_or(passed < outward.len());
    let there: f64 = motion.outward().map(|phase| phase.motion.duration_s()).sum();
    Ok(ManipulationOutcome {
        stalled,
        grip: motion
            .carries()
            .then(|| Grip { object: None, end: moved.grip.unwrap_or_else(|| likely_end(motion, stalled)) }),
        way_m,
        arm_s: (there + motion.way_back(arm).duration_s()) as f32,
        passed: outward[..passed].to_vec(),
        ..ManipulationOutcome::default()
    })
}

/// How holding an object ended, where the program does not say.
fn likely_end(motion: &PhasedMotion, stalled: bool) -> GripEnd {
    let is_stowed = motion.outward().any(|phase| phase.kind == PhaseKind::Stow);
    match (stalled, is_stowed) {
        (true, _) => GripEnd::NoSeal,
        (false, true) => GripEnd::Stowed,
        (false, false) => GripEnd::SetDown,
    }
}
