//! From an entry's files to a frame.

use super::entry::{Depth, Entry, Labels, Place};
use super::flying::drop_flying;
use super::image::image;
use super::labels::own_class;
use super::pixels::Values;
use super::{Board, Settings};
use crate::camera::{Frame, Pinhole, PixelClasses, UNLABELLED};
use crate::{Error, Pose, Result};
use std::path::Path;

/// The frame of an entry, in the board's frame. `recording` is what is named where no single file is to blame.
pub(super) fn frame(recording: &Path, entry: &Entry, settings: &Settings, board: &Board) -> Result<Frame> {
    let refused = |words: &String| Error::input(recording, format!("frame {}", entry.name), words.clone());
    let pose = entry.pose.as_ref().map_err(refused)?;
    let mut depth_m = depth(entry, settings).and_then(|depth| depth.map_err(|words| refused(&words)))?;
    drop_flying(&mut depth_m, &entry.camera, settings.edge_deg);
    let classes = labels(entry, settings)?.unwrap_or_else(|| vec![UNLABELLED; depth_m.len()]);
    let file = entry.depth.as_ref().map_or(recording, |depth| depth.place.file());
    Frame::new(file, board.board_from_camera(pose), entry.camera, depth_m, PixelClasses::Labels(classes))
}

/// A frame of image files, as somebody hands it over: whole numbers are `unit_m` metres, a thousandth unless told, real
/// numbers are metres; the pose is the board's.
///
/// # Errors
/// Those of reading the images, and of [`Frame::new`].
pub(crate) fn frame_of_files(
    depth: &Path,
    unit_m: Option<f64>,
    labels: Option<&Path>,
    camera: Pinhole,
    world_from_camera: Pose,
) -> Result<Frame> {
    let entry = Entry {
        name: String::new(),
        time_s: None,
        pose: Ok(world_from_camera),
        camera,
        depth: Ok(Depth { place: Place::File(depth.to_owned()), unit_m: unit_m.unwrap_or(0.001) }),
        labels: labels.map_or(Labels::None, |file| Labels::Image(Place::File(file.to_owned()))),
    };
    let settings = Settings { edge_deg: 0.0, ..Settings::default() };
    frame(depth, &entry, &settings, &Board::default())
}

/// The depth of every pixel as it is filed, metres: 0 where it is 0, negative or no number. The inner error says why there is
/// no depth at all.
pub(super) fn depth(entry: &Entry, settings: &Settings) -> Result<std::result::Result<Vec<f32>, String>> {
    let source = match &entry.depth {
        Ok(source) => source,
        Err(words) => return Ok(Err(words.clone())),
    };
    let pixels = image(&source.place)?;
    check_size(source.place.file(), pixels.size, entry)?;
    let metres = match pixels.values {
        Values::Whole(values) => {
            let unit_m = settings.depth_unit_m.unwrap_or(source.unit_m);
            values.into_iter().map(|value| (f64::from(value) * unit_m) as f32).collect()
        }
        Values::Real(mut values) => {
            let unit_m = settings.depth_unit_m.unwrap_or(1.0);
            for value in &mut values {
                let is_depth = value.is_finite() && *value > 0.0;
                *value = if is_depth { (f64::from(*value) * unit_m) as f32 } else { 0.0 };
            }
            values
        }
    };
    Ok(Ok(metres))
}

/// The class of every pixel, if the entry has labels.
pub(super) fn labels(entry: &Entry, settings: &Settings) -> Result<Option<Vec<u8>>> {
    let whole = |place: &Place| -> Result<Vec<u16>> {
        let (pixels, path) = (image(place)?, place.file());
        check_size(path, pixels.size, entry)?;
        match pixels.values {
            Values::Whole(values) => Ok(values),
            Values::Real(_) => Err(Error::input(path, "", "labels must be whole numbers")),
        }
    };
    match &entry.labels {
        Labels::None => Ok(None),
        Labels::Image(place) => classes(place.file(), &whole(place)?, entry.camera.width, settings).map(Some),
        Labels::Masks(masks) => {
            let mut labels = vec![UNLABELLED; entry.camera.width * entry.camera.height];
            for (path, object) in masks {
                let class = settings.labels.as_ref().map_or(UNLABELLED, |map| map.class(*object));
                for (label, _) in
                    labels.iter_mut().zip(whole(&Place::File(path.clone()))?).filter(|(_, mask)| *mask > 0)
                {
                    *label = class;
                }
            }
            Ok(Some(labels))
        }
    }
}

fn classes(path: &Path, numbers: &[u16], width: usize, settings: &Settings) -> Result<Vec<u8>> {
    if let Some(map) = &settings.labels {
        return Ok(numbers.iter().map(|number| map.class(*number)).collect());
    }
    let class = |(at, number): (usize, &u16)| {
        own_class(*number).ok_or_else(|| {
            let place = format!("row {}, column {}", at / width, at % width);
            let words = format!("{number} is no class of the catalogue; say with --labels FILE what the numbers mean");
            Error::input(path, place, words)
        })
    };
    numbers.iter().enumerate().map(class).collect()
}

fn check_size(path: &Path, [width, height]: [usize; 2], entry: &Entry) -> Result<()> {
    let camera = &entry.camera;
    if [width, height] == [camera.width, camera.height] {
        return Ok(());
    }
    let words = format!("{width} x {height} pixels, but its camera has {} x {}", camera.width, camera.height);
    Err(Error::input(path, "", words))
}
