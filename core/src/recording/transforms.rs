//! Where one frame is in another over time: the tree of `/tf` and `/tf_static`.

use super::ros::Placed;
use crate::Pose;
use crate::camera::pose_from_quaternion;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::collections::BTreeMap;

/// How far the length of a quaternion may be from 1.
const TOLERANCE: f64 = 1e-3;
/// A chain of more frames than this is a circle.
const MAX_CHAIN: usize = 100;

/// A tree of frames: for every child its parent, and where it is there.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    edges: BTreeMap<String, Edge>,
}

#[derive(Clone, Debug)]
struct Edge {
    parent: String,
    /// By time, nanoseconds.
    moving: BTreeMap<i64, Placed>,
    fixed: Option<Placed>,
}

/// A frame's name as the tree has it.
fn plain(frame: &str) -> &str {
    frame.trim_start_matches('/')
}

impl Tree {
    /// Adds a transform. A frame that gets another parent has the last one.
    pub(super) fn add(&mut self, parent: &str, child: &str, time_ns: Option<i64>, placed: Placed) {
        let edge = self.edges.entry(plain(child).to_owned()).or_insert_with(|| Edge {
            parent: String::new(),
            moving: BTreeMap::new(),
            fixed: None,
        });
        plain(parent).clone_into(&mut edge.parent);
        match time_ns {
            Some(time_ns) => drop(edge.moving.insert(time_ns, placed)),
            None => edge.fixed = Some(placed),
        }
    }

    /// The frame at the root of the tree that holds a frame; `None` for one that nothing is said of.
    pub(super) fn root_of(&self, frame: &str) -> Option<&str> {
        let mut at = self.edges.get(plain(frame))?;
        for _ in 0..MAX_CHAIN {
            match self.edges.get(&at.parent) {
                Some(next) => at = next,
                None => return Some(&at.parent),
            }
        }
        None
    }

    /// `target_from_source` at a time: of what moves, the transform that is nearest in time.
    ///
    /// A single transform is given to the bit; a chain of them is computed in double precision.
    pub(super) fn lookup(&self, target: &str, source: &str, time_ns: i64, tolerance_s: f64) -> Result<Pose, String> {
        let (target, source) = (plain(target), plain(source));
        if target == source {
            return Ok(Pose::identity());
        }
        let up = self.chain(source, time_ns, tolerance_s, target)?;
        if let (Some(placed), 1, true) = (up.placed.first(), up.placed.len(), up.end == target) {
            return single(placed);
        }
        let root_from_source = product(&up.placed)?;
        if up.end == target {
            return Ok(root_from_source.cast());
        }
        let other = self.chain(target, time_ns, tolerance_s, &up.end)?;
        if other.end != up.end {
            return Err(format!("no pose: nothing connects frame {source} to {target}"));
        }
        Ok((product(&other.placed)?.inverse() * root_from_source).cast())
    }

    /// The transforms from a frame up to `until`, or to the root.
    fn chain(&self, from: &str, time_ns: i64, tolerance_s: f64, until: &str) -> Result<Chain<'_>, String> {
        let mut chain = Chain { placed: Vec::new(), end: from.to_owned() };
        while let Some(edge) = self.edges.get(&chain.end).filter(|_| chain.end != until) {
            if chain.placed.len() == MAX_CHAIN {
                return Err("no pose: the frames are a circle".to_owned());
            }
            chain.placed.push(edge.at(time_ns, tolerance_s)?);
            edge.parent.clone_into(&mut chain.end);
        }
        Ok(chain)
    }
}

struct Chain<'a> {
    placed: Vec<&'a Placed>,
    end: String,
}

impl Edge {
    fn at(&self, time_ns: i64, tolerance_s: f64) -> Result<&Placed, String> {
        if let Some(fixed) = &self.fixed {
            return Ok(fixed);
        }
        nearest(&self.moving, time_ns, tolerance_s)
    }
}

/// What is nearest in time.
pub(super) fn nearest<T>(all: &BTreeMap<i64, T>, time_ns: i64, tolerance_s: f64) -> Result<&T, String> {
    let (before, after) = (all.range(..=time_ns).next_back(), all.range(time_ns..).next());
    let off_s = |at: i64| (at - time_ns).unsigned_abs() as f64 * 1e-9;
    let best = before.into_iter().chain(after).min_by(|a, b| off_s(*a.0).total_cmp(&off_s(*b.0)));
    let (at, found) = best.ok_or("no pose: there is none")?;
    if off_s(*at) <= tolerance_s {
        return Ok(found);
    }
    Err(format!("no pose within {tolerance_s} s: the nearest is {:.3} s away", off_s(*at)))
}

/// A single transform, its numbers as they are.
pub(super) fn single(placed: &Placed) -> Result<Pose, String> {
    pose_from_quaternion(placed.position.map(|m| m as f32), placed.quaternion.map(|q| q as f32))
        .map_err(|words| format!("no pose: {words}"))
}

fn product(placed: &[&Placed]) -> Result<Isometry3<f64>, String> {
    let mut whole = Isometry3::identity();
    for Placed { position, quaternion } in placed {
        let [x, y, z, w] = *quaternion;
        let quaternion = Quaternion::new(w, x, y, z);
        let off = (quaternion.norm() - 1.0).abs();
        if off.is_nan() || off > TOLERANCE {
            return Err(format!("no pose: a quaternion of length {} is no rotation", quaternion.norm()));
        }
        let step = Isometry3::from_parts(Translation3::from(*position), UnitQuaternion::from_quaternion(quaternion));
        whole = step * whole;
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> Placed {
        Placed { position: [x, 0.0, 0.0], quaternion: [0.0, 0.0, 0.0, 1.0] }
    }

    #[test]
    fn a_frame_is_found_up_and_down_the_tree_at_the_nearest_time() {
        let mut tree = Tree::default();
        tree.add("world", "arm", None, at(1.0));
        tree.add("/arm", "hand", Some(1_000_000_000), at(10.0));
        tree.add("arm", "hand", Some(2_000_000_000), at(20.0));
        tree.add("hand", "camera", None, at(100.0));
        tree.add("world", "board", None, at(5.0));
        let x = |target: &str, time_ns: i64| {
            tree.lookup(target, "camera", time_ns, 0.02)
                .map(|pose| pose.translation.x)
                .map_err(|words| words[..20].to_owned())
        };
        assert_eq!(x("world", 1_010_000_000), Ok(111.0));
        assert_eq!(x("world", 1_990_000_000), Ok(121.0));
        assert_eq!(x("board", 2_000_000_000), Ok(116.0), "through what both stand in");
        assert_eq!(x("hand", 0), Ok(100.0), "what is fixed is always there");
        assert_eq!(x("camera", 0), Ok(0.0));
        assert_eq!(x("world", 1_500_000_000), Err("no pose within 0.02 ".to_owned()));
        assert_eq!(x("moon", 1_000_000_000), Err("no pose: nothing con".to_owned()));
        assert_eq!(tree.root_of("camera"), Some("world"));
        tree.add("camera", "world", None, at(0.0));
        assert!(tree.lookup("moon", "camera", 1_000_000_000, 0.02).is_err(), "a circle ends");
        assert_eq!(tree.root_of("camera"), None);
    }
}
