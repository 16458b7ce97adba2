//! Inferring an episode's beliefs again from its filed frames, without simulating anything.

use super::directory::EpisodeDir;
use super::estimate::{Estimate, Told};
use super::record::EpisodeRecord;
use super::replay::{Comparison, ReplayReport, tolerance};
use crate::Result;
use crate::belief::BeliefUpdate;
use crate::camera::{NoiseModel, project};
use crate::score::Scores;
use std::sync::Arc;

/// Has the beliefs of an episode again from what its updates were told (`frames/`), and compares them with those that are
/// filed, and their scores with the log's where the truth is filed. Nothing is decided or simulated, so that it works for every
/// episode with frames, whatever its environment was. `progress` is called with the number of steps done and of those in the
/// log.
///
/// # Errors
/// Those of reading the directory: [`Error::Input`](crate::Error::Input) for an episode without frames. A difference is not an
/// error here but in [`ReplayReport::verdict`].
pub fn infer(
    directory: &EpisodeDir,
    update: Arc<dyn BeliefUpdate>,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<ReplayReport> {
    let logged = directory.record()?;
    directory.check_frames(&logged)?;
    let mut comparison = Comparison::new(tolerance(&logged));
    let mut estimate = Estimate::uniform(&logged.scene.grid());
    compare(&mut comparison, directory, &logged, 0, &estimate)?;
    progress(0, logged.steps.len());
    for step in &logged.steps {
        move_on(&mut estimate, &*update, directory, &logged, step.index)?;
        update.fault().map_or(Ok(()), Err)?;
        compare(&mut comparison, directory, &logged, step.index, &estimate)?;
        progress(step.index, logged.steps.len());
    }
    Ok(comparison.report(&logged))
}

/// Tells the estimate what is filed of a step.
fn move_on(
    estimate: &mut Estimate,
    update: &dyn BeliefUpdate,
    directory: &EpisodeDir,
    logged: &EpisodeRecord,
    index: usize,
) -> Result<()> {
    let (config, step) = (&logged.config, &logged.steps[index - 1]);
    match directory.read_told(step)? {
        Told::Frame(sensed) => {
            let noise = config.noise.unwrap_or(NoiseModel::OFF);
            let frame = noise.apply(&sensed, config.seed, index as u64);
            estimate.look(update, &project(&frame, &logged.scene.shelf));
        }
        Told::Manipulation(swept) => {
            drop(estimate.manipulate(update, &swept, config.is_predicted(step.decision.reason)))
        }
    }
    Ok(())
}

fn compare(
    comparison: &mut Comparison,
    directory: &EpisodeDir,
    logged: &EpisodeRecord,
    actions: usize,
    estimate: &Estimate,
) -> Result<()> {
    comparison.at(actions);
    comparison.belief(directory, actions, &estimate.belief)?;
    if let Some(scores) = logged.scores_after(actions) {
        let truth = directory.read_truth(actions)?.into_map(|| None);
        comparison.documents("scores", scores, &Scores::of(&estimate.belief, &truth));
    }
    Ok(())
}

#[cfg(test)]
#[path = "infer_tests.rs"]
mod tests;
