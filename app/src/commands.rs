//! The command line: one file per subcommand.

use crate::driver::own::{self, OwnFiles};
use crate::planner_args::PlannerArgs;
use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;

mod bench;
mod calibrate;
mod convert;
mod data;
mod doctor;
mod manual;
mod map;
mod mesh;
#[cfg(not(feature = "workbench"))]
mod no_window;
#[cfg(feature = "workbench")]
mod open;
mod probe;
mod progress;
mod regress;
mod replay;
mod report;
mod robot;
mod run;
mod scene;
mod settings;
mod share;
#[cfg(feature = "workbench")]
mod shot;
mod train;
mod views;

#[cfg(not(feature = "workbench"))]
use no_window::{self as open, self as shot};

/// Manipulation-enhanced mapping of cluttered shelves: look, push, and know how sure you are.
#[derive(Parser)]
#[command(name = "nudge", version, about, after_help = ENVIRONMENT, arg_required_else_help = !cfg!(feature = "workbench"))]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

/// What help and the man page say at their end.
const ENVIRONMENT: &str = "\
Environment:
  NUDGE_MODELS  Folder of the networks' weights, in place of those that came with the program
  NUDGE_SCENES  Folder of scenes, in place of those that came with the program
  NUDGE_DEVICE  Device of the networks: auto, cpu or cuda

Exit codes: 0 for success, 1 for a check that failed, 2 for wrong use or bad input";

#[derive(Subcommand)]
enum Command {
    /// Open the workbench, with a scene, an episode or a recording (the same as no command)
    Open(open::Args),
    /// Render the workbench's window to a picture, without a display
    Shot(shot::Args),
    /// Map a scene with a policy and write the episode
    Run(run::Args),
    /// Map a recording that a real camera or another program made, and write the episode
    Map(map::Args),
    /// Turn maps of other programs into episodes, and beliefs into maps for other programs
    Convert(convert::Args),
    /// Run policies on sets of scenes, and put shards of that together
    Bench(bench::Args),
    /// Re-run an episode from its log and verify every step
    Replay(replay::Args),
    /// Carry out every push candidate of a decision, and hold what was promised against what it really does
    Probe(probe::Args),
    /// Hold the scores of a small fixed bench against golden ones
    Regress(regress::Args),
    /// Make one page that anyone can open, of an episode or of two beside each other
    Share(share::Args),
    /// Make a page of tables and charts of a bench
    Report(report::Args),
    /// Make, check, generate, rescale and draw scenes
    Scene(scene::Args),
    /// Check an arm's URDF file: what it reaches, and which views
    Robot(robot::Args),
    /// Make training data
    Data(data::Args),
    /// Train the networks of the belief update
    Train(train::Args),
    /// Score belief updates and their calibration on held-out scenes
    Calibrate(calibrate::Args),
    /// Show what Nudge makes of a mesh
    Mesh(mesh::Args),
    /// Print the poses of a view array
    Views(views::Args),
    /// Print the planner's settings: units, ranges, defaults and what they mean
    Settings(settings::Args),
    /// Tell what this installation is made of, and what is wrong with it
    Doctor(doctor::Args),
    /// Write man pages and shell completions
    #[command(hide = true)]
    Manual(manual::Args),
}

/// What was typed. Wrong use ends the program with one line and exit code 2, help and version with what was asked for.
fn parse() -> Cli {
    Cli::try_parse().unwrap_or_else(|error| {
        if !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            error.exit();
        }
        eprintln!("nudge: {}", in_one_line(&error.to_string()));
        std::process::exit(2);
    })
}

/// What clap says of wrong use, without the usage that it prints below.
fn in_one_line(said: &str) -> String {
    let lines = said.lines().map(str::trim).take_while(|line| !line.starts_with("Usage:"));
    let lines = lines.filter(|line| !line.is_empty() && !line.starts_with("For more information"));
    let said = lines.map(|line| line.strip_prefix("error: ").unwrap_or(line)).collect::<Vec<_>>().join(" ");
    format!("{}; --help tells more", said.replace(" tip: ", "; "))
}

/// Parses the command line, runs the command and turns errors into one line and an exit code: 0 for success, 1 for a
/// failed check, 2 for wrong use, bad input, or an output that fails.
pub fn main() -> ExitCode {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        // What a wall catches is told as an error.
        if !nudge_core::wall::is_guarding() {
            hook(panic);
        }
    }));
    let result = match parse().command {
        #[cfg(feature = "workbench")]
        None => open::run(&open::Args::default()),
        Some(Command::Open(args)) => open::run(&args),
        Some(Command::Shot(args)) => shot::run(&args),
        // Clap has shown the help already.
        #[cfg(not(feature = "workbench"))]
        None => Ok(()),
        Some(Command::Run(args)) => run::run(&args),
        Some(Command::Map(args)) => map::run(&args),
        Some(Command::Convert(args)) => convert::run(&args),
        Some(Command::Bench(args)) => bench::run(&args),
        Some(Command::Replay(args)) => replay::run(&args),
        Some(Command::Probe(args)) => probe::run(&args),
        Some(Command::Regress(args)) => regress::run(&args),
        Some(Command::Share(args)) => share::run(&args),
        Some(Command::Report(args)) => report::run(&args),
        Some(Command::Scene(args)) => scene::run(&args),
        Some(Command::Robot(args)) => robot::run(&args),
        Some(Command::Data(args)) => data::run(&args),
        Some(Command::Train(args)) => train::run(&args),
        Some(Command::Calibrate(args)) => calibrate::run(&args),
        Some(Command::Mesh(args)) => mesh::run(&args),
        Some(Command::Views(args)) => views::run(&args),
        Some(Command::Settings(args)) => settings::run(&args),
        Some(Command::Doctor(args)) => doctor::run(&args),
        Some(Command::Manual(args)) => manual::run(&args),
    };
    // An output that failed is told when the work is done.
    let result = result.and_then(|()| match crate::output::take_fault() {
        Some(error) => Err(anyhow::Error::new(error).context("standard output")),
        None => Ok(()),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("nudge: {error:#}");
            ExitCode::from(error.downcast_ref::<nudge_core::Error>().map_or(2, nudge_core::Error::exit_code))
        }
    }
}

/// Writes a result to standard output. Always `Ok`, so that a command can end with it: what is wrong with the output is
/// told when the work is done.
fn print(text: &str) -> anyhow::Result<()> {
    crate::output::print(text);
    Ok(())
}

/// A document as indented JSON with a line's end.
fn to_json(document: &impl Serialize) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(document)? + "\n")
}

/// Modules of the user's own.
#[derive(clap::Args, Debug, Default)]
pub struct OwnArgs {
    /// A TorchScript module of your own that updates the belief after a look, in place of sigma_o; what no module does, the
    /// classical update does, or the one that --belief names
    #[arg(long, value_name = "FILE.pt")]
    sigma_o: Option<PathBuf>,
    /// A TorchScript module of your own that predicts what a manipulation leaves, in place of sigma_m
    #[arg(long, value_name = "FILE.pt")]
    sigma_m: Option<PathBuf>,
}

impl OwnArgs {
    fn choose(&self) -> nudge_core::Result<()> {
        for file in [&self.sigma_o, &self.sigma_m].into_iter().flatten() {
            std::fs::metadata(file).map_err(|error| nudge_core::Error::io(file, error))?;
        }
        own::choose(OwnFiles { sigma_o: self.sigma_o.clone(), sigma_m: self.sigma_m.clone() });
        Ok(())
    }
}

/// What the networks are, where they are not those that came with the program, and where they run.
#[derive(clap::Args, Debug)]
struct DeviceArgs {
    #[command(flatten)]
    own: OwnArgs,
    /// Device of the networks: auto (CUDA when it is there), cpu or cuda [default: $NUDGE_DEVICE, or auto]
    #[arg(long, value_name = "auto|cpu|cuda")]
    device: Option<String>,
}

impl DeviceArgs {
    fn choose(&self) -> nudge_core::Result<()> {
        self.own.choose()?;
        self.device.as_deref().map_or(Ok(()), nudge_core::cnabu::choose_device)
    }
}

/// What is seen, what beliefs are updated by, and what is weighed how.
#[derive(clap::Args, Debug)]
struct PlanningArgs {
    /// How beliefs are updated: cnabu (the networks) or classical (counting of rays) [default: cnabu; the policy random is
    /// defined on the classical one]
    #[arg(long, value_name = "cnabu|classical")]
    belief: Option<String>,
    #[command(flatten)]
    device: DeviceArgs,
    /// The view array: standard300, real75, or a file
    #[arg(long, default_value = "standard300")]
    views: String,
    /// What the camera gets wrong: nothing, or as much as a consumer depth camera on an arm (depth, labels and poses)
    #[arg(long, default_value = "none", value_name = "none|standard")]
    noise: String,
    #[command(flatten)]
    planner: PlannerArgs,
}

impl PlanningArgs {
    /// The belief update that was asked for, after the device was chosen.
    fn belief(&self) -> Option<String> {
        own::with_own(self.belief.as_deref())
    }
}

/// What to say when networks are asked for in a build without them.
#[cfg(not(feature = "cnabu"))]
fn no_networks() -> nudge_core::Error {
    nudge_core::Error::Usage(crate::driver::WITHOUT_NETWORKS.to_owned())
}

/// Tells of something on standard error that does not stop the work.
fn warn(message: &str) {
    eprintln!("warning: {message}");
}

#[cfg(test)]
mod tests {
    use super::Cli;
    use clap::{CommandFactory, Parser};

    #[test]
    fn help_lists_the_windows_commands_in_every_build() {
        let help = Cli::command().render_help().to_string();
        for command in ["open", "shot", "run"] {
            assert!(help.lines().any(|line| line.trim_start().starts_with(&format!("{command} "))), "{help}");
        }
    }

    #[test]
    #[cfg(not(feature = "workbench"))]
    fn without_the_window_its_commands_say_so_whatever_is_typed() {
        let typed = ["nudge", "shot", "out/demo", "--layout", "why", "--out", "why.png"];
        let Some(super::Command::Shot(args)) = Cli::try_parse_from(typed).expect("taken").command else { panic!() };
        let said = super::shot::run(&args).expect_err("no window").to_string();
        assert!(said.contains("make workbench"), "{said}");
    }

    fn said(args: &[&str]) -> String {
        let error = Cli::try_parse_from(args).err().expect("wrong use");
        super::in_one_line(&error.to_string())
    }

    #[test]
    fn wrong_use_is_told_in_one_line() {
        assert_eq!(
            said(&["nudge", "scene", "check"]),
            "the following required arguments were not provided: <FILE>...; --help tells more"
        );
        assert_eq!(
            said(&["nudge", "settings", "--jso"]),
            "unexpected argument '--jso' found; a similar argument exists: '--json'; --help tells more"
        );
        assert!(said(&["nudge", "fly"]).starts_with("unrecognized subcommand 'fly'"));
    }
}
