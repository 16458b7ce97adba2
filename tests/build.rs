//! Lets the binary find the libtorch that it is linked against by its run path, so that `LD_LIBRARY_PATH` stays out of it.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=LIBTORCH");
    println!("cargo:rerun-if-env-changed=LIBTORCH_LIB");
    let folder = std::env::var("LIBTORCH_LIB").or_else(|_| std::env::var("LIBTORCH"));
    if let (Ok(folder), true) = (folder, cfg!(target_os = "linux")) {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{folder}/lib");
    }
}
