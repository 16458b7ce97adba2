//! Which voxels count as a gain: the choice, and what it makes of IGV and IGM, in words.

use crate::belief::observes_with_networks;
use crate::grid::VoxelSet;
use crate::named;
use serde::{Deserialize, Serialize};

/// Which voxels count as a gain, and what a push is worth. [`Gain`](super::Gain) is what it makes of a belief.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Counted {
    /// All voxels that the view may see, summed over its rays; a push is worth the best single view after it. As in the
    /// paper.
    #[default]
    All,
    /// Only voxels that no look has seen yet, or not since a push has probably changed them. Each voxel counts once: in
    /// the gain of a view ([`crate::gain::Coverage`]), in IGV and in IGM. A push is worth the unseen space that it
    /// opens to all views together ([`crate::gain::Openings`]); making seen voxels uncertain is no gain.
    Unseen,
}

impl Counted {
    /// Both.
    pub const ALL: [Self; 2] = [Self::All, Self::Unseen];

    /// The default for a belief update, by its name: the networks stay uncertain of edges however often they are looked
    /// at, so with them only unseen voxels count.
    pub fn of_belief(name: &str) -> Self {
        if observes_with_networks(name) { Self::Unseen } else { Self::All }
    }

    /// The voxels that do not count, of those that looks have seen; `None` where all count.
    pub(crate) fn left_out(self, seen: &VoxelSet) -> Option<&VoxelSet> {
        match self {
            Self::All => None,
            Self::Unseen => Some(seen),
        }
    }

    /// What IGV is, as the end of a sentence.
    pub fn of_looks(self) -> &'static str {
        match self {
            Self::All => "information gain of the best two views together",
            Self::Unseen => "what the best two views together would see of what no look has seen",
        }
    }

    /// What IGM is, as the end of a sentence.
    pub fn of_pushes(self) -> &'static str {
        match self {
            Self::All => "the best view after the best push",
            Self::Unseen => "what the best push opens to all views together",
        }
    }

    /// What one view's gain is, with the formula.
    pub fn of_a_view(self) -> &'static str {
        match self {
            Self::All => {
                "Information gain of the view, nats: IG(v) = Σ rays Σ voxels H(p)·Π(1 − p before), summed over rays"
            }
            Self::Unseen => {
                "Coverage of the view, nats: IG(v) = Σ voxels H(p)·max over rays Π(1 − p before); every voxel that no look \
                 has seen counts once, however many rays meet it"
            }
        }
    }

    /// What one push's gain is, with the formula.
    pub fn of_a_push(self) -> &'static str {
        match self {
            Self::All => "Gain of the best single view under the predicted belief, nats: max over views of IG(v)",
            Self::Unseen => {
                "What the push opens, nats: Σ voxels H(p predicted) that a ray of some view reaches after it and none \
                 before, of those that no look has seen"
            }
        }
    }
}

impl std::fmt::Display for Counted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::All => "all",
            Self::Unseen => "unseen",
        })
    }
}

impl std::str::FromStr for Counted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        named::parse(&Self::ALL, text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_by_coverage_is_not_explained_as_a_sum_over_rays() {
        let [all, unseen] = Counted::ALL.map(Counted::of_a_view);
        assert!(all.contains("Σ rays Σ voxels"), "{all}");
        assert!(unseen.contains("max over rays") && !unseen.contains("Σ rays"), "{unseen}");
        let [all, unseen] = Counted::ALL.map(Counted::of_a_push);
        assert!(all.contains("best single view"), "{all}");
        assert!(unseen.contains("opens") && !unseen.contains("best single view"), "{unseen}");
    }
}
