//! `nudge data worth`: states along episodes, and what pushes from each really do.

use crate::commands::progress::Progress;
use crate::commands::{print, scene, to_json, warn};
use crate::driver;
use nudge_core::arm::ArmTool;
use nudge_core::camera::ViewArray;
use nudge_core::learn::worth::{WorthProgress, WorthRecipe, WorthState, WorthSummary, make_worth, summarise};
use nudge_core::learn::{Card, Dataset, Recipe, Stretch};
use nudge_core::plan::PolicyKind;
use nudge_core::scene::{Catalog, Family, GenerateConfig};
use nudge_core::shard::Shard;
use nudge_core::{Error, cnabu};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// Number of states in the directory; a larger number extends it
    #[arg(long, required_unless_present = "summary")]
    count: Option<usize>,
    /// Seed of every episode
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Directory to write to; an unfinished one is continued
    #[arg(long, value_name = "DIR", required_unless_present = "summary")]
    out: Option<PathBuf>,
    /// Make the i-th of every n episodes only, i from 0: several processes may share a directory
    #[arg(long, value_name = "i/n", default_value = "0/1")]
    shard: Shard,
    /// Pushes from each state
    #[arg(long, default_value_t = 25, value_name = "N")]
    pushes: usize,
    /// Families of shelves, each as often as it is listed [default: every family once]
    #[arg(long, value_delimiter = ',', value_name = "NAME,...")]
    families: Vec<Family>,
    /// How beliefs change: cnabu or classical
    #[arg(long, default_value = "cnabu", value_name = "NAME")]
    belief: String,
    /// Share of episodes with sensor noise
    #[arg(long, default_value_t = 0.25)]
    noise: f32,
    /// Share of shelves whose objects are stretched, each along each axis by a factor of its own
    #[arg(long, default_value_t = 0.2, value_name = "SHARE")]
    stretch_share: f32,
    /// Smallest and largest of these factors
    #[arg(long, default_value = "0.8-1.2", value_name = "LOW-HIGH", value_parser = scene::parse_scale)]
    stretch: scene::Scale,
    /// Share of states for which it is found too what the map gains by a push and two looks, against three looks: some pushes each
    #[arg(long, default_value_t = 0.05, value_name = "SHARE")]
    followed: f32,
    /// The view array
    #[arg(long, default_value = "standard300")]
    views: String,
    /// Make nothing: tell what is in this directory, and how well the promised gain serves to choose a push
    #[arg(long, value_name = "DIR", conflicts_with_all = ["count", "out"])]
    summary: Option<PathBuf>,
    /// Print a JSON document at the end
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// Wrong use, a directory that holds other data, missing weights, and what cannot be written.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(directory) = &args.summary {
        return tell(directory, args.json);
    }
    let (Some(count), Some(out)) = (args.count, &args.out) else {
        return Err(Error::Usage("--count and --out are needed".to_owned()).into());
    };
    for (name, number) in [("count", count), ("pushes", args.pushes)] {
        if number == 0 {
            return Err(Error::Usage(format!("--{name} must be at least 1")).into());
        }
    }
    for (name, share) in [("noise", args.noise), ("stretch-share", args.stretch_share), ("followed", args.followed)] {
        if !(0.0..=1.0).contains(&share) {
            return Err(Error::Usage(format!("--{name} {share}: must be a share between 0 and 1")).into());
        }
    }
    cnabu::compute_beside_rayon();
    let scenes = GenerateConfig::default();
    let recipe = WorthRecipe {
        families: if args.families.is_empty() { Family::ALL.to_vec() } else { args.families.clone() },
        update: driver::belief_update(Some(&args.belief), PolicyKind::Mem)?,
        pushes: args.pushes,
        followed_share: args.followed,
        base: Recipe {
            catalog: Catalog::standard(),
            arm: Arc::new(ArmTool::standard(scenes.shelf)),
            scenes,
            views: ViewArray::named(&args.views)?,
            noise_share: args.noise,
            stretch: Stretch { share: args.stretch_share, range: args.stretch.0 },
        },
    };
    let card = Card::of_worth(&recipe, args.seed, count);
    let started = Instant::now();
    let bar = OnceLock::new();
    let done = make_worth(&card, &recipe, out, args.shard, &|state| {
        let begun = || Progress::new("data worth", state.of).with_done(state.done);
        let bar: &Progress = bar.get_or_init(begun);
        if state.made > 0 {
            bar.at_rate(state.done, &rate(state, &started));
        }
    })?;
    if let Some(bar) = bar.get() {
        bar.finish();
    }
    let seconds = started.elapsed().as_secs_f64();
    let data = Dataset::<WorthState>::open(out)?;
    data.skipped().iter().for_each(|skipped| warn(skipped));
    if args.json {
        return print(&to_json(&serde_json::json!({
            "directory": out, "kind": "worth", "samples": data.len(), "of": card.count, "made": done.made,
            "pushes": done.pushes, "seconds": seconds, "bytes_per_sample": data.bytes_per_sample(),
        }))?);
    }
    print(&format!(
        "{}: {} of {} states, {:.0} kB each; {} made with {} pushes in {seconds:.1} s, {:.1} pushes per second\n",
        out.display(),
        data.len(),
        card.count,
        data.bytes_per_sample() / 1e3,
        done.made,
        done.pushes,
        done.pushes as f64 / seconds,
    ))
}

fn rate(state: WorthProgress, started: &Instant) -> String {
    format!("{:.1} pushes per second", state.pushes as f64 / started.elapsed().as_secs_f64())
}

/// Tells what is in a directory.
fn tell(directory: &Path, json: bool) -> anyhow::Result<()> {
    let data = Dataset::<WorthState>::open(directory)?;
    data.skipped().iter().for_each(|skipped| warn(skipped));
    let bar = Progress::bar("read", data.len());
    let summaries = summarise(&data, &mut |done| bar.at(done))?;
    bar.finish();
    if json {
        return print(&to_json(&serde_json::json!({ "directory": directory, "summaries": summaries }))?);
    }
    let mut text = "            states  pushes  hidden   won  lost  winning  jammed  dropped  | net objects: chosen   best  random  \
                    | rank of promise: objects  volume  voxels\n"
        .to_owned();
    for s in &summaries {
        text += &line(s);
    }
    print(&text)
}

fn line(s: &WorthSummary) -> String {
    let rank = |rank: Option<f64>| rank.map_or("-".to_owned(), |rank| format!("{rank:.3}"));
    format!(
        "{:<11} {:>6}  {:>6}  {:>6.2}  {:>4.2}  {:>4.2}  {:>6.1}%  {:>5.1}%  {:>6.1}%  | {:>19.0} {:>6.0} {:>7.1}  | {:>24} {:>7} {:>7}\n",
        s.of,
        s.states,
        s.pushes,
        s.hidden,
        s.won,
        s.lost,
        100.0 * s.winning_share,
        100.0 * s.jammed_share,
        100.0 * s.dropped_share,
        s.chosen,
        s.best,
        s.random,
        rank(s.rank_objects),
        rank(s.rank_volume),
        rank(s.rank_voxels),
    )
}
