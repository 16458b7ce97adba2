//! `nudge` and `nudge open FILE`: the workbench.

use super::convert::{Maps, import, is_map};
use crate::planner_args::ChosenLastArgs;
use crate::workbench::app::FormOptions;
use crate::workbench::file_kind::FileKind;
use anyhow::Context;
use nudge_core::camera::{NoiseModel, ViewArray};
use nudge_core::episode::{EpisodeDir, Overwrite};
use nudge_core::foreign::CONVERTED;
use nudge_core::plan::{PlannerSettings, PolicyKind};
use nudge_core::scene::Catalog;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What was typed.
#[derive(clap::Args, Debug, Default)]
pub struct Args {
    /// A scene (.toml), an episode's directory, a recording (.rrd), or a map of another program (.bt, .ot, .ply, .npz, or a
    /// folder of .npz), which becomes an episode in the folder that new ones go to (`nudge convert` takes a board and a scene)
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
    /// The view array: standard300, real75, or a file (default: the one chosen last)
    #[arg(long)]
    pub views: Option<String>,
    /// What the camera gets wrong: nothing, or as much as a consumer depth camera on an arm (default: the one chosen last)
    #[arg(long, value_name = "none|standard")]
    pub noise: Option<String>,
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
    #[command(flatten)]
    pub own: super::OwnArgs,
    #[command(flatten)]
    pub planner: ChosenLastArgs,
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
    args.own.choose()?;
    // Wrong choices are told here, where the command line is, and not in the window.
    args.views.as_deref().map_or(Ok(()), |views| ViewArray::named(views).map(|_| ()))?;
    let noise = args.noise.as_deref().map(NoiseModel::named).transpose()?;
    args.planner.0.onto(PlannerSettings::default())?;
    if let Some(port) = args.serve {
        std::net::TcpListener::bind((crate::workbench::viewer::LOOPBACK, port))
            .with_context(|| format!("--serve {port}: the port cannot be opened"))?;
    }
    let open = args.file.as_deref().map(|file| converted(file, &args.out)).transpose()?;
    let options = crate::workbench::app::Options {
        open,
        form: FormOptions {
            policy: args.policy,
            budget: args.budget,
            seed: args.seed,
            views: args.views.clone(),
            noise,
            planner: args.planner.0.clone(),
        },
        out: args.out.clone(),
        shipped_scenes: nudge_core::places::SCENES.find().map(|found| found.path),
        remember: args.picture.is_none(),
        script: args.picture.clone().map(|picture| crate::workbench::app::Script { steps: args.steps, picture }),
        serve: args.serve,
        ..Default::default()
    };
    crate::workbench::run(options).map_err(|reason| anyhow::anyhow!("the window could not be opened: {reason}"))
}

/// What is to be opened: of a map of another program the episode that it becomes, in place of one that such a map became
/// before.
fn converted(file: &Path, out: &Path) -> anyhow::Result<PathBuf> {
    if !is_map(file) {
        return Ok(file.to_owned());
    }
    let (board, beliefs) = Maps::read(file)?.beliefs(None)?;
    let to = out.join(format!("{}-converted", super::map::name_of(file)));
    let is_older = || EpisodeDir::open(&to)?.record().map(|record| record.config.belief == CONVERTED);
    let overwrite = if is_older().unwrap_or(false) { Overwrite::Replace } else { Overwrite::Refuse };
    import(file, board, beliefs, None, Arc::new(Catalog::standard()), &to, overwrite)?;
    Ok(to)
}
