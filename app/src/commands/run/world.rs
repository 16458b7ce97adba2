//! `nudge run --world`: looks and motions are carried out by another program.

use crate::driver::Driver;
use nudge_core::belief::BeliefUpdate;
use nudge_core::environment::{External, WorldSettings};
use nudge_core::episode::{Episode, EpisodeConfig, EpisodeRecord, Observer};
use nudge_core::scene::{Catalog, Scene};
use nudge_core::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Another program carries out looks and motions: a robot, another simulator. It is started by a shell and speaks JSON lines
    /// on its standard input and output (docs/world-protocol.md); the scene says which shelf and robot it is about
    #[arg(long = "world", value_name = "COMMAND")]
    pub(super) command: Option<String>,
    /// How long the world may take for an answer, seconds
    #[arg(long = "world-timeout", value_name = "SECONDS", default_value_t = 60.0, requires = "command")]
    timeout_s: f64,
    /// The folder of the world's images [default: a temporary one]
    #[arg(long = "world-folder", value_name = "FOLDER", requires = "command")]
    folder: Option<PathBuf>,
}

/// The scene as an episode files it that knows the shelf and not what stands in it.
pub(super) fn unknown(scene: &Scene) -> Scene {
    Scene { objects: Vec::new(), meshes: Default::default(), ..scene.clone() }
}

fn settings(args: &Args, seed: u64) -> Result<WorldSettings> {
    if !(args.timeout_s.is_finite() && (0.01..=86_400.0).contains(&args.timeout_s)) {
        return Err(Error::Usage(format!("--world-timeout {}: must be from 0.01 to 86400 seconds", args.timeout_s)));
    }
    let folder = match &args.folder {
        Some(folder) => folder.clone(),
        None => std::env::temp_dir().join(format!("nudge-world-{}", std::process::id())),
    };
    std::fs::create_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
    let folder = folder.canonicalize().map_err(|error| Error::io(&folder, error))?;
    let command = args.command.clone().unwrap_or_default();
    Ok(WorldSettings { command, timeout_s: args.timeout_s, folder, seed })
}

/// An episode in the world, before its first action.
pub(super) fn begin(
    args: &Args,
    scene: Scene,
    catalog: Arc<Catalog>,
    config: EpisodeConfig,
    update: Arc<dyn BeliefUpdate>,
) -> Result<Episode> {
    let world = Box::new(External::start(&settings(args, config.seed)?, &scene, &[])?);
    Episode::within(world, unknown(&scene), catalog, config, update)
}

/// Goes on with an episode, now that the world is back.
pub(super) fn go_on(
    args: &Args,
    scene: &Scene,
    logged: &EpisodeRecord,
    catalog: Arc<Catalog>,
    update: Arc<dyn BeliefUpdate>,
    out: &Path,
    watch: Observer<'_>,
) -> Result<Driver> {
    let done: Vec<_> = logged.steps.iter().filter_map(done).collect();
    let world = Box::new(External::start(&settings(args, logged.config.seed)?, scene, &done)?);
    Driver::resume_within(world, out, catalog, update, watch)
}

/// The motion that a step carried out, if it was one.
fn done(step: &nudge_core::episode::StepRecord) -> Option<nudge_core::arm::PhasedMotion> {
    let is_motion = matches!(step.action, nudge_core::plan::Action::Manipulate(_));
    step.decision.motion.clone().filter(|_| is_motion)
}
