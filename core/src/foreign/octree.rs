//! An octree of occupancy as OctoMap has it: 16 levels around the origin, leaves at any of them.

/// Levels below the root.
pub(super) const DEPTH: u32 = 16;
/// The voxel that begins at the origin, along each axis.
pub(super) const MIDDLE: i64 = 1 << (DEPTH - 1);

/// What is in an eighth of a node, or in the root.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Child {
    /// Nobody knows.
    #[default]
    Unknown,
    /// All of it has these log-odds of being occupied.
    Leaf(f32),
    /// A node of the tree, by its position.
    Node(u32),
}

/// A tree.
#[derive(Debug)]
pub(super) struct Octree {
    /// The edge of the smallest voxels, metres.
    pub(super) resolution_m: f64,
    /// What the whole is.
    pub(super) root: Child,
    /// The nodes that have parts: the part at `x + 2 y + 4 z`, each 1 for the farther half.
    pub(super) nodes: Vec<[Child; 8]>,
}

impl Octree {
    /// Log-odds of being occupied at a point, where they are known.
    pub(super) fn log_odds(&self, point: [f64; 3]) -> Option<f32> {
        let key = point.map(|x| (x / self.resolution_m).floor());
        if !key.iter().all(|k| (-(MIDDLE as f64)..MIDDLE as f64).contains(k)) {
            return None;
        }
        let key = key.map(|k| (k as i64 + MIDDLE) as u32);
        let mut at = self.root;
        for level in (0..DEPTH).rev() {
            let Child::Node(node) = at else { break };
            let [x, y, z] = key.map(|k| (k >> level & 1) as usize);
            at = self.nodes[node as usize][x + 2 * y + 4 * z];
        }
        if let Child::Leaf(log_odds) = at { Some(log_odds) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_found_on_its_way_down_the_halves() {
        // All at x >= 0, y < 0, z >= 0 is occupied; nothing else is known.
        let mut root = [Child::Unknown; 8];
        root[5] = Child::Leaf(3.5);
        let tree = Octree { resolution_m: 0.1, root: Child::Node(0), nodes: vec![root] };
        assert_eq!(tree.log_odds([0.0, -0.01, 5.0]), Some(3.5));
        assert_eq!(tree.log_odds([0.0, 0.0, 5.0]), None);
        assert_eq!(tree.log_odds([3276.7, -3276.8, 0.0]), Some(3.5));
        assert_eq!(tree.log_odds([3276.81, -1.0, 0.0]), None, "outside of what 16 levels hold");
        assert_eq!(tree.log_odds([f64::NAN, -1.0, 0.0]), None);
    }
}
