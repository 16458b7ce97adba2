//! What an installation is made of, whether it works, and what to do where it does not.
//!
//! [`Diagnosis::of_this_machine`] tries everything that an episode and the window need: it loads the weights, asks which
//! libtorch the process runs on, sets up a graphics device, and writes to the folders that will be written to.

mod folders;
mod libtorch;
#[cfg(test)]
mod tests;

pub use folders::Folder;
pub use libtorch::{Libtorch, WANTED};

use crate::made_by;
use nudge_core::cnabu;
use nudge_core::files::sha256_of_file;
use nudge_core::made_by::Build;
use nudge_core::places::{Found, MODELS, SCENES, Shipped};
use serde::Serialize;
use std::path::PathBuf;

/// Everything that was found out.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The program's version.
    pub version: &'static str,
    /// The git commit that it was built from, or `unknown`.
    pub commit: String,
    /// Whether what went into it differed from that commit; `null` where there is none.
    pub dirty: Option<bool>,
    /// The program's file.
    pub program: Option<PathBuf>,
    /// Whether this build has the networks.
    pub networks: bool,
    /// Whether this build has the window.
    pub window: bool,
    /// The networks' weights.
    pub weights: Weights,
    /// The scenes that came with the program.
    pub scenes: Place,
    /// The libtorch that the process runs on; `null` in a build without networks.
    pub libtorch: Option<Libtorch>,
    /// Where the networks run: `cpu` or `cuda`; `null` in a build without networks.
    pub device: Option<&'static str>,
    /// Numbers of threads.
    pub threads: Threads,
    /// What draws the window; `null` in a build without one, or where nothing does.
    pub graphics: Option<Graphics>,
    /// The folders that are written to.
    pub folders: Vec<Folder>,
    /// What is wrong.
    pub problems: Vec<Problem>,
}

/// A folder that comes with the program.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Place {
    /// The folder; `null` if it was not found.
    pub folder: Option<PathBuf>,
    /// How it was found.
    pub found: Option<String>,
}

/// The networks' weights.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Weights {
    /// Where they lie.
    #[serde(flatten)]
    pub place: Place,
    /// Their files.
    pub files: Vec<WeightFile>,
    /// Whether they load; `null` where there is nothing to load them with or onto.
    pub load: Option<bool>,
}

/// A file of weights.
#[derive(Clone, Debug, Serialize)]
pub struct WeightFile {
    /// Its name.
    pub file: &'static str,
    /// Its size; `null` if it is not there.
    pub bytes: Option<u64>,
    /// Its SHA-256; `null` if it cannot be read.
    pub sha256: Option<String>,
}

/// Numbers of threads.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Threads {
    /// Processors that the process may use.
    pub processors: usize,
    /// Threads of rays, pushes and pictures (`RAYON_NUM_THREADS`).
    pub planning: usize,
    /// Threads of the networks; `null` in a build without them.
    pub networks: Option<usize>,
}

/// What draws the window.
#[derive(Clone, Debug, Serialize)]
pub struct Graphics {
    /// The adapter's name.
    pub adapter: String,
    /// Through what it is spoken to: `Vulkan`, `Gl`.
    pub backend: String,
    /// Whether it is the processor that draws.
    pub software: bool,
    /// Whether there is a display to open the window on; `nudge shot` needs none.
    pub display: bool,
}

/// Something that is wrong.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// What is wrong.
    pub what: String,
    /// What to do.
    pub remedy: String,
}

impl Problem {
    fn new(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { what: what.into(), remedy: remedy.into() }
    }
}

impl Diagnosis {
    /// Looks at the program, what it finds and the machine; leaves nothing behind.
    pub fn of_this_machine() -> Self {
        let mut problems = Vec::new();
        if !cnabu::AVAILABLE {
            let what = "this build has no networks, which `nudge run` updates beliefs with unless told";
            problems.push(Problem::new(what, "build it with them (make demo), or choose --belief classical"));
        }
        let libtorch = libtorch::in_use();
        problems.extend(libtorch.as_ref().and_then(Libtorch::problem));
        let (device, networks) = networks(&mut problems);
        let weights = weights(MODELS.find(), device.is_some(), &mut problems);
        let scenes = place("scenes", &SCENES, SCENES.find(), &mut problems);
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = Threads { processors, planning: rayon::current_num_threads(), networks };
        let graphics = graphics(&mut problems);
        let folders = folders::all();
        problems.extend(folders.iter().flat_map(Folder::problems));
        let Build { commit, dirty } = made_by::build();
        Self {
            version: nudge_core::VERSION,
            commit,
            dirty,
            program: std::env::current_exe().ok(),
            networks: cnabu::AVAILABLE,
            window: cfg!(feature = "workbench"),
            weights,
            scenes,
            libtorch,
            device,
            threads,
            graphics,
            folders,
            problems,
        }
    }
}

/// Where something that comes with the program is; that it is not there is a problem.
fn place(noun: &str, shipped: &Shipped, found: Option<Found>, problems: &mut Vec<Problem>) -> Place {
    let variable = shipped.variable;
    let Some(Found { path, by }) = found else {
        let remedy = format!("name their folder with {variable}, or install the program again");
        problems.push(Problem::new(format!("no {noun} were found"), remedy));
        return Place::default();
    };
    if !path.is_dir() {
        let what = format!("{}: there is no such folder, {by}", path.display());
        problems.push(Problem::new(what, format!("correct {variable} or unset it")));
    }
    Place { folder: Some(path), found: Some(by.to_string()) }
}

/// The weights; loaded only where there is a device for them.
fn weights(found: Option<Found>, has_device: bool, problems: &mut Vec<Problem>) -> Weights {
    let place = place("weights", &MODELS, found, problems);
    let Some(folder) = place.folder.clone().filter(|folder| folder.is_dir()) else {
        return Weights { place, ..Weights::default() };
    };
    let file = |file| {
        let path = folder.join(file);
        let bytes = path.metadata().ok().map(|data| data.len());
        WeightFile { file, bytes, sha256: sha256_of_file(&path).ok() }
    };
    let files = [cnabu::OBSERVE_WEIGHTS, cnabu::PUSH_WEIGHTS].map(file).to_vec();
    let loaded = has_device.then(|| cnabu::load(&folder));
    if let Some(Err(error)) = &loaded {
        let (folder, variable) = (folder.display(), MODELS.variable);
        let remedy =
            format!("put the weights that came with the program into {folder}, or name others with {variable}");
        problems.push(Problem::new(error.to_string(), remedy));
    }
    Weights { place, files, load: loaded.map(|loaded| loaded.is_ok()) }
}

/// The device and the number of threads of the networks.
#[cfg(feature = "cnabu")]
fn networks(problems: &mut Vec<Problem>) -> (Option<&'static str>, Option<usize>) {
    let device = cnabu::device_name();
    if let Err(error) = &device {
        problems.push(Problem::new(error.to_string(), format!("correct or unset {}", cnabu::DEVICE_ENV)));
    }
    (device.ok(), Some(cnabu::threads()))
}

#[cfg(not(feature = "cnabu"))]
fn networks(_problems: &mut Vec<Problem>) -> (Option<&'static str>, Option<usize>) {
    (None, None)
}

#[cfg(feature = "workbench")]
fn graphics(problems: &mut Vec<Problem>) -> Option<Graphics> {
    let display =
        ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some_and(|at| !at.is_empty()));
    match crate::workbench::graphics::adapter() {
        Ok(adapter) => {
            Some(Graphics { adapter: adapter.name, backend: adapter.backend, software: adapter.software, display })
        }
        Err(why) => {
            let remedy = "install the graphics card's Vulkan driver, or a software one (Debian: mesa-vulkan-drivers)";
            problems.push(Problem::new(format!("nothing can draw the window: {why}"), remedy));
            None
        }
    }
}

#[cfg(not(feature = "workbench"))]
fn graphics(_problems: &mut Vec<Problem>) -> Option<Graphics> {
    None
}
