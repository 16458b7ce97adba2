//! `nudge manual`: man pages and shell completions, for installers.

use clap::CommandFactory;
use clap_complete::Shell;
use nudge_core::Error;
use nudge_core::files::write_atomically;
use std::path::{Path, PathBuf};

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The folder that they are laid out in as below `share`
    folder: PathBuf,
}

/// Where a shell looks for completions below `share`: folder and file.
const COMPLETIONS: [(Shell, &str, &str); 3] = [
    (Shell::Bash, "bash-completion/completions", "nudge"),
    (Shell::Zsh, "zsh/site-functions", "_nudge"),
    (Shell::Fish, "fish/vendor_completions.d", "nudge.fish"),
];

/// Runs the command.
///
/// # Errors
/// When the folder cannot be written to.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let make = |folder: &Path| std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error));
    let pages = args.folder.join("man/man1");
    make(&pages)?;
    // One page a subcommand: nudge.1, nudge-scene.1, nudge-scene-check.1 and so on.
    clap_mangen::generate_to(super::Cli::command(), &pages).map_err(|error| Error::io(&pages, error))?;
    for (shell, folder, name) in COMPLETIONS {
        let folder = args.folder.join(folder);
        make(&folder)?;
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut super::Cli::command(), "nudge", &mut script);
        write_atomically(&folder.join(name), &script)?;
    }
    Ok(())
}
