//! Scenes and solids set up for a picture.

use super::light::{Eye, Item, Projection, render};
use crate::colors::{self, Rgb};
use image::RgbImage;
use nudge_core::scene::{Body, Catalog, Scene, Shelf};
use nudge_core::solid::{ConvexPart, Solid};
use nudge_core::{Point, Pose, Result, Vector};

const BOARD_RGB: Rgb = [232, 214, 188];
const WALL_RGB: Rgb = [240, 236, 229];
/// Thickness of the shelf's panels, metres.
const PANEL_M: f32 = 0.014;

/// From where a scene is pictured. The ceiling is left out of every picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From the robot's side, slightly above.
    Front,
    /// Straight down, x to the right and y (into the shelf) up, without perspective: the floor plan fills the picture
    /// up to the walls.
    Above,
}

impl View {
    /// The eye of this view on a shelf, for a picture of the given aspect (width over height).
    pub fn eye(self, shelf: &Shelf, aspect: f32) -> Eye {
        let [width, depth, height] = shelf.size;
        match self {
            Self::Front => {
                let (mut eye, bounds) = front(shelf);
                let fill = (bounds[1] / eye_height(&eye)).max(bounds[0] / eye_height(&eye) / aspect) * 1.02;
                eye.projection = Projection::Perspective(2.0 * (0.5 * eye_height(&eye) * fill).atan().to_degrees());
                eye
            }
            Self::Above => {
                let (across, along) = (width + 2.0 * PANEL_M, depth + PANEL_M);
                let middle = 0.5 * along;
                Eye {
                    position: Point::new(0.0, middle, height + 3.0),
                    target: Point::new(0.0, middle, 0.0),
                    up: Vector::y(),
                    projection: Projection::Orthographic(along.max(across / aspect)),
                }
            }
        }
    }

    /// The aspect (width over height) that wastes no space on this shelf.
    pub fn aspect(self, shelf: &Shelf) -> f32 {
        let [width, depth, _] = shelf.size;
        match self {
            Self::Front => {
                let (_, [across, up]) = front(shelf);
                across / up
            }
            Self::Above => (width + 2.0 * PANEL_M) / (depth + PANEL_M),
        }
    }
}

/// Height of what a perspective eye sees at a distance of one metre.
fn eye_height(eye: &Eye) -> f32 {
    match eye.projection {
        Projection::Perspective(degrees) => 2.0 * (0.5 * degrees.to_radians()).tan(),
        Projection::Orthographic(height) => height,
    }
}

/// An eye before a shelf that has its panels in the middle of the picture, and how wide and high they appear at a
/// distance of one metre.
fn front(shelf: &Shelf) -> (Eye, [f32; 2]) {
    let [width, depth, height] = shelf.size;
    let away = 2.1 * width.max(1.6 * height).max(depth);
    let mut eye = Eye {
        position: Point::new(0.0, 0.3 * depth - 0.87 * away, 0.3 * height + 0.50 * away),
        target: Point::new(0.0, 0.4 * depth, 0.36 * height),
        up: Vector::z(),
        projection: Projection::Perspective(40.0),
    };
    let corners = || {
        (0..8).map(|i| {
            let side = |axis: usize, low: f32, high: f32| if i >> axis & 1 == 1 { high } else { low };
            let x = 0.5 * width + PANEL_M;
            Point::new(side(0, -x, x), side(1, 0.0, depth + PANEL_M), side(2, -PANEL_M, height))
        })
    };
    // Turning the eye changes the perspective a little: a few rounds settle it.
    let mut seen = [1.0, 1.0];
    for _ in 0..4 {
        let spots: Vec<[f32; 2]> = corners().map(|corner| eye.project(corner, [1000, 1000])).collect();
        let range = |axis: usize| {
            let values = spots.iter().map(|spot| spot[axis]);
            [values.clone().fold(f32::MAX, f32::min), values.fold(f32::MIN, f32::max)]
        };
        let ([left, right], [top, bottom]) = (range(0), range(1));
        let metre = eye_height(&eye) / 1000.0;
        seen = [(right - left) * metre, (bottom - top) * metre];
        let up = (500.0 - 0.5 * (top + bottom)) * metre;
        let forward = (eye.target - eye.position).normalize();
        let right = forward.cross(&eye.up).normalize();
        eye.target = eye.position + forward + right.cross(&forward) * up;
    }
    (eye, seen)
}

/// A picture of bodies in their shelf, `size` pixels.
pub fn of_bodies(shelf: &Shelf, bodies: &[Body], catalog: &Catalog, view: View, size: [u32; 2]) -> RgbImage {
    let mut items = panels(shelf);
    items.extend(
        bodies.iter().map(|body| Item::new(&body.solid, body.world_from_body, colors::of_class(catalog, body.class))),
    );
    render(&items, &view.eye(shelf, size[0] as f32 / size[1] as f32), size)
}

/// A small picture of a scene as its file places it, `width` pixels wide: from the front, or from above.
///
/// # Errors
/// For a scene whose objects have no shape; a checked scene has none.
pub fn thumbnail(scene: &Scene, catalog: &Catalog, view: View, width: u32) -> Result<RgbImage> {
    let height = (width as f32 / view.aspect(&scene.shelf)).round().max(1.0) as u32;
    Ok(of_bodies(&scene.shelf, &scene.bodies(catalog)?, catalog, view, [width, height]))
}

/// A picture of one solid on white ground from the front right, every convex part in a tint of its own.
pub fn of_solid(solid: &Solid, size: [u32; 2]) -> RgbImage {
    let bounds = solid.bounds();
    let middle = nalgebra::center(&bounds.min, &bounds.max);
    let radius = 0.5 * bounds.size().norm().max(1e-3);
    let unit = 0.14 / radius;
    // Light and lines are made for things of a hand's size: bring the solid to it.
    let solid = solid.scaled([unit; 3]);
    let middle = Point::from(middle.coords * unit);
    let floor = bounds.min.z * unit;
    let ground = Solid::standing_box(Vector::new(4.0, 4.0, 0.01));
    let single = solid.parts.len() == 1;
    let items = [
        Item::shadow_catcher(&ground, Pose::translation(middle.x, middle.y, floor - 0.01)),
        Item::tinted(&solid, Pose::identity(), |part| if single { [120, 156, 196] } else { tint(part) }),
    ];
    let eye = Eye {
        position: middle + Vector::new(0.42, -0.78, 0.46) * 1.0,
        target: middle,
        up: Vector::z(),
        projection: Projection::Perspective(20.0 * (1.0_f32).max(size[1] as f32 / size[0] as f32)),
    };
    render(&items, &eye, size)
}

/// Board, back and side walls of a shelf; no ceiling.
pub(super) fn panels(shelf: &Shelf) -> Vec<Item> {
    let [width, depth, height] = shelf.size;
    let side = 0.5 * width;
    let panel = |min: [f32; 3], max: [f32; 3], rgb: Rgb| {
        let corner = |i: usize| {
            let at = |axis: usize| if i >> axis & 1 == 1 { max[axis] } else { min[axis] };
            Point::new(at(0), at(1), at(2))
        };
        let corners: Vec<Point> = (0..8).map(corner).collect();
        let solid = Solid { parts: ConvexPart::hull(&corners).into_iter().collect() };
        Item::new(&solid, Pose::identity(), rgb)
    };
    vec![
        panel([-side - PANEL_M, 0.0, -PANEL_M], [side + PANEL_M, depth + PANEL_M, 0.0], BOARD_RGB),
        panel([-side - PANEL_M, depth, 0.0], [side + PANEL_M, depth + PANEL_M, height], WALL_RGB),
        panel([-side - PANEL_M, 0.0, 0.0], [-side, depth, height], WALL_RGB),
        panel([side, 0.0, 0.0], [side + PANEL_M, depth, height], WALL_RGB),
    ]
}

/// Light tints that stay apart from their neighbours in the list.
fn tint(part: usize) -> Rgb {
    let hue = (part as f32 * 0.618_034 + 0.58).fract() * 6.0;
    let channel = |shift: f32| {
        let at = (hue + shift) % 6.0;
        let pure = (at - 3.0).abs() - 1.0;
        (255.0 * (0.42 + 0.42 * pure.clamp(0.0, 1.0))) as u8
    };
    [channel(0.0), channel(4.0), channel(2.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn a_scene_shows_its_classes_from_both_sides() {
        let played = fixture::play(0);
        for (view, name) in [(View::Front, "front"), (View::Above, "above")] {
            let picture = thumbnail(&played.record.scene, &played.catalog, view, 400).expect("picture");
            let colors: std::collections::BTreeSet<[u8; 3]> = picture.pixels().map(|p| p.0.map(|c| c / 32)).collect();
            assert!(colors.len() > 20, "{name}: {} tones", colors.len());
            keep(&picture, name);
        }
        let solid = &played.catalog.classes[4].solid;
        let picture = of_solid(solid, [320, 320]);
        assert_eq!(picture.get_pixel(0, 0).0, [255; 3], "white around a solid");
        assert_ne!(picture.get_pixel(160, 160).0, [255; 3]);
        keep(&picture, "solid");
    }

    fn keep(picture: &RgbImage, name: &str) {
        if let Some(kept) = std::env::var_os("NUDGE_KEEP") {
            picture.save(std::path::Path::new(&kept).join(format!("{name}.png"))).expect("saved");
        }
    }
}
