//! `nudge data`: make training data from our own simulation.

use super::progress::Progress;
use nudge_core::Error;
use nudge_core::arm::ArmTool;
use nudge_core::camera::ViewArray;
use nudge_core::learn::{Card, Dataset, Kind, MapSample, PushSample, Recipe, Sample, Stretch, make};
use nudge_core::scene::{Catalog, GenerateConfig};
use nudge_core::shard::Shard;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

mod worth;

/// Make training data: random scenes, settled, observed, with truth.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand, Debug)]
enum Command {
    /// Scenes seen from ten random views, with truth: data for sigma_o
    Maps(MakeArgs),
    /// Scenes after one to ten views, with pushes and the truth before and after: data for sigma_m
    Pushes(MakeArgs),
    /// States along episodes, with pushes that are carried out from each: data for what pushes are worth
    Worth(worth::Args),
}

#[derive(clap::Args, Debug)]
struct MakeArgs {
    /// Number of samples in the directory; a larger number extends it
    #[arg(long)]
    count: usize,
    /// Seed of every sample
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Directory to write to; an unfinished one is continued
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Make the i-th of every n shards only, i from 0: several processes may share a directory
    #[arg(long, value_name = "i/n", default_value = "0/1")]
    shard: Shard,
    /// Share of samples observed with sensor noise
    #[arg(long, default_value_t = 0.25)]
    noise: f32,
    /// Share of the floor that objects cover, drawn for each scene from this range
    #[arg(long, default_value = "0.30-0.45", value_parser = super::scene::parse_fill)]
    fill: super::scene::Fill,
    /// Regularity: 0 places freely, 1 lines objects up behind each other
    #[arg(long, default_value_t = 0.0)]
    rho: f32,
    /// Share of scenes whose objects are stretched, each along each axis by a factor of its own
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    stretch_share: f32,
    /// Smallest and largest of these factors
    #[arg(long, default_value = "0.8-1.2", value_name = "LOW-HIGH", value_parser = super::scene::parse_scale)]
    stretch: super::scene::Scale,
    /// The view array that views are drawn from
    #[arg(long, default_value = "standard300")]
    views: String,
    /// Print a JSON document at the end
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// Wrong use, a directory that holds other data, and what cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.command {
        Command::Maps(args) => make_data::<MapSample>(args, Kind::Maps),
        Command::Pushes(args) => make_data::<PushSample>(args, Kind::Pushes),
        Command::Worth(args) => worth::run(args),
    }
}

fn make_data<S: Sample>(args: &MakeArgs, kind: Kind) -> anyhow::Result<()> {
    if args.count == 0 {
        return Err(Error::Usage("--count must be at least 1".to_owned()).into());
    }
    for (name, share) in [("noise", args.noise), ("stretch-share", args.stretch_share)] {
        if !(0.0..=1.0).contains(&share) {
            return Err(Error::Usage(format!("--{name} {share}: must be a share between 0 and 1")).into());
        }
    }
    let scenes = GenerateConfig { fill: args.fill.0, rho: args.rho, ..GenerateConfig::default() };
    let arm = Arc::new(ArmTool::standard(scenes.shelf));
    let recipe = Recipe {
        catalog: Catalog::standard(),
        scenes,
        arm,
        views: ViewArray::named(&args.views)?,
        noise_share: args.noise,
        stretch: Stretch { share: args.stretch_share, range: args.stretch.0 },
    };
    let card = Card::new(kind, &recipe, args.seed, args.count);
    let started = Instant::now();
    // How much is there already is told first.
    let progress = OnceLock::new();
    let done = make::<S>(&card, &recipe, &args.out, args.shard, &|state| {
        let begun = || Progress::new(format!("data {kind}"), state.of).with_done(state.done);
        progress.get_or_init(begun).at(state.done);
    })?;
    if let Some(progress) = progress.get() {
        progress.finish();
    }
    let seconds = started.elapsed().as_secs_f64();
    let data = Dataset::<S>::open(&args.out)?;
    data.skipped().iter().for_each(|skipped| super::warn(skipped));
    if args.json {
        return super::print(&super::to_json(&serde_json::json!({
            "directory": args.out, "kind": kind, "samples": data.len(), "of": card.count, "made": done.made,
            "seconds": seconds, "bytes_per_sample": data.bytes_per_sample(),
        }))?);
    }
    super::print(&format!(
        "{}: {} of {} samples of {kind}, {:.0} kB each; {} made in {seconds:.1} s\n",
        args.out.display(),
        data.len(),
        card.count,
        data.bytes_per_sample() / 1e3,
        done.made,
    ))
}
