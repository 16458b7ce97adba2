//! The workbench: one window to see a belief, ask why, try something else, and share it.
//!
//! [`model`] is what the window shows and holds every choice a person has made; [`command`] is everything that can be
//! asked; `panels/` draw the model and return commands; `app` carries them out. Episodes live on worker
//! threads (`worker`), floor maps and answers are made in the background (`latest`), files are written by tasks (`tasks`),
//! and `viewer` alone touches Rerun's viewer. `shot` renders the same window without a display.

pub mod app;
pub mod author;
pub mod browser;
pub mod changes;
pub mod columns;
pub mod command;
pub mod derive;
pub mod dialog;
pub mod export;
pub mod file_kind;
pub mod filed;
pub mod graphics;
pub mod half_belief;
mod icon;
pub mod latest;
pub mod layout_kind;
pub mod menu;
pub mod model;
pub mod packed;
pub mod packed_frame;
pub mod panels;
pub mod part;
pub mod picked;
pub mod ray;
pub mod recording_file;
pub mod session;
pub mod shot;
pub mod space;
pub mod tasks;
pub mod theme;
pub mod threads;
pub mod toasts;
pub mod viewer;
pub mod worker;

#[cfg(test)]
mod fixture;

use re_viewer::external::eframe;
use re_viewer::external::egui;

/// The name that desktops know the window by, and eframe the folder of what outlasts the program.
pub const APP_ID: &str = "nudge";

/// Opens the window and returns when it is closed.
///
/// # Errors
/// When there is no display, or no temporary folder for a window that remembers nothing.
pub fn run(options: app::Options) -> Result<(), String> {
    let mut native = re_viewer::native::eframe_options(None);
    native.viewport = egui::ViewportBuilder::default()
        .with_app_id(APP_ID)
        .with_icon(icon::icon())
        .with_title("Nudge")
        .with_inner_size([1440.0, 900.0])
        .with_min_inner_size([900.0, 560.0]);
    // What remembers nothing begins like the first time, and leaves no trace: eframe keeps the sizes of panels by itself.
    let scratch = if options.remember { None } else { Some(tempfile::tempdir().map_err(|error| error.to_string())?) };
    native.persistence_path = scratch.as_ref().map(|folder| folder.path().join("app.ron"));
    let threads = options.threads.clone();
    let closed =
        eframe::run_native("Nudge", native, Box::new(move |cc| Ok(Box::new(app::App::new(cc, options.clone())))));
    // Episodes still end their recordings.
    threads.join();
    closed.map_err(|error| error.to_string())
}
