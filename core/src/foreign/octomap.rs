//! OctoMap's files (Hornung et al. 2013), `.bt` and `.ot`.
//!
//! A header of text says the kind of tree, the number of nodes and the resolution; behind `data` the tree is written from
//! the root on, each node before its parts. In `.bt` a node is two bytes, two bits for each of its parts: unknown, free,
//! occupied, or a node that follows. In `.ot` a node is its log-odds and a byte that says which parts follow; coloured trees
//! have three bytes of colour between them.

use super::bytes::Bytes;
use super::octree::{Child, DEPTH, Octree};
use crate::{Error, Result};
use std::path::Path;

/// First line of a `.bt`.
pub(super) const BINARY_HEAD: &str = "# Octomap OcTree binary file";
/// First line of a `.ot`.
const FULL_HEAD: &str = "# Octomap OcTree file";
/// Log-odds of what a `.bt` calls occupied and free: the limits that OctoMap clamps to.
const OCCUPIED: f32 = 3.5;
const FREE: f32 = -2.0;
/// The most nodes with parts that are read; each takes 64 bytes.
const MOST_NODES: usize = 8 << 20;

/// Reads either kind: the first line tells which it is.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Octree> {
    let mut bytes = Bytes::new(bytes);
    let fail = |bytes: &Bytes<'_>, words: String| Error::input(path, format!("byte {}", bytes.position()), words);
    let head = head(&mut bytes).map_err(|words| Error::input(path, "header", words))?;
    let mut tree = Octree { resolution_m: head.resolution_m, root: Child::Unknown, nodes: Vec::new() };
    let root = match head.kind {
        Kind::Binary => read_binary(&mut bytes, &mut tree, DEPTH),
        Kind::Full { after } => read_full(&mut bytes, &mut tree, DEPTH, after),
    };
    tree.root = root.map_err(|words| fail(&bytes, words))?;
    if bytes.left() > 0 {
        return Err(fail(&bytes, format!("{} bytes follow behind the tree", bytes.left())));
    }
    Ok(tree)
}

enum Kind {
    Binary,
    /// With so many bytes between a node's log-odds and its parts.
    Full {
        after: usize,
    },
}

struct Head {
    kind: Kind,
    resolution_m: f64,
}

fn head(bytes: &mut Bytes<'_>) -> std::result::Result<Head, String> {
    let first = bytes.line().unwrap_or_default().to_owned();
    let is_binary = first.starts_with(BINARY_HEAD);
    if !is_binary && !first.starts_with(FULL_HEAD) {
        return Err(format!("does not begin with \"{BINARY_HEAD}\" or \"{FULL_HEAD}\""));
    }
    let (mut resolution_m, mut after) = (None, None);
    loop {
        let line = bytes.line()?;
        let mut words = line.split_whitespace();
        match (words.next(), words.next()) {
            (Some("data"), _) => break,
            (Some("id"), Some("OcTree")) => after = Some(0),
            (Some("id"), Some("ColorOcTree")) if !is_binary => after = Some(3),
            (Some("id"), id) => {
                let id = id.unwrap_or("nothing");
                return Err(format!("id is {id}; OcTree is read, and ColorOcTree in .ot"));
            }
            (Some("res"), Some(number)) => {
                let number = number.parse::<f64>().ok().filter(|m| (1e-4..=100.0).contains(m));
                resolution_m =
                    Some(number.ok_or_else(|| format!("{line}: a resolution of 0.0001 to 100 m is needed"))?);
            }
            // The number of nodes is told by the nodes themselves; comments say nothing.
            _ => {}
        }
    }
    let resolution_m = resolution_m.ok_or("tells no resolution (res)")?;
    let after = after.ok_or("tells no kind of tree (id)")?;
    Ok(Head { kind: if is_binary { Kind::Binary } else { Kind::Full { after } }, resolution_m })
}

/// A place for a node with parts.
fn new_node(tree: &mut Octree) -> std::result::Result<u32, String> {
    if tree.nodes.len() >= MOST_NODES {
        return Err(format!("has more than {MOST_NODES} nodes: cut the shelf out of it first"));
    }
    tree.nodes.push([Child::Unknown; 8]);
    Ok(tree.nodes.len() as u32 - 1)
}

/// A node whose parts are `levels` levels above the smallest voxels, or lower.
fn read_binary(bytes: &mut Bytes<'_>, tree: &mut Octree, levels: u32) -> std::result::Result<Child, String> {
    // An empty tree has not even a root.
    if levels == DEPTH && bytes.left() == 0 {
        return Ok(Child::Unknown);
    }
    if levels == 0 {
        return Err(format!("goes down more than {DEPTH} levels"));
    }
    let bits = u16::from_le_bytes(bytes.array()?);
    let node = new_node(tree)?;
    for part in 0..8 {
        let child = match bits >> (2 * part) & 3 {
            0 => Child::Unknown,
            1 => Child::Leaf(FREE),
            2 => Child::Leaf(OCCUPIED),
            _ => read_binary(bytes, tree, levels - 1)?,
        };
        tree.nodes[node as usize][part] = child;
    }
    Ok(Child::Node(node))
}

fn read_full(
    bytes: &mut Bytes<'_>,
    tree: &mut Octree,
    levels: u32,
    after: usize,
) -> std::result::Result<Child, String> {
    if levels == DEPTH && bytes.left() == 0 {
        return Ok(Child::Unknown);
    }
    let log_odds = f32::from_le_bytes(bytes.array()?);
    bytes.take(after)?;
    let [parts] = bytes.array::<1>()?;
    if parts == 0 {
        return if log_odds.is_finite() {
            Ok(Child::Leaf(log_odds))
        } else {
            Err(format!("a voxel has log-odds {log_odds}"))
        };
    }
    if levels == 0 {
        return Err(format!("goes down more than {DEPTH} levels"));
    }
    let node = new_node(tree)?;
    for part in (0..8).filter(|part| parts >> part & 1 == 1) {
        tree.nodes[node as usize][part] = read_full(bytes, tree, levels - 1, after)?;
    }
    Ok(Child::Node(node))
}
