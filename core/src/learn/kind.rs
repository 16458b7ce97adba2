//! The kinds of data.

use serde::{Deserialize, Serialize};
use std::fmt;

/// What a directory's samples are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Scenes seen from views.
    Maps,
    /// Scenes seen from views, and pushes.
    Pushes,
    /// States of episodes, and what pushes from each are worth.
    Worth,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Maps => "maps",
            Self::Pushes => "pushes",
            Self::Worth => "worth",
        })
    }
}
