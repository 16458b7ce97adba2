//! `nudge run`: map a scene with a policy and write the episode.

mod table;
mod world;

use super::progress::Progress;
use crate::driver::{Driver, belief_update, default_out};
use nudge_core::Error;
use nudge_core::camera::NoiseModel;
use nudge_core::episode::{
    DirectoryState, Episode, EpisodeConfig, EpisodeDir, EpisodeRecord, Frames, Overwrite, StepOutcome, StepRecord,
};
use nudge_core::plan::{Action, PolicyKind};
use nudge_core::scene::{Catalog, ObjectId, RobotFile, Scene};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The scene file
    scene: PathBuf,
    /// The arm, in place of the scene's: gripper or suction, which come with the program, or a URDF file; by default the
    /// hand is what the policy needs
    #[arg(long, value_name = "gripper|suction|FILE")]
    arm: Option<String>,
    /// The rule that chooses actions: mem, mem-no-push, random, random-cnabu, random-push-5, random-push-5-blind,
    /// random-view-push-5, saturation; with suction mem-pick, random-pick-5, greedy-front-pick; and as ceilings, since they know the truth, oracle (the view that really tells most) and
    /// clairvoyant-push (mem, but each push is carried out in a copy of the world before one is chosen)
    #[arg(long, default_value = "mem")]
    policy: PolicyKind,
    /// Number of actions
    #[arg(long, default_value_t = 20)]
    budget: usize,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    planning: super::PlanningArgs,
    /// Map the scene a second time with this policy, into OUT-POLICY, and show both: in the table and in the figure
    #[arg(long, value_name = "POLICY")]
    beside: Option<PolicyKind>,
    /// The episode's directory (default: out/SCENE-POLICY-SEED)
    #[arg(long)]
    out: Option<PathBuf>,
    /// Replace the episode that is in the directory
    #[arg(long, conflicts_with = "resume")]
    force: bool,
    /// Go on with the episode that is in the directory
    #[arg(long)]
    resume: bool,
    /// With --resume: repeat what was done so far and verify every step, instead of going on from the last checkpoint
    #[arg(long, requires = "resume")]
    verify: bool,
    /// File what the camera gave and what the arm swept in every step (the default), for `nudge replay --infer`
    #[arg(long, conflicts_with = "no_frames")]
    frames: bool,
    /// Do not file frames
    #[arg(long)]
    no_frames: bool,
    #[command(flatten)]
    world: world::Args,
    /// Print episode.json instead of the table
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let started = Instant::now();
    args.planning.device.choose()?;
    let catalog = Arc::new(Catalog::standard());
    let (mut scene, warnings) = Scene::load(&args.scene, &catalog)?;
    if let Some(arm) = &args.arm {
        scene.robot.urdf = Some(RobotFile::named(arm)?);
    }
    for warning in warnings {
        super::warn(&format!("{}: {warning}", args.scene.display()));
    }
    if args.beside == Some(args.policy) {
        return Err(Error::Usage(format!("--beside {0}: is the policy itself; choose another", args.policy)).into());
    }
    let begin_with = |policy, out: &Path| begin(args, policy, scene.clone(), catalog.clone(), out);
    let out = args.out.clone().unwrap_or_else(|| default_out(&scene, args.policy, args.seed));
    let mut main = begin_with(args.policy, &out)?;
    for warning in &main.episode().arm().arm.warnings {
        super::warn(&format!("{}: {warning}", main.episode().arm().arm.name));
    }
    if let Some(why) = main.episode().why_no_push() {
        super::warn(&why);
    }
    if !args.json {
        table::header(main.episode().record());
        main.episode().record().steps.iter().for_each(|step| table::step(step, args.budget));
    }
    // It prints a row for every step, the one beside it nothing.
    go_on(&mut main, Progress::bar("run", args.budget), &mut |step| {
        if !args.json {
            table::step(step, args.budget);
        }
    })?;
    let mut columns = vec![Column::of(&main, &out, started)?];
    if let Some(policy) = args.beside {
        let started = Instant::now();
        let out = beside_of(&out, policy);
        let mut other = begin_with(policy, &out)?;
        let (name, budget) = (policy.name(), args.budget);
        let progress = if args.json { Progress::bar(name, budget) } else { Progress::new(name, budget) };
        go_on(&mut other, progress, &mut |_| ())?;
        columns.push(Column::of(&other, &out, started)?);
        other.finish()?;
    }
    let episode = main.finish_beside(columns.get(1).map(|column| &column.record))?;
    if args.json {
        super::print(&episode.record().to_json())?;
    } else {
        table::summary(&columns);
    }
    Ok(())
}

/// Where the second episode goes: beside the first, with the policy's name behind its own.
fn beside_of(out: &Path, policy: PolicyKind) -> PathBuf {
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!("{name}-{policy}"))
}

/// Begins an episode, or goes on with the one that is there and is to be resumed.
fn begin(args: &Args, policy: PolicyKind, scene: Scene, catalog: Arc<Catalog>, out: &Path) -> anyhow::Result<Driver> {
    let scene = scene.with_hand_for(policy.picks());
    let update = belief_update(args.planning.belief.as_deref(), policy)?;
    let outside = args.world.command.is_some();
    let config = EpisodeConfig {
        policy,
        belief: update.name().to_owned(),
        seed: args.seed,
        budget: args.budget,
        views: args.planning.views.clone(),
        planner: args.planning.planner.settings(update.name())?,
        noise: NoiseModel::named(&args.planning.noise)?,
    };
    if !(args.resume && EpisodeDir::state(out)? == DirectoryState::Episode) {
        let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
        let frames = if args.no_frames && !args.frames { Frames::Left } else { Frames::Filed };
        let episode = if outside {
            world::begin(&args.world, scene, catalog, config, update)?
        } else {
            Episode::new(scene, catalog, config, update)?
        };
        return Ok(Driver::start(episode, out, overwrite, frames)?);
    }
    let logged = EpisodeDir::open(out)?.record()?;
    let filed = if outside { world::unknown(&scene) } else { scene.clone() };
    same_episode(&logged, &filed, &config, out)?;
    let progress = Progress::new("repeating", logged.steps.len());
    let mut watch = |episode: &Episode, _: Option<&StepOutcome>| {
        progress.at(episode.record().steps.len());
        Ok(())
    };
    let driver = if outside {
        world::go_on(&args.world, &scene, &logged, catalog, update, out, &mut watch)?
    } else if args.verify {
        Driver::resume(out, catalog, update, &mut watch)?
    } else {
        Driver::go_on(out, catalog, update, &mut watch)?
    };
    progress.finish();
    Ok(driver)
}

/// Does the actions that are left, and shows each.
fn go_on(driver: &mut Driver, progress: Progress, show: &mut dyn FnMut(&StepRecord)) -> anyhow::Result<()> {
    let progress = progress.with_done(driver.episode().record().steps.len());
    while !driver.episode().is_finished() {
        progress.doing("deciding");
        let decision = driver.decide();
        progress.doing(match decision.action {
            Action::Look { .. } => "looking",
            Action::Manipulate(_) => "pushing",
        });
        let outcome = driver.act(decision)?;
        progress.suspend(|| show(&outcome.record));
        progress.at(outcome.record.index);
    }
    progress.finish();
    Ok(())
}

/// An episode as a column of the final table.
struct Column {
    record: EpisodeRecord,
    /// Objects that no view shows at the start.
    hidden: Vec<ObjectId>,
    out: PathBuf,
    /// Wall-clock seconds from its start to its end, reading weights and scene included.
    seconds: f64,
}

impl Column {
    fn of(driver: &Driver, out: &Path, started: Instant) -> nudge_core::Result<Self> {
        let seconds = started.elapsed().as_secs_f64();
        let record = driver.episode().record().clone();
        Ok(Self { record, hidden: driver.hidden()?, out: out.to_owned(), seconds })
    }
}

/// Refuses to go on with an episode of another scene or with other settings; names the first that differs.
fn same_episode(
    logged: &EpisodeRecord,
    scene: &Scene,
    config: &EpisodeConfig,
    out: &std::path::Path,
) -> Result<(), Error> {
    let settings = |config: &EpisodeConfig| {
        [
            ("policy", config.policy.to_string()),
            ("belief", config.belief.clone()),
            ("seed", config.seed.to_string()),
            ("budget", config.budget.to_string()),
            ("views", config.views.clone()),
            ("noise", NoiseModel::name_of(config.noise)),
        ]
    };
    if logged.scene != *scene {
        let message = format!(
            "the episode there is of another scene ({}); leave out --resume or choose another --out",
            logged.scene.name
        );
        return Err(Error::input(out, "", message));
    }
    let both = settings(&logged.config).into_iter().zip(settings(config));
    let mut whole = both.map(|((name, before), (_, now))| (name, before, now)).filter(|(_, before, now)| before != now);
    let planner = || config.planner.difference(&logged.config.planner);
    let differs = whole.next().or_else(|| planner().map(|(setting, before, now)| (setting.name, before, now)));
    differs.map_or(Ok(()), |(name, before, now)| {
        Err(Error::input(out, "", format!("the episode there was run with --{name} {before}, not {now}")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::plan::{SETTINGS, Values};
    use nudge_core::skill::{SkillKind, SkillSet};

    /// An episode whose gamma was another one was gone on with, without a word.
    #[test]
    fn going_on_with_other_settings_is_refused_whichever_it_is() {
        let logged = crate::fixture::play(1).record;
        let (scene, config) = (logged.scene.clone(), logged.config.clone());
        let out = std::path::Path::new("there");
        let refused = |config: &EpisodeConfig| same_episode(&logged, &scene, config, out).err().map(|e| e.to_string());
        assert_eq!(refused(&config), None);
        for setting in SETTINGS {
            let other = match &setting.values {
                Values::Whole { range: [_, high], .. } => high.to_string(),
                Values::Real { range: [_, high], .. } => high.to_string(),
                Values::Choice { choices, .. } => choices[1].name.to_owned(),
                Values::Skills { .. } => SkillSet::of(SkillKind::ALL).to_string(),
            };
            let mut planner = config.planner;
            setting.set(&mut planner, &other).expect("allowed");
            let said = refused(&EpisodeConfig { planner, ..config.clone() }).expect(setting.name);
            let before = setting.value(&config.planner);
            assert_eq!(said, format!("there: the episode there was run with --{} {before}, not {other}", setting.name));
        }
        let noisy = EpisodeConfig { noise: Some(NoiseModel::STANDARD), ..config };
        let said = refused(&noisy).expect("other noise");
        assert_eq!(said, "there: the episode there was run with --noise none, not standard");
    }
}
