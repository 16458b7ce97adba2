//! `nudge doctor`: whether everything is there and works.

use super::{print, to_json};
use crate::doctor::{Diagnosis, Place};
use nudge_core::Error;
use std::fmt::Write as _;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// [`Error::Check`] when something is wrong.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let found = Diagnosis::of_this_machine();
    print(&if args.json { to_json(&found)? } else { table(&found) })?;
    match found.problems.len() {
        0 => Ok(()),
        1 => Err(Error::Check("one thing is wrong".to_owned()).into()),
        count => Err(Error::Check(format!("{count} things are wrong")).into()),
    }
}

/// Everything on lines of its own, then what is wrong with what to do.
fn table(found: &Diagnosis) -> String {
    let changed = if found.dirty == Some(true) { ", changed since" } else { "" };
    let mut text = format!("nudge {} (commit {}{changed})", found.version, found.commit);
    // Writing into a string cannot fail.
    if let Some(program) = &found.program {
        let _ = write!(text, ", {}", program.display());
    }
    text.push('\n');
    let mut line = |name: &str, words: &str| {
        let _ = writeln!(text, "  {name:<10} {words}");
    };
    let has = |has: bool| if has { "yes" } else { "not in this build" };
    line("networks", has(found.networks));
    line("window", has(found.window));
    line("weights", &place(&found.weights.place));
    for file in &found.weights.files {
        let bytes = file.bytes.map_or("not there".to_owned(), megabytes);
        let hash = file.sha256.as_ref().map_or(String::new(), |hash| format!(", SHA-256 {hash}"));
        line("", &format!("{}  {bytes}{hash}", file.file));
    }
    match found.weights.load {
        Some(true) => line("", "they load"),
        Some(false) => line("", "they do not load"),
        None => (),
    }
    line("scenes", &place(&found.scenes));
    if let Some(libtorch) = &found.libtorch {
        let version = libtorch.version.as_deref().unwrap_or("of an unknown version");
        let folder = libtorch.folder.as_ref().map_or("of an unknown folder".to_owned(), |at| at.display().to_string());
        line("libtorch", &format!("{version}, {folder}"));
    }
    if let Some(device) = found.device {
        line("device", device);
    }
    let of_networks = found.threads.networks.map_or(String::new(), |n| format!(", {n} for the networks"));
    let threads = &found.threads;
    line("threads", &format!("{} for planning{of_networks}; processors: {}", threads.planning, threads.processors));
    if let Some(graphics) = &found.graphics {
        let software = if graphics.software { ", the processor draws" } else { "" };
        let display = if graphics.display { "" } else { "; no display, so only `nudge shot` draws" };
        line("graphics", &format!("{} ({}{software}){display}", graphics.adapter, graphics.backend));
    } else {
        line("graphics", if found.window { "none" } else { "this build has no window" });
    }
    for (at, folder) in found.folders.iter().enumerate() {
        let free = folder.free_bytes.map_or(String::new(), |free| format!(", {} free", megabytes(free)));
        let state = if folder.fault.is_some() { "cannot be written to" } else { "can be written to" };
        let words = format!("{}: {}, {state}{free}", folder.path.display(), folder.purpose);
        line(if at == 0 { "folders" } else { "" }, &words);
    }
    if found.problems.is_empty() {
        text += "all is well\n";
    }
    for problem in &found.problems {
        let _ = writeln!(text, "wrong: {}; {}", problem.what, problem.remedy);
    }
    text
}

fn place(place: &Place) -> String {
    match (&place.folder, &place.found) {
        (Some(folder), Some(found)) => format!("{} ({found})", folder.display()),
        _ => "not found".to_owned(),
    }
}

fn megabytes(bytes: u64) -> String {
    match bytes {
        0..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}
