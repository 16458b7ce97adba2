//! TUM RGB-D (Sturm et al. 2012): lists of times and files, poses from a motion-capture system, 5,000 depth units a metre.
//!
//! A depth image gets the pose that is nearest in time, as the benchmark's own tools choose it. The data set tells no
//! intrinsics in its files: they are read from `intrinsics.json` beside them, else the values that ROS takes for a Kinect
//! stand in and a warning says so. Labels, which the data set does not have, are `label/` with the depth image's name.

use super::Settings;
use super::entry::{Depth, Entry, Found, Labels, Place};
use super::folder::{camera, pinhole};
use super::pixels::size_of;
use super::pose_text::pose_of;
use crate::{Error, Pose, Result};
use std::path::Path;

/// Metres per unit of the depth images.
const UNIT_M: f64 = 1.0 / 5000.0;
/// `fx = fy`, and the pixel that the camera looks at, for the 640 x 480 images of a Kinect.
const KINECT: (f64, [f64; 2]) = (525.0, [319.5, 239.5]);

/// Lists the frames.
pub(super) fn list(path: &Path, settings: &Settings) -> Result<Found> {
    let poses = poses(&path.join("groundtruth.txt"))?;
    let depths = lines(&path.join("depth.txt"))?;
    let mut warnings = Vec::new();
    let own = settings.intrinsics.clone().or_else(|| Some(path.join("intrinsics.json")).filter(|file| file.is_file()));
    let (camera, scale) = match own {
        Some(file) => camera(&file)?,
        None => {
            let first = depths.first().map(|(_, words)| path.join(words.first().map_or("", String::as_str)));
            let size = first.map_or(Ok([640, 480]), |file| size_of(&file))?;
            let (focal_px, center_px) = KINECT;
            warnings.push("no intrinsics.json: those of a Kinect (f = 525 pixels) are taken".to_owned());
            (pinhole(size, [focal_px; 2], center_px), None)
        }
    };
    let unit_m = scale.map_or(UNIT_M, |scale| 1.0 / scale);
    let entry = |(time_s, words): (f64, Vec<String>)| {
        let file = words.first().map_or("", String::as_str);
        let place = path.join(file);
        let stem = place.file_name().unwrap_or_default().to_owned();
        let depth =
            if place.is_file() { Ok(Depth { place: Place::File(place), unit_m }) } else { Err("no depth".to_owned()) };
        Entry {
            name: Path::new(file)
                .file_stem()
                .map_or_else(|| file.to_owned(), |stem| stem.to_string_lossy().into_owned()),
            time_s: Some(time_s),
            pose: nearest(&poses, time_s, settings.tolerance_s),
            camera,
            depth,
            labels: Labels::image_if_there(path.join("label").join(stem)),
        }
    };
    Ok(Found { entries: depths.into_iter().map(entry).collect(), warnings })
}

/// The pose that is nearest to a time.
pub(super) fn nearest(poses: &[(f64, Pose)], time_s: f64, tolerance_s: f64) -> std::result::Result<Pose, String> {
    let after = poses.partition_point(|(at, _)| *at < time_s);
    let candidates = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|at| poses.get(at));
    let off = |at: f64| (at - time_s).abs();
    let best = candidates.min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
    let Some((at, pose)) = best else { return Err("no pose: there is none".to_owned()) };
    if off(*at) <= tolerance_s {
        return Ok(*pose);
    }
    Err(format!("no pose within {tolerance_s} s: the nearest is {:.3} s away", off(*at)))
}

/// `groundtruth.txt`: time, position and quaternion, sorted by time.
fn poses(path: &Path) -> Result<Vec<(f64, Pose)>> {
    let mut poses = Vec::new();
    for (number, (time_s, words)) in lines(path)?.into_iter().enumerate() {
        let pose = pose_of(&words.join(" ")).map_err(|why| Error::input(path, format!("pose {}", number + 1), why))?;
        poses.push((time_s, pose));
    }
    poses.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(poses)
}

/// The lines of a list, without comments: a time, and the words behind it.
fn lines(path: &Path) -> Result<Vec<(f64, Vec<String>)>> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
    let mut found = Vec::new();
    for (at, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace().map(str::to_owned);
        let Some(first) = words.next().filter(|word| !word.starts_with('#')) else { continue };
        let time_s: Option<f64> = first.parse().ok().filter(|time: &f64| time.is_finite());
        let time_s = time_s.ok_or_else(|| {
            Error::input(path, format!("line {}", at + 1), format!("`{}` is no time", first.escape_default()))
        })?;
        found.push((time_s, words.collect()));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_pose_in_time_counts_if_it_is_near_enough() {
        let at = |x: f32| Pose::translation(x, 0.0, 0.0);
        let poses = [(1.0, at(1.0)), (2.0, at(2.0)), (3.0, at(3.0))];
        assert_eq!(nearest(&poses, 1.985, 0.02), Ok(at(2.0)));
        assert_eq!(nearest(&poses, 3.01, 0.02), Ok(at(3.0)));
        assert_eq!(nearest(&poses, 0.99, 0.02), Ok(at(1.0)));
        assert_eq!(nearest(&poses, 2.5, 0.02), Err("no pose within 0.02 s: the nearest is 0.500 s away".to_owned()));
        assert!(nearest(&[], 2.5, 0.02).is_err());
    }
}
