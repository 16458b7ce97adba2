//! The panels around the three-dimensional views: which are open, and how large they are at first.
//!
//! A panel folds by itself where the window is too small for it, so that the three-dimensional views keep half of the width; what a
//! person opens or folds stays so.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A panel that can be folded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Column {
    /// The episode and its buttons, at the left.
    Episode,
    /// Floor maps and camera images.
    Maps,
    /// The curves over the steps.
    Curves,
    /// The layout's own panel, at the right.
    Right,
}

impl Column {
    /// All of them, from left to right.
    pub const ALL: [Self; 4] = [Self::Episode, Self::Maps, Self::Curves, Self::Right];

    /// As menus and buttons name it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Episode => "Episode panel",
            Self::Maps => "Maps and camera",
            Self::Curves => "Curves",
            Self::Right => "Right panel",
        }
    }

    /// What folding it does, in a sentence.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Episode => "Show or fold the panel at the left: the episode and its buttons",
            Self::Maps => "Show or fold the floor maps and camera images",
            Self::Curves => "Show or fold the curves over the steps",
            Self::Right => "Show or fold the panel at the right: the decision, or what the layout is about",
        }
    }

    /// Whether a window of this size, points, has room for it.
    fn has_room(self, [width, height]: [f32; 2]) -> bool {
        match self {
            Self::Episode => width >= 1280.0,
            Self::Maps => width >= 1180.0,
            Self::Curves => height >= 600.0,
            Self::Right => true,
        }
    }

    /// How wide it is at first in a window of this size, points; `least` is what it needs.
    pub fn width(self, least: f32, [width, _]: [f32; 2]) -> f32 {
        let share = match self {
            Self::Episode => 0.11,
            Self::Maps => 0.22,
            Self::Right => 0.18,
            Self::Curves => 1.0,
        };
        least.max(share * width)
    }
}

/// What a person has opened and folded.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Columns(BTreeMap<Column, bool>);

impl Columns {
    /// Whether a panel is open in a window of this size, points.
    pub fn is_open(&self, column: Column, window: [f32; 2]) -> bool {
        self.0.get(&column).copied().unwrap_or_else(|| column.has_room(window))
    }

    /// Opens what is folded and folds what is open.
    pub fn toggle(&mut self, column: Column, window: [f32; 2]) {
        let is_open = self.is_open(column, window);
        self.0.insert(column, !is_open);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_window_folds_panels_by_itself_and_a_person_has_the_last_word() {
        let [small, large] = [[1000.0, 700.0], [1440.0, 900.0]];
        let mut columns = Columns::default();
        let open = |columns: &Columns, window| Column::ALL.map(|column| columns.is_open(column, window));
        assert_eq!(open(&columns, small), [false, false, true, true]);
        assert_eq!(open(&columns, large), [true; 4]);
        columns.toggle(Column::Maps, small);
        columns.toggle(Column::Right, large);
        assert_eq!(open(&columns, small), [false, true, true, false]);
        assert_eq!(open(&columns, large), [true, true, true, false]);
        // What is open at the sides leaves half of the width.
        assert!(Column::Right.width(330.0, small) <= 0.5 * small[0]);
        assert!(Column::Right.width(330.0, [2560.0, 1440.0]) > 400.0);
    }
}
