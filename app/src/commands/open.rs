//! `nudge` and `nudge open FILE`: the workbench.

use std::path::PathBuf;

/// What was typed.
#[derive(clap::Args, Debug, Default)]
pub struct Args {
    /// A scene (.toml), an episode's directory, or a recording (.rrd)
    pub file: Option<PathBuf>,
    /// The folder that new episodes go to
    #[arg(long, default_value = "out")]
    pub out: PathBuf,
    /// Write a picture of the window once everything is drawn, and end
    #[arg(long, value_name = "PNG")]
    pub picture: Option<PathBuf>,
    /// Do this many actions first
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub steps: usize,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(file) = args.file.as_ref().filter(|file| !file.exists()) {
        anyhow::bail!("{}: no such file or directory", file.display());
    }
    let options = crate::workbench::app::Options {
        open: args.file.clone(),
        out: args.out.clone(),
        remember: args.picture.is_none(),
        script: args.picture.clone().map(|picture| crate::workbench::app::Script { steps: args.steps, picture }),
        ..Default::default()
    };
    crate::workbench::run(options).map_err(|reason| anyhow::anyhow!("the window could not be opened: {reason}"))
}
