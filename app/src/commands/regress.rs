//! `nudge regress`: a small fixed bench against its golden scores.

use super::bench::workers;
use super::progress::Progress;
use super::{print, to_json};
use crate::regress::{Compared, Golden};
use nudge_core::Error;
use std::path::PathBuf;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The golden file
    #[arg(long, default_value = "tests/golden/regress.json", value_name = "FILE")]
    golden: PathBuf,
    /// Show how scores differ from the golden ones, and take the new ones over
    #[arg(long)]
    bless: bool,
    /// Episodes at once [default: as many as processors and memory allow]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let golden = Golden::read(&args.golden)?;
    let episodes = if args.bless { golden.episodes_to_bless() } else { golden.episodes() };
    let workers = workers(args.jobs, episodes);
    let progress = Progress::new("regress", episodes);
    if args.bless {
        let blessed = golden.bless(&args.golden, workers, &mut || progress.inc())?;
        progress.finish();
        let mut text = String::new();
        for score in blessed.scores() {
            let name = format!("{} {}", score.policy, score.name);
            let now = format!("{:.4} ± {:.4}", score.golden, score.tolerance);
            text += &match golden.expected(score.policy, &score.name) {
                Some(before) if before == score => format!("{name:<34} {now:>24}  as it was\n"),
                Some(before) => {
                    let was = format!("{:.4} ± {:.4}", before.golden, before.tolerance);
                    format!("{name:<34} {now:>24}  was {was}, {:+.4}\n", score.golden - before.golden)
                }
                None => format!("{name:<34} {now:>24}  new\n"),
            };
        }
        print(&text)?;
        blessed.write(&args.golden)?;
        return print(&format!("written to {}\n", args.golden.display()));
    }
    let compared = golden.compare(&args.golden, workers, &mut || progress.inc())?;
    progress.finish();
    if args.json {
        print(&to_json(&serde_json::json!({ "scores": compared }))?)?;
    } else {
        print(&compared.iter().map(line).collect::<String>())?;
    }
    verdict(&compared)
}

fn line(compared: &Compared) -> String {
    let Compared { policy, name, golden, tolerance, now, ok } = compared;
    let name = format!("{policy} {name}");
    let mark = if *ok { "ok" } else { "OFF" };
    match (golden, tolerance) {
        (Some(golden), Some(tolerance)) => {
            format!("{name:<34} {now:>13.4}  golden {golden:>13.4} ± {tolerance:<10.4} {mark}\n")
        }
        _ => format!("{name:<34} {now:>13.4}  no golden score: --bless takes it over\n"),
    }
}

/// [`Error::Check`] if anything is off; names the score that is off by the most tolerances.
fn verdict(compared: &[Compared]) -> anyhow::Result<()> {
    let off: Vec<&Compared> = compared.iter().filter(|compared| !compared.ok).collect();
    let by = |compared: &&Compared| match (compared.golden, compared.tolerance) {
        (Some(golden), Some(tolerance)) => (compared.now - golden).abs() / tolerance.max(f64::MIN_POSITIVE),
        _ => f64::INFINITY,
    };
    let Some(worst) = off.iter().copied().max_by(|a, b| by(a).total_cmp(&by(b))) else { return Ok(()) };
    let (count, all) = (off.len(), compared.len());
    let expected = worst.golden.map_or("no golden score".to_owned(), |golden| format!("{golden:.4}"));
    let message = format!(
        "{count} of {all} scores are off, the worst {} {}: {:.4} against {expected}",
        worst.policy, worst.name, worst.now
    );
    Err(Error::Check(message).into())
}
