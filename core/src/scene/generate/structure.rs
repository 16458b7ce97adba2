//! The structures of [`Family`]: what is placed before a shelf is filled at random.
//!
//! Most are made of lines: objects side by side along a line, box sides along it, with small gaps. Nothing is placed where
//! it would overlap or stand outside; a line leaves such a place empty.

use super::{Family, GAP_M, GenerateConfig, Standing};
use crate::rng::ChaCha8Rng;
use crate::scene::{Catalog, Class, Object, Shelf, outline};
use rand::Rng;
use rand::seq::IndexedRandom;

/// From this height on an object is tall: it hides what is behind it from most views, metres.
const TALL_M: f32 = 0.165;
/// Up to this height it is small, metres.
const SMALL_M: f32 = 0.105;
/// Draws of a place for an object that is to stand somewhere in a region.
const DRAWS: usize = 12;

/// A class that may stand in a structure.
struct Choice<'a> {
    class: &'a Class,
    /// Outline grown by half the gap, at yaw 0 about the origin.
    footprint: Vec<[f32; 2]>,
    height_m: f32,
}

/// A shelf while its structure is placed.
pub(super) struct Builder<'a, 'b> {
    shelf: Shelf,
    choices: Vec<Choice<'a>>,
    objects: &'b mut Vec<Object>,
    standing: &'b mut Vec<Standing>,
    rng: ChaCha8Rng,
}

/// Which classes a part of a structure is made of.
#[derive(Clone, Copy)]
enum Pool {
    Any,
    Tall,
    Small,
    /// All but tall ones.
    Low,
}

/// A line along which objects stand side by side.
struct Line {
    from: [f32; 2],
    to: [f32; 2],
    pool: Pool,
    /// Range of the gaps, metres.
    gaps: [f32; 2],
    /// Chance that an object is of the class of the one before.
    same: f64,
}

impl<'a, 'b> Builder<'a, 'b> {
    pub(super) fn new(
        catalog: &'a Catalog,
        config: &GenerateConfig,
        objects: &'b mut Vec<Object>,
        standing: &'b mut Vec<Standing>,
        rng: ChaCha8Rng,
    ) -> Self {
        let listed = |class: &&Class| config.classes.is_empty() || config.classes.contains(&class.id);
        let choice = |class: &'a Class| {
            let mesh = config.meshes.get(&class.name).map(crate::scene::MeshShape::solid);
            let solid = mesh.as_ref().unwrap_or(&class.solid);
            let footprint = outline::grown(&solid.footprint(), 0.5 * GAP_M);
            Choice { class, footprint, height_m: solid.bounds().max.z }
        };
        let mut choices: Vec<Choice<'a>> = catalog.classes.iter().filter(listed).map(choice).collect();
        choices.retain(|choice| choice.height_m <= config.shelf.size[2]);
        Self { shelf: config.shelf, choices, objects, standing, rng }
    }

    /// Places the structure of a family.
    pub(super) fn build(&mut self, family: Family) {
        match family {
            Family::Mixed | Family::Crowded => {}
            Family::Walls => self.walls(),
            Family::Rows => self.rows(),
            Family::Rings => self.rings(),
            Family::TallFirst => self.tall_first(),
            Family::Halves => self.halves(),
            Family::Chambers => self.chambers(),
        }
    }

    fn half_width(&self) -> f32 {
        0.5 * self.shelf.size[0]
    }

    fn depth(&self) -> f32 {
        self.shelf.size[1]
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + self.rng.random::<f32>() * (high - low)
    }

    /// A wall at a third of the depth, seldom parallel to the front, and small and other things behind it.
    fn walls(&mut self) {
        let (half, depth) = (self.half_width(), self.depth());
        let length = self.between(1.1, 1.9) * half;
        let left = self.between(-half, half - length);
        let (at, slant) = (self.between(0.2, 0.5) * depth, self.between(-0.1, 0.1) * depth);
        let (from, to) = ([left, at - slant], [left + length, at + slant]);
        self.line(&Line { from, to, pool: Pool::Tall, gaps: [0.001, 0.012], same: 0.4 });
        let behind = self.rng.random_range(3..=7);
        for _ in 0..behind {
            let pool = if self.rng.random::<f32>() < 0.7 { Pool::Small } else { Pool::Any };
            self.somewhere(pool, [left, left + length], [at + 0.15 * depth, depth]);
        }
    }

    /// Files side by side, each from the front edge to the back.
    fn rows(&mut self) {
        let (half, depth) = (self.half_width(), self.depth());
        let deep = self.rng.random_range(3..=4);
        let mut x = -half + self.between(0.0, 0.1);
        while x < half - 0.03 {
            let before = self.standing.len();
            // Four deep, if they are narrow enough along y.
            let first = self.between(0.0, 0.02);
            let pitch = (depth - first) / deep as f32;
            let tall = self.rng.random::<f32>() < 0.5;
            let mut last = None;
            for row in 0..deep {
                let pool = if row == 0 && tall { Pool::Tall } else { Pool::Any };
                let stays = last.is_some() && self.rng.random::<f32>() < 0.6;
                let at =
                    if stays { last } else { self.pick(pool, |choice| span(&choice.footprint, [0.0, 1.0]) < pitch) };
                let Some(at) = at else { continue };
                last = Some(at);
                let yaw = self.between(-3.0, 3.0);
                let (width, y) = (span(&self.choices[at].footprint, [1.0, 0.0]), first + pitch * (row as f32 + 0.5));
                let jitter = self.between(-0.004, 0.004);
                self.try_place(at, [x + 0.5 * width + jitter.abs(), y + jitter], yaw);
            }
            let right = self.standing[before..].iter().flat_map(|one| &one.outline).map(|p| p[0]);
            x = right.fold(x + 0.03, f32::max) + self.between(0.003, 0.025);
            if self.rng.random::<f32>() < 0.12 {
                x += 0.08;
            }
        }
    }

    /// Objects around a point, and small ones inside.
    fn rings(&mut self) {
        let (half, depth) = (self.half_width(), self.depth());
        let two = half > 0.35 && self.rng.random::<f32>() < 0.5;
        let centers = if two { vec![-0.5 * half, 0.5 * half] } else { vec![self.between(-0.45, 0.45) * half] };
        for x in centers {
            let radius = self.between(0.25, 0.33) * depth;
            let center = [x + self.between(-0.04, 0.04), self.between(0.45, 0.6) * depth];
            let inside = self.rng.random_range(1..=3);
            for _ in 0..inside {
                let r = 0.35 * radius;
                self.somewhere(Pool::Small, [center[0] - r, center[0] + r], [center[1] - r, center[1] + r]);
            }
            let mut angle = self.between(0.0, 20.0);
            let end = angle + 360.0;
            while angle < end {
                let pool = if self.rng.random::<f32>() < 0.75 { Pool::Tall } else { Pool::Any };
                let Some(at) = self.pick(pool, |choice| longest(&choice.footprint) < 1.2 * radius) else { break };
                // Its longer side along the ring.
                let footprint = &self.choices[at].footprint;
                let (along_x, along_y) = (span(footprint, [1.0, 0.0]), span(footprint, [0.0, 1.0]));
                let turned = if along_x >= along_y { 90.0 } else { 0.0 };
                let half_step = (0.5 * along_x.max(along_y) / radius).atan().to_degrees();
                let (sin, cos) = (angle + half_step).to_radians().sin_cos();
                let jitter = self.between(-5.0, 5.0);
                let out = radius + 0.5 * along_x.min(along_y);
                self.try_place(at, [center[0] + out * cos, center[1] + out * sin], angle + half_step + turned + jitter);
                angle += 2.0 * half_step + self.between(0.5, 6.0);
            }
        }
    }

    /// Tall ones side by side near the front; behind each, one or two small ones.
    fn tall_first(&mut self) {
        let (half, depth) = (self.half_width(), self.depth());
        let at = self.between(0.18, 0.35) * depth;
        let before = self.standing.len();
        let (from, to) = ([-half, at], [half, at]);
        self.line(&Line { from, to, pool: Pool::Tall, gaps: [0.004, 0.05], same: 0.3 });
        let tall: Vec<([f32; 2], f32)> = self.standing[before..]
            .iter()
            .map(|one| (one.position, one.outline.iter().map(|p| p[1]).fold(0.0, f32::max)))
            .collect();
        for (position, back) in tall {
            let mut y = back;
            let small = self.rng.random_range(1..=2);
            for _ in 0..small {
                let Some(at) = self.pick(Pool::Small, |_| true) else { return };
                let yaw = if self.rng.random() { 0.0 } else { 90.0 } + self.between(-8.0, 8.0);
                let deep = span(&outline::placed(&self.choices[at].footprint, [0.0; 2], yaw), [0.0, 1.0]);
                let [gap, aside] = [self.between(0.003, 0.03), self.between(-0.015, 0.015)];
                self.try_place(at, [position[0] + aside, y + gap + 0.5 * deep], yaw);
                y += gap + deep;
            }
        }
    }

    /// Rows close behind each other in one half, a few things in the other.
    fn halves(&mut self) {
        let (half, depth) = (self.half_width(), self.depth());
        let wide = self.between(0.9, 1.1) * half;
        let packed = if self.rng.random() { [-half, -half + wide] } else { [half - wide, half] };
        let mut y = self.between(0.0, 0.03);
        while y < depth - 0.03 {
            let before = self.standing.len();
            // Along the row's front edge.
            let mut x = packed[0];
            let mut failures = 0;
            while x < packed[1] - 0.03 && failures < 3 {
                let [room_x, room_y] = [packed[1] - x, depth - y];
                let front = y < 0.1;
                let pool = if front && self.rng.random::<f32>() < 0.5 { Pool::Tall } else { Pool::Any };
                let turned = if self.rng.random() { 0.0_f32 } else { 90.0 };
                let fits = |choice: &Choice<'_>| {
                    let outline = outline::placed(&choice.footprint, [0.0; 2], turned);
                    span(&outline, [1.0, 0.0]) < room_x && span(&outline, [0.0, 1.0]) < room_y.min(0.17)
                };
                let Some(at) = self.pick(pool, fits) else { break };
                let outline = outline::placed(&self.choices[at].footprint, [0.0; 2], turned);
                let size = [span(&outline, [1.0, 0.0]), span(&outline, [0.0, 1.0])];
                let yaw = turned + self.between(-1.5, 1.5);
                // As near to the front as what stands there lets it.
                let placed = (0..4).any(|step| {
                    let y = y + 0.02 * step as f32 + 0.002;
                    self.try_place(at, [x + 0.5 * size[0] + 0.003, y + 0.5 * size[1]], yaw)
                });
                failures = if placed { 0 } else { failures + 1 };
                x += if placed { size[0] + self.between(0.004, 0.01) } else { 0.02 };
            }
            let nearest =
                self.standing[before..].iter().map(|one| one.outline.iter().map(|p| p[1]).fold(0.0, f32::max));
            y = nearest.fold(f32::INFINITY, f32::min).min(y + 0.12).max(y + 0.03);
        }
        let other = if packed[0] < -0.9 * half { [packed[1] + 0.02, half] } else { [-half, packed[0] - 0.02] };
        let few = self.rng.random_range(0..=3);
        for _ in 0..few {
            self.somewhere(Pool::Any, other, [0.0, depth]);
        }
    }

    /// A wall in front and one from it to the back, and a few things in either chamber.
    fn chambers(&mut self) {
        let (half, depth) = (self.half_width(), self.depth());
        let at = self.between(0.2, 0.32) * depth;
        let middle = self.between(-0.3, 0.3) * half;
        let (left, right) = (-half * self.between(0.85, 1.0), half * self.between(0.85, 1.0));
        self.line(&Line { from: [left, at], to: [right, at], pool: Pool::Tall, gaps: [0.001, 0.012], same: 0.5 });
        let (from, to) = ([middle, at + 0.2 * depth], [middle, depth]);
        self.line(&Line { from, to, pool: Pool::Tall, gaps: [0.001, 0.01], same: 0.5 });
        for room in [[left, middle], [middle, right]] {
            let inside = self.rng.random_range(2..=4);
            for _ in 0..inside {
                let pool = if self.rng.random::<f32>() < 0.8 { Pool::Low } else { Pool::Any };
                self.somewhere(pool, room, [at + 0.12 * depth, depth]);
            }
        }
    }

    /// Places objects side by side along a line, each with a side along it.
    fn line(&mut self, line: &Line) {
        let [dx, dy] = [line.to[0] - line.from[0], line.to[1] - line.from[1]];
        let length = dx.hypot(dy);
        let along = [dx / length, dy / length];
        let angle = dy.atan2(dx).to_degrees();
        let mut at_m = 0.0;
        let mut last: Option<usize> = None;
        while at_m < length {
            let room = length - at_m;
            let repeats = last.is_some() && self.rng.random::<f64>() < line.same;
            // The longer side along the line, more often than not.
            let crosswise = self.rng.random::<f32>() < 0.3;
            let fits = |choice: &Choice<'_>| {
                let [x, y] = [span(&choice.footprint, [1.0, 0.0]), span(&choice.footprint, [0.0, 1.0])];
                (if crosswise { x.min(y) } else { x.max(y) }) <= room
            };
            let chosen = if repeats { last } else { self.pick(line.pool, fits) };
            let Some(at) = chosen else { break };
            last = Some(at);
            let footprint = &self.choices[at].footprint;
            let lies_along = span(footprint, [1.0, 0.0]) >= span(footprint, [0.0, 1.0]);
            let turn = if lies_along == crosswise { 90.0 } else { 0.0 };
            let yaw = angle + turn + self.between(-2.0, 2.0);
            let wide = span(&outline::placed(&self.choices[at].footprint, [0.0; 2], yaw), along);
            let middle = at_m + 0.5 * wide;
            self.try_place(at, [line.from[0] + along[0] * middle, line.from[1] + along[1] * middle], yaw);
            at_m += wide + self.between(line.gaps[0], line.gaps[1]);
        }
    }

    /// Places an object of a pool at random in a rectangle of the floor, if a place is found in some draws.
    fn somewhere(&mut self, pool: Pool, x: [f32; 2], y: [f32; 2]) {
        let Some(at) = self.pick(pool, |_| true) else { return };
        for _ in 0..DRAWS {
            let position = [self.between(x[0], x[1]), self.between(y[0], y[1])];
            let yaw = self.between(0.0, 180.0);
            if self.try_place(at, position, yaw) {
                return;
            }
        }
    }

    /// A class of a pool that fits, each as likely as the other; one of all that fit if the pool has none.
    fn pick(&mut self, pool: Pool, fits: impl Fn(&Choice<'_>) -> bool) -> Option<usize> {
        let is_in = |choice: &Choice<'_>| match pool {
            Pool::Any => true,
            Pool::Tall => choice.height_m >= TALL_M,
            Pool::Small => choice.height_m <= SMALL_M,
            Pool::Low => choice.height_m < TALL_M,
        };
        let fitting: Vec<usize> = (0..self.choices.len()).filter(|at| fits(&self.choices[*at])).collect();
        let of_pool: Vec<usize> = fitting.iter().copied().filter(|at| is_in(&self.choices[*at])).collect();
        let from = if of_pool.is_empty() { fitting } else { of_pool };
        from.choose(&mut self.rng).copied()
    }

    /// Places an object if it stands in the shelf and meets nothing.
    fn try_place(&mut self, choice: usize, position: [f32; 2], yaw_deg: f32) -> bool {
        if self.objects.len() >= crate::scene::MAX_OBJECTS {
            return false;
        }
        let choice = &self.choices[choice];
        // Tenths of a millimetre and of a degree, which files keep.
        let position = position.map(|v| (v * 1e4).round() / 1e4);
        let yaw_deg = ((yaw_deg * 10.0).round() / 10.0).rem_euclid(360.0);
        let outline = outline::placed(&choice.footprint, position, yaw_deg);
        let (half, margin) = (0.5 * self.shelf.size[0] - 0.5 * GAP_M, 0.5 * GAP_M);
        let high = self.shelf.size[1] - margin;
        let inside = outline.iter().all(|[x, y]| x.abs() <= half && *y >= margin && *y <= high);
        if !inside || self.standing.iter().any(|other| outline::separation(&outline, &other.outline) < 0.0) {
            return false;
        }
        self.objects.push(Object::new(choice.class.name.clone(), position, yaw_deg));
        self.standing.push(Standing { class: choice.class.id, position, outline });
        true
    }
}

/// Extent of an outline along a unit direction, metres.
fn span(outline: &[[f32; 2]], along: [f32; 2]) -> f32 {
    let at = outline.iter().map(|[x, y]| x * along[0] + y * along[1]);
    let [low, high] = at.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
    high - low
}

/// The larger of an outline's extents along its own axes, metres.
fn longest(outline: &[[f32; 2]]) -> f32 {
    span(outline, [1.0, 0.0]).max(span(outline, [0.0, 1.0]))
}
