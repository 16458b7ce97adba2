//! `nudge scene generate`: random scenes.

use super::{unknown_class, with_absolute_meshes};
use crate::commands::progress::Progress;
use crate::commands::{print, to_json, warn};
use nudge_core::camera::{ViewArray, hidden_objects};
use nudge_core::scene::{Catalog, ClassId, Family, GenerateConfig, Scene, Shelf, generate};
use nudge_core::{Error, rng};
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Draws of a scene until one hides enough objects.
const MAX_DRAWS: usize = 1000;

/// Generate random scenes as DIR/000.toml, 001.toml, ...
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Number of scenes
    #[arg(long, default_value_t = 1)]
    count: usize,
    /// What is placed before the rest is filled at random: mixed, crowded, walls, rows, rings, tall-first, halves, chambers
    #[arg(long, default_value_t = Family::Mixed, value_name = "NAME")]
    family: Family,
    /// Share of the floor that objects cover: 0.4, or a range that each scene draws from [default: 0.30-0.45, or the
    /// family's own]
    #[arg(long, value_parser = parse_fill, value_name = "SHARE")]
    fill: Option<Fill>,
    /// Regularity: 0 places freely, 1 lines objects up behind each other [default: 0, or the family's own]
    #[arg(long)]
    rho: Option<f32>,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Directory to write to
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Classes to place [default: all]
    #[arg(long, value_delimiter = ',', value_name = "CLASS,...")]
    classes: Vec<String>,
    /// Shelf interior: width, depth and height in metres [default: 0.8,0.4,0.4]
    #[arg(long, value_delimiter = ',', num_args = 1, value_name = "W,D,H")]
    shelf: Vec<f32>,
    /// Keep the objects, meshes and shelf of this scene, and generate around them
    #[arg(long, value_name = "FILE", conflicts_with = "shelf")]
    around: Option<PathBuf>,
    /// Only scenes where at least so many objects are unseen from all 300 views
    #[arg(long, visible_alias = "hidden-at-least", default_value_t = 0, value_name = "N")]
    hidden: usize,
    /// What the scenes' names start with [default: generated-SEED]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Overwrite files that are there
    #[arg(long)]
    force: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// A range of floor shares.
#[derive(Clone, Copy, Debug)]
pub(in crate::commands) struct Fill(pub(in crate::commands) [f32; 2]);

/// `0.4`, or a range, `0.30-0.45`.
pub(in crate::commands) fn parse_fill(text: &str) -> Result<Fill, String> {
    let number = |text: &str| text.trim().parse::<f32>().map_err(|_| format!("`{text}` is not a number"));
    let (low, high) = text.split_once('-').unwrap_or((text, text));
    Ok(Fill([number(low)?, number(high)?]))
}

/// What `nudge scene generate --json` tells of a scene.
#[derive(Serialize)]
struct Generated {
    file: String,
    name: String,
    objects: usize,
    fill: f32,
    target_fill: f32,
    /// Whether the target was reached; if not, nothing more had room.
    reached: bool,
    /// Objects unseen from all views, when that was asked for.
    hidden: Option<usize>,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let catalog = Catalog::standard();
    let config = config(args, &catalog)?;
    let digits = args.count.saturating_sub(1).to_string().len().max(3);
    let files: Vec<PathBuf> = (0..args.count).map(|at| args.out.join(format!("{at:0digits$}.toml"))).collect();
    if !args.force
        && let Some(file) = files.iter().find(|file| file.exists())
    {
        return Err(Error::input(file, "", "is there already; --force overwrites it").into());
    }
    let views = (args.hidden > 0).then(|| ViewArray::named("standard300")).transpose()?;
    let bar = Progress::new("generate", args.count);
    // All scenes before any file, so that nothing half-done is left behind.
    let scenes = files
        .par_iter()
        .enumerate()
        .map(|(at, file)| {
            let generated = generate_one(args, &config, &catalog, views.as_ref(), at, file);
            bar.inc();
            generated
        })
        .collect::<nudge_core::Result<Vec<_>>>()?;
    bar.finish();
    std::fs::create_dir_all(&args.out).map_err(|error| Error::io(&args.out, error))?;
    for ((scene, _), file) in scenes.iter().zip(&files) {
        scene.save_toml(file)?;
    }
    let documents: Vec<Generated> = scenes.into_iter().map(|(_, document)| document).collect();
    for document in documents.iter().filter(|document| !document.reached) {
        let (fill, target) = (100.0 * document.fill, 100.0 * document.target_fill);
        warn(&format!("{}: filled to {fill:.1} % of {target:.1} %: nothing more had room", document.file));
    }
    if args.json {
        return print(&to_json(&serde_json::json!({ "seed": args.seed, "scenes": documents }))?);
    }
    for document in &documents {
        let hidden = document.hidden.map_or(String::new(), |hidden| format!(", {hidden} hidden"));
        let fill = 100.0 * document.fill;
        print(&format!("{}: {} objects, fill {fill:.1} %{hidden}\n", document.file, document.objects))?;
    }
    Ok(())
}

fn config(args: &Args, catalog: &Catalog) -> anyhow::Result<GenerateConfig> {
    let class = |name: &String| -> Result<ClassId, Error> {
        catalog.by_name(name).map(|class| class.id).ok_or_else(|| unknown_class(catalog, name))
    };
    let classes = args.classes.iter().map(class).collect::<Result<Vec<_>, _>>()?;
    let mut config = match &args.around {
        Some(file) => {
            let (scene, warnings) = Scene::load(file, catalog)?;
            for warning in warnings {
                warn(&format!("{}: {warning}", file.display()));
            }
            GenerateConfig::around(&with_absolute_meshes(scene, file)?)
        }
        None => GenerateConfig::default(),
    };
    match args.shelf[..] {
        [] => {}
        [width, depth, height] => config.shelf = Shelf::new([width, depth, height]),
        _ => return Err(Error::Usage("--shelf wants three numbers: width,depth,height".into()).into()),
    }
    let family = args.family;
    let fill = args.fill.map_or(family.fill(), |fill| fill.0);
    Ok(GenerateConfig { family, fill, rho: args.rho.unwrap_or(family.rho()), classes, ..config })
}

/// Draws scenes until one hides enough objects.
fn generate_one(
    args: &Args,
    config: &GenerateConfig,
    catalog: &Catalog,
    views: Option<&ViewArray>,
    at: usize,
    file: &Path,
) -> nudge_core::Result<(Scene, Generated)> {
    let own_seed = rng::derived_seed(args.seed, "generated scenes", at as u64);
    for draw in 0..MAX_DRAWS {
        let seed = rng::derived_seed(own_seed, "draws of a scene", draw as u64);
        let mut scene = generate(catalog, config, seed)?;
        let hidden = match views {
            Some(views) => Some(hidden_objects(&scene.shelf, &scene.bodies(catalog)?, views).len()),
            None => None,
        };
        if hidden.is_some_and(|hidden| hidden < args.hidden) {
            continue;
        }
        scene.name = match &args.name {
            Some(name) => format!("{name}-{at:03}"),
            None => format!("generated-{}-{at:03}", args.seed),
        };
        let (fill, target_fill) = (scene.fill(catalog)?, config.target_fill(seed));
        let structure = match config.family {
            Family::Mixed => String::new(),
            family => format!("{}; ", family.description()),
        };
        let hidden_words = hidden.map_or(String::new(), |hidden| format!(", {hidden} hidden"));
        let regularity = config.rho;
        scene.description = format!("generated: {structure}fill {fill:.2}, regularity {regularity}{hidden_words}");
        let document = Generated {
            file: file.display().to_string(),
            name: scene.name.clone(),
            objects: scene.objects.len(),
            fill,
            target_fill,
            reached: fill > target_fill - 0.01,
            hidden,
        };
        return Ok((scene, document));
    }
    Err(Error::Usage(format!("no scene of {MAX_DRAWS} hides {} objects; ask for more fill", args.hidden)))
}
