//! The evidential map belief: a Beta per voxel and a Dirichlet over the classes per floor cell.
//!
//! The mean of a Beta is `p = a_occ / (a_occ + a_free)`; all maps start at ones (uniform). Entropy is the
//! natural-log entropy of the mean distribution (nats); epistemic uncertainty is `K / sum(a)` for a Dirichlet and
//! the Beta's variance for a voxel (Marques et al., manipulation-enhanced mapping; Ulmer et al. 2023).

mod classical;
mod floor;
mod held;
mod intervention;
mod mixed;
mod networks;
mod sightings;

pub use classical::{Classical, LOG_ODDS_LIMIT, LOG_ODDS_STEP, evidence, log_odds};
pub use floor::{FloorPlan, Patch};
pub(crate) use intervention::Met;
#[cfg(feature = "cnabu")]
pub(crate) use intervention::Moved;
pub use intervention::{Flow, Intervention, SOLID, Stroke};
pub use mixed::{OWN, mixed_name, mixed_parts, observes_with_networks};
pub use networks::{ModuleFiles, NetworksUsed, Weights, short};
pub use sightings::{CHANGED, LOOKS_TAKEN, NEWS_REACH_M, Sightings, look};

use crate::camera::MapObservation;
use crate::grid::{Grid, Window};
use crate::scene::{CLASS_COUNT, ClassId};
use rayon::prelude::*;

/// A floor cell's certainty (largest class probability) above which it counts as known.
pub const CERTAIN: f32 = 0.85;
/// The share of known floor cells at which a map is complete.
pub const COMPLETE_SHARE: f32 = 0.95;

/// Largest distance between a floor cell of an object and the cell where the object is touched, metres: the length of
/// the longest object.
pub const OBJECT_RADIUS_M: f32 = 0.20;

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

    /// Entropy of the occupancy map's lowest `levels` levels, nats.
    pub fn occupancy_entropy(&self, levels: usize) -> f64 {
        let (height, depth) = (self.grid.dims[2], self.grid.dims[1]);
        let of_column = |column: &[[f32; 2]]| -> f64 {
            column[..levels.min(height)].iter().map(|a| f64::from(bernoulli_entropy(beta_mean(*a)))).sum()
        };
        // Slices first, then their sum in order: the same on any number of threads.
        let slices: Vec<f64> = self
            .occupancy
            .par_chunks(height * depth)
            .map(|slice| slice.chunks_exact(height).map(of_column).sum())
            .collect();
        slices.iter().sum()
    }

    /// Entropy of the semantic map, nats.
    pub fn semantic_entropy(&self) -> f64 {
        self.semantics.iter().map(|a| f64::from(dirichlet_entropy(a))).sum()
    }

    /// Entropy of the whole map, every level and the semantics, nats.
    pub fn entropy(&self) -> f64 {
        self.occupancy_entropy(self.grid.dims[2]) + self.semantic_entropy()
    }

    /// Share of floor cells whose certainty is above `threshold`, by default [`CERTAIN`].
    pub fn certain_share(&self, threshold: f32) -> f32 {
        let certain = (0..self.grid.cell_count()).filter(|&cell| self.likeliest(cell).1 > threshold).count();
        certain as f32 / self.grid.cell_count() as f32
    }

    /// Whether the map is complete, by [`CERTAIN`] and [`COMPLETE_SHARE`]: then the planner no longer pushes but goes on
    /// looking.
    pub fn is_complete(&self) -> bool {
        self.certain_share(CERTAIN) >= COMPLETE_SHARE
    }

    /// Writes the prediction for a manipulation into the belief.
    pub fn apply(&mut self, prediction: &Prediction) {
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

/// The belief that a manipulation is predicted to leave, inside the window of the floor plan that it can touch; outside it
/// nothing changes. Arrays are in the window's `[x][y]([z])` order, full height.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// The columns that the prediction covers.
    pub window: Window,
    /// Posterior `[a_occ, a_free]` per voxel, already gated with the probability of change.
    pub occupancy: Vec<[f32; 2]>,
    /// Posterior Dirichlet per floor cell.
    pub semantics: Vec<[f32; CLASS_COUNT]>,
    /// Probability per floor cell that the manipulation changes it.
    pub change: Vec<f32>,
}

/// Smallest probability that a prediction is taken to give to what happens to a floor cell: 1 %.
const SUREST: f32 = 0.01;
/// The largest surprise of a floor cell, nats: the prediction gave at most 1 % to what happened.
pub const MOST_SURPRISING: f32 = 4.605_17;

impl Prediction {
    /// The surprise of every floor cell: `-ln` of the predicted probability of what happened to it (changed or
    /// unchanged), nats, at most [`MOST_SURPRISING`]. Cells outside the window were predicted to stay.
    pub fn surprise(&self, grid: &Grid, changed: &[bool]) -> Vec<f32> {
        let mut chance = vec![0.0; grid.cell_count()];
        for (cell, change) in self.window.cells(grid).zip(&self.change) {
            chance[cell] = if change.is_finite() { *change } else { 0.5 };
        }
        let surprise = |(chance, changed): (&f32, &bool)| {
            let given = if *changed { *chance } else { 1.0 - chance };
            -given.max(SUREST).ln()
        };
        chance.iter().zip(changed).map(surprise).collect()
    }

    /// `H_s(belief) - H_s(predicted)`, nats: negative when labels are predicted to become less certain. `belief`
    /// is the one that the prediction was made from; cells outside the window cancel out.
    pub fn semantic_entropy_drop(&self, belief: &Belief) -> f64 {
        self.window
            .cells(&belief.grid)
            .zip(&self.semantics)
            .filter(|&(cell, after)| belief.semantics[cell] != *after)
            .map(|(cell, after)| {
                f64::from(dirichlet_entropy(&belief.semantics[cell])) - f64::from(dirichlet_entropy(after))
            })
            .sum()
    }
}

/// Name of the classical update.
pub const CLASSICAL: &str = "classical";
/// Name of the networks' update ([`crate::cnabu`]).
pub const CNABU: &str = "cnabu";

/// How a belief changes with an observation (sigma_o) and how it is predicted to change with a manipulation (sigma_m).
pub trait BeliefUpdate: Send + Sync {
    /// Name in episodes and reports: [`CLASSICAL`], [`CNABU`], or one of [`mixed_name`].
    fn name(&self) -> &str;

    /// Whether beliefs over `grid` can be updated.
    ///
    /// # Errors
    /// For a grid that the update is not made for.
    fn check_grid(&self, _grid: &Grid) -> crate::Result<()> {
        Ok(())
    }

    /// Whether beliefs drift when the update is applied to the same place again and again, so that [`look`] limits
    /// where a look changes them.
    fn wears(&self) -> bool {
        false
    }

    /// The networks that it runs on; `None` for an update without any.
    fn networks_used(&self) -> Option<NetworksUsed> {
        None
    }

    /// What went wrong in an update, if anything did: from then on nothing that it answers counts, and whoever asked it
    /// ends with this error.
    fn fault(&self) -> Option<crate::Error> {
        None
    }

    /// The belief after an observation: `lambda' = sigma_o(lambda, o)`. Episodes go through [`look`].
    fn observe(&self, belief: &Belief, observation: &MapObservation) -> Belief;

    /// The beliefs that manipulations are predicted to leave: `lambda' = sigma_m(lambda, intervention)`, one prediction per
    /// intervention.
    fn predict(&self, belief: &Belief, interventions: &[Intervention]) -> Vec<Prediction>;
}

/// Predictions in order: what is held moves as a whole (`held`), the rest is what `rest` answers.
pub(crate) fn predict_held_apart(
    belief: &Belief,
    interventions: &[Intervention],
    rest: impl FnOnce(&[Intervention]) -> Vec<Prediction>,
) -> Vec<Prediction> {
    if interventions.iter().all(|intervention| intervention.held.is_none()) {
        return rest(interventions);
    }
    let others: Vec<Intervention> = interventions.iter().filter(|one| one.held.is_none()).cloned().collect();
    let mut others = if others.is_empty() { Vec::new() } else { rest(&others) }.into_iter();
    let of = |one: &Intervention| match one.held {
        Some(chance) => Some(held::predict(belief, one, chance)),
        None => others.next(),
    };
    interventions.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::LN_2;

    fn near(a: f32, b: f32) -> bool {
        (a - b).abs() < 1e-6
    }

    /// 4 x 2 x 4 voxels on 8 floor cells.
    fn small() -> Belief {
        Belief::uniform(Grid::for_shelf([0.02, 0.01, 0.02], 0.005))
    }

    #[test]
    fn entropy_of_hand_made_cells() {
        assert!(near(bernoulli_entropy(0.5), LN_2));
        assert!(near(bernoulli_entropy(0.25), 0.562_335_1));
        assert_eq!((bernoulli_entropy(0.0), bernoulli_entropy(1.0)), (0.0, 0.0));
        assert!(near(dirichlet_entropy(&[1.0; CLASS_COUNT]), 15.0_f32.ln()));
        // (16, 1 x 14) / 30: 8/15 ln 15/8 + 14/30 ln 30.
        let mut a = [1.0; CLASS_COUNT];
        a[3] = 16.0;
        assert!(near(dirichlet_entropy(&a), 8.0 / 15.0 * (15.0_f32 / 8.0).ln() + 14.0 / 30.0 * 30.0_f32.ln()));
    }

    #[test]
    fn mean_variance_and_vacuity_of_hand_made_parameters() {
        assert_eq!(beta_mean([3.0, 1.0]), 0.75);
        // Beta(3, 1): 3 * 1 / (16 * 5).
        assert!(near(beta_variance([3.0, 1.0]), 0.0375));
        assert!(near(beta_variance([1.0, 1.0]), 1.0 / 12.0));
        assert_eq!(dirichlet_vacuity(&[1.0; CLASS_COUNT]), 1.0);
        assert_eq!(dirichlet_vacuity(&[2.0; CLASS_COUNT]), 0.5);
    }

    #[test]
    fn entropy_of_a_map_is_the_sum_of_its_cells() {
        let mut belief = small();
        assert!((belief.occupancy_entropy(4) - 32.0 * 2.0_f64.ln()).abs() < 1e-5);
        assert!((belief.occupancy_entropy(1) - 8.0 * 2.0_f64.ln()).abs() < 1e-5);
        assert!((belief.semantic_entropy() - 8.0 * 15.0_f64.ln()).abs() < 1e-5);
        belief.occupancy[0] = [3.0, 1.0];
        assert!((belief.occupancy_entropy(9) - (31.0 * 2.0_f64.ln() + 0.562_335_1)).abs() < 1e-5);
        assert!((belief.entropy() - belief.occupancy_entropy(4) - belief.semantic_entropy()).abs() < 1e-9);
    }

    #[test]
    fn certainty_is_the_largest_class_probability() {
        let mut belief = small();
        assert_eq!(belief.likeliest(0), (ClassId(0), 1.0 / 15.0));
        belief.semantics[0][7] = 6.0;
        let (class, certainty) = belief.likeliest(0);
        assert_eq!(class, ClassId(7));
        assert!(near(certainty, 0.3));
        belief.semantics[0][9] = 6.0;
        assert_eq!(belief.likeliest(0).0, ClassId(7), "the first of equals");
    }

    #[test]
    fn a_map_is_complete_when_95_percent_are_certain() {
        // 10 x 2 cells: 19 certain ones are 95 %.
        let mut belief = Belief::uniform(Grid::for_shelf([0.05, 0.01, 0.01], 0.005));
        for cell in 0..18 {
            belief.semantics[cell][14] = 100.0;
        }
        assert!(near(belief.certain_share(CERTAIN), 0.9) && !belief.is_complete());
        belief.semantics[18][2] = 79.0; // 79 / 93 = 0.8495
        assert!(!belief.is_complete());
        belief.semantics[18][2] = 80.0; // 80 / 94 = 0.8511
        assert!(belief.is_complete());
        assert!(belief.certain_share(0.852) < COMPLETE_SHARE, "a higher threshold");
    }

    #[test]
    fn a_prediction_lands_in_its_window_and_nowhere_else() {
        let mut belief = small();
        let mut class = [1.0; CLASS_COUNT];
        class[4] = 16.0;
        let mut other = [1.0; CLASS_COUNT];
        other[2] = 6.0;
        let prediction = Prediction {
            window: Window { x: [1, 3], y: [1, 2] },
            occupancy: (0..8).map(|i| [2.0 + i as f32, 1.0]).collect(),
            semantics: vec![other, class],
            change: vec![0.5, 1.0],
        };
        let drop = prediction.semantic_entropy_drop(&belief);
        let before = belief.clone();
        belief.apply(&prediction);
        assert!((drop - (before.semantic_entropy() - belief.semantic_entropy())).abs() < 1e-5 && drop > 0.5);
        let grid = belief.grid;
        for index in 0..grid.voxel_count() {
            let voxel = grid.voxel(index);
            let inside = (1..3).contains(&voxel.x) && voxel.y == 1;
            let value = if inside { 2.0 + f32::from((voxel.x - 1) * 4 + voxel.z) } else { 1.0 };
            assert_eq!(belief.occupancy[index], [value, 1.0], "{voxel:?}");
        }
        let last = grid.cell_index(crate::grid::Cell { x: 2, y: 1 });
        assert_eq!(belief.semantics[last], class);
        assert_eq!(belief.semantics.iter().filter(|a| **a != [1.0; CLASS_COUNT]).count(), 2);
    }
}
