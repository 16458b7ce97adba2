//! Which voxels of a belief are drawn, and in which colours.

use crate::colors::{self, Colormap, Rgb};
use crate::picture;
use crate::record::voxels::surface;
use crate::workbench::model::{ColourBy, Display};
use nudge_core::belief::{Belief, bernoulli_entropy};
use nudge_core::grid::Cell;
use nudge_core::scene::{BACKGROUND, Catalog};
use nudge_core::world::TruthMap;

/// Probability changes smaller than this are not drawn.
const CHANGED: f32 = 0.05;

/// What of the display decides about the belief's voxels.
pub(super) fn voxel_key(display: &Display) -> (ColourBy, [f32; 2], [[f32; 2]; 3]) {
    (display.colour_by, display.band, display.slice_m)
}

/// Voxels that shall be seen.
pub(super) struct Shown<'a> {
    /// Those that show from outside.
    pub outside: Vec<usize>,
    /// Whether a voxel is one of them or within.
    pub inside: Vec<bool>,
    /// The colour of one.
    pub rgb: Box<dyn Fn(usize) -> Rgb + 'a>,
}

impl Shown<'_> {
    /// Nothing.
    pub fn nothing() -> Self {
        Self { outside: Vec::new(), inside: Vec::new(), rgb: Box::new(|_| [0; 3]) }
    }
}

/// A belief with what colours need.
pub(super) struct Voxels<'a> {
    pub belief: &'a Belief,
    /// What is, if that is known; without it nothing is an error.
    pub truth: Option<&'a TruthMap>,
    pub catalog: &'a Catalog,
}

impl<'a> Voxels<'a> {
    /// The voxels to draw and their colours. Without a state before, nothing has changed.
    pub fn drawn(&self, display: &Display, before: Option<&'a Belief>) -> Shown<'a> {
        let (belief, truth, catalog) = (self.belief, self.truth, self.catalog);
        let grid = &belief.grid;
        let height = grid.dims[2];
        let [least, most] = display.band;
        // Per axis, which numbers of voxels have their centre in the slice; a slice thinner than a voxel has one.
        let slices: [[usize; 2]; 3] = std::array::from_fn(|axis| {
            let at = |m: f32| ((m - grid.origin[axis]) / grid.voxel_m).clamp(0.0, grid.dims[axis] as f32);
            let [low, high] = display.slice_m[axis].map(at);
            let first = ((low - 0.5).ceil().max(0.0) as usize).min(grid.dims[axis] - 1);
            [first, ((high - 0.5).floor().max(first as f32) as usize).min(grid.dims[axis] - 1)]
        });
        let in_band = |p: f32| p >= least && p <= most && (p > 0.5 || least < 0.5);
        let is_there = move |index: usize| truth.map(|truth| truth.occupancy[index] == 1);
        let changed = |index: usize| before.map_or(0.0, |before| belief.probability(index) - before.probability(index));
        let shows = |index: usize| match display.colour_by {
            ColourBy::Change => changed(index).abs() >= CHANGED,
            ColourBy::Error => belief.probability(index) > 0.5 || is_there(index) == Some(true),
            _ => in_band(belief.probability(index)),
        };
        let mut voxels = vec![false; grid.voxel_count()];
        let [along_x, along_y, along_z] = slices.map(|[first, last]| first..=last);
        for x in along_x {
            for y in along_y.clone() {
                let column = grid.column(grid.cell_index(Cell { x: x as u16, y: y as u16 })).start;
                let levels = column + along_z.start()..column + along_z.end() + 1;
                for (voxel, index) in voxels[levels.clone()].iter_mut().zip(levels) {
                    *voxel = shows(index);
                }
            }
        }
        let shown = surface(grid, &voxels);
        let rgb: Box<dyn Fn(usize) -> Rgb + 'a> = match display.colour_by {
            ColourBy::Probability => Box::new(move |index| Colormap::Viridis.rgb(belief.probability(index))),
            ColourBy::Entropy => Box::new(move |index| {
                Colormap::Magma.of(bernoulli_entropy(belief.probability(index)), [0.0, std::f32::consts::LN_2])
            }),
            ColourBy::Class => Box::new(move |index| match picture::believed_class(belief, index / height) {
                None | Some(BACKGROUND) => colors::UNKNOWN_RGB,
                Some(class) => colors::of_class(catalog, class),
            }),
            ColourBy::Error => Box::new(move |index| match (belief.probability(index) > 0.5, is_there(index)) {
                (true, Some(false)) => colors::HALLUCINATED_RGB,
                (false, Some(true)) => colors::MISSED_RGB,
                _ => [226, 228, 232],
            }),
            ColourBy::Change => Box::new(move |index| {
                let change = before.map_or(0.0, |before| belief.probability(index) - before.probability(index));
                Colormap::Diverging.of(change, [-1.0, 1.0])
            }),
        };
        Shown { outside: shown, inside: voxels, rgb }
    }
}
