//! Where the board is on the screen, and what of it cannot be seen from any view.

use crate::workbench::author::Author;
use nudge_core::scene::Shelf;
use re_viewer::external::egui::{Pos2, Rect, Vec2};

/// Room around the board for its scale, points.
const MARGIN: Vec2 = Vec2::new(44.0, 40.0);

/// Where the board is on the screen.
#[derive(Clone, Copy)]
pub(super) struct Board {
    /// Its front edge at the bottom.
    pub rect: Rect,
    /// Points per metre.
    pub scale: f32,
}

impl Board {
    pub fn fitting(shelf: &Shelf, space: Rect) -> Self {
        let [width, depth, _] = shelf.size;
        let room = (space.size() - 2.0 * MARGIN).max(Vec2::splat(20.0));
        let scale = (room.x / width).min(room.y / depth);
        Self { rect: Rect::from_center_size(space.center(), Vec2::new(width, depth) * scale), scale }
    }

    pub fn screen(&self, [x, y]: [f32; 2]) -> Pos2 {
        Pos2::new(self.rect.center().x + x * self.scale, self.rect.bottom() - y * self.scale)
    }

    pub fn board(&self, at: Pos2) -> [f32; 2] {
        [(at.x - self.rect.center().x) / self.scale, (self.rect.bottom() - at.y) / self.scale]
    }

    pub fn points(&self, outline: &[[f32; 2]]) -> Vec<Pos2> {
        outline.iter().map(|point| self.screen(*point)).collect()
    }
}

pub(super) fn is_hidden(author: &Author, at: usize) -> bool {
    author.hidden().objects.as_ref().is_some_and(|hidden| hidden.contains(&at))
}
