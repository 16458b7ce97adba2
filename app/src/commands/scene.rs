//! `nudge scene`: make, check, generate, rescale and draw scene files.

use super::progress::Progress;
use super::{print, to_json, warn};
use nudge_core::Error;
use nudge_core::arm::{Arm, ArmTool};
use nudge_core::camera::{ViewArray, hidden_objects};
use nudge_core::files::write_atomically;
use nudge_core::scene::{Catalog, Scene};
use nudge_core::score::{Scores, scores_without};
use serde::Serialize;
use std::path::{Path, PathBuf};

mod generate;
mod rescale;
mod thumbnail;

pub(super) use generate::{Fill, parse_fill};
pub(super) use rescale::{Scale, parse_scale};

/// Make, check, generate, rescale and draw scene files.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand, Debug)]
enum Command {
    New(NewArgs),
    Check(CheckArgs),
    Generate(generate::Args),
    Rescale(rescale::Args),
    Thumbnail(thumbnail::Args),
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

/// Check scene files: how full they are, how many objects no view shows, and how good a map without these can be
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

/// Does what `nudge scene ...` asks for.
///
/// # Errors
///
/// Wrong use, bad scenes, and files that cannot be read or written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.command {
        Command::New(args) => new(args),
        Command::Check(args) => check(args),
        Command::Generate(args) => generate::run(args),
        Command::Rescale(args) => rescale::run(args),
        Command::Thumbnail(args) => thumbnail::run(args),
    }
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
         # chips_can = \"chips_can.obj\"\n\
         # gum_tin = {{ file = \"tin.stl\", unit = \"in\" }}   # m, dm, cm, mm, in, km; guessed where it is left out\n\n\
         # [robot]                        # the arm before the shelf; these are the defaults\n\
         # base = [0.0, -0.70, -0.015]    # origin of its base, as high as the table that it stands on\n\
         # yaw_deg = 0.0                  # turn of the base\n\
         # urdf = \"my_arm.urdf\"          # an arm of one's own, relative to this file, for the UR5 that Nudge has\n\
         # tool = \"tip\"                 # its link at the finger tip, where that has no usual name\n\
         # camera = \"lens\"              # its link of the camera in hand\n\n\
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
    /// Scores of a perfect map of all other objects: anything better needs pushes, or a lucky guess.
    without_hidden: Scores,
}

fn check(args: &CheckArgs) -> anyhow::Result<()> {
    let catalog = Catalog::standard();
    let views = ViewArray::named(&args.views)?;
    let bar = Progress::new("check", args.files.len());
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
                        "{}: {} objects, fill {:.1} %, {} hidden; mapped perfectly without them: IoU {:.3}, mIoU {:.3}\n",
                        file.display(),
                        facts.objects,
                        100.0 * facts.fill,
                        facts.hidden.len(),
                        facts.without_hidden.occupancy_iou,
                        facts.without_hidden.semantic_miou
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
        bar.inc();
    }
    bar.finish();
    if args.json {
        print(&to_json(&serde_json::json!({ "scenes": documents }))?)?;
    }
    last_error.map_or(Ok(()), |error| Err(error.into()))
}

fn check_file(file: &Path, catalog: &Catalog, views: &ViewArray) -> nudge_core::Result<(Facts, Vec<String>)> {
    let (scene, mut warnings) = Scene::load(file, catalog)?;
    let arm = ArmTool::new(Arm::placed(&scene.robot)?, scene.shelf);
    warnings.extend(arm.arm.warnings.iter().map(|warning| format!("{}: {warning}", arm.arm.name)));
    if arm.ready.is_none() {
        warnings.push(format!("{} reaches no place before the shelf from where it stands", arm.arm.name));
    }
    let bodies = scene.bodies(catalog)?;
    let hidden = hidden_objects(&scene.shelf, &bodies, views);
    let name = |id: &nudge_core::scene::ObjectId| format!("{}#{}", scene.objects[usize::from(id.0)].class, id.0);
    let facts = Facts {
        name: scene.name.clone(),
        objects: scene.objects.len(),
        fill: scene.fill(catalog)?,
        hidden: hidden.iter().map(name).collect(),
        without_hidden: scores_without(&scene.grid(), &bodies, &hidden),
    };
    Ok((facts, warnings))
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
