//! The plain folder: `depth/NNN.png`, `pose/NNN.txt`, perhaps `label/NNN.png`, and one `intrinsics.json`.
//!
//! ```json
//! { "width": 640, "height": 480, "fx": 615.2, "fy": 615.4, "cx": 319.5, "cy": 239.5, "depth_scale": 1000 }
//! ```
//!
//! `depth_scale` is the number of units of the depth PNGs in a metre. Pixel centres have whole numbers, as OpenCV and ROS
//! count; `distortion` may give k1, k2, p1, p2, k3. Depth and labels may be NumPy arrays (`.npy`); real numbers are metres.

use super::Settings;
use super::entry::{DEPTH_RANGE_M, Depth, Entry, Found, Labels, Place};
use super::pose_text::pose_of;
use crate::camera::Pinhole;
use crate::files::names_in;
use crate::{Error, Result};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// How image files may end, in the order of preference.
const ENDS: [&str; 2] = ["npy", "png"];

/// `intrinsics.json`. What else stands in it is for its reader.
#[derive(Deserialize)]
struct RawCamera {
    width: usize,
    height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    distortion: Vec<f64>,
    depth_scale: Option<f64>,
}

/// The camera of an `intrinsics.json`, and its units per metre.
pub(super) fn camera(path: &Path) -> Result<(Pinhole, Option<f64>)> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
    let raw: RawCamera = from_json(path, &text)?;
    if raw.distortion.len() > 5 {
        let words = format!("{} numbers; k1, k2, p1, p2, k3 are read", raw.distortion.len());
        return Err(Error::input(path, "distortion", words));
    }
    if let Some(scale) = raw.depth_scale.filter(|scale| !(scale.is_finite() && *scale > 0.0)) {
        return Err(Error::input(path, "depth_scale", format!("is {scale}, not a number of units in a metre")));
    }
    let mut camera = pinhole([raw.width, raw.height], [raw.fx, raw.fy], [raw.cx, raw.cy]);
    camera.distortion = std::array::from_fn(|at| raw.distortion.get(at).map_or(0.0, |k| *k as f32));
    camera.check().map_err(|(field, words)| Error::input(path, field, words))?;
    Ok((camera, raw.depth_scale))
}

/// A camera whose pixel centres have whole numbers, as OpenCV and ROS count; here they are at a half.
pub(crate) fn pinhole([width, height]: [usize; 2], focal_px: [f64; 2], center_px: [f64; 2]) -> Pinhole {
    Pinhole {
        width,
        height,
        focal_px: focal_px.map(|px| px as f32),
        principal_px: center_px.map(|px| (px + 0.5) as f32),
        distortion: [0.0; 5],
        depth_range_m: DEPTH_RANGE_M,
    }
}

/// JSON with line and column in the error.
pub(super) fn from_json<'t, T: Deserialize<'t>>(path: &Path, text: &'t str) -> Result<T> {
    serde_json::from_str(text).map_err(|error| {
        let words = error.to_string();
        let words = words.rsplit_once(" at line ").map_or(words.as_str(), |(words, _)| words);
        let place =
            if error.line() > 0 { format!("line {}, column {}", error.line(), error.column()) } else { String::new() };
        Error::input(path, place, words)
    })
}

/// Lists the frames.
pub(super) fn list(path: &Path, settings: &Settings) -> Result<Found> {
    let file = settings.intrinsics.clone().unwrap_or_else(|| path.join("intrinsics.json"));
    let (camera, scale) = camera(&file)?;
    let mut warnings = Vec::new();
    let depths = images_in(&path.join("depth"))?;
    let is_whole = depths.iter().any(|(_, file)| file.extension().is_some_and(|end| end == "png"));
    if scale.is_none() && settings.depth_unit_m.is_none() && is_whole {
        warnings.push(format!("{}: no depth_scale; 1000 units are taken for a metre", file.display()));
    }
    let unit_m = 1.0 / scale.unwrap_or(1000.0);
    // A pose without a depth image is a frame that is skipped, and so is the other way round.
    let mut names: Vec<String> = depths.iter().map(|(name, _)| name.clone()).collect();
    names.extend(stems(&path.join("pose"), &["txt"])?.into_iter().map(|(name, _)| name));
    names.sort();
    names.dedup();
    let labels = images_in(&path.join("label"))?;
    let of = |images: &[(String, PathBuf)], name: &String| {
        images.iter().find(|(stem, _)| stem == name).map(|(_, file)| file.clone())
    };
    let entry = |name: String| {
        let pose = path.join("pose").join(format!("{name}.txt"));
        let pose = match std::fs::read_to_string(&pose) {
            Ok(text) => pose_of(&text),
            Err(_) => Err("no pose".to_owned()),
        };
        let depth = of(&depths, &name)
            .map(|place| Depth { place: Place::File(place), unit_m })
            .ok_or_else(|| "no depth".to_owned());
        let labels = of(&labels, &name).map_or(Labels::None, |file| Labels::Image(Place::File(file)));
        Entry { name, time_s: None, pose, camera, depth, labels }
    };
    Ok(Found { entries: names.into_iter().map(entry).collect(), warnings })
}

/// The images in a folder by what their names begin with, sorted; arrays before PNGs of the same name.
fn images_in(folder: &Path) -> Result<Vec<(String, PathBuf)>> {
    let mut found = stems(folder, &ENDS)?;
    found.dedup_by(|later, earlier| later.0 == earlier.0);
    Ok(found)
}

/// The files in a folder that end in one of `ends`, by what their names begin with, sorted by that and the order of `ends`.
fn stems(folder: &Path, ends: &[&str]) -> Result<Vec<(String, PathBuf)>> {
    let mut found = Vec::new();
    for name in names_in(folder)? {
        if let Some((stem, end)) = name.rsplit_once('.')
            && let Some(at) = ends.iter().position(|known| *known == end)
        {
            found.push((stem.to_owned(), at, folder.join(&name)));
        }
    }
    found.sort();
    Ok(found.into_iter().map(|(stem, _, file)| (stem, file)).collect())
}
