//! Which files there are to choose from: episodes and recordings below the folder that new ones are written to, scenes below
//! a folder of one's own and those that came with the program, and what was opened lately and lies elsewhere.

use crate::workbench::file_kind::FileKind;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Folders below this depth are not looked into.
const DEPTH: usize = 4;
/// Files that are listed at most.
const MOST: usize = 1000;
/// Episodes and recordings that are listed at most, the latest ones.
const LATEST: usize = 12;
/// The heading of episodes and recordings.
pub const EPISODES: &str = "Latest episodes and recordings";

/// A file with the heading that it stands under, and when it was changed last.
pub type Listed = (PathBuf, String, Option<SystemTime>);

/// Where to search.
#[derive(Clone, Debug, Default)]
pub struct Folders {
    /// Scenes of one's own.
    pub scenes: PathBuf,
    /// The scenes that came with the program.
    pub shipped: Option<PathBuf>,
    /// Episodes and recordings.
    pub episodes: Option<PathBuf>,
}

/// The latest episodes and recordings; then scene files below a folder, by folder and name, then those that came with the program
/// where that is another folder, and then the recent ones that lie elsewhere.
pub fn files(folders: &Folders, recent: &[PathBuf]) -> Vec<Listed> {
    let below = |folder: &Path| {
        let mut found = Vec::new();
        search(folder, 0, &mut found);
        found.retain(|path| FileKind::of(path) == FileKind::Scene);
        found.sort();
        found.truncate(MOST);
        found
    };
    let folder = &folders.scenes;
    let is_same = |shipped: &Path| shipped.canonicalize().ok() == folder.canonicalize().ok();
    let shipped = folders.shipped.as_deref().filter(|shipped| !is_same(shipped));
    let (own, others) = (below(folder), shipped.map(below).unwrap_or_default());
    let known: BTreeSet<PathBuf> = own.iter().chain(&others).filter_map(|path| path.canonicalize().ok()).collect();
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
    let elsewhere = elsewhere.map(|path| (path.clone(), "Recent".to_owned(), changed(path)));
    latest(folders, recent).into_iter().chain(own).chain(others).chain(elsewhere).collect()
}

/// Episodes and recordings, the latest first.
fn latest(folders: &Folders, recent: &[PathBuf]) -> Vec<Listed> {
    let mut found = Vec::new();
    if let Some(folder) = &folders.episodes {
        search(folder, 0, &mut found);
    }
    found.extend(recent.iter().filter(|path| path.exists()).cloned());
    found.retain(|path| FileKind::of(path) != FileKind::Scene);
    let mut known = BTreeSet::new();
    found.retain(|path| path.canonicalize().is_ok_and(|path| known.insert(path)));
    let mut listed: Vec<Listed> =
        found.into_iter().map(|path| (path.clone(), EPISODES.to_owned(), changed(&path))).collect();
    listed.sort_by(|a, b| b.2.cmp(&a.2).then_with(|| a.0.cmp(&b.0)));
    listed.truncate(LATEST);
    listed
}

/// When a file was changed last; of an episode its log.
fn changed(path: &Path) -> Option<SystemTime> {
    let log = path.join("episode.json");
    let of = if log.is_file() { &log } else { path };
    of.metadata().and_then(|data| data.modified()).ok()
}

/// Scenes, recordings and episodes below a folder; what lies in an episode is its own.
fn search(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if is_hidden || found.len() >= MOST {
            continue;
        }
        if path.join("episode.json").is_file() {
            found.push(path);
        } else if path.is_dir() {
            if depth < DEPTH {
                search(&path, depth + 1, found);
            }
        } else if FileKind::of(&path) != FileKind::Other && path.is_file() {
            found.push(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(folder: &Path, names: &[&str]) {
        for name in names {
            let path = folder.join(name);
            std::fs::create_dir_all(path.parent().expect("folder")).expect("made");
            std::fs::write(path, "").expect("written");
        }
    }

    #[test]
    fn scenes_of_ones_own_come_before_the_shipped_ones_and_none_comes_twice() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        let names = ["own/mine/a.toml", "share/scenes/high/b.toml", "share/scenes/high/notes.txt", "far/c.toml"];
        write(folder.path(), &names);
        let listed = |own: &Path, shipped: Option<&Path>| -> Vec<(PathBuf, String)> {
            let recent = [at("share/scenes/high/b.toml"), at("far/c.toml")];
            let folders = Folders { scenes: own.to_owned(), shipped: shipped.map(Path::to_owned), episodes: None };
            files(&folders, &recent).into_iter().map(|(path, group, _)| (path, group)).collect()
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

    #[test]
    fn episodes_and_recordings_come_first_the_latest_of_them_at_the_front() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        write(folder.path(), &["out/old/episode.json", "out/old/episode.rrd", "out/old/inside.toml", "scenes/a.toml"]);
        write(folder.path(), &["out/set/new/episode.json", "out/loose.rrd", "out/bench.json", "far/e/episode.json"]);
        let times = [("out/old/episode.json", 10), ("out/set/new/episode.json", 30), ("out/loose.rrd", 20)];
        for (name, seconds) in times.into_iter().chain([("far/e/episode.json", 40)]) {
            let time = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(seconds);
            std::fs::File::options().write(true).open(at(name)).and_then(|file| file.set_modified(time)).expect("set");
        }
        let folders = Folders { scenes: at("scenes"), shipped: None, episodes: Some(at("out")) };
        let recent = [at("out/set/new"), at("far/e"), at("gone")];
        let listed: Vec<PathBuf> = files(&folders, &recent).into_iter().map(|(path, ..)| path).collect();
        let expected = ["far/e", "out/set/new", "out/loose.rrd", "out/old", "scenes/a.toml"].map(at);
        assert_eq!(listed, expected, "what lies in an episode is not listed beside it");
    }
}
