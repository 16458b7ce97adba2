//! A picture of an arm before its shelf, with what it reaches.

use super::light::{Eye, Item, Projection, render};
use super::stage::panels;
use crate::colors::Rgb;
use image::RgbImage;
use nudge_core::arm::{ArmTool, Joints, Reach, Role, pose_of};
use nudge_core::camera::{Intrinsics, View};
use nudge_core::solid::{ConvexPart, Solid};
use nudge_core::{Point, Pose, Vector};

const LINK_RGB: Rgb = [172, 190, 208];
const JOINT_RGB: Rgb = [98, 128, 160];
const TOOL_RGB: Rgb = [84, 86, 92];
const TABLE_RGB: Rgb = [214, 214, 210];
const REACHED_RGB: Rgb = [76, 175, 120];
const OUT_OF_REACH_RGB: Rgb = [206, 96, 84];
/// Depth of the frustum that stands for a view, metres.
const FRUSTUM_M: f32 = 0.018;

/// An arm with what was found of its reach.
pub struct Placed<'a> {
    /// The arm and its shelf.
    pub arm: &'a ArmTool,
    /// The configuration to show.
    pub joints: Joints,
    /// Where its tip comes over the board.
    pub reach: &'a Reach,
    /// The views' camera.
    pub intrinsics: &'a Intrinsics,
    /// Each view, and whether the hand can be there.
    pub views: &'a [(View, bool)],
}

/// The arm before its shelf, from the side: the board green where the tip comes and red where it does not, views as small
/// frusta in the same colours.
pub fn of_robot(placed: &Placed<'_>, size: [u32; 2]) -> RgbImage {
    let shelf = &placed.arm.shelf;
    let arm = &placed.arm.arm;
    let mut items = panels(shelf);
    let poses = arm.body_poses(&placed.joints);
    for (body, parts) in arm.bodies.iter().enumerate() {
        let solid = Solid { parts: parts.iter().map(|part| part.shape.clone()).collect() };
        let rgb = |at: usize| match (parts[at].role, body % 2) {
            (Role::Tool, _) => TOOL_RGB,
            (Role::Link, 0) => LINK_RGB,
            (Role::Link, _) => JOINT_RGB,
        };
        items.push(Item::tinted(&solid, pose_of(&poses[body]), rgb));
    }
    let base: Vector = arm.world_from_base.translation.vector.map(|v| v as f32);
    let table = Solid::standing_box(Vector::new(0.5, 0.4, 0.02));
    items.push(Item::new(&table, Pose::translation(base.x, base.y, base.z - 0.02), TABLE_RGB));
    items.extend(tiles(placed.reach, shelf.min()));
    items.extend(placed.views.iter().filter_map(|(view, reached)| frustum(view, placed.intrinsics, *reached)));

    // Everything from the base to the shelf's back, seen from the front right.
    let (low, high) = (shelf.min().coords.inf(&base), shelf.max().coords.sup(&base));
    let middle = Point::from(0.5 * (low + high) + Vector::new(0.0, 0.0, 0.06));
    let away = 1.15 * (high - low).norm().max(0.8);
    let eye = Eye {
        position: middle + Vector::new(0.88, -0.62, 0.62) * away,
        target: middle,
        up: Vector::z(),
        projection: Projection::Perspective(42.0),
    };
    render(&items, &eye, size)
}

/// Thin tiles on the board.
fn tiles(reach: &Reach, min: Point) -> Vec<Item> {
    const THICK_M: f32 = 0.001;
    let tile = |reached: bool| -> Option<Item> {
        let edge = 0.86 * reach.step_m;
        let mut parts = Vec::new();
        for y in 0..reach.size[1] {
            for x in 0..reach.size[0] {
                if reach.at(x, y) == reached {
                    let center = |axis: usize, i: usize| min[axis] + (i as f32 + 0.5) * reach.step_m;
                    parts.extend(block([center(0, x), center(1, y)], edge, [min.z, min.z + THICK_M]));
                }
            }
        }
        let rgb = if reached { REACHED_RGB } else { OUT_OF_REACH_RGB };
        (!parts.is_empty()).then(|| Item::new(&Solid { parts }, Pose::identity(), rgb))
    };
    [true, false].into_iter().filter_map(tile).collect()
}

fn block(center: [f32; 2], edge: f32, z: [f32; 2]) -> Option<ConvexPart> {
    let side = |i: usize, axis: usize| center[axis] + if i >> axis & 1 == 1 { 0.5 * edge } else { -0.5 * edge };
    let corners: Vec<Point> = (0..8).map(|i| Point::new(side(i, 0), side(i, 1), z[i >> 2])).collect();
    ConvexPart::hull(&corners)
}

fn frustum(view: &View, intrinsics: &Intrinsics, reached: bool) -> Option<Item> {
    let half = [intrinsics.width, intrinsics.height].map(|n| 0.5 * n as f32 / intrinsics.focal_px * FRUSTUM_M);
    let corners: Vec<Point> = [[0.0, 0.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .iter()
        .enumerate()
        .map(|(i, [x, y])| Point::new(x * half[0], y * half[1], if i == 0 { 0.0 } else { FRUSTUM_M }))
        .collect();
    let solid = Solid { parts: vec![ConvexPart::hull(&corners)?] };
    Some(Item::new(&solid, view.world_from_camera, if reached { REACHED_RGB } else { OUT_OF_REACH_RGB }))
}
