//! Which views of an array the hand can be at.

use super::{ViewArray, ViewId};
use crate::Pose;
use crate::arm::{ArmTool, HandPose};

impl ViewArray {
    /// Per view, how the hand gets there; `None` where it cannot be.
    pub fn hand_poses(&self, arm: &ArmTool) -> Vec<Option<HandPose>> {
        let poses: Vec<Pose> = self.views.iter().map(|view| view.world_from_camera).collect();
        arm.hand_poses(&poses)
    }

    /// The views that are not offered, given [`ViewArray::hand_poses`]: those that the hand cannot be at. None where it can
    /// be at none, so that an episode without a fitting arm still looks.
    pub fn unreachable(&self, hands: &[Option<HandPose>]) -> Vec<ViewId> {
        if hands.iter().all(Option::is_none) {
            return Vec::new();
        }
        self.views.iter().zip(hands).filter(|(_, hand)| hand.is_none()).map(|(view, _)| view.id).collect()
    }
}
