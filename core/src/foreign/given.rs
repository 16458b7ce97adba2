//! Beliefs that are there already, as an episode: one step for each, in which nothing is measured.

use crate::arm::{Arm, PhasedMotion};
use crate::belief::{Belief, BeliefUpdate, Intervention, Prediction};
use crate::camera::{Frame, Intrinsics, MapObservation, Pinhole, PixelClasses, Sensed, View, ViewArray, ViewId};
use crate::environment::Environment;
use crate::scene::BACKGROUND;
use crate::world::{ManipulationOutcome, TruthMap};
use crate::{Error, Point, Pose, Result, Vector};
use nalgebra::{Translation3, UnitQuaternion};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Name of the belief update of episodes whose beliefs were converted from files.
pub const CONVERTED: &str = "converted";

/// Answers the next of some beliefs to every observation.
#[derive(Debug)]
pub struct Given {
    beliefs: Vec<Belief>,
    next: AtomicUsize,
}

impl Given {
    /// An update that gives these beliefs, the first first.
    pub fn new(beliefs: Vec<Belief>) -> Self {
        Self { beliefs, next: AtomicUsize::new(0) }
    }
}

impl BeliefUpdate for Given {
    fn name(&self) -> &str {
        CONVERTED
    }

    fn observe(&self, belief: &Belief, _: &MapObservation) -> Belief {
        self.beliefs.get(self.next.fetch_add(1, Ordering::Relaxed)).unwrap_or(belief).clone()
    }

    fn predict(&self, _: &Belief, _: &[Intervention]) -> Vec<Prediction> {
        Vec::new()
    }
}

/// Surroundings of which nothing is known but what was converted: a camera that looks away from the shelf.
#[derive(Clone, Debug)]
pub struct Blank(ViewArray);

/// The camera of [`Blank`].
const CAMERA: Intrinsics = Intrinsics { width: 16, height: 12, focal_px: 16.0, depth_range_m: [0.1, 5.0] };

impl Blank {
    /// Surroundings in which so many looks can be taken.
    pub fn new(looks: usize) -> Self {
        // The optical axis, z, turns to -y: away from the shelf, before which the camera stands.
        let rotation = UnitQuaternion::from_axis_angle(&Vector::x_axis(), std::f32::consts::FRAC_PI_2);
        let world_from_camera = Pose::from_parts(Translation3::new(0.0, -0.5, 0.2), rotation);
        let target: [f32; 3] = (world_from_camera * Point::new(0.0, 0.0, 0.5)).coords.into();
        let view = |at: usize| View { id: ViewId(at as u16), world_from_camera, target, slot: [at as u16, 0, 0] };
        Self(ViewArray {
            name: ViewArray::RECORDED.to_owned(),
            intrinsics: CAMERA,
            layout: [looks, 1, 1],
            views: (0..looks).map(view).collect(),
        })
    }
}

impl Environment for Blank {
    fn frame(&mut self, view: &View, _: &Intrinsics) -> Result<Sensed> {
        let camera = Pinhole::from(CAMERA);
        let pixels = camera.width * camera.height;
        let classes = PixelClasses::Labels(vec![BACKGROUND.0; pixels]);
        let frame =
            Frame::new(Path::new("a converted map"), view.world_from_camera, camera, vec![1.0; pixels], classes)?;
        Ok(Sensed { frame, objects: None })
    }

    fn carry_out(&mut self, _: &Arm, _: &PhasedMotion) -> Result<ManipulationOutcome> {
        Err(Error::Usage("nothing can be moved in a converted map".to_owned()))
    }

    fn truth(&self) -> Option<&TruthMap> {
        None
    }

    fn branch(&self) -> Option<Box<dyn Environment>> {
        Some(Box::new(self.clone()))
    }

    fn views(&self) -> Option<&ViewArray> {
        Some(&self.0)
    }
}
