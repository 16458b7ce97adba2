//! What the camera saw in the looks, as small images.

use super::pack::deflated;
use nudge_core::camera::{Frame, NoiseModel};
use nudge_core::episode::{EpisodeDir, EpisodeRecord, StepRecord, Told};
use nudge_core::plan::Action;
use nudge_core::{Error, Point, Result};
use rayon::prelude::*;
use serde::Serialize;

/// Images are at most this wide, pixels.
const WIDTH: usize = 320;
/// How far the frustum of a camera is drawn, metres.
const FRUSTUM_M: f32 = 0.1;

/// What there is to know of an image.
#[derive(Clone, Debug, Serialize)]
pub struct Facts {
    /// The step of the look.
    pub step: usize,
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// The depths of the first and the last byte, metres.
    pub depth_m: [f32; 2],
    /// Where the camera was: its frustum, as one line.
    pub frustum: Vec<[f32; 3]>,
}

/// An image: its depths, row by row, each byte less the one to its left (0 where there is no depth, 1 to 255 from near to
/// far), and its labels (the class and one, 0 where there is none), compressed.
pub struct Image {
    /// What there is to know of it.
    pub facts: Facts,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// The images of the looks among the kept steps; none where frames were not filed.
pub fn pack(directory: &EpisodeDir, record: &EpisodeRecord, kept: &[usize]) -> Result<Vec<Image>> {
    let looks = record.steps.iter().filter(|step| matches!(step.action, Action::Look { .. }));
    let looks: Vec<&StepRecord> = looks.filter(|step| kept.binary_search(&step.index).is_ok()).collect();
    let images: Result<Vec<Option<Image>>> = looks.into_par_iter().map(|step| image(directory, record, step)).collect();
    Ok(images?.into_iter().flatten().collect())
}

fn image(directory: &EpisodeDir, record: &EpisodeRecord, step: &StepRecord) -> Result<Option<Image>> {
    let sensed = match directory.read_told(step) {
        Ok(Told::Frame(sensed)) => sensed,
        Ok(Told::Manipulation(_)) => return Ok(None),
        Err(Error::Io { reason, .. }) if reason.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let noise = record.config.noise.unwrap_or(NoiseModel::OFF);
    Ok(Some(small(&noise.apply(&sensed, record.config.seed, step.index as u64), step.index)))
}

fn small(frame: &Frame, step: usize) -> Image {
    let [full_width, full_height] = frame.size();
    let every = full_width.div_ceil(WIDTH).max(1);
    let (width, height) = (full_width.div_ceil(every), full_height.div_ceil(every));
    let depth_m = frame.intrinsics().depth_range_m;
    let [near, far] = depth_m;
    let labels = frame.labels();
    let mut bytes = Vec::with_capacity(2 * width * height);
    for row in 0..height {
        let mut left = 0_u8;
        for column in 0..width {
            let depth = frame.depth_m()[row * every * full_width + column * every];
            let share = ((depth - near) / (far - near)).clamp(0.0, 1.0);
            let now = if depth > 0.0 { 1 + (254.0 * share).round() as u8 } else { 0 };
            bytes.push(now.wrapping_sub(left));
            left = now;
        }
    }
    for row in 0..height {
        bytes.extend((0..width).map(|column| labels[row * every * full_width + column * every].wrapping_add(1)));
    }
    Image { facts: Facts { step, width, height, depth_m, frustum: frustum(frame) }, bytes: deflated(&bytes) }
}

/// The edges of a pyramid from the camera's centre through the corners of its image, as one line.
fn frustum(frame: &Frame) -> Vec<[f32; 3]> {
    let camera = frame.intrinsics();
    let place = |column: f32, row: f32, depth: f32| -> [f32; 3] {
        let across = |pixel: f32, axis: usize| (pixel - camera.principal_px[axis]) / camera.focal_px[axis] * depth;
        (frame.world_from_camera() * Point::new(across(column, 0), across(row, 1), depth)).coords.into()
    };
    let (right, bottom) = (camera.width as f32, camera.height as f32);
    let apex = place(camera.principal_px[0], camera.principal_px[1], 0.0);
    let [a, b, c, d] =
        [[0.0, 0.0], [right, 0.0], [right, bottom], [0.0, bottom]].map(|[column, row]| place(column, row, FRUSTUM_M));
    vec![apex, a, b, apex, c, d, apex, d, a, b, c]
}
