//! Training the networks.
//!
//! The weights that are validated and shipped are a running mean of the trained ones.
//!
//! Every random choice of batch `n` comes from the stream `(seed, n)`, and a checkpoint holds weights, running mean, Adam's
//! moments and counters: a run that is stopped and resumed is the run that was not stopped, bit for bit, on the same number
//! of threads and the same data.

mod adam;
mod after;
mod batch;
mod kept;
mod moved;
mod observe;
mod push;
mod state;

pub use after::AfterPushes;
pub use observe::{ObserveTrainer, ViewLoss};
pub use push::{Priors, PushLoss, PushTrainer};
pub use state::{checkpoint_path, settings_path};

use super::VIEWS;
use crate::cnabu::{Card, Layout, Network, load_network, seeded};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use state::State;
use std::path::Path;
use tch::nn::VarStore;
use tch::{Device, Tensor};

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
    /// Most views in a sequence; beyond a sample's own views they repeat, so that more looks do no harm.
    pub max_views: usize,
    /// Weight of the KL term once it has risen.
    pub kl_weight: f64,
    /// Updates over which it rises from 0.
    pub kl_ramp: u64,
    /// Weight of the semantic loss beside that of occupancy.
    pub semantic_weight: f64,
    /// Share of sigma_o's sequences that begin after a push, where there is data of pushes.
    pub push_share: f64,
    /// Share of sigma_o's scenes that are shifted and turned a little on their board, beside mirroring.
    #[serde(default)]
    pub move_share: f64,
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
            push_share: 0.0,
            move_share: 0.0,
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
            ("push share", (0.0..=1.0).contains(&self.push_share), "0 to 1"),
            ("move share", (0.0..=1.0).contains(&self.move_share), "0 to 1"),
            ("mean decay", (0.0..1.0).contains(&self.mean_decay), "0 to below 1"),
        ];
        match sane.iter().find(|(_, ok, _)| !ok) {
            Some((name, _, needed)) => Err(Error::Usage(format!("{name}: {needed} is needed"))),
            None => Ok(()),
        }
    }
}

/// A network in training.
#[derive(Debug)]
pub struct Trainer<N> {
    settings: TrainSettings,
    layout: Layout,
    net: N,
    store: VarStore,
    state: State,
}

impl<N: Network> Trainer<N> {
    /// A network with fresh weights, for samples over the grid of `layout`.
    ///
    /// # Errors
    /// [`Error::Usage`] for settings out of range.
    pub fn new(settings: TrainSettings, layout: Layout, device: Device) -> Result<Self> {
        settings.check()?;
        if layout.is_padded() {
            return Err(Error::Usage("training wants a floor plan of a multiple of 16 cells along x and y".to_owned()));
        }
        let store = VarStore::new(device);
        let net = seeded(settings.seed as i64, || N::new(&store.root(), settings.width));
        let state = State::new(&store);
        Ok(Self { settings, layout, net, store, state })
    }

    /// Continues the run named `out`.
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

    /// Begins with weights that are finished: those in the file `weights`, with its card beside it. The count of
    /// updates continues from the number on the card.
    ///
    /// # Errors
    /// For weights that are missing, damaged, of another network, or of another width than the settings'.
    pub fn begin_with(weights: &Path, settings: TrainSettings, layout: Layout, device: Device) -> Result<Self> {
        let mut trainer = Self::new(settings, layout, device)?;
        let (_, store, card) = load_network::<N>(weights, device)?;
        let width = trainer.settings.width;
        if card.width != width {
            return Err(Error::input(weights, "width", format!("is {}, not {width} as asked for", card.width)));
        }
        trainer.state.begin_with(&store, card.updates());
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

    /// The running mean of the weights by name.
    pub fn mean_weights(&self) -> Vec<(String, Tensor)> {
        self.state.mean_weights()
    }

    /// A card for the weights.
    pub fn card(&self) -> Card {
        Card::new(N::NAME, self.settings.width, self.parameters())
    }

    /// The network with the running mean of the weights, and its variables.
    fn mean_net(&self) -> (N, VarStore) {
        let store = VarStore::new(self.store.device());
        let net = seeded(0, || N::new(&store.root(), self.settings.width));
        self.state.copy_mean(&store);
        (net, store)
    }

    /// The weight of the KL term now.
    fn kl(&self) -> f64 {
        self.settings.kl_weight * (self.state.updates as f64 / self.settings.kl_ramp.max(1) as f64).min(1.0)
    }

    /// Moves the weights by the gradients of a loss whose `parts` are told; `rate` scales the step size.
    fn descend(&mut self, loss: &Tensor, parts: &[f64], rate: f64) -> Result<()> {
        if parts.iter().any(|part| !part.is_finite()) {
            let message = format!("training diverged: the loss of update {} is not finite", self.state.updates);
            return Err(Error::Check(message));
        }
        loss.backward();
        self.state.update(self.settings.learning_rate * rate, self.settings.mean_decay);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
