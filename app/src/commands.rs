//! The command line: one file per subcommand.

use clap::{Parser, Subcommand};
use std::io::Write;
use std::process::ExitCode;

mod mesh;
mod replay;
mod run;
mod scene;
mod views;

/// Manipulation-enhanced mapping of cluttered shelves: look, push, and know how sure you are.
#[derive(Parser)]
#[command(name = "nudge", version, about, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Map a scene with a policy and write the episode
    Run(run::Args),
    /// Re-run an episode from its log and verify every step
    Replay(replay::Args),
    /// Make, check and draw scenes
    #[command(subcommand)]
    Scene(scene::Command),
    /// Show what Nudge makes of a mesh
    Mesh(mesh::Args),
    /// Print the poses of a view array
    Views(views::Args),
}

/// Parses the command line, runs the command and turns errors into one line and an exit code: 0 for success, 1 for a
/// failed check, 2 for wrong use or bad input.
pub fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Run(args) => run::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Scene(command) => scene::run(&command),
        Command::Mesh(args) => mesh::run(&args),
        Command::Views(args) => views::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("nudge: {error:#}");
            ExitCode::from(error.downcast_ref::<nudge_core::Error>().map_or(2, nudge_core::Error::exit_code))
        }
    }
}

/// Prints a result on standard output.
fn print(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    if !text.ends_with('\n') {
        out.write_all(b"\n")?;
    }
    out.flush()
}

/// Tells of something on standard error that does not stop the work.
fn warn(message: &str) {
    eprintln!("warning: {message}");
}

/// Whether the reader of our output went away (`nudge … | head`), which is no error of ours.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<std::io::Error>().is_some_and(|io| io.kind() == std::io::ErrorKind::BrokenPipe)
}
