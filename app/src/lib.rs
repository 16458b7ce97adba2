//! The workbench's three storeys: [`commands`] (one file per subcommand, thin), `record` (an episode's events become
//! Rerun entities) and, with the feature `workbench`, the window. The headless run and the window drive the same
//! [`driver::Driver`], so what a test proves of one holds for the other.

pub mod commands;
pub mod driver;
