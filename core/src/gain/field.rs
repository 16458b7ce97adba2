//! A belief's occupancy prepared for walking rays.

use super::code::{MATTER, OPAQUE, Quantiser};
use super::layout::{Layout, VoxelBox};
use super::{RayDensity, arrivals, skip};
use crate::belief::{Belief, Prediction, beta_mean};
use crate::camera::{ViewArray, ViewId};
use crate::grid::{Grid, VoxelSet, Window};
use crate::world::TruthMap;
use rayon::prelude::*;
use std::sync::Arc;

/// A belief's occupancy prepared for walking rays: 8-bit probabilities in a padded grid, transparent voxels with the
/// room ahead of them.
#[derive(Clone)]
pub struct GainField {
    pub(super) layout: Layout,
    /// Code per voxel of the padded grid.
    pub(super) codes: Vec<u8>,
    /// Transmittance with which an earlier view arrived, per voxel of the padded grid.
    pub(super) seen: Option<Arc<Vec<f32>>>,
}

impl GainField {
    /// Quantises a belief's occupancy.
    ///
    /// # Panics
    /// If the grid has more than 2,000 voxels along an axis.
    pub fn new(belief: &Belief) -> Self {
        let layout = Layout::of(&belief.grid);
        let [width, depth, height] = layout.grid.dims;
        let mut codes = vec![OPAQUE; layout.len()];
        let quantiser = Quantiser::get();
        let [plane, line, _] = layout.stride;
        let planes = codes[layout.at([0, 0, 0])..].par_chunks_mut(plane).take(width);
        planes.zip(belief.occupancy.par_chunks(depth * height)).for_each(|(codes, occupancy)| {
            for (codes, occupancy) in codes.chunks_mut(line).zip(occupancy.chunks(height)) {
                for (code, beta) in codes.iter_mut().zip(occupancy) {
                    *code = quantiser.code(beta_mean(*beta));
                }
            }
        });
        skip::mark(&mut codes, &layout, Window::whole(&layout.grid), skip::LEVELS);
        Self { layout, codes, seen: None }
    }

    /// A true map, every voxel free or filled, without skip levels as [flat](Self::flat).
    ///
    /// # Panics
    /// If the grid has more than 2,000 voxels along an axis.
    pub(super) fn of_truth(grid: &Grid, truth: &TruthMap) -> Self {
        let layout = Layout::of(grid);
        let mut codes = vec![OPAQUE; layout.len()];
        for (cell, filled) in truth.occupancy.chunks_exact(grid.dims[2]).enumerate() {
            let column = layout.column(cell);
            for (code, filled) in codes[column..].iter_mut().zip(filled) {
                *code = if *filled == 0 { 0 } else { OPAQUE };
            }
        }
        Self { layout, codes, seen: None }
    }

    /// The grid of the belief.
    pub fn grid(&self) -> &Grid {
        &self.layout.grid
    }

    /// This field with a push's predicted window in place of what stands there. Voxels that were seen do not count
    /// after the push either: looking at them again would only restore what the push made uncertain.
    pub fn with_prediction(&self, prediction: &Prediction) -> Self {
        self.patched(prediction).0
    }

    /// This field where the given voxels still block rays but no longer count as a gain (a view saw them).
    pub fn with_seen(&self, seen: &VoxelSet) -> Self {
        let mut arrival = vec![0.0; self.codes.len()];
        for index in seen.iter() {
            arrival[self.layout.padded(index)] = 1.0;
        }
        self.with_arrivals(arrival)
    }

    /// This field after a look from `view`: what a second view adds to the first one.
    ///
    /// A voxel that the first view's rays reach with transmittance `T_1` counts for a ray that arrives with `T` only
    /// by `max(0, T - T_1)`. So what the first view sees for certain no longer counts, what it may see counts partly,
    /// and a second look from the same place gains nothing. The gain of a pair is then the sum over voxels of `H`
    /// times the larger of two transmittances (a facility-location function: monotone and submodular, for which the
    /// greedy choice is within 1 - 1/e of the best), a lower bound of what both views see. `T_1` is taken over rays
    /// without gaps, because the camera sees every voxel in its view, not only those that sampled rays hit.
    pub fn with_view(&self, array: &ViewArray, view: ViewId) -> Self {
        self.with_arrivals(arrivals(self, array, view, RayDensity::gapless(self.grid(), array)))
    }

    fn with_arrivals(&self, mut arrival: Vec<f32>) -> Self {
        if let Some(earlier) = &self.seen {
            for (arrival, earlier) in arrival.iter_mut().zip(earlier.iter()) {
                *arrival = arrival.max(*earlier);
            }
        }
        Self { layout: self.layout, codes: self.codes.clone(), seen: Some(Arc::new(arrival)) }
    }

    /// What of a ray's transmittance at a voxel tells something that no earlier view saw.
    #[inline(always)]
    pub(super) fn unseen_share(&self, index: usize, transmittance: f32) -> f32 {
        match &self.seen {
            None => transmittance,
            Some(seen) => (transmittance - seen[index]).max(0.0),
        }
    }

    /// Entropy of a voxel of the padded grid, as far as no earlier view saw it, nats.
    pub(super) fn unseen_information(&self, index: usize) -> f32 {
        self.unseen_share(index, 1.0) * MATTER[usize::from(self.codes[index])].information
    }

    /// This field without skip levels: rays walk it voxel by voxel, and a window of it can be written over as it is.
    pub(super) fn flat(&self) -> Self {
        let codes = self.codes.iter().map(|code| if skip::is_transparent(*code) { 0 } else { *code }).collect();
        Self { layout: self.layout, codes, seen: None }
    }

    /// Writes a prediction over a [flat](Self::flat) field.
    pub(super) fn overwrite(&mut self, prediction: &Prediction) {
        let quantiser = Quantiser::get();
        let height = self.layout.grid.dims[2];
        let predicted = prediction.occupancy.chunks_exact(height);
        for (cell, betas) in prediction.window.cells(&self.layout.grid).zip(predicted) {
            let column = self.layout.column(cell);
            for (code, beta) in self.codes[column..column + height].iter_mut().zip(betas) {
                *code = quantiser.code(beta_mean(*beta));
            }
        }
    }

    /// Makes a window again what it is in `original`.
    pub(super) fn restore(&mut self, original: &Self, window: Window) {
        let height = self.layout.grid.dims[2];
        for cell in window.cells(&self.layout.grid) {
            let column = self.layout.column(cell);
            self.codes[column..column + height].copy_from_slice(&original.codes[column..column + height]);
        }
    }

    /// This field with a prediction, and the box of the voxels that changed in it.
    pub(super) fn patched(&self, prediction: &Prediction) -> (Self, Option<VoxelBox>) {
        let mut field = self.clone();
        let window = prediction.window;
        let height = self.layout.grid.dims[2];
        let quantiser = Quantiser::get();
        let mut predicted = prediction.occupancy.chunks_exact(height);
        let (mut changed, mut blocked) = (None, None);
        for x in window.x[0]..window.x[1] {
            for (y, betas) in (window.y[0]..window.y[1]).zip(predicted.by_ref()) {
                let column = self.layout.at([x, y, 0]);
                for (z, (code, beta)) in field.codes[column..column + height].iter_mut().zip(betas).enumerate() {
                    let new = quantiser.code(beta_mean(*beta));
                    let (was_clear, is_clear) = (skip::is_transparent(*code), new == 0);
                    if was_clear && is_clear || *code == new {
                        continue;
                    }
                    *code = new;
                    VoxelBox::add(&mut changed, [x, y, z]);
                    if was_clear {
                        VoxelBox::add(&mut blocked, [x, y, z]);
                    }
                }
            }
        }
        if let Some(changed) = changed {
            if let Some(blocked) = blocked {
                skip::limit(&mut field.codes, &self.layout, blocked);
            }
            let touched = Window { x: [changed.min[0], changed.max[0] + 1], y: [changed.min[1], changed.max[1] + 1] };
            skip::mark(&mut field.codes, &self.layout, touched, skip::LOCAL_LEVELS);
        }
        (field, changed)
    }
}
