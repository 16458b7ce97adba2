//! The parts of the window.

/// A part of the window that can be exported as a picture of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    #[default]
    Window,
    /// The three-dimensional views.
    Space,
    /// Floor maps and camera images.
    Maps,
    /// The score curves.
    Curves,
    /// The panel at the right.
    Right,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Window, Self::Space, Self::Maps, Self::Curves, Self::Right];

    /// As a choice names it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Window => "the whole window",
            Self::Space => "the three-dimensional views",
            Self::Maps => "the floor maps and camera images",
            Self::Curves => "the score curves",
            Self::Right => "the panel at the right",
        }
    }
}
