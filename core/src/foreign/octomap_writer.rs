//! A belief as OctoMap's binary tree.
//!
//! A voxel of the grid becomes one of the tree's: occupied or free, whichever is likelier, and unknown where neither is. Eight
//! alike become one. OctoMap's voxels begin at the origin; those of a shelf of an odd number of voxels across begin half a voxel
//! beside it, and are written half a voxel to the right.

use super::octomap::BINARY_HEAD;
use super::octree::{DEPTH, MIDDLE};
use crate::belief::Belief;

/// A part of the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Unknown,
    Free,
    Occupied,
    /// It has parts of its own, which follow.
    Inner,
}

/// The file.
pub(super) fn write(belief: &Belief) -> Vec<u8> {
    let voxel_m = f64::from(belief.grid.voxel_m);
    let first = belief.grid.origin.map(|m| (f64::from(m) / voxel_m - 1e-3).ceil() as i64 + MIDDLE);
    let mut writer = Writer { belief, first, data: Vec::new(), nodes: 0 };
    let root = writer.part([0; 3], DEPTH);
    let mut data = writer.data;
    if root != Part::Inner {
        // The root is always a node with parts: eight of its kind.
        data = u16::to_le_bytes(root as u16 * 0x5555).to_vec();
        writer.nodes = if root == Part::Unknown { 1 } else { 9 };
    }
    let size = writer.nodes;
    // `float` first: 0.005 and not what its nearest single-precision number is in double precision.
    let resolution = belief.grid.voxel_m;
    let mut file = format!(
        "{BINARY_HEAD}\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n\
         id OcTree\nsize {size}\nres {resolution}\ndata\n"
    )
    .into_bytes();
    file.extend(data);
    file
}

struct Writer<'a> {
    belief: &'a Belief,
    /// The grid's first voxel in the tree's counting.
    first: [i64; 3],
    /// Two bytes for each node with parts, parents first.
    data: Vec<u8>,
    /// Nodes in the sense of OctoMap: leaves count too.
    nodes: usize,
}

impl Writer<'_> {
    /// Writes the cube of `2^levels` voxels along an edge that begins at `corner`, and says what it is.
    fn part(&mut self, corner: [i64; 3], levels: u32) -> Part {
        let dims = self.belief.grid.dims;
        let edge = 1_i64 << levels;
        let is_outside = |axis: usize| {
            corner[axis] >= self.first[axis] + dims[axis] as i64 || corner[axis] + edge <= self.first[axis]
        };
        if (0..3).any(is_outside) {
            return Part::Unknown;
        }
        if levels == 0 {
            let [x, y, z] = [0, 1, 2].map(|axis| (corner[axis] - self.first[axis]) as usize);
            let [occupied, free] = self.belief.occupancy[(x * dims[1] + y) * dims[2] + z];
            let part = match occupied.partial_cmp(&free) {
                Some(std::cmp::Ordering::Greater) => Part::Occupied,
                Some(std::cmp::Ordering::Less) => Part::Free,
                _ => Part::Unknown,
            };
            self.nodes += usize::from(part != Part::Unknown);
            return part;
        }
        // Its own bytes stand before those of its parts.
        let (at, before) = (self.data.len(), self.nodes);
        self.data.extend([0; 2]);
        let half = edge / 2;
        let parts: [Part; 8] = std::array::from_fn(|part| {
            let corner = [0, 1, 2].map(|axis| corner[axis] + half * (part >> axis & 1) as i64);
            self.part(corner, levels - 1)
        });
        if parts[0] != Part::Inner && parts.iter().all(|part| *part == parts[0]) {
            self.data.truncate(at);
            self.nodes = before + usize::from(parts[0] != Part::Unknown);
            return parts[0];
        }
        let bits = parts.iter().enumerate().fold(0_u16, |bits, (at, part)| bits | (*part as u16) << (2 * at));
        self.data[at..at + 2].copy_from_slice(&bits.to_le_bytes());
        self.nodes += 1;
        Part::Inner
    }
}
