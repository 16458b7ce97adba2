//! Questions that the window asks in front of everything else.

use super::command::MenuCommand;
use super::part::Part;
use super::session::SessionId;
use std::path::{Path, PathBuf};

/// An open question.
#[derive(Clone, Debug)]
pub enum Dialog {
    /// Where something shall be written.
    WriteTo {
        /// What: one of the export and save commands.
        what: MenuCommand,
        /// The path as it is typed.
        path: String,
        /// Which part of the window, for a picture.
        part: Part,
    },
    /// Which file or directory shall be opened, where the system has no dialog for it.
    OpenPath {
        /// Opening a scene or an episode.
        what: MenuCommand,
        /// The path as it is typed.
        path: String,
    },
    /// An episode's worker broke down: what shall become of the episode.
    Broke {
        /// The episode.
        id: SessionId,
        /// The panic's words.
        words: String,
        /// Its directory.
        path: PathBuf,
        /// Number of actions that are in it.
        steps: usize,
    },
    /// Whether unsaved work may be lost.
    Quit {
        /// What would be lost.
        lost: Vec<String>,
    },
    /// The table of shortcuts.
    Shortcuts,
    /// Versions and licences.
    About,
}

impl Dialog {
    /// Asks where something shall be written, with a proposal.
    pub fn write_to(what: MenuCommand, proposal: &Path) -> Self {
        Self::WriteTo { what, path: proposal.display().to_string(), part: Part::Window }
    }

    /// Takes the path that a person has chosen in the system's dialog.
    pub fn chosen(&mut self, chosen: &Path) {
        if let Self::WriteTo { path, .. } = self {
            *path = chosen.display().to_string();
        }
    }
}

/// What a question was answered with.
#[derive(Clone, Debug)]
pub enum Reply {
    /// Write it, or that part of the window, there.
    Write(MenuCommand, PathBuf, Part),
    /// Open it.
    Open(PathBuf),
    /// Export the episode whose worker broke down.
    Export(SessionId),
    /// Close it and open its directory again, to go on.
    Reopen(SessionId),
    /// Choose a path in the system's dialog.
    Browse(MenuCommand),
    /// Save what is unsaved, then quit.
    SaveAndQuit,
    /// Quit all the same.
    Quit,
    /// Nothing; close the question.
    Close,
}
