//! `nudge run`: map a scene with a policy and write the episode.

mod table;

use crate::driver::{Driver, belief_update, default_out};
use crate::planner_args;
use indicatif::{ProgressBar, ProgressStyle};
use nudge_core::Error;
use nudge_core::episode::{DirectoryState, EpisodeConfig, EpisodeDir, EpisodeRecord, Overwrite, StepRecord};
use nudge_core::plan::{Action, PolicyKind};
use nudge_core::scene::{Catalog, ObjectId, Scene};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The scene file
    scene: PathBuf,
    /// The rule that chooses actions: mem, mem-no-push, random, random-cnabu, random-push-5, random-push-5-blind,
    /// random-view-push-5, saturation; and as ceilings, since they know the truth, oracle (the view that really tells most) and
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
    /// Print episode.json instead of the table
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let started = Instant::now();
    args.planning.device.choose()?;
    let catalog = Arc::new(Catalog::standard());
    let (scene, warnings) = Scene::load(&args.scene, &catalog)?;
    for warning in warnings {
        super::warn(&format!("{}: {warning}", args.scene.display()));
    }
    if args.beside == Some(args.policy) {
        return Err(Error::Usage(format!("--beside {0}: is the policy itself; choose another", args.policy)).into());
    }
    let begin_with = |policy, out: &Path| begin(args, policy, scene.clone(), catalog.clone(), out);
    let out = args.out.clone().unwrap_or_else(|| default_out(&scene, args.policy, args.seed));
    let mut main = begin_with(args.policy, &out)?;
    if let Some(why) = main.episode().why_no_push() {
        super::warn(&why);
    }
    if !args.json {
        table::header(main.episode().record());
        main.episode().record().steps.iter().for_each(|step| table::step(step, args.budget));
    }
    go_on(&mut main, "", &mut |step| {
        if !args.json {
            table::step(step, args.budget);
        }
    })?;
    let mut columns = vec![Column::of(&main, &out, started)?];
    if let Some(policy) = args.beside {
        let started = Instant::now();
        let out = beside_of(&out, policy);
        let mut other = begin_with(policy, &out)?;
        go_on(&mut other, policy.name(), &mut |_| ())?;
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

/// Begins an episode, or repeats the log of the one that is there and is to be resumed.
fn begin(args: &Args, policy: PolicyKind, scene: Scene, catalog: Arc<Catalog>, out: &Path) -> anyhow::Result<Driver> {
    let update = belief_update(args.planning.belief.as_deref(), policy)?;
    let config = EpisodeConfig {
        policy,
        belief: update.name().to_owned(),
        seed: args.seed,
        budget: args.budget,
        views: args.planning.views.clone(),
        planner: args.planning.planner.settings(update.name()),
        noise: None,
    };
    if !(args.resume && EpisodeDir::state(out)? == DirectoryState::Episode) {
        let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
        return Ok(Driver::start(scene, catalog, config, update, out, overwrite)?);
    }
    let logged = EpisodeDir::open(out)?.record()?;
    same_episode(&logged, &scene, &config, out)?;
    let bar = bar(logged.steps.len(), "repeating");
    let driver = Driver::resume(out, catalog, update, &mut |episode, _| {
        bar.set_position(episode.record().steps.len() as u64);
        Ok(())
    })?;
    bar.finish_and_clear();
    Ok(driver)
}

/// Does the actions that are left, and shows each.
fn go_on(driver: &mut Driver, title: &'static str, show: &mut dyn FnMut(&StepRecord)) -> anyhow::Result<()> {
    let bar = bar(driver.episode().record().config.budget, title);
    let title = if title.is_empty() { String::new() } else { format!("{title}: ") };
    while !driver.episode().is_finished() {
        bar.set_position(driver.episode().record().steps.len() as u64);
        bar.set_message(format!("{title}deciding"));
        let decision = driver.decide();
        bar.set_message(match decision.action {
            Action::Look { .. } => format!("{title}looking"),
            Action::Push(_) => format!("{title}pushing"),
        });
        let outcome = driver.act(decision)?;
        bar.suspend(|| show(&outcome.record));
    }
    bar.finish_and_clear();
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
        let whole = [
            ("--policy", config.policy.to_string()),
            ("--belief", config.belief.clone()),
            ("--seed", config.seed.to_string()),
            ("--budget", config.budget.to_string()),
            ("--views", config.views.clone()),
        ];
        whole.into_iter().chain(planner_args::options(&config.planner))
    };
    if logged.scene != *scene {
        let message = format!(
            "the episode there is of another scene ({}); leave out --resume or choose another --out",
            logged.scene.name
        );
        return Err(Error::input(out, "", message));
    }
    for ((name, before), (_, now)) in settings(&logged.config).zip(settings(config)) {
        if before != now {
            return Err(Error::input(out, "", format!("the episode there was run with {name} {before}, not {now}")));
        }
    }
    Ok(())
}

fn bar(length: usize, message: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:24} {pos}/{len} {msg} {elapsed}").expect("a valid template");
    ProgressBar::new(length as u64).with_style(style).with_message(message)
}
