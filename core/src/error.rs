//! What can go wrong, in words for the person who gave the input.

use std::path::{Path, PathBuf};

/// The result of everything here that reads input or touches a disk.
pub type Result<T> = std::result::Result<T, Error>;

/// An error in one line: what happened, to which file, at which place.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file's content is not what it should be. `place` is a line, an object, a field.
    #[error("{}: {place}{}{message}", path.display(), if place.is_empty() { "" } else { ": " })]
    Input {
        /// The file that the message is about.
        path: PathBuf,
        /// Where in the file: `line 12, object 3 (tomato_can)`; empty when the file as a whole is meant.
        place: String,
        /// What is wrong and, where it is short, what would be right.
        message: String,
    },
    /// The operating system refused to read or write.
    ///
    /// The system's words are part of this error's own line and therefore not its `source`: who prints the chain of
    /// causes would print them twice.
    #[error("{}: {reason}", path.display())]
    Io {
        /// The file or directory that was asked for.
        path: PathBuf,
        /// The system's own words.
        reason: std::io::Error,
    },
    /// A value on the command line or in a call is out of its range.
    #[error("{0}")]
    Usage(String),
    /// Something that was verified did not hold (a replay that differs, a scene that fails its check).
    #[error("{0}")]
    Check(String),
}

impl Error {
    /// An [`Error::Input`] about a place in a file.
    pub fn input(path: impl AsRef<Path>, place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Input { path: path.as_ref().to_owned(), place: place.into(), message: message.into() }
    }

    /// An [`Error::Io`] for `path`.
    pub fn io(path: impl AsRef<Path>, reason: std::io::Error) -> Self {
        Self::Io { path: path.as_ref().to_owned(), reason }
    }

    /// The process's exit code: 1 for a failed check, 2 for wrong use or bad input.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Check(_) => 1,
            _ => 2,
        }
    }
}
