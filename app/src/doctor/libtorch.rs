//! The libtorch that this process runs on.

use super::Problem;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The version that the networks need; `scripts/libtorch.sh` fetches it.
pub const WANTED: &str = "2.13.0";

/// A libtorch.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Libtorch {
    /// The folder of its libraries; `null` where the system does not tell.
    pub folder: Option<PathBuf>,
    /// Its version; `null` if no file beside it tells.
    pub version: Option<String>,
}

impl Libtorch {
    /// What is wrong with it.
    pub(super) fn problem(&self) -> Option<Problem> {
        let version = self.version.as_deref()?;
        // A build's own mark, as in 2.13.0+cu130, does not matter.
        if version.split('+').next() == Some(WANTED) {
            return None;
        }
        let folder = self.folder.as_deref().unwrap_or(Path::new("")).display();
        Some(Problem::new(
            format!("the program runs on libtorch {version} in {folder}, and needs {WANTED}"),
            "unset LD_LIBRARY_PATH if it names that folder, or install the program again",
        ))
    }
}

/// The libtorch that is loaded; `None` in a build without networks.
pub(super) fn in_use() -> Option<Libtorch> {
    if !nudge_core::cnabu::AVAILABLE {
        return None;
    }
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let folder = folder_of(&maps, "libtorch_cpu.so").or_else(|| folder_of(&maps, "libtorch.so"));
    let version = folder.as_deref().and_then(version_of);
    Some(Libtorch { folder, version })
}

/// The folder of a library that is in a process's memory map (`/proc/PID/maps`).
pub(super) fn folder_of(maps: &str, library: &str) -> Option<PathBuf> {
    let paths = maps.lines().filter_map(|line| Some(Path::new(&line[line.find('/')?..])));
    paths.filter(|path| path.file_name().is_some_and(|name| name == library)).find_map(Path::parent).map(Path::to_owned)
}

/// The version of the libtorch whose libraries lie in a folder: as its `build-version` tells, or its headers.
pub(super) fn version_of(libraries: &Path) -> Option<String> {
    let above = libraries.parent().unwrap_or(libraries);
    let told = [libraries.join("build-version"), above.join("build-version")];
    if let Some(told) = told.iter().find_map(|path| std::fs::read_to_string(path).ok()) {
        return Some(told.trim().to_owned());
    }
    let headers = ["include/torch/headeronly/version.h", "include/torch/version.h"].map(|path| above.join(path));
    let header = headers.iter().find_map(|path| std::fs::read_to_string(path).ok())?;
    let number = |part: &str| {
        let line = header.lines().find_map(|line| line.strip_prefix(&format!("#define TORCH_VERSION_{part} ")))?;
        line.trim().parse::<u32>().ok()
    };
    Some(format!("{}.{}.{}", number("MAJOR")?, number("MINOR")?, number("PATCH")?))
}
