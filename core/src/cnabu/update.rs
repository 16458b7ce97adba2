//! The networks as a belief update.
//!
//! Observations go through sigma_o, pushes through sigma_m. A [`Cnabu`] of sigma_o alone is for training and for scoring
//! observations; asked for a push, it predicts by the classical rule.

use super::layout::{LABELS, Layout, Mirror, OCCUPANCY, SEMANTICS};
use super::observe_net::{Evidence, ObserveNet};
use super::predict::predict;
use super::push_net::PushNet;
use super::weights::{Card, load_network};
use super::{OBSERVE_WEIGHTS, PUSH_WEIGHTS};
use crate::belief::{Belief, BeliefUpdate, Classical, NetworksUsed, PushPrediction, SweptPush, Weights};
use crate::camera::MapObservation;
use crate::files::sha256_of_file;
use crate::grid::Grid;
use crate::{Error, Result};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tch::nn::VarStore;
use tch::{Device, Kind, Tensor};

/// sigma_o and sigma_m with their weights; `cnabu` in episodes.
#[derive(Debug)]
pub struct Cnabu {
    // libtorch's tensors may be sent to another thread but not be used by two at once.
    networks: Mutex<Networks>,
    card: Card,
    /// The files that they were read from.
    weights: Weights,
}

#[derive(Debug)]
struct Networks {
    observe: ObserveNet,
    /// sigma_m, and the temperature of its probabilities of change.
    push: Option<(PushNet, f32)>,
    /// They hold the variables, and say on which device.
    stores: Vec<VarStore>,
}

impl Networks {
    fn device(&self) -> Device {
        self.stores.first().map_or(Device::Cpu, VarStore::device)
    }
}

impl Cnabu {
    /// Loads the weights of a models directory, onto the device that [`DEVICE_ENV`](super::DEVICE_ENV) names or, if it is
    /// not set, a CUDA device if libtorch has one.
    ///
    /// # Errors
    /// For weights that are missing, damaged, not finite, or of another grid, class list or version.
    pub fn load(directory: &Path) -> Result<Self> {
        Self::load_file(&directory.join(OBSERVE_WEIGHTS))?.with_push_file(&directory.join(PUSH_WEIGHTS))
    }

    /// Loads sigma_o from its file.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn load_file(path: &Path) -> Result<Self> {
        is_there(path, "observe")?;
        let (net, store, card) = load_network::<ObserveNet>(path, super::chosen_device()?)?;
        let weights = Weights { sigma_o: Some(sha256_of_file(path)?), ..Weights::default() };
        Ok(Self { weights, ..Self::of(net, store, card) })
    }

    /// The same with sigma_m from its file.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn with_push_file(self, path: &Path) -> Result<Self> {
        is_there(path, "push")?;
        let (net, store, card) = load_network::<PushNet>(path, self.device())?;
        let mut update = self.with_push(net, store, card.change_temperature.unwrap_or(1.0));
        update.weights.sigma_m = Some(sha256_of_file(path)?);
        Ok(update)
    }

    /// A belief update of a sigma_o at hand.
    pub fn of(net: ObserveNet, store: VarStore, card: Card) -> Self {
        let networks = Networks { observe: net, push: None, stores: vec![store] };
        Self { networks: Mutex::new(networks), card, weights: Weights::default() }
    }

    /// The same with a sigma_m at hand, whose log-odds of change are divided by `temperature`.
    pub fn with_push(mut self, net: PushNet, store: VarStore, temperature: f32) -> Self {
        self.weights = Weights { sigma_m: None, change_temperature: Some(temperature), ..self.weights };
        {
            let mut networks = self.networks();
            networks.push = Some((net, temperature));
            networks.stores.push(store);
        }
        self
    }

    /// The card of sigma_o's weights.
    pub fn card(&self) -> &Card {
        &self.card
    }

    /// The device that the networks are on.
    pub fn device(&self) -> Device {
        self.networks().device()
    }

    fn networks(&self) -> MutexGuard<'_, Networks> {
        self.networks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// sigma_o on planes: posterior evidence from prior evidence, levels observed and one-hot labels.
    pub(crate) fn observe_planes(
        &self,
        layout: &Layout,
        prior: &Evidence,
        observed: &Tensor,
        labels: &Tensor,
    ) -> Evidence {
        let networks = self.networks();
        let device = networks.device();
        let forward = if layout.is_padded() { ObserveNet::forward } else { ObserveNet::forward_both_ways };
        tch::no_grad(|| {
            let (occupancy, semantics) =
                forward(&networks.observe, prior, &observed.to_device(device), &labels.to_device(device));
            Evidence::of_heads(&occupancy, &semantics)
        })
    }

    /// A belief's evidence as planes on the networks' device.
    pub(crate) fn planes_of(&self, layout: &Layout, belief: &Belief) -> Evidence {
        let plane = layout.plane();
        let (mut occupancy, mut semantics) = (vec![0.0; 2 * OCCUPANCY * plane], vec![0.0; SEMANTICS * plane]);
        layout.put_belief(belief, &mut occupancy, &mut semantics);
        let device = self.device();
        let tensor =
            |planes: &[f32], channels| Tensor::from_slice(planes).reshape(layout.shape(channels)).to_device(device);
        Evidence { occupancy: tensor(&occupancy, 2 * OCCUPANCY), semantics: tensor(&semantics, SEMANTICS) }
    }
}

/// Refuses a file of weights that is missing, and names the command that makes it.
fn is_there(path: &Path, network: &str) -> Result<()> {
    let missing = || Error::input(path, "", format!("no weights are here (`nudge train {network}` makes them)"));
    path.is_file().then_some(()).ok_or_else(missing)
}

/// The belief of planes of evidence's logarithms.
pub(crate) fn belief_of(layout: &Layout, evidence: &Evidence) -> Belief {
    let values = |logs: &Tensor| {
        let mut out = vec![0.0_f32; logs.numel()];
        logs.exp().to_device(Device::Cpu).to_kind(Kind::Float).contiguous().copy_data(&mut out, logs.numel());
        out
    };
    layout.belief(&values(&evidence.occupancy), &values(&evidence.semantics))
}

/// What an observation looks like to sigma_o: levels and labels.
pub(crate) fn observation_planes(layout: &Layout, observation: &MapObservation, mirror: Mirror) -> (Tensor, Tensor) {
    let plane = layout.plane();
    let (mut observed, mut labels) = (vec![0.0; 2 * OCCUPANCY * plane], vec![0.0; LABELS * plane]);
    layout.put_observed(observation, mirror, &mut observed);
    layout.put_labels(&observation.labels, mirror, &mut labels);
    let tensor = |planes: &[f32], channels| Tensor::from_slice(planes).reshape(layout.shape(channels));
    (tensor(&observed, 2 * OCCUPANCY), tensor(&labels, LABELS))
}

impl BeliefUpdate for Cnabu {
    fn name(&self) -> &str {
        "cnabu"
    }

    fn check_grid(&self, grid: &Grid) -> Result<()> {
        Layout::new(grid).map(|_| ())
    }

    /// sigma_o learned to take in ten looks; by forty its map of what is seen has worn (RESULTS.md).
    fn wears(&self) -> bool {
        true
    }

    fn networks_used(&self) -> Option<NetworksUsed> {
        let device = if self.device().is_cuda() { "cuda" } else { "cpu" };
        Some(NetworksUsed {
            weights: self.weights.clone(),
            libtorch: env!("NUDGE_LIBTORCH").to_owned(),
            device: device.to_owned(),
        })
    }

    /// A grid of other voxels than the networks' ([`BeliefUpdate::check_grid`] refuses it) is updated classically.
    fn observe(&self, belief: &Belief, observation: &MapObservation) -> Belief {
        let Ok(layout) = Layout::new(&belief.grid) else { return Classical.observe(belief, observation) };
        let (observed, labels) = observation_planes(&layout, observation, Mirror::No);
        let evidence = self.observe_planes(&layout, &self.planes_of(&layout, belief), &observed, &labels);
        belief_of(&layout, &evidence)
    }

    fn predict_pushes(&self, belief: &Belief, pushes: &[SweptPush]) -> Vec<PushPrediction> {
        let Ok(layout) = Layout::new(&belief.grid) else { return Classical.predict_pushes(belief, pushes) };
        let prior = self.planes_of(&layout, belief);
        let networks = self.networks();
        match &networks.push {
            Some((net, temperature)) => {
                tch::no_grad(|| predict(net, *temperature, &layout, &prior, belief, pushes, networks.device()))
            }
            None => Classical.predict_pushes(belief, pushes),
        }
    }
}
