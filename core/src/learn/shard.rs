//! A shard: samples one after the other, each a zstd frame of its own, and beside it an index.

use crate::files::write_atomically;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Samples in a shard.
pub const SAMPLES_PER_SHARD: usize = 50;
/// zstd's level: from here on time grows faster than size falls.
const LEVEL: i32 = 5;
/// No record is larger than this, bytes: what is promised beyond it is no record.
const MAX_RECORD: usize = 1 << 30;

/// Room that is made for a record before it is unpacked, at most, bytes.
const MAX_PROMISED: usize = 1 << 24;

/// The index of a shard, `shard-NNNNN.json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Index {
    /// CRC-32 of the whole shard.
    pub crc32: u32,
    /// Length of the shard, bytes.
    pub bytes: u64,
    /// Its samples, in order.
    pub samples: Vec<Entry>,
}

/// Where a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Entry {
    /// The sample's number in the directory.
    pub number: usize,
    /// Its seed.
    pub seed: u64,
    /// First byte of its frame.
    pub offset: u64,
    /// Length of its frame, bytes.
    pub length: u64,
    /// Length of its record, bytes.
    pub record: usize,
}

/// The file of a shard.
pub(super) fn path(directory: &Path, shard: usize) -> PathBuf {
    directory.join(format!("shard-{shard:05}.zst"))
}

/// The file of a shard's index.
pub(super) fn index_path(directory: &Path, shard: usize) -> PathBuf {
    directory.join(format!("shard-{shard:05}.json"))
}

/// A record as a zstd frame that carries a checksum of its content.
pub(super) fn compress(record: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut encoder = zstd::Encoder::new(Vec::new(), LEVEL)?;
    encoder.include_checksum(true)?;
    encoder.set_pledged_src_size(Some(record.len() as u64))?;
    std::io::Write::write_all(&mut encoder, record)?;
    encoder.finish()
}

/// A sample that is to be written.
pub(super) struct Frame {
    pub number: usize,
    pub seed: u64,
    pub record: usize,
    pub bytes: Vec<u8>,
}

/// Writes a shard and then its index, each whole or not at all; what has an index is complete.
pub(super) fn write(directory: &Path, shard: usize, frames: &[Frame]) -> Result<()> {
    let mut bytes = Vec::with_capacity(frames.iter().map(|frame| frame.bytes.len()).sum());
    let mut samples = Vec::with_capacity(frames.len());
    for frame in frames {
        let (offset, length) = (bytes.len() as u64, frame.bytes.len() as u64);
        samples.push(Entry { number: frame.number, seed: frame.seed, offset, length, record: frame.record });
        bytes.extend(&frame.bytes);
    }
    let index = Index { crc32: crc32fast::hash(&bytes), bytes: bytes.len() as u64, samples };
    write_atomically(&path(directory, shard), &bytes)?;
    let at = index_path(directory, shard);
    let json = serde_json::to_vec(&index).map_err(|error| Error::input(&at, "", error.to_string()))?;
    write_atomically(&at, &json)
}

/// Reads and verifies the index of a shard against the shard.
pub(super) fn verified_index(directory: &Path, shard: usize) -> Result<Index> {
    let at = index_path(directory, shard);
    let text = std::fs::read(&at).map_err(|error| Error::io(&at, error))?;
    let index: Index = serde_json::from_slice(&text)
        .map_err(|error| Error::input(&at, format!("line {}", error.line()), "is no index of a shard"))?;
    let file = path(directory, shard);
    let bytes = std::fs::read(&file).map_err(|error| Error::io(&file, error))?;
    if bytes.len() as u64 != index.bytes {
        let message = format!("holds {} bytes, its index says {}", bytes.len(), index.bytes);
        return Err(Error::input(&file, "", message));
    }
    if crc32fast::hash(&bytes) != index.crc32 {
        return Err(Error::input(&file, "", "its checksum is not that of its index"));
    }
    let inside =
        |e: &Entry| e.offset.checked_add(e.length).is_some_and(|end| end <= index.bytes) && e.record < MAX_RECORD;
    if !index.samples.iter().all(inside) {
        return Err(Error::input(&at, "", "points outside its shard"));
    }
    Ok(index)
}

/// The record of a sample.
pub(super) fn read(directory: &Path, shard: usize, entry: &Entry) -> Result<Vec<u8>> {
    let file = path(directory, shard);
    let bad = |error: std::io::Error| Error::input(&file, format!("sample {}", entry.number), error.to_string());
    let mut from = File::open(&file).map_err(|error| Error::io(&file, error))?;
    from.seek(SeekFrom::Start(entry.offset)).map_err(|error| Error::io(&file, error))?;
    let mut frame = vec![0; entry.length as usize];
    from.read_exact(&mut frame).map_err(bad)?;
    // What the index promises need not be there.
    let mut record = Vec::with_capacity(entry.record.min(MAX_PROMISED));
    let decoder = zstd::Decoder::with_buffer(frame.as_slice()).map_err(bad)?;
    decoder.take(entry.record as u64 + 1).read_to_end(&mut record).map_err(bad)?;
    if record.len() != entry.record {
        return Err(bad(std::io::Error::other("its record has another length than its index says")));
    }
    Ok(record)
}
