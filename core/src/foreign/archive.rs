//! Beliefs in NumPy archives, one in a file.
//!
//! | array | shape | what it is |
//! |---|---|---|
//! | `occupancy` | `[W, D, H, 2]` | evidence for occupied and for free per voxel, above 0; ones where nothing is known |
//! | or `probability` | `[W, D, H]` | probability of being occupied; 0.5 where nothing is known |
//! | `semantics`, optional | `[W, D, 15]` | Dirichlet over the classes per floor cell, above 0 |
//! | `voxel_m`, optional | one number | the edge of a voxel, metres; where it is not there that of the shelf, or else 0.005 |
//!
//! x is right, y into the shelf, z up, z fastest; float16, float32 or float64, in C order. The beliefs of an episode are
//! such files.

use super::believed;
use crate::belief::Belief;
use crate::episode::{Archive, OpenArchive};
use crate::grid::Grid;
use crate::scene::{CLASS_COUNT, MAX_VOXELS, Shelf};
use crate::{Error, Result};
use std::path::Path;

/// The least evidence that is taken.
const LEAST: f32 = 1e-3;
/// How far a probability is from 0 and 1 at least.
const SUREST: f32 = 1e-3;

/// Reads an archive: the belief, and whether it tells its voxels.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<(Belief, bool)> {
    let fail = |place: &str, words: String| Error::input(path, format!("array {place}"), words);
    let mut archive = OpenArchive::new(bytes, path)?;
    let has_evidence = archive.has("occupancy");
    let name = if has_evidence { "occupancy" } else { "probability" };
    if !archive.has(name) {
        return Err(Error::input(path, "", "has neither an array occupancy nor an array probability"));
    }
    let shape = archive.shape(name)?;
    let wanted = if has_evidence { "[W, D, H, 2]" } else { "[W, D, H]" };
    let dims = match (has_evidence, &shape[..]) {
        (true, &[w, d, h, 2]) | (false, &[w, d, h]) => [w, d, h],
        _ => return Err(fail(name, format!("has shape {shape:?} where {wanted} is needed"))),
    };
    let voxels = dims.iter().try_fold(1_usize, |product, n| product.checked_mul(*n));
    if !voxels.is_some_and(|voxels| (1..=MAX_VOXELS).contains(&voxels)) {
        return Err(fail(name, format!("has shape {shape:?}; 1 to {MAX_VOXELS} voxels are read")));
    }
    let tells_voxel = archive.has("voxel_m");
    let voxel_m = if tells_voxel {
        let is_one = archive.shape("voxel_m")?.iter().all(|n| *n == 1);
        let numbers = if is_one { archive.numbers("voxel_m", None)? } else { Vec::new() };
        let number = numbers.first().copied().filter(|m| (0.001..=0.05).contains(m));
        number.ok_or_else(|| fail("voxel_m", "one number from 0.001 to 0.05 m is needed".to_owned()))?
    } else {
        Shelf::new([1.0; 3]).voxel_m
    };
    let grid = Grid::for_shelf(dims.map(|n| n as f32 * voxel_m), voxel_m);
    let mut belief = Belief::uniform(Grid { dims, ..grid });
    let numbers = archive.numbers(name, Some(&shape))?;
    if has_evidence {
        check(&numbers, |a| a >= LEAST && a.is_finite(), "evidence, which is at least 0.001")
            .map_err(|words| fail(name, words))?;
        belief.occupancy = numbers.as_chunks().0.to_vec();
    } else {
        check(&numbers, |p| (0.0..=1.0).contains(&p), "a probability").map_err(|words| fail(name, words))?;
        let evidence = |p: &f32| {
            let p = p.clamp(SUREST, 1.0 - SUREST);
            if p == 0.5 { [1.0; 2] } else { believed((p / (1.0 - p)).ln(), 1.0) }
        };
        belief.occupancy = numbers.iter().map(evidence).collect();
    }
    if archive.has("semantics") {
        let numbers = archive.numbers("semantics", Some(&[dims[0], dims[1], CLASS_COUNT]))?;
        check(&numbers, |a| a >= LEAST && a.is_finite(), "evidence, which is at least 0.001")
            .map_err(|words| fail("semantics", words))?;
        belief.semantics = numbers.as_chunks().0.to_vec();
    }
    Ok((belief, tells_voxel))
}

fn check(numbers: &[f32], is: impl Fn(f32) -> bool, what: &str) -> std::result::Result<(), String> {
    match numbers.iter().position(|number| !is(*number)) {
        Some(at) => Err(format!("entry {at} is {}, not {what}", numbers[at])),
        None => Ok(()),
    }
}

/// The archive of a belief, in single precision.
pub(super) fn write(belief: &Belief) -> Vec<u8> {
    let [w, d, h] = belief.grid.dims;
    let mut archive = Archive::new();
    archive.add("occupancy", &[w, d, h, 2], belief.occupancy.as_flattened());
    archive.add("semantics", &[w, d, CLASS_COUNT], belief.semantics.as_flattened());
    archive.add("voxel_m", &[1], &[belief.grid.voxel_m]);
    archive.finish()
}
