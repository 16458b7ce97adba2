//! Build script of `app` and `tests`, and part of that of `core`: where their programs find libtorch, so that
//! `LD_LIBRARY_PATH` stays out of it.
//!
//! The run path names the folder that `scripts/install.sh` copies the libraries to, seen from the program (a folder that is
//! not there before), and then the libtorch that the build links against.

/// Prints the run path for cargo.
pub fn main() {
    println!("cargo:rerun-if-changed=../scripts/run_path.rs");
    println!("cargo:rerun-if-env-changed=LIBTORCH");
    println!("cargo:rerun-if-env-changed=LIBTORCH_LIB");
    let folder = std::env::var("LIBTORCH_LIB").or_else(|_| std::env::var("LIBTORCH"));
    if let (Ok(folder), true) = (folder, cfg!(target_os = "linux")) {
        println!("cargo:rustc-link-arg=-Wl,-rpath,$ORIGIN/../lib/nudge");
        println!("cargo:rustc-link-arg=-Wl,-rpath,{folder}/lib");
    }
}
