//! `nudge scene rescale`: the same scenes with every object in another size.

use super::with_absolute_meshes;
use crate::commands::progress::Progress;
use crate::commands::{print, to_json, warn};
use nudge_core::camera::{ViewArray, hidden_objects};
use nudge_core::scene::{Catalog, Scene, rescale};
use nudge_core::{Error, rng};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Stretch every object of scenes by random factors; objects that then overlap are moved apart as little as possible
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Scene files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Smallest and largest factor; each object draws one per axis
    #[arg(long, default_value = "0.8-1.2", value_name = "LOW-HIGH", value_parser = parse_scale)]
    scale: Scale,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Directory to write to; files keep their names
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Overwrite files that are there
    #[arg(long)]
    force: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// A range of factors of an object's size.
#[derive(Clone, Copy, Debug)]
pub(in crate::commands) struct Scale(pub(in crate::commands) [f32; 2]);

/// A range, `0.8-1.2`.
pub(in crate::commands) fn parse_scale(text: &str) -> Result<Scale, String> {
    let number = |text: &str| text.trim().parse::<f32>().map_err(|_| format!("`{text}` is not a number"));
    let (low, high) = text.split_once('-').ok_or("a range is two numbers, such as 0.8-1.2")?;
    let (low, high) = (number(low)?, number(high)?);
    if low > 0.0 && low <= high && high.is_finite() {
        Ok(Scale([low, high]))
    } else {
        Err("the range must rise, above 0".to_owned())
    }
}

/// What `nudge scene rescale --json` tells of a scene.
#[derive(Serialize)]
struct Rescaled {
    file: String,
    from: String,
    objects: usize,
    fill: f32,
    hidden: usize,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let catalog = Catalog::standard();
    let views = ViewArray::named("standard300")?;
    let targets = targets(args)?;
    let bar = Progress::new("rescale", args.files.len());
    // All scenes before any file, so that nothing half-done is left behind.
    let rescaled = args
        .files
        .par_iter()
        .zip(&targets)
        .map(|(file, target)| {
            let rescaled = rescale_one(args, file, target, &catalog, &views);
            bar.inc();
            rescaled
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    bar.finish();
    std::fs::create_dir_all(&args.out).map_err(|error| Error::io(&args.out, error))?;
    for ((scene, _), target) in rescaled.iter().zip(&targets) {
        scene.save_toml(target)?;
    }
    let documents: Vec<Rescaled> = rescaled.into_iter().map(|(_, document)| document).collect();
    if args.json {
        return print(&to_json(&serde_json::json!({ "seed": args.seed, "scenes": documents }))?);
    }
    for Rescaled { file, objects, fill, hidden, .. } in &documents {
        print(&format!("{file}: {objects} objects, fill {:.1} %, {hidden} hidden\n", 100.0 * fill))?;
    }
    Ok(())
}

/// Where every scene goes.
fn targets(args: &Args) -> anyhow::Result<Vec<PathBuf>> {
    let mut taken = BTreeSet::new();
    let mut targets = Vec::new();
    for file in &args.files {
        let name = file.file_name().ok_or_else(|| Error::input(file, "", "is no scene file"))?;
        let target = args.out.join(name);
        if !taken.insert(name) {
            return Err(Error::input(file, "", "another file of this name comes before it").into());
        }
        if target.exists() && !args.force {
            return Err(Error::input(&target, "", "is there already; --force overwrites it").into());
        }
        targets.push(target);
    }
    Ok(targets)
}

fn rescale_one(
    args: &Args,
    file: &Path,
    target: &Path,
    catalog: &Catalog,
    views: &ViewArray,
) -> anyhow::Result<(Scene, Rescaled)> {
    let (scene, warnings) = Scene::load(file, catalog)?;
    warnings.iter().for_each(|warning| warn(&format!("{}: {warning}", file.display())));
    let scene = with_absolute_meshes(scene, file)?;
    // A stream per scene, named after its file: adding a scene to a set changes no other.
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let [low, high] = args.scale.0;
    let mut rescaled = rescale(&scene, catalog, args.scale.0, rng::derived_seed(args.seed, &stem, 0))?;
    rescaled.name = format!("{} (rescaled)", scene.name);
    let note = format!("every object stretched {low} to {high} on each axis");
    rescaled.description = if scene.description.is_empty() { note } else { format!("{}; {note}", scene.description) };
    rescaled.check(catalog)?;
    let document = Rescaled {
        file: target.display().to_string(),
        from: file.display().to_string(),
        objects: rescaled.objects.len(),
        fill: rescaled.fill(catalog)?,
        hidden: hidden_objects(&rescaled.shelf, &rescaled.bodies(catalog)?, views).len(),
    };
    Ok((rescaled, document))
}
