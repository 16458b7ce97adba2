//! The scenes there are to choose from: files below a folder and those that were opened lately, looked at in the
//! background, with a picture and how many objects no view shows.

use super::file_kind::FileKind;
use super::latest::Wake;
use crate::picture::{self, RgbImage, View};
use nudge_core::camera::{ViewArray, hidden_objects};
use nudge_core::scene::{Catalog, Scene};
use re_viewer::external::egui::TextureHandle;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::SystemTime;

/// Where scenes of one's own lie; in a checkout the shipped ones as well.
pub const FOLDER: &str = "scenes";
/// Width of a thumbnail, pixels.
pub const THUMBNAIL_PX: u32 = 320;
/// Folders below this depth are not looked into.
const DEPTH: usize = 4;
/// Files that are listed at most.
const MOST: usize = 1000;

/// What is known of a scene's file.
pub enum Look {
    /// Nobody has asked yet, or the answer is on its way.
    Unknown,
    /// It is a sound scene.
    Sound(Box<Facts>),
    /// It is none; the line that says why.
    Broken(String),
}

/// What a card shows.
pub struct Facts {
    /// The scene's name.
    pub name: String,
    /// Its one line on what makes it what it is.
    pub description: String,
    /// Number of objects.
    pub objects: usize,
    /// Objects that no view shows, once they are counted.
    pub hidden: Option<usize>,
    /// The scene from the front.
    pub picture: RgbImage,
}

/// A scene's file.
pub struct Entry {
    /// The file.
    pub path: PathBuf,
    /// The heading that it stands under.
    pub group: String,
    /// When it was changed last.
    changed: Option<SystemTime>,
    /// What is known of it.
    pub look: Look,
    is_asked: bool,
    /// Its picture on the graphics card, once it has been drawn.
    pub texture: Option<TextureHandle>,
}

impl Entry {
    /// Whether a word typed by a person is in the name, the line about it, or the path.
    pub fn matches(&self, search: &str) -> bool {
        let search = search.trim().to_lowercase();
        let has = |text: &str| text.to_lowercase().contains(&search);
        let looks = match &self.look {
            Look::Sound(facts) => has(&facts.name) || has(&facts.description),
            Look::Unknown | Look::Broken(_) => false,
        };
        search.is_empty() || looks || has(&self.path.to_string_lossy())
    }
}

enum Job {
    List { folder: PathBuf, shipped: Option<PathBuf>, recent: Vec<PathBuf> },
    Look(PathBuf),
    Count(PathBuf),
}

enum Answer {
    Listed(Vec<(PathBuf, String, Option<SystemTime>)>),
    Looked(PathBuf, Result<Box<Facts>, String>),
    Counted(PathBuf, usize),
}

/// The list of scenes.
pub struct Browser {
    /// The folder that is searched.
    folder: PathBuf,
    /// The folder of the scenes that came with the program, which is searched as well.
    shipped: Option<PathBuf>,
    /// What a person searches for.
    pub search: String,
    /// A path that a person types.
    pub typed: String,
    entries: Vec<Entry>,
    is_listed: bool,
    recent: Vec<PathBuf>,
    worker: Option<(Sender<Job>, Receiver<Answer>)>,
}

impl Default for Browser {
    fn default() -> Self {
        Self::of(Path::new(FOLDER))
    }
}

impl Browser {
    /// The scenes below a folder.
    pub fn of(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            shipped: None,
            search: String::new(),
            typed: String::new(),
            entries: Vec::new(),
            is_listed: false,
            recent: Vec::new(),
            worker: None,
        }
    }

    /// And those below the folder that came with the program.
    pub fn and_shipped(self, shipped: Option<PathBuf>) -> Self {
        Self { shipped, ..self }
    }

    /// The folder that is searched.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The scenes, in the order of their groups.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// A scene, to keep its texture with it.
    pub fn entry_mut(&mut self, at: usize) -> Option<&mut Entry> {
        self.entries.get_mut(at)
    }

    /// Whether the folder has been searched.
    pub fn is_listed(&self) -> bool {
        self.is_listed
    }

    /// Searches the folder again; files that have changed are looked at again.
    pub fn refresh(&mut self, wake: &Wake) {
        let (folder, shipped, recent) = (self.folder.clone(), self.shipped.clone(), self.recent.clone());
        self.ask(Job::List { folder, shipped, recent }, wake);
    }

    /// Lists the scenes at the first call and when `recent` has changed, and takes in what was found since the last call.
    pub fn poll(&mut self, recent: &[PathBuf], wake: &Wake) {
        if self.worker.is_none() || self.recent != recent {
            self.recent = recent.to_vec();
            self.refresh(wake);
        }
        let answers: Vec<Answer> = self.worker.iter().flat_map(|(_, answers)| answers.try_iter()).collect();
        for answer in answers {
            match answer {
                Answer::Listed(files) => self.list(files),
                Answer::Looked(path, look) => {
                    let is_sound = look.is_ok();
                    if let Some(entry) = self.entries.iter_mut().find(|entry| entry.path == path) {
                        entry.look = look.map_or_else(Look::Broken, Look::Sound);
                        entry.texture = None;
                    }
                    if is_sound {
                        self.ask(Job::Count(path), wake);
                    }
                }
                Answer::Counted(path, hidden) => {
                    let entry = self.entries.iter_mut().find(|entry| entry.path == path);
                    if let Some(Entry { look: Look::Sound(facts), .. }) = entry {
                        facts.hidden = Some(hidden);
                    }
                }
            }
        }
    }

    /// Has a scene looked at, once; to be called for what is on the screen.
    pub fn want(&mut self, at: usize, wake: &Wake) {
        if let Some(entry) = self.entries.get_mut(at).filter(|entry| !entry.is_asked) {
            entry.is_asked = true;
            let path = entry.path.clone();
            self.ask(Job::Look(path), wake);
        }
    }

    fn list(&mut self, files: Vec<(PathBuf, String, Option<SystemTime>)>) {
        let mut before = std::mem::take(&mut self.entries);
        self.entries = files
            .into_iter()
            .map(|(path, group, changed)| {
                let known = before.iter().position(|entry| entry.path == path && entry.changed == changed);
                match known {
                    Some(at) => Entry { group, ..before.swap_remove(at) },
                    None => Entry { path, group, changed, look: Look::Unknown, is_asked: false, texture: None },
                }
            })
            .collect();
        self.is_listed = true;
    }

    fn ask(&mut self, job: Job, wake: &Wake) {
        let (jobs, _) = self.worker.get_or_insert_with(|| start(wake.clone()));
        // Without a thread the cards stay without pictures; nothing else depends on it.
        let _ = jobs.send(job);
    }
}

fn start(wake: Wake) -> (Sender<Job>, Receiver<Answer>) {
    let (jobs, queue) = channel();
    let (results, answers) = channel();
    // One thread and a pool of one: an episode that runs meanwhile keeps the other cores.
    let work = move || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let catalog = Catalog::standard();
        let views = ViewArray::named("standard300").ok();
        for job in queue {
            let answer = match &pool {
                Ok(pool) => pool.install(|| answer(job, &catalog, views.as_ref())),
                Err(_) => answer(job, &catalog, views.as_ref()),
            };
            if let Some(answer) = answer {
                if results.send(answer).is_err() {
                    return;
                }
                wake();
            }
        }
    };
    let _ = std::thread::Builder::new().name("scene browser".to_owned()).spawn(work);
    (jobs, answers)
}

fn answer(job: Job, catalog: &Catalog, views: Option<&ViewArray>) -> Option<Answer> {
    match job {
        Job::List { folder, shipped, recent } => Some(Answer::Listed(files(&folder, shipped.as_deref(), &recent))),
        Job::Look(path) => {
            let look = look_at(&path, catalog).map_err(|error| error.to_string());
            Some(Answer::Looked(path, look))
        }
        Job::Count(path) => {
            let (scene, _) = Scene::load(&path, catalog).ok()?;
            let hidden = hidden_objects(&scene.shelf, &scene.bodies(catalog).ok()?, views?).len();
            Some(Answer::Counted(path, hidden))
        }
    }
}

fn look_at(path: &Path, catalog: &Catalog) -> nudge_core::Result<Box<Facts>> {
    let (scene, _) = Scene::load(path, catalog)?;
    let picture = picture::thumbnail(&scene, catalog, View::Front, THUMBNAIL_PX)?;
    let Scene { name, description, objects, .. } = scene;
    Ok(Box::new(Facts { name, description, objects: objects.len(), hidden: None, picture }))
}

/// Scene files below a folder, by folder and name, then those that came with the program where that is another folder,
/// and then the recent ones that lie elsewhere.
fn files(folder: &Path, shipped: Option<&Path>, recent: &[PathBuf]) -> Vec<(PathBuf, String, Option<SystemTime>)> {
    let below = |folder: &Path| {
        let mut found = Vec::new();
        search(folder, 0, &mut found);
        found.sort();
        found.truncate(MOST);
        found
    };
    let is_same = |shipped: &Path| shipped.canonicalize().ok() == folder.canonicalize().ok();
    let shipped = shipped.filter(|shipped| !is_same(shipped));
    let (own, others) = (below(folder), shipped.map(below).unwrap_or_default());
    let known: BTreeSet<PathBuf> = own.iter().chain(&others).filter_map(|path| path.canonicalize().ok()).collect();
    let changed = |path: &Path| path.metadata().and_then(|data| data.modified()).ok();
    let elsewhere = recent.iter().filter(|path| {
        FileKind::of(path) == FileKind::Scene
            && path.is_file()
            && path.canonicalize().is_ok_and(|path| !known.contains(&path))
    });
    let group = |path: &Path| path.parent().map_or(String::new(), |parent| parent.display().to_string());
    let set = |path: &Path| {
        let below = shipped.and_then(|shipped| path.parent()?.strip_prefix(shipped).ok());
        format!("Shipped: {}", below.unwrap_or(Path::new("")).display())
    };
    let own = own.iter().map(|path| (path.clone(), group(path), changed(path)));
    let others = others.iter().map(|path| (path.clone(), set(path), changed(path)));
    own.chain(others).chain(elsewhere.map(|path| (path.clone(), "Recent".to_owned(), changed(path)))).collect()
}

fn search(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if is_hidden {
            continue;
        }
        if path.is_dir() && depth < DEPTH && found.len() < MOST {
            search(&path, depth + 1, found);
        } else if FileKind::of(&path) == FileKind::Scene && path.is_file() {
            found.push(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_of_ones_own_come_before_the_shipped_ones_and_none_comes_twice() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        for name in ["own/mine/a.toml", "share/scenes/high/b.toml", "share/scenes/high/notes.txt", "far/c.toml"] {
            std::fs::create_dir_all(at(name).parent().expect("folder")).expect("made");
            std::fs::write(at(name), "").expect("written");
        }
        let listed = |own: &Path, shipped: Option<&Path>| -> Vec<(PathBuf, String)> {
            let recent = [at("share/scenes/high/b.toml"), at("far/c.toml")];
            files(own, shipped, &recent).into_iter().map(|(path, group, _)| (path, group)).collect()
        };
        let mine = (at("own/mine/a.toml"), at("own/mine").display().to_string());
        let shipped = (at("share/scenes/high/b.toml"), "Shipped: high".to_owned());
        let far = (at("far/c.toml"), "Recent".to_owned());
        assert_eq!(listed(&at("own"), Some(&at("share/scenes"))), [mine, shipped.clone(), far.clone()]);
        assert_eq!(listed(&at("none"), Some(&at("share/scenes"))), [shipped.clone(), far.clone()]);
        // In a checkout both are the same folder.
        let here = (shipped.0, at("share/scenes/high").display().to_string());
        assert_eq!(listed(&at("share/scenes"), Some(&at("own/../share/scenes"))), [here, far]);
    }
}
