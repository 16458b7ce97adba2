//! `nudge` and `nudge open FILE`: the workbench.

use crate::workbench::app::FormOptions;
use crate::workbench::file_kind::FileKind;
use anyhow::Context;
use nudge_core::plan::PolicyKind;
use std::path::PathBuf;

/// What was typed.
#[derive(clap::Args, Debug, Default)]
pub struct Args {
    /// A scene (.toml), an episode's directory, or a recording (.rrd)
    pub file: Option<PathBuf>,
    /// The rule that chooses actions (default: the one chosen last)
    #[arg(long)]
    pub policy: Option<PolicyKind>,
    /// Number of actions (default: the one chosen last)
    #[arg(long)]
    pub budget: Option<usize>,
    /// Seed of every random choice (default: the one chosen last)
    #[arg(long)]
    pub seed: Option<u64>,
    /// The folder that new episodes go to
    #[arg(long, default_value = "out")]
    pub out: PathBuf,
    /// Write a picture of the window once everything is drawn, and end
    #[arg(long, value_name = "PNG")]
    pub picture: Option<PathBuf>,
    /// Do this many actions first
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub steps: usize,
    /// Let other Rerun viewers on this machine look on, at 127.0.0.1 and this port; without it no port is opened
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "9876", value_parser = clap::value_parser!(u16).range(1..))]
    pub serve: Option<u16>,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(file) = args.file.as_ref().filter(|file| !file.exists()) {
        anyhow::bail!("{}: no such file or directory", file.display());
    }
    if let (Some(file), Some(_)) = (&args.file, &args.picture)
        && FileKind::of(file) == FileKind::Scene
    {
        // Nobody would see the message in the window.
        nudge_core::scene::Scene::load(file, &nudge_core::scene::Catalog::standard())?;
    }
    if let Some(port) = args.serve {
        std::net::TcpListener::bind((crate::workbench::viewer::LOOPBACK, port))
            .with_context(|| format!("--serve {port}: the port cannot be opened"))?;
    }
    let options = crate::workbench::app::Options {
        open: args.file.clone(),
        form: FormOptions { policy: args.policy, budget: args.budget, seed: args.seed },
        out: args.out.clone(),
        shipped_scenes: nudge_core::places::SCENES.find().map(|found| found.path),
        remember: args.picture.is_none(),
        script: args.picture.clone().map(|picture| crate::workbench::app::Script { steps: args.steps, picture }),
        serve: args.serve,
        ..Default::default()
    };
    crate::workbench::run(options).map_err(|reason| anyhow::anyhow!("the window could not be opened: {reason}"))
}
