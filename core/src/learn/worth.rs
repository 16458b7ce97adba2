//! What pushes are worth: states along episodes, and what some pushes from each of them really do.
//!
//! Pushes compete with others from the same state, so they are compared where nothing else differs: from every state
//! [`WorthRecipe::pushes`] pushes are drawn and each is carried out in a copy of the world.
//!
//! # Episodes and states
//!
//! An episode begins in a settled shelf of a [`Family`] with nothing known; of up to 16 shelves that are
//! drawn the first that hides one to six objects or more, else the one that hides most. It has [`STATES_PER_EPISODE`]
//! states. Before each come one to three looks, and before those (not before the first state, in three of five cases) a
//! push: half of the time the one that promises most of the pushes from the state before, else one of them at random. So a state has
//! up to [`MOST_LOOKS`] looks and three pushes behind it. After a drop nothing is pushed any more. Half of the episodes look where
//! `mem-no-push` would look, a quarter at random, and a quarter takes turns at random. Beliefs are those of the update (the networks');
//! a push is predicted into the belief as in an episode. Objects of some episodes are stretched, some see with sensor noise.
//!
//! # Pushes and labels
//!
//! Three of four pushes are drawn from the frontier ([`PushSampler::Frontier`](crate::skill::PushSampler)), the rest before what
//! is hidden; all are feasible under the belief. Labels are those of [`PushTruth`](crate::skill::PushTruth): objects won and lost
//! (25 pixels in some view), voxels of each object that views reach, space opened, how far the tip came, whether it jammed,
//! drops. Beside them stands what was promised: the nats that sigma_m's prediction opens, its disturbance, and the prediction itself.
//!
//! # The record
//!
//! One zstd frame per state, in a shard of its own; little endian. `X Y Z` are the grid's voxels (160 80 80 of 5 mm),
//! `x y z` blocks of 2 x 2 x 2 voxels, `u v` blocks of 4 x 4 floor cells. Arrays are in the order of their axes, the last fastest.
//! [`LAYOUT`] lists the fields; it stands on the data's card too. `scripts/read_worth.py` reads it with NumPy.

mod blocks;
mod considered;
mod follow;
mod make;
mod measure;
mod planes;
mod record;
mod rollout;
mod state;
mod summary;

pub use make::{WorthProgress, make_worth};
pub use planes::{PUSH_PLANES, PlaneScale, Planes, STATE_PLANES, push_planes, state_planes};
pub use record::LAYOUT;
pub use state::{
    BANDS, BeliefMap, FloorFacts, Followed, MapScores, ObjectOutcome, ObjectState, Promise, WorthPush, WorthState,
};
pub use summary::{WorthSummary, summarise};

use super::Recipe;
use crate::belief::BeliefUpdate;
use crate::scene::Family;
use std::sync::Arc;

/// States of an episode.
pub const STATES_PER_EPISODE: usize = 4;
/// Looks before a state at most.
pub const MOST_LOOKS: usize = 3 * STATES_PER_EPISODE;

/// What states and pushes are made of, beside their seeds.
#[derive(Clone)]
pub struct WorthRecipe {
    /// Catalogue, views, arm, noise and stretches; fill and regularity are those of the families.
    pub base: Recipe,
    /// The families that shelves are drawn from, each as often as it is listed.
    pub families: Vec<Family>,
    /// How beliefs change.
    pub update: Arc<dyn BeliefUpdate>,
    /// Pushes from each state, where so many are feasible.
    pub pushes: usize,
    /// Share of states for which it is found too what the map gains by some pushes and looks after them.
    pub followed_share: f32,
}
