//! Nerfstudio's `transforms.json`: intrinsics for all frames or for each, camera-to-world matrices in OpenGL's axes (x right,
//! y up, z backwards), `depth_file_path` for depth.
//!
//! Whole numbers are thousandths of a metre unless `depth_unit_scale_factor` says otherwise; real numbers are metres. Pixel
//! centres are at a half, as Nerfstudio and COLMAP count. Labels, which Nerfstudio does not have, are `label_file_path`.

use super::entry::{DEPTH_RANGE_M, Depth, Entry, Found, Labels, Place};
use super::folder::from_json;
use super::pose_text::pose_of_rows;
use crate::camera::Pinhole;
use crate::{Error, Pose, Result};
use serde::Deserialize;
use std::path::Path;

#[derive(Clone, Default, Deserialize)]
struct RawCamera {
    camera_model: Option<String>,
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

#[derive(Deserialize)]
struct RawFrame {
    #[serde(default)]
    file_path: String,
    depth_file_path: Option<String>,
    label_file_path: Option<String>,
    transform_matrix: Vec<Vec<f64>>,
    #[serde(flatten)]
    camera: RawCamera,
}

#[derive(Deserialize)]
struct RawTransforms {
    #[serde(flatten)]
    camera: RawCamera,
    depth_unit_scale_factor: Option<f64>,
    frames: Vec<RawFrame>,
}

/// Lists the frames.
pub(super) fn list(path: &Path) -> Result<Found> {
    let file = path.join("transforms.json");
    let text = std::fs::read_to_string(&file).map_err(|error| Error::io(&file, error))?;
    let raw: RawTransforms = from_json(&file, &text)?;
    let unit_m = raw.depth_unit_scale_factor.unwrap_or(0.001);
    let mut entries = Vec::new();
    for (at, frame) in raw.frames.iter().enumerate() {
        let camera = camera(&raw.camera, &frame.camera)
            .map_err(|(field, words)| Error::input(&file, format!("frames[{at}].{field}"), words))?;
        let depth = match &frame.depth_file_path {
            Some(depth) if path.join(depth).is_file() => Ok(Depth { place: Place::File(path.join(depth)), unit_m }),
            _ => Err("no depth".to_owned()),
        };
        let stem = Path::new(&frame.file_path).file_stem();
        entries.push(Entry {
            name: stem.map_or_else(|| format!("{at:03}"), |stem| stem.to_string_lossy().into_owned()),
            time_s: None,
            pose: pose(&frame.transform_matrix),
            camera,
            depth,
            labels: frame
                .label_file_path
                .as_ref()
                .map_or(Labels::None, |label| Labels::image_if_there(path.join(label))),
        });
    }
    Ok(Found { entries, warnings: Vec::new() })
}

fn camera(all: &RawCamera, own: &RawCamera) -> std::result::Result<Pinhole, (&'static str, String)> {
    let model = own.camera_model.as_ref().or(all.camera_model.as_ref()).map_or("OPENCV", String::as_str);
    if !matches!(model, "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL") {
        return Err(("camera_model", format!("is {model}; pinholes with the distortion of OPENCV are read")));
    }
    let needed = |name, of: fn(&RawCamera) -> Option<f64>| of(own).or(of(all)).ok_or((name, "is missing".to_owned()));
    let bend = |of: fn(&RawCamera) -> Option<f64>| of(own).or(of(all)).unwrap_or(0.0) as f32;
    let [fx, cx, cy] = [needed("fl_x", |c| c.fl_x)?, needed("cx", |c| c.cx)?, needed("cy", |c| c.cy)?];
    let fy = own.fl_y.or(all.fl_y).unwrap_or(fx);
    let camera = Pinhole {
        width: needed("w", |c| c.w)? as usize,
        height: needed("h", |c| c.h)? as usize,
        focal_px: [fx as f32, fy as f32],
        principal_px: [cx as f32, cy as f32],
        distortion: [bend(|c| c.k1), bend(|c| c.k2), bend(|c| c.p1), bend(|c| c.p2), bend(|c| c.k3)],
        depth_range_m: DEPTH_RANGE_M,
    };
    camera.check().map(|()| camera)
}

/// The pose of a matrix in OpenGL's axes: y and z turned round.
fn pose(matrix: &[Vec<f64>]) -> std::result::Result<Pose, String> {
    let rows: Option<Vec<[f64; 4]>> = matrix.iter().map(|row| <[f64; 4]>::try_from(&row[..]).ok()).collect();
    let rows = rows.filter(|rows| matches!(rows.len(), 3 | 4)).ok_or("no pose: transform_matrix must be 4 x 4")?;
    let turned = |row: [f64; 4]| [row[0], -row[1], -row[2], row[3]];
    let last = rows.get(3).copied().unwrap_or([0.0, 0.0, 0.0, 1.0]);
    pose_of_rows([turned(rows[0]), turned(rows[1]), turned(rows[2]), last])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;

    #[test]
    fn a_camera_in_opengl_axes_looks_along_its_minus_z() {
        let identity: Vec<Vec<f64>> = (0..4).map(|r| (0..4).map(|c| f64::from(u8::from(r == c))).collect()).collect();
        let pose = pose(&identity).expect("a pose");
        assert!((pose * Point::new(0.1, 0.2, 1.0) - Point::new(0.1, -0.2, -1.0)).norm() < 1e-6);
        assert!(super::pose(&identity[..2]).is_err());
    }

    #[test]
    fn a_frame_has_its_own_camera_before_the_one_for_all() {
        let all = RawCamera {
            w: Some(64.0),
            h: Some(48.0),
            fl_x: Some(50.0),
            cx: Some(32.0),
            cy: Some(24.0),
            ..RawCamera::default()
        };
        let own = RawCamera { fl_x: Some(60.0), fl_y: Some(61.0), ..RawCamera::default() };
        let found = camera(&all, &own).expect("a camera");
        assert_eq!((found.focal_px, found.principal_px, found.width), ([60.0, 61.0], [32.0, 24.0], 64));
        assert_eq!(camera(&RawCamera::default(), &own).expect_err("no size").0, "cx");
        let fish = RawCamera { camera_model: Some("OPENCV_FISHEYE".to_owned()), ..all.clone() };
        assert_eq!(camera(&fish, &own).expect_err("no pinhole").0, "camera_model");
    }
}
