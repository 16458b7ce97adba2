//! The camera of one frame: focal lengths, principal point and lens distortion.
//!
//! The model is the usual one (Brown 1966, as OpenCV writes it). A point at `x`, `y` on the plane one metre ahead, with
//! `r^2 = x^2 + y^2`, is seen at
//!
//! ```text
//! x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2)      column = fx x' + cx
//! y' = y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y      row    = fy y' + cy
//! ```

use super::Intrinsics;
use crate::Vector;
use serde::{Deserialize, Serialize};

/// Rounds of the fixed-point iteration that takes the distortion out of a pixel; lenses of depth cameras need about five.
const ROUNDS: usize = 30;

/// A pinhole camera with radial and tangential distortion. Pixel `(0, 0)` covers columns and rows from 0 to 1: its centre
/// is at 0.5.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pinhole {
    /// Image width, pixels.
    pub width: usize,
    /// Image height, pixels.
    pub height: usize,
    /// `fx`, `fy`, pixels.
    pub focal_px: [f32; 2],
    /// `cx`, `cy`, pixels from the image's top left corner.
    pub principal_px: [f32; 2],
    /// `k1`, `k2`, `p1`, `p2`, `k3`, in OpenCV's order; zeros for images without distortion.
    pub distortion: [f32; 5],
    /// Nearest and farthest depth that the sensor reports, metres.
    pub depth_range_m: [f32; 2],
}

impl From<Intrinsics> for Pinhole {
    fn from(camera: Intrinsics) -> Self {
        let Intrinsics { width, height, focal_px, depth_range_m } = camera;
        let (focal_px, principal_px) = ([focal_px; 2], camera.principal_px());
        Self { width, height, focal_px, principal_px, distortion: [0.0; 5], depth_range_m }
    }
}

impl Pinhole {
    /// The ray through the centre of a pixel, in the camera's frame and one metre deep: `depth * ray` is the point seen.
    pub fn ray(&self, column: usize, row: usize) -> Vector {
        let across = |pixel: usize, axis: usize| (pixel as f32 + 0.5 - self.principal_px[axis]) / self.focal_px[axis];
        let (x, y) = (across(column, 0), across(row, 1));
        if self.distortion == [0.0; 5] {
            return Vector::new(x, y, 1.0);
        }
        let [x, y] = self.undistorted([x, y].map(f64::from));
        Vector::new(x as f32, y as f32, 1.0)
    }

    /// Column and row where a point in the camera's frame is seen; `None` for one that is not before the camera.
    pub fn pixel(&self, point: Vector) -> Option<[f32; 2]> {
        if point.z <= 0.0 {
            return None;
        }
        let seen = self.distorted([point.x, point.y].map(|m| f64::from(m / point.z)));
        Some([0, 1].map(|axis| seen[axis] as f32 * self.focal_px[axis] + self.principal_px[axis]))
    }

    fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (radial, [dx, dy]) = self.bend([x, y]);
        [x * radial + dx, y * radial + dy]
    }

    /// The factor along the radius and the tangential shift at a point of the plane one metre ahead.
    fn bend(&self, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
        let [k1, k2, p1, p2, k3] = self.distortion.map(f64::from);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        (radial, [2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y])
    }

    fn undistorted(&self, seen: [f64; 2]) -> [f64; 2] {
        let mut at = seen;
        for _ in 0..ROUNDS {
            let (radial, shift) = self.bend(at);
            at = [0, 1].map(|axis| (seen[axis] - shift[axis]) / radial);
        }
        at
    }

    /// What is wrong with it: the field and the words.
    pub(crate) fn check(&self) -> Result<(), (&'static str, String)> {
        let [near, far] = self.depth_range_m;
        if !((1..=4096).contains(&self.width) && (1..=4096).contains(&self.height)) {
            let words = format!("an image of {} x {} pixels; 1 to 4096 are allowed", self.width, self.height);
            return Err(("intrinsics", words));
        }
        if !self.focal_px.iter().all(|px| px.is_finite() && *px >= 1.0) {
            return Err(("focal_px", format!("is {:?}, at least 1 is needed", self.focal_px)));
        }
        if !self.principal_px.iter().all(|px| px.is_finite()) {
            return Err(("principal_px", format!("is {:?}, not a place", self.principal_px)));
        }
        if !self.distortion.iter().all(|k| k.is_finite()) {
            return Err(("distortion", format!("is {:?}, which are not numbers", self.distortion)));
        }
        if !(near >= 0.0 && near < far && far <= 100.0) {
            return Err(("depth_range_m", format!("is [{near}, {far}]; it must rise and be within 0 to 100 m")));
        }
        // A lens that folds its image over cannot be undone.
        let corners = [(0, 0), (self.width - 1, 0), (0, self.height - 1), (self.width - 1, self.height - 1)];
        for (column, row) in corners {
            let back = self.pixel(self.ray(column, row));
            let is_near =
                |at: [f32; 2]| (at[0] - column as f32 - 0.5).abs() < 0.5 && (at[1] - row as f32 - 0.5).abs() < 0.5;
            if !back.is_some_and(is_near) {
                return Err(("distortion", format!("{:?} cannot be undone at the image's corners", self.distortion)));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Intrinsics = Intrinsics { width: 640, height: 480, focal_px: 433.0, depth_range_m: [0.07, 1.5] };

    #[test]
    fn without_distortion_rays_are_those_of_the_plain_pinhole_to_the_bit() {
        let camera = Pinhole::from(PLAIN);
        for (column, row) in [(0, 0), (639, 479), (320, 240), (17, 401)] {
            assert_eq!(camera.ray(column, row), PLAIN.ray(column, row));
        }
    }

    #[test]
    fn a_distorted_pixel_is_where_its_ray_is_seen() {
        // A lens as depth cameras have it, off centre and with oblong pixels.
        let camera = Pinhole {
            focal_px: [455.0, 456.5],
            principal_px: [331.2, 247.9],
            distortion: [0.17, -0.48, 0.0009, -0.0007, 0.43],
            ..Pinhole::from(PLAIN)
        };
        camera.check().expect("sound");
        for (column, row) in [(0, 0), (639, 479), (320, 240), (17, 401)] {
            let [u, v] = camera.pixel(camera.ray(column, row) * 0.8).expect("before the camera");
            assert!((u - column as f32 - 0.5).abs() < 1e-2 && (v - row as f32 - 0.5).abs() < 1e-2, "{u} {v}");
        }
        let plain = Pinhole { distortion: [0.0; 5], ..camera };
        assert!((plain.ray(0, 0) - camera.ray(0, 0)).norm() > 0.01, "the lens bends its rays");
        let (field, _) = Pinhole { distortion: [-3.0, 0.0, 0.0, 0.0, 0.0], ..camera }.check().expect_err("folds");
        assert_eq!(field, "distortion");
    }
}
