//! Where the robot stands, and which one it is.

use crate::scene::Shelf;
use crate::{Pose, Vector};
use nalgebra::{Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

/// Which arm stands where: the `[robot]` table of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotPlacement {
    /// URDF file of the arm, relative to the scene; `None` for the UR5 that comes with the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub urdf: Option<String>,
    /// Origin of the arm's base, metres; the table that it stands on is as high.
    pub base: [f32; 3],
    /// Counter-clockwise turn of the base about z, degrees.
    pub yaw_deg: f32,
}

impl Default for RobotPlacement {
    /// The shipped arm, 0.70 m before the shelf's front edge and 15 mm under its board.
    fn default() -> Self {
        Self { urdf: None, base: [0.0, -0.70, -0.015], yaw_deg: 0.0 }
    }
}

impl RobotPlacement {
    /// The base's pose.
    pub fn world_from_base(&self) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&Vector::z_axis(), self.yaw_deg.to_radians());
        Pose::from_parts(Translation3::from(Vector::from(self.base)), turn)
    }

    /// What is wrong with the place, if anything: a base that is no number, far away, or inside the shelf.
    pub fn fault(&self, shelf: &Shelf) -> Option<String> {
        /// Farther than this from the shelf's front edge no arm reaches it, metres.
        const FAR_M: f32 = 10.0;
        /// Half a base's width, metres.
        const BASE_M: f32 = 0.08;
        let [x, y, z] = self.base;
        if !(self.base.iter().all(|v| v.abs() <= FAR_M) && self.yaw_deg.abs() <= 3600.0) {
            return Some(format!(
                "robot base [{x}, {y}, {z}], yaw_deg = {}: must be finite and within {FAR_M} m of the shelf's origin",
                self.yaw_deg
            ));
        }
        let (min, max) = (shelf.min(), shelf.max());
        let inside = x > min.x - BASE_M && x < max.x + BASE_M && y > min.y - BASE_M && y < max.y + BASE_M && z < max.z;
        inside.then(|| format!("robot base [{x}, {y}, {z}] stands in or under the shelf; put it before y = {}", min.y - BASE_M))
    }
}
