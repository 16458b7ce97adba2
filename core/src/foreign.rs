//! Maps that other programs made, read into a shelf's grid, and beliefs written for other programs.
//!
//! | file | what is read | what is written |
//! |---|---|---|
//! | `.bt`, `.ot` | OctoMap's tree of occupancy: binary, or with log-odds | `.bt`: occupied and free; what is neither is unknown |
//! | `.ply` | a point cloud; each point is a hit | the centres of voxels that are occupied rather than free |
//! | `.npz` | evidence or probabilities per voxel, and classes per floor cell | the belief without loss |
//!
//! A [`ForeignMap`] is a file as it was read. A [`Board`] says where the shelf is in the map's frame, as it does for
//! recordings; [`ForeignMap::belief`] is what the map says of the shelf. Nothing is asked of sizes that a file only claims.

mod archive;
mod bytes;
mod cloud;
mod given;
mod octomap;
mod octomap_writer;
mod octree;

pub use given::{Blank, CONVERTED, Given};

use crate::belief::{Belief, LOG_ODDS_LIMIT, LOG_ODDS_STEP, evidence};
use crate::files::write_atomically;
use crate::grid::Grid;
use crate::recording::Board;
use crate::scene::Shelf;
use crate::{Error, Point, Result};
use octree::Octree;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// The largest file that is read, bytes.
const LARGEST_FILE: u64 = 256 << 20;
/// A map's log-odds are believed up to this magnitude: `p` from 0.001 to 0.999.
const SUREST: f32 = 7.0;
/// The most samples along an edge of a voxel, of a tree whose own voxels are smaller.
const FINEST: f64 = 4.0;

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapFormat {
    /// OctoMap's binary tree, `.bt`.
    BinaryTree,
    /// OctoMap's tree with log-odds, `.ot`.
    Tree,
    /// A point cloud, `.ply`.
    Cloud,
    /// A NumPy archive, `.npz`.
    Archive,
}

impl MapFormat {
    /// The format that a name's ending tells, in upper or lower case.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_lowercase();
        match ending.as_str() {
            "bt" => Some(Self::BinaryTree),
            "ot" => Some(Self::Tree),
            "ply" => Some(Self::Cloud),
            "npz" => Some(Self::Archive),
            _ => None,
        }
    }
}

/// A map as its file has it.
#[derive(Debug)]
pub struct ForeignMap {
    path: PathBuf,
    content: Content,
}

#[derive(Debug)]
enum Content {
    Tree(Octree),
    /// Finite points, and how many are not.
    Points(Vec<[f32; 3]>, usize),
    /// A belief over a grid of its own, and whether the file tells its voxels.
    Belief(Box<Belief>, bool),
}

/// What a map says of a shelf.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The belief over the shelf's grid.
    pub belief: Belief,
    /// What was done to the map on the way, a line each.
    pub remarks: Vec<String>,
}

/// Reads a map.
///
/// # Errors
/// [`Error::Input`] that names the file and the place for what is damaged, cut short or of another format.
pub fn read_map(path: &Path) -> Result<ForeignMap> {
    let unknown = || Error::input(path, "", "is no map that can be read: .bt, .ot, .ply or .npz");
    let format = MapFormat::of(path).ok_or_else(unknown)?;
    let length = std::fs::metadata(path).map_err(|error| Error::io(path, error))?.len();
    if length > LARGEST_FILE {
        let megabytes = LARGEST_FILE >> 20;
        return Err(Error::input(path, "", format!("is larger than {megabytes} MB: cut the shelf out of it first")));
    }
    let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
    let content = match format {
        MapFormat::BinaryTree | MapFormat::Tree => Content::Tree(octomap::read(&bytes, path)?),
        MapFormat::Cloud => {
            let points = cloud::read(&bytes, path)?;
            let finite: Vec<[f32; 3]> =
                points.iter().copied().filter(|point| point.iter().all(|x| x.is_finite())).collect();
            let others = points.len() - finite.len();
            Content::Points(finite, others)
        }
        MapFormat::Archive => {
            let (belief, tells_voxel) = archive::read(&bytes, path)?;
            Content::Belief(Box::new(belief), tells_voxel)
        }
    };
    Ok(ForeignMap { path: path.to_owned(), content })
}

/// Writes a belief as the format that the name tells, whole or not at all.
///
/// # Errors
/// [`Error::Usage`] for another name, and for `.ot`, which is only read; what the disk does not take.
pub fn write_map(path: &Path, belief: &Belief) -> Result<()> {
    let bytes = match MapFormat::of(path) {
        Some(MapFormat::BinaryTree) => octomap_writer::write(belief),
        Some(MapFormat::Cloud) => cloud::write(belief),
        Some(MapFormat::Archive) => archive::write(belief),
        Some(MapFormat::Tree) | None => {
            let message = format!("{}: a belief is written as .bt, .ply or .npz", path.display());
            return Err(Error::Usage(message));
        }
    };
    write_atomically(path, &bytes)
}

impl ForeignMap {
    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The shelf that the map itself tells; `None` of trees and clouds, which go on and on.
    pub fn shelf(&self) -> Option<Shelf> {
        let Content::Belief(belief, _) = &self.content else { return None };
        let mut shelf = Shelf::new(belief.grid.size_m());
        shelf.voxel_m = belief.grid.voxel_m;
        Some(shelf)
    }

    /// What the map says of the shelf of a board.
    ///
    /// # Errors
    /// For a map of which nothing lies in the shelf, and an archive of another grid.
    pub fn belief(&self, board: &Board) -> Result<Placed> {
        let grid = board.shelf.grid();
        let fail = |words: String| Error::input(&self.path, "", words);
        let nothing = || {
            let [w, d, h] = board.shelf.size;
            fail(format!("nothing of it lies in the board's box of {w} x {d} x {h} m; --board tells where that is"))
        };
        match &self.content {
            Content::Belief(belief, tells_voxel) => {
                let is_other_voxel = *tells_voxel && (belief.grid.voxel_m - grid.voxel_m).abs() > 1e-6;
                if belief.grid.dims != grid.dims || is_other_voxel {
                    let words = |grid: &Grid| {
                        let [w, d, h] = grid.dims;
                        format!("{w} x {d} x {h} voxels of {} m", grid.voxel_m)
                    };
                    return Err(fail(format!("has {}, and the shelf has {}", words(&belief.grid), words(&grid))));
                }
                Ok(Placed { belief: Belief { grid, ..(**belief).clone() }, remarks: Vec::new() })
            }
            Content::Tree(tree) => of_tree(tree, board, &grid).ok_or_else(nothing),
            Content::Points(points, others) => of_points(points, *others, board, &grid).ok_or_else(nothing),
        }
    }
}

/// A voxel is what the tree says at its centre; where the tree is finer, the surest for occupied of some places in it.
fn of_tree(tree: &Octree, board: &Board, grid: &Grid) -> Option<Placed> {
    let height = grid.dims[2];
    let voxel_m = f64::from(grid.voxel_m);
    let samples = (voxel_m / tree.resolution_m - 1e-3).ceil().clamp(1.0, FINEST) as usize;
    let map_from_board = board.recording_from_board.cast::<f64>();
    let offset = |at: usize| ((at as f64 + 0.5) / samples as f64 - 0.5) * voxel_m;
    let log_odds = |index: usize| {
        let center = grid.center(grid.voxel(index)).cast::<f64>();
        let mut known: Option<f32> = None;
        for at in 0..samples.pow(3) {
            let step = nalgebra::Vector3::new(at % samples, at / samples % samples, at / samples / samples).map(offset);
            if let Some(here) = tree.log_odds((map_from_board * (center + step)).coords.into()) {
                known = Some(known.map_or(here, |known| known.max(here)));
            }
        }
        known
    };
    let mut belief = Belief::uniform(*grid);
    let known: usize = belief
        .occupancy
        .par_chunks_mut(height)
        .enumerate()
        .map(|(cell, column)| {
            let mut known = 0;
            for (level, voxel) in column.iter_mut().enumerate() {
                if let Some(log_odds) = log_odds(cell * height + level) {
                    *voxel = believed(log_odds, 1.0);
                    known += 1;
                }
            }
            known
        })
        .sum();
    let mut remarks = Vec::new();
    if (tree.resolution_m - voxel_m).abs() > 1e-6 {
        remarks.push(format!("its voxels of {} m are resampled to {} m", tree.resolution_m, grid.voxel_m));
    }
    remarks.push(format!("it knows {:.1} % of the shelf", 100.0 * known as f64 / grid.voxel_count() as f64));
    (known > 0).then_some(Placed { belief, remarks })
}

/// Each point is a hit of the voxel that it lies in.
fn of_points(points: &[[f32; 3]], others: usize, board: &Board, grid: &Grid) -> Option<Placed> {
    let board_from_map = board.recording_from_board.inverse();
    let mut hits = vec![0_u32; grid.voxel_count()];
    let mut inside = 0;
    for voxel in points.iter().filter_map(|point| grid.voxel_at(board_from_map * Point::from(*point))) {
        let hits = &mut hits[grid.index(voxel)];
        *hits = hits.saturating_add(1);
        inside += 1;
    }
    let mut belief = Belief::uniform(*grid);
    for (voxel, hits) in belief.occupancy.iter_mut().zip(&hits).filter(|(_, hits)| **hits > 0) {
        let hits = *hits as f32;
        *voxel = believed((hits * LOG_ODDS_STEP).min(LOG_ODDS_LIMIT), hits);
    }
    let mut remarks = vec![format!("{inside} of {} points lie in the shelf", points.len())];
    if others > 0 {
        remarks.push(format!("{others} points are not finite and left out"));
    }
    (inside > 0).then_some(Placed { belief, remarks })
}

/// Evidence for a map's log-odds, as much as the classical update has after so many observations.
fn believed(log_odds: f32, observations: f32) -> [f32; 2] {
    let log_odds = log_odds.clamp(-SUREST, SUREST);
    evidence(log_odds, (2.0 + observations).max(1.0 + log_odds.abs().exp()))
}

#[cfg(test)]
mod tests;
