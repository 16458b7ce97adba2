//! The networks as a belief update.
//!
//! Observations go through sigma_o. Pushes go through sigma_m where its weights are there; where they are not, the
//! classical rule predicts them, on the belief that sigma_o made.

use super::layout::{LABELS, Layout, Mirror, OCCUPANCY, SEMANTICS};
use super::observe_net::{Evidence, ObserveNet};
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
    // libtorch's tensors may be sent to another thread but not be used by two at once.
    networks: Mutex<Networks>,
    card: Card,
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
    /// For weights that are missing (those of sigma_m may), damaged, not finite, or of another grid, class list or version.
    pub fn load(directory: &Path) -> Result<Self> {
        let update = Self::load_file(&directory.join(OBSERVE_WEIGHTS))?;
        let push = directory.join(PUSH_WEIGHTS);
        if push.is_file() { update.with_push_file(&push) } else { Ok(update) }
    }

    /// Loads sigma_o from its file.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn load_file(path: &Path) -> Result<Self> {
        if !path.is_file() {
            return Err(Error::input(path, "", "there are no weights here (nudge train observe makes them)"));
        }
        let (net, store, card) = load_network::<ObserveNet>(path, super::chosen_device()?)?;
        Ok(Self::of(net, store, card))
    }

    /// The same with sigma_m from its file.
    ///
    /// # Errors
    /// As [`Cnabu::load`].
    pub fn with_push_file(self, path: &Path) -> Result<Self> {
        let (net, store, card) = load_network::<PushNet>(path, self.device())?;
        Ok(self.with_push(net, store, card.change_temperature.unwrap_or(1.0)))
    }

    /// A belief update of a sigma_o at hand.
    pub fn of(net: ObserveNet, store: VarStore, card: Card) -> Self {
        Self { networks: Mutex::new(Networks { observe: net, push: None, stores: vec![store] }), card }
    }

    /// The same with a sigma_m at hand, whose log-odds of change are divided by `temperature`.
    pub fn with_push(self, net: PushNet, store: VarStore, temperature: f32) -> Self {
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
        let (observed, labels) = (observed.to_device(device), labels.to_device(device));
        let cells = layout.grid().dims[0];
        tch::no_grad(|| {
            let (occupancy, semantics) = networks.observe.forward_both_ways(prior, &observed, &labels, cells);
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
        tch::manual_seed(3);
        let store = VarStore::new(Device::Cpu);
        let net = ObserveNet::new(&store.root(), 8);
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
