//! Samples as tensors in the network's layout.

use super::moved::Moved;
use crate::Result;
use crate::cnabu::{Layout, Mirror, SUBS};
use crate::learn::{Dataset, MapSample};
use crate::rng::ChaCha8Rng;
use crate::scene::CLASS_COUNT;
use rand::Rng;
use rayon::prelude::*;
use tch::Tensor;

/// A few samples, some of them mirrored, some moved.
pub(super) struct Batch<'a> {
    layout: &'a Layout,
    samples: Vec<(MapSample, Mirror)>,
}

impl<'a> Batch<'a> {
    /// Draws samples, whether they are mirrored, and for a share of them a small move.
    pub(super) fn draw(
        data: &Dataset<MapSample>,
        layout: &'a Layout,
        count: usize,
        move_share: f64,
        rng: &mut ChaCha8Rng,
    ) -> Result<Self> {
        let mut draw = || {
            let (at, mirror) = (rng.random_range(0..data.len()), Mirror::either(rng));
            let moved = (rng.random::<f64>() < move_share).then(|| Moved::random(layout.grid(), rng));
            (at, mirror, moved)
        };
        let drawn: Vec<(usize, Mirror, Option<Moved>)> = (0..count).map(|_| draw()).collect();
        let samples = drawn.into_par_iter().map(|(at, mirror, moved)| {
            let sample = data.get(at)?;
            Ok((if let Some(moved) = moved { moved.sample(&sample) } else { sample }, mirror))
        });
        Ok(Self::of(layout, samples.collect::<Result<_>>()?))
    }

    /// These samples.
    pub(super) fn of(layout: &'a Layout, samples: Vec<(MapSample, Mirror)>) -> Self {
        Self { layout, samples }
    }

    /// `[B, channels, X, Y]`, filled sample by sample.
    fn tensor<T: tch::kind::Element + Default + Clone + Send>(
        &self,
        channels: usize,
        fill: impl Fn(&MapSample, Mirror, &mut [T]) + Sync,
    ) -> Tensor {
        let size = channels * self.layout.plane();
        let mut planes = vec![T::default(); size * self.samples.len()];
        let samples = self.samples.par_iter();
        planes.par_chunks_mut(size).zip(samples).for_each(|(out, (sample, mirror))| fill(sample, *mirror, out));
        let [x, y] = self.layout.pixels();
        Tensor::from_slice(&planes).reshape([self.samples.len() as i64, channels as i64, x as i64, y as i64])
    }

    /// Share of occupied voxels per level.
    pub(super) fn truth(&self) -> Tensor {
        let levels = crate::cnabu::LEVELS * SUBS;
        self.tensor(levels, |sample, mirror, out: &mut [f32]| {
            self.layout.put_set(&sample.truth, mirror, self.layout.whole(), out);
        })
    }

    /// True class numbers, `[B, 1, 4, X, Y]`.
    pub(super) fn classes(&self) -> Tensor {
        let classes = self.tensor(SUBS, |sample, mirror, out: &mut [i64]| {
            self.layout.put_classes(&sample.labels, mirror, self.layout.whole(), out);
        });
        classes.unsqueeze(1)
    }

    /// What view number `view` of every sample saw: levels and labels.
    pub(super) fn view(&self, view: usize) -> (Tensor, Tensor) {
        let observed = self.tensor(2 * crate::cnabu::LEVELS * SUBS, |sample, mirror, out: &mut [f32]| {
            self.layout.put_observed(&sample.views[view].observation, mirror, out);
        });
        let labels = self.tensor((CLASS_COUNT + 1) * SUBS, |sample, mirror, out: &mut [f32]| {
            self.layout.put_labels(&sample.views[view].observation.labels, mirror, out);
        });
        (observed, labels)
    }
}
