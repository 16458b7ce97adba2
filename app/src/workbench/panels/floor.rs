//! A floor map on the screen: the picture, the outlines of what really stands there, the picked cell, and the cell
//! under the pointer. Seen from above, the front edge at the bottom.

use nudge_core::Point;
use nudge_core::grid::{Grid, Window};
use nudge_core::scene::Body;
use nudge_core::solid::convex_outline;
use re_viewer::external::egui::{
    Color32, Painter, Pos2, Rect, Response, Sense, Shape, Stroke, StrokeKind, TextureHandle, Tooltip, Ui, WidgetInfo,
    WidgetType, pos2, vec2,
};
use std::sync::Arc;

/// A line on the board, metres.
pub type Line = Vec<[f32; 2]>;

/// The outlines of the bodies, made anew only when something moved.
#[derive(Default)]
pub struct Outlines {
    of: Option<Arc<Vec<Body>>>,
    lines: Arc<Vec<Line>>,
}

impl Outlines {
    /// The outlines of `bodies` as seen from above.
    pub fn of(&mut self, bodies: &Arc<Vec<Body>>) -> Arc<Vec<Line>> {
        if !self.of.as_ref().is_some_and(|known| Arc::ptr_eq(known, bodies)) {
            self.lines = Arc::new(bodies.iter().map(outline).collect());
            self.of = Some(bodies.clone());
        }
        self.lines.clone()
    }
}

/// The outline of a body as seen from above, toppled ones too.
fn outline(body: &Body) -> Line {
    let corners = body.solid.parts.iter().flat_map(|part| &part.vertices);
    let mut points: Line = corners
        .map(|corner| {
            let at = body.world_from_body * corner;
            [at.x, at.y]
        })
        .collect();
    convex_outline(&mut points)
}

/// Where a cell is in the arrays of a window of the floor plan; `None` outside it.
pub fn in_window(window: &Window, grid: &Grid, cell: usize) -> Option<usize> {
    let at = grid.cell(cell);
    let (x, y) = (usize::from(at.x), usize::from(at.y));
    let inside = (window.x[0]..window.x[1]).contains(&x) && (window.y[0]..window.y[1]).contains(&y);
    inside.then(|| (x - window.x[0]) * window.size()[1] + y - window.y[0])
}

/// Where the floor plan is on the screen.
#[derive(Clone, Copy)]
pub struct Frame {
    /// The board's interior.
    pub board: Rect,
    grid: Grid,
}

impl Frame {
    /// A place on the board, metres, on the screen.
    pub fn place(&self, [x, y]: [f32; 2]) -> Pos2 {
        let [width, depth, _] = self.grid.size_m();
        pos2(
            self.board.left() + (x - self.grid.origin[0]) / width * self.board.width(),
            self.board.bottom() - (y - self.grid.origin[1]) / depth * self.board.height(),
        )
    }

    /// The cell at a place on the screen, by its position in arrays over cells.
    pub fn cell_at(&self, at: Pos2) -> Option<usize> {
        let [width, depth, _] = self.grid.size_m();
        let x = (at.x - self.board.left()) / self.board.width() * width + self.grid.origin[0];
        let y = (self.board.bottom() - at.y) / self.board.height() * depth + self.grid.origin[1];
        self.grid.cell_at(Point::new(x, y, 0.0)).map(|cell| self.grid.cell_index(cell))
    }

    /// Where a cell is on the screen.
    pub fn cell(&self, cell: usize) -> Rect {
        let (at, half) = (self.grid.cell_center(self.grid.cell(cell)), 0.5 * self.grid.voxel_m);
        Rect::from_two_pos(self.place([at.x - half, at.y - half]), self.place([at.x + half, at.y + half]))
    }
}

/// What is drawn of a floor map.
pub struct FloorMap<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// One pixel a cell, or several.
    pub picture: Option<&'a TextureHandle>,
    /// The outlines drawn over it.
    pub outlines: &'a [Line],
    /// The cell that a person asks about.
    pub picked: Option<usize>,
    /// How much of what is before the front edge is shown too, metres.
    pub apron_m: f32,
    /// What it is, for screen readers.
    pub name: &'a str,
}

/// A floor map that was drawn.
pub struct Drawn {
    /// Where a person points and clicks.
    pub response: Response,
    /// Where the floor is.
    pub frame: Frame,
    /// The cell under the pointer.
    pub over: Option<usize>,
    /// The cell that was clicked, or that the arrow keys went to.
    pub chosen: Option<usize>,
}

impl Drawn {
    /// Says at the pointer what is there, at once.
    pub fn tell(&self, text: impl FnOnce(usize) -> String) {
        if let Some(cell) = self.over {
            Tooltip::for_widget(&self.response).at_pointer().gap(12.0).show(|ui| ui.label(text(cell)));
        }
    }
}

impl FloorMap<'_> {
    /// Draws it as wide as `width`, in its true proportions.
    pub fn show(&self, ui: &mut Ui, width: f32) -> Drawn {
        let [across_m, depth_m, _] = self.grid.size_m();
        let scale = width / across_m;
        let (rect, response) = ui.allocate_exact_size(vec2(width, (depth_m + self.apron_m) * scale), Sense::click());
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Image, true, self.name));
        let frame = Frame { board: rect.with_max_y(rect.top() + depth_m * scale), grid: *self.grid };
        let over = response.hover_pos().and_then(|at| frame.cell_at(at));
        if ui.is_rect_visible(rect) {
            self.paint(ui, rect, &frame, over);
        }
        let chosen = match super::arrow_keys(ui, &response) {
            Some(by) => Some(self.beside(by)),
            // Enter on a map that has the focus is a click without a place.
            None => response.clicked().then(|| over.unwrap_or_else(|| self.beside([0, 0]))),
        };
        Drawn { response, frame, over, chosen }
    }

    /// The cell so many cells beside the picked one, or beside the middle; on the floor.
    fn beside(&self, [right, back]: [i32; 2]) -> usize {
        let [width, depth, _] = self.grid.dims;
        let from = self.picked.filter(|cell| *cell < self.grid.cell_count());
        let from = from.map_or([width / 2, depth / 2], |cell| {
            let at = self.grid.cell(cell);
            [usize::from(at.x), usize::from(at.y)]
        });
        let step = |at: usize, by: i32, count: usize| {
            (at as i64 + i64::from(by)).clamp(0, count.saturating_sub(1) as i64) as usize
        };
        step(from[0], right, width) * depth + step(from[1], back, depth)
    }

    fn paint(&self, ui: &Ui, rect: Rect, frame: &Frame, over: Option<usize>) {
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 0.0, ui.visuals().extreme_bg_color);
        if let Some(picture) = self.picture {
            painter.image(picture.id(), frame.board, Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)), Color32::WHITE);
        } else {
            painter.rect_filled(frame.board, 0.0, super::legend::ink(crate::colors::UNKNOWN_RGB));
        }
        outlines(&painter, frame, self.outlines);
        let edge = Stroke::new(1.0, ui.visuals().weak_text_color().gamma_multiply(0.6));
        painter.rect_stroke(frame.board, 0.0, edge, StrokeKind::Inside);
        // The open front of the shelf.
        let front = Stroke::new(2.0, ui.visuals().strong_text_color());
        painter.hline(frame.board.x_range(), frame.board.bottom() - 1.0, front);
        if let Some(cell) = over {
            painter.rect_stroke(
                frame.cell(cell).expand(1.0),
                0.0,
                Stroke::new(1.0, Color32::WHITE),
                StrokeKind::Outside,
            );
        }
        if let Some(cell) = self.picked {
            mark(&painter, frame.cell(cell));
        }
    }
}

/// Thin dark lines with a light rim, so that they show on every colour.
fn outlines(painter: &Painter, frame: &Frame, lines: &[Line]) {
    let placed = |line: &Line| -> Vec<Pos2> { line.iter().map(|at| frame.place(*at)).collect() };
    for line in lines.iter().filter(|line| line.len() > 2) {
        let points = placed(line);
        painter.add(Shape::closed_line(points.clone(), Stroke::new(2.2, Color32::from_white_alpha(70))));
        painter.add(Shape::closed_line(points, Stroke::new(0.9, Color32::from_black_alpha(230))));
    }
}

/// A cross hair about what was picked.
fn mark(painter: &Painter, cell: Rect) {
    let (center, reach) = (cell.center(), 0.5 * cell.width() + 7.0);
    for (width, colour) in [(3.5, Color32::BLACK), (1.5, Color32::WHITE)] {
        let stroke = Stroke::new(width, colour);
        painter.rect_stroke(cell.expand(2.0), 0.0, stroke, StrokeKind::Middle);
        let gap = 0.5 * cell.width() + 2.0;
        for way in [vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0)] {
            painter.line_segment([center + way * gap, center + way * reach], stroke);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_lists_its_cells_in_its_own_order() {
        let grid = Grid::for_shelf([0.08, 0.06, 0.02], 0.01);
        let window = Window { x: [2, 5], y: [1, 4] };
        let listed: Vec<usize> = window.cells(&grid).collect();
        for cell in 0..grid.cell_count() {
            assert_eq!(in_window(&window, &grid, cell), listed.iter().position(|other| *other == cell));
        }
    }

    #[test]
    fn the_arrow_keys_walk_over_the_floor_and_stop_at_its_edges() {
        let grid = Grid::for_shelf([0.8, 0.4, 0.3], 0.01);
        let map = |picked| FloorMap { grid: &grid, picture: None, outlines: &[], picked, apron_m: 0.0, name: "" };
        let at = |cell: usize| [grid.cell(cell).x, grid.cell(cell).y];
        assert_eq!(at(map(None).beside([1, -1])), [41, 19]);
        assert_eq!(at(map(Some(map(None).beside([1, -1]))).beside([-10, 0])), [31, 19]);
        assert_eq!(at(map(Some(0)).beside([-10, 10])), [0, 10]);
        assert_eq!(at(map(Some(usize::MAX)).beside([0, 1])), [40, 21]);
    }

    #[test]
    fn cells_are_found_where_they_are_drawn() {
        let grid = Grid::for_shelf([0.8, 0.4, 0.3], 0.01);
        let board = Rect::from_min_size(pos2(30.0, 50.0), vec2(320.0, 160.0));
        let frame = Frame { board, grid };
        for cell in (0..grid.cell_count()).step_by(37) {
            assert_eq!(frame.cell_at(frame.cell(cell).center()), Some(cell));
        }
        // The front edge is at the bottom, the right end of the shelf to the right.
        assert_eq!(frame.place([0.4, 0.0]), board.right_bottom());
        assert_eq!(frame.cell_at(board.left_top() - vec2(1.0, 0.0)), None);
    }
}
