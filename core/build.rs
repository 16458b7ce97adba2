//! What [`run_path`] does for the tests and benchmarks of this crate.

#[path = "../scripts/run_path.rs"]
mod run_path;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    run_path::main();
}
