//! `nudge regress`: a small fixed bench against its golden scores.

use super::bench::workers;
use super::progress::Progress;
use super::{print, to_json};
use crate::regress::{Compared, Golden, OTHER_PROCESSORS};
use anyhow::Context;
use nudge_core::Error;
use std::path::{Path, PathBuf};

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The golden files
    #[arg(long, default_values = GOLDENS, value_name = "FILE")]
    golden: Vec<PathBuf>,
    /// Show how scores differ from the golden ones, and take the new ones over
    #[arg(long)]
    bless: bool,
    /// Episodes at once [default: as many as processors and memory allow]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Print one JSON document
    #[arg(long, conflicts_with = "bless")]
    json: bool,
}

/// What ships, on the networks; and the paper's rule on the classical belief.
const GOLDENS: [&str; 2] = ["tests/golden/regress-networks.json", "tests/golden/regress.json"];

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let goldens: Vec<Golden> = args.golden.iter().map(|path| Golden::read(path)).collect::<Result<_, _>>()?;
    let mut all = Vec::new();
    for (path, golden) in args.golden.iter().zip(&goldens) {
        let workers = workers(args.jobs, golden.episodes());
        let progress = Progress::new("regress", golden.episodes());
        let compared = golden.compare(path, workers, &mut || progress.inc())?;
        progress.finish();
        if args.bless {
            bless(path, golden, &compared)?;
        } else if !args.json {
            print(&format!("{}\n", path.display()))?;
            print(&compared.iter().map(line).collect::<String>())?;
        }
        all.extend(compared);
    }
    if args.bless {
        return Ok(());
    }
    if args.json {
        print(&to_json(&serde_json::json!({ "scores": all }))?)?;
    }
    verdict(&all)
}

/// Takes the scores over, and tells what changes.
fn bless(path: &Path, golden: &Golden, now: &[Compared]) -> anyhow::Result<()> {
    let others = if golden.is_rounded() { &OTHER_PROCESSORS[..] } else { &[] };
    let rounded = others.iter().map(|environment| as_another_processor(path, environment));
    let blessed = golden.bless(now, &rounded.collect::<anyhow::Result<Vec<_>>>()?);
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
    blessed.write(path)?;
    print(&format!("written to {}\n", path.display()))
}

/// The scores with another processor's rounding: in a process of its own, since libtorch chooses its kernels once.
fn as_another_processor(path: &Path, environment: &[(&str, &str)]) -> anyhow::Result<Vec<Compared>> {
    #[derive(serde::Deserialize)]
    struct Document {
        scores: Vec<Compared>,
    }
    let program = std::env::current_exe().context("the program's own path")?;
    let mut command = std::process::Command::new(program);
    command.args(["regress", "--json", "--golden"]).arg(path).envs(environment.iter().copied());
    let output = command.output().context("a second run of the program")?;
    // Scores that are off end with 1; what is wrong otherwise was said.
    anyhow::ensure!(
        output.status.code().is_some_and(|code| code < 2),
        "a run with {environment:?} failed: {}",
        String::from_utf8_lossy(&output.stderr).trim()
    );
    let document: Document = serde_json::from_slice(&output.stdout).context("what a second run printed")?;
    Ok(document.scores)
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
