//! The counts behind the scores: of one belief, or merged over a set.

use super::{Confusion, Reliability, SCORED_HEIGHT_M, Scores};
use crate::belief::{Belief, bernoulli_entropy, beta_mean, dirichlet_entropy};
use crate::scene::CLASS_COUNT;
use crate::world::TruthMap;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Occupancy as a class of a confusion matrix.
const FREE: usize = 0;
const OCCUPIED: usize = 1;

/// Confusion matrices, reliability bins and entropy of one belief, or of many merged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Voxels of the scored volume: class 0 free, class 1 occupied (`p > 0.5`).
    pub occupancy: Confusion,
    /// Floor cells by class: the likeliest, the first of equals.
    pub semantics: Confusion,
    /// Calibration of the voxels' `max(p, 1 - p)`.
    pub occupancy_reliability: Reliability,
    /// Calibration of the floor cells' largest class probability.
    pub semantics_reliability: Reliability,
    /// Entropy of occupancy in the scored volume and of semantics together, summed over the beliefs, nats.
    pub entropy_nats: f64,
    /// Number of beliefs counted.
    pub beliefs: u64,
}

impl Default for Tally {
    fn default() -> Self {
        Self {
            occupancy: Confusion::new(2),
            semantics: Confusion::new(CLASS_COUNT),
            occupancy_reliability: Reliability::new(2),
            semantics_reliability: Reliability::new(CLASS_COUNT),
            entropy_nats: 0.0,
            beliefs: 0,
        }
    }
}

impl Tally {
    /// Counts one belief against the truth of the same grid.
    pub fn of(belief: &Belief, truth: &TruthMap) -> Self {
        Self::of_some(belief, truth, None)
    }

    /// Counts the floor cells of one belief, and the voxels above them, that `counted` marks.
    pub fn of_cells(belief: &Belief, truth: &TruthMap, counted: &[bool]) -> Self {
        Self::of_some(belief, truth, Some(counted))
    }

    fn of_some(belief: &Belief, truth: &TruthMap, counted: Option<&[bool]>) -> Self {
        assert_eq!(belief.grid.dims, truth.dims, "belief and truth cover different grids");
        let levels = belief.grid.levels_below(SCORED_HEIGHT_M);
        // One slab of equal x per job; merged in order, so that sums of f64 do not depend on the threads.
        let slabs: Vec<Self> = (0..belief.grid.dims[0])
            .into_par_iter()
            .map(|x| Self::of_slab(belief, truth, x, levels, counted))
            .collect();
        let mut tally = slabs.iter().fold(Self::default(), |mut sum, slab| {
            sum.merge(slab);
            sum
        });
        tally.beliefs = 1;
        tally
    }

    fn of_slab(belief: &Belief, truth: &TruthMap, x: usize, levels: usize, counted: Option<&[bool]>) -> Self {
        let mut tally = Self::default();
        let depth = belief.grid.dims[1];
        for cell in (x * depth..(x + 1) * depth).filter(|cell| counted.is_none_or(|counted| counted[*cell])) {
            let column = belief.grid.column(cell);
            let scored = column.start..column.start + levels;
            // Neighbours in a column mostly share their evidence: logarithms are taken once per run of equals.
            let mut last: Option<([f32; 2], f32, f32)> = None;
            for (evidence, &truth) in belief.occupancy[scored.clone()].iter().zip(&truth.occupancy[scored]) {
                let (p, entropy) = match last {
                    Some((same, p, entropy)) if same == *evidence => (p, entropy),
                    _ => {
                        let p = beta_mean(*evidence);
                        let entropy = bernoulli_entropy(p);
                        last = Some((*evidence, p, entropy));
                        (p, entropy)
                    }
                };
                let truth = if truth != 0 { OCCUPIED } else { FREE };
                let predicted = if p > 0.5 { OCCUPIED } else { FREE };
                tally.occupancy.add(truth, predicted);
                tally.occupancy_reliability.add(truth, predicted, p.max(1.0 - p));
                tally.entropy_nats += f64::from(entropy);
            }
            let (class, certainty) = belief.likeliest(cell);
            let (predicted, truth) = (usize::from(class.0), usize::from(truth.labels[cell]));
            tally.semantics.add(truth, predicted);
            tally.semantics_reliability.add(truth, predicted, certainty);
            tally.entropy_nats += f64::from(dirichlet_entropy(&belief.semantics[cell]));
        }
        tally
    }

    /// Adds the counts of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.occupancy.merge(&other.occupancy);
        self.semantics.merge(&other.semantics);
        self.occupancy_reliability.merge(&other.occupancy_reliability);
        self.semantics_reliability.merge(&other.semantics_reliability);
        self.entropy_nats += other.entropy_nats;
        self.beliefs += other.beliefs;
    }

    /// The scores: of the one belief counted, or of the set (one confusion matrix; entropy is the mean per belief).
    ///
    /// Where nothing is occupied, neither in truth nor in prediction, the occupied IoU is 1: there was nothing to miss.
    pub fn scores(&self) -> Scores {
        Scores {
            occupancy_iou: self.occupancy.mean_iou(),
            occupied_iou: self.occupancy.iou(OCCUPIED).unwrap_or(1.0),
            semantic_miou: self.semantics.mean_iou(),
            entropy_nats: self.entropy_nats / self.beliefs.max(1) as f64,
            mece_occupancy: self.occupancy_reliability.mean_ece(),
            mece_semantics: self.semantics_reliability.mean_ece(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::scene::BACKGROUND;

    /// A floor of 2 x 1 cells with 0.1 m voxels, 4 levels, of which three are below 0.27 m.
    fn small() -> (Belief, TruthMap) {
        let grid = Grid { voxel_m: 0.1, dims: [2, 1, 4], origin: [-0.1, 0.0, 0.0] };
        let mut truth = TruthMap {
            dims: grid.dims,
            occupancy: vec![0; 8],
            labels: vec![3, BACKGROUND.0],
            objects: vec![0, u16::MAX],
        };
        truth.occupancy[0] = 1;
        truth.occupancy[1] = 1;
        (Belief::uniform(grid), truth)
    }

    #[test]
    fn scores_of_a_small_map_are_those_computed_by_hand() {
        let (mut belief, truth) = small();
        assert_eq!(belief.grid.levels_below(SCORED_HEIGHT_M), 3);
        // Column 0 (truth: 1 1 0): p = .75 .25 .25; column 1 (truth: 0 0 0): p = .75 .25 .5; level 3 is not scored.
        let odds = |p: f32| [4.0 * p, 4.0 * (1.0 - p)];
        belief.occupancy = [0.75, 0.25, 0.25, 0.75, 0.75, 0.25, 0.5, 0.75].map(odds).to_vec();
        // Cell 0 (truth 3): class 3 with probability .5; cell 1 (background): class 3 with .25.
        let semantics = |p: f32| {
            let mut a = [(1.0 - p) / 14.0; CLASS_COUNT];
            a[3] = p;
            a
        };
        belief.semantics = vec![semantics(0.5), semantics(0.25)];
        let scores = Scores::of(&belief, &truth);
        // Occupied: hit 1, union 3. Free: hit 3, union 5.
        assert!((scores.occupied_iou - 1.0 / 3.0).abs() < 1e-9);
        assert!((scores.occupancy_iou - 0.5 * (1.0 / 3.0 + 3.0 / 5.0)).abs() < 1e-9);
        // Class 3: hit 1, union 2. Background: hit 0.
        assert!((scores.semantic_miou - 0.25).abs() < 1e-9);
        // Truly occupied: two at .75, one right: |1 - 1.5| / 2. Truly free: three at .75, two right; one at .5, right.
        let (occupied, free) = (0.25, ((2.0_f64 - 2.25).abs() + 0.5) / 4.0);
        assert!((scores.mece_occupancy - 0.5 * (occupied + free)).abs() < 1e-6);
        assert!((scores.mece_semantics - 0.5 * (0.5 + 0.25)).abs() < 1e-6);
        let h = |p: f64| if p > 0.0 { -p * p.ln() } else { 0.0 };
        let dirichlet = |p: f64| h(p) + 14.0 * h((1.0 - p) / 14.0);
        let entropy = 5.0 * (h(0.75) + h(0.25)) + 2.0 * h(0.5) + dirichlet(0.5) + dirichlet(0.25);
        assert!((scores.entropy_nats - entropy).abs() < 1e-5);
    }

    #[test]
    fn a_perfect_map_scores_one_and_an_empty_scene_misses_nothing() {
        let (mut belief, mut truth) = small();
        belief.occupancy = truth.occupancy.iter().map(|&o| if o == 1 { [1e6, 1e-6] } else { [1e-6, 1e6] }).collect();
        for (a, &label) in belief.semantics.iter_mut().zip(&truth.labels) {
            *a = [1e-6; CLASS_COUNT];
            a[usize::from(label)] = 1e6;
        }
        let scores = Scores::of(&belief, &truth);
        assert_eq!((scores.occupancy_iou, scores.occupied_iou, scores.semantic_miou), (1.0, 1.0, 1.0));
        assert!(scores.mece_occupancy < 1e-6 && scores.mece_semantics < 1e-6 && scores.entropy_nats < 1e-6);

        truth.occupancy.fill(0);
        truth.labels.fill(BACKGROUND.0);
        let empty = Scores::of(&Belief::uniform(belief.grid), &truth);
        assert_eq!((empty.occupancy_iou, empty.occupied_iou), (1.0, 1.0));
    }

    #[test]
    fn a_set_is_scored_from_one_confusion_matrix() {
        let (mut belief, truth) = small();
        let empty = Tally::of(&belief, &truth);
        belief.occupancy[0] = [3.0, 1.0];
        belief.occupancy[1] = [3.0, 1.0];
        let mut set = Tally::of(&belief, &truth);
        let single = (set.scores().occupied_iou, empty.scores().occupied_iou);
        set.merge(&empty);
        assert_eq!((single, set.scores().occupied_iou, set.beliefs), ((1.0, 0.0), 0.5, 2));
        let mean = 0.5 * (Scores::of(&belief, &truth).entropy_nats + empty.scores().entropy_nats);
        assert!((set.scores().entropy_nats - mean).abs() < 1e-9);
    }

    #[test]
    fn scores_do_not_depend_on_the_number_of_threads() {
        let grid = Grid::for_shelf([0.80, 0.40, 0.40], 0.005);
        let (belief, truth) = noisy(grid);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            pool.install(|| Scores::of(&belief, &truth))
        };
        assert_eq!(with(1), with(3));
    }

    /// A belief whose evidence differs from voxel to voxel: the slowest to score.
    fn noisy(grid: Grid) -> (Belief, TruthMap) {
        use rand::Rng;
        let mut rng = crate::rng::stream(7, "score-test", 0);
        let mut belief = Belief::uniform(grid);
        belief.occupancy.iter_mut().flatten().for_each(|a| *a = rng.random_range(1.0..30.0));
        belief.semantics.iter_mut().flatten().for_each(|a| *a = rng.random_range(1.0..30.0));
        let truth = TruthMap {
            dims: grid.dims,
            occupancy: (0..grid.voxel_count()).map(|_| rng.random_range(0..2)).collect(),
            labels: (0..grid.cell_count()).map(|_| rng.random_range(0..CLASS_COUNT as u8)).collect(),
            objects: vec![u16::MAX; grid.cell_count()],
        };
        (belief, truth)
    }
}
