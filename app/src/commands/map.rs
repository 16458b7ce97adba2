//! `nudge map`: map a recording that others made.

mod table;

use super::progress::Progress;
use crate::driver::{Driver, belief_update};
use nudge_core::Error;
use nudge_core::camera::{ViewArray, ViewId};
use nudge_core::environment::Recorded;
use nudge_core::episode::{Episode, EpisodeConfig, Frames, Overwrite, StepRecord};
use nudge_core::files::write_atomically;
use nudge_core::plan::{Action, Decision, PolicyKind, Reason};
use nudge_core::recording::{Board, EDGE_DEG, LabelMap, Recording, Settings, Survey, find_board, inspect};
use nudge_core::scene::{Catalog, Scene};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The recording: a folder (depth/, pose/, intrinsics.json; label/ if there are labels), a TUM RGB-D sequence, a BOP scene,
    /// a folder with Nerfstudio's transforms.json, or an MCAP file of ROS 2
    recording: PathBuf,
    /// Where the shelf is in the recording, and how large [default: board.toml in the recording, else a shelf of
    /// 0.8 x 0.4 x 0.4 m at the origin of the recording's frame]
    #[arg(long, value_name = "FILE", conflicts_with = "find_board")]
    board: Option<PathBuf>,
    /// Find the board: the plane below the camera, its front edge and its size. It is written to board.toml in the
    /// episode's directory
    #[arg(long)]
    find_board: bool,
    /// What the numbers of the label images mean (TOML) [default: labels.toml in the recording, else they are class numbers
    /// of the catalogue]
    #[arg(long, value_name = "FILE")]
    labels: Option<PathBuf>,
    /// How the next frame is chosen: mem-no-push (the one that promises to tell most) or random [default: the recording's
    /// own order]
    #[arg(long, value_name = "mem-no-push|random")]
    policy: Option<PolicyKind>,
    /// Number of frames to map [default: all]
    #[arg(long)]
    budget: Option<usize>,
    /// Take every so many frames only
    #[arg(long, default_value_t = 1)]
    every: usize,
    /// Seed of random choices
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Metres in a unit of the depth images, against what the recording says: 0.001 for millimetres
    #[arg(long, value_name = "METRES", value_parser = positive)]
    depth_unit: Option<f64>,
    /// Drop depths that lie on no surface, but between an object's edge and what is behind it: steps in depth that are seen at
    /// less than this angle, degrees; 0 drops nothing
    #[arg(long, value_name = "DEGREES", default_value_t = EDGE_DEG)]
    edge_angle: f32,
    /// How far the times of a pose and an image may be apart, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.02)]
    tolerance: f64,
    /// The camera, for recordings that do not tell: an intrinsics.json
    #[arg(long, value_name = "FILE")]
    intrinsics: Option<PathBuf>,
    /// Which topics of an MCAP file are depth, camera, labels and poses (TOML) [default: what --inspect proposes]
    #[arg(long, value_name = "FILE")]
    topics: Option<PathBuf>,
    /// Print what is in an MCAP file and a topic map to begin with, and map nothing
    #[arg(long)]
    inspect: bool,
    /// How beliefs are updated: cnabu (the networks) or classical (counting of rays) [default: cnabu]
    #[arg(long, value_name = "cnabu|classical")]
    belief: Option<String>,
    #[command(flatten)]
    device: super::DeviceArgs,
    #[command(flatten)]
    planner: crate::planner_args::PlannerArgs,
    /// The episode's directory [default: out/NAME-map]
    #[arg(long)]
    out: Option<PathBuf>,
    /// Replace the episode that is in the directory
    #[arg(long)]
    force: bool,
    /// Do not file the frames in the episode: smaller, but `nudge replay --infer` needs them
    #[arg(long)]
    no_frames: bool,
    /// Print the table of frames and map nothing
    #[arg(long)]
    frames_only: bool,
    /// Print episode.json instead of the tables
    #[arg(long)]
    json: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| "must be a number above 0".to_owned())
}

/// The policies that only look.
const LOOKING: [PolicyKind; 3] = [PolicyKind::MemNoPush, PolicyKind::Random, PolicyKind::RandomCnabu];

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let started = Instant::now();
    args.device.choose()?;
    check(args)?;
    if args.inspect {
        return table::inspection(&args.recording, &inspect(&args.recording)?);
    }
    let catalog = Arc::new(Catalog::standard());
    let recording = Arc::new(Recording::open(&args.recording, settings(args, &catalog)?)?);
    let (board, from) = board(args, &recording)?;
    let name = name_of(&args.recording);
    let mut scene = Scene {
        name: name.clone(),
        description: String::new(),
        shelf: board.shelf,
        objects: Vec::new(),
        meshes: Default::default(),
        robot: Default::default(),
    };
    scene.check_numbers(args.board.as_deref().unwrap_or(&args.recording))?;
    let began = Instant::now();
    let survey = recording.survey(&board)?;
    if !args.json {
        table::frames(&recording, &survey, &board, &from)?;
    }
    for warning in &survey.warnings {
        super::warn(&format!("{}: {warning}", args.recording.display()));
    }
    if args.frames_only {
        return Ok(());
    }
    scene.description = description(args, &recording, &survey);
    let out = args.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{name}-map")));
    let mut driver = begin(args, scene, catalog, Recorded::new(recording.clone(), board, &survey), &out)?;
    write_atomically(&out.join("board.toml"), board.to_toml().as_bytes())?;
    let budget = driver.episode().record().config.budget;
    let progress = Progress::new("map", budget);
    while !driver.episode().is_finished() {
        let step = next(args, &mut driver)?;
        progress.at(step.index);
    }
    progress.finish();
    let mapping_s = began.elapsed().as_secs_f64();
    let record = driver.episode().record().clone();
    let labelled = survey.labelled();
    let episode = driver.finish()?;
    if args.json {
        super::print(&record.to_json())?;
    } else {
        table::summary(&episode, labelled, &out, [started.elapsed().as_secs_f64(), mapping_s]);
    }
    Ok(())
}

fn check(args: &Args) -> Result<(), Error> {
    if let Some(policy) = args.policy.filter(|policy| !LOOKING.contains(policy)) {
        let message = format!(
            "policy {policy} moves things or asks for the truth; a recording is mapped with mem-no-push or random"
        );
        return Err(Error::Usage(message));
    }
    if !(0.0..=45.0).contains(&args.edge_angle) {
        return Err(Error::Usage(format!("--edge-angle {}: must be from 0 to 45 degrees", args.edge_angle)));
    }
    if !(args.tolerance.is_finite() && args.tolerance >= 0.0) {
        return Err(Error::Usage(format!("--tolerance {}: must be a number of seconds from 0", args.tolerance)));
    }
    Ok(())
}

fn settings(args: &Args, catalog: &Catalog) -> Result<Settings, Error> {
    let beside = || Some(args.recording.join("labels.toml")).filter(|file| file.is_file());
    let labels = args.labels.clone().or_else(beside).map(|file| LabelMap::read(&file, catalog)).transpose()?;
    Ok(Settings {
        labels,
        depth_unit_m: args.depth_unit,
        edge_deg: args.edge_angle,
        tolerance_s: args.tolerance,
        every: args.every,
        intrinsics: args.intrinsics.clone(),
        topics: args.topics.clone(),
    })
}

/// The board, and where it is from, in words.
fn board(args: &Args, recording: &Recording) -> Result<(Board, String), Error> {
    if args.find_board {
        return Ok((find_board(recording)?, "found".to_owned()));
    }
    let beside = || Some(args.recording.join("board.toml")).filter(|file| file.is_file());
    match args.board.clone().or_else(beside) {
        Some(file) => Ok((Board::read(&file)?, format!("from {}", file.display()))),
        None => Ok((Board::default(), "at the origin of the recording's frame (no board.toml)".to_owned())),
    }
}

/// The recording's name as a scene's.
fn name_of(recording: &Path) -> String {
    let whole = recording.canonicalize().unwrap_or_else(|_| recording.to_owned());
    let name = whole.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let name: String =
        name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).take(60).collect();
    let name = name.trim_start_matches('.');
    if name.is_empty() { "recording".to_owned() } else { name.to_owned() }
}

fn description(args: &Args, recording: &Recording, survey: &Survey) -> String {
    let order = args.policy.map_or("in the recording's order".to_owned(), |policy| format!("chosen by {policy}"));
    let labels = if survey.labelled() == 0 { "; no labels: only occupancy is mapped" } else { "" };
    let used = survey.used().len();
    format!("a recording ({}), {used} of {} frames {order}{labels}", recording.format(), recording.len())
}

fn begin(args: &Args, scene: Scene, catalog: Arc<Catalog>, recorded: Recorded, out: &Path) -> Result<Driver, Error> {
    // The order of the recording is a choice that no policy made; the episode still names one that only looks.
    let is_classical = args.belief.as_deref() == Some("classical");
    let in_order = if is_classical { PolicyKind::Random } else { PolicyKind::RandomCnabu };
    let policy = args.policy.map_or(in_order, |policy| if policy == PolicyKind::Random { in_order } else { policy });
    let update = belief_update(args.belief.as_deref(), policy)?;
    let environment = Box::new(recorded);
    let frames = nudge_core::environment::Environment::views(&*environment).map_or(0, |views| views.views.len());
    let budget = args.budget.unwrap_or(frames);
    if budget > frames {
        return Err(Error::Usage(format!("--budget {budget}: the recording has {frames} frames to map")));
    }
    let config = EpisodeConfig {
        policy,
        belief: update.name().to_owned(),
        seed: args.seed,
        budget,
        views: ViewArray::RECORDED.to_owned(),
        planner: args.planner.settings(update.name())?,
        noise: None,
    };
    let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
    let frames = if args.no_frames { Frames::Left } else { Frames::Filed };
    Driver::start(Episode::within(environment, scene, catalog, config, update)?, out, overwrite, frames)
}

/// Maps the next frame.
fn next(args: &Args, driver: &mut Driver) -> Result<StepRecord, Error> {
    // What comes next in the recording's own order, nobody weighed.
    let in_order = || {
        let view = ViewId(driver.episode().record().steps.len() as u16);
        Decision::unweighed(Action::Look { view }, Reason::Manual)
    };
    let decision = if args.policy.is_some() { driver.decide() } else { in_order() };
    Ok(driver.act(decision)?.record)
}
