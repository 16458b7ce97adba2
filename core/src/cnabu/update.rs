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
use super::pool::{Networks, Pool};
use super::predict::predict;
use super::push_net::PushNet;
use super::weights::{Card, load_network};
use super::{OBSERVE_WEIGHTS, PUSH_WEIGHTS};
use crate::belief::{
    Belief, BeliefUpdate, Classical, Intervention, ModuleFiles, NetworksUsed, Prediction, Weights, predict_held_apart,
};
use crate::camera::MapObservation;
use crate::files::sha256_of_file;
use crate::grid::Grid;
use crate::{Error, Result};
use std::path::Path;
use std::sync::Mutex;
use tch::nn::VarStore;
use tch::{Device, Kind, Tensor};

/// sigma_o and sigma_m with their weights; `cnabu` in episodes.
#[derive(Debug)]
pub struct Cnabu {
    pool: Pool,
    card: Card,
    /// The files that they were read from.
    weights: Weights,
}

impl Cnabu {
    /// Loads the weights of a models directory, onto the device that [`DEVICE_ENV`](super::DEVICE_ENV) names or, if it is
    /// not set, a CUDA device if libtorch has one.
    ///
    /// # Errors
    /// For weights that are missing, damaged, not finite, or of another grid, class list or version.
    pub fn load(directory: &Path) -> Result<Self> {
        let [observe, push] = [OBSERVE_WEIGHTS, PUSH_WEIGHTS].map(|file| directory.join(file));
        let first = Self::load_file(&observe)?.with_push_file(&push)?;
        first.for_all_threads(|| Self::read_file(&observe)?.with_push_read(&push))
    }

    /// Loads sigma_o alone, to score observations.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn load_observation(directory: &Path) -> Result<Self> {
        let path = directory.join(OBSERVE_WEIGHTS);
        Self::load_file(&path)?.for_all_threads(|| Self::read_file(&path))
    }

    /// Networks for each of rayon's threads: these, and what `again` reads.
    fn for_all_threads(mut self, again: impl Fn() -> Result<Self>) -> Result<Self> {
        // A graphics card computes for all threads in turn.
        let copies = if self.device() == Device::Cpu { rayon::current_num_threads() } else { 1 };
        for _ in 1..copies {
            self.pool.0.append(&mut again()?.pool.0);
        }
        Ok(self)
    }

    /// Loads sigma_o from its file.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn load_file(path: &Path) -> Result<Self> {
        let mut update = Self::read_file(path)?;
        update.weights.sigma_o = Some(sha256_of_file(path)?);
        Ok(update)
    }

    fn read_file(path: &Path) -> Result<Self> {
        is_there(path, "observe")?;
        let (net, store, card) = load_network::<ObserveNet>(path, super::chosen_device()?)?;
        Ok(Self::of(net, store, card))
    }

    /// The same with sigma_m from its file.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn with_push_file(self, path: &Path) -> Result<Self> {
        let mut update = self.with_push_read(path)?;
        update.weights.sigma_m = Some(sha256_of_file(path)?);
        Ok(update)
    }

    fn with_push_read(self, path: &Path) -> Result<Self> {
        is_there(path, "push")?;
        let (net, store, card) = load_network::<PushNet>(path, self.device())?;
        Ok(self.with_push(net, store, card.change_temperature.unwrap_or(1.0)))
    }

    /// A belief update of a sigma_o at hand.
    pub fn of(net: ObserveNet, store: VarStore, card: Card) -> Self {
        let networks = Networks { observe: net, push: None, stores: vec![store] };
        Self { pool: Pool(vec![Mutex::new(networks)]), card, weights: Weights::default() }
    }

    /// The same with a sigma_m at hand, whose log-odds of change are divided by `temperature`.
    pub fn with_push(mut self, net: PushNet, store: VarStore, temperature: f32) -> Self {
        self.weights = Weights { sigma_m: None, change_temperature: Some(temperature), ..self.weights };
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
        // The shelf and its mirror image side by side: what stands there does not depend on which side is called left, and
        // where the two answers disagree neither is certain.
        let mirrored = |planes: &Tensor| mirrored(planes, layout.grid().dims[0] as i64);
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

    fn networks_used(&self) -> Option<NetworksUsed> {
        let device = if self.device().is_cuda() { "cuda" } else { "cpu" };
        Some(NetworksUsed {
            weights: self.weights.clone(),
            modules: ModuleFiles::default(),
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

    fn predict(&self, belief: &Belief, interventions: &[Intervention]) -> Vec<Prediction> {
        let classical = || Classical.predict(belief, interventions);
        let Ok(layout) = Layout::new(&belief.grid) else { return classical() };
        let asked = |rest: &[Intervention]| {
            predict(&self.pool, &layout, &self.planes_of(&layout, belief), belief, rest)
                .unwrap_or_else(|| Classical.predict(belief, rest))
        };
        predict_held_apart(belief, interventions, asked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::UNOBSERVED;
    use crate::cnabu::Network;
    use crate::grid::VoxelSet;
    use crate::rng;
    use crate::scene::CLASS_COUNT;
    use rand::Rng;

    /// The floor cell that is as far from the right as `cell` is from the left.
    fn opposite(grid: &Grid, cell: usize) -> usize {
        let [width, depth, _] = grid.dims;
        (width - 1 - cell / depth) * depth + cell % depth
    }

    fn mirrored_set(grid: &Grid, set: &VoxelSet) -> VoxelSet {
        let (mut mirrored, height) = (VoxelSet::empty(grid), grid.dims[2]);
        set.iter().for_each(|voxel| mirrored.insert(opposite(grid, voxel / height) * height + voxel % height));
        mirrored
    }

    fn mirrored_observation(grid: &Grid, of: &MapObservation) -> MapObservation {
        let labels = (0..grid.cell_count()).map(|cell| of.labels[opposite(grid, cell)]).collect();
        MapObservation { free: mirrored_set(grid, &of.free), occupied: mirrored_set(grid, &of.occupied), labels }
    }

    fn mirrored_belief(of: &Belief) -> Belief {
        let mut mirrored = of.clone();
        for cell in 0..of.grid.cell_count() {
            let from = opposite(&of.grid, cell);
            mirrored.semantics[cell] = of.semantics[from];
            mirrored.occupancy[of.grid.column(cell)].copy_from_slice(&of.occupancy[of.grid.column(from)]);
        }
        mirrored
    }

    /// A belief and an observation without any symmetry.
    fn scene(grid: Grid) -> (Belief, MapObservation) {
        let mut rng = rng::stream(5, "mirror test", 0);
        let mut belief = Belief::uniform(grid);
        let mut observation = MapObservation {
            free: VoxelSet::empty(&grid),
            occupied: VoxelSet::empty(&grid),
            labels: vec![UNOBSERVED; grid.cell_count()],
        };
        for cell in 0..grid.cell_count() {
            belief.semantics[cell] = std::array::from_fn(|_| 1.0 + 9.0 * rng.random::<f32>());
            if rng.random::<bool>() {
                observation.labels[cell] = rng.random_range(0..CLASS_COUNT as u8);
            }
            for voxel in grid.column(cell) {
                belief.occupancy[voxel] = std::array::from_fn(|_| 1.0 + 9.0 * rng.random::<f32>());
                match rng.random_range(0..3) {
                    0 => observation.free.insert(voxel),
                    1 => observation.occupied.insert(voxel),
                    _ => (),
                }
            }
        }
        (belief, observation)
    }

    /// The largest difference between the means of two beliefs.
    fn far(a: &Belief, b: &Belief) -> f32 {
        let voxels = (0..a.occupancy.len()).map(|voxel| (a.probability(voxel) - b.probability(voxel)).abs());
        let cells = a.semantics.iter().zip(&b.semantics).flat_map(|(a, b)| {
            let sums = [a, b].map(|classes| classes.iter().sum::<f32>());
            (0..CLASS_COUNT).map(move |class| (a[class] / sums[0] - b[class] / sums[1]).abs())
        });
        voxels.chain(cells).fold(0.0, f32::max)
    }

    /// Shelves whose planes need padding lost the second opinion of the mirror image, without a word.
    #[test]
    fn a_mirrored_shelf_gets_the_mirrored_posterior_padded_or_not() {
        let store = VarStore::new(Device::Cpu);
        let net = crate::cnabu::seeded(3, || ObserveNet::new(&store.root(), 8));
        let update = Cnabu::of(net, store, Card::new("sigma_o", 8, 0));
        // No padding; padding along x with an even and with an odd number of floor cells; padding along y alone.
        for (size, padded) in [
            ([0.16, 0.08, 0.10], false),
            ([0.13, 0.08, 0.10], true),
            ([0.135, 0.07, 0.08], true),
            ([0.16, 0.06, 0.10], true),
        ] {
            let grid = Grid::for_shelf(size, 0.005);
            assert_eq!(Layout::new(&grid).expect("5 mm").is_padded(), padded, "{size:?}");
            let (belief, observation) = scene(grid);
            let here = update.observe(&belief, &observation);
            let there = update.observe(&mirrored_belief(&belief), &mirrored_observation(&grid, &observation));
            let off = far(&mirrored_belief(&here), &there);
            assert!(off < 1e-4, "{size:?}: {off}");
            assert!(far(&here, &there) > 1e-2, "the scene has no symmetry");
        }
    }
}
