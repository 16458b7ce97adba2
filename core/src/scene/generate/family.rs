//! Families of shelves: what stands where before the rest is filled up at random.
//!
//! Shelves that are filled at random hide little. In most families a structure is placed first that hides what is behind
//! it or beside it; then the shelf is filled up to its target like any other. Everything about a structure (classes,
//! places, gaps, angles) is drawn from the scene's seed.

use crate::named;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A kind of shelf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Filled at random: no structure.
    #[default]
    Mixed,
    /// Filled at random, fuller, and in line behind each other.
    Crowded,
    /// A wall of large objects across most of the shelf, and things behind it.
    Walls,
    /// Files of three or four objects behind each other, most of one class, side by side.
    Rows,
    /// One or two rings of objects with small ones inside.
    Rings,
    /// A row of tall objects, close to each other, and small ones behind each.
    TallFirst,
    /// One half of the shelf is packed row by row, the other is nearly empty.
    Halves,
    /// Two chambers: a wall in front, another from it to the back, and things in both.
    Chambers,
}

impl Family {
    /// Every family.
    pub const ALL: [Self; 8] = [
        Self::Mixed,
        Self::Crowded,
        Self::Walls,
        Self::Rows,
        Self::Rings,
        Self::TallFirst,
        Self::Halves,
        Self::Chambers,
    ];

    /// What its shelves look like, as the end of a sentence.
    pub fn description(self) -> &'static str {
        match self {
            Self::Mixed => "filled at random",
            Self::Crowded => "filled at random, fuller, and in line behind each other",
            Self::Walls => "a wall of large objects, and things behind it",
            Self::Rows => "files of three or four objects behind each other, side by side",
            Self::Rings => "rings of objects with small ones inside",
            Self::TallFirst => "a row of tall objects with small ones behind each",
            Self::Halves => "one half packed row by row, the other nearly empty",
            Self::Chambers => "two chambers behind a wall, with things in both",
        }
    }

    /// The usual range of the floor share that objects cover.
    pub fn fill(self) -> [f32; 2] {
        match self {
            Self::Mixed => [0.30, 0.45],
            Self::Crowded => [0.45, 0.55],
            Self::Halves => [0.30, 0.42],
            Self::Walls | Self::Rings | Self::TallFirst | Self::Chambers => [0.28, 0.45],
            Self::Rows => [0.32, 0.48],
        }
    }

    /// The usual regularity of what is filled in at random.
    pub fn rho(self) -> f32 {
        if self == Self::Crowded { 0.5 } else { 0.0 }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Mixed => "mixed",
            Self::Crowded => "crowded",
            Self::Walls => "walls",
            Self::Rows => "rows",
            Self::Rings => "rings",
            Self::TallFirst => "tall-first",
            Self::Halves => "halves",
            Self::Chambers => "chambers",
        })
    }
}

impl FromStr for Family {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        named::parse(&Self::ALL, text).map_err(|known| format!("unknown family \"{text}\"; {known}"))
    }
}
