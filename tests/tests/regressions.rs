//! Inputs of users that once broke the program, each as a test named after what they saw.
//!
//! The files are made here, in the words of the programs that write them. What is about one module of the library alone
//! is tested beside it.

#[path = "regressions/arms.rs"]
mod arms;
#[path = "regressions/meshes.rs"]
mod meshes;
#[path = "regressions/outputs.rs"]
mod outputs;
#[path = "regressions/scenes.rs"]
mod scenes;

use std::path::{Path, PathBuf};

/// A folder of one test's files.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("tempdir"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The path of a file that may not be there yet, as an argument.
    fn name(&self, name: &str) -> String {
        argument(&self.path(name))
    }

    /// Writes a file and returns its path as an argument.
    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        std::fs::write(self.path(name), content).expect("written");
        self.name(name)
    }
}

fn argument(path: &Path) -> String {
    path.to_str().expect("utf-8").to_owned()
}

/// A scene of the given objects that is quick to map: a small shelf of coarse voxels.
fn small_scene(objects: &str) -> String {
    format!("format = 1\nname = \"small\"\n[shelf]\nsize = [0.3, 0.2, 0.2]\nvoxel_m = 0.01\n{objects}")
}

/// A tin that stands in [`small_scene`].
const TIN: &str = "[[object]]\nclass = \"tomato_can\"\nposition = [0.0, 0.1]\n";
