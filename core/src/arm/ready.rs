//! Where the arm waits: with its tool before the shelf, clear of everything.

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

impl Space<'_> {
    /// A configuration with the tool before the middle of the shelf, pointing in, that has much room: the one with the
    /// most of those tried. `None` when the arm reaches none, which is when it cannot push in this shelf at all.
    pub fn ready(&self) -> Option<Joints> {
        let home = Joints::zero(self.arm.joints.len());
        let middle = self.middle();
        let mut best: Option<(f64, Joints)> = None;
        for before in [0.10, 0.20, 0.30] {
            for height in [0.12, 0.20, 0.28] {
                let tip = Point3::new(middle.x, middle.y - before, middle.z + height);
                for joints in self.arm.inverse(&level_tool(&tip, 0.0), &home) {
                    // A folded wrist is no place to start from, so its distance from a singularity counts too.
                    let room = self.room_m(&joints).min(0.5 * self.arm.singularity_margin(&joints));
                    if room > 0.0 && best.is_none_or(|(most, _)| room > most) {
                        best = Some((room, joints));
                    }
                }
            }
        }
        best.map(|(_, joints)| joints)
    }

    /// The middle of the board's front edge.
    fn middle(&self) -> Point3<f64> {
        let board = &self.panels[0];
        Point3::new(0.5 * (board.min[0] + board.max[0]), board.min[1], board.max[2])
    }
}
