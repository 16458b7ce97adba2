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

    // Everything from the base to the shelf's back, seen from the front right.
    let (low, high) = (shelf.min().coords.inf(&base), shelf.max().coords.sup(&base));
    let middle = Point::from(0.5 * (low + high) + Vector::new(0.0, 0.0, 0.02));
    let away = 0.98 * (high - low).norm().max(0.8);
    let eye = Eye {
        position: middle + Vector::new(0.88, -0.62, 0.62) * away,
        target: middle,
        up: Vector::z(),
        projection: Projection::Perspective(42.0),
    };
    let mut picture = render(&items, &eye, size);
    // Those out of reach below the others.
    for shown in [false, true] {
        for (view, reached) in placed.views.iter().filter(|(_, reached)| *reached == shown) {
            draw_view(&mut picture, &eye, view, placed.intrinsics, *reached);
        }
    }
    picture
}

/// Thin tiles on the board, a row's neighbours of one colour joined.
fn tiles(reach: &Reach, min: Point) -> Vec<Item> {
    let mut items = Vec::new();
    for y in 0..reach.size[1] {
        let mut x = 0;
        while x < reach.size[0] {
            let reached = reach.at(x, y);
            let end = (x..reach.size[0]).find(|next| reach.at(*next, y) != reached).unwrap_or(reach.size[0]);
            let rgb = if reached { REACHED_RGB } else { OUT_OF_REACH_RGB };
            let edge = |axis: usize, i: usize| min[axis] + i as f32 * reach.step_m;
            let part = block([edge(0, x), edge(1, y), min.z], [edge(0, end), edge(1, y + 1), min.z + 0.001]);
            items.extend(part.map(|part| Item::new(&Solid { parts: vec![part] }, Pose::identity(), rgb)));
            x = end;
        }
    }
    items
}

fn block(low: [f32; 3], high: [f32; 3]) -> Option<ConvexPart> {
    let corner = |i: usize| Point::from([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { high[axis] } else { low[axis] }));
    ConvexPart::hull(&(0..8).map(corner).collect::<Vec<_>>())
}

/// Draws a view over the picture as the edges of its frustum.
fn draw_view(picture: &mut RgbImage, eye: &Eye, view: &View, intrinsics: &Intrinsics, reached: bool) {
    let half = [intrinsics.width, intrinsics.height].map(|n| 0.5 * n as f32 / intrinsics.focal_px * FRUSTUM_M);
    let size = picture.dimensions().into();
    let place =
        |x: f32, y: f32, z: f32| eye.project(view.world_from_camera * Point::new(x * half[0], y * half[1], z), size);
    let apex = place(0.0, 0.0, 0.0);
    let base = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| place(x, y, FRUSTUM_M));
    let rgb = if reached { REACHED_RGB } else { OUT_OF_REACH_RGB };
    for i in 0..4 {
        line(picture, apex, base[i], rgb);
        line(picture, base[i], base[(i + 1) % 4], rgb);
    }
}

/// A line two pixels wide.
fn line(picture: &mut RgbImage, from: [f32; 2], to: [f32; 2], rgb: Rgb) {
    let steps = (to[0] - from[0]).abs().max((to[1] - from[1]).abs()).ceil().max(1.0);
    for step in 0..=steps as u32 {
        let share = step as f32 / steps;
        let at = [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * share);
        for [dx, dy] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            let [x, y] = [at[0] + dx - 0.5, at[1] + dy - 0.5];
            if x >= 0.0
                && y >= 0.0
                && let Some(pixel) = picture.get_pixel_mut_checked(x as u32, y as u32)
            {
                pixel.0 = rgb;
            }
        }
    }
}
