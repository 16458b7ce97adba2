//! Names the run path of this crate's tests and benchmarks ([`run_path`]), and tells the library what made it: the hash of
//! the method's source, and the version of libtorch.

#[path = "../scripts/run_path.rs"]
mod run_path;
#[path = "src/made_by/source.rs"]
mod source;

use source::Source;
use std::path::Path;

/// Crates whose versions can change a number: they count with the source.
const COMPUTING: [&str; 6] = ["nalgebra", "parry3d", "rand", "rand_chacha", "rapier3d", "tch"];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    run_path::main();
    let folder = std::env::var("LIBTORCH_LIB").or_else(|_| std::env::var("LIBTORCH")).ok();
    println!("cargo:rustc-env=NUDGE_LIBTORCH={}", folder.as_deref().and_then(libtorch).unwrap_or("unknown".to_owned()));
    println!("cargo:rustc-env=NUDGE_METHOD={}", method());
}

/// The version that a folder of libtorch names.
fn libtorch(folder: &str) -> Option<String> {
    let file = Path::new(folder).join("build-version");
    let version = std::fs::read_to_string(&file).ok()?;
    println!("cargo:rerun-if-changed={}", file.display());
    Some(version.trim().to_owned()).filter(|version| !version.is_empty() && version.lines().count() == 1)
}

/// The hash of the method's source. Only what counts is watched, so that an edited test compiles no library anew.
fn method() -> String {
    let folder = std::env::var("CARGO_MANIFEST_DIR").expect("cargo names the crate's folder");
    let folder = Path::new(&folder);
    let source = Source::read(folder).unwrap_or_else(|error| panic!("the source cannot be read: {error}"));
    for file in source.files() {
        println!("cargo:rerun-if-changed={}", folder.join(file).display());
    }
    let lock = folder.join("../Cargo.lock");
    println!("cargo:rerun-if-changed={}", lock.display());
    let lock = std::fs::read_to_string(lock).unwrap_or_default();
    source.hash(&source::locked(&lock, &COMPUTING))
}
