//! `nudge report`: what a bench measured, as a page or as Markdown.

use super::print;
use crate::report::{Pages, Results, made_by, markdown, write};
use std::path::PathBuf;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The bench's directory
    bench: PathBuf,
    /// Where to write the page and its charts [default: BENCH/report]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the tables as Markdown instead of making the page
    #[arg(long, conflicts_with = "out")]
    markdown: bool,
    /// Also make a page of every recorded episode of the worst and best scenes, and link it
    #[arg(long, conflicts_with = "markdown")]
    pages: bool,
    /// Report what is there of an unfinished bench
    #[arg(long)]
    partial: bool,
}

/// Runs the command. The page's path alone goes to standard output; what made the numbers is told beside it.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let results = Results::read(&args.bench, args.partial)?;
    if args.markdown {
        return print(&markdown(&results)?);
    }
    let out = args.out.clone().unwrap_or_else(|| args.bench.join("report"));
    let pages = if args.pages { Pages::Made } else { Pages::Left };
    let index = write(&results, &args.bench, &out, pages)?;
    crate::output::print_error(&made_by(&results.plan).lines());
    print(&format!("{}\n", index.display()))
}
