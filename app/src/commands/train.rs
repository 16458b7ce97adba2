//! `nudge train`: train the networks, and turn checkpoints into weights.

#[cfg(feature = "cnabu")]
mod curve;
#[cfg(feature = "cnabu")]
mod export;
#[cfg(feature = "cnabu")]
mod lineage;
#[cfg(feature = "cnabu")]
mod observe;
#[cfg(feature = "cnabu")]
mod push;
#[cfg(feature = "cnabu")]
mod session;

use std::path::PathBuf;

/// Train the networks of the belief update.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand, Debug)]
enum Command {
    /// Train sigma_o, the update with an observation, on data of `nudge data maps`
    Observe(ObserveArgs),
    /// Train sigma_m, the update with a push, on data of `nudge data pushes`
    Push(PushArgs),
    /// Turn a checkpoint into weights with a card, scored on held-out scenes
    Export(ExportArgs),
}

/// What was typed of a training run, whatever the network.
#[derive(clap::Args, Debug)]
#[cfg_attr(not(feature = "cnabu"), allow(dead_code, reason = "nothing is trained in a build without networks"))]
pub(super) struct SessionArgs {
    /// Training data
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Validation data: the running mean of the weights is scored on it now and then
    #[arg(long, value_name = "DIR")]
    val: Option<PathBuf>,
    /// Name of the run: writes FILE.safetensors (checkpoint), FILE.toml (settings), FILE.jsonl (losses)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Continue the run from its checkpoint
    #[arg(long)]
    resume: bool,
    /// Begin with the checkpoint of another run, or with finished weights (FILE.safetensors)
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    from: Option<PathBuf>,
    /// Replace the run that is there
    #[arg(long, conflicts_with = "resume")]
    force: bool,
    /// Write the curves into FILE.rrd too, live, for the Rerun viewer
    #[arg(long)]
    follow: bool,
    /// Stop after so many minutes
    #[arg(long)]
    minutes: Option<f64>,
    /// Stop at so many updates of the weights
    #[arg(long)]
    updates: Option<u64>,
    /// Let the step size fall to nothing over the last so many updates (with --updates)
    #[arg(long, default_value_t = 0, requires = "updates")]
    cooldown: u64,
    /// Stop when so many validations in a row have not improved
    #[arg(long, requires = "val")]
    patience: Option<usize>,
    /// Seed of the first weights and of every choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Scenes in a batch
    #[arg(long, default_value_t = 4)]
    batch: usize,
    /// Adam's step size
    #[arg(long, default_value_t = 1e-3)]
    learning_rate: f64,
    /// Weight of the KL term
    #[arg(long, default_value_t = 0.02)]
    kl: f64,
    /// Threads of libtorch
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// cpu, cuda, or auto for CUDA when it is there
    #[arg(long, default_value = "auto")]
    device: String,
    /// Minutes between checkpoints
    #[arg(long, default_value_t = 3.0)]
    checkpoint_minutes: f64,
    /// Minutes between validations
    #[arg(long, default_value_t = 15.0)]
    validate_minutes: f64,
    /// Validation scenes to use
    #[arg(long, default_value_t = 16)]
    validate_scenes: usize,
}

/// What was typed after `nudge train observe`.
#[derive(clap::Args, Debug)]
#[cfg_attr(not(feature = "cnabu"), allow(dead_code, reason = "nothing is trained in a build without networks"))]
pub(super) struct ObserveArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Channels of the U-Net's first level
    #[arg(long, default_value_t = 32)]
    width: i64,
    /// Most views in a sequence
    #[arg(long, default_value_t = 20)]
    max_views: usize,
    /// Share of the scenes that are shifted (to 4 cm) and turned (to 8 degrees) on their board, beside mirroring
    #[arg(long, default_value_t = 0.25)]
    move_share: f64,
    /// Data of `nudge data pushes`: some sequences begin after a push, as the shipped networks predict it
    #[arg(long, value_name = "DIR")]
    pushes: Option<PathBuf>,
    /// Share of the sequences that do
    #[arg(long, default_value_t = 0.3, requires = "pushes")]
    push_share: f64,
}

/// What was typed after `nudge train push`.
#[derive(clap::Args, Debug)]
#[cfg_attr(not(feature = "cnabu"), allow(dead_code, reason = "nothing is trained in a build without networks"))]
pub(super) struct PushArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Weights of sigma_o, which makes the beliefs [default: the shipped ones]
    #[arg(long, value_name = "FILE")]
    observe: Option<PathBuf>,
    /// Channels of the U-Net's first level
    #[arg(long, default_value_t = 24)]
    width: i64,
}

/// Which network a checkpoint is of.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Network {
    /// sigma_o
    Observe,
    /// sigma_m
    Push,
}

/// What was typed after `nudge train export`.
#[derive(clap::Args, Debug)]
#[cfg_attr(not(feature = "cnabu"), allow(dead_code, reason = "nothing is exported in a build without networks"))]
pub(super) struct ExportArgs {
    /// Which network it is
    network: Network,
    /// Name of the run; for sigma_m also finished weights (FILE.safetensors), to calibrate and score them anew
    run: PathBuf,
    /// Held-out data that the card's scores are of
    #[arg(long, value_name = "DIR")]
    test: PathBuf,
    /// Validation data of pushes: fits the temperature of sigma_m's probabilities of change
    #[arg(long, value_name = "DIR")]
    val: Option<PathBuf>,
    /// Scenes of the held-out data to use
    #[arg(long, default_value_t = 300)]
    scenes: usize,
    /// The training data, for the card
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Directory of the weights: writes sigma_o.safetensors or sigma_m.safetensors there, and its card beside it
    #[arg(long, value_name = "DIR", default_value = "models")]
    out: PathBuf,
    /// Keep 16 bits of every weight instead of 32
    #[arg(long)]
    half: bool,
}

/// Runs the command.
///
/// # Errors
/// In a build without networks; for wrong use, bad data and checkpoints, and what cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    #[cfg(feature = "cnabu")]
    return match &args.command {
        Command::Observe(args) => observe::run(args),
        Command::Push(args) => push::run(args),
        Command::Export(args) => export::run(args),
    };
    #[cfg(not(feature = "cnabu"))]
    {
        let _ = args;
        Err(super::no_networks().into())
    }
}
