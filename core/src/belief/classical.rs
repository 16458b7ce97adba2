//! Classical metric-semantic occupancy mapping in evidential form.
//!
//! The classical map keeps a log-odds `l` per voxel, moved by [`LOG_ODDS_STEP`] per observation and clamped at
//! [`LOG_ODDS_LIMIT`], and running label counts per floor cell. Both fit the evidential belief without loss:
//!
//! * `p = sigmoid(l)` is the Beta's mean, so `a_occ = S p`, `a_free = S (1 - p)` and, exactly, `l = ln(a_occ / a_free)`.
//! * The total evidence `S = a_occ + a_free` counts observations: it starts at 2 (the uniform prior, `l = 0`) and grows
//!   by one per observation, but is never below `1 + e^|l|`, the least total at which both parameters are at least one
//!   (no negative evidence).
//! * The Dirichlet of a floor cell is one plus the number of times each class was seen there.

mod manipulated;

pub(super) use manipulated::GONE;

use super::{Belief, BeliefUpdate, CLASSICAL, FloorPlan, Intervention, Prediction, SOLID, predict_held_apart};
use crate::camera::MapObservation;
use crate::scene::CLASS_COUNT;
use rayon::prelude::*;

/// Change of a voxel's log-odds per observation: up for a hit, down for a ray that passed.
pub const LOG_ODDS_STEP: f32 = 0.85;
/// Largest magnitude of a voxel's log-odds (`p` between 0.029 and 0.971).
pub const LOG_ODDS_LIMIT: f32 = 3.5;

/// The classical update: log-odds and label counts for observations, a hand-made rule for manipulations.
#[derive(Clone, Copy, Debug, Default)]
pub struct Classical;

impl BeliefUpdate for Classical {
    fn name(&self) -> &str {
        CLASSICAL
    }

    fn observe(&self, belief: &Belief, observation: &MapObservation) -> Belief {
        let height = belief.grid.dims[2];
        let (hit, miss, limit) = (LOG_ODDS_STEP.exp(), (-LOG_ODDS_STEP).exp(), LOG_ODDS_LIMIT.exp());
        let mut next = belief.clone();
        next.occupancy.par_chunks_mut(height).zip(&mut next.semantics).enumerate().for_each(
            |(cell, (column, counts))| {
                for (level, voxel) in column.iter_mut().enumerate() {
                    let index = cell * height + level;
                    if observation.occupied.contains(index) {
                        *voxel = shifted(*voxel, hit, limit);
                    } else if observation.free.contains(index) {
                        *voxel = shifted(*voxel, miss, limit);
                    }
                }
                // Anything that is no class is `UNOBSERVED`.
                let label = usize::from(observation.labels[cell]);
                if label < CLASS_COUNT {
                    counts[label] += 1.0;
                }
            },
        );
        next
    }

    fn predict(&self, belief: &Belief, interventions: &[Intervention]) -> Vec<Prediction> {
        let plan = FloorPlan::new(belief, SOLID);
        predict_held_apart(belief, interventions, |rest| {
            rest.par_iter().map(|intervention| manipulated::predict(belief, &plan, intervention)).collect()
        })
    }
}

/// Log-odds of a voxel, the inverse of [`evidence`].
pub fn log_odds([occupied, free]: [f32; 2]) -> f32 {
    (occupied / free).ln()
}

/// `[a_occ, a_free]` of a voxel with the given log-odds and total evidence.
pub fn evidence(log_odds: f32, total: f32) -> [f32; 2] {
    evidence_of_odds(log_odds.exp(), total)
}

/// One observation: the odds are multiplied by `factor` (`e^+-0.85`) and held within `1 / limit ..= limit`. Working in
/// odds instead of log-odds spares a logarithm and an exponential per voxel.
fn shifted([occupied, free]: [f32; 2], factor: f32, limit: f32) -> [f32; 2] {
    let odds = (occupied / free * factor).clamp(1.0 / limit, limit);
    evidence_of_odds(odds, (occupied + free + 1.0).max(1.0 + odds.max(1.0 / odds)))
}

fn evidence_of_odds(odds: f32, total: f32) -> [f32; 2] {
    [total * odds / (1.0 + odds), total / (1.0 + odds)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::beta_mean;
    use crate::camera::UNOBSERVED;
    use crate::grid::{Grid, VoxelSet};
    use proptest::prelude::*;

    fn nothing_seen(grid: &Grid) -> MapObservation {
        MapObservation {
            free: VoxelSet::empty(grid),
            occupied: VoxelSet::empty(grid),
            labels: vec![UNOBSERVED; grid.cell_count()],
        }
    }

    #[test]
    fn one_hit_and_one_miss_are_0_85_of_log_odds() {
        let grid = Grid::for_shelf([0.02, 0.02, 0.02], 0.005);
        let mut seen = nothing_seen(&grid);
        seen.occupied.insert(5);
        seen.free.insert(6);
        seen.labels[3] = 9;
        let belief = Classical.observe(&Belief::uniform(grid), &seen);
        // sigmoid(0.85) = 0.700567, total evidence max(3, 1 + e^0.85 = 3.339647).
        assert!((belief.probability(5) - 0.700_567).abs() < 1e-5);
        assert!((belief.probability(6) - 0.299_433).abs() < 1e-5);
        let [occupied, free] = belief.occupancy[5];
        assert!((occupied - 2.339_647).abs() < 1e-5 && (free - 1.0).abs() < 1e-6);
        assert_eq!(belief.occupancy[7], [1.0, 1.0], "unobserved voxels stay");
        let mut counts = [1.0; CLASS_COUNT];
        counts[9] = 2.0;
        assert_eq!(belief.semantics[3], counts);
        assert_eq!(belief.semantics[2], [1.0; CLASS_COUNT]);
    }

    #[test]
    fn log_odds_stop_at_the_limit_and_turn_back_at_once() {
        let grid = Grid::for_shelf([0.01, 0.01, 0.01], 0.005);
        let (mut hit, mut miss) = (nothing_seen(&grid), nothing_seen(&grid));
        hit.occupied.insert(0);
        miss.free.insert(0);
        let mut belief = Belief::uniform(grid);
        let mut totals = vec![2.0];
        for _ in 0..40 {
            belief = Classical.observe(&belief, &hit);
            totals.push(belief.occupancy[0].iter().sum::<f32>());
        }
        assert!((log_odds(belief.occupancy[0]) - 3.5).abs() < 1e-4);
        assert!(totals.windows(2).all(|pair| pair[1] > pair[0] + 0.99), "evidence grows with every observation");
        for turn in 1..=3 {
            belief = Classical.observe(&belief, &miss);
            assert!((log_odds(belief.occupancy[0]) - (3.5 - 0.85 * turn as f32)).abs() < 1e-4);
        }
    }

    proptest! {
        #[test]
        fn evidence_and_log_odds_are_inverse(l in -3.5_f32..3.5, total in 2.0_f32..100.0) {
            let parameters = evidence(l, total);
            prop_assert!((log_odds(parameters) - l).abs() < 1e-4);
            prop_assert!((parameters[0] + parameters[1] - total).abs() < 1e-4 * total);
            prop_assert!((beta_mean(parameters) - 1.0 / (1.0 + (-l).exp())).abs() < 1e-5);
        }

        #[test]
        fn no_sequence_of_observations_leaves_negative_evidence(hits in proptest::collection::vec(any::<bool>(), 1..60)) {
            let (up, down, limit) = (LOG_ODDS_STEP.exp(), (-LOG_ODDS_STEP).exp(), LOG_ODDS_LIMIT.exp());
            let mut voxel = [1.0, 1.0];
            let mut l = 0.0_f32;
            for hit in hits {
                voxel = shifted(voxel, if hit { up } else { down }, limit);
                l = (l + if hit { LOG_ODDS_STEP } else { -LOG_ODDS_STEP }).clamp(-LOG_ODDS_LIMIT, LOG_ODDS_LIMIT);
                prop_assert!((log_odds(voxel) - l).abs() < 1e-3, "{} {}", log_odds(voxel), l);
                prop_assert!(voxel[0] > 0.9999 && voxel[1] > 0.9999);
            }
        }
    }
}
