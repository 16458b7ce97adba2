//! One frame of a depth camera, wherever it comes from: what a belief is updated with.

use super::{Pinhole, UNOBSERVED, View};
use crate::scene::{CLASS_COUNT, OBJECT_CLASS_COUNT};
use crate::{Error, Point, Pose, Result};
use nalgebra::{Matrix3, Quaternion, Rotation3, Translation3, Unit, UnitQuaternion};
use std::borrow::Cow;
use std::path::Path;

/// A pixel of a label map that has no label.
pub const UNLABELLED: u8 = UNOBSERVED;
/// How far a rotation may be from one: the length of a quaternion from 1, the entries of `R R^T` from the identity.
const ROTATION_TOLERANCE: f32 = 1e-3;

/// What is known of the classes of a frame's pixels.
#[derive(Clone, Debug, PartialEq)]
pub enum PixelClasses {
    /// The class of every pixel, row-major from the top left, or [`UNLABELLED`]; background for shelf and emptiness.
    Labels(Vec<u8>),
    /// Scores per class, `[C][H][W]` with [`CLASS_COUNT`] classes, larger for likelier.
    Scores(Vec<f32>),
}

/// Where a camera was, what it was, and what it gave: row-major images from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    pub(super) world_from_camera: Pose,
    pub(super) intrinsics: Pinhole,
    pub(super) depth_m: Vec<f32>,
    pub(super) classes: PixelClasses,
}

/// What an environment gives from a view: a frame, and, if the environment can tell things apart, which pixels show the
/// same thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensed {
    /// The frame.
    pub frame: Frame,
    /// Per pixel the thing that it shows, [`u16::MAX`] where none: the simulator's objects. For counting what shows and for
    /// noise that takes a whole thing for another class; never for the belief.
    pub objects: Option<Vec<u16>>,
}

impl Frame {
    /// A frame from outside. `file` is what errors name.
    ///
    /// # Errors
    /// [`Error::Input`] that names file and field: depth or scores that are no numbers, negative depth, an image in which no
    /// pixel has any depth, another size than the intrinsics', classes that there are not.
    pub fn new(
        file: &Path,
        world_from_camera: Pose,
        intrinsics: Pinhole,
        depth_m: Vec<f32>,
        classes: PixelClasses,
    ) -> Result<Self> {
        let frame = Self { world_from_camera, intrinsics, depth_m, classes };
        frame.check(file)?;
        if frame.readings() == 0 {
            return Err(Error::input(file, "depth_m", "is 0 everywhere: the frame says nothing"));
        }
        Ok(frame)
    }

    pub(super) fn check(&self, file: &Path) -> Result<()> {
        let fail = |field: &str, words: String| Err(Error::input(file, field, words));
        if let Err((field, words)) = self.intrinsics.check() {
            return fail(field, words);
        }
        if !self.world_from_camera.translation.vector.iter().all(|m| m.is_finite() && m.abs() <= 100.0) {
            return fail("world_from_camera", "its position must be finite and within 100 m".to_owned());
        }
        let [width, height] = self.size();
        let (pixels, at) = (width * height, |index: usize| {
            format!("row {}, column {}", index % (width * height) / width, index % width)
        });
        let same_size = |field: &str, count: usize, classes: usize| {
            if count == pixels * classes {
                return Ok(());
            }
            let layers = if classes > 1 { format!(" of {classes} classes") } else { String::new() };
            fail(field, format!("{count} values, but the intrinsics are of {width} x {height} pixels{layers}"))
        };
        same_size("depth_m", self.depth_m.len(), 1)?;
        if let Some(index) = self.depth_m.iter().position(|depth| !depth.is_finite() || *depth < 0.0) {
            let depth = self.depth_m[index];
            return fail("depth_m", format!("{}: is {depth}; metres, or 0 where there is none, are needed", at(index)));
        }
        match &self.classes {
            PixelClasses::Labels(labels) => {
                same_size("labels", labels.len(), 1)?;
                let known = |label: u8| usize::from(label) < CLASS_COUNT || label == UNLABELLED;
                if let Some(index) = labels.iter().position(|label| !known(*label)) {
                    let words = format!("{}: class {} of {CLASS_COUNT}", at(index), labels[index]);
                    return fail("labels", words);
                }
            }
            PixelClasses::Scores(scores) => {
                same_size("scores", scores.len(), CLASS_COUNT)?;
                if let Some(index) = scores.iter().position(|score| !score.is_finite()) {
                    return fail("scores", format!("class {}, {}: is {}", index / pixels, at(index), scores[index]));
                }
            }
        }
        Ok(())
    }

    /// The camera's pose.
    pub fn world_from_camera(&self) -> &Pose {
        &self.world_from_camera
    }

    /// Where the camera is, metres.
    pub fn position(&self) -> Point {
        Point::from(self.world_from_camera.translation.vector)
    }

    /// The camera.
    pub fn intrinsics(&self) -> &Pinhole {
        &self.intrinsics
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.intrinsics.width, self.intrinsics.height]
    }

    /// Depth per pixel: the distance along the optical axis, metres; 0 where the sensor gave none.
    pub fn depth_m(&self) -> &[f32] {
        &self.depth_m
    }

    /// What is known of the pixels' classes.
    pub fn classes(&self) -> &PixelClasses {
        &self.classes
    }

    /// Number of pixels with a depth.
    pub fn readings(&self) -> usize {
        self.depth_m.iter().filter(|depth| **depth > 0.0).count()
    }

    /// The class of every pixel, or [`UNLABELLED`]: of scores the class with the largest, unless another has as much.
    pub fn labels(&self) -> Cow<'_, [u8]> {
        match &self.classes {
            PixelClasses::Labels(labels) => Cow::Borrowed(labels),
            PixelClasses::Scores(scores) => {
                let pixels = self.depth_m.len();
                Cow::Owned((0..pixels).map(|at| likeliest(scores, pixels, at)).collect())
            }
        }
    }

    /// The same frame, as if the camera had been elsewhere.
    pub(super) fn moved_to(self, world_from_camera: Pose) -> Self {
        Self { world_from_camera, ..self }
    }
}

fn likeliest(scores: &[f32], pixels: usize, at: usize) -> u8 {
    let score = |class: usize| scores[class * pixels + at];
    let best = (1..CLASS_COUNT).fold(0, |best, class| if score(class) > score(best) { class } else { best });
    let tied = (0..CLASS_COUNT).any(|class| class != best && score(class) == score(best));
    if tied { UNLABELLED } else { best as u8 }
}

/// Which pixels show the same thing, for frames that do not say: regions of one object class that touch along an edge get a
/// number each; [`u16::MAX`] elsewhere.
pub(super) fn regions(labels: &[u8], width: usize) -> Vec<u16> {
    let is_object = |label: u8| usize::from(label) < OBJECT_CLASS_COUNT;
    let mut regions = vec![u16::MAX; labels.len()];
    let (mut count, mut open) = (0, Vec::new());
    for start in 0..labels.len() {
        if regions[start] != u16::MAX || !is_object(labels[start]) || count == u16::MAX {
            continue;
        }
        regions[start] = count;
        open.push(start);
        while let Some(at) = open.pop() {
            let column = at % width;
            let beside = [
                (column > 0).then(|| at - 1),
                (column + 1 < width).then_some(at + 1),
                at.checked_sub(width),
                Some(at + width).filter(|below| *below < labels.len()),
            ];
            for next in beside.into_iter().flatten() {
                if regions[next] == u16::MAX && labels[next] == labels[start] {
                    regions[next] = count;
                    open.push(next);
                }
            }
        }
        count += 1;
    }
    regions
}

/// The pose at a position with a rotation that is given as a quaternion `x`, `y`, `z`, `w`. Its numbers are kept as they are.
///
/// # Errors
/// In words, for what is no rotation.
pub fn pose_from_quaternion(position: [f32; 3], xyzw: [f32; 4]) -> std::result::Result<Pose, String> {
    let [x, y, z, w] = xyzw;
    let quaternion = Quaternion::new(w, x, y, z);
    let norm = quaternion.norm();
    if (norm - 1.0).abs() <= ROTATION_TOLERANCE {
        return Ok(Pose::from_parts(Translation3::from(position), Unit::new_unchecked(quaternion)));
    }
    Err(format!("the quaternion {xyzw:?} is no rotation: its length is {norm}, not 1"))
}

/// The pose of a row-major 4 x 4 matrix.
///
/// # Errors
/// In words, for what is no rotation and translation.
pub fn pose_from_matrix(rows: [[f32; 4]; 4]) -> std::result::Result<Pose, String> {
    let axes = Matrix3::from_fn(|row, column| rows[row][column]);
    let off = (axes * axes.transpose() - Matrix3::identity()).abs().max();
    let upright = axes.determinant() > 0.0;
    if !(off <= ROTATION_TOLERANCE && upright) || rows[3] != [0.0, 0.0, 0.0, 1.0] {
        return Err("the matrix is no rotation and translation".to_owned());
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Ok(Pose::from_parts(Translation3::new(rows[0][3], rows[1][3], rows[2][3]), rotation))
}

impl View {
    /// The same view from another place.
    pub(super) fn moved_to(&self, world_from_camera: Pose) -> Self {
        Self { world_from_camera, ..self.clone() }
    }
}

#[cfg(test)]
#[path = "frame_tests.rs"]
mod tests;
