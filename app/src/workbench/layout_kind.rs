//! The layouts of the window.

use serde::{Deserialize, Serialize};

/// The layouts, as the tabs at the top right name them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum LayoutKind {
    /// Belief, maps, curves and decision.
    #[default]
    Episode,
    /// The numbers and causes of one voxel or cell.
    Why,
    /// The gain of every view.
    Gains,
    /// What pushes would do.
    Push,
    /// Two episodes on one clock.
    Compare,
    /// A scene in the making.
    Author,
}

impl LayoutKind {
    /// All of them, in the order of the tabs.
    pub const ALL: [Self; 6] = [Self::Episode, Self::Why, Self::Gains, Self::Push, Self::Compare, Self::Author];

    /// The tab's text.
    pub fn title(self) -> &'static str {
        match self {
            Self::Episode => "Episode",
            Self::Why => "Why",
            Self::Gains => "Gains",
            Self::Push => "Push",
            Self::Compare => "Compare",
            Self::Author => "Author",
        }
    }

    /// What it shows, in a sentence.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Episode => "Belief, floor maps, score curves and the decision",
            Self::Why => "The numbers, history and causes of one voxel or floor cell",
            Self::Gains => "The gain of every view, in nats",
            Self::Push => "What a push would do, and what it did",
            Self::Compare => "Two episodes on one clock",
            Self::Author => "Make a scene",
        }
    }

    /// How wide the panel at the right is at first, points.
    pub fn right_width(self) -> f32 {
        match self {
            Self::Gains => 460.0,
            Self::Why | Self::Push | Self::Compare => 420.0,
            Self::Episode | Self::Author => 330.0,
        }
    }

    /// Whether the three-dimensional view shows where the chosen view's gain comes from, in place of the belief's
    /// probabilities.
    pub fn shows_gain(self) -> bool {
        self == Self::Gains
    }
}
