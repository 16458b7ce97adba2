//! A scene in the making: the document, what is chosen in it, undo and redo, what is wrong with it, and, in the
//! background, which of its objects no view can see.
//!
//! Nothing in here draws. While it is edited the document may hold what a scene file may not (overlaps, objects outside);
//! [`Author::save`] refuses until that is put right.

mod edit;
mod gesture;
mod history;
mod plan;
mod snap;
#[cfg(test)]
mod tests;

pub use edit::Choose;
pub use gesture::Gesture;
pub use history::Edit;
pub use plan::{Plan, name};
pub use snap::{Snap, normal_angle, rounded};

use super::latest::{Latest, Wake};
use history::History;
use nudge_core::camera::{ViewArray, hidden_objects_while};
use nudge_core::scene::{Catalog, GenerateConfig, Object, Scene, Shelf, generate};
use nudge_core::{Error, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

/// The views that an object is hidden from.
const VIEWS: &str = "standard300";
/// Name of a scene that has none yet.
const UNNAMED: &str = "new-scene";

static VIEW_ARRAY: LazyLock<Option<ViewArray>> = LazyLock::new(|| ViewArray::named(VIEWS).ok());

/// What *Generate* is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FillForm {
    /// Share of the floor that footprints shall cover.
    pub fill: f32,
    /// Regularity in 0 to 1: how strongly objects line up behind each other.
    pub rho: f32,
    /// Seed of every random choice; goes on by one after each use.
    pub seed: u64,
}

impl Default for FillForm {
    fn default() -> Self {
        Self { fill: 0.35, rho: 0.0, seed: 0 }
    }
}

/// Objects that no view shows, as far as they have been counted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hidden {
    /// Positions in the scene's list; `None` before the first count.
    pub objects: Option<BTreeSet<usize>>,
    /// Whether the scene has changed since.
    pub is_stale: bool,
}

/// The scene in the making.
pub struct Author {
    catalog: Arc<Catalog>,
    scene: Scene,
    /// As it is on disk.
    saved: Scene,
    path: Option<PathBuf>,
    history: History<Scene>,
    selection: BTreeSet<usize>,
    gesture: Option<Gesture>,
    plan: Plan,
    hidden: Hidden,
    count: Latest<BTreeSet<usize>>,
    /// The first count that is about the objects that are there now, at whatever places.
    first_count: u64,
    /// Number of objects that were counted last.
    counted: usize,
    generator: Latest<Result<Vec<Object>>>,
    /// The grid that positions snap to.
    pub snap: Snap,
    /// What *Generate* is asked for.
    pub fill: FillForm,
}

impl Default for Author {
    /// An empty shelf of the design's size.
    fn default() -> Self {
        Self::new(empty(), None)
    }
}

fn empty() -> Scene {
    Scene {
        name: UNNAMED.to_owned(),
        description: String::new(),
        shelf: Shelf::new([0.80, 0.40, 0.40]),
        objects: Vec::new(),
        meshes: Default::default(),
        robot: Default::default(),
    }
}

impl Author {
    fn new(scene: Scene, path: Option<PathBuf>) -> Self {
        let mut author = Self {
            catalog: Arc::new(Catalog::standard()),
            saved: scene.clone(),
            scene,
            path,
            history: History::default(),
            selection: BTreeSet::new(),
            gesture: None,
            plan: Plan::default(),
            hidden: Hidden::default(),
            count: Latest::new("hidden objects"),
            first_count: 0,
            counted: 0,
            generator: Latest::new("scene generator"),
            snap: Snap::default(),
            fill: FillForm::default(),
        };
        author.changed();
        author
    }

    /// Calls `wake` when something in the background is done.
    pub fn wake_with(&self, wake: Wake) {
        self.count.wake_with(wake.clone());
        self.generator.wake_with(wake);
    }

    /// Begins a new scene, an empty shelf.
    pub fn clear(&mut self) {
        self.replace(empty(), None);
    }

    /// Opens a scene file; returns what a person should know about it.
    ///
    /// # Errors
    /// For a file that is no sound scene; the one that was open stays.
    pub fn open(&mut self, path: &Path) -> Result<Vec<String>> {
        let (scene, warnings) = Scene::load(path, &self.catalog)?;
        self.replace(scene, Some(path.to_owned()));
        Ok(warnings)
    }

    /// Edits a copy of a scene that has no file here, for example an episode's.
    pub fn edit_copy(&mut self, scene: Scene) {
        self.replace(scene, None);
    }

    fn replace(&mut self, scene: Scene, path: Option<PathBuf>) {
        self.generator.forget();
        self.saved = scene.clone();
        self.scene = scene;
        self.path = path;
        self.history = History::default();
        self.selection.clear();
        self.gesture = None;
        self.counted = usize::MAX;
        self.changed();
        self.count.hurry();
    }

    /// Writes the scene to its file.
    ///
    /// # Errors
    /// For a scene that has problems, which are named, or no file yet; and what the system refuses.
    pub fn save(&mut self) -> Result<PathBuf> {
        match self.path.clone() {
            Some(path) => self.save_as(&path),
            None => Err(Error::Usage(format!("{} has no file yet; save it under a name", self.scene.name))),
        }
    }

    /// Writes the scene to a file, which becomes its own. A scene without a name is named after the file.
    ///
    /// # Errors
    /// Like [`Author::save`].
    pub fn save_as(&mut self, path: &Path) -> Result<PathBuf> {
        self.settle();
        if let Some(problem) = self.problem() {
            return Err(Error::Check(format!("{} was not saved: {problem}", self.scene.name)));
        }
        let mut named = self.scene.clone();
        if let (UNNAMED, Some(stem)) = (named.name.as_str(), path.file_stem()) {
            named.name = stem.to_string_lossy().into_owned();
        }
        named.check(&self.catalog)?;
        named.save_toml(path)?;
        self.scene = named.clone();
        self.saved = named;
        self.path = Some(path.to_owned());
        Ok(path.to_owned())
    }

    /// The first thing that is wrong, and how many more there are.
    fn problem(&self) -> Option<String> {
        if let Some(error) = &self.plan.error {
            return Some(error.clone());
        }
        let mut lines = self.plan.problems.iter().flat_map(|(at, words)| words.iter().map(move |words| (at, words)));
        let (at, words) = lines.next()?;
        let first = format!("{} {words}", name(&self.scene, *at));
        Some(match lines.count() {
            0 => first,
            more => format!("{first}, and {more} more"),
        })
    }

    /// The document.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Names, shapes and colours of the classes.
    pub fn catalog(&self) -> &Arc<Catalog> {
        &self.catalog
    }

    /// The scene's file, once it has one.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Whether something has changed since it was opened or saved.
    pub fn is_unsaved(&self) -> bool {
        self.scene != self.saved
    }

    /// Where everything stands and what is wrong with it.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Whether the scene may be saved and tried as it is.
    pub fn is_sound(&self) -> bool {
        self.plan.error.is_none() && self.plan.problems.is_empty()
    }

    /// What no view shows.
    pub fn hidden(&self) -> &Hidden {
        &self.hidden
    }

    /// Whether the hidden objects are being counted.
    pub fn is_counting(&self) -> bool {
        self.count.is_busy()
    }

    /// Positions of the chosen objects.
    pub fn selection(&self) -> &BTreeSet<usize> {
        &self.selection
    }

    /// The chosen object, if it is one.
    pub fn only_selected(&self) -> Option<usize> {
        (self.selection.len() == 1).then(|| self.selection.first().copied()).flatten()
    }

    /// Whether there is a change to take back.
    pub fn has_undo(&self) -> bool {
        self.history.has_undo()
    }

    /// Whether there is a change to do again.
    pub fn has_redo(&self) -> bool {
        self.history.has_redo()
    }

    /// Takes in what was done in the background.
    pub fn poll(&mut self) {
        if let Some((_, objects)) = self.count.take().filter(|(number, _)| *number >= self.first_count) {
            self.hidden.objects = Some(objects);
            self.hidden.is_stale = self.count.is_busy();
        }
    }

    /// Fills the shelf around what stands there, in the background.
    pub fn generate(&mut self) {
        self.settle();
        let FillForm { fill, rho, seed } = self.fill;
        let config = GenerateConfig { fill: [fill, fill], rho, ..GenerateConfig::around(&self.scene) };
        let catalog = self.catalog.clone();
        self.generator.ask(move |_| {
            let kept = config.keep.len();
            Some(generate(&catalog, &config, seed).map(|scene| scene.objects.into_iter().skip(kept).collect()))
        });
        self.fill.seed = seed.wrapping_add(1);
    }

    /// Whether objects are being generated.
    pub fn is_generating(&self) -> bool {
        self.generator.is_busy()
    }

    /// Gives up generating.
    pub fn cancel_generating(&mut self) {
        self.generator.forget();
    }

    /// Takes in generated objects, as one step; returns how many there are, or why there are none.
    pub fn poll_generated(&mut self) -> Option<Result<usize>> {
        let (_, answer) = self.generator.take()?;
        Some(answer.map(|new| {
            let count = new.len();
            self.edit(Edit::Once, |scene| scene.objects.extend(new));
            count
        }))
    }

    /// Looks again at what is wrong, and has the hidden objects counted anew.
    fn changed(&mut self) {
        self.selection.retain(|at| *at < self.scene.objects.len());
        self.plan = Plan::of(&self.scene, &self.catalog);
        let count = self.scene.objects.len();
        let is_other = std::mem::replace(&mut self.counted, count) != count;
        if count == 0 {
            self.count.forget();
            self.hidden = Hidden { objects: Some(BTreeSet::new()), is_stale: false };
            return;
        }
        self.hidden.is_stale = true;
        let (scene, catalog) = (self.scene.clone(), self.catalog.clone());
        let number = self.count.ask(move |waiting| {
            let bodies = scene.bodies(&catalog).ok()?;
            let hidden = hidden_objects_while(&scene.shelf, &bodies, VIEW_ARRAY.as_ref()?, || waiting.go_on())?;
            Some(hidden.into_iter().map(|id| usize::from(id.0)).collect())
        });
        if is_other {
            // Positions in the list no longer mean the same objects.
            self.hidden.objects = None;
            self.first_count = number;
        }
    }
}
