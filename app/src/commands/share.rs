//! `nudge share`: one page that anyone can open, of an episode or of two beside each other.

use super::print;
use crate::share::{Source, write};
use std::path::{Path, PathBuf};

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The episode's directory
    episode: PathBuf,
    /// A second episode to show beside it, on the same clock
    other: Option<PathBuf>,
    /// The page to write [default: EPISODE.html, beside the directory]
    #[arg(long, value_name = "HTML")]
    out: Option<PathBuf>,
}

/// Runs the command. The page's path alone goes to standard output.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let sources: Vec<Source<'_>> =
        std::iter::once(&args.episode).chain(&args.other).map(|directory| Source::filed(directory)).collect();
    let out = args.out.clone().unwrap_or_else(|| beside(&args.episode));
    let shared = write(&sources, &out, &|_| true)?;
    for sentence in &shared.left_out {
        crate::output::print_error(&format!("{}: {sentence}\n", out.display()));
    }
    print(&format!("{}\n", out.display()))
}

/// `out/demo.html` for `out/demo`.
fn beside(directory: &Path) -> PathBuf {
    let whole = directory.canonicalize().unwrap_or_else(|_| directory.to_owned());
    let name = whole.file_name().unwrap_or_default().to_string_lossy().into_owned();
    directory.components().as_path().with_file_name(format!("{name}.html"))
}
