//! Between the belief's arrays and the networks' planes: the only place that knows both.
//!
//! A network sees the floor plan as an image and the heights as channels. To be light it works on folded planes: two by
//! two floor cells make one pixel with four channels (space to depth), and two voxels of 5 mm make one level of 1 cm, up
//! to the scored height of 0.27 m. Channel `k * 4 + sub` is level or class `k` at the sub-cell `sub = 2 (x % 2) + y % 2`;
//! planes are `[x / 2][y / 2]`, padded at the far ends so that the U-Net can halve them three times.
//!
//! Evidence goes in as its logarithm, which squashes it and is 0 for the uniform prior.

use crate::belief::{Belief, Moved, Stroke};
use crate::camera::{MapObservation, UNOBSERVED};
use crate::grid::{Grid, VoxelSet};
use crate::scene::CLASS_COUNT;
use crate::{Error, Result};
use rand::Rng;
use rayon::prelude::*;
use std::ops::Range;

/// Levels that the networks see.
pub const LEVELS: usize = 27;
/// Voxels in a level.
pub(super) const VOXELS_PER_LEVEL: usize = 2;
/// The voxel that the networks are made for, metres.
const VOXEL_M: f32 = 0.005;
/// Floor cells in a pixel, along x and along y.
const FOLD: usize = 2;
/// Sub-cells of a pixel.
pub(crate) const SUBS: usize = FOLD * FOLD;
/// The U-Net halves its planes so often that they must be multiples of this.
const PIXEL_MULTIPLE: usize = 8;
/// Channels of one occupancy quantity: a value per level and sub-cell.
pub(super) const OCCUPANCY: usize = LEVELS * SUBS;
/// Channels of the semantics: a value per class and sub-cell.
pub(super) const SEMANTICS: usize = CLASS_COUNT * SUBS;
/// Channels of a label map: one-hot classes and "unobserved".
pub(super) const LABELS: usize = (CLASS_COUNT + 1) * SUBS;

/// Whether x is mirrored on the way, for augmentation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mirror {
    /// As it is.
    No,
    /// Left is right.
    X,
}

impl Mirror {
    /// The one or the other, each as likely.
    pub(crate) fn either(rng: &mut impl Rng) -> Self {
        if rng.random() { Self::X } else { Self::No }
    }
}

/// The planes of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    grid: Grid,
    /// Pixels along x and y.
    pixels: [usize; 2],
}

impl Layout {
    /// The planes of `grid`.
    ///
    /// # Errors
    /// [`Error::Usage`] for a grid whose voxels are not 5 mm.
    pub fn new(grid: &Grid) -> Result<Self> {
        if (grid.voxel_m - VOXEL_M).abs() > 1e-6 {
            let message = format!("the networks are made for voxels of {VOXEL_M} m, not {} m", grid.voxel_m);
            return Err(Error::Usage(message));
        }
        let pixels = [grid.dims[0], grid.dims[1]].map(|n| n.div_ceil(FOLD).next_multiple_of(PIXEL_MULTIPLE));
        Ok(Self { grid: *grid, pixels })
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Pixels along x and y.
    pub fn pixels(&self) -> [usize; 2] {
        self.pixels
    }

    /// Pixels of a plane.
    pub fn plane(&self) -> usize {
        self.pixels[0] * self.pixels[1]
    }

    /// Whether some pixels lie outside the floor plan.
    pub fn is_padded(&self) -> bool {
        self.plane() * SUBS != self.grid.cell_count()
    }

    /// Shape of a tensor of `channels` planes.
    pub(super) fn shape(&self, channels: usize) -> [i64; 4] {
        [1, channels as i64, self.pixels[0] as i64, self.pixels[1] as i64]
    }

    /// Sub-cell and pixel of a floor cell.
    fn place(&self, cell: usize, mirror: Mirror) -> (usize, usize) {
        let [width, depth, _] = self.grid.dims;
        let (x, y) = (cell / depth, cell % depth);
        let x = if mirror == Mirror::X { width - 1 - x } else { x };
        (x % FOLD * FOLD + y % FOLD, x / FOLD * self.pixels[1] + y / FOLD)
    }

    /// All pixels along x.
    pub(crate) fn whole(&self) -> Range<usize> {
        0..self.pixels[0]
    }

    /// The window of at most `width` pixels along x around a stroke, in planes that are not mirrored.
    pub(crate) fn around(&self, stroke: &Stroke, width: usize) -> Range<usize> {
        let width = width.min(self.pixels[0]);
        let middle = 0.5 * (stroke.start.x + stroke.end().x) - self.grid.origin[0];
        let pixel = middle / (self.grid.voxel_m * FOLD as f32);
        let first = (pixel - 0.5 * width as f32).round().clamp(0.0, (self.pixels[0] - width) as f32) as usize;
        first..first + width
    }

    /// The same pixels in planes that are mirrored; for planes without padding.
    pub(crate) fn mirrored(&self, x: &Range<usize>) -> Range<usize> {
        self.pixels[0] - x.end..self.pixels[0] - x.start
    }

    /// Floor cells whose (mirrored) pixels are in `x`, each with its sub-cell and its position in a plane of those pixels.
    fn cells(&self, mirror: Mirror, x: Range<usize>) -> impl Iterator<Item = (usize, usize, usize)> {
        let ([width, depth, _], across) = (self.grid.dims, self.pixels[1]);
        let first = x.start;
        (FOLD * x.start..(FOLD * x.end).min(width)).flat_map(move |at| {
            let x = if mirror == Mirror::X { width - 1 - at } else { at };
            (0..depth)
                .map(move |y| (x * depth + y, at % FOLD * FOLD + y % FOLD, (at / FOLD - first) * across + y / FOLD))
        })
    }

    /// The share of occupied voxels per level in the pixels `x`: [`OCCUPANCY`] planes of 0, a half or 1 (zero before).
    pub(crate) fn put_set(&self, set: &VoxelSet, mirror: Mirror, x: Range<usize>, out: &mut [f32]) {
        const SHARE: [f32; 4] = [0.0, 0.5, 0.5, 1.0];
        let plane = x.len() * self.pixels[1];
        assert_eq!(out.len(), OCCUPANCY * plane, "planes of another layout");
        let height = self.grid.dims[2];
        let mask = if height < 64 { (1_u64 << height) - 1 } else { u64::MAX };
        let words = set.words();
        for (cell, sub, pixel) in self.cells(mirror, x) {
            // The lowest 64 voxels of the column, of which 54 are looked at.
            let bit = cell * height;
            let (word, shift) = (bit / 64, bit % 64);
            let high = if shift == 0 { 0 } else { words.get(word + 1).copied().unwrap_or(0) << (64 - shift) };
            let mut bits = (words[word] >> shift | high) & mask;
            if bits == 0 {
                continue;
            }
            for level in 0..LEVELS {
                out[(level * SUBS + sub) * plane + pixel] = SHARE[(bits & 3) as usize];
                bits >>= VOXELS_PER_LEVEL;
            }
        }
    }

    /// Where a stroke starts and where it ends: two times [`SUBS`] planes, 1 within a centimetre (zero before).
    pub(crate) fn put_marks(&self, stroke: &Stroke, mirror: Mirror, x: Range<usize>, out: &mut [f32]) {
        const REACH_M: f32 = 0.01;
        let plane = x.len() * self.pixels[1];
        let ends = [stroke.start, stroke.end()];
        for (cell, sub, pixel) in self.cells(mirror, x) {
            let at = self.grid.cell_center(self.grid.cell(cell));
            for (which, end) in ends.iter().enumerate() {
                if (at.x - end.x).hypot(at.y - end.y) < REACH_M {
                    out[(which * SUBS + sub) * plane + pixel] = 1.0;
                }
            }
        }
    }

    /// Where what is moved stood, and where it comes to: two times [`SUBS`] planes (zero before).
    pub(crate) fn put_moved(&self, moved: &Moved, mirror: Mirror, x: Range<usize>, out: &mut [f32]) {
        let (stood, comes) = out.split_at_mut(SUBS * x.len() * self.pixels[1]);
        self.put_cells(|cell| moved.stood(cell), mirror, x.clone(), stood);
        self.put_cells(|cell| moved.source(cell).is_some(), mirror, x, comes);
    }

    /// Channels of the (mirrored) whole `planes`, shifted with what is moved to where it comes to in the pixels `x`
    /// (zero before).
    pub(crate) fn put_arriving(&self, moved: &Moved, planes: &[f32], mirror: Mirror, x: Range<usize>, out: &mut [f32]) {
        let (whole, plane) = (self.plane(), x.len() * self.pixels[1]);
        for (cell, sub, pixel) in self.cells(mirror, x) {
            let Some(source) = moved.source(cell) else { continue };
            let (from, at) = self.place(source, mirror);
            for channel in (0..planes.len() / whole).step_by(SUBS) {
                out[(channel + sub) * plane + pixel] = planes[(channel + from) * whole + at];
            }
        }
    }

    /// Floor cells that `is` holds of: [`SUBS`] planes of 0 and 1 (zero before).
    pub(crate) fn put_cells(&self, is: impl Fn(usize) -> bool, mirror: Mirror, x: Range<usize>, out: &mut [f32]) {
        let plane = x.len() * self.pixels[1];
        for (_, sub, pixel) in self.cells(mirror, x).filter(|(cell, ..)| is(*cell)) {
            out[sub * plane + pixel] = 1.0;
        }
    }

    /// An observation: occupied levels, then free levels (2 x [`OCCUPANCY`] planes).
    pub(crate) fn put_observed(&self, observation: &MapObservation, mirror: Mirror, out: &mut [f32]) {
        let (occupied, free) = out.split_at_mut(OCCUPANCY * self.plane());
        self.put_set(&observation.occupied, mirror, self.whole(), occupied);
        self.put_set(&observation.free, mirror, self.whole(), free);
    }

    /// A label map as one-hot planes, "unobserved" last ([`LABELS`] planes, zero before).
    pub(crate) fn put_labels(&self, labels: &[u8], mirror: Mirror, out: &mut [f32]) {
        assert_eq!(out.len(), LABELS * self.plane(), "planes of another layout");
        for (cell, &label) in labels.iter().enumerate() {
            let (sub, pixel) = self.place(cell, mirror);
            let class = if label == UNOBSERVED { CLASS_COUNT } else { usize::from(label).min(CLASS_COUNT) };
            out[(class * SUBS + sub) * self.plane() + pixel] = 1.0;
        }
    }

    /// A map of true labels in the pixels `x` as class numbers ([`SUBS`] planes).
    pub(crate) fn put_classes(&self, labels: &[u8], mirror: Mirror, x: Range<usize>, out: &mut [i64]) {
        let plane = x.len() * self.pixels[1];
        assert_eq!(out.len(), SUBS * plane, "planes of another layout");
        for (cell, sub, pixel) in self.cells(mirror, x) {
            out[sub * plane + pixel] = i64::from(labels[cell]);
        }
    }

    /// The logarithms of a belief's evidence: occupied, then free levels (2 x [`OCCUPANCY`] planes), and classes
    /// ([`SEMANTICS`] planes). The evidence of a level is the mean of its voxels'.
    pub(crate) fn put_belief(&self, belief: &Belief, occupancy: &mut [f32], semantics: &mut [f32]) {
        let (plane, height) = (self.plane(), self.grid.dims[2]);
        // Level by level, so that threads write apart from each other, both sides of it at once: they lie side by side.
        let (occupied, free) = occupancy.split_at_mut(OCCUPANCY * plane);
        occupied.par_chunks_mut(SUBS * plane).zip(free.par_chunks_mut(SUBS * plane)).enumerate().for_each(
            |(level, (occupied, free))| {
                let voxels = (level * VOXELS_PER_LEVEL).min(height)..((level + 1) * VOXELS_PER_LEVEL).min(height);
                let share = 1.0 / voxels.len().max(1) as f32;
                let mut last = ([f32::NAN; 2], [0.0; 2]);
                for (cell, sub, pixel) in self.cells(Mirror::No, self.whole()) {
                    let column = &belief.occupancy[cell * height..(cell + 1) * height];
                    let sum = column[voxels.clone()].iter().fold([0.0; 2], |sum, a| [sum[0] + a[0], sum[1] + a[1]]);
                    // Neighbours often share their evidence: one logarithm for all of them.
                    if sum != last.0 {
                        last = (sum, sum.map(|sum| (sum * share).max(1.0).ln()));
                    }
                    occupied[sub * plane + pixel] = last.1[0];
                    free[sub * plane + pixel] = last.1[1];
                }
            },
        );
        semantics.par_chunks_mut(SUBS * plane).enumerate().for_each(|(class, out)| {
            for (cell, sub, pixel) in self.cells(Mirror::No, self.whole()) {
                out[sub * plane + pixel] = belief.semantics[cell][class].max(1.0).ln();
            }
        });
    }

    /// The belief of evidence planes (not logarithms) in the order of [`Layout::put_belief`]. Voxels above the networks'
    /// levels get the evidence of the highest level below them: objects stand on the board and do not overhang.
    pub(crate) fn belief(&self, occupancy: &[f32], semantics: &[f32]) -> Belief {
        let (plane, height) = (self.plane(), self.grid.dims[2]);
        let mut belief = Belief::uniform(self.grid);
        belief.occupancy.par_chunks_mut(height).zip(&mut belief.semantics).enumerate().for_each(
            |(cell, (column, classes))| {
                let (sub, pixel) = self.place(cell, Mirror::No);
                for (level, voxels) in column.chunks_mut(VOXELS_PER_LEVEL).enumerate() {
                    let at = (level.min(LEVELS - 1) * SUBS + sub) * plane + pixel;
                    voxels.fill([occupancy[at], occupancy[OCCUPANCY * plane + at]]);
                }
                for (class, a) in classes.iter_mut().enumerate() {
                    *a = semantics[(class * SUBS + sub) * plane + pixel];
                }
            },
        );
        belief
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::{FloorPlan, Flow, SOLID};
    use crate::skill::push::{Push, SweptPush};

    fn grid() -> Grid {
        Grid::for_shelf([0.80, 0.40, 0.40], 0.005)
    }

    #[test]
    fn a_belief_goes_to_planes_and_back() {
        let layout = Layout::new(&grid()).expect("5 mm");
        let mut belief = Belief::uniform(grid());
        for cell in 0..grid().cell_count() {
            for level in 0..LEVELS {
                let a = [1.0 + (cell * 31 + level * 7) as f32 % 50.0, 1.0 + (cell + level) as f32 % 9.0];
                let first = grid().column(cell).start + 2 * level;
                belief.occupancy[first..first + 2].fill(a);
            }
            let top = belief.occupancy[grid().column(cell).start + 2 * LEVELS - 1];
            belief.occupancy[grid().column(cell)][2 * LEVELS..].fill(top);
            belief.semantics[cell] = std::array::from_fn(|k| 1.0 + (cell * (k + 3)) as f32 % 20.0);
        }
        let plane = layout.plane();
        let (mut occupancy, mut semantics) = (vec![0.0; 2 * OCCUPANCY * plane], vec![0.0; SEMANTICS * plane]);
        layout.put_belief(&belief, &mut occupancy, &mut semantics);
        let exp = |planes: &[f32]| planes.iter().map(|x| x.exp()).collect::<Vec<f32>>();
        let back = layout.belief(&exp(&occupancy), &exp(&semantics));
        let close = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4 * a);
        assert!(close(belief.occupancy.as_flattened(), back.occupancy.as_flattened()));
        assert!(close(belief.semantics.as_flattened(), back.semantics.as_flattened()));
    }

    #[test]
    fn sets_and_labels_land_where_the_belief_has_them() {
        // A shelf whose columns are no whole words, whose planes need padding, and that is lower than the levels.
        for size in [[0.80, 0.40, 0.40], [0.33, 0.21, 0.19]] {
            let grid = Grid::for_shelf(size, 0.005);
            let layout = Layout::new(&grid).expect("5 mm");
            let plane = layout.plane();
            let mut set = VoxelSet::empty(&grid);
            let mut belief = Belief::uniform(grid);
            let mut labels = vec![UNOBSERVED; grid.cell_count()];
            for index in (0..grid.voxel_count()).filter(|index| index * 7 % 13 < 5) {
                set.insert(index);
            }
            for (index, a) in belief.occupancy.iter_mut().enumerate() {
                a[0] = if set.contains(index) { 1.5 } else { 0.5 };
            }
            for (cell, label) in labels.iter_mut().enumerate().filter(|(cell, _)| cell % 3 != 0) {
                *label = (cell % CLASS_COUNT) as u8;
                belief.semantics[cell][cell % CLASS_COUNT] = 2.0;
            }
            let mut planes = vec![0.0; OCCUPANCY * plane];
            layout.put_set(&set, Mirror::No, layout.whole(), &mut planes);
            let (mut occupancy, mut semantics) = (vec![0.0; 2 * OCCUPANCY * plane], vec![0.0; SEMANTICS * plane]);
            layout.put_belief(&belief, &mut occupancy, &mut semantics);
            for (share, log) in planes.iter().zip(&occupancy).filter(|(_, log)| **log > 0.0) {
                assert_eq!(*share, 1.0, "the mean is above 1 where both voxels are in: {log}");
            }
            let full = |planes: &[f32]| planes.iter().filter(|share| **share == 1.0).count();
            assert_eq!(full(&planes), occupancy.iter().filter(|log| **log > 0.0).count());
            let mut one_hot = vec![0.0; LABELS * plane];
            layout.put_labels(&labels, Mirror::No, &mut one_hot);
            assert!(one_hot[..SEMANTICS * plane].iter().zip(&semantics).all(|(hot, log)| (*hot > 0.0) == (*log > 0.0)));
            let unobserved = one_hot[SEMANTICS * plane..].iter().sum::<f32>() as usize;
            assert_eq!(unobserved, labels.iter().filter(|label| **label == UNOBSERVED).count());
        }
    }

    #[test]
    fn mirrored_twice_is_as_it_was() {
        let layout = Layout::new(&grid()).expect("5 mm");
        let mut set = VoxelSet::empty(&grid());
        (0..grid().voxel_count()).filter(|index| index * 11 % 17 < 6).for_each(|index| set.insert(index));
        let mut flipped = VoxelSet::empty(&grid());
        for index in set.iter() {
            let voxel = grid().voxel(index);
            flipped.insert(grid().index(crate::grid::Voxel { x: 159 - voxel.x, ..voxel }));
        }
        let planes = |set: &VoxelSet, mirror| {
            let mut out = vec![0.0; OCCUPANCY * layout.plane()];
            layout.put_set(set, mirror, layout.whole(), &mut out);
            out
        };
        assert_eq!(planes(&flipped, Mirror::X), planes(&set, Mirror::No));
        assert_ne!(planes(&set, Mirror::X), planes(&set, Mirror::No));

        // Evidence turned round as a whole is the same as planes of what is turned round.
        let [x, y] = layout.pixels().map(|n| n as i64);
        let as_evidence = |planes: &[f32]| {
            let occupancy = tch::Tensor::from_slice(planes).reshape([1, OCCUPANCY as i64, x, y]);
            super::super::Evidence { semantics: occupancy.shallow_clone(), occupancy }
        };
        let turned = as_evidence(&planes(&set, Mirror::No)).mirrored();
        let expected = as_evidence(&planes(&set, Mirror::X));
        assert!(turned.occupancy.equal(&expected.occupancy) && turned.semantics.equal(&expected.semantics));
    }

    #[test]
    fn a_window_is_a_part_of_the_whole_mirrored_or_not() {
        let layout = Layout::new(&grid()).expect("5 mm");
        let mut set = VoxelSet::empty(&grid());
        (0..grid().voxel_count()).filter(|index| index * 11 % 17 < 6).for_each(|index| set.insert(index));
        let push = Push { start: [0.12, 0.1, 0.06], direction_deg: 60.0, length_m: 0.1 };
        let window = layout.around(&push.stroke(), 40);
        assert_eq!(window.len(), 40);
        let [across, along] = layout.pixels();
        for (mirror, x) in [(Mirror::No, window.clone()), (Mirror::X, layout.mirrored(&window))] {
            let mut whole = vec![0.0; OCCUPANCY * layout.plane()];
            layout.put_set(&set, mirror, layout.whole(), &mut whole);
            let mut part = vec![0.0; OCCUPANCY * 40 * along];
            layout.put_set(&set, mirror, x.clone(), &mut part);
            let mut marks = vec![0.0; 2 * SUBS * 40 * along];
            layout.put_marks(&push.stroke(), mirror, x.clone(), &mut marks);
            assert!(marks.iter().sum::<f32>() > 16.0, "both ends are in the window");
            for channel in 0..OCCUPANCY {
                let from = channel * across * along + x.start * along;
                assert_eq!(part[channel * 40 * along..][..40 * along], whole[from..from + 40 * along]);
            }
        }
    }

    /// A push that meets a box 3 cm along its way of 8 cm, towards the far right.
    fn push_of_a_box() -> (Belief, SweptPush) {
        let mut belief = Belief::uniform(grid());
        let mut swept = VoxelSet::empty(&grid());
        let push = Push { start: [0.10, 0.12, 0.06], direction_deg: 60.0, length_m: 0.08 };
        for index in 0..grid().voxel_count() {
            let at = grid().center(grid().voxel(index));
            let cell = index / grid().dims[2];
            let inside = (0.08..0.16).contains(&at.x) && (0.146..0.19).contains(&at.y) && at.z < 0.12;
            belief.occupancy[index] = if inside { [9.0 + at.x, 1.5] } else { [1.0, 12.0] };
            belief.semantics[cell][if inside { 5 } else { 14 }] = 4.0 + at.y;
            let along = (at.x - 0.10) * 0.5 + (at.y - 0.12) * 0.866;
            let beside = ((at.y - 0.12) * 0.5 - (at.x - 0.10) * 0.866).abs();
            if (0.0..0.08).contains(&along) && beside < 0.01 && (0.04..0.08).contains(&at.z) {
                swept.insert(index);
            }
        }
        (belief, SweptPush { push, swept })
    }

    #[test]
    fn what_is_carried_along_arrives_whole_mirrored_or_not() {
        let layout = Layout::new(&grid()).expect("5 mm");
        let (belief, push) = push_of_a_box();
        let carried = push.intervention(&belief, &FloorPlan::new(&belief, SOLID)).flow.moved(&grid());
        let evidence = |belief: &Belief| {
            let plane = layout.plane();
            let (mut occupancy, mut semantics) = (vec![0.0; 2 * OCCUPANCY * plane], vec![0.0; SEMANTICS * plane]);
            layout.put_belief(belief, &mut occupancy, &mut semantics);
            [occupancy, semantics]
        };
        // The belief of what arrives alone.
        let mut expected = Belief::uniform(grid());
        let mut count = 0;
        for cell in 0..grid().cell_count() {
            let Some(source) = carried.source(cell) else { continue };
            let from = &belief.occupancy[grid().column(source)];
            expected.occupancy[grid().column(cell)].copy_from_slice(from);
            expected.semantics[cell] = belief.semantics[source];
            assert!(carried.stood(source) && belief.semantics[source][5] > 4.0, "it comes from the box");
            let way = [0, 1].map(|axis| {
                let at = [cell, source].map(|cell| [grid().cell(cell).x, grid().cell(cell).y][axis] as f32);
                (at[0] - at[1]) * 0.005
            });
            // 8 cm less the 3 cm before the contact, towards 60 degrees.
            assert!((way[0] - 0.025).abs() < 0.008 && (way[1] - 0.043).abs() < 0.008, "{way:?}");
            count += 1;
        }
        assert_eq!(count, 16 * 9, "all of its cells arrive");
        let [x, y] = layout.pixels().map(|n| n as i64);
        let tensor = |planes: &[f32]| tch::Tensor::from_slice(planes).reshape([1, -1, x, y]);
        for (planes, expected) in evidence(&belief).iter().zip(&evidence(&expected)) {
            let arriving = |planes: &[f32], mirror| {
                let mut out = vec![0.0; planes.len()];
                layout.put_arriving(&carried, planes, mirror, layout.whole(), &mut out);
                out
            };
            let here = arriving(planes, Mirror::No);
            assert_eq!(&here, expected);
            let mirrored = |planes: &[f32]| {
                let occupancy = tensor(planes);
                super::super::Evidence { semantics: occupancy.shallow_clone(), occupancy }.mirrored().occupancy
            };
            let turned = Vec::<f32>::try_from(mirrored(planes).flatten(0, -1)).expect("numbers");
            assert!(tensor(&arriving(&turned, Mirror::X)).equal(&mirrored(&here)));
        }
        let mut marks = vec![0.0; 2 * SUBS * layout.plane()];
        layout.put_moved(&carried, Mirror::No, layout.whole(), &mut marks);
        let (stood, comes) = marks.split_at(SUBS * layout.plane());
        assert_eq!([stood, comes].map(|marks| marks.iter().sum::<f32>() as usize), [count; 2]);
    }

    #[test]
    fn a_push_through_air_carries_nothing_along() {
        let (belief, push) = push_of_a_box();
        let air = Belief { occupancy: vec![[1.0, 9.0]; grid().voxel_count()], ..belief };
        let flow = push.intervention(&air, &FloorPlan::new(&air, SOLID)).flow;
        assert!(flow == Flow::nothing() && flow.moved(&grid()).is_nothing());
    }

    #[test]
    fn other_voxels_are_refused() {
        assert!(Layout::new(&Grid::for_shelf([0.8, 0.4, 0.4], 0.01)).is_err());
    }
}
