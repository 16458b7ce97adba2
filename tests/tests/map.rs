//! Recordings that others made: read, mapped, opened again, and refused in one line where something is wrong with them.

#[path = "map/bad.rs"]
mod bad;
#[path = "map/formats.rs"]
mod formats;
#[path = "map/mcaps.rs"]
mod mcaps;
#[path = "map/mujoco.rs"]
mod mujoco;
#[path = "map/real.rs"]
mod real;
#[path = "map/world.rs"]
mod world;
#[path = "map/written.rs"]
mod written;
