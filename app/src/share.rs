//! `nudge share`: an episode, or two beside each other, as one HTML page that needs nothing else.
//!
//! An [`episode`](Source) is read from its directory alone: no networks, no simulation. `states` packs what was believed
//! after every step, `camera` what the camera saw, `story` what was done, weighed, scored and said; `page` puts them
//! together with the page's own script. Everything is compressed and in base64, so that no name in it is ever read as HTML.
//!
//! The page is at most [`LIMIT`] bytes long: of long episodes it holds the beliefs of every n-th step, and says so.

mod camera;
mod pack;
mod page;
mod states;
mod story;

use crate::annotations::Annotations;
use crate::record::RECORDING;
use nudge_core::episode::{EpisodeDir, EpisodeRecord};
use nudge_core::files::write_atomically;
use nudge_core::{Error, Result};
use std::path::Path;

/// The page is no longer than this, bytes.
pub const LIMIT: usize = 6_000_000;
/// What the page is apart from its episodes at most, bytes: its script and style, and the words around.
const FRAME: usize = 150_000;

/// Is told the share that is done, 0 to 1, and answers whether to go on.
pub type Watch<'a> = &'a dyn Fn(f32) -> bool;

/// An episode to share.
pub struct Source<'a> {
    /// Its directory.
    pub directory: &'a Path,
    /// Its notes and verdicts, in place of those that are filed.
    pub annotations: Option<Annotations>,
}

impl<'a> Source<'a> {
    /// An episode as it is filed.
    pub fn filed(directory: &'a Path) -> Self {
        Self { directory, annotations: None }
    }
}

/// What a page became.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shared {
    /// Its length, bytes.
    pub bytes: usize,
    /// What was left out to keep it short, a sentence each.
    pub left_out: Vec<String>,
}

/// An episode as the page holds it.
struct Packed {
    record: EpisodeRecord,
    story: story::Story,
    /// What the page unpacks, by name.
    parts: Vec<(String, String)>,
    left_out: Vec<String>,
}

impl Packed {
    fn bytes(&self) -> usize {
        self.parts.iter().map(|(_, part)| part.len()).sum()
    }
}

/// Writes one or two episodes as a page; a file of that name is replaced at once or not at all.
///
/// # Errors
/// For a directory that holds no episode or a damaged one, what the system refuses, and when `watch` says to stop.
pub fn write(sources: &[Source<'_>], out: &Path, watch: Watch<'_>) -> Result<Shared> {
    let room = (LIMIT - FRAME) / sources.len().max(1);
    let share = 1.0 / sources.len().max(1) as f32;
    let mut episodes = Vec::with_capacity(sources.len());
    for (at, source) in sources.iter().enumerate() {
        let part = |done: f32| watch(share * (at as f32 + done));
        episodes.push(read(source, page::LETTERS[at.min(1)], room, &part)?);
    }
    // What is left takes recordings, as long as they fit.
    let mut left = LIMIT.saturating_sub(FRAME + episodes.iter().map(Packed::bytes).sum::<usize>());
    for (at, source) in sources.iter().enumerate() {
        left -= attach(&mut episodes[at], page::LETTERS[at.min(1)], source.directory, left)?;
    }
    let html = page::html(&episodes);
    write_atomically(out, html.as_bytes())?;
    watch(1.0);
    let left_out = episodes.into_iter().flat_map(|episode| episode.left_out).collect();
    Ok(Shared { bytes: html.len(), left_out })
}

/// Reads an episode and packs it into at most `room` bytes.
fn read(source: &Source<'_>, letter: char, room: usize, watch: Watch<'_>) -> Result<Packed> {
    let directory = EpisodeDir::open(source.directory)?;
    let record = directory.record()?;
    let annotations = source.annotations.clone().map_or_else(|| Annotations::read(source.directory), Ok)?;
    let steps = record.steps.len();
    let mut every = 1;
    loop {
        let kept = states::kept(steps, every);
        let states = states::pack(&directory, &kept, &|done| watch(0.7 * done))?;
        let images = camera::pack(&directory, &record, &kept)?;
        let mut story = story::tell(&record, &annotations);
        story.kept = kept;
        story.every = every;
        story.cameras = images.iter().map(|image| image.facts.clone()).collect();
        if !watch(0.9) {
            return Err(Error::Usage("the page was not written: cancelled".to_owned()));
        }
        let mut parts = vec![(format!("{letter}-states"), pack::text(&states))];
        if record.has_truth() {
            parts.push((format!("{letter}-truths"), pack::text(&states::pack_truths(&directory, &record)?)));
        }
        for image in &images {
            parts.push((format!("{letter}-camera-{}", image.facts.step), pack::text(&image.bytes)));
        }
        let mut packed = Packed { record: record.clone(), story, parts, left_out: Vec::new() };
        // The story is short and in any case whole.
        let length = packed.bytes() + pack::text(&pack::json(&packed.story)).len();
        if length <= room || every > steps {
            packed.left_out.extend(packed.story.thinned());
            return Ok(packed);
        }
        every = (every * length).div_ceil(room).max(every + 1);
    }
}

/// Puts the recording into the page if it takes no more than `room` bytes; says so if it does not. Returns what it takes.
fn attach(episode: &mut Packed, letter: char, directory: &Path, room: usize) -> Result<usize> {
    let path = directory.join(RECORDING);
    let length = match std::fs::metadata(&path) {
        Ok(found) => found.len() as usize,
        Err(_) => {
            episode.story.recording_left_out = Some("The episode has no recording (.rrd).".to_owned());
            return Ok(0);
        }
    };
    let too_long = |length: usize| {
        format!(
            "The recording ({:.1} MB) is left out to keep the page below {} MB.",
            length as f64 / 1e6,
            LIMIT / 1_000_000
        )
    };
    // Base64 takes four letters for three bytes; recordings are compressed already.
    let text = (length <= room * 3 / 4).then(|| std::fs::read(&path)).transpose();
    let text = text.map_err(|error| Error::io(&path, error))?.map(|bytes| pack::text(&bytes));
    let Some(text) = text.filter(|text| text.len() <= room) else {
        episode.story.recording_left_out = Some(too_long(length));
        episode.left_out.push(too_long(length));
        return Ok(0);
    };
    episode.story.recording_bytes = Some(length);
    let taken = text.len();
    episode.parts.push((format!("{letter}-recording"), text));
    Ok(taken)
}

#[cfg(test)]
#[path = "share/tests.rs"]
mod tests;
