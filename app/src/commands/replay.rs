//! `nudge replay`: simulate an episode again from its log, or infer its beliefs again from its filed frames, and verify every
//! step.

use super::progress::Progress;
use crate::driver::belief_update;
use nudge_core::episode::{Agreement, EpisodeDir, infer, replay};
use nudge_core::scene::Catalog;
use std::path::PathBuf;
use std::sync::Arc;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The episode's directory
    episode: PathBuf,
    #[command(flatten)]
    device: super::DeviceArgs,
    /// Simulate and decide nothing: infer every belief again from the frames that are filed in the episode's directory
    #[arg(long)]
    infer: bool,
    /// Print what was found as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    args.device.choose()?;
    let directory = EpisodeDir::open(&args.episode)?;
    let record = directory.record()?;
    let update = belief_update(Some(&record.config.belief), record.config.policy)?;
    if let Some(words) = record.other_weights(&*update) {
        super::warn(&format!("{}: {words}", args.episode.display()));
    }
    let progress = Progress::new("replay", record.steps.len());
    let mut done = |done, _| progress.at(done);
    let report = if args.infer {
        infer(&directory, update, &mut done)?
    } else {
        replay(&directory, Arc::new(Catalog::standard()), update, &mut done)?
    };
    progress.finish();
    if args.json {
        super::print(&super::to_json(&report)?)?;
    } else {
        let words = match report.agreement {
            Agreement::BitEqual => "bit for bit".to_owned(),
            Agreement::Within { largest } => format!("within {largest:.1e}"),
            Agreement::Differs => {
                let steps: Vec<String> = report.differences.iter().map(|at| at.step.to_string()).collect();
                format!("but at steps {}", steps.join(", "))
            }
        };
        let did = if args.infer { "inferred" } else { "run" };
        println!(
            "{}: {} of {} steps {did} again, the same {words}",
            args.episode.display(),
            report.steps,
            report.budget
        );
    }
    Ok(report.verdict()?)
}
