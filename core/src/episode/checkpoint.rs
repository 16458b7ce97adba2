//! `checkpoints/NNN.state`: all that it takes to go on after `NNN` actions without repeating them.
//!
//! The first line is JSON: where every body stands. Behind it are, compressed (Zstandard), the belief's evidence as float32
//! (beliefs in `beliefs/` are rounded) and what has been seen. Only the newest is kept. What the files of an episode tell
//! anyway (the scene, the decisions, the history of actions, the arm's pushes) is not in it.

use super::estimate::Estimate;
use super::machine::Episode;
use super::record::EpisodeRecord;
use super::told_file::voxel_set;
use crate::arm::HandPose;
use crate::belief::{Belief, Sightings};
use crate::environment::Environment;
use crate::files::{split_head, with_head};
use crate::grid::Grid;
use crate::plan::{Action, History};
use crate::world::Standing;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The format number of checkpoints.
const FORMAT: u32 = 1;
/// Beliefs are written after every action: fast rather than small.
const LEVEL: i32 = 1;

#[derive(Serialize, Deserialize)]
struct Head {
    format: u32,
    dims: [usize; 3],
    standing: Vec<Standing>,
}

/// The state of a simulated episode that its log does not tell.
pub(super) struct Checkpoint {
    estimate: Estimate,
    standing: Vec<Standing>,
}

impl Checkpoint {
    /// The state now; `None` of an episode that is not simulated, which cannot be put back to where it was.
    pub(super) fn of(episode: &Episode) -> Option<Self> {
        Some(Self { estimate: episode.estimate().clone(), standing: episode.simulated()?.standing() })
    }

    /// The file's bytes.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let Estimate { belief, sightings } = &self.estimate;
        let head = Head { format: FORMAT, dims: belief.grid.dims, standing: self.standing.clone() };
        let evidence = || belief.occupancy.as_flattened().iter().chain(belief.semantics.as_flattened());
        let mut content = Vec::with_capacity(5 * evidence().count());
        // Bytes of equal weight together: the compressor finds more.
        for byte in 0..4 {
            content.extend(evidence().map(|value| value.to_le_bytes()[byte]));
        }
        content.extend(sightings.seen().words().iter().flat_map(|word| word.to_le_bytes()));
        content.extend(sightings.taken());
        with_head(&head, &content, LEVEL)
    }

    /// Reads a file's bytes; `None` for those that are no whole checkpoint of an episode over this grid.
    pub(super) fn from_bytes(bytes: &[u8], grid: &Grid) -> Option<Self> {
        let (head, content) = split_head(bytes)?;
        let head: Head = serde_json::from_slice(head).ok()?;
        if head.format != FORMAT || head.dims != grid.dims {
            return None;
        }
        let mut belief = Belief::uniform(*grid);
        let numbers = belief.occupancy.as_flattened().len() + belief.semantics.as_flattened().len();
        let words = 8 * grid.voxel_count().div_ceil(64);
        let content = zstd::bulk::decompress(content, 4 * numbers + words + grid.cell_count()).ok()?;
        let (evidence, seen) = content.split_at_checked(4 * numbers)?;
        let (seen, taken) = seen.split_at_checked(words)?;
        let number = |at: usize| f32::from_le_bytes([0, 1, 2, 3].map(|byte| evidence[byte * numbers + at]));
        let both = belief.occupancy.as_flattened_mut().iter_mut().chain(belief.semantics.as_flattened_mut());
        both.enumerate().for_each(|(at, value)| *value = number(at));
        let sightings = Sightings::from_parts(grid, voxel_set(grid, seen)?, taken.to_vec())?;
        let estimate = Estimate { belief: Arc::new(belief), sightings: Arc::new(sightings) };
        Some(Self { estimate, standing: head.standing })
    }
}

impl Episode {
    /// Goes to the state after the last step of a log. The episode must be a simulated one that was just set up.
    ///
    /// # Errors
    /// In words, where the checkpoint cannot be of this log.
    pub(super) fn go_to(&mut self, checkpoint: Checkpoint, logged: EpisodeRecord) -> Result<(), String> {
        let shelf = self.simulated().ok_or("nothing is simulated")?;
        let pushes = logged.steps.iter().filter(|step| matches!(step.action, Action::Manipulate(_)));
        let motions: Option<Vec<_>> = pushes.map(|step| step.decision.motion.clone()).collect();
        let motions = motions.ok_or("the log does not tell how the arm pushed")?;
        let shelf = shelf.resumed(self.arm().clone(), motions, checkpoint.standing)?;
        let environment: Box<dyn Environment> = Box::new(shelf);
        let mut history = History::default();
        let mut hand = self.arm().ready.map(HandPose::waiting);
        for step in &logged.steps {
            history.record(&step.decision, !step.dropped().is_empty(), step.grip());
            let to = match step.action {
                Action::Look { view } => self.hand_poses().get(usize::from(view.0)).cloned().flatten(),
                Action::Manipulate(_) => self.arm().ready.map(HandPose::waiting),
            };
            hand = if hand.is_some() { to.or(hand) } else { None };
        }
        self.adopt(environment, checkpoint.estimate, history, hand, logged);
        Ok(())
    }
}

#[cfg(test)]
#[path = "checkpoint_tests.rs"]
mod tests;
