//! `nudge report`: what a bench measured, as a page.

use super::print;
use crate::report::write;
use std::path::PathBuf;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The bench's directory
    bench: PathBuf,
    /// Where to write the page and its charts [default: BENCH/report]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Report what is there of an unfinished bench
    #[arg(long)]
    partial: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let out = args.out.clone().unwrap_or_else(|| args.bench.join("report"));
    let index = write(&args.bench, &out, args.partial)?;
    print(&format!("{}\n", index.display()))
}
