//! How much transparent space lies ahead of a transparent voxel.
//!
//! Skip level `l` of a voxel says that the box of `RADII[l]` voxels to both sides, up and down, and twice as many
//! into the shelf is transparent (all rays go into the shelf, so nothing behind matters). The sets of voxels that
//! reach a level are nested; each follows from the one before by widening the blocked voxels, one bit per voxel, by
//! shifted copies (a box of radius `r` widened by `s <= r` is covered by its two shifts by `s`).

use super::code::FIRST_INFORMATIVE;
use super::layout::{Layout, VoxelBox};
use crate::grid::Window;

/// Free voxels to the side, by skip level.
pub(super) const RADII: [u8; LEVELS] = [0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32];
/// Number of skip levels.
pub(super) const LEVELS: usize = 11;
/// Levels that are distinguished where a prediction changed the field: enough, and quick to compute.
pub(super) const LOCAL_LEVELS: usize = 6;

/// Free voxels to the side, by code; 0 for what is not transparent.
pub(super) const RADIUS_OF_CODE: [u8; 256] = {
    let mut radius = [0; 256];
    let mut level = 0;
    while level < LEVELS {
        radius[level] = RADII[level];
        level += 1;
    }
    radius
};

/// Whether a code is a transparent voxel's.
#[inline(always)]
pub(super) fn is_transparent(code: u8) -> bool {
    code < FIRST_INFORMATIVE
}

/// Writes the skip levels, below `levels`, of the transparent voxels in `window`.
pub(super) fn mark(codes: &mut [u8], layout: &Layout, window: Window, levels: usize) {
    let [width, depth, height] = layout.grid.dims;
    let reach = usize::from(RADII[levels - 1]);
    // The columns that can matter. What lies beyond counts as blocked: beyond the shelf it is, and beyond the reach
    // it is too far to be noticed inside the window.
    let (x0, x1) = (window.x[0].saturating_sub(reach), (window.x[1] + reach).min(width));
    let (y0, y1) = (window.y[0], (window.y[1] + 2 * reach).min(depth));
    let mut blocked = Columns::blocked(x1 - x0, y1 - y0, height);
    for x in x0..x1 {
        for y in y0..y1 {
            let from = layout.at([x, y, 0]);
            for (word, codes) in
                blocked.column_mut(x - x0, y - y0).iter_mut().zip(codes[from..from + height].chunks(64))
            {
                for (bit, code) in codes.iter().enumerate() {
                    *word &= !(u64::from(is_transparent(*code)) << bit);
                }
            }
        }
    }
    // Binary digits of every voxel's level, counted up as it passes level after level.
    let mut digits: [Columns; 4] = std::array::from_fn(|_| Columns::clear(x1 - x0, y1 - y0, height));
    let mut scratch = blocked.clone();
    for level in 1..levels {
        blocked.widen(usize::from(RADII[level] - RADII[level - 1]), &mut scratch);
        for at in 0..blocked.words.len() {
            let mut carry = !blocked.words[at];
            for digit in &mut digits {
                let digit = &mut digit.words[at];
                (*digit, carry) = (*digit ^ carry, *digit & carry);
            }
        }
    }
    for x in window.x[0]..window.x[1] {
        for y in window.y[0]..window.y[1] {
            let from = layout.at([x, y, 0]);
            let digits = [0, 1, 2, 3].map(|digit: usize| digits[digit].column(x - x0, y - y0));
            for (eight, codes) in codes[from..from + height].chunks_mut(8).enumerate() {
                let byte = |digit: usize| digits[digit][eight / 8].to_le_bytes()[eight % 8];
                let spread = |digit: usize| SPREAD[usize::from(byte(digit))] << digit;
                let levels = (spread(0) | spread(1) | spread(2) | spread(3)).to_le_bytes();
                for (code, level) in codes.iter_mut().zip(levels) {
                    *code = if is_transparent(*code) { level } else { *code };
                }
            }
        }
    }
}

/// Lowers the skip levels around voxels that are no longer transparent, all inside `blocked`, to what is surely free.
pub(super) fn limit(codes: &mut [u8], layout: &Layout, blocked: VoxelBox) {
    let [width, _, height] = layout.grid.dims;
    let reach = usize::from(RADII[LEVELS - 1]);
    // The highest level whose box has this many voxels to the side.
    let level = |room: usize| (0..LEVELS).rev().find(|&level| usize::from(RADII[level]) <= room).unwrap_or(0) as u8;
    let off = |at: usize, axis: usize| blocked.min[axis].saturating_sub(at).max(at.saturating_sub(blocked.max[axis]));
    let by_distance: Vec<u8> = (0..=reach + 1).map(|away| level(away.saturating_sub(1))).collect();
    let by_height: Vec<u8> = (0..height).map(|z| by_distance[off(z, 2).min(reach + 1)]).collect();
    for x in blocked.min[0].saturating_sub(reach)..(blocked.max[0] + reach + 1).min(width) {
        let beside = by_distance[off(x, 0).min(reach + 1)];
        for y in blocked.min[1].saturating_sub(2 * reach)..=blocked.max[1] {
            // A box reaches `2 r` voxels into the shelf, so `2 r < off`; behind the blocked voxels only the side counts.
            let before = by_distance[off(y, 1).div_ceil(2).min(reach + 1)];
            let sideways = beside.max(before);
            let from = layout.at([x, y, 0]);
            for (code, by_height) in codes[from..from + height].iter_mut().zip(&by_height) {
                let most = sideways.max(*by_height);
                *code = if is_transparent(*code) { (*code).min(most) } else { *code };
            }
        }
    }
}

/// The bits of a byte, one per byte.
const SPREAD: [u64; 256] = {
    let mut spread = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut bit = 0;
        while bit < 8 {
            spread[byte] |= (byte as u64 >> bit & 1) << (8 * bit);
            bit += 1;
        }
        byte += 1;
    }
    spread
};

/// A bit per voxel, whole words per column.
#[derive(Clone)]
struct Columns {
    size: [usize; 2],
    words_per_column: usize,
    words: Vec<u64>,
}

impl Columns {
    fn clear(width: usize, depth: usize, height: usize) -> Self {
        let words_per_column = height.div_ceil(64);
        Self { size: [width, depth], words_per_column, words: vec![0; width * depth * words_per_column] }
    }

    fn blocked(width: usize, depth: usize, height: usize) -> Self {
        let mut all = Self::clear(width, depth, height);
        all.words.fill(!0);
        all
    }

    fn range(&self, x: usize, y: usize) -> std::ops::Range<usize> {
        let from = (x * self.size[1] + y) * self.words_per_column;
        from..from + self.words_per_column
    }

    fn column(&self, x: usize, y: usize) -> &[u64] {
        &self.words[self.range(x, y)]
    }

    fn column_mut(&mut self, x: usize, y: usize) -> &mut [u64] {
        let range = self.range(x, y);
        &mut self.words[range]
    }

    /// Adds the voxels `by` (below 64) above, below and to both sides of the set's, and up to twice as far before
    /// them. Everything outside belongs to the set.
    fn widen(&mut self, by: usize, scratch: &mut Self) {
        let n = self.words_per_column;
        for (wide, column) in scratch.words.chunks_exact_mut(n).zip(self.words.chunks_exact(n)) {
            for k in 0..n {
                let below = if k > 0 { column[k - 1] } else { !0 };
                let above = if k + 1 < n { column[k + 1] } else { !0 };
                wide[k] = column[k] | column[k] << by | below >> (64 - by) | column[k] >> by | above << (64 - by);
            }
        }
        let plane = self.size[1] * n;
        let (near, far) = (by * n, 2 * by * n);
        for (wide, plane) in self.words.chunks_exact_mut(plane).zip(scratch.words.chunks_exact(plane)) {
            let inside = plane.len().saturating_sub(far);
            for at in 0..inside {
                wide[at] = plane[at] | plane[at + near] | plane[at + far];
            }
            wide[inside..].fill(!0);
        }
        let width = self.size[0];
        for x in 0..width {
            let wide = &mut scratch.words[x * plane..(x + 1) * plane];
            if x < by || x + by >= width {
                wide.fill(!0);
                continue;
            }
            let beside = |x: usize| &self.words[x * plane..(x + 1) * plane];
            let (left, middle, right) = (beside(x - by), beside(x), beside(x + by));
            for at in 0..plane {
                wide[at] = left[at] | middle[at] | right[at];
            }
        }
        std::mem::swap(&mut self.words, &mut scratch.words);
    }
}
