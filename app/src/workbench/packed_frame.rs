//! What the camera saw, packed: 1.5 MB of depth and labels in a tenth of a megabyte.

use super::packed::{packed, unpacked};
use nudge_core::Pose;
use nudge_core::camera::{Frame, Pinhole, PixelClasses};
use nudge_core::episode::StepOutcome;
use nudge_core::scene::CLASS_COUNT;
use std::path::Path;

/// A frame that is unpacked when it is looked at.
#[derive(Clone, Debug)]
pub struct PackedFrame {
    world_from_camera: Pose,
    intrinsics: Pinhole,
    depth_m: Box<[u8]>,
    classes: Classes,
}

#[derive(Clone, Debug)]
enum Classes {
    Labels(Box<[u8]>),
    Scores(Box<[u8]>),
}

impl PackedFrame {
    /// The frame, to the bit.
    pub fn of(frame: &Frame) -> Self {
        Self {
            world_from_camera: *frame.world_from_camera(),
            intrinsics: *frame.intrinsics(),
            depth_m: packed(&bytes_of(frame.depth_m())),
            classes: match frame.classes() {
                PixelClasses::Labels(labels) => Classes::Labels(packed(labels)),
                PixelClasses::Scores(scores) => Classes::Scores(packed(&bytes_of(scores))),
            },
        }
    }

    /// Takes the frame out of what a step brought.
    pub fn taken_from(outcome: Option<&mut StepOutcome>) -> Option<Self> {
        outcome?.frame.take().map(|frame| Self::of(&frame))
    }

    /// The frame; `None` for one without any reading.
    pub fn frame(&self) -> Option<Frame> {
        let pixels = self.intrinsics.width * self.intrinsics.height;
        let classes = match &self.classes {
            Classes::Labels(labels) => PixelClasses::Labels(unpacked(labels, pixels)),
            Classes::Scores(scores) => PixelClasses::Scores(numbers_of(scores, CLASS_COUNT * pixels)),
        };
        let depth_m = numbers_of(&self.depth_m, pixels);
        Frame::new(Path::new("frame"), self.world_from_camera, self.intrinsics, depth_m, classes).ok()
    }
}

fn bytes_of(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn numbers_of(packed: &[u8], len: usize) -> Vec<f32> {
    let bytes = unpacked(packed, 4 * len);
    bytes.chunks_exact(4).map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]])).collect()
}
