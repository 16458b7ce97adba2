//! Names the program's run path ([`run_path`]), and tells it which commit it is built from.

#[path = "../scripts/run_path.rs"]
mod run_path;

use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    run_path::main();
    let here = std::env::var("CARGO_MANIFEST_DIR").expect("cargo names the crate's folder");
    let checkout = Path::new(&here).parent().and_then(Checkout::at);
    let state = checkout.and_then(|checkout| checkout.state());
    let (commit, dirty) = state.map_or_else(Default::default, |(commit, dirty)| (commit, dirty.to_string()));
    println!("cargo:rustc-env=NUDGE_COMMIT={commit}");
    println!("cargo:rustc-env=NUDGE_DIRTY={dirty}");
}

/// What goes into the program, from the workspace's folder.
const PARTS: [&str; 10] = [
    "app/src",
    "app/build.rs",
    "app/Cargo.toml",
    "core/src",
    "core/build.rs",
    "core/Cargo.toml",
    "unify/Cargo.toml",
    "assets",
    "Cargo.toml",
    "Cargo.lock",
];

/// A git checkout of this workspace.
struct Checkout<'a> {
    root: &'a Path,
}

impl<'a> Checkout<'a> {
    /// `None` where there is no git, no checkout, or somebody else's: a source archive may lie inside one.
    fn at(root: &'a Path) -> Option<Self> {
        let checkout = Self { root };
        let top = checkout.git(&["rev-parse", "--show-toplevel"])?;
        (Path::new(&top).canonicalize().ok()? == root.canonicalize().ok()?).then_some(checkout)
    }

    /// The commit, and whether what goes into the program differs from it: files that are new count, tests do not.
    fn state(&self) -> Option<(String, bool)> {
        // A commit, a checkout and a change to any part have to run this script again, or what it says would be stale.
        let branch = self.git(&["symbolic-ref", "-q", "HEAD"]);
        for name in ["HEAD", "logs/HEAD", "packed-refs"].into_iter().chain(branch.as_deref()) {
            let file = self.git(&["rev-parse", "--git-path", name]).map(|file| self.root.join(file));
            // A file that is not there would run the script every time.
            if let Some(file) = file.filter(|file| file.exists()) {
                println!("cargo:rerun-if-changed={}", file.display());
            }
        }
        for part in PARTS {
            watch(&self.root.join(part));
        }
        let mut status = vec!["--no-optional-locks", "status", "--porcelain", "--"];
        status.extend(PARTS);
        status.extend([":(exclude,glob)**/tests.rs", ":(exclude,glob)**/*_tests.rs", ":(exclude,glob)**/tests/**"]);
        let changes = self.git(&status)?;
        Some((self.git(&["rev-parse", "HEAD"])?, !changes.is_empty()))
    }

    /// What git prints; `None` where there is no git or it refuses.
    fn git(&self, arguments: &[&str]) -> Option<String> {
        let mut command = Command::new("git");
        command.arg("-C").arg(self.root).args(arguments);
        // Set where cargo runs in a hook of git; they would lead elsewhere.
        for name in ["GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"] {
            command.env_remove(name);
        }
        let output = command.output().ok().filter(|output| output.status.success())?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
    }
}

/// Watches the files below a path that go into the program: not tests, so that an edited one compiles no program anew.
fn watch(path: &Path) {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if name == "tests.rs" || name.ends_with("_tests.rs") || name == "tests" {
        return;
    }
    if path.is_dir() {
        let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
        let mut inside: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        inside.sort();
        inside.iter().for_each(|path| watch(path));
    } else if path.exists() {
        println!("cargo:rerun-if-changed={}", path.display());
    }
}
