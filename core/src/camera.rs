//! Cameras: arrays of views, frames (depth and classes as a camera gives them), frames of a simulated shelf by ray casting,
//! the noise model, and the projection of a frame into the grid.
//!
//! A camera looks along its own +z with x right and y down (the usual optical frame); `world_from_camera` places it
//! in the shelf's frame. Depth is the distance along the optical axis, metres.

mod depth_code;
mod frame;
mod frame_file;
mod noise;
mod pinhole;
mod project;
mod reach;
mod render;
mod view_record;
mod views;
mod visibility;
mod watch;

pub use frame::{Frame, PixelClasses, Sensed, UNLABELLED, pose_from_matrix, pose_from_quaternion};
pub use noise::NoiseModel;
pub use pinhole::Pinhole;
pub use project::project;
pub use render::render;
pub use visibility::{ObjectVisibility, UNSEEN_PX, hidden_count, hidden_objects, hidden_objects_while, visibility};
pub use watch::HiddenWatch;

use crate::grid::VoxelSet;
use crate::{Point, Pose, Vector};
use serde::{Deserialize, Serialize};

/// A view by its position in its array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ViewId(pub u16);

/// The camera of a view array: a pinhole without distortion whose principal point is the image's centre. Frames carry the
/// whole [`Pinhole`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intrinsics {
    /// Image width, pixels.
    pub width: usize,
    /// Image height, pixels.
    pub height: usize,
    /// Focal length, pixels.
    pub focal_px: f32,
    /// Nearest and farthest depth that the sensor reports, metres.
    #[serde(deserialize_with = "crate::fixed::array")]
    pub depth_range_m: [f32; 2],
}

impl Intrinsics {
    /// The ray through the centre of a pixel, in the camera's frame and one metre deep: `depth * ray` is the point seen.
    pub fn ray(&self, column: usize, row: usize) -> Vector {
        let across = |pixel: usize, pixels: usize| (pixel as f32 + 0.5 - 0.5 * pixels as f32) / self.focal_px;
        Vector::new(across(column, self.width), across(row, self.height), 1.0)
    }

    /// Principal point, pixels: the image's centre.
    pub fn principal_px(&self) -> [f32; 2] {
        [0.5 * self.width as f32, 0.5 * self.height as f32]
    }
}

/// One candidate camera pose.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Its position in the array.
    pub id: ViewId,
    /// The camera's pose.
    pub world_from_camera: Pose,
    /// The point that it looks at, metres.
    pub target: [f32; 3],
    /// Column and row in the array's positions and the number of the look-at target, for heat maps.
    pub slot: [u16; 3],
}

impl View {
    /// Where the camera is, metres.
    pub fn position(&self) -> Point {
        Point::from(self.world_from_camera.translation.vector)
    }
}

/// An array of candidate views that share one camera. Serialises with all of its poses, to the bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "view_record::Filed", into = "view_record::Filed")]
pub struct ViewArray {
    /// `standard300`, `real75`, or the name in a file of one's own.
    pub name: String,
    /// The camera.
    pub intrinsics: Intrinsics,
    /// Number of positions across, of positions up, and of look-at targets.
    pub layout: [usize; 3],
    /// The views, by id.
    pub views: Vec<View>,
}

/// No label: the cell was not seen.
pub const UNOBSERVED: u8 = u8::MAX;

/// A frame projected into the grid: what the belief update sees.
#[derive(Clone, Debug, PartialEq)]
pub struct MapObservation {
    /// Voxels seen through.
    pub free: VoxelSet,
    /// Voxels seen as surface.
    pub occupied: VoxelSet,
    /// Class of the top-most labelled point per floor cell, or [`UNOBSERVED`].
    pub labels: Vec<u8>,
}

#[cfg(test)]
mod tests;
