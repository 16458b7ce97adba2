//! Training sigma_o: recursive over random sequences of views, an update of the weights after every view.
//!
//! A batch is a few scenes; for one to `max_views` views the network turns its own last evidence, cut off from its history, and
//! the next observation into new evidence, whose loss against the truth moves the weights at once (Adam). Occupancy's loss
//! is taken on a random quarter of the pixels and the semantic KL on a sixteenth: transcendental functions on every voxel
//! would cost more than the network. Some sequences begin not with the uniform belief but after a push ([`AfterPushes`]).

use super::Trainer;
use super::after::AfterPushes;
use super::batch::Batch;
use crate::Result;
use crate::cnabu::{Cnabu, Evidence, LossForm, ObserveNet, kl_to_uniform, occupancy_loss, semantics_loss};
use crate::learn::{Dataset, MapSample, VIEWS, VIEWS_AFTER};
use crate::rng::{ChaCha8Rng, stream};
use crate::scene::CLASS_COUNT;
use rand::Rng;
use rand::seq::SliceRandom;
use tch::{Kind, Tensor};

/// A sigma_o in training.
pub type ObserveTrainer = Trainer<ObserveNet>;

/// The losses of one view of a batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewLoss {
    /// Whether the sequence began after a push.
    pub after_push: bool,
    /// Number of views so far.
    pub views: usize,
    /// Loss of occupancy, nats per level.
    pub occupancy: f64,
    /// Loss of semantics, nats per floor cell.
    pub semantics: f64,
}

impl ObserveTrainer {
    /// Trains on the next batch, one of `data` or, as often as the settings say, of pushes; `rate` scales the step size (a
    /// cooldown takes it to 0). Gives the losses per view.
    ///
    /// # Errors
    /// When a sample cannot be read, and [`crate::Error::Check`] when the loss is no longer finite.
    pub fn train(
        &mut self,
        data: &Dataset<MapSample>,
        after: Option<&mut AfterPushes>,
        rate: f64,
    ) -> Result<Vec<ViewLoss>> {
        let mut rng = stream(self.settings.seed, "training batch", self.state.batches);
        let (count, longest, device) = (self.settings.batch, self.settings.max_views, self.store.device());
        let layout = self.layout;
        let [x, y] = layout.pixels().map(|n| n as i64);
        let after = after.filter(|_| rng.random::<f64>() < self.settings.push_share);
        let after_push = after.is_some();
        let (views, batch, mut evidence) = match after {
            Some(after) => {
                let (batch, prior) = after.draw(&layout, count, &mut rng)?;
                (sequence(VIEWS_AFTER, longest.min(2 * VIEWS_AFTER), &mut rng), batch, prior.to_device(device))
            }
            None => {
                let batch = Batch::draw(data, &layout, count, self.settings.move_share, &mut rng)?;
                (sequence(VIEWS, longest, &mut rng), batch, Evidence::uniform(count as i64, [x, y], device))
            }
        };
        let truth = batch.truth().to_device(device);
        let classes = batch.classes().to_device(device);
        let mut losses = Vec::with_capacity(views.len());
        for (at, view) in views.into_iter().enumerate() {
            let (observed, labels) = batch.view(view);
            let (observed, labels) = (observed.to_device(device), labels.to_device(device));
            let (z_occupancy, z_semantics) = self.net.forward(&evidence, &observed, &labels);
            let kl = self.kl();
            let strided = |t: &Tensor, stride: i64, at: [i64; 2]| {
                let axis = t.dim() as i64 - 2;
                t.slice(axis, at[0], None, stride).slice(axis + 1, at[1], None, stride)
            };
            let quarter = [rng.random_range(0..2), rng.random_range(0..2)];
            let sixteenth = [rng.random_range(0..4), rng.random_range(0..4)];
            let levels = z_occupancy.size()[1] / 2;
            let part = |first: i64| strided(&z_occupancy.narrow(1, first, levels), 2, quarter);
            let occupancy =
                occupancy_loss(&part(0), &part(levels), &strided(&truth, 2, quarter), LossForm::Marginal, kl, None);
            let z_classes = z_semantics.view([self.settings.batch as i64, CLASS_COUNT as i64, -1, x, y]);
            let semantics = semantics_loss(&z_classes, &classes, LossForm::Marginal, 0.0, None);
            let mut loss = &occupancy + &semantics * self.settings.semantic_weight;
            if kl > 0.0 {
                let few = strided(&z_classes, 4, sixteenth).exp() + 1.0;
                let wrong = few.scatter_value(1, &strided(&classes, 4, sixteenth), 1.0);
                loss += kl_to_uniform(&wrong, 1).mean(Kind::Float) * (kl * self.settings.semantic_weight);
            }
            let (occupancy, semantics) = (occupancy.double_value(&[]), semantics.double_value(&[]));
            self.descend(&loss, &[occupancy, semantics], rate)?;
            evidence = Evidence::of_heads(&z_occupancy, &z_semantics);
            losses.push(ViewLoss { after_push, views: at + 1, occupancy, semantics });
        }
        self.state.batches += 1;
        Ok(losses)
    }

    /// The running mean of the weights as a belief update.
    pub fn update(&self) -> Cnabu {
        let (net, store) = self.mean_net();
        Cnabu::of(net, store, self.card())
    }
}

/// One to `longest` views of a sample that has `count`: all of them in a random order, and then some again, as an
/// episode looks on when it has seen everything.
fn sequence(count: usize, longest: usize, rng: &mut ChaCha8Rng) -> Vec<usize> {
    let length = rng.random_range(1..=longest);
    let mut views: Vec<usize> = (0..count).collect();
    views.shuffle(rng);
    views.extend((count..length).map(|_| rng.random_range(0..count)));
    views.truncate(length);
    views
}

#[cfg(test)]
mod tests {
    use super::VIEWS;

    #[test]
    fn sequences_show_every_view_before_any_comes_again() {
        let mut rng = crate::rng::stream(1, "sequences", 0);
        let mut longest = 0;
        let mut firsts = std::collections::BTreeSet::new();
        for _ in 0..400 {
            let views = super::sequence(VIEWS, 20, &mut rng);
            longest = longest.max(views.len());
            assert!((1..=20).contains(&views.len()));
            let mut first: Vec<usize> = views.iter().copied().take(VIEWS).collect();
            firsts.insert(first[0]);
            first.sort_unstable();
            first.dedup();
            assert_eq!(first.len(), views.len().min(VIEWS), "{views:?}");
        }
        assert_eq!((longest, firsts.len()), (20, VIEWS), "all lengths, in all orders");
    }
}
