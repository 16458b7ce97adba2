//! The workbench: one window to see a belief, ask why, try something else, and share it.
//!
//! [`model`] is what the window shows and holds every choice a person has made; [`command`] is everything that can be
//! asked; `panels/` are functions of the model that return commands; `app` carries them out. Episodes live on worker
//! threads (`worker`), floor maps and answers are made in the background (`jobs`), and `viewer` alone touches Rerun's
//! viewer. `shot` renders the same window without a display.

pub mod annotations;
pub mod author;
pub mod browser;
pub mod command;
pub mod derive;
pub mod export;
#[cfg(test)]
pub mod fixture;
pub mod half_belief;
pub mod latest;
pub mod model;
pub mod panels;
pub mod session;
pub mod toasts;
