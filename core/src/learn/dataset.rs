//! Reading a data directory.

use super::shard::{self, Entry};
use super::{Card, Record};
use crate::files::names_in;
use crate::grid::Grid;
use crate::{Error, Result};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// The samples of a directory whose shards are there and undamaged.
#[derive(Clone, Debug)]
pub struct Dataset<S> {
    directory: PathBuf,
    card: Card,
    /// Shard and place of every sample, in order of their numbers.
    entries: Vec<(usize, Entry)>,
    skipped: Vec<String>,
    kind: PhantomData<fn() -> S>,
}

impl<S: Record> Dataset<S> {
    /// Opens a directory and verifies every shard's checksum. Shards that are damaged are left out and named in
    /// [`Dataset::skipped`]; shards that were not made yet are ignored.
    ///
    /// # Errors
    /// For a directory without a card, of another kind, or without a single whole shard.
    pub fn open(directory: &Path) -> Result<Self> {
        let missing = || Error::input(directory, "", "holds no data: it has no card.toml (nudge data makes it)");
        let card = Card::read(directory)?.ok_or_else(missing)?;
        if card.kind != S::KIND {
            let message = format!("holds data of {}, {} are needed", card.kind, S::KIND);
            return Err(Error::input(directory, "", message));
        }
        let mut entries = Vec::new();
        let mut skipped = Vec::new();
        for name in names_in(directory)? {
            let number = name.strip_prefix("shard-").and_then(|rest| rest.strip_suffix(".json"));
            let Some(shard) = number.and_then(|number| number.parse().ok()) else { continue };
            match shard::verified_index(directory, shard) {
                Ok(index) => entries.extend(index.samples.into_iter().map(|entry| (shard, entry))),
                Err(error) => skipped.push(error.to_string()),
            }
        }
        if entries.is_empty() {
            let why = skipped.first().map_or(String::new(), |first| format!("; {first}"));
            return Err(Error::input(directory, "", format!("holds no whole shard{why}")));
        }
        entries.sort_by_key(|(_, entry)| entry.number);
        Ok(Self { directory: directory.to_owned(), card, entries, skipped, kind: PhantomData })
    }

    /// The card.
    pub fn card(&self) -> &Card {
        &self.card
    }

    /// Where the data is.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The grid of the samples.
    pub fn grid(&self) -> Grid {
        self.card.grid()
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is none; never after [`Dataset::open`].
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// What was left out, one line each that names the file.
    pub fn skipped(&self) -> &[String] {
        &self.skipped
    }

    /// Keeps the first `count` samples only.
    pub fn truncate(&mut self, count: usize) {
        self.entries.truncate(count);
    }

    /// Bytes that a sample takes on disk, in the mean.
    pub fn bytes_per_sample(&self) -> f64 {
        self.entries.iter().map(|(_, entry)| entry.length as f64).sum::<f64>() / self.len().max(1) as f64
    }

    /// Reads a sample.
    ///
    /// # Errors
    /// When it can no longer be read, or is not what the index promised.
    pub fn get(&self, at: usize) -> Result<S> {
        let (shard, entry) = &self.entries[at];
        let record = shard::read(&self.directory, *shard, entry)?;
        S::from_bytes(&self.grid(), &record).ok_or_else(|| {
            let place = format!("sample {}", entry.number);
            Error::input(shard::path(&self.directory, *shard), place, "is no record of this kind and grid")
        })
    }
}
