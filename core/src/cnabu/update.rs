//! The networks as a belief update.
//!
//! Observations go through sigma_o, pushes through sigma_m. A [`Cnabu`] of sigma_o alone is for training and for scoring
//! observations; asked for a push, it predicts by the classical rule.
//!
//! libtorch computes on the thread that asks (`cnabu::compute_beside_rayon`): what can be done side by side is split over
//! rayon's threads, each with networks of its own. So nothing waits at OpenMP's barriers, where threads spin and a decision
//! beside other work takes ten times as long; and no sum depends on the number of threads.

use super::layout::{LABELS, Layout, Mirror, OCCUPANCY, SEMANTICS};
use super::observe_net::{Evidence, ObserveNet, mirrored};
use super::predict::predict;
use super::push_net::PushNet;
use super::weights::{Card, load_network};
use super::{OBSERVE_WEIGHTS, PUSH_WEIGHTS};
use crate::belief::{Belief, BeliefUpdate, Classical, PushPrediction, SweptPush};
use crate::camera::MapObservation;
use crate::grid::Grid;
use crate::{Error, Result};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tch::nn::VarStore;
use tch::{Device, Kind, Tensor};

/// sigma_o and sigma_m with their weights; `cnabu` in episodes.
#[derive(Debug)]
pub struct Cnabu {
    pool: Pool,
    card: Card,
}

/// The same networks several times, one for each thread that may ask at once: libtorch's tensors may be sent to another
/// thread but not be used by two.
#[derive(Debug)]
pub(super) struct Pool(Vec<Mutex<Networks>>);

#[derive(Debug)]
pub(super) struct Networks {
    observe: ObserveNet,
    /// sigma_m, and the temperature of its probabilities of change.
    pub(super) push: Option<(PushNet, f32)>,
    /// They hold the variables, and say on which device.
    stores: Vec<VarStore>,
}

impl Pool {
    /// Networks that no other thread uses now, or the next to be free. Whoever holds them asks nothing of rayon, whose
    /// thread might take up work that wants them too.
    pub(super) fn take(&self) -> MutexGuard<'_, Networks> {
        let free = self.0.iter().find_map(|networks| networks.try_lock().ok());
        let mine = rayon::current_thread_index().unwrap_or(0) % self.0.len();
        free.unwrap_or_else(|| self.0[mine].lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Networks {
    pub(super) fn device(&self) -> Device {
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
        let [observe, push] = [OBSERVE_WEIGHTS, PUSH_WEIGHTS].map(|file| directory.join(file));
        Self::for_all_threads(|| Self::load_file(&observe)?.with_push_file(&push))
    }

    /// Loads sigma_o alone, to score observations.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn load_observation(directory: &Path) -> Result<Self> {
        Self::for_all_threads(|| Self::load_file(&directory.join(OBSERVE_WEIGHTS)))
    }

    /// Networks for each of rayon's threads.
    fn for_all_threads(once: impl Fn() -> Result<Self>) -> Result<Self> {
        let mut update = once()?;
        // A graphics card computes for all threads in turn.
        let copies = if update.device() == Device::Cpu { rayon::current_num_threads() } else { 1 };
        for _ in 1..copies {
            update.pool.0.append(&mut once()?.pool.0);
        }
        Ok(update)
    }

    /// Loads sigma_o from its file.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn load_file(path: &Path) -> Result<Self> {
        is_there(path, "observe")?;
        let (net, store, card) = load_network::<ObserveNet>(path, super::chosen_device()?)?;
        Ok(Self::of(net, store, card))
    }

    /// The same with sigma_m from its file.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn with_push_file(self, path: &Path) -> Result<Self> {
        is_there(path, "push")?;
        let (net, store, card) = load_network::<PushNet>(path, self.device())?;
        Ok(self.with_push(net, store, card.change_temperature.unwrap_or(1.0)))
    }

    /// A belief update of a sigma_o at hand.
    pub fn of(net: ObserveNet, store: VarStore, card: Card) -> Self {
        Self { pool: Pool(vec![Mutex::new(Networks { observe: net, push: None, stores: vec![store] })]), card }
    }

    /// The same with a sigma_m at hand, whose log-odds of change are divided by `temperature`.
    pub fn with_push(self, net: PushNet, store: VarStore, temperature: f32) -> Self {
        {
            let mut networks = self.pool.take();
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
        self.pool.take().device()
    }

    /// sigma_o on planes: posterior evidence from prior evidence, levels observed and one-hot labels.
    pub(crate) fn observe_planes(
        &self,
        layout: &Layout,
        prior: &Evidence,
        observed: &Tensor,
        labels: &Tensor,
    ) -> Evidence {
        let device = self.device();
        let planes = [&prior.occupancy, &prior.semantics, observed, labels].map(|planes| planes.to_device(device));
        let forward = |planes: [Tensor; 4]| {
            let [occupancy, semantics, observed, labels] = planes;
            let prior = Evidence { occupancy, semantics };
            tch::no_grad(|| self.pool.take().observe.forward(&prior, &observed, &labels))
        };
        if layout.is_padded() {
            let (occupancy, semantics) = forward(planes);
            return Evidence::of_heads(&occupancy, &semantics);
        }
        // The shelf and its mirror image side by side: what stands there does not depend on which side is called left, and
        // where the two answers disagree neither is certain.
        let turned = planes.each_ref().map(mirrored);
        let (here, there) = rayon::join(|| forward(planes), || forward(turned));
        let mean = |here: Tensor, there: Tensor| (here + mirrored(&there)) * 0.5;
        Evidence::of_heads(&mean(here.0, there.0), &mean(here.1, there.1))
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

/// Inputs of sigma_o that describe an observation: levels and labels.
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

    /// sigma_o was trained on ten looks; with forty the belief drifts (RESULTS.md).
    fn wears(&self) -> bool {
        true
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
        predict(&self.pool, &layout, &self.planes_of(&layout, belief), belief, pushes)
            .unwrap_or_else(|| Classical.predict_pushes(belief, pushes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cnabu::Network;

    #[test]
    fn the_mirrored_scene_has_the_mirrored_posterior() {
        tch::manual_seed(3);
        let store = VarStore::new(Device::Cpu);
        let net = ObserveNet::new(&store.root(), 8);
        let update = Cnabu::of(net, store, Card::new("sigma_o", 8, 0));
        let layout = Layout::new(&Grid::for_shelf([0.16, 0.08, 0.30], 0.005)).expect("voxels of the networks");
        let planes = |channels: usize| Tensor::rand(layout.shape(channels), (Kind::Float, Device::Cpu));
        let prior = Evidence { occupancy: planes(2 * OCCUPANCY), semantics: planes(SEMANTICS) };
        let (observed, labels) = (planes(2 * OCCUPANCY).round(), planes(LABELS).round());
        let far = |a: &Tensor, b: &Tensor| (a - b).abs().max().double_value(&[]);
        let here = update.observe_planes(&layout, &prior, &observed, &labels);
        let there = update.observe_planes(&layout, &prior.mirrored(), &mirrored(&observed), &mirrored(&labels));
        let off = |kind: fn(&Evidence) -> &Tensor| far(&mirrored(kind(&here)), kind(&there));
        assert!(off(|e| &e.occupancy) < 1e-4 && off(|e| &e.semantics) < 1e-4);
        // The network alone does not give it: it would have to have learned it.
        let alone = |prior: &Evidence, observed: &Tensor, labels: &Tensor| {
            tch::no_grad(|| update.pool.take().observe.forward(prior, observed, labels)).0
        };
        let one = alone(&prior, &observed, &labels);
        let turned = alone(&prior.mirrored(), &mirrored(&observed), &mirrored(&labels));
        assert!(far(&mirrored(&one), &turned) > 1e-2);
    }
}
