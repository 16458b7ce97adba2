//! `nudge shot`: the workbench's window as a picture, without a display.

use crate::workbench::file_kind::FileKind;
use crate::workbench::model::LayoutKind;
use crate::workbench::shot::{Shot, shoot};
use std::path::PathBuf;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A scene (.toml) or an episode's directory
    open: PathBuf,
    /// A second episode, for the layout compare
    #[arg(long, value_name = "EPISODE")]
    with: Option<PathBuf>,
    /// Number of actions after which to show it (default: the last state)
    #[arg(long)]
    step: Option<usize>,
    /// episode, why, gains, push, compare or author; all for one picture of each
    #[arg(long, default_value = "episode", value_parser = layout)]
    layout: Layouts,
    /// Width and height of the window, points
    #[arg(long, default_value = "1440x900", value_parser = size)]
    size: [u32; 2],
    /// Pixels per point; 2 for a figure in print
    #[arg(long, default_value_t = 1.0)]
    scale: f32,
    /// The light theme
    #[arg(long)]
    light: bool,
    /// Show the arm at this time of its last motion, in seconds
    #[arg(long, value_name = "SECONDS")]
    arm: Option<f64>,
    /// The picture; with --layout all, the layout's name is added to the file name
    #[arg(long)]
    out: PathBuf,
}

/// Which layouts are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layouts {
    All,
    One(LayoutKind),
}

fn layout(name: &str) -> Result<Layouts, String> {
    if name.eq_ignore_ascii_case("all") {
        return Ok(Layouts::All);
    }
    let known = || LayoutKind::ALL.map(|layout| layout.title().to_lowercase()).join(", ");
    let one = LayoutKind::ALL.into_iter().find(|layout| layout.title().eq_ignore_ascii_case(name));
    one.map(Layouts::One).ok_or_else(|| format!("there are {}, all", known()))
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let (width, height) = text.split_once('x').ok_or("width and height, like 1440x900")?;
    let number = |text: &str| text.parse::<u32>().ok().filter(|n| (200..=8192).contains(n));
    match (number(width), number(height)) {
        (Some(width), Some(height)) => Ok([width, height]),
        _ => Err("two numbers from 200 to 8192, like 1440x900".to_owned()),
    }
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    for path in std::iter::once(&args.open).chain(&args.with) {
        anyhow::ensure!(path.exists(), "{}: no such file or directory", path.display());
        anyhow::ensure!(
            FileKind::of(path) != FileKind::Recording,
            "{0}: is a recording, which has no layouts; `nudge open {0} --picture PNG` makes a picture of it, or name the \
             episode's directory",
            path.display()
        );
    }
    anyhow::ensure!((0.5..=4.0).contains(&args.scale), "--scale {}: must be between 0.5 and 4", args.scale);
    let out = tempfile::tempdir()?;
    let shot = Shot {
        open: args.open.clone(),
        with: args.with.clone(),
        step: args.step,
        layouts: match args.layout {
            Layouts::All => LayoutKind::ALL.to_vec(),
            Layouts::One(layout) => vec![layout],
        },
        size: args.size,
        scale: args.scale,
        light: args.light,
        arm_s: args.arm,
    };
    for (layout, picture) in shoot(&shot, out.path().to_owned())? {
        let path = match args.layout {
            Layouts::One(_) => args.out.clone(),
            Layouts::All => {
                let stem = args.out.file_stem().unwrap_or_default().to_string_lossy();
                args.out.with_file_name(format!("{stem}-{}.png", layout.title().to_lowercase()))
            }
        };
        crate::picture::save(&picture, &path)?;
    }
    Ok(())
}
