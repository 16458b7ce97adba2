//! The method of manipulation-enhanced mapping (MEM), without a window and without a recorder.
//!
//! Data walks through the modules once, in this order, and every module depends only on the ones before it:
//!
//! ```text
//! grid -> solid -> scene -> tool -> arm -> world -> camera -> belief -> cnabu -> gain -> push -> plan -> score -> episode -> probe -> learn
//! ```
//!
//! One frame everywhere: x right, y into the shelf (0 at its front edge), z up (0 on the board), x = 0 in the
//! middle of the shelf; metres, right-handed. Entropy and gain are in nats.

pub mod arm;
pub mod belief;
pub mod camera;
pub mod cnabu;
pub mod episode;
pub mod error;
pub mod files;
pub mod gain;
pub mod grid;
pub mod learn;
mod named;
pub mod plan;
pub mod probe;
pub mod push;
pub mod rng;
pub mod scene;
pub mod score;
pub mod shard;
pub mod solid;
pub mod world;

pub use error::{Error, Result};

/// A point in the shelf's frame, metres.
pub type Point = nalgebra::Point3<f32>;
/// A displacement or direction in the shelf's frame, metres.
pub type Vector = nalgebra::Vector3<f32>;
/// A rigid transform; names say `to_from`, for example `world_from_camera`.
pub type Pose = nalgebra::Isometry3<f32>;

/// The version that episodes, weights and reports carry.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
