//! Manipulations as arrows and lines on a floor map.

use super::floor::Frame;
use super::legend;
use nudge_core::plan::CandidateRecord;
use nudge_core::skill::{Arrow, Outline};
use re_viewer::external::egui::{self, Color32, Painter, Pos2, Shape, Stroke, Ui, Vec2};

/// How near the pointer has to be to an arrow, points.
const NEAR: f32 = 7.0;

/// Both ends of a way on the screen.
pub fn ends(frame: &Frame, arrow: &Arrow) -> [Pos2; 2] {
    [arrow.start, arrow.end()].map(|end| frame.place([end.x, end.y]))
}

/// Draws the lines beside the ways of a manipulation.
pub fn lines(painter: &Painter, frame: &Frame, outline: &Outline) {
    for line in &outline.lines {
        let points: Vec<Pos2> = line.iter().map(|point| frame.place([point.x, point.y])).collect();
        painter.add(Shape::line(points.clone(), Stroke::new(3.4, Color32::from_black_alpha(200))));
        painter.add(Shape::line(points, Stroke::new(1.4, Color32::WHITE)));
    }
}

/// The arrow nearest to the pointer, if one is near.
pub fn nearest(arrows: &[(usize, &CandidateRecord, [Pos2; 2])], pointer: Pos2) -> Option<usize> {
    let distance = |[from, to]: [Pos2; 2]| {
        let way = to - from;
        let t = ((pointer - from).dot(way) / way.length_sq().max(1e-6)).clamp(0.0, 1.0);
        (from + way * t).distance(pointer)
    };
    let measured = arrows.iter().map(|(at, candidate, ends)| {
        // Of two that are equally near, the feasible one.
        (distance(*ends) + if candidate.rejection.is_some() { 1.0 } else { 0.0 }, *at)
    });
    let near = measured.filter(|(distance, _)| *distance <= NEAR);
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, at)| at)
}

/// How an arrow looks.
#[derive(Clone, Copy)]
pub enum Look {
    /// In the colour of its value.
    Weighed(Color32),
    /// Grey and dashed.
    Rejected,
}

/// Draws the way of a tool's tip.
pub fn arrow(painter: &Painter, [from, to]: [Pos2; 2], look: Look, picked: bool) {
    let way = (to - from).normalized();
    let width: f32 = if picked { 3.0 } else { 1.6 };
    let grey = Color32::from_gray(120);
    match look {
        Look::Rejected => {
            let colour = if picked { Color32::from_gray(60) } else { grey };
            painter.extend(Shape::dashed_line(&[from, to], Stroke::new(width.min(2.2), colour), 4.0, 3.0));
            painter.add(head(to, way, 5.0 + width, colour, Stroke::NONE));
        }
        Look::Weighed(colour) => {
            let rim = if picked { Color32::WHITE } else { Color32::from_black_alpha(200) };
            let back = to - way * 4.0;
            if picked {
                painter.line_segment([from, back], Stroke::new(width + 5.0, Color32::BLACK));
            }
            painter.line_segment([from, back], Stroke::new(width + 2.4, rim));
            painter.line_segment([from, back], Stroke::new(width, colour));
            painter.circle(from, width + 0.6, colour, Stroke::new(1.0, rim));
            painter.add(head(to, way, 6.0 + 1.5 * width, colour, Stroke::new(1.0, rim)));
        }
    }
}

/// The head of an arrow.
fn head(tip: Pos2, way: Vec2, length: f32, colour: Color32, stroke: Stroke) -> Shape {
    let (back, side) = (tip - way * length, way.rot90() * (0.42 * length));
    Shape::convex_polygon(vec![tip, back + side, back - side], colour, stroke)
}

/// A word beside an arrow's tip.
pub fn tag(ui: &Ui, painter: &Painter, at: Pos2, text: &str) {
    let galley = painter.layout_no_wrap(text.to_owned(), legend::small(ui), Color32::WHITE);
    let mut place = at + Vec2::new(6.0, -0.5 * galley.size().y);
    // At the map's edge on the other side.
    if place.x + galley.size().x + 3.0 > painter.clip_rect().right() {
        place.x = at.x - 6.0 - galley.size().x;
    }
    let ground = egui::Rect::from_min_size(place, galley.size()).expand2(Vec2::new(3.0, 1.0));
    painter.rect_filled(ground, 3.0, Color32::from_black_alpha(190));
    painter.galley(place, galley, Color32::WHITE);
}
