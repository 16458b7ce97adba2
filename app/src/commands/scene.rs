//! `nudge scene`: make, check, generate and draw scene files.

use super::{print, to_json, warn};
use crate::picture::{self, View};
use indicatif::{ProgressBar, ProgressStyle};
use nudge_core::camera::{ViewArray, hidden_objects};
use nudge_core::files::write_atomically;
use nudge_core::scene::{Catalog, ClassId, GenerateConfig, Scene, Shelf, generate};
use nudge_core::{Error, rng};
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Draws of a scene until one hides enough objects.
const MAX_DRAWS: usize = 1000;

/// Make, check, generate and draw scene files.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand, Debug)]
enum Command {
    New(NewArgs),
    Check(CheckArgs),
    Generate(GenerateArgs),
    Thumbnail(ThumbnailArgs),
}

/// Write a scene to start from: a few objects, and every key explained
#[derive(clap::Args, Debug)]
struct NewArgs {
    /// Name of the scene
    name: String,
    /// File to write [default: NAME.toml]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Overwrite the file if it is there
    #[arg(long)]
    force: bool,
}

/// Check scene files, and tell how full they are and how many objects no view shows
#[derive(clap::Args, Debug)]
struct CheckArgs {
    /// Scene files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// View array that objects count as hidden from
    #[arg(long, default_value = "standard300")]
    views: String,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Generate random scenes as DIR/000.toml, 001.toml, ...
#[derive(clap::Args, Debug)]
struct GenerateArgs {
    /// Number of scenes
    #[arg(long, default_value_t = 1)]
    count: usize,
    /// Share of the floor that objects cover: 0.4, or a range that each scene draws from, 0.30-0.45
    #[arg(long, default_value = "0.30-0.45", value_parser = parse_fill)]
    fill: Fill,
    /// Regularity: 0 places freely, 1 lines objects up behind each other
    #[arg(long, default_value_t = 0.0)]
    rho: f32,
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
    #[arg(long, default_value_t = 0, value_name = "N")]
    hidden: usize,
    /// Overwrite files that are there
    #[arg(long)]
    force: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Draw a picture of each scene
#[derive(clap::Args, Debug)]
struct ThumbnailArgs {
    /// Scene files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The picture of a single scene [default: beside each scene, with .png for .toml]
    #[arg(long, value_name = "PNG")]
    out: Option<PathBuf>,
    /// Straight from above instead of from the front
    #[arg(long)]
    above: bool,
    /// Width of the picture, pixels
    #[arg(long, default_value_t = 640, value_parser = clap::value_parser!(u32).range(16..=8192))]
    width: u32,
}

/// A range of floor shares.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fill(pub(super) [f32; 2]);

/// `0.4`, or a range, `0.30-0.45`.
pub(super) fn parse_fill(text: &str) -> Result<Fill, String> {
    let number = |text: &str| text.trim().parse::<f32>().map_err(|_| format!("`{text}` is not a number"));
    let (low, high) = text.split_once('-').unwrap_or((text, text));
    Ok(Fill([number(low)?, number(high)?]))
}

/// Does what `nudge scene ...` asks for.
///
/// # Errors
///
/// Wrong use, bad scenes, and files that cannot be read or written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.command {
        Command::New(args) => new(args),
        Command::Check(args) => check(args),
        Command::Generate(args) => generate_files(args),
        Command::Thumbnail(args) => thumbnails(args),
    }
}

/// A bar on standard error, when that is a terminal and there is more than one thing to wait for.
fn progress(count: usize, what: &str) -> ProgressBar {
    if count < 2 {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}").expect("a constant template");
    ProgressBar::new(count as u64).with_style(style).with_message(what.to_owned())
}

fn new(args: &NewArgs) -> anyhow::Result<()> {
    let catalog = Catalog::standard();
    let path = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("{}.toml", args.name)));
    let text = template(&args.name, &catalog);
    Scene::parse(&text, &path, &catalog)?;
    if path.exists() && !args.force {
        return Err(Error::input(&path, "", "is there already; --force overwrites it").into());
    }
    write_atomically(&path, text.as_bytes())?;
    print(&format!("{}\n", path.display()))
}

fn template(name: &str, catalog: &Catalog) -> String {
    let mut text = format!(
        "# A scene: what stands in the shelf. x is right, y into the shelf (0 at its front edge), metres.\n\
         format = 1\n\
         name = {name:?}\n\
         description = \"a few objects to start from\"\n\n\
         [shelf]\n\
         size = [0.80, 0.40, 0.40]        # width (x from -0.40 to 0.40), depth, height\n\
         # voxel_m = 0.005                # edge of a voxel\n\
         # column_closure = true          # above free all is free, below occupied all is occupied\n\n\
         # [meshes]                       # shapes of one's own: class = mesh file, relative to this file\n\
         # chips_can = \"chips_can.obj\"\n\n\
         # Classes, with their size along x, y, z in metres:\n"
    );
    for class in &catalog.classes {
        let size = class.solid.bounds().size();
        text += &format!("#   {:<16}{:.3} {:.3} {:.3}\n", class.name, size.x, size.y, size.z);
    }
    text += "\n[[object]]\nclass = \"cereal_box\"\nposition = [-0.10, 0.10]         # centre of the footprint\n\
             yaw_deg = 90.0                   # counter-clockwise about z; 0 when left out\n\
             # scale = [1.0, 1.0, 1.1]        # stretch along the object's own axes\n\
             # mesh = \"my_box.stl\"            # a shape of this object's own\n\
             \n[[object]]\nclass = \"tomato_can\"\nposition = [-0.12, 0.25]\n\
             \n[[object]]\nclass = \"mustard_bottle\"\nposition = [0.15, 0.20]\nyaw_deg = 30.0\n";
    text
}

/// What `nudge scene check --json` tells of a file.
#[derive(Serialize)]
struct Checked {
    file: String,
    ok: bool,
    #[serde(flatten)]
    facts: Option<Facts>,
    warnings: Vec<String>,
    error: Option<String>,
}

#[derive(Serialize)]
struct Facts {
    name: String,
    objects: usize,
    fill: f32,
    /// Objects unseen from every view, as `class#id`.
    hidden: Vec<String>,
}

fn check(args: &CheckArgs) -> anyhow::Result<()> {
    let catalog = Catalog::standard();
    let views = ViewArray::named(&args.views)?;
    let bar = progress(args.files.len(), "checking");
    let mut documents = Vec::new();
    let mut last_error: Option<Error> = None;
    for file in &args.files {
        let mut document =
            Checked { file: file.display().to_string(), ok: true, facts: None, warnings: Vec::new(), error: None };
        match check_file(file, &catalog, &views) {
            Ok((facts, warnings)) => {
                document.warnings = warnings;
                for warning in &document.warnings {
                    bar.suspend(|| warn(&format!("{}: {warning}", file.display())));
                }
                if !args.json {
                    let line = format!(
                        "{}: {} objects, fill {:.1} %, {} hidden\n",
                        file.display(),
                        facts.objects,
                        100.0 * facts.fill,
                        facts.hidden.len()
                    );
                    bar.suspend(|| print(&line))?;
                }
                document.facts = Some(facts);
            }
            Err(error) => {
                document.ok = false;
                document.error = Some(error.to_string());
                // The last one goes to whoever prints errors and sets the exit code.
                if let Some(before) = last_error.replace(error) {
                    bar.suspend(|| eprintln!("{before}"));
                }
            }
        }
        documents.push(document);
        bar.inc(1);
    }
    bar.finish_and_clear();
    if args.json {
        print(&to_json(&serde_json::json!({ "scenes": documents }))?)?;
    }
    last_error.map_or(Ok(()), |error| Err(error.into()))
}

fn check_file(file: &Path, catalog: &Catalog, views: &ViewArray) -> nudge_core::Result<(Facts, Vec<String>)> {
    let (scene, warnings) = Scene::load(file, catalog)?;
    let bodies = scene.bodies(catalog)?;
    let hidden = hidden_objects(&scene.shelf, &bodies, views);
    let name = |id: &nudge_core::scene::ObjectId| format!("{}#{}", scene.objects[usize::from(id.0)].class, id.0);
    let facts = Facts {
        name: scene.name.clone(),
        objects: scene.objects.len(),
        fill: scene.fill(catalog)?,
        hidden: hidden.iter().map(name).collect(),
    };
    Ok((facts, warnings))
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

fn generate_files(args: &GenerateArgs) -> anyhow::Result<()> {
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
    let bar = progress(args.count, "generating");
    // All scenes before any file, so that nothing half-done is left behind.
    let scenes = files
        .par_iter()
        .enumerate()
        .map(|(at, file)| {
            let generated = generate_one(args, &config, &catalog, views.as_ref(), at, file);
            bar.inc(1);
            generated
        })
        .collect::<nudge_core::Result<Vec<_>>>()?;
    bar.finish_and_clear();
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

fn config(args: &GenerateArgs, catalog: &Catalog) -> anyhow::Result<GenerateConfig> {
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
    Ok(GenerateConfig { fill: args.fill.0, rho: args.rho, classes, ..config })
}

/// An [`Error::Usage`] about a class on the command line.
pub(super) fn unknown_class(catalog: &Catalog, name: &str) -> Error {
    let hint = match catalog.nearest_name(name) {
        Some(near) => format!("did you mean `{near}`?"),
        None => {
            let names: Vec<&str> = catalog.classes.iter().map(|class| class.name.as_str()).collect();
            format!("known are {}", names.join(", "))
        }
    };
    Error::Usage(format!("unknown class `{name}`; {hint}"))
}

/// Names mesh files by their full paths: the generated scenes lie elsewhere.
fn with_absolute_meshes(mut scene: Scene, file: &Path) -> anyhow::Result<Scene> {
    let folder = file.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let folder = folder.canonicalize().map_err(|error| Error::io(folder, error))?;
    let absolute = |source: &str| folder.join(source).display().to_string();
    for object in &mut scene.objects {
        object.mesh = object.mesh.as_deref().map(absolute);
    }
    let own = |key: &str, catalog: &Catalog| catalog.by_name(key).is_none();
    let catalog = Catalog::standard();
    scene.meshes = std::mem::take(&mut scene.meshes)
        .into_iter()
        .map(|(key, mut mesh)| {
            mesh.source = absolute(&mesh.source);
            (if own(&key, &catalog) { absolute(&key) } else { key }, mesh)
        })
        .collect();
    Ok(scene)
}

/// Draws scenes until one hides enough objects.
fn generate_one(
    args: &GenerateArgs,
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
        scene.name = format!("generated-{}-{at:03}", args.seed);
        let (fill, target_fill) = (scene.fill(catalog)?, config.target_fill(seed));
        scene.description = match hidden {
            Some(hidden) => format!("generated: fill {fill:.2}, regularity {}, {hidden} hidden", config.rho),
            None => format!("generated: fill {fill:.2}, regularity {}", config.rho),
        };
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

fn thumbnails(args: &ThumbnailArgs) -> anyhow::Result<()> {
    if args.out.is_some() && args.files.len() > 1 {
        return Err(Error::Usage("--out names the picture of one scene; leave it out for several".to_owned()).into());
    }
    let catalog = Catalog::standard();
    let view = if args.above { View::Above } else { View::Front };
    let bar = progress(args.files.len(), "drawing");
    for file in &args.files {
        let (scene, warnings) = Scene::load(file, &catalog)?;
        warnings.iter().for_each(|warning| bar.suspend(|| warn(&format!("{}: {warning}", file.display()))));
        let out = args.out.clone().unwrap_or_else(|| file.with_extension("png"));
        picture::save(&picture::thumbnail(&scene, &catalog, view, args.width)?, &out)?;
        bar.suspend(|| print(&format!("{}\n", out.display())))?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}
