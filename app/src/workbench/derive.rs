//! What panels draw of a state, made on a background thread: the belief in full precision and the floor maps.

use super::session::{Moment, SessionId};
use crate::picture::{self, RgbImage};
use nudge_core::belief::Belief;
use nudge_core::scene::Catalog;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The floor maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MapKind {
    /// The likeliest class, paler where it is less certain.
    Semantics,
    /// The likeliest class's probability (viridis).
    Certainty,
    /// Entropy of the column and its class, nats (magma).
    Entropy,
    /// The true classes.
    Truth,
    /// Where belief and truth differ.
    Error,
}

impl MapKind {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Semantics, Self::Certainty, Self::Entropy, Self::Truth, Self::Error];

    /// As the map's heading says it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Semantics => "Semantics",
            Self::Certainty => "Certainty",
            Self::Entropy => "Entropy",
            Self::Truth => "Truth",
            Self::Error => "Error",
        }
    }
}

/// What is made of a state.
#[derive(Debug)]
pub struct Derived {
    /// The episode and the number of actions.
    pub of: (SessionId, usize),
    /// The belief in full precision.
    pub belief: Arc<Belief>,
    /// The floor maps, one pixel a cell, the back of the shelf on top; without a truth those of the belief alone.
    pub maps: BTreeMap<MapKind, RgbImage>,
}

impl Derived {
    /// Makes them; takes some tens of milliseconds.
    pub fn of(id: SessionId, moment: &Moment, catalog: &Catalog) -> Self {
        let belief = moment.belief.belief();
        let truth = moment.truth.as_ref();
        let maps = MapKind::ALL.into_iter().filter_map(|kind| {
            let map = match kind {
                MapKind::Semantics => picture::paint_semantics(&belief, catalog),
                MapKind::Certainty => picture::paint_certainty(&belief),
                MapKind::Entropy => picture::paint_entropy(&belief),
                MapKind::Truth => picture::paint_labels(&belief.grid, &truth?.labels, catalog),
                MapKind::Error => picture::paint_errors(&belief, truth?),
            };
            Some((kind, map))
        });
        Self { of: (id, moment.step), maps: maps.collect(), belief: Arc::new(belief) }
    }
}
