//! The method of manipulation-enhanced mapping (MEM), without a window and without a recorder.
//!
//! Data walks through the modules once, in this order, and every module depends only on the ones before it:
//!
//! ```text
//! grid -> solid -> scene -> arm -> world -> camera -> recording -> environment -> belief -> cnabu -> gain -> skill -> plan -> made_by -> score -> episode -> foreign -> probe -> learn
//! ```
//!
//! Beside them stand what all of them may use: [`error`], [`files`], [`places`], [`rng`], [`shard`] and [`wall`].
//!
//! One frame everywhere: x right, y into the shelf (0 at its front edge), z up (0 on the board), x = 0 in the
//! middle of the shelf; metres, right-handed. Entropy and gain are in nats.

pub mod arm;
pub mod belief;
pub mod camera;
pub mod cnabu;
pub mod environment;
pub mod episode;
pub mod error;
pub mod files;
mod fixed;
pub mod foreign;
pub mod gain;
pub mod grid;
pub mod learn;
pub mod made_by;
mod named;
pub mod places;
pub mod plan;
pub mod probe;
pub mod recording;
pub mod rng;
pub mod scene;
pub mod score;
pub mod shard;
pub mod skill;
pub mod solid;
pub mod wall;
pub mod world;

pub use error::{Error, Result};

/// A point in the shelf's frame, metres.
pub type Point = nalgebra::Point3<f32>;
/// A displacement or direction in the shelf's frame, metres.
pub type Vector = nalgebra::Vector3<f32>;
/// A rigid transform; names say `to_from`, for example `world_from_camera`.
pub type Pose = nalgebra::Isometry3<f32>;

/// The version that episodes, weights and reports carry.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    /// This file, whose head lists the modules.
    const SOURCE: &str = include_str!("lib.rs");
    /// What every module may use.
    const BESIDE: [&str; 8] = ["error", "files", "fixed", "named", "places", "rng", "shard", "wall"];

    fn street() -> Vec<&'static str> {
        let line = SOURCE.lines().find(|line| line.contains(" -> ")).expect("the list of modules");
        line.trim_start_matches("//!").split("->").map(str::trim).collect()
    }

    /// A module's own files, without those of tests.
    fn files(of: &str) -> Vec<PathBuf> {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let (mut found, mut folders) = (vec![source.join(of).with_extension("rs")], vec![source.join(of)]);
        while let Some(folder) = folders.pop() {
            let Ok(entries) = std::fs::read_dir(folder) else { continue };
            for path in entries.map(|entry| entry.expect("listed").path()) {
                if path.is_dir() { folders.push(path) } else { found.push(path) }
            }
        }
        let is_code = |path: &PathBuf| {
            let below = path.strip_prefix(&source).expect("below the sources").to_string_lossy().into_owned();
            below.ends_with(".rs") && !below.contains("tests")
        };
        found.retain(is_code);
        assert!(found[0].is_file(), "{} is missing", found[0].display());
        found
    }

    #[test]
    fn the_list_of_modules_is_that_of_the_code() {
        let of =
            |line: &str| line.trim_start_matches("pub ").strip_prefix("mod ")?.strip_suffix(';').map(str::to_owned);
        let mut declared: Vec<String> = SOURCE.lines().filter_map(of).collect();
        let mut listed: Vec<String> = street().into_iter().chain(BESIDE).map(str::to_owned).collect();
        declared.sort();
        listed.sort();
        assert_eq!(listed, declared);
    }

    #[test]
    fn every_module_depends_only_on_the_ones_before_it() {
        let street = street();
        for (at, module) in street.iter().enumerate() {
            for file in files(module) {
                let text = std::fs::read_to_string(&file).expect("a source file");
                let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
                for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
                    let used = line.split("crate::").skip(1);
                    let used =
                        used.map(|rest| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or(""));
                    for used in used {
                        let after = street[at + 1..].contains(&used);
                        assert!(!after, "{}: {module} comes before {used}", file.display());
                    }
                }
            }
        }
    }
}
