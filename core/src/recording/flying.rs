//! Flying pixels: depths between an object's edge and what is behind it, where there is nothing.
//!
//! Two neighbouring pixels with depths `a < b` are joined by a segment. It is seen at an angle `theta` with
//! `tan(theta) = a delta / (b - a)`, where `delta = 1 / f` is the angle between the pixels. Where `theta` is smaller than the
//! edge angle, the two do not lie on one surface, or on one that is seen edge-on; the farther one is dropped. So of a step
//! from an object to its background the object keeps its edge, and what lies between goes. (The shadow filter of laser
//! scanners is the same test.)

use crate::camera::Pinhole;

/// The edge angle unless a person says otherwise, degrees.
pub const EDGE_DEG: f32 = 4.0;

/// Drops flying pixels: sets their depth to 0. Nothing is dropped at an angle of 0. Returns how many were.
pub(super) fn drop_flying(depth_m: &mut [f32], camera: &Pinhole, edge_deg: f32) -> usize {
    if edge_deg <= 0.0 {
        return 0;
    }
    let width = camera.width;
    let steep = edge_deg.to_radians().tan();
    // Per metre of the nearer depth, how much farther the other may be.
    let [across, down] = camera.focal_px.map(|focal_px| 1.0 / (focal_px * steep));
    let mut drop = vec![false; depth_m.len()];
    let mut compare = |at: usize, other: usize, slack: f32| {
        let (a, b) = (depth_m[at], depth_m[other]);
        if a > 0.0 && b > 0.0 && (b - a).abs() > a.min(b) * slack {
            drop[if a > b { at } else { other }] = true;
        }
    };
    for at in 0..depth_m.len() {
        if at % width + 1 < width {
            compare(at, at + 1, across);
        }
        if at + width < depth_m.len() {
            compare(at, at + width, down);
        }
    }
    let mut count = 0;
    for (depth, drop) in depth_m.iter_mut().zip(drop) {
        if drop {
            *depth = 0.0;
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;

    const CAMERA: Intrinsics = Intrinsics { width: 9, height: 3, focal_px: 500.0, depth_range_m: [0.1, 5.0] };

    fn filtered(row: [f32; 9]) -> Vec<f32> {
        let mut depth = row.repeat(3);
        drop_flying(&mut depth, &CAMERA.into(), EDGE_DEG);
        depth[9..18].to_vec()
    }

    #[test]
    fn a_ramp_behind_an_edge_goes_and_the_edge_stays() {
        let row = [0.5, 0.5, 0.5, 0.6, 0.75, 0.9, 0.9, 0.0, 0.9];
        assert_eq!(filtered(row), [0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.9, 0.0, 0.9]);
    }

    #[test]
    fn a_board_that_is_seen_at_a_slant_stays_and_zero_degrees_drop_nothing() {
        // A board seen at 15 degrees: from pixel to pixel the depth grows by a / (f tan 15) = 0.75 %.
        let slant: Vec<f32> = (0..9).map(|at| 0.6 * 1.0075_f32.powi(at)).collect();
        let slant: [f32; 9] = slant.try_into().expect("nine");
        assert_eq!(filtered(slant), slant);
        let mut step = vec![0.5, 1.0];
        assert_eq!(drop_flying(&mut step, &Intrinsics { width: 2, height: 1, ..CAMERA }.into(), 0.0), 0);
        assert_eq!(step, [0.5, 1.0]);
    }
}
