//! The file of a recording, written by whoever records: an error reaches the next flush with the system's own words.
//!
//! Rerun's own file sink writes on a thread that ends at the first error; a flush after that waits for an answer that
//! never comes. This one writes on the thread that hands it over. What could not be written whole is cut off, back to the
//! last flush, and nothing is written any more: the file opens with everything up to the last step.

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::rrd::{Encoder, EncodingOptions};
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};
use std::fs::File;
use std::io::{Error, ErrorKind, Result, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Why a recording's file takes nothing any more, for whoever writes the recording.
#[derive(Clone, Default)]
pub(super) struct Fault(Arc<Mutex<Option<(ErrorKind, String)>>>);

impl Fault {
    /// What went wrong, if something has.
    pub fn error(&self) -> Option<Error> {
        self.lock().as_ref().map(|(kind, words)| Error::new(*kind, words.clone()))
    }

    fn note(&self, error: &Error) {
        self.lock().get_or_insert_with(|| (error.kind(), error.to_string()));
    }

    fn lock(&self) -> MutexGuard<'_, Option<(ErrorKind, String)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A recording's file as a sink.
pub(super) struct Disk {
    encoder: Mutex<Encoder<Tail>>,
    fault: Fault,
}

impl Disk {
    /// Starts the file, overwritten.
    pub fn create(path: &Path, fault: Fault) -> Result<Self> {
        let tail = Tail { file: File::create(path)?, written: 0, whole: 0, fault: fault.clone() };
        let encoder = Encoder::new_eager(CrateVersion::LOCAL, EncodingOptions::PROTOBUF_COMPRESSED, tail);
        let encoder = encoder.map_err(|error| fault.error().unwrap_or_else(|| Error::other(error.to_string())))?;
        Ok(Self { encoder: Mutex::new(encoder), fault })
    }

    fn encoder(&self) -> MutexGuard<'_, Encoder<Tail>> {
        self.encoder.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LogSink for Disk {
    fn send(&self, message: LogMsg) {
        if let Err(error) = self.encoder().append(&message) {
            // An error of the file is noted already.
            self.fault.note(&Error::other(error.to_string()));
        }
    }

    fn flush_blocking(&self, _: Duration) -> std::result::Result<(), SinkFlushError> {
        let flushed = self.encoder().flush_blocking();
        match (self.fault.error(), flushed) {
            (Some(error), _) => Err(SinkFlushError::failed(error.to_string())),
            (None, flushed) => flushed.map_err(|error| SinkFlushError::failed(error.to_string())),
        }
    }
}

/// The end of the file.
struct Tail {
    file: File,
    /// Bytes in the file.
    written: u64,
    /// Bytes at the last flush.
    whole: u64,
    fault: Fault,
}

impl Write for Tail {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        if let Some(error) = self.fault.error() {
            return Err(error);
        }
        if let Err(error) = self.file.write_all(bytes) {
            self.fault.note(&error);
            // Half a message would be the end of everything before it for some readers.
            let _ = self.file.set_len(self.whole);
            return Err(error);
        }
        self.written += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        if let Some(error) = self.fault.error() {
            return Err(error);
        }
        self.file.flush()?;
        self.whole = self.written;
        Ok(())
    }
}
