//! A recording: frames from the poses that its camera had, nothing to move, no truth.

use super::Environment;
use crate::arm::{Arm, PhasedMotion};
use crate::camera::{Intrinsics, Pinhole, Sensed, View, ViewArray, ViewId};
use crate::recording::{Board, Recording, Survey};
use crate::world::{ManipulationOutcome, TruthMap};
use crate::{Error, Result, Vector};
use std::sync::Arc;

/// How far ahead of a camera the point lies that it is said to look at, metres.
const AHEAD_M: f32 = 0.45;

/// The frames of a recording that show its board. A view is a frame; a clone reads the same files.
#[derive(Clone)]
pub struct Recorded {
    recording: Arc<Recording>,
    board: Board,
    /// The frame of every view.
    used: Arc<Vec<usize>>,
    views: Arc<ViewArray>,
}

impl Recorded {
    /// The frames of a recording that its survey uses, in the recording's order.
    ///
    /// The views share one camera for the sake of the gain, the nearest of the plain kind to that of the first frame; every
    /// frame is projected through its own.
    pub fn new(recording: Arc<Recording>, board: Board, survey: &Survey) -> Self {
        let used = survey.used();
        let camera = used.first().map_or_else(|| *recording.camera(0), |first| *recording.camera(*first));
        let view = |(at, frame): (usize, &usize)| {
            let world_from_camera = survey.rows[*frame].board_from_camera.unwrap_or_default();
            let ahead = world_from_camera * (nalgebra::Point3::origin() + Vector::z() * AHEAD_M);
            View { id: ViewId(at as u16), world_from_camera, target: ahead.coords.into(), slot: [at as u16, 0, 0] }
        };
        let views = ViewArray {
            name: ViewArray::RECORDED.to_owned(),
            intrinsics: plain(&camera),
            layout: [used.len(), 1, 1],
            views: used.iter().enumerate().map(view).collect(),
        };
        Self { recording, board, used: Arc::new(used), views: Arc::new(views) }
    }
}

/// The camera without distortion, with square pixels and a central principal point that is most like another one.
fn plain(camera: &Pinhole) -> Intrinsics {
    Intrinsics {
        width: camera.width,
        height: camera.height,
        focal_px: 0.5 * (camera.focal_px[0] + camera.focal_px[1]),
        depth_range_m: camera.depth_range_m,
    }
}

impl Environment for Recorded {
    fn frame(&mut self, view: &View, _: &Intrinsics) -> Result<Sensed> {
        let at = self.used.get(usize::from(view.id.0));
        let at = *at.ok_or_else(|| Error::Usage(format!("the recording has no frame of view {}", view.id.0)))?;
        Ok(Sensed { frame: self.recording.frame(at, &self.board)?, objects: None })
    }

    fn carry_out(&mut self, _: &Arm, _: &PhasedMotion) -> Result<ManipulationOutcome> {
        Err(Error::Usage("nothing can be moved in a recording".to_owned()))
    }

    fn truth(&self) -> Option<&TruthMap> {
        None
    }

    fn branch(&self) -> Option<Box<dyn Environment>> {
        Some(Box::new(self.clone()))
    }

    fn views(&self) -> Option<&ViewArray> {
        Some(&self.views)
    }
}
