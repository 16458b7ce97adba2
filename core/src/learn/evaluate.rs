//! Scores of a belief update on held-out scenes, against the number of views.

use super::{Dataset, MapSample, PushSample, PushedSample, VIEWS, VIEWS_AFTER, ViewSample};
use crate::Result;
use crate::belief::{Belief, BeliefUpdate, Prediction, Sightings, look};
use crate::grid::{Grid, VoxelSet};
use crate::score::Tally;
use crate::world::TruthMap;

/// Counts after one to [`VIEWS`] views over a set of map samples: entry `v - 1` is after `v` views.
///
/// `progress` is called with the number of samples that are done.
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
        let (mut belief, mut sightings) = (Belief::uniform(grid), Sightings::none(&grid));
        for (tally, view) in tallies.iter_mut().zip(&sample.views) {
            belief = look(update, &belief, &view.observation, &mut sightings);
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
/// `progress` is called with the number of samples that are done.
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
    for_each_push(data, observe, predict, progress, &mut |sample, belief, pushed, prediction| {
        let truth = truth_map(&grid, &pushed.truth, &pushed.labels);
        let changed = sample.changed_by(pushed);
        tallies.unchanged.merge(&Tally::of_cells(belief, &truth, &changed));
        let mut after = belief.clone();
        after.apply(prediction);
        tallies.predicted.merge(&Tally::of_cells(&after, &truth, &changed));
    })?;
    Ok(tallies)
}

/// Calls `each` with every push of the samples: the sample, the belief after its views, the push, and its prediction.
fn for_each_push(
    data: &Dataset<PushSample>,
    observe: &dyn BeliefUpdate,
    predict: &dyn BeliefUpdate,
    progress: &mut dyn FnMut(usize),
    each: &mut dyn FnMut(&PushSample, &Belief, &PushedSample, &Prediction),
) -> Result<()> {
    for at in 0..data.len() {
        let sample = data.get(at)?;
        let (belief, _) = after_views(observe, &data.grid(), &sample.views);
        let interventions = sample.interventions(&belief);
        for (pushed, prediction) in sample.pushes.iter().zip(predict.predict(&belief, &interventions)) {
            each(&sample, &belief, pushed, &prediction);
        }
        progress(at + 1);
    }
    Ok(())
}

/// What the log-odds of the predicted probabilities of change have to be divided by so that they fit best to what happened
/// (least negative log-likelihood; temperature scaling, Guo et al., "On calibration of modern neural networks", 2017), over
/// all floor cells that a prediction holds possible to change.
///
/// `progress` is told how many samples are done.
///
/// # Errors
/// When a sample cannot be read.
pub fn fit_change_temperature(
    data: &Dataset<PushSample>,
    update: &dyn BeliefUpdate,
    progress: &mut dyn FnMut(usize),
) -> Result<f64> {
    let grid = data.grid();
    let mut outcomes = Vec::new();
    for_each_push(data, update, update, progress, &mut |sample, _, pushed, prediction| {
        let changed = sample.changed_by(pushed);
        let cells = prediction.window.cells(&grid).zip(&prediction.change).filter(|(_, p)| **p > 0.0);
        outcomes.extend(cells.map(|(cell, p)| (log_odds(f64::from(*p)), changed[cell])));
    })?;
    Ok(best_temperature(&outcomes))
}

fn log_odds(p: f64) -> f64 {
    let p = p.clamp(1e-6, 1.0 - 1e-6);
    (p / (1.0 - p)).ln()
}

/// The temperature between 0.2 and 5 under which log-odds fit best to whether something happened.
fn best_temperature(outcomes: &[(f64, bool)]) -> f64 {
    // -ln P(outcome) = ln(1 + e^-z) where it happened, ln(1 + e^z) where it did not.
    let loss = |log_t: f64| -> f64 {
        let scale = (-log_t).exp();
        outcomes
            .iter()
            .map(|(z, happened)| if *happened { -z * scale } else { z * scale })
            .map(|z| z.exp().ln_1p())
            .sum()
    };
    // In 1 / T the loss is convex, so over ln T it has one minimum: golden-section search.
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (0.2_f64.ln(), 5.0_f64.ln());
    while high - low > 1e-3 {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        if loss(left) < loss(right) {
            high = right;
        } else {
            low = left;
        }
    }
    (0.5 * (low + high)).exp()
}

/// Counts on the whole map after the first push of every sample: entry `v` is of the belief that was predicted, updated with
/// `v` views of what the push left.
///
/// `progress` is called with the number of samples that are done.
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
        let (mut belief, mut sightings) = after_views(update, &grid, &sample.views);
        for prediction in update.predict(&belief, &sample.interventions(&belief)[..1]) {
            belief.apply(&prediction);
            sightings.forget_changed(&prediction);
        }
        tallies[0].merge(&Tally::of(&belief, &truth));
        for (tally, view) in tallies[1..].iter_mut().zip(&sample.after) {
            belief = look(update, &belief, &view.observation, &mut sightings);
            tally.merge(&Tally::of(&belief, &truth));
        }
        progress(at + 1);
    }
    Ok(tallies)
}

/// The belief after some views, from the uniform one, and what they have seen.
pub(super) fn after_views(update: &dyn BeliefUpdate, grid: &Grid, views: &[ViewSample]) -> (Belief, Sightings) {
    let begin = (Belief::uniform(*grid), Sightings::none(grid));
    views.iter().fold(begin, |(belief, mut sightings), view| {
        (look(update, &belief, &view.observation, &mut sightings), sightings)
    })
}

/// A truth without objects' numbers.
fn truth_map(grid: &Grid, occupied: &VoxelSet, labels: &[u8]) -> TruthMap {
    let mut occupancy = vec![0; grid.voxel_count()];
    occupied.iter().for_each(|voxel| occupancy[voxel] = 1);
    TruthMap { dims: grid.dims, occupancy, labels: labels.to_vec(), objects: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::{best_temperature, log_odds};

    #[test]
    fn a_temperature_that_is_known_is_found() {
        for temperature in [0.6, 1.0, 1.7] {
            // Of 1,000 cells told at log-odds z, as many change as T says.
            let cells = (-30..=30).map(|z| 0.1 * f64::from(z)).flat_map(|z: f64| {
                let changed = (1000.0 / (1.0 + (-z / temperature).exp())).round() as usize;
                (0..1000).map(move |number| (z, number < changed))
            });
            let found = best_temperature(&cells.collect::<Vec<_>>());
            assert!((found - temperature).abs() < 0.02 * temperature, "{found} is not {temperature}");
        }
        assert!((log_odds(0.9) - 9.0_f64.ln()).abs() < 1e-9);
    }
}
