//! `nudge convert`: maps of other programs into episodes, and beliefs of episodes into maps for other programs.

use crate::driver::Driver;
use nudge_core::Error;
use nudge_core::belief::Belief;
use nudge_core::camera::{ViewArray, ViewId};
use nudge_core::episode::{Episode, EpisodeConfig, EpisodeDir, Frames, Overwrite};
use nudge_core::files::names_in;
use nudge_core::foreign::{Blank, CONVERTED, ForeignMap, Given, MapFormat, read_map, write_map};
use nudge_core::plan::{Action, Decision, PlannerSettings, PolicyKind, Reason};
use nudge_core::recording::Board;
use nudge_core::scene::{Catalog, Scene, Shelf};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A map of another program (.bt or .ot of OctoMap, a point cloud .ply, a belief .npz), a folder of .npz beliefs, or an
    /// episode's directory
    from: PathBuf,
    /// The directory of the episode to make, or the map to write: .bt, .ply or .npz
    to: PathBuf,
    /// Of an episode, the step whose belief is written, 0 for the prior [default: the last]
    #[arg(long, value_name = "N")]
    step: Option<usize>,
    /// Where the shelf is in the map's frame, and how large (board.toml) [default: a shelf of 0.8 x 0.4 x 0.4 m at its origin;
    /// of .npz, all of it]
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    board: Option<PathBuf>,
    /// Score the map against this scene, whose shelf's frame is the map's
    #[arg(long, value_name = "SCENE")]
    scene: Option<PathBuf>,
    /// Replace the episode that is in the directory
    #[arg(long)]
    force: bool,
}

/// The views of an episode of a scene; what is seen from them is shown beside the map and never looked at by it.
const VIEWS: &str = "standard300";

/// Whether an episode is there.
fn is_episode(path: &Path) -> bool {
    path.join("episode.json").is_file()
}

/// Whether a path is a map of another program, or a folder of them, and no episode.
#[cfg(feature = "workbench")]
pub(super) fn is_map(path: &Path) -> bool {
    let is_archive = |name: &String| MapFormat::of(Path::new(name)) == Some(MapFormat::Archive);
    if path.is_dir() {
        return !is_episode(path) && names_in(path).is_ok_and(|names| names.iter().any(is_archive));
    }
    MapFormat::of(path).is_some()
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    if is_episode(&args.from) {
        return export(args);
    }
    if args.step.is_some() {
        return Err(Error::Usage("--step: only an episode has steps".to_owned()).into());
    }
    let catalog = Arc::new(Catalog::standard());
    let maps = Maps::read(&args.from)?;
    let scene = args.scene.as_deref().map(|path| Scene::load(path, &catalog)).transpose()?;
    let board = match (&args.board, &scene) {
        (Some(file), _) => Some(Board::read(file)?),
        (None, Some((scene, _))) => Some(Board { shelf: scene.shelf, ..Board::default() }),
        (None, None) => None,
    };
    let (board, beliefs) = maps.beliefs(board)?;
    if MapFormat::of(&args.to).is_some() {
        let [belief] = &beliefs[..] else {
            let message = format!("{}: a folder of maps becomes an episode, not one file", args.to.display());
            return Err(Error::Usage(message).into());
        };
        write_map(&args.to, belief)?;
        return super::print(&format!("{}\n", args.to.display()));
    }
    let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
    let episode = import(&args.from, board, beliefs, scene.map(|(scene, _)| scene), catalog, &args.to, overwrite)?;
    super::print(&summary(&episode, &args.to))
}

/// Writes the belief of a step.
fn export(args: &Args) -> anyhow::Result<()> {
    if args.board.is_some() || args.scene.is_some() {
        return Err(Error::Usage("--board and --scene are for maps of other programs".to_owned()).into());
    }
    let directory = EpisodeDir::open(&args.from)?;
    let steps = directory.record()?.steps.len();
    let step = args.step.unwrap_or(steps);
    if step > steps {
        return Err(Error::Usage(format!("--step {step}: the episode has {steps} steps")).into());
    }
    write_map(&args.to, &directory.read_belief(step)?)?;
    super::print(&format!("{}: the belief after {step} of {steps} steps\n", args.to.display()))
}

/// Maps that become the steps of one episode.
pub(super) struct Maps(Vec<ForeignMap>);

impl Maps {
    /// Reads a map, or the archives of a folder in the order of their names.
    pub(super) fn read(path: &Path) -> nudge_core::Result<Self> {
        if !path.is_dir() {
            return Ok(Self(vec![read_map(path)?]));
        }
        let mut names = names_in(path)?;
        names.retain(|name| MapFormat::of(Path::new(name)) == Some(MapFormat::Archive));
        names.sort();
        if names.is_empty() {
            return Err(Error::input(path, "", "holds neither an episode nor .npz beliefs"));
        }
        Ok(Self(names.iter().map(|name| read_map(&path.join(name))).collect::<Result<_, _>>()?))
    }

    /// What they say of the shelf of a board, by default the one that they tell; what was done on the way goes to standard
    /// error.
    pub(super) fn beliefs(self, board: Option<Board>) -> nudge_core::Result<(Board, Vec<Belief>)> {
        let told = self.0.iter().find_map(ForeignMap::shelf);
        let own = || told.map_or_else(Board::default, |shelf| Board { shelf, ..Board::default() });
        let board = board.unwrap_or_else(own);
        let path = self.0.first().map_or_else(PathBuf::new, |map| map.path().to_owned());
        empty(&path, board.shelf).check_numbers(&path)?;
        let mut beliefs = Vec::new();
        for map in &self.0 {
            let placed = map.belief(&board)?;
            placed.remarks.iter().for_each(|remark| eprintln!("{}: {remark}", map.path().display()));
            beliefs.push(placed.belief);
        }
        Ok((board, beliefs))
    }
}

/// A shelf of which nobody knows what stands in it.
fn empty(from: &Path, shelf: Shelf) -> Scene {
    Scene {
        name: super::map::name_of(from),
        description: format!("a map of another program: {}", from.file_name().unwrap_or_default().to_string_lossy()),
        shelf,
        objects: Vec::new(),
        meshes: Default::default(),
        robot: Default::default(),
    }
}

/// Writes an episode whose steps are these beliefs; with a scene it has a truth and is scored.
pub(super) fn import(
    from: &Path,
    board: Board,
    beliefs: Vec<Belief>,
    scene: Option<Scene>,
    catalog: Arc<Catalog>,
    out: &Path,
    overwrite: Overwrite,
) -> nudge_core::Result<Episode> {
    let budget = beliefs.len();
    let update = Arc::new(Given::new(beliefs));
    let config = |views: &str| EpisodeConfig {
        policy: PolicyKind::Random,
        belief: CONVERTED.to_owned(),
        seed: 0,
        budget,
        views: views.to_owned(),
        planner: PlannerSettings::default(),
        noise: None,
    };
    let frames = Frames::Left;
    let mut driver = match scene {
        Some(scene) => Driver::start(Episode::new(scene, catalog, config(VIEWS), update)?, out, overwrite, frames)?,
        None => {
            let (scene, config) = (empty(from, board.shelf), config(ViewArray::RECORDED));
            let blank = Box::new(Blank::new(budget));
            Driver::start(Episode::within(blank, scene, catalog, config, update)?, out, overwrite, frames)?
        }
    };
    let views = driver.episode().views().views.len();
    for step in 0..budget {
        let view = ViewId((step % views) as u16);
        driver.act(Decision::unweighed(Action::Look { view }, Reason::Manual))?;
    }
    driver.finish()
}

fn summary(episode: &Episode, out: &Path) -> String {
    let record = episode.record();
    let mut text = String::new();
    if record.has_truth() {
        text += "step  occupancy IoU  occupied IoU  semantic mIoU  mECE occ.  mECE sem.  H nats\n";
        for step in &record.steps {
            if let Some(s) = step.scores() {
                text += &format!(
                    "{:>4}  {:>13.3}  {:>12.3}  {:>13.3}  {:>9.3}  {:>9.3}  {:>6.0}\n",
                    step.index,
                    s.occupancy_iou,
                    s.occupied_iou,
                    s.semantic_miou,
                    s.mece_occupancy,
                    s.mece_semantics,
                    s.entropy_nats
                );
            }
        }
    }
    let steps = record.steps.len();
    text + &format!("{}: an episode of {steps} {}\n", out.display(), if steps == 1 { "step" } else { "steps" })
}
