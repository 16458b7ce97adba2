//! Training sigma_o: recursive over random sequences of views, an update of the weights after every view.
//!
//! A batch is a few scenes; for one to `max_views` views the network turns its own last evidence, cut off from its history, and
//! the next observation into new evidence, whose loss against the truth moves the weights at once (Adam). Occupancy's loss
//! is taken on a random quarter of the pixels and the semantic KL on a sixteenth: transcendental functions on every voxel
//! would cost more than the network. The weights that are shown and shipped are a running mean of the trained ones.
//!
//! Every random choice of batch `n` comes from the stream `(seed, n)`, and a checkpoint holds weights, running mean, Adam's
//! moments and counters: a run that is stopped and resumed is the run that was not stopped, bit for bit, on the same number
//! of threads and the same data.

mod adam;
mod batch;
mod push;
mod state;

pub use push::{PushLoss, PushTrainer};
pub use state::{checkpoint_path, settings_path};

use super::{Dataset, MapSample, VIEWS};
use crate::cnabu::{
    Card, Cnabu, Evidence, Layout, LossForm, ObserveConfig, ObserveNet, kl_to_uniform, occupancy_loss, semantics_loss,
};
use crate::rng::{ChaCha8Rng, stream};
use crate::scene::CLASS_COUNT;
use crate::{Error, Result};
use batch::Batch;
use rand::Rng;
use rand::seq::SliceRandom;
use serde::{Deserialize, Serialize};
use state::State;
use std::path::Path;
use tch::nn::VarStore;
use tch::{Device, Kind, Tensor};

/// Most views that a sequence may have: as many as the longest usual episode.
const MAX_VIEWS: usize = 40;

/// What a training run is run with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainSettings {
    /// Seed of the first weights and of every choice.
    pub seed: u64,
    /// Channels of the U-Net's first level.
    pub width: i64,
    /// Scenes in a batch.
    pub batch: usize,
    /// Adam's step size.
    pub learning_rate: f64,
    /// Most views in a sequence; beyond a sample's own they come again, so that going on looking does no harm.
    pub max_views: usize,
    /// Weight of the KL term once it has risen.
    pub kl_weight: f64,
    /// Updates over which it rises from 0.
    pub kl_ramp: u64,
    /// Weight of the semantic loss beside that of occupancy.
    pub semantic_weight: f64,
    /// How slowly the running mean of the weights follows: its share of the old mean.
    pub mean_decay: f64,
}

impl Default for TrainSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            width: 32,
            batch: 4,
            learning_rate: 1e-3,
            max_views: 2 * VIEWS,
            kl_weight: 0.02,
            kl_ramp: 1000,
            semantic_weight: 1.0,
            mean_decay: 0.998,
        }
    }
}

impl TrainSettings {
    fn check(&self) -> Result<()> {
        let sane = [
            ("width", self.width % 8 == 0 && (8..=512).contains(&self.width), "a multiple of 8 up to 512"),
            ("batch", (1..=256).contains(&self.batch), "1 to 256"),
            ("learning rate", self.learning_rate > 0.0 && self.learning_rate < 1.0, "above 0 and below 1"),
            ("views", (1..=MAX_VIEWS).contains(&self.max_views), "1 to 40"),
            ("kl weight", (0.0..=10.0).contains(&self.kl_weight), "0 to 10"),
            ("semantic weight", (0.0..=100.0).contains(&self.semantic_weight), "0 to 100"),
            ("mean decay", (0.0..1.0).contains(&self.mean_decay), "0 to below 1"),
        ];
        match sane.iter().find(|(_, ok, _)| !ok) {
            Some((name, _, needed)) => Err(Error::Usage(format!("{name}: {needed} is needed"))),
            None => Ok(()),
        }
    }
}

/// The losses of one view of a batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewLoss {
    /// Number of views so far.
    pub views: usize,
    /// Loss of occupancy, nats per level.
    pub occupancy: f64,
    /// Loss of semantics, nats per floor cell.
    pub semantics: f64,
}

/// A network in training.
#[derive(Debug)]
pub struct Trainer {
    settings: TrainSettings,
    layout: Layout,
    net: ObserveNet,
    store: VarStore,
    state: State,
}

impl Trainer {
    /// A network with fresh weights, for samples over the grid of `layout`.
    ///
    /// # Errors
    /// [`Error::Usage`] for settings out of range.
    pub fn new(settings: TrainSettings, layout: Layout, device: Device) -> Result<Self> {
        settings.check()?;
        if layout.is_padded() {
            return Err(Error::Usage("training wants a floor plan of a multiple of 16 cells along x and y".to_owned()));
        }
        tch::manual_seed(settings.seed as i64);
        let store = VarStore::new(device);
        let net = ObserveNet::new(&store.root(), ObserveConfig { width: settings.width });
        let state = State::new(&store);
        Ok(Self { settings, layout, net, store, state })
    }

    /// Goes on with the run named `out`.
    ///
    /// # Errors
    /// For a run with other settings (names the first that differs), and a checkpoint that is missing or damaged.
    pub fn resume(out: &Path, settings: TrainSettings, layout: Layout, device: Device) -> Result<Self> {
        state::same_settings(out, &settings)?;
        Self::load(out, settings, layout, device)
    }

    /// Begins with the checkpoint of the run named `out`, whatever its settings were.
    ///
    /// # Errors
    /// For a checkpoint that is missing, damaged, or of another network.
    pub fn load(out: &Path, settings: TrainSettings, layout: Layout, device: Device) -> Result<Self> {
        let mut trainer = Self::new(settings, layout, device)?;
        trainer.state.load(out)?;
        Ok(trainer)
    }

    /// The settings of the run named `out`.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn logged_settings(out: &Path) -> Result<TrainSettings> {
        state::logged_settings(out)
    }

    /// Writes a checkpoint of the run named `out`, whole or not at all: the one before survives a full disk.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self, out: &Path) -> Result<()> {
        self.state.save(out, &self.settings)
    }

    /// The settings.
    pub fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    /// Updates of the weights so far.
    pub fn updates(&self) -> u64 {
        self.state.updates
    }

    /// Batches so far.
    pub fn batches(&self) -> u64 {
        self.state.batches
    }

    /// Number of parameters.
    pub fn parameters(&self) -> i64 {
        self.state.parameters()
    }

    /// Trains on the next batch; `rate` scales the step size (a cooldown takes it to 0). Gives the losses per view.
    ///
    /// # Errors
    /// When a sample cannot be read, and [`Error::Check`] when the loss is no longer finite.
    pub fn train(&mut self, data: &Dataset<MapSample>, rate: f64) -> Result<Vec<ViewLoss>> {
        let mut rng = stream(self.settings.seed, "training batch", self.state.batches);
        let views = sequence(self.settings.max_views, &mut rng);
        let batch = Batch::draw(data, &self.layout, self.settings.batch, &mut rng)?;
        let device = self.store.device();
        let truth = batch.truth().to_device(device);
        let classes = batch.classes().to_device(device);
        let [x, y] = self.layout.pixels().map(|n| n as i64);
        let mut evidence = Evidence::uniform(self.settings.batch as i64, [x, y], device);
        let mut losses = Vec::with_capacity(views.len());
        for (at, view) in views.into_iter().enumerate() {
            let (observed, labels) = batch.view(view);
            let (observed, labels) = (observed.to_device(device), labels.to_device(device));
            let (z_occupancy, z_semantics) = self.net.forward(&evidence, &observed, &labels);
            let kl =
                self.settings.kl_weight * (self.state.updates as f64 / self.settings.kl_ramp.max(1) as f64).min(1.0);
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
            if !(occupancy.is_finite() && semantics.is_finite()) {
                return Err(Error::Check(format!(
                    "training diverged: the loss of update {} is not finite",
                    self.state.updates
                )));
            }
            loss.backward();
            self.state.update(self.settings.learning_rate * rate, self.settings.mean_decay);
            evidence = Evidence::of_heads(&z_occupancy, &z_semantics);
            losses.push(ViewLoss { views: at + 1, occupancy, semantics });
        }
        self.state.batches += 1;
        Ok(losses)
    }

    /// The running mean of the weights as a belief update.
    pub fn update(&self) -> Cnabu {
        let store = VarStore::new(self.store.device());
        let net = ObserveNet::new(&store.root(), ObserveConfig { width: self.settings.width });
        self.state.copy_mean(&store);
        Cnabu::of(net, store, Card::new("sigma_o", self.settings.width, self.parameters()))
    }

    /// The running mean of the weights by name.
    pub fn mean_weights(&self) -> Vec<(String, Tensor)> {
        self.state.mean_weights()
    }
}

/// One to `longest` views of a sample: all of them in a random order, and then some again, as an episode goes on looking
/// when it has seen what there is to see.
fn sequence(longest: usize, rng: &mut ChaCha8Rng) -> Vec<usize> {
    let length = rng.random_range(1..=longest);
    let mut views: Vec<usize> = (0..VIEWS).collect();
    views.shuffle(rng);
    views.extend((VIEWS..length).map(|_| rng.random_range(0..VIEWS)));
    views.truncate(length);
    views
}

#[cfg(test)]
mod tests;
