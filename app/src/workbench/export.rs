//! An annotated episode as files for others: its directory, one self-contained recording, tables, pictures.
//!
//! Everything is made from a [`Session`] as it is now and touches no other file; it takes seconds, so a window calls it
//! on a thread of its own. What is written is there whole or not at all.

mod tables;
#[cfg(test)]
mod tests;

pub use tables::{decisions_csv, scores_csv, verdicts_csv, write_tables};

use super::session::{Moment, Session};
use crate::driver::{RECORDING, SUMMARY};
use crate::figure;
use crate::picture;
use crate::record::{self, Recorder, Setting, State};
use image::{ImageBuffer, Pixel, PixelWithColorType};
use nudge_core::belief::Belief;
use nudge_core::episode::{EpisodeDir, EpisodeRecord};
use nudge_core::files::{names_in, target_of, temporary_of, write_atomically};
use nudge_core::{Error, Result};
use std::fs;
use std::path::{Path, PathBuf};

/// Is told the share that is done, 0 to 1, and answers whether to go on.
pub type Watch<'a> = &'a dyn Fn(f32) -> bool;

/// Writes the episode with its notes and verdicts into a directory that is new or empty: `episode.json`, `beliefs/`,
/// `truth/`, `notes.json`, `summary.png` and `episode.rrd`.
///
/// # Errors
/// For a directory that holds anything, what the system refuses, and when `watch` says to stop; nothing is left then.
pub fn write_episode(session: &Session, into: &Path, watch: Watch<'_>) -> Result<()> {
    if into.exists() && (!into.is_dir() || !names_in(into)?.is_empty()) {
        return Err(Error::input(into, "", "is not empty: choose a new or an empty directory"));
    }
    let beside = beside(into)?;
    if beside.is_dir() {
        // Left by a run that was killed.
        fs::remove_dir_all(&beside).map_err(|error| Error::io(&beside, error))?;
    }
    let record = record_of(session);
    let states = session.moments.iter().map(|moment| (moment.belief.belief(), moment.truth.as_deref()));
    let written = EpisodeDir::store(&beside, &record, states).and_then(|directory| {
        // The directory's lock has to go before the directory moves.
        drop(directory);
        session.annotations.write(&beside)?;
        picture::save(&summary(session, &record)?, &beside.join(SUMMARY))?;
        record_into(session, &record, &beside.join(RECORDING), watch)?;
        if into.exists() {
            fs::remove_dir(into).map_err(|error| Error::io(into, error))?;
        }
        fs::rename(&beside, into).map_err(|error| Error::io(into, error))
    });
    if written.is_err() {
        let _ = fs::remove_dir_all(&beside);
    }
    written
}

/// Writes the episode as one recording with its layout, notes and verdicts inside; a file of that name is replaced.
///
/// # Errors
/// What the system refuses, and when `watch` says to stop.
pub fn write_recording(session: &Session, path: &Path, watch: Watch<'_>) -> Result<()> {
    let path = &target_of(path)?;
    let beside = beside(path)?;
    let written = record_into(session, &record_of(session), &beside, watch)
        .and_then(|()| fs::rename(&beside, path).map_err(|error| Error::io(path, error)));
    if written.is_err() {
        let _ = fs::remove_file(&beside);
    }
    written
}

/// Writes a picture as PNG, every pixel as a square of `scale` pixels.
///
/// # Errors
/// What the system refuses.
pub fn write_picture<P>(picture: &ImageBuffer<P, Vec<u8>>, scale: u32, path: &Path) -> Result<()>
where
    P: Pixel<Subpixel = u8> + PixelWithColorType,
{
    let scaled = enlarged(picture, scale);
    let mut bytes = std::io::Cursor::new(Vec::new());
    let encoded = scaled.write_to(&mut bytes, image::ImageFormat::Png);
    encoded.map_err(|error| Error::io(path, std::io::Error::other(error.to_string())))?;
    write_atomically(path, bytes.get_ref())
}

/// A picture with every pixel as a square of `scale` pixels.
pub fn enlarged<P: Pixel<Subpixel = u8>>(picture: &ImageBuffer<P, Vec<u8>>, scale: u32) -> ImageBuffer<P, Vec<u8>> {
    let scale = scale.max(1);
    ImageBuffer::from_fn(picture.width() * scale, picture.height() * scale, |x, y| {
        *picture.get_pixel(x / scale, y / scale)
    })
}

/// A name beside `path` for what is not whole yet.
fn beside(path: &Path) -> Result<PathBuf> {
    path.file_name().ok_or_else(|| Error::input(path, "", "names no file"))?;
    if let Some(parent) = path.parent().filter(|parent| *parent != Path::new("")) {
        fs::create_dir_all(parent).map_err(|error| Error::io(parent, error))?;
    }
    Ok(temporary_of(path))
}

/// `episode.json` as far as the session has come.
fn record_of(session: &Session) -> EpisodeRecord {
    let mut record = session.record.clone();
    if record.steps.len() != session.steps() {
        let outcomes = session.moments.iter().filter_map(|moment| moment.outcome.as_ref());
        record.steps = outcomes.map(|outcome| outcome.record.clone()).collect();
    }
    // Who would have gone on with it but has not is no maker of it.
    let last = record.steps.len();
    record.also_made_by.retain(|later| later.from_step <= last);
    record
}

fn record_into(session: &Session, record: &EpisodeRecord, path: &Path, watch: Watch<'_>) -> Result<()> {
    let setting = Setting {
        arm: &session.setup.arm,
        unreachable: &session.setup.unreachable,
        shelf: &record.scene.shelf,
        catalog: &session.setup.catalog,
        views: &session.setup.views,
        budget: record.config.budget,
        planner: &record.config.planner,
    };
    let mut recorder = Recorder::begin(path, &record::title(record), &setting)?;
    for (done, moment) in session.moments.iter().enumerate() {
        if !watch(done as f32 / session.moments.len() as f32) {
            return Err(Error::Usage("the export was cancelled".to_owned()));
        }
        let belief = moment.belief.belief();
        let state = State {
            step: moment.step,
            bodies: &moment.bodies,
            belief: &belief,
            seen: &moment.seen,
            truth: moment.truth.as_deref(),
            scores: moment.scores.as_ref(),
            entropy_nats: moment.entropy_nats,
        };
        recorder.record(&setting, &state, moment.whole_outcome().as_ref())?;
        let objects = moment.outcome.as_ref().map_or(&[][..], |outcome| outcome.record.objects());
        let note = session.annotations.notes.get(&moment.step).map(String::as_str);
        recorder.remark(note, &session.annotations.judge(moment.step, objects))?;
    }
    recorder.finish()?;
    watch(1.0);
    Ok(())
}

/// The figure of the episode: after the first action, after half of the budget, and now.
fn summary(session: &Session, record: &EpisodeRecord) -> Result<picture::RgbImage> {
    let last = session.steps();
    let mut steps: Vec<usize> = [1, record.config.budget.div_ceil(2)].into_iter().filter(|step| *step < last).collect();
    steps.dedup();
    steps.push(last);
    let moments: Vec<&Moment> = steps.into_iter().map(|step| &**session.moment(step)).collect();
    let beliefs: Vec<Belief> = moments.iter().map(|moment| moment.belief.belief()).collect();
    let columns: Vec<figure::Moment<'_>> = moments
        .iter()
        .zip(&beliefs)
        .map(|(moment, belief)| figure::Moment { step: moment.step, belief, truth: moment.truth.as_deref() })
        .collect();
    figure::summary(&figure::Summary {
        record,
        catalog: &session.setup.catalog,
        start: &session.moment(0).bodies,
        moments: &columns,
        beside: None,
    })
}
