//! An episode as its files hold it, read in about a second: what the window shows until its actions are repeated.

use super::half_belief::HalfBelief;
use super::packed_frame::PackedFrame;
use super::session::{Moment, Setup};
use super::worker::told::Opened;
use nudge_core::Result;
use nudge_core::arm::{Arm, ArmTool};
use nudge_core::camera::NoiseModel;
use nudge_core::episode::{EpisodeDir, EpisodeRecord, StepOutcome, StepRecord, Told};
use nudge_core::grid::VoxelSet;
use nudge_core::plan::Action;
use nudge_core::scene::Catalog;
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// Reads the beliefs, the truth and the camera's images of an episode. What only repeating its actions tells is not there:
/// what looks have seen, where objects stand after the first push, what pushes were predicted to do.
///
/// # Errors
/// For a directory that holds no episode, or a damaged one.
pub fn open(path: &Path, catalog: Arc<Catalog>) -> Result<Opened> {
    let directory = EpisodeDir::open(path)?;
    let record = directory.record()?;
    let beliefs: Result<Vec<HalfBelief>> = (0..=record.steps.len())
        .into_par_iter()
        .map(|step| directory.read_belief(step).map(|belief| HalfBelief::of(&belief)))
        .collect();
    let grid = record.scene.grid();
    let unseen = Arc::new(VoxelSet::empty(&grid));
    let mut truth = None;
    let mut bodies = Arc::new(if record.has_truth() { record.scene.bodies(&catalog)? } else { Vec::new() });
    let mut moments = Vec::with_capacity(record.steps.len() + 1);
    for (step, belief) in beliefs?.into_iter().enumerate() {
        let done = step.checked_sub(1).map(|at| &record.steps[at]);
        if record.has_new_truth(step) {
            truth = Some(Arc::new(directory.read_truth(step)?.into_map(|| None)));
        }
        if done.is_some_and(|done| matches!(done.action, Action::Manipulate(_))) {
            // Where a push leaves things is told by the simulation alone.
            bodies = Arc::default();
        }
        moments.push(Arc::new(Moment {
            step,
            belief,
            seen: unseen.clone(),
            truth: truth.clone(),
            bodies: bodies.clone(),
            scores: record.scores_after(step).copied(),
            entropy_nats: record.entropy_after(step),
            outcome: done.map(|done| Arc::new(StepOutcome::of_log(done.clone()))),
            frame: done.and_then(|done| frame(&directory, &record, done)),
            is_whole: false,
        }));
    }
    let setup = setup(&record, catalog)?;
    Ok(Opened { path: path.to_owned(), record, setup, moments, read_only: None })
}

fn setup(record: &EpisodeRecord, catalog: Arc<Catalog>) -> Result<Setup> {
    let views = record.view_array()?;
    let arm = ArmTool::new(Arm::placed(&record.scene.robot)?, record.scene.shelf);
    // A recording's views were taken: whoever carried the camera.
    let unreachable =
        if record.recorded_views.is_some() { Vec::new() } else { views.unreachable(&views.hand_poses(&arm)) };
    Ok(Setup {
        catalog,
        views: Arc::new(views),
        update: None,
        arm: Arc::new(arm),
        unreachable: Arc::new(unreachable),
        hidden: None,
    })
}

/// The image of a look with its noise, if it is filed.
fn frame(directory: &EpisodeDir, record: &EpisodeRecord, step: &StepRecord) -> Option<PackedFrame> {
    if !matches!(step.action, Action::Look { .. }) {
        return None;
    }
    let Ok(Told::Frame(sensed)) = directory.read_told(step) else { return None };
    let noise = record.config.noise.unwrap_or(NoiseModel::OFF);
    Some(PackedFrame::of(&noise.apply(&sensed, record.config.seed, step.index as u64)))
}
