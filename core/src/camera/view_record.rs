//! View arrays inside the files of episodes: every pose to the bit, for arrays that no other file describes.

use super::views::check_camera;
use super::{Intrinsics, View, ViewArray, ViewId, pose_from_quaternion};
use serde::{Deserialize, Serialize};

/// An array as it is filed.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Filed {
    name: String,
    camera: Intrinsics,
    layout: [usize; 3],
    views: Vec<FiledView>,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FiledView {
    position: [f32; 3],
    /// x, y, z, w.
    quaternion: [f32; 4],
    target: [f32; 3],
    slot: [u16; 3],
}

impl From<ViewArray> for Filed {
    fn from(array: ViewArray) -> Self {
        let filed = |view: &View| {
            let (pose, q) = (view.world_from_camera, view.world_from_camera.rotation);
            FiledView {
                position: pose.translation.vector.into(),
                quaternion: [q.i, q.j, q.k, q.w],
                target: view.target,
                slot: view.slot,
            }
        };
        let views = array.views.iter().map(filed).collect();
        Self { name: array.name, camera: array.intrinsics, layout: array.layout, views }
    }
}

impl TryFrom<Filed> for ViewArray {
    type Error = String;

    fn try_from(filed: Filed) -> Result<Self, String> {
        check_camera(&filed.camera)?;
        if filed.views.is_empty() || filed.views.len() > usize::from(u16::MAX) {
            return Err(format!("{} views; 1 to {} are allowed", filed.views.len(), u16::MAX));
        }
        let layout = filed.layout;
        let is_small = layout.iter().all(|n| (1..=usize::from(u16::MAX)).contains(n));
        if !is_small || layout.iter().product::<usize>() > usize::from(u16::MAX) {
            return Err(format!("layout {layout:?}: at most {} views have a place", u16::MAX));
        }
        let view = |(at, view): (usize, FiledView)| {
            if view.slot.iter().zip(layout).any(|(slot, size)| usize::from(*slot) >= size) {
                return Err(format!("view {at}: slot {:?} is outside layout {layout:?}", view.slot));
            }
            let is_near = |x: &f32| x.is_finite() && x.abs() <= 1000.0;
            if !view.position.iter().chain(&view.target).all(is_near) {
                return Err(format!("view {at} is nowhere"));
            }
            let world_from_camera =
                pose_from_quaternion(view.position, view.quaternion).map_err(|words| format!("view {at}: {words}"))?;
            Ok(View { id: ViewId(at as u16), world_from_camera, target: view.target, slot: view.slot })
        };
        let views = filed.views.into_iter().enumerate().map(view).collect::<Result<_, _>>()?;
        Ok(Self { name: filed.name, intrinsics: filed.camera, layout: filed.layout, views })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_comes_back_from_json_to_the_bit() {
        let array = ViewArray::named("real75").expect("shipped");
        let text = serde_json::to_string(&array).expect("text");
        assert!(serde_json::from_str::<ViewArray>(&text).expect("reads") == array);
        let turned = text.replacen("\"quaternion\":[", "\"quaternion\":[9.0,0.0,0.0,0.0],\"was\":[", 1);
        assert!(serde_json::from_str::<ViewArray>(&turned).is_err());
        let wrong = text.replacen("\"quaternion\":[-0.", "\"quaternion\":[-9.", 1);
        let said = serde_json::from_str::<ViewArray>(&wrong).expect_err("no rotation").to_string();
        assert!(said.contains("view 0: the quaternion"), "{said}");
    }
}
