//! The waiting configuration: the tool before the shelf, clear of everything, ready to go straight in.

use super::line::{LINE_STEP_M, follow_line};
use super::space::Space;
use super::{Frame, Joints};
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// The tool's pose with its tip at `tip`, level (its broad side flat), turned by `yaw_rad` counter-clockwise from
/// pointing straight into the shelf.
pub fn level_tool(tip: &Point3<f64>, yaw_rad: f64) -> Frame {
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw_rad);
    // x to the right, y down, z ahead.
    let axes = Matrix3::from_columns(&[turn * Vector3::x(), -Vector3::z(), turn * Vector3::y()]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Frame::from_parts(Translation3::from(tip.coords), rotation)
}

/// The same, with the tool pointing downwards by `pitch_rad`; level for 0.
pub fn inclined_tool(tip: &Point3<f64>, yaw_rad: f64, pitch_rad: f64) -> Frame {
    let level = level_tool(tip, yaw_rad);
    if pitch_rad == 0.0 {
        return level;
    }
    // About the tool's own x, which points right: y is down and z ahead, so ahead turns down.
    let pitch = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -pitch_rad);
    Frame::from_parts(level.translation, level.rotation * pitch)
}

/// Where the tip enters the shelf before all pushes are tried: before the front edge, above the board, metres.
const ENTRY_M: [f64; 2] = [0.10, 0.06];
/// How deep it is tried to go in from there, metres.
const DEPTH_M: f64 = 0.40;
/// Steps of the way in that count as alike: 5 cm.
const ALIKE: usize = (0.05 / LINE_STEP_M) as usize;

impl Space<'_> {
    /// A configuration with the tool before the middle of the shelf, pointing in: on the branch of the inverse that comes
    /// deepest into the shelf at the height of pushes, and of the places tried before the shelf the one with the most room.
    /// `None` when the arm reaches none, which is when it cannot push in this shelf at all.
    pub fn ready(&self) -> Option<Joints> {
        let home = Joints::zero(self.arm.joints.len());
        let middle = self.middle();
        let tip = |before: f64, height: f64| Point3::new(middle.x, middle.y - before, middle.z + height);
        let entry = tip(ENTRY_M[0], ENTRY_M[1]);
        let mut best: Option<(usize, f64, Joints)> = None;
        let mut consider = |depth: usize, joints: Joints| {
            // A folded wrist is no place to start from, so its distance from a singularity counts too.
            let room = self.room_m(&joints).min(0.5 * self.arm.singularity_margin(&joints));
            if room > 0.0 && best.is_none_or(|(deepest, most, _)| (depth, room) > (deepest, most)) {
                best = Some((depth, room, joints));
            }
        };
        let places =
            || [0.10, 0.20, 0.30].into_iter().flat_map(|before| [0.12, 0.20, 0.28].map(|height| (before, height)));
        for start in self.arm.inverse(&level_tool(&entry, 0.0), &home) {
            let free = |joints: &Joints| self.is_free(joints);
            if !free(&start) {
                continue;
            }
            let inward = follow_line(self.arm, &start, &Vector3::new(0.0, DEPTH_M, 0.0), free);
            for (before, height) in places() {
                let back = follow_line(self.arm, &start, &(tip(before, height) - entry), free);
                if let (true, Some(joints)) = (back.complete, back.path.last()) {
                    consider(inward.path.len() / ALIKE, *joints);
                }
            }
        }
        for (before, height) in places() {
            for joints in self.arm.inverse(&level_tool(&tip(before, height), 0.0), &home) {
                consider(0, joints);
            }
        }
        best.map(|(_, _, joints)| joints)
    }

    /// The middle of the board's front edge.
    fn middle(&self) -> Point3<f64> {
        let board = &self.panels[0];
        Point3::new(0.5 * (board.min[0] + board.max[0]), board.min[1], board.max[2])
    }
}
