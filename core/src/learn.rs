//! Learning: data from our own simulation, and (with the feature `cnabu`) training of the networks on it.
//!
//! A data directory holds a card (`card.toml`: what it is, from which seed), shards of samples (`shard-00000.zst`) and
//! an index with checksums beside each shard (`shard-00000.json`). A sample is a record of fixed size, bit-packed, and
//! compressed on its own as one zstd frame, so that any sample can be read without the others and
//! `numpy.frombuffer` understands it (`scripts/read_data.py`).
//!
//! Every sample has a seed of its own that follows from the directory's seed and the sample's number: shards can be
//! made in any order, by several processes, and again. What pushes are worth ([`worth`]) is filed by the state along
//! episodes, one state a shard.

mod bytes;
mod card;
mod dataset;
mod evaluate;
mod kind;
mod make;
mod maps;
mod pushes;
mod shard;
#[cfg(feature = "cnabu")]
mod train;
pub mod worth;

pub use card::{Card, NAME as CARD_NAME, WorthCard};
pub use dataset::Dataset;
pub use evaluate::{PushTallies, evaluate, evaluate_after_pushes, evaluate_pushes, fit_change_temperature};
pub use kind::Kind;
pub use make::{Progress, make};
pub use maps::{MapSample, Recipe, Stretch, ViewSample};
pub use pushes::{PUSHES, PushSample, PushedSample, VIEWS_AFTER};
pub use shard::SAMPLES_PER_SHARD;
#[cfg(feature = "cnabu")]
pub use train::{
    AfterPushes, ObserveTrainer, Priors, PushLoss, PushTrainer, TrainSettings, Trainer, ViewLoss, checkpoint_path,
    settings_path,
};

/// Views that a sample holds.
pub const VIEWS: usize = 10;

/// What shards hold.
pub trait Record: Sized {
    /// Which kind of directory holds it.
    const KIND: Kind;

    /// The record, before compression.
    fn to_bytes(&self) -> Vec<u8>;

    /// What was written as a record; `None` when its size or a number in it is not that of this kind.
    fn from_bytes(grid: &crate::grid::Grid, bytes: &[u8]) -> Option<Self>;
}

/// A record that is simulated from its own seed.
pub trait Sample: Record + Send {
    /// Simulates the sample with this seed.
    ///
    /// # Errors
    /// When the recipe is wrong (an unknown view array, a fill that cannot be).
    fn simulate(recipe: &Recipe, seed: u64) -> crate::Result<Self>;
}
