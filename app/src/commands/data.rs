//! `nudge data`: make training data from our own simulation.

use indicatif::{ProgressBar, ProgressStyle};
use nudge_core::Error;
use nudge_core::arm::ArmTool;
use nudge_core::camera::ViewArray;
use nudge_core::learn::{Card, Dataset, Kind, MapSample, Progress, PushSample, Recipe, Sample, Stretch, make};
use nudge_core::scene::{Catalog, GenerateConfig};
use nudge_core::shard::Shard;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Without a terminal, a line of progress is printed this often.
const REPORT_EVERY: Duration = Duration::from_secs(60);

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
    let report = Report::new(kind);
    let done = make::<S>(&card, &recipe, &args.out, args.shard, &|progress| report.tell(progress))?;
    report.bar.finish_and_clear();
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

/// Tells how far it is: a bar on a terminal, else a line now and then.
struct Report {
    bar: ProgressBar,
    kind: Kind,
    started: Instant,
    last: Mutex<Instant>,
}

impl Report {
    fn new(kind: Kind) -> Self {
        let style =
            ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta} left").expect("a constant template");
        let now = Instant::now();
        Self {
            bar: ProgressBar::new(0).with_style(style).with_message(kind.to_string()),
            kind,
            started: now,
            last: Mutex::new(now),
        }
    }

    fn tell(&self, progress: Progress) {
        self.bar.set_length(progress.of as u64);
        if progress.made == 0 {
            self.bar.set_position(progress.done as u64);
            self.bar.reset_eta();
        }
        self.bar.set_position(progress.done as u64);
        if std::io::stderr().is_terminal() {
            return;
        }
        let Ok(mut last) = self.last.lock() else { return };
        if last.elapsed() >= REPORT_EVERY && progress.made > 0 {
            *last = Instant::now();
            let per_sample = self.started.elapsed().as_secs_f64() / progress.made as f64;
            let left = (per_sample * (progress.of - progress.done) as f64 / 60.0).ceil();
            eprintln!("{}: {}/{}, {per_sample:.2} s a sample, {left} min left", self.kind, progress.done, progress.of);
        }
    }
}
