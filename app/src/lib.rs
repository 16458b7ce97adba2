//! Nudge: the command line, experiments and their report, recording to Rerun, pictures and figures.
//!
//! [`commands`] has one thin file per subcommand; [`driver`] moves an episode, its directory and its recording one action
//! at a time; [`record`] turns an episode's events into Rerun entities; [`picture`] draws scenes and floor plans, and
//! [`figure`] composes them into a slide; [`doctor`] looks at an installation.

// First, so that its macros hold everywhere.
#[macro_use]
mod output;

pub mod annotations;
pub mod bench;
pub mod colors;
pub mod commands;
pub mod doctor;
pub mod driver;
pub mod figure;
#[cfg(test)]
mod fixture;
pub mod made_by;
pub mod picture;
pub mod planner_args;
pub mod record;
pub mod regress;
pub mod report;
pub mod share;
pub mod verdicts;
#[cfg(feature = "workbench")]
pub mod workbench;
