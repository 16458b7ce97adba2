//! The ray caster: nearest hits, then light.
//!
//! Two passes over a grid of 2 x 2 samples a pixel: the first finds what every sample sees, the second lights it with
//! one soft sun, the sky (ambient occlusion within [`REACH_M`]) and thin lines where the thing or the face changes.

use crate::colors::Rgb;
use image::RgbImage;
use nudge_core::solid::{Bounds, ConvexPart, Solid};
use nudge_core::{Point, Pose, Vector};
use rayon::prelude::*;

/// Samples per pixel along one axis.
const SUPERSAMPLING: usize = 2;
/// Things nearer than this darken a point, metres.
const REACH_M: f32 = 0.14;
/// Directions to the sky and to the sun per lit sample.
const SKY_RAYS: usize = 20;
const SUN_RAYS: usize = 6;
/// Two faces whose normals differ by less than this (cosine) belong to one rounded surface.
const ROUND_COS: f32 = 0.90;
/// A face this close below a point bends the normal there, metres.
const ROUND_M: f32 = 0.0012;

/// A solid with a colour and a place.
pub struct Item {
    parts: Vec<(ConvexPart, [f32; 3])>,
    world_from_body: Pose,
    body_from_world: Pose,
    bounds: Bounds,
    catcher: bool,
}

impl Item {
    /// A solid of one colour.
    pub fn new(solid: &Solid, world_from_body: Pose, rgb: Rgb) -> Self {
        Self::tinted(solid, world_from_body, |_| rgb)
    }

    /// A solid with a colour for each of its parts.
    pub fn tinted(solid: &Solid, world_from_body: Pose, rgb_of_part: impl Fn(usize) -> Rgb) -> Self {
        let color = |part: usize| rgb_of_part(part).map(linear_from_srgb);
        Self {
            parts: solid.parts.iter().cloned().enumerate().map(|(at, part)| (part, color(at))).collect(),
            world_from_body,
            body_from_world: world_from_body.inverse(),
            bounds: solid.bounds_at(&world_from_body),
            catcher: false,
        }
    }

    /// A ground that shows nothing but the shadows on it: the picture's white where light falls.
    pub fn shadow_catcher(solid: &Solid, world_from_body: Pose) -> Self {
        Self { catcher: true, ..Self::new(solid, world_from_body, [255; 3]) }
    }

    /// Where a ray enters, and which part.
    fn enter(&self, ray: &Ray, t_max: f32) -> Option<(f32, usize)> {
        if !ray.crosses(&self.bounds, t_max) {
            return None;
        }
        let from = self.body_from_world * ray.from;
        let direction = self.body_from_world * ray.direction;
        let mut nearest = None;
        let mut t_end = t_max;
        for (at, (part, _)) in self.parts.iter().enumerate() {
            if let Some(t) = part.ray_enter(from, direction, t_end) {
                t_end = t;
                nearest = Some((t, at));
            }
        }
        nearest
    }

    /// The surface normal at a point of a part, rounded across the facets of a curved surface.
    fn normal(&self, part: usize, point: Point) -> Vector {
        let point = self.body_from_world * point;
        let planes = &self.parts[part].0.planes;
        let depth = |plane: &nudge_core::solid::HalfSpace| plane.offset - plane.normal.dot(&point.coords);
        let Some(face) = planes.iter().min_by(|a, b| depth(a).total_cmp(&depth(b))) else { return Vector::z() };
        let mut sum = Vector::zeros();
        for plane in planes {
            if plane.normal.dot(&face.normal) > ROUND_COS {
                sum += plane.normal * (1.0 - depth(plane).max(0.0) / ROUND_M).max(0.0);
            }
        }
        self.world_from_body * sum.try_normalize(1e-9).unwrap_or(face.normal)
    }
}

/// A ray with what it needs at every box.
struct Ray {
    from: Point,
    direction: Vector,
    inverse: Vector,
}

impl Ray {
    fn new(from: Point, direction: Vector) -> Self {
        Self { from, direction, inverse: direction.map(|d| 1.0 / d) }
    }

    /// Whether the ray crosses a box before `t_max`.
    fn crosses(&self, bounds: &Bounds, t_max: f32) -> bool {
        let (mut enter, mut leave) = (0.0_f32, t_max);
        for axis in 0..3 {
            let a = (bounds.min[axis] - self.from[axis]) * self.inverse[axis];
            let b = (bounds.max[axis] - self.from[axis]) * self.inverse[axis];
            // A ray in a face's plane gives NaN, which max and min ignore.
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
    }
}

/// How an [`Eye`] projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Vertical field of view, degrees.
    Perspective(f32),
    /// Height of what the picture shows, metres.
    Orthographic(f32),
}

/// From where a picture is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// The eye's place, metres.
    pub position: Point,
    /// The point in the middle of the picture, metres.
    pub target: Point,
    /// What is up in the picture.
    pub up: Vector,
    /// How it projects.
    pub projection: Projection,
}

impl Eye {
    /// Right, up and forward of the eye.
    fn axes(&self) -> [Vector; 3] {
        let forward = (self.target - self.position).normalize();
        let right = forward.cross(&self.up).normalize();
        [right, right.cross(&forward), forward]
    }

    /// The ray through a place of the picture; `u` to the right and `v` up, in heights of the picture from its middle.
    fn ray(&self, [right, up, forward]: &[Vector; 3], u: f32, v: f32) -> (Point, Vector) {
        match self.projection {
            Projection::Perspective(degrees) => {
                let scale = 2.0 * (0.5 * degrees.to_radians()).tan();
                (self.position, (forward + right * (u * scale) + up * (v * scale)).normalize())
            }
            Projection::Orthographic(height) => (self.position + right * (u * height) + up * (v * height), *forward),
        }
    }

    /// Where a point shows, in pixels from the top left of a picture of the given size.
    pub fn project(&self, point: Point, [width, height]: [u32; 2]) -> [f32; 2] {
        let [right, up, forward] = self.axes();
        let offset = point - self.position;
        let scale = match self.projection {
            Projection::Perspective(degrees) => {
                0.5 / (0.5 * degrees.to_radians()).tan() / offset.dot(&forward).max(1e-6)
            }
            Projection::Orthographic(height) => 1.0 / height,
        };
        let (u, v) = (offset.dot(&right) * scale, offset.dot(&up) * scale);
        [0.5 * width as f32 + u * height as f32, (0.5 - v) * height as f32]
    }
}

/// What one sample sees.
#[derive(Clone, Copy)]
struct Sample {
    item: u16,
    part: u16,
    point: Point,
    normal: Vector,
}

/// Nothing but background.
const NOTHING: u16 = u16::MAX;

/// The picture of `items` from `eye`, `size` pixels (width, height), on white.
pub fn render(items: &[Item], eye: &Eye, size: [u32; 2]) -> RgbImage {
    let [width, height] = size.map(|n| n as usize * SUPERSAMPLING);
    let axes = eye.axes();
    let samples: Vec<Sample> = (0..width * height)
        .into_par_iter()
        .map(|at| {
            let u = ((at % width) as f32 + 0.5 - 0.5 * width as f32) / height as f32;
            let v = 0.5 - ((at / width) as f32 + 0.5) / height as f32;
            let (from, direction) = eye.ray(&axes, u, v);
            look(items, from, direction)
        })
        .collect();
    let mut picture = RgbImage::new(size[0], size[1]);
    picture.par_chunks_exact_mut(3 * size[0] as usize).enumerate().for_each(|(row, pixels)| {
        for (column, pixel) in pixels.chunks_exact_mut(3).enumerate() {
            let at = [column * SUPERSAMPLING, row * SUPERSAMPLING];
            let rgb = pixel_light(items, &samples, [width, height], at);
            pixel.copy_from_slice(&rgb.map(srgb_from_linear));
        }
    });
    picture
}

/// The nearest thing along a ray.
fn look(items: &[Item], from: Point, direction: Vector) -> Sample {
    let mut sample = Sample { item: NOTHING, part: 0, point: from, normal: -direction };
    let mut t_end = 100.0;
    let ray = Ray::new(from, direction);
    for (at, item) in items.iter().enumerate() {
        if let Some((t, part)) = item.enter(&ray, t_end) {
            t_end = t;
            sample.item = at as u16;
            sample.part = part as u16;
        }
    }
    if sample.item != NOTHING {
        sample.point = from + direction * t_end;
        sample.normal = items[usize::from(sample.item)].normal(usize::from(sample.part), sample.point);
    }
    sample
}

/// Linear light of one pixel: the mean of its samples. Sky and sun are looked up once for samples on one surface.
fn pixel_light(items: &[Item], samples: &[Sample], size: [usize; 2], at: [usize; 2]) -> [f32; 3] {
    let mut sum = [0.0_f32; 3];
    let mut known: Option<(Sample, [f32; 2])> = None;
    for sub in 0..SUPERSAMPLING * SUPERSAMPLING {
        let [x, y] = [at[0] + sub % SUPERSAMPLING, at[1] + sub / SUPERSAMPLING];
        let sample = samples[y * size[0] + x];
        if sample.item == NOTHING {
            sum.iter_mut().for_each(|sum| *sum += 1.0);
            continue;
        }
        let item = &items[usize::from(sample.item)];
        let open = match known {
            Some((other, open)) if other.item == sample.item && other.normal.dot(&sample.normal) > 0.98 => open,
            _ => openness(items, &sample, (y * size[0] + x) as u32),
        };
        known = Some((sample, open));
        let [sky, sun] = open;
        let line = if edge(samples, size, [x, y]) { 0.55 } else { 1.0 };
        if item.catcher {
            let shade = 0.45 + 0.25 * sky + 0.3 * sun;
            sum.iter_mut().for_each(|sum| *sum += shade);
            continue;
        }
        let facing = sample.normal.dot(&sunward()).max(0.0);
        let light = (0.60 + 0.10 * sample.normal.z) * sky + 0.45 * sun * facing;
        let color = item.parts[usize::from(sample.part)].1;
        for (sum, color) in sum.iter_mut().zip(color) {
            // Light that comes back from the thing's own colour keeps contacts from turning grey.
            *sum += (color * (light + 0.05) * line).min(1.0);
        }
    }
    sum.map(|sum| sum / (SUPERSAMPLING * SUPERSAMPLING) as f32)
}

/// How much of the sky and of the sun a point sees, 0 to 1 each.
fn openness(items: &[Item], sample: &Sample, seed: u32) -> [f32; 2] {
    let from = sample.point + sample.normal * 5e-4;
    let tangent = sample.normal.cross(&if sample.normal.x.abs() > 0.6 { Vector::y() } else { Vector::x() }).normalize();
    let bitangent = sample.normal.cross(&tangent);
    let turn = hash(seed) as f32 / u32::MAX as f32;
    let mut closed = 0.0;
    let near: Vec<&Item> = items.iter().filter(|item| distance(&item.bounds, from) < REACH_M).collect();
    for ray in 0..SKY_RAYS {
        // Cosine-weighted directions on a spiral, turned by another angle for every sample.
        let radius = ((ray as f32 + 0.5) / SKY_RAYS as f32).sqrt();
        let angle = std::f32::consts::TAU * (ray as f32 * 0.618_034 + turn);
        let up = (1.0 - radius * radius).sqrt();
        let direction =
            tangent * (radius * angle.cos()) + bitangent * (radius * angle.sin()) + sample.normal * up.max(0.02);
        if let Some(t) = nearest(&near, &Ray::new(from, direction), REACH_M) {
            closed += 1.0 - t / REACH_M;
        }
    }
    let facing = sample.normal.dot(&sunward());
    let mut lit = 0.0;
    if facing > 0.0 {
        for ray in 0..SUN_RAYS {
            let angle = std::f32::consts::TAU * (ray as f32 * 0.618_034 + turn);
            let radius = 0.16 * ((ray as f32 + 0.5) / SUN_RAYS as f32).sqrt();
            let spread = Vector::new(angle.cos(), 0.0, angle.sin()) * radius;
            let ray = Ray::new(from, sunward() + spread);
            if items.iter().all(|item| item.enter(&ray, 2.0).is_none()) {
                lit += 1.0 / SUN_RAYS as f32;
            }
        }
    }
    [1.0 - closed / SKY_RAYS as f32, lit]
}

/// The ray parameter of the nearest hit.
fn nearest(items: &[&Item], ray: &Ray, t_max: f32) -> Option<f32> {
    items.iter().filter_map(|item| item.enter(ray, t_max)).map(|hit| hit.0).min_by(f32::total_cmp)
}

/// Distance of a point from a box, metres.
fn distance(bounds: &Bounds, point: Point) -> f32 {
    let outside = |axis: usize| (bounds.min[axis] - point[axis]).max(point[axis] - bounds.max[axis]).max(0.0);
    Vector::new(outside(0), outside(1), outside(2)).norm()
}

/// Whether the neighbour to the right or below is another thing, another face, or lies further back.
fn edge(samples: &[Sample], [width, height]: [usize; 2], [x, y]: [usize; 2]) -> bool {
    let here = &samples[y * width + x];
    let differs = |x: usize, y: usize| {
        let there = &samples[y * width + x];
        there.item != here.item
            || there.normal.dot(&here.normal) < 0.75
            || (there.point - here.point).dot(&here.normal).abs() > 0.008
    };
    (x + 1 < width && differs(x + 1, y)) || (y + 1 < height && differs(x, y + 1))
}

/// Direction to the sun: from the robot's side, left and above.
fn sunward() -> Vector {
    Vector::new(-0.36, -0.52, 0.775)
}

/// A well-mixed number for each sample (the finaliser of MurmurHash3).
fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x85eb_ca6b);
    x ^= x >> 13;
    x = x.wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

fn linear_from_srgb(value: u8) -> f32 {
    (f32::from(value) / 255.0).powf(2.2)
}

fn srgb_from_linear(value: f32) -> u8 {
    (value.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn above(height_m: f32) -> Eye {
        Eye {
            position: Point::new(0.0, 0.0, 5.0),
            target: Point::origin(),
            up: Vector::y(),
            projection: Projection::Orthographic(height_m),
        }
    }

    #[test]
    fn a_box_from_above_is_a_rectangle_of_its_colour() {
        let solid = Solid::standing_box(Vector::new(0.2, 0.1, 0.1));
        let picture = render(&[Item::new(&solid, Pose::identity(), [200, 40, 40])], &above(0.4), [80, 40]);
        let inside = picture.get_pixel(40, 20).0;
        assert!(inside[0] > 150 && inside[1] < 90, "{inside:?}");
        // The picture is 0.8 m wide: the box takes 20 x 10 pixels around the middle.
        assert_eq!(picture.get_pixel(28, 20).0, [255; 3]);
        assert_eq!(picture.get_pixel(40, 13).0, [255; 3]);
        assert_ne!(picture.get_pixel(31, 20).0, [255; 3]);
        assert_ne!(picture.get_pixel(40, 16).0, [255; 3]);
    }

    #[test]
    fn a_point_projects_to_where_its_ray_starts() {
        let mut eye = above(0.4);
        assert_eq!(eye.project(Point::new(0.1, 0.1, 0.3), [80, 40]), [50.0, 10.0]);
        eye.projection = Projection::Perspective(40.0);
        let (from, direction) = eye.ray(&eye.axes(), 0.3, 0.2);
        let [x, y] = eye.project(from + direction * 3.0, [80, 40]);
        assert!((x - 52.0).abs() < 1e-2 && (y - 12.0).abs() < 1e-2, "{x} {y}");
    }

    #[test]
    fn contact_darkens_the_ground() {
        let ground = Solid::standing_box(Vector::new(1.0, 1.0, 0.01));
        let wall = Solid::standing_box(Vector::new(0.02, 1.0, 0.2));
        let items = [
            Item::new(&ground, Pose::identity(), [220; 3]),
            Item::new(&wall, Pose::translation(-0.2, 0.0, 0.0), [220; 3]),
        ];
        let picture = render(&items, &above(0.8), [80, 80]);
        // The wall ends at x = -0.19, pixel 21; it is to the sun's side, so compare within the shadow as well.
        assert!(picture.get_pixel(22, 40).0[0] + 20 < picture.get_pixel(70, 40).0[0]);
    }
}
