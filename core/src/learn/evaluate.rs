//! How well a belief update does on held-out scenes, against the number of views.

use super::{Dataset, MapSample, PushSample, VIEWS, VIEWS_AFTER, ViewSample};
use crate::Result;
use crate::belief::{Belief, BeliefUpdate};
use crate::grid::{Grid, VoxelSet};
use crate::score::Tally;
use crate::world::TruthMap;

/// Counts after one to [`VIEWS`] views over a set of map samples: entry `v - 1` is after `v` views.
///
/// `progress` is told how many samples are done.
///
/// # Errors
/// When a sample cannot be read.
pub fn evaluate(
    data: &Dataset<MapSample>,
    update: &dyn BeliefUpdate,
    progress: &mut dyn FnMut(usize),
) -> Result<Vec<Tally>> {
    let grid = data.grid();
    let mut tallies = vec![Tally::default(); VIEWS];
    for at in 0..data.len() {
        let sample = data.get(at)?;
        let truth = truth_map(&grid, &sample.truth, &sample.labels);
        let mut belief = Belief::uniform(grid);
        for (tally, view) in tallies.iter_mut().zip(&sample.views) {
            belief = update.observe(&belief, &view.observation);
            tally.merge(&Tally::of(&belief, &truth));
        }
        progress(at + 1);
    }
    Ok(tallies)
}

/// Counts on the floor cells that pushes really change, of beliefs before and after them.
#[derive(Clone, Debug, Default)]
pub struct PushTallies {
    /// Of the belief before the push, as if nothing had changed.
    pub unchanged: Tally,
    /// Of the belief that was predicted.
    pub predicted: Tally,
}

/// How well pushes are predicted, over a set of push samples: the belief after a sample's views against the truth after
/// each of its pushes, on the floor cells that the push changes. `observe` makes the beliefs and `predict` the predictions.
///
/// `progress` is told how many samples are done.
///
/// # Errors
/// When a sample cannot be read.
pub fn evaluate_pushes(
    data: &Dataset<PushSample>,
    observe: &dyn BeliefUpdate,
    predict: &dyn BeliefUpdate,
    progress: &mut dyn FnMut(usize),
) -> Result<PushTallies> {
    let grid = data.grid();
    let mut tallies = PushTallies::default();
    for at in 0..data.len() {
        let sample = data.get(at)?;
        let prior = Belief::uniform(grid);
        let belief = sample.views.iter().fold(prior, |belief, view| observe.observe(&belief, &view.observation));
        let pushes: Vec<_> = sample.pushes.iter().map(|pushed| pushed.push.clone()).collect();
        for (pushed, prediction) in sample.pushes.iter().zip(predict.predict_pushes(&belief, &pushes)) {
            let truth = truth_map(&grid, &pushed.truth, &pushed.labels);
            let changed = sample.changed_by(pushed);
            tallies.unchanged.merge(&Tally::of_cells(&belief, &truth, &changed));
            let mut after = belief.clone();
            after.apply(&prediction);
            tallies.predicted.merge(&Tally::of_cells(&after, &truth, &changed));
        }
        progress(at + 1);
    }
    Ok(tallies)
}

/// Counts on the whole map after the first push of every sample: entry `v` is of the belief that was predicted, updated with
/// `v` views of what the push left.
///
/// `progress` is told how many samples are done.
///
/// # Errors
/// When a sample cannot be read.
pub fn evaluate_after_pushes(
    data: &Dataset<PushSample>,
    update: &dyn BeliefUpdate,
    progress: &mut dyn FnMut(usize),
) -> Result<Vec<Tally>> {
    let grid = data.grid();
    let mut tallies = vec![Tally::default(); VIEWS_AFTER + 1];
    for at in 0..data.len() {
        let sample = data.get(at)?;
        let Some(pushed) = sample.pushes.first() else { continue };
        let truth = truth_map(&grid, &pushed.truth, &pushed.labels);
        let look = |belief: Belief, view: &ViewSample| update.observe(&belief, &view.observation);
        let mut belief = sample.views.iter().fold(Belief::uniform(grid), look);
        for prediction in update.predict_pushes(&belief, std::slice::from_ref(&pushed.push)) {
            belief.apply(&prediction);
        }
        tallies[0].merge(&Tally::of(&belief, &truth));
        for (tally, view) in tallies[1..].iter_mut().zip(&sample.after) {
            belief = look(belief, view);
            tally.merge(&Tally::of(&belief, &truth));
        }
        progress(at + 1);
    }
    Ok(tallies)
}

/// A truth without objects' numbers.
fn truth_map(grid: &Grid, occupied: &VoxelSet, labels: &[u8]) -> TruthMap {
    let mut occupancy = vec![0; grid.voxel_count()];
    occupied.iter().for_each(|voxel| occupancy[voxel] = 1);
    TruthMap { dims: grid.dims, occupancy, labels: labels.to_vec(), objects: Vec::new() }
}
