//! Training sequences of sigma_o that begin with the belief that sigma_m predicts after a push, and not with the
//! uniform belief.
//!
//! In an episode, sigma_o is applied to looks at what was pushed, and its prior is then a prediction that may be wrong.
//! Trained on its own beliefs alone, it would never learn how far to trust a prediction.

use super::batch::Batch;
use super::kept::Kept;
use crate::Result;
use crate::belief::BeliefUpdate;
use crate::cnabu::{Cnabu, Evidence, Layout, Mirror};
use crate::learn::evaluate::after_views;
use crate::learn::{Dataset, MapSample, PushSample};
use crate::rng::ChaCha8Rng;
use rand::Rng;
use tch::{Kind, Tensor};

/// Pushes that sequences begin with, and the frozen networks that predict them.
#[derive(Debug)]
pub struct AfterPushes {
    data: Dataset<PushSample>,
    update: Cnabu,
    kept: Kept<Evidence>,
}

impl AfterPushes {
    /// Those of a data directory, as `update` predicts them.
    pub fn new(data: Dataset<PushSample>, update: Cnabu) -> Self {
        Self { data, update, kept: Kept::default() }
    }

    /// Draws samples after their first pushes, whether they are mirrored, and what is believed of them before the next look.
    pub(super) fn draw<'a>(
        &mut self,
        layout: &'a Layout,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(Batch<'a>, Evidence)> {
        let mut samples = Vec::with_capacity(count);
        let mut priors = Vec::with_capacity(count);
        while samples.len() < count {
            let (at, mirror) = (rng.random_range(0..self.data.len()), Mirror::either(rng));
            let sample = self.data.get(at)?;
            if sample.pushes.is_empty() {
                continue;
            }
            let update = &self.update;
            let prior = self.kept.of(at, || believed(layout, &sample, update).to_kind(Kind::Half), Evidence::bytes);
            let prior = prior.to_kind(Kind::Float);
            priors.push(if mirror == Mirror::X { prior.mirrored() } else { prior });
            let PushSample { seed, mut pushes, after, .. } = sample;
            let pushed = pushes.swap_remove(0);
            samples.push((MapSample { seed, truth: pushed.truth, labels: pushed.labels, views: after }, mirror));
        }
        let stacked =
            |part: &dyn Fn(&Evidence) -> &Tensor| Tensor::cat(&priors.iter().map(part).collect::<Vec<_>>(), 0);
        let prior = Evidence { occupancy: stacked(&|e| &e.occupancy), semantics: stacked(&|e| &e.semantics) };
        Ok((Batch::of(layout, samples), prior))
    }
}

/// What is believed of a sample after its views and the prediction of its first push.
fn believed(layout: &Layout, sample: &PushSample, update: &Cnabu) -> Evidence {
    let (mut belief, _) = after_views(update, layout.grid(), &sample.views);
    let mut first = sample.interventions(&belief);
    first.truncate(1);
    for prediction in update.predict(&belief, &first) {
        belief.apply(&prediction);
    }
    update.planes_of(layout, &belief)
}
