//! `nudge bench`: every policy on every scene of some sets, and the shards of that put together again.

use super::progress::{Progress, words};
use super::{print, to_json, warn};
use crate::bench::{
    BenchDir, BrokenScene, EpisodeId, EpisodeResult, Event, Mixing, Plan, PolicyPlan, SetPlan, SummaryRow, Workers,
    load_sets, merge, run as work, summarise,
};
use crate::driver::belief_update;
use crate::made_by;
use nudge_core::Error;
use nudge_core::belief::{BeliefUpdate, CLASSICAL, mixed_parts};
use nudge_core::camera::NoiseModel;
use nudge_core::grid::Grid;
use nudge_core::made_by::MadeBy;
use nudge_core::plan::PolicyKind;
use nudge_core::scene::Catalog;
use nudge_core::shard::Shard;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Run every policy on every scene of some sets; the same command goes on after a kill.
#[derive(clap::Args, Debug)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: RunArgs,
}

#[derive(clap::Subcommand, Debug)]
enum Command {
    Merge(MergeArgs),
}

/// Put the shards of a bench together, as if one process had run all of it
#[derive(clap::Args, Debug)]
struct MergeArgs {
    /// The directories of all shards
    #[arg(required = true, value_name = "DIR")]
    parts: Vec<PathBuf>,
    /// The directory to make
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    mixing: MixingArgs,
}

#[derive(clap::Args, Debug)]
struct MixingArgs {
    /// Let results of other weights, other code of the method or other settings of the planner stand together; bench.json
    /// and the report say so
    #[arg(long)]
    allow_mixed: bool,
}

impl MixingArgs {
    fn mixing(&self) -> Mixing {
        if self.allow_mixed { Mixing::Allowed } else { Mixing::Refused }
    }
}

#[derive(clap::Args, Debug)]
struct RunArgs {
    /// Sets of scenes: folders of scene files, or single files
    #[arg(required = true, value_name = "SET")]
    sets: Vec<PathBuf>,
    /// Policies, or `all`; of these the clairvoyant ones, oracle and clairvoyant-push, take most of the time
    #[arg(long, default_value = "all", value_delimiter = ',', value_name = "A,B")]
    policies: Vec<String>,
    /// Number of seeds; policies that draw nothing at random run once
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Number of actions of an episode
    #[arg(long, default_value_t = 20, value_name = "B")]
    budget: usize,
    #[command(flatten)]
    planning: super::PlanningArgs,
    /// The bench's directory
    #[arg(long, required = true, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run the i-th of every n episodes only, i from 0; `nudge bench merge` puts the directories together
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Episodes at once [default: as many as processors and memory allow]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    #[command(flatten)]
    mixing: MixingArgs,
    /// Keep every episode whole, with beliefs and recording (about 100 MB each)
    #[arg(long)]
    record: bool,
    /// Print the summary as JSON, and nothing on the way
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.command {
        None => run_bench(&args.run),
        Some(Command::Merge(args)) => {
            let plan = merge(&args.parts, &args.out, args.mixing.mixing())?;
            tell_mixed(&plan);
            let (directory, _) = BenchDir::open(&args.out)?;
            let results = results(&directory, &plan, &plan.episodes())?;
            print(&table(&summarise(&results)))
        }
    }
}

fn run_bench(args: &RunArgs) -> anyhow::Result<()> {
    args.planning.device.choose()?;
    let plan = plan(args)?;
    for BrokenScene { error, .. } in &plan.broken {
        warn(&format!("left out: {error}"));
    }
    let out = args.out.as_deref().unwrap_or(std::path::Path::new("."));
    let (directory, filed) = BenchDir::go_on(out, &plan, args.mixing.mixing())?;
    tell_mixed(&filed);
    let (all, missing) = (plan.episodes(), directory.missing(&filed)?);
    let workers = workers(args.jobs, missing.len());
    let mut progress = Watch::new(&plan, all.len(), missing.len(), workers, args.json);
    let mut failed = Vec::new();
    work(&plan, &directory, &missing, workers, args.record, &mut |event| match event {
        Event::Done { id, result, seconds } => progress.done(id, &result, seconds),
        Event::Failed { error, .. } => failed.push(error),
    })?;
    progress.finish();
    if let Some(error) = failed.pop() {
        failed.iter().for_each(|error| eprintln!("{error}"));
        return Err(error.into());
    }
    let summary = summarise(&results(&directory, &filed, &all)?);
    if args.json {
        let broken: Vec<&str> = plan.broken.iter().map(|broken| broken.error.as_str()).collect();
        let document = serde_json::json!({ "episodes": all.len(), "summary": summary, "broken": broken });
        print(&to_json(&document)?)?;
    } else {
        print(&table(&summary))?;
    }
    match &plan.broken[..] {
        [] => Ok(()),
        [first, ..] => {
            let count = plan.broken.len();
            let message = format!("{count} of the scenes could not be read, the rest ran; first {}", first.error);
            Err(Error::Usage(message).into())
        }
    }
}

/// Warns of results that do not stand together by themselves.
fn tell_mixed(plan: &Plan) {
    for also in plan.also_made_by.iter().filter(|also| also.mixed) {
        warn(&format!("the results are mixed: {}", also.differs.join("; ")));
    }
}

fn plan(args: &RunArgs) -> anyhow::Result<Plan> {
    let mut policies = policies(args)?;
    if args.budget == 0 {
        return Err(Error::Usage("--budget must be at least one action".to_owned()).into());
    }
    // What was not asked for is what serves the belief of a policy best, as in a run of the policy alone.
    let belief = policies.iter().map(|plan| &plan.belief).find(|belief| *belief != CLASSICAL).cloned();
    let belief = belief.unwrap_or_else(|| CLASSICAL.to_owned());
    let planner = args.planning.planner.settings(&belief)?;
    for policy in &mut policies {
        let own = args.planning.planner.settings(&policy.belief)?;
        policy.planner = (own != planner).then_some(own);
    }
    let noise = NoiseModel::named(&args.planning.noise)?;
    let (sets, broken) = load_sets(&args.sets, &Catalog::standard())?;
    nudge_core::camera::ViewArray::named(&args.planning.views)?;
    // All policies of a bench share the networks, if they run on any.
    let update = policies.iter().find(|plan| plan.belief == belief);
    let networks = match update {
        Some(PolicyPlan { policy, belief, .. }) => {
            let update = belief_update(Some(belief), *policy)?;
            if mixed_parts(belief).is_some() {
                check_on(&*update, &sets)?;
            }
            update.networks_used()
        }
        None => None,
    };
    Ok(Plan {
        format: crate::bench::FORMAT,
        version: nudge_core::VERSION.to_owned(),
        made_by: Some(MadeBy::new(made_by::build(), networks, planner, processors())),
        also_made_by: Vec::new(),
        budget: args.budget,
        seeds: args.seeds,
        views: args.planning.views.clone(),
        planner,
        noise,
        policies,
        sets,
        broken,
        shard: args.shard,
    })
}

/// Refuses modules of the user's own that do not answer as they must, before the first episode and not at each.
fn check_on(update: &dyn BeliefUpdate, sets: &[SetPlan]) -> nudge_core::Result<()> {
    let mut grids: Vec<Grid> = Vec::new();
    for scene in sets.iter().flat_map(|set| &set.scenes) {
        let grid = scene.scene.grid();
        if !grids.contains(&grid) {
            update.check_grid(&grid)?;
            grids.push(grid);
        }
    }
    Ok(())
}

fn policies(args: &RunArgs) -> anyhow::Result<Vec<PolicyPlan>> {
    let mut kinds: Vec<PolicyKind> = Vec::new();
    for name in &args.policies {
        let named = if name == "all" { PolicyKind::ALL.to_vec() } else { vec![name.parse()?] };
        for kind in named {
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
    }
    let plan_of = |policy| {
        let update = belief_update(args.planning.belief().as_deref(), policy)?;
        Ok(PolicyPlan { policy, belief: update.name().to_owned(), planner: None })
    };
    kinds.into_iter().map(plan_of).collect()
}

fn results(directory: &BenchDir, plan: &Plan, episodes: &[EpisodeId]) -> nudge_core::Result<Vec<EpisodeResult>> {
    let mut results = Vec::with_capacity(episodes.len());
    for id in episodes {
        results.extend(directory.result(plan, *id)?);
    }
    Ok(results)
}

/// The workers for a number of episodes: as many as were asked for, or as processors (or `RAYON_NUM_THREADS`) and memory
/// allow.
pub(super) fn workers(jobs: Option<u16>, episodes: usize) -> Workers {
    Workers::new(jobs.map(usize::from), processors(), available_memory(), episodes)
}

/// Threads that all episodes together have.
fn processors() -> usize {
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|number| number.parse().ok()).filter(|n| *n > 0);
    asked.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get))
}

/// Memory that is free to use, bytes; `None` where the system does not say.
fn available_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
    let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes << 10)
}

fn table(rows: &[SummaryRow]) -> String {
    let picks = rows.iter().any(|row| row.picks > 0.0);
    let mut text = format!(
        "\n{:<12} {:<20} {:>8}  {:>6}  {:>6}  {:>8}  {:>8}  {:>6}{}\n",
        "set",
        "policy",
        "episodes",
        "IoU",
        "mIoU",
        "H nats",
        "revealed",
        "pushes",
        if picks { "   picks" } else { "" }
    );
    for row in rows {
        let revealed = row.revealed.map_or("-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        text += &format!(
            "{:<12} {:<20} {:>8}  {:>6.3}  {:>6.3}  {:>8.0}  {revealed:>8}  {:>6.1}{}\n",
            row.set,
            row.policy,
            row.episodes,
            row.occupancy_iou,
            row.semantic_miou,
            row.entropy_nats,
            row.pushes,
            if picks { format!("  {:>6.1}", row.picks) } else { String::new() }
        );
    }
    text
}

/// Tells how far a bench has come: a bar on a terminal, and a line per episode.
struct Watch<'a> {
    plan: &'a Plan,
    progress: Progress,
    quiet: bool,
    all: usize,
    missing: usize,
    done: usize,
    jobs: usize,
    started: Instant,
    /// Sum of seconds and number of finished episodes, and number of those to come, by policy.
    spent: Vec<(f64, usize, usize)>,
}

impl<'a> Watch<'a> {
    fn new(plan: &'a Plan, all: usize, missing: usize, workers: Workers, quiet: bool) -> Self {
        let mut spent = vec![(0.0, 0, 0); plan.policies.len()];
        if !quiet {
            let Workers { jobs, threads } = workers;
            println!(
                "{missing} of {all} episodes to run, {jobs} at once on {threads} {} each",
                if threads == 1 { "thread" } else { "threads" }
            );
        }
        // What is to come is counted down as it is done; shares of policies are those of the whole plan.
        for id in plan.episodes() {
            spent[id.policy].2 += 1;
        }
        Self {
            plan,
            progress: Progress::bar("bench", missing),
            quiet,
            all,
            missing,
            done: 0,
            jobs: workers.jobs,
            started: Instant::now(),
            spent,
        }
    }

    fn done(&mut self, id: EpisodeId, result: &EpisodeResult, seconds: f64) {
        self.done += 1;
        let (sum, count, to_come) = &mut self.spent[id.policy];
        (*sum, *count, *to_come) = (*sum + seconds, *count + 1, to_come.saturating_sub(1));
        let left = self.left();
        self.progress.at_with(self.done, left);
        if self.quiet {
            return;
        }
        let last = result.scores(result.steps.len());
        let line = format!(
            "{:>5}/{}  {:<48}  IoU {:.3}  mIoU {:.3}  {seconds:>6.1} s, about {} left",
            self.all - self.missing + self.done,
            self.all,
            self.plan.name(id),
            last.occupancy_iou,
            last.semantic_miou,
            words(left)
        );
        self.progress.suspend(|| println!("{line}"));
    }

    /// Time left, from what episodes of each policy have taken so far.
    fn left(&self) -> Duration {
        let (sum, count) = self.spent.iter().fold((0.0, 0), |(sum, count), (s, c, _)| (sum + s, count + c));
        let overall = sum / f64::max(1.0, count as f64);
        let to_come: usize = self.spent.iter().map(|(_, _, to_come)| to_come).sum();
        let seconds: f64 = self
            .spent
            .iter()
            .map(|(sum, count, to_come)| {
                let each = if *count > 0 { sum / *count as f64 } else { overall };
                each * *to_come as f64
            })
            .sum();
        // Of a plan that is being gone on with, only what is missing.
        let share = (self.missing - self.done) as f64 / to_come.max(1) as f64;
        Duration::from_secs_f64(seconds * share / self.jobs as f64)
    }

    fn finish(&self) {
        self.progress.finish();
        if !self.quiet && self.done > 0 {
            println!("{} episodes in {}", self.done, words(self.started.elapsed()));
        }
    }
}
