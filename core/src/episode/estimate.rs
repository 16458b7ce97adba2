//! What an episode believes and what it has seen, moved on by what its camera and its arm tell.
//!
//! Both a running episode and [`infer`](super::infer()) go through here, so that a belief can be had again from what is filed.

use super::record::EpisodeRecord;
use crate::Result;
use crate::belief::{Belief, BeliefUpdate, Prediction, Sightings, look};
use crate::camera::{Frame, MapObservation, NoiseModel, Sensed, View};
use crate::grid::Grid;
use crate::skill::SweptManipulation;
use std::sync::Arc;

/// What a belief update was told: all that it takes to have the belief again.
#[derive(Clone, Debug)]
pub enum Told {
    /// After a look what the environment gave, with the pose where the camera was thought to be; noise is not in its pixels.
    Frame(Sensed),
    /// After a manipulation as far as it came what the arm swept.
    Manipulation(SweptManipulation),
}

/// Belief and sightings. Cheap to clone.
#[derive(Clone)]
pub(super) struct Estimate {
    pub(super) belief: Arc<Belief>,
    /// What looks have seen and no push may have changed since.
    pub(super) sightings: Arc<Sightings>,
}

impl Estimate {
    /// The uniform belief; nothing is seen.
    pub(super) fn uniform(grid: &Grid) -> Self {
        Self { belief: Arc::new(Belief::uniform(*grid)), sightings: Arc::new(Sightings::none(grid)) }
    }

    /// After a look.
    pub(super) fn look(&mut self, update: &dyn BeliefUpdate, observation: &MapObservation) {
        let sightings = Arc::make_mut(&mut self.sightings);
        self.belief = Arc::new(look(update, &self.belief, observation, sightings));
    }

    /// After a manipulation that is predicted into the belief, or one after which the belief stays and everything is unseen.
    pub(super) fn manipulate(
        &mut self,
        update: &dyn BeliefUpdate,
        swept: &SweptManipulation,
        is_predicted: bool,
    ) -> Option<Prediction> {
        let predict = || update.predict(&self.belief, &[swept.intervention(&self.belief)]).pop();
        let prediction = is_predicted.then(predict).flatten();
        match &prediction {
            Some(prediction) => {
                Arc::make_mut(&mut self.belief).apply(prediction);
                Arc::make_mut(&mut self.sightings).forget_changed(prediction);
            }
            None => self.sightings = Arc::new(Sightings::none(&self.belief.grid)),
        }
        prediction
    }
}

/// A frame with the noise of the next step, the same for whoever asks: the oracle sees the very frame that a look would give.
pub(super) fn sense(
    record: &EpisodeRecord,
    view: &View,
    shoot: impl FnOnce(&View) -> Result<Sensed>,
) -> Result<(Sensed, Frame)> {
    let noise = record.config.noise.unwrap_or(NoiseModel::OFF);
    let (seed, step) = (record.config.seed, record.steps.len() as u64 + 1);
    let sensed = noise.aim(view, seed, step, shoot)?;
    let frame = noise.apply(&sensed, seed, step);
    Ok((sensed, frame))
}
