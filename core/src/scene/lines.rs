//! Where things stand in a scene's file.

use super::Scene;
use crate::Error;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Where things stand in a scene's file, for errors that name file, line and object. Scenes that came from elsewhere
/// (embedded in an episode, made by the generator) have no lines.
pub(super) struct Places {
    pub path: PathBuf,
    /// Line per key: `name`, `shelf.size`, `meshes.tomato_can`, `object.0`, `object.0.position`.
    pub lines: BTreeMap<String, usize>,
}

impl Places {
    /// No file: errors name the object only.
    pub fn without_file(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), lines: BTreeMap::new() }
    }

    fn line(&self, key: &str) -> Option<String> {
        self.lines.get(key).map(|line| format!("line {line}"))
    }

    /// An error about the whole file.
    pub fn file(&self, message: impl Into<String>) -> Error {
        Error::input(&self.path, "", message)
    }

    /// An error about a key outside the objects.
    pub fn key(&self, key: &str, message: impl Into<String>) -> Error {
        // A key that was left out has its default, so the fault shows at its table.
        let line = self.line(key).or_else(|| self.line(key.split('.').next()?));
        Error::input(&self.path, line.unwrap_or_default(), message)
    }

    /// An error about an entry of `[meshes]`, or about an object's own mesh.
    pub fn mesh(&self, key: &str, message: impl Into<String>) -> Error {
        let line = self.line(&format!("meshes.{key}")).map_or(String::new(), |line| line + ", ");
        Error::input(&self.path, format!("{line}mesh of {key}"), message)
    }

    /// An error about a key of the object at position `at`.
    pub fn object(&self, scene: &Scene, at: usize, key: &str, message: impl Into<String>) -> Error {
        let line = self.line(&format!("object.{at}.{key}")).or_else(|| self.line(&format!("object.{at}")));
        let line = line.map_or(String::new(), |line| line + ", ");
        Error::input(&self.path, line + &name_object(at, &scene.objects[at].class), message)
    }

    /// `object 3 (tomato_can, line 12)`.
    pub fn name_object(&self, scene: &Scene, at: usize) -> String {
        let name = name_object(at, &scene.objects[at].class);
        match self.line(&format!("object.{at}")) {
            Some(line) => format!("{}, {line})", name.trim_end_matches(')')),
            None => name,
        }
    }
}

/// Objects are counted from one for people.
pub(super) fn name_object(at: usize, class: &str) -> String {
    format!("object {} ({class})", at + 1)
}
