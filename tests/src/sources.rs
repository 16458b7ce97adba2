//! Which source file of a crate uses which: read from the text of its modules, so that a test can hold the walls between
//! them.
//!
//! A file uses another when its code names something of that file by a path: after `use`, or in place (`maps::level_at`).
//! Names that a file imports are followed to where they are defined, so that whoever names a re-export uses what is behind it;
//! the re-export of a child is itself no use. Tests (`#[cfg(test)]`) may use anything and are left out. Methods are not
//! followed: only paths are.

mod text;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use text::{File, Named};

/// The path of a module below its crate, for example `["workbench", "model"]`; empty for the crate's root.
pub type ModulePath = Vec<String>;

/// A crate's modules that have files of their own, and what they use.
pub struct Sources {
    files: BTreeMap<ModulePath, (PathBuf, File)>,
}

impl Sources {
    /// Reads all files below a folder, as `src`, but for the modules that only tests have.
    pub fn read(root: &Path) -> Self {
        let mut texts = BTreeMap::new();
        let mut folders = vec![root.to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
                let path = entry.expect("listed").path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|end| end == "rs") {
                    let text = std::fs::read_to_string(&path).expect("a source file");
                    texts.insert(path.strip_prefix(root).expect("below the root").to_owned(), text);
                }
            }
        }
        Self::of(texts)
    }

    /// Takes files as they are, by their paths below `src`.
    pub fn of(texts: BTreeMap<PathBuf, String>) -> Self {
        let mut all = BTreeMap::new();
        for (path, text) in texts {
            let mut module: ModulePath =
                path.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
            if module.last().is_some_and(|last| last == "mod") || module == ["lib"] {
                module.pop();
            }
            all.insert(module, (path, File::of(&text)));
        }
        // What is reached from the root without a test on the way.
        let mut files = BTreeMap::new();
        let mut reached = vec![ModulePath::new()];
        while let Some(module) = reached.pop() {
            let Some((path, file)) = all.remove(&module) else { continue };
            reached.extend(file.children.iter().map(|child| [module.as_slice(), std::slice::from_ref(child)].concat()));
            files.insert(module, (path, file));
        }
        Self { files }
    }

    /// The modules, in the order of their paths.
    pub fn modules(&self) -> impl Iterator<Item = &ModulePath> {
        self.files.keys()
    }

    /// The files below `src` whose code has a snippet in it, word by word; comments and tests do not count.
    pub fn naming(&self, snippet: &str) -> BTreeSet<&Path> {
        let words = text::tokens(snippet);
        self.files.values().filter(|(_, file)| file.says(&words)).map(|(path, _)| path.as_path()).collect()
    }

    /// What each module uses of others.
    pub fn uses(&self) -> BTreeMap<ModulePath, BTreeSet<ModulePath>> {
        let of = |module: &ModulePath| {
            let file = &self.files[module].1;
            let own_child = |named: &Named, to: &ModulePath| named.is_reexport && to.starts_with(module);
            let targets = file.named.iter().filter_map(|named| {
                let to = self.target(module, &named.path, named.inside, 0)?;
                (to != *module && !own_child(named, &to)).then_some(to)
            });
            targets.collect()
        };
        self.files.keys().map(|module| (module.clone(), of(module))).collect()
    }

    /// The module that defines what a path in `from` names; `inside` modules without a file enclose the place.
    fn target(&self, from: &ModulePath, path: &[String], inside: usize, depth: usize) -> Option<ModulePath> {
        let (first, rest) = path.split_first()?;
        let mut at = from.clone();
        let mut rest = rest;
        match first.as_str() {
            "crate" => at.clear(),
            "self" => {}
            "super" => {
                let mut up = 1;
                while rest.first().is_some_and(|next| next == "super") {
                    (up, rest) = (up + 1, &rest[1..]);
                }
                at.truncate(at.len().checked_sub(up - inside.min(up))?);
            }
            _ => return self.named_in(&at, path, depth),
        }
        if rest.is_empty() || rest == ["*"] { Some(at) } else { self.named_in(&at, rest, depth).or(Some(at)) }
    }

    /// The module that defines `path` as seen in `at`: a child, something imported, or, of a module that was reached, its own.
    fn named_in(&self, at: &ModulePath, path: &[String], depth: usize) -> Option<ModulePath> {
        let (first, rest) = path.split_first()?;
        let file = &self.files.get(at)?.1;
        if file.children.contains(first) {
            let child = [at.as_slice(), std::slice::from_ref(first)].concat();
            if !self.files.contains_key(&child) {
                return None;
            }
            return if rest.is_empty() { Some(child) } else { self.named_in(&child, rest, depth).or(Some(child)) };
        }
        let import = file.named.iter().find(|named| named.name.as_ref() == Some(first))?;
        // Deep enough for any chain of re-exports; a name that leads back to itself ends.
        if depth > 8 {
            return None;
        }
        self.target(at, &[import.path.as_slice(), rest].concat(), import.inside, depth + 1)
    }

    /// The circles of uses: groups of modules in which each leads to every other.
    pub fn circles(&self) -> Vec<Vec<ModulePath>> {
        circles(&self.uses())
    }

    /// The circles that are left where a module may use what the modules around it define, as in `use super::Thing`: a
    /// module and what is inside it are one room.
    pub fn circles_between_rooms(&self) -> Vec<Vec<ModulePath>> {
        let mut uses = self.uses();
        for (module, used) in &mut uses {
            used.retain(|used| !module.starts_with(used));
        }
        circles(&uses)
    }
}

fn circles(uses: &BTreeMap<ModulePath, BTreeSet<ModulePath>>) -> Vec<Vec<ModulePath>> {
    let reach = |from: &ModulePath| {
        let (mut reached, mut next) = (BTreeSet::new(), vec![from]);
        while let Some(module) = next.pop() {
            for to in &uses[module] {
                if reached.insert(to.clone()) {
                    next.push(to);
                }
            }
        }
        reached
    };
    let reached: BTreeMap<&ModulePath, BTreeSet<ModulePath>> = uses.keys().map(|from| (from, reach(from))).collect();
    let mut circles: Vec<Vec<ModulePath>> = Vec::new();
    for (from, to) in &reached {
        if to.contains(*from) && !circles.iter().any(|circle| circle.contains(from)) {
            circles.push(to.iter().filter(|other| reached[*other].contains(*from)).cloned().collect());
        }
    }
    circles
}

/// A module's path as code writes it; `crate` for the root.
pub fn words(module: &ModulePath) -> String {
    if module.is_empty() { "crate".to_owned() } else { module.join("::") }
}

#[cfg(test)]
mod tests;
