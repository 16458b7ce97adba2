//! An episode: scene, policy and seed, and the sequence of decisions, observations, beliefs and scores.
//!
//! [`Episode`] is a state machine that the command line and the window drive one action at a time: [`Episode::decide`]
//! says what the policy would do and changes nothing, [`Episode::act`] does it; [`Episode::branch`] goes another way.
//!
//! The directory that an episode is written to, step by step, is [`EpisodeDir`]. [`resume`] continues a directory whose
//! run was stopped; [`review`] opens one without writing; [`replay`] simulates one again from its log and verifies every
//! step; [`infer()`] has its beliefs again from its filed frames.

mod checkpoint;
mod delivered;
mod directory;
mod document;
mod estimate;
mod filed;
mod infer;
mod judgement;
mod machine;
mod npz;
mod record;
mod replay;
mod resume;
mod stopwatch;
#[cfg(test)]
mod synthetic;
mod told_file;

pub use delivered::{Acted, Delivered, Gained, LOWERED, MapState, delivered};
pub use directory::{DirectoryState, EpisodeDir, Frames, Overwrite};
pub use estimate::Told;
pub use filed::{Observer, resume_within};
pub use infer::infer;
pub use judgement::{Judgement, NO_TRUTH, Prior};
pub use machine::Episode;
pub use npz::{Precision, StoredTruth};
pub use record::{
    EpisodeConfig, EpisodeRecord, FORMAT, GripReport, LaterMaker, LinkTouch, PushReport, StepOutcome, StepRecord,
    StepSeconds,
};
pub use replay::{Agreement, Difference, ReplayReport, TOLERANCE, replay};
pub(crate) use resume::revisit;
pub use resume::{resume, resume_from_checkpoint, review};
