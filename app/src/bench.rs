//! Benches: every policy on every scene of some sets, a few seeds each.
//!
//! A [`Plan`] says which episodes a bench consists of; [`BenchDir`] keeps one small file per finished episode, so that a
//! kill loses no more than the episodes that were running; [`run`] works through what is missing, several episodes at
//! once; [`merge()`] joins the directories of shards. Results that other weights, other code of the method or other settings
//! made do not join unless told ([`Mixing`]). What an episode leaves is an [`EpisodeResult`] that is the same byte
//! for byte whenever and wherever it ran, and its seconds in a file of their own.

mod makers;
mod merge;
mod plan;
mod result;
mod store;
mod summary;
mod work;

pub use makers::Mixing;
pub use merge::merge;
pub use plan::{AlsoMadeBy, BrokenScene, EpisodeId, FORMAT, Plan, PolicyPlan, ScenePlan, SetPlan, load_sets};
pub use result::{EpisodeResult, EpisodeSeconds, StepResult, VerdictCounts};
pub use store::BenchDir;
pub use summary::{SummaryRow, summarise};
pub use work::{BYTES_PER_EPISODE, Event, Workers, run, run_episode};
