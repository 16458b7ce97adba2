//! Where footprints can stand: bit masks over a fine grid of floor points, with convex obstacles drawn into them.

use crate::rng::ChaCha8Rng;
use rand::Rng;

/// Distance of two grid points, metres.
const STEP_M: f32 = 0.005;

/// The floor points that a footprint's centre may take.
pub struct FloorGrid {
    size: [f32; 2],
    columns: usize,
    rows: usize,
    /// Words of a row.
    words: usize,
}

/// One bit per floor point, set where a centre may not be; rows along x.
#[derive(Clone)]
pub struct FloorMask(Vec<u64>);

impl FloorGrid {
    /// The grid of a shelf's floor (size in metres).
    pub fn new(size: [f32; 3]) -> Self {
        let count = |length: f32| ((length / STEP_M).round() as usize).max(1);
        let (columns, rows) = (count(size[0]), count(size[1]));
        Self { size: [size[0], size[1]], columns, rows, words: columns.div_ceil(64) }
    }

    /// Points along x.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Distance of two points, metres.
    pub fn step_m(&self) -> f32 {
        STEP_M
    }

    /// x of a column, metres; multiples of a tenth of a millimetre, which files keep.
    pub fn x(&self, column: usize) -> f32 {
        let x = (column as f32 + 0.5) / self.columns as f32 * self.size[0] - 0.5 * self.size[0];
        (x * 1e4).round() / 1e4
    }

    /// y of a row, metres.
    pub fn y(&self, row: usize) -> f32 {
        ((row as f32 + 0.5) / self.rows as f32 * self.size[1] * 1e4).round() / 1e4
    }

    /// Whether an outline lies in the floor, `margin` off the walls.
    pub fn contains(&self, outline: &[[f32; 2]], margin: f32) -> bool {
        let half = 0.5 * self.size[0] - margin;
        outline.iter().all(|[x, y]| x.abs() <= half && *y >= margin && *y <= self.size[1] - margin)
    }

    /// The points where an outline about the origin would come nearer to a wall than `margin`.
    pub fn outside(&self, outline: &[[f32; 2]], margin: f32) -> FloorMask {
        let span = |axis: usize| {
            outline.iter().map(|p| p[axis]).fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)])
        };
        let ([x0, x1], [y0, y1]) = (span(0), span(1));
        let (left, right) = (-0.5 * self.size[0] + margin - x0, 0.5 * self.size[0] - margin - x1);
        let (front, back) = (margin - y0, self.size[1] - margin - y1);
        let mut free_row = vec![0; self.words];
        let mut free = (0..self.columns).filter(|x| (left..=right).contains(&self.x(*x)));
        if let Some(first) = free.next() {
            set_range(&mut free_row, first, free.next_back().unwrap_or(first));
        }
        let mut mask = FloorMask(vec![u64::MAX; self.words * self.rows]);
        for row in (0..self.rows).filter(|row| (front..=back).contains(&self.y(*row))) {
            let words = &mut mask.0[row * self.words..(row + 1) * self.words];
            words.iter_mut().zip(&free_row).for_each(|(word, free)| *word = !free);
        }
        mask
    }

    /// Blocks the points inside a convex outline.
    pub fn block(&self, mask: &mut FloorMask, obstacle: &[[f32; 2]]) {
        // Positions in columns and rows, where points are whole numbers.
        let [step_x, step_y] = [self.size[0] / self.columns as f32, self.size[1] / self.rows as f32];
        let at = |[x, y]: [f32; 2]| [(x + 0.5 * self.size[0]) / step_x - 0.5, y / step_y - 0.5];
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        let corners: Vec<[f32; 2]> = obstacle.iter().map(|corner| at(*corner)).collect();
        for [_, y] in &corners {
            (low, high) = (low.min(*y), high.max(*y));
        }
        let first = low.ceil().max(0.0) as usize;
        let past = ((high.floor() + 1.0).max(0.0) as usize).min(self.rows);
        if first >= past {
            return;
        }
        let mut spans = vec![[f32::INFINITY, f32::NEG_INFINITY]; past - first];
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            let (y0, y1) = (a[1].min(b[1]), a[1].max(b[1]));
            let rows = (y0.ceil().max(first as f32) as usize)..((y1.floor() + 1.0).max(0.0) as usize).min(past);
            let slope = if y1 > y0 { (b[0] - a[0]) / (b[1] - a[1]) } else { 0.0 };
            for row in rows {
                // Clamped to the edge: a nearly level one has a slope beyond all digits.
                let x = (a[0] + slope * (row as f32 - a[1])).clamp(a[0].min(b[0]), a[0].max(b[0]));
                let span = &mut spans[row - first];
                *span = [span[0].min(x), span[1].max(x)];
                if y1 == y0 {
                    *span = [span[0].min(b[0]), span[1].max(b[0])];
                }
            }
        }
        for (row, [left, right]) in (first..past).zip(spans) {
            let (from, to) = (left.ceil().max(0.0), right.floor().min(self.columns as f32 - 1.0));
            if from <= to {
                set_range(&mut mask.0[row * self.words..(row + 1) * self.words], from as usize, to as usize);
            }
        }
    }

    /// The points that are blocked in every mask; `None` without masks.
    pub fn common<'a>(&self, mut masks: impl Iterator<Item = &'a FloorMask>) -> Option<FloorMask> {
        let mut common = masks.next()?.clone();
        for mask in masks {
            common.0.iter_mut().zip(&mask.0).for_each(|(word, other)| *word &= other);
        }
        Some(common)
    }

    /// Whether a point is blocked.
    pub fn is_blocked(&self, mask: &FloorMask, column: usize, row: usize) -> bool {
        mask.0[row * self.words + column / 64] >> (column % 64) & 1 == 1
    }

    /// Draws one of the free points, column and row, with the weight of its column. `None` when none is free.
    pub fn draw_free(&self, mask: &FloorMask, column_weights: &[f64], rng: &mut ChaCha8Rng) -> Option<(usize, usize)> {
        let free = (0..self.rows)
            .flat_map(|row| (0..self.columns).map(move |column| (column, row)))
            .filter(|(column, row)| !self.is_blocked(mask, *column, *row));
        let free: Vec<(usize, usize)> = free.collect();
        let total: f64 = free.iter().map(|(column, _)| column_weights[*column]).sum();
        let mut at = rng.random::<f64>() * total;
        for point in &free {
            at -= column_weights[point.0];
            if at < 0.0 {
                return Some(*point);
            }
        }
        free.last().copied()
    }
}

/// Sets the bits `from..=to` of a row.
fn set_range(row: &mut [u64], from: usize, to: usize) {
    for (at, word) in row.iter_mut().enumerate().take(to / 64 + 1).skip(from / 64) {
        let low = from.max(at * 64) - at * 64;
        let high = to.min(at * 64 + 63) - at * 64;
        *word |= (u64::MAX << low) & (u64::MAX >> (63 - high));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::outline;
    use proptest::prelude::*;

    proptest! {
        /// A point is blocked exactly when the footprint centred there meets the obstacle or a wall.
        #[test]
        fn masks_agree_with_separating_axes(
            x in -0.3_f32..0.3, y in 0.0_f32..0.4, yaws in prop::array::uniform2(0.0_f32..180.0), sides in 3_usize..8,
        ) {
            let grid = FloorGrid::new([0.8, 0.4, 0.4]);
            let ring = (0..sides).map(|i| (std::f32::consts::TAU * i as f32 / sides as f32).sin_cos());
            let polygon: Vec<[f32; 2]> = ring.map(|(sin, cos)| [0.06 * cos, 0.03 * sin]).collect();
            let standing = outline::placed(&polygon, [x, y], yaws[0]);
            let moving = outline::placed(&polygon, [0.0, 0.0], yaws[1]);
            let mut mask = grid.outside(&moving, 0.001);
            grid.block(&mut mask, &outline::obstacle(&standing, &moving));
            for column in (0..grid.columns()).step_by(3) {
                for row in (0..grid.rows).step_by(3) {
                    let there = outline::placed(&moving, [grid.x(column), grid.y(row)], 0.0);
                    let gap = outline::separation(&there, &standing);
                    if gap.abs() < 1e-4 {
                        continue;
                    }
                    let blocked = gap < 0.0 || !grid.contains(&there, 0.001);
                    prop_assert_eq!(grid.is_blocked(&mask, column, row), blocked, "at {} {}", column, row);
                }
            }
        }
    }
}
