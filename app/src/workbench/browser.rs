//! What there is to choose from: episodes, recordings and scenes, looked at in the background, with a picture and a few words
//! on each.

mod cache;
mod files;
mod look;

pub use cache::Cache;
pub use files::Folders;
pub use look::{About, Facts, Text};

use super::file_kind::FileKind;
use super::latest::Wake;
use files::Listed;
use nudge_core::camera::ViewArray;
use nudge_core::scene::Catalog;
use re_viewer::external::egui::TextureHandle;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::SystemTime;

/// Where scenes of one's own lie; in a checkout the shipped ones as well.
pub const FOLDER: &str = "scenes";

/// What is known of a file.
pub enum Look {
    /// Nobody has asked yet, or the answer is on its way.
    Unknown,
    /// It is sound.
    Sound(Box<Facts>),
    /// It is not what its name says; the line that says why.
    Broken(String),
}

/// A scene, an episode or a recording.
pub struct Entry {
    /// The file, or the episode's directory.
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
    /// How well it fits a word typed by a person, 0 best: the word begins its name, is in its name, in the line about it, or in
    /// its path. `None` where it is nowhere.
    pub fn rank(&self, search: &str) -> Option<usize> {
        let search = search.trim().to_lowercase();
        let text = match &self.look {
            Look::Sound(facts) => Some(&facts.text),
            Look::Unknown | Look::Broken(_) => None,
        };
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
        let name = text.map_or(stem, |text| text.name.to_lowercase());
        let about = text.map_or(String::new(), |text| text.description.to_lowercase());
        let path = self.path.to_string_lossy().to_lowercase();
        let fits = [name.starts_with(&search), name.contains(&search), about.contains(&search), path.contains(&search)];
        fits.into_iter().position(|fits| fits)
    }

    /// Whether it is opened, and not started.
    pub fn is_opened(&self) -> bool {
        FileKind::of(&self.path) != FileKind::Scene
    }
}

enum Job {
    List { folders: Folders, recent: Vec<PathBuf> },
    Look(PathBuf, Option<SystemTime>),
}

enum Answer {
    Listed(Vec<Listed>),
    Looked(PathBuf, Result<Box<Facts>, String>),
}

/// The list of what there is to choose from.
pub struct Browser {
    folders: Folders,
    cache: Cache,
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
        Self::of(Folders { scenes: PathBuf::from(FOLDER), ..Folders::default() })
    }
}

impl Browser {
    /// What lies in some folders.
    pub fn of(folders: Folders) -> Self {
        Self {
            folders,
            cache: Cache::default(),
            search: String::new(),
            typed: String::new(),
            entries: Vec::new(),
            is_listed: false,
            recent: Vec::new(),
            worker: None,
        }
    }

    /// The same, with cards from one start to the next.
    pub fn with_cache(self, cache: Cache) -> Self {
        Self { cache, ..self }
    }

    /// The folder that is searched for scenes of one's own.
    pub fn folder(&self) -> &Path {
        &self.folders.scenes
    }

    /// What there is, in the order of its groups.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// What fits the search: positions in [`Self::entries`], the best hits first, else in their order.
    pub fn hits(&self) -> Vec<usize> {
        let ranked = self.entries.iter().enumerate().filter_map(|(at, entry)| Some((entry.rank(&self.search)?, at)));
        let mut ranked: Vec<(usize, usize)> = ranked.collect();
        if !self.search.trim().is_empty() {
            ranked.sort();
        }
        ranked.into_iter().map(|(_, at)| at).collect()
    }

    /// One of them, to keep its texture with it.
    pub fn entry_mut(&mut self, at: usize) -> Option<&mut Entry> {
        self.entries.get_mut(at)
    }

    /// Whether the folders have been searched.
    pub fn is_listed(&self) -> bool {
        self.is_listed
    }

    /// Searches the folders again; files that have changed are looked at again.
    pub fn refresh(&mut self, wake: &Wake) {
        let (folders, recent) = (self.folders.clone(), self.recent.clone());
        self.ask(Job::List { folders, recent }, wake);
    }

    /// Searches at the first call and when `recent` has changed, and takes in what was found since the last call.
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
                    if let Some(entry) = self.entries.iter_mut().find(|entry| entry.path == path) {
                        let is_new = !matches!(entry.look, Look::Sound(_));
                        entry.look = look.map_or_else(Look::Broken, Look::Sound);
                        if is_new {
                            entry.texture = None;
                        }
                    }
                }
            }
        }
    }

    /// Has a file looked at, once; to be called for what is on the screen.
    pub fn want(&mut self, at: usize, wake: &Wake) {
        if let Some(entry) = self.entries.get_mut(at).filter(|entry| !entry.is_asked) {
            entry.is_asked = true;
            let job = Job::Look(entry.path.clone(), entry.changed);
            self.ask(job, wake);
        }
    }

    fn list(&mut self, files: Vec<Listed>) {
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
        let cache = &self.cache;
        let (jobs, _) = self.worker.get_or_insert_with(|| start(cache.clone(), wake.clone()));
        // Without a thread the cards stay without pictures; nothing else depends on it.
        let _ = jobs.send(job);
    }
}

fn start(cache: Cache, wake: Wake) -> (Sender<Job>, Receiver<Answer>) {
    let (jobs, queue) = channel();
    let (results, answers) = channel();
    // One thread and a pool of one: an episode that runs meanwhile keeps the other cores.
    let work = move || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let catalog = Catalog::standard();
        let views = ViewArray::named("standard300").ok();
        let tell = |answer: Answer| {
            let is_heard = results.send(answer).is_ok();
            wake();
            is_heard
        };
        for job in queue {
            let work = || do_it(job, &cache, &catalog, views.as_ref(), &tell);
            let is_heard = match &pool {
                Ok(pool) => pool.install(work),
                Err(_) => work(),
            };
            if !is_heard {
                return;
            }
        }
    };
    let _ = std::thread::Builder::new().name("scene browser".to_owned()).spawn(work);
    (jobs, answers)
}

/// Does what is asked; whether somebody still listens. What is hidden in a scene comes in a second answer.
fn do_it(
    job: Job,
    cache: &Cache,
    catalog: &Catalog,
    views: Option<&ViewArray>,
    tell: &(dyn Fn(Answer) -> bool + Sync),
) -> bool {
    let (path, changed) = match job {
        Job::List { folders, recent } => return tell(Answer::Listed(files::files(&folders, &recent))),
        Job::Look(path, changed) => (path, changed),
    };
    if let Some(facts) = cache.get(&path, changed) {
        return tell(Answer::Looked(path, Ok(Box::new(facts))));
    }
    let mut facts = match look::look_at(&path, catalog) {
        Ok(facts) => facts,
        Err(error) => return tell(Answer::Looked(path, Err(error.to_string()))),
    };
    if let (true, Some(views)) = (matches!(facts.text.about, About::Scene { .. }), views) {
        if !tell(Answer::Looked(path.clone(), Ok(Box::new(facts.clone())))) {
            return false;
        }
        if let About::Scene { hidden, .. } = &mut facts.text.about {
            *hidden = look::hidden(&path, catalog, views);
        }
    }
    cache.put(&path, changed, &facts);
    tell(Answer::Looked(path, Ok(Box::new(facts))))
}
