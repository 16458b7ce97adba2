//! The evidential map belief: a Beta per voxel and a Dirichlet over the classes per floor cell.
//!
//! The mean of a Beta is `p = a_occ / (a_occ + a_free)`; all maps start at ones (uniform). Entropy is the
//! natural-log entropy of the mean distribution (nats); epistemic uncertainty is `K / sum(a)` for a Dirichlet and
//! the Beta's variance for a voxel (Marques et al., manipulation-enhanced mapping; Ulmer et al. 2023).

mod classical;

pub use classical::Classical;

use crate::camera::MapObservation;
use crate::grid::{Grid, VoxelSet, Window};
use crate::scene::{CLASS_COUNT, ClassId};
use crate::tool::Push;

/// A floor cell's certainty (largest class probability) above which it counts as known.
pub const CERTAIN: f32 = 0.85;
/// The share of known floor cells at which a map is complete.
pub const COMPLETE_SHARE: f32 = 0.95;

/// What is believed about the shelf at one time step.
#[derive(Clone, Debug, PartialEq)]
pub struct Belief {
    /// The grid that the maps cover.
    pub grid: Grid,
    /// `[a_occ, a_free]` per voxel, in the grid's order.
    pub occupancy: Vec<[f32; 2]>,
    /// `a_0 .. a_14` per floor cell, in the grid's order.
    pub semantics: Vec<[f32; CLASS_COUNT]>,
}

impl Belief {
    /// The uniform belief: all parameters one.
    pub fn uniform(grid: Grid) -> Self {
        Self {
            grid,
            occupancy: vec![[1.0; 2]; grid.voxel_count()],
            semantics: vec![[1.0; CLASS_COUNT]; grid.cell_count()],
        }
    }

    /// Probability that a voxel is occupied.
    pub fn probability(&self, voxel_index: usize) -> f32 {
        beta_mean(self.occupancy[voxel_index])
    }

    /// Class probabilities of a floor cell.
    pub fn class_probabilities(&self, cell_index: usize) -> [f32; CLASS_COUNT] {
        let a = &self.semantics[cell_index];
        let sum: f32 = a.iter().sum();
        a.map(|a| a / sum)
    }

    /// The likeliest class of a floor cell (the first of equals) and its probability, which is the cell's certainty.
    pub fn likeliest(&self, cell_index: usize) -> (ClassId, f32) {
        let p = self.class_probabilities(cell_index);
        let best = (1..CLASS_COUNT).fold(0, |best, k| if p[k] > p[best] { k } else { best });
        (ClassId(best as u8), p[best])
    }

    /// Entropy of the occupancy map below `levels`, nats.
    pub fn occupancy_entropy(&self, levels: usize) -> f64 {
        let height = self.grid.dims[2];
        self.occupancy
            .chunks_exact(height)
            .map(|column| {
                column[..levels.min(height)].iter().map(|a| f64::from(bernoulli_entropy(beta_mean(*a)))).sum::<f64>()
            })
            .sum()
    }

    /// Entropy of the semantic map, nats.
    pub fn semantic_entropy(&self) -> f64 {
        self.semantics.iter().map(|a| f64::from(dirichlet_entropy(a))).sum()
    }

    /// Share of floor cells whose certainty is above [`CERTAIN`].
    pub fn certain_share(&self) -> f32 {
        let certain = (0..self.grid.cell_count()).filter(|&cell| self.likeliest(cell).1 > CERTAIN).count();
        certain as f32 / self.grid.cell_count() as f32
    }

    /// Whether the map is complete: then the planner no longer pushes but goes on looking.
    pub fn is_complete(&self) -> bool {
        self.certain_share() >= COMPLETE_SHARE
    }

    /// Writes a push's prediction into the belief.
    pub fn apply(&mut self, prediction: &PushPrediction) {
        let height = self.grid.dims[2];
        for (at, cell) in prediction.window.cells(&self.grid).enumerate() {
            self.occupancy[self.grid.column(cell)]
                .copy_from_slice(&prediction.occupancy[at * height..(at + 1) * height]);
            self.semantics[cell] = prediction.semantics[at];
        }
    }
}

/// Mean of `Beta(a_occ, a_free)`.
pub fn beta_mean([occupied, free]: [f32; 2]) -> f32 {
    occupied / (occupied + free)
}

/// Variance of `Beta(a_occ, a_free)`: a voxel's epistemic uncertainty.
pub fn beta_variance([occupied, free]: [f32; 2]) -> f32 {
    let sum = occupied + free;
    occupied * free / (sum * sum * (sum + 1.0))
}

/// Entropy of a coin that shows heads with probability `p`, nats.
pub fn bernoulli_entropy(p: f32) -> f32 {
    let term = |p: f32| if p > 0.0 { -p * p.ln() } else { 0.0 };
    term(p) + term(1.0 - p)
}

/// Entropy of the mean of a Dirichlet, nats.
pub fn dirichlet_entropy(a: &[f32; CLASS_COUNT]) -> f32 {
    let sum: f32 = a.iter().sum();
    a.iter().map(|a| a / sum).map(|p| if p > 0.0 { -p * p.ln() } else { 0.0 }).sum()
}

/// `K / sum(a)`: a floor cell's epistemic uncertainty, 1 for no evidence.
pub fn dirichlet_vacuity(a: &[f32; CLASS_COUNT]) -> f32 {
    CLASS_COUNT as f32 / a.iter().sum::<f32>()
}

/// The belief that a push is predicted to leave, inside the window of the floor plan that it can touch; outside it
/// nothing changes. Arrays are in the window's `[x][y]([z])` order, full height.
#[derive(Clone, Debug, PartialEq)]
pub struct PushPrediction {
    /// The columns that the prediction covers.
    pub window: Window,
    /// Posterior `[a_occ, a_free]` per voxel, already gated with the probability of change.
    pub occupancy: Vec<[f32; 2]>,
    /// Posterior Dirichlet per floor cell.
    pub semantics: Vec<[f32; CLASS_COUNT]>,
    /// Probability per floor cell that the push changes it.
    pub change: Vec<f32>,
}

/// A push and the voxels that its tool sweeps.
#[derive(Clone, Debug)]
pub struct SweptPush {
    /// The push.
    pub push: Push,
    /// Every voxel that gripper or links touch, approach included.
    pub swept: VoxelSet,
}

/// How a belief changes with an observation (sigma_o) and how it is predicted to change with a push (sigma_m).
pub trait BeliefUpdate: Send + Sync {
    /// Name in episodes and reports: `classical`, `cnabu`.
    fn name(&self) -> &str;

    /// The belief after an observation: `lambda' = sigma_o(lambda, o)`.
    fn observe(&self, belief: &Belief, observation: &MapObservation) -> Belief;

    /// The beliefs that pushes are predicted to leave: `lambda' = sigma_m(lambda, push)`, one prediction per push.
    fn predict_pushes(&self, belief: &Belief, pushes: &[SweptPush]) -> Vec<PushPrediction>;
}
