//! How well a belief predicts what manipulations do.

use crate::arm::PhasedMotion;
use crate::belief::{Belief, FloorPlan, Intervention, Prediction, SOLID, beta_mean};
use crate::episode::Episode;
use crate::grid::VoxelSet;
use crate::skill::{Manipulation, PushTruth};

/// Predictions that are held in memory at once.
const AT_ONCE: usize = 8;

/// For each manipulation, the cross-entropy of what is occupied after it, summed over all voxels, nats: by the episode's
/// prediction, and by its belief as it is.
pub(super) fn nats(
    episode: &Episode,
    manipulations: &[Manipulation],
    motions: &[PhasedMotion],
    truths: &[PushTruth],
) -> Vec<[f64; 2]> {
    let (belief, arm) = (episode.belief(), &episode.arm().arm);
    let solid = FloorPlan::new(belief, SOLID);
    let told = |(manipulation, motion): (&Manipulation, &PhasedMotion)| {
        manipulation.skill().intervention(belief, &solid, motion.swept_volume(arm, &belief.grid))
    };
    let interventions: Vec<Intervention> = manipulations.iter().zip(motions).map(told).collect();
    let of_some = |(interventions, truths): (&[Intervention], &[PushTruth])| -> Vec<[f64; 2]> {
        let predictions = episode.update().predict(belief, interventions);
        let of = |(prediction, truth): (Prediction, &PushTruth)| {
            let mut after = belief.clone();
            after.apply(&prediction);
            [&after, belief].map(|belief| cross_entropy(belief, &truth.occupied))
        };
        predictions.into_iter().zip(truths).map(of).collect()
    };
    interventions.chunks(AT_ONCE).zip(truths.chunks(AT_ONCE)).flat_map(of_some).collect()
}

/// `-sum log p(voxel as it is)`, nats.
fn cross_entropy(belief: &Belief, occupied: &VoxelSet) -> f64 {
    let of = |(voxel, alpha): (usize, &[f32; 2])| {
        let p = f64::from(beta_mean(*alpha));
        -(if occupied.contains(voxel) { p } else { 1.0 - p }).max(f64::MIN_POSITIVE).ln()
    };
    belief.occupancy.iter().enumerate().map(of).sum()
}
