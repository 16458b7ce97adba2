//! The panels: functions of the model that draw themselves and return commands.
//!
//! Every panel is `show(ui, model, ask)`: it reads the model, writes only what belongs to looking (what the pointer is
//! over, which row is chosen), and pushes onto `ask` what shall be done.

pub mod author;
pub mod notes;
#[cfg(test)]
mod photo;
pub mod scenes;
