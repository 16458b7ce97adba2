//! Where images come from and motions go: a simulated shelf, a recording, a robot.
//!
//! An [`Episode`](crate::episode::Episode) knows its surroundings only through [`Environment`]. It asks for a frame from a
//! view, has a motion carried out and is told what happened; if the surroundings know the truth, it is scored. Whatever can
//! do the first two runs every policy but those that know what would happen ([`Environment::simulated`]).

mod external;
mod recorded;
mod simulated;

pub use external::{External, PROTOCOL, WorldSettings};
pub use recorded::Recorded;
pub use simulated::Simulated;

use crate::Result;
use crate::arm::{Arm, PhasedMotion};
use crate::camera::{Intrinsics, Sensed, View, ViewArray};
use crate::world::{ManipulationOutcome, TruthMap};

/// What an episode maps.
pub trait Environment: Send + Sync {
    /// What the camera gives from a view, as it is: without the noise of [`NoiseModel`](crate::camera::NoiseModel).
    ///
    /// The camera asked for is `intrinsics` at the view's pose; the frame says which camera it was and where.
    ///
    /// # Errors
    /// For a view from which there is no frame.
    fn frame(&mut self, view: &View, intrinsics: &Intrinsics) -> Result<Sensed>;

    /// Carries out a motion of the arm, phase by phase. What an environment does not know of the objects (their
    /// displacements, contacts and drops) it leaves empty.
    ///
    /// # Errors
    /// Where the motion could not be begun.
    fn carry_out(&mut self, arm: &Arm, motion: &PhasedMotion) -> Result<ManipulationOutcome>;

    /// What is really there now, if that is known. `None` once is `None` always.
    fn truth(&self) -> Option<&TruthMap>;

    /// A copy that goes its own way from here on, if there can be one.
    fn branch(&self) -> Option<Box<dyn Environment>>;

    /// The only views from which there are frames, where it is the environment that says which; the episode then files them.
    /// No arm is asked whether its hand can be there. `None` of an environment whose camera goes where it is sent.
    fn views(&self) -> Option<&ViewArray> {
        None
    }

    /// The simulation, for policies that know what would happen and for probes; `None` of everything else.
    fn simulated(&self) -> Option<&Simulated> {
        None
    }
}
