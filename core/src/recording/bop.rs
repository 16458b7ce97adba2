//! A scene of a BOP data set (Hodan et al.): `scene_camera.json`, `depth/NNNNNN.png`, and for labels `scene_gt.json` with
//! `mask_visib/NNNNNN_MMMMMM.png`.
//!
//! Poses are `cam_R_w2c` and `cam_t_w2c` (world to camera, millimetres); a unit of the depth images is `depth_scale`
//! millimetres. Masks carry the data set's object numbers, which a label map turns into classes.

use super::entry::{Depth, Entry, Found, Labels, Place};
use super::folder::{from_json, pinhole};
use super::pixels::size_of;
use super::pose_text::pose_of_rows;
use crate::{Error, Pose, Result};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
struct RawCamera {
    #[serde(rename = "cam_K")]
    k: Vec<f64>,
    depth_scale: Option<f64>,
    #[serde(rename = "cam_R_w2c")]
    rotation: Option<Vec<f64>>,
    #[serde(rename = "cam_t_w2c")]
    translation: Option<Vec<f64>>,
}

#[derive(Deserialize)]
struct RawObject {
    obj_id: u16,
}

/// Lists the frames.
pub(super) fn list(path: &Path) -> Result<Found> {
    let file = path.join("scene_camera.json");
    let text = std::fs::read_to_string(&file).map_err(|error| Error::io(&file, error))?;
    let cameras: BTreeMap<String, RawCamera> = from_json(&file, &text)?;
    let truth = path.join("scene_gt.json");
    let objects: BTreeMap<String, Vec<RawObject>> = match std::fs::read_to_string(&truth) {
        Ok(text) => from_json(&truth, &text)?,
        Err(_) => BTreeMap::new(),
    };
    let mut numbered = Vec::new();
    for (key, raw) in cameras {
        let number: u32 = key.parse().map_err(|_| Error::input(&file, &key, "is no number of an image"))?;
        numbered.push((number, key, raw));
    }
    numbered.sort_by_key(|(number, ..)| *number);
    let mut entries = Vec::new();
    for (number, key, raw) in numbered {
        let name = format!("{number:06}");
        let place = ["png", "npy"]
            .map(|end| path.join("depth").join(format!("{name}.{end}")))
            .into_iter()
            .find(|f| f.is_file());
        let Some([fx, _, cx, _, fy, cy, ..]) = raw.k.get(..9).and_then(|k| <[f64; 9]>::try_from(k).ok()) else {
            return Err(Error::input(
                &file,
                format!("{key}.cam_K"),
                format!("{} numbers where 9 are needed", raw.k.len()),
            ));
        };
        let size = place.as_deref().map_or(Ok([1, 1]), size_of)?;
        let unit_m = raw.depth_scale.unwrap_or(1.0) / 1000.0;
        let masks = objects.get(&key).map_or_else(Vec::new, |objects| masks(path, &name, objects));
        entries.push(Entry {
            pose: pose(&raw),
            camera: pinhole(size, [fx, fy], [cx, cy]),
            depth: place.map(|place| Depth { place: Place::File(place), unit_m }).ok_or_else(|| "no depth".to_owned()),
            labels: if masks.is_empty() { Labels::None } else { Labels::Masks(masks) },
            time_s: None,
            name,
        });
    }
    Ok(Found { entries, warnings: Vec::new() })
}

/// The masks of an image that are there, each with its object's number.
fn masks(path: &Path, name: &str, objects: &[RawObject]) -> Vec<(PathBuf, u16)> {
    let file = |at: usize| path.join("mask_visib").join(format!("{name}_{at:06}.png"));
    let mask = |(at, object): (usize, &RawObject)| (file(at), object.obj_id);
    objects.iter().enumerate().map(mask).filter(|(file, _)| file.is_file()).collect()
}

/// `world_from_camera` of a camera.
fn pose(raw: &RawCamera) -> std::result::Result<Pose, String> {
    let (Some(r), Some(t)) = (&raw.rotation, &raw.translation) else { return Err("no pose".to_owned()) };
    let (&[r00, r01, r02, r10, r11, r12, r20, r21, r22], &[x, y, z]) = (&r[..], &t[..]) else {
        return Err("no pose: 9 numbers of cam_R_w2c and 3 of cam_t_w2c are needed".to_owned());
    };
    let [x, y, z] = [x, y, z].map(|mm| mm / 1000.0);
    let rows = [[r00, r01, r02, x], [r10, r11, r12, y], [r20, r21, r22, z], [0.0, 0.0, 0.0, 1.0]];
    pose_of_rows(rows).map(|camera_from_world| camera_from_world.inverse())
}
