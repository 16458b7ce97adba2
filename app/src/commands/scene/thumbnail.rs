//! `nudge scene thumbnail`: pictures of scenes, one by one or together on a sheet.

use crate::commands::progress::Progress;
use crate::commands::{print, warn};
use crate::figure::{INK, RasterStyle, Svg, Text, text_width};
use crate::picture::{self, View};
use nudge_core::Error;
use nudge_core::scene::{Catalog, Scene};
use std::path::{Path, PathBuf};

/// Draw a picture of each scene
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Scene files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The picture of a single scene [default: beside each scene, with .png for .toml]
    #[arg(long, value_name = "PNG")]
    out: Option<PathBuf>,
    /// All on one sheet, each under its name, instead of a picture each
    #[arg(long, value_name = "PNG", conflicts_with = "out")]
    sheet: Option<PathBuf>,
    /// Straight from above instead of from the front
    #[arg(long)]
    above: bool,
    /// Width of a picture, pixels [default: 640; on a sheet 320]
    #[arg(long, value_parser = clap::value_parser!(u32).range(16..=8192))]
    width: Option<u32>,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    if args.out.is_some() && args.files.len() > 1 {
        return Err(Error::Usage("--out names the picture of one scene; leave it out for several".to_owned()).into());
    }
    if let Some(path) = &args.sheet {
        return sheet(args, path);
    }
    let catalog = Catalog::standard();
    let view = if args.above { View::Above } else { View::Front };
    let bar = Progress::new("draw", args.files.len());
    for file in &args.files {
        let (scene, warnings) = Scene::load(file, &catalog)?;
        warnings.iter().for_each(|warning| bar.suspend(|| warn(&format!("{}: {warning}", file.display()))));
        let out = args.out.clone().unwrap_or_else(|| file.with_extension("png"));
        picture::save(&picture::thumbnail(&scene, &catalog, view, args.width.unwrap_or(640))?, &out)?;
        bar.suspend(|| print(&format!("{}\n", out.display())))?;
        bar.inc();
    }
    bar.finish();
    Ok(())
}

/// Columns of a sheet, and of one with more than [`MANY`] pictures.
const COLUMNS: [usize; 2] = [5, 10];
const MANY: usize = 40;
/// Space around a picture, and height of its caption, units.
const GAP: f32 = 8.0;
const CAPTION: f32 = 16.0;

/// Draws all scenes on one sheet.
fn sheet(args: &Args, path: &Path) -> anyhow::Result<()> {
    let catalog = Catalog::standard();
    let view = if args.above { View::Above } else { View::Front };
    let pixels = args.width.unwrap_or(320);
    let bar = Progress::new("draw", args.files.len());
    let mut pictures = Vec::new();
    for file in &args.files {
        let (scene, warnings) = Scene::load(file, &catalog)?;
        warnings.iter().for_each(|warning| bar.suspend(|| warn(&format!("{}: {warning}", file.display()))));
        pictures.push((picture::thumbnail(&scene, &catalog, view, pixels)?, scene.name));
        bar.inc();
    }
    bar.finish();
    // A unit is a pixel.
    let width = pixels as f32;
    let height = pictures.iter().map(|(picture, _)| picture.height()).max().unwrap_or(1) as f32;
    let columns = pictures.len().clamp(1, COLUMNS[usize::from(pictures.len() > MANY)]);
    let rows = pictures.len().div_ceil(columns);
    let pitch = [width + GAP, height + CAPTION + GAP];
    let mut svg = Svg::new([GAP + columns as f32 * pitch[0], GAP + rows as f32 * pitch[1]]);
    for (at, (picture, name)) in pictures.iter().enumerate() {
        let corner = [GAP + (at % columns) as f32 * pitch[0], GAP + (at / columns) as f32 * pitch[1]];
        let size = [picture.width(), picture.height()].map(|n| n as f32);
        svg.raster([corner[0], corner[1] + CAPTION], size, picture, RasterStyle::Smooth);
        let type_size = (13.0 * width / text_width(name, 13.0).max(1.0)).min(13.0);
        svg.text(&Text::new(name, [corner[0] + 1.0, corner[1] + CAPTION - 5.0], type_size).colored(INK));
    }
    picture::save(&svg.render(1.0)?, path)?;
    print(&format!("{}\n", path.display()))
}
