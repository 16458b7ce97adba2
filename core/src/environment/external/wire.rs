//! The lines of the protocol.

use crate::arm::PhasedMotion;
use crate::camera::Pinhole;
use crate::recording::opencv_pinhole;
use crate::world::GripEnd;
use serde::{Deserialize, Serialize};

/// A request, one line.
#[derive(Serialize)]
pub(super) struct Request {
    /// Counted from 0; the answer carries the same.
    pub(super) id: u64,
    #[serde(flatten)]
    pub(super) asked: Asked,
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Asked {
    Begin(Box<Begin>),
    Look(Box<Look>),
    Move(Move),
    End {},
}

#[derive(Serialize)]
pub(super) struct Begin {
    pub(super) protocol: u32,
    pub(super) folder: String,
    pub(super) seed: u64,
    pub(super) scene: serde_json::Value,
    pub(super) done: Vec<Move>,
}

#[derive(Clone, Serialize)]
pub(super) struct Look {
    pub(super) view: u16,
    pub(super) position: [f32; 3],
    pub(super) quaternion: [f32; 4],
    pub(super) camera: Camera,
}

/// A camera as OpenCV counts: pixel centres have whole numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Camera {
    width: usize,
    height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    distortion: [f32; 5],
}

impl Camera {
    pub(super) fn of(camera: &Pinhole) -> Self {
        let ([fx, fy], [cx, cy]) = (camera.focal_px.map(f64::from), camera.principal_px.map(f64::from));
        let (width, height) = (camera.width, camera.height);
        Self { width, height, fx, fy, cx: cx - 0.5, cy: cy - 0.5, distortion: camera.distortion }
    }

    pub(super) fn pinhole(&self) -> Result<Pinhole, String> {
        let mut camera = opencv_pinhole([self.width, self.height], [self.fx, self.fy], [self.cx, self.cy]);
        camera.distortion = self.distortion;
        camera.check().map(|()| camera).map_err(|(field, words)| format!("{field} {words}"))
    }
}

#[derive(Serialize)]
pub(super) struct Move {
    #[serde(skip_serializing_if = "Vec::is_empty")]
    joint_names: Vec<String>,
    phases: Vec<MovePhase>,
}

#[derive(Serialize)]
struct MovePhase {
    kind: crate::arm::PhaseKind,
    opening_m: f32,
    at_s: Vec<f64>,
    joints: Vec<Vec<f64>>,
}

impl Move {
    pub(super) fn of(motion: &PhasedMotion, joint_names: &[&str]) -> Self {
        let phase = |phase: &crate::arm::Phase| MovePhase {
            kind: phase.kind,
            opening_m: phase.opening_m,
            at_s: phase.motion.stops.iter().map(|stop| stop.at_s).collect(),
            joints: phase.motion.path().map(|joints| joints.to_vec()).collect(),
        };
        Self {
            joint_names: joint_names.iter().map(|name| (*name).to_owned()).collect(),
            phases: motion.phases.iter().map(phase).collect(),
        }
    }
}

/// An answer, one line.
#[derive(Debug, Deserialize)]
pub(super) struct Reply {
    pub(super) id: u64,
    #[serde(flatten)]
    pub(super) answer: Answer,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Answer {
    Ready(ReadyAnswer),
    Frame(FrameAnswer),
    Moved(MovedAnswer),
    Error(String),
}

impl Answer {
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Ready(_) => "ready",
            Self::Frame(_) => "frame",
            Self::Moved(_) => "moved",
            Self::Error(_) => "error",
        }
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct ReadyAnswer {
    pub(super) protocol: u32,
    pub(super) views: Option<Offered>,
}

/// Views of the program's own: nothing else can be looked from.
#[derive(Debug, Deserialize)]
pub(super) struct Offered {
    pub(super) camera: Camera,
    pub(super) poses: Vec<Posed>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Posed {
    pub(super) position: [f32; 3],
    pub(super) quaternion: [f32; 4],
}

#[derive(Debug, Deserialize)]
pub(super) struct FrameAnswer {
    pub(super) depth: String,
    pub(super) depth_unit_m: Option<f64>,
    pub(super) labels: Option<String>,
    pub(super) camera: Option<Camera>,
    pub(super) position: Option<[f32; 3]>,
    pub(super) quaternion: Option<[f32; 4]>,
}

#[derive(Debug, Deserialize)]
pub(super) struct MovedAnswer {
    pub(super) passed: Option<usize>,
    pub(super) stalled: Option<bool>,
    pub(super) grip: Option<GripEnd>,
}
