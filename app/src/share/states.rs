//! What was believed after the steps, and what was true, as bytes: of every kept step what changed since the one before.
//!
//! A state has four arrays, each as [`runs`](super::pack::runs) of what changed, the first since an array of zeros:
//! * per voxel `[x][y][z]` the mean probability of being occupied, 255 for 1, rounded down; 0 below [`LOWEST`];
//! * per floor cell `[x][y]` the likeliest class and one, 0 where nothing is known;
//! * per floor cell its probability, 255 for 1;
//! * per floor cell the entropy of its column and class, 255 for the most that there can be.
//!
//! A truth has four likewise: per voxel whether it is occupied; per floor cell the class and one; and the object and one, the
//! low byte and the high byte, 0 where none stands.

use super::pack::{deflated, runs};
use crate::picture::{believed_class, cell_entropy, entropy_range};
use nudge_core::belief::{Belief, beta_mean};
use nudge_core::episode::{EpisodeDir, EpisodeRecord};
use nudge_core::{Error, Result};

/// Voxels that are less probable are never drawn.
pub const LOWEST: f32 = 0.3;

/// The numbers of actions whose states are kept: every so manyth, and the last.
pub fn kept(steps: usize, every: usize) -> Vec<usize> {
    (0..=steps).filter(|step| step % every.max(1) == 0 || *step == steps).collect()
}

fn byte(share: f32) -> u8 {
    (share.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn arrays(belief: &Belief) -> [Vec<u8>; 4] {
    let cells = 0..belief.grid.cell_count();
    let [low, high] = entropy_range(&belief.grid);
    // Rounded down: a voxel of which nothing is known is not more probable than 0.5.
    let below = |p: f32| (p.clamp(0.0, 1.0) * 255.0) as u8;
    let probability = |a: &[f32; 2]| Some(beta_mean(*a)).filter(|p| *p >= LOWEST).map_or(0, below);
    [
        belief.occupancy.iter().map(probability).collect(),
        cells.clone().map(|cell| believed_class(belief, cell).map_or(0, |class| class.0 + 1)).collect(),
        cells.map(|cell| byte(belief.likeliest(cell).1)).collect(),
        cell_entropy(belief).into_iter().map(|nats| byte((nats - low) / (high - low))).collect(),
    ]
}

fn append(before: &mut [Vec<u8>; 4], now: [Vec<u8>; 4], into: &mut Vec<u8>) {
    for (before, now) in before.iter_mut().zip(now) {
        before.resize(now.len(), 0);
        runs(before, &now, into);
        *before = now;
    }
}

/// The states after the given numbers of actions.
pub fn pack(directory: &EpisodeDir, kept: &[usize], watch: super::Watch<'_>) -> Result<Vec<u8>> {
    let (mut before, mut bytes) = (Default::default(), Vec::new());
    for (at, step) in kept.iter().enumerate() {
        if !watch(at as f32 / kept.len() as f32) {
            return Err(Error::Usage("the page was not written: cancelled".to_owned()));
        }
        append(&mut before, arrays(&directory.read_belief(*step)?), &mut bytes);
    }
    Ok(deflated(&bytes))
}

/// The truths of an episode, in the order of [`EpisodeRecord::truth_indices`].
pub fn pack_truths(directory: &EpisodeDir, record: &EpisodeRecord) -> Result<Vec<u8>> {
    let (mut before, mut bytes) = (Default::default(), Vec::new());
    for step in record.truth_indices() {
        let truth = directory.read_truth(step)?.into_map(|| None);
        let object = |id: &u16| id.wrapping_add(1).to_le_bytes();
        let now = [
            truth.occupancy,
            truth.labels.iter().map(|label| label + 1).collect(),
            truth.objects.iter().map(|id| object(id)[0]).collect(),
            truth.objects.iter().map(|id| object(id)[1]).collect(),
        ];
        append(&mut before, now, &mut bytes);
    }
    Ok(deflated(&bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::grid::Grid;

    #[test]
    fn the_first_and_the_last_state_are_always_kept() {
        assert_eq!(kept(3, 1), [0, 1, 2, 3]);
        assert_eq!(kept(7, 3), [0, 3, 6, 7]);
        assert_eq!(kept(0, 5), [0]);
    }

    #[test]
    fn a_state_tells_what_is_believed_in_bytes() {
        let mut belief = Belief::uniform(Grid::for_shelf([0.02, 0.02, 0.02], 0.01));
        belief.occupancy[3] = [9.0, 1.0];
        belief.occupancy[4] = [1.0, 9.0];
        belief.semantics[1][4] = 16.0;
        let [occupancy, class, certainty, entropy] = arrays(&belief);
        assert_eq!(occupancy[2..5], [127, 229, 0], "unknown, likely, unlikely");
        assert_eq!(class, [0, 5, 0, 0]);
        assert_eq!(certainty[..2], [17, 136]);
        assert!((entropy[0], entropy[3]) == (255, 255) && entropy[1] < entropy[2] && entropy[2] < 255, "{entropy:?}");
    }
}
