//! The curves of a training run as a recording: losses and validation scores over the updates of the weights.

use super::disk::Fault;
use super::{file_stream, paths};
use nudge_core::{Error, Result};
use rerun::RecordingStream;
use std::path::{Path, PathBuf};

/// Writes curves into a recording, value by value; the file opens in the viewer while it grows.
pub struct CurveRecorder {
    stream: RecordingStream,
    file: PathBuf,
    fault: Fault,
}

impl CurveRecorder {
    /// Starts `path` (an `.rrd` file, overwritten).
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(path: &Path, name: &str) -> Result<Self> {
        let (stream, fault) = file_stream(path, name)?;
        stream.set_log_time_enabled(false);
        stream.set_log_tick_enabled(false);
        Ok(Self { stream, file: path.to_owned(), fault })
    }

    /// Adds the value of a curve at a number of updates.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn value(&self, curve: &str, updates: u64, value: f64) -> Result<()> {
        let failed = |error: &dyn std::fmt::Display| Error::io(&self.file, std::io::Error::other(error.to_string()));
        self.stream.set_time_sequence(paths::UPDATES, updates as i64);
        self.stream.log(paths::training(curve), &rerun::Scalars::single(value)).map_err(|error| failed(&error))?;
        let flushed = self.stream.flush_blocking();
        match self.fault.error() {
            Some(error) => Err(Error::io(&self.file, error)),
            None => flushed.map_err(|error| failed(&error)),
        }
    }
}
