//! Inputs of users that once broke the program, each as a test named after what they saw.
//!
//! The files are made here, in the words of the programs that write them. What is about one module of the library alone
//! is tested beside it.

#[path = "regressions/arms.rs"]
mod arms;
#[path = "regressions/meshes.rs"]
mod meshes;
#[path = "regressions/outputs.rs"]
mod outputs;
#[path = "regressions/scenes.rs"]
mod scenes;

use nudge_tests::{Folder, TIN, small_scene};
