//! How the board and what stands on it look.

use super::board::{Board, is_hidden};
use crate::workbench::author::{Author, Gesture};
use crate::workbench::panels::author::common::colour;
use crate::workbench::theme::LEAST_SIZE;
use nudge_core::scene::Shelf;
use re_viewer::external::egui::{
    self, Align2, Color32, CornerRadius, FontId, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Vec2,
};

/// Spacing of the grid, metres.
const GRID_M: f32 = 0.1;
/// Distance of the lines of a hatch, points.
const HATCH: f32 = 7.0;
const WALL: f32 = 6.0;
/// Sizes of names; those that fit in none are told on hover only.
const NAME_SIZES: [f32; 2] = [13.0, LEAST_SIZE];

/// The colours of the canvas that are no class's.
pub(super) struct Ink {
    is_dark: bool,
    board: Color32,
    grid: Color32,
    wall: Color32,
    text: Color32,
    weak: Color32,
    accent: Color32,
    wrong: Color32,
}

impl Ink {
    pub fn of(visuals: &egui::Visuals) -> Self {
        let is_dark = visuals.dark_mode;
        let grey = |dark: u8, light: u8| Color32::from_gray(if is_dark { dark } else { light });
        Self {
            is_dark,
            board: if is_dark { Color32::from_rgb(33, 36, 42) } else { Color32::from_rgb(250, 247, 241) },
            grid: grey(54, 222),
            wall: grey(92, 168),
            text: visuals.strong_text_color(),
            weak: visuals.weak_text_color(),
            accent: if is_dark { Color32::from_rgb(110, 170, 255) } else { Color32::from_rgb(20, 90, 210) },
            wrong: if is_dark { Color32::from_rgb(255, 92, 92) } else { Color32::from_rgb(205, 20, 30) },
        }
    }

    /// Ink that can be read on a class's colour.
    fn on(fill: Color32) -> Color32 {
        let luma = 0.2126 * f32::from(fill.r()) + 0.7152 * f32::from(fill.g()) + 0.0722 * f32::from(fill.b());
        if luma > 128.0 { Color32::from_gray(18) } else { Color32::from_gray(245) }
    }
}

/// Board, walls, grid and scale.
pub(super) fn ground(painter: &Painter, ink: &Ink, board: &Board, shelf: &Shelf) {
    let rect = board.rect;
    painter.rect_filled(rect, 0.0, ink.board);
    let [width, depth, _] = shelf.size;
    let font = FontId::proportional(LEAST_SIZE);
    let first = (-0.5 * width / GRID_M).ceil() as i32;
    for i in first..=-first {
        let x = i as f32 * GRID_M;
        let at = board.screen([x, 0.0]);
        painter.vline(at.x, rect.y_range(), Stroke::new(if i == 0 { 1.5 } else { 1.0 }, ink.grid));
        painter.text(at + Vec2::new(0.0, 7.0), Align2::CENTER_TOP, metres(x), font.clone(), ink.weak);
    }
    for j in 0..=(depth / GRID_M + 1e-3) as i32 {
        let y = j as f32 * GRID_M;
        let at = board.screen([-0.5 * width, y]);
        if j > 0 {
            painter.hline(rect.x_range(), at.y, Stroke::new(1.0, ink.grid));
        }
        painter.text(at - Vec2::new(WALL + 5.0, 0.0), Align2::RIGHT_CENTER, metres(y), font.clone(), ink.weak);
    }
    let wall = |from: Pos2, to: Pos2| painter.rect_filled(Rect::from_two_pos(from, to), CornerRadius::ZERO, ink.wall);
    let (out, back) = (Vec2::new(WALL, 0.0), Vec2::new(0.0, WALL));
    wall(rect.left_bottom(), rect.left_top() - out - back);
    wall(rect.right_bottom(), rect.right_top() + out - back);
    wall(rect.left_top() - back, rect.right_top());
    for dash in Shape::dashed_line(&[rect.left_bottom(), rect.right_bottom()], Stroke::new(1.5, ink.wall), 8.0, 5.0) {
        painter.add(dash);
    }
    let below = rect.center_bottom() + Vec2::new(0.0, 22.0);
    painter.text(below, Align2::CENTER_TOP, "front edge: the robot looks from here  ·  metres", font, ink.weak);
}

fn metres(value: f32) -> String {
    if value.abs() < 1e-3 { "0".to_owned() } else { format!("{value:.1}").replace('-', "\u{2212}") }
}

/// All objects: footprints in their classes' colours, what is chosen, hidden or wrong marked by more than colour.
pub(super) fn objects(painter: &Painter, ink: &Ink, board: &Board, author: &Author, hovered: Option<usize>) {
    let plan = author.plan();
    let count = author.scene().objects.len();
    // What is chosen on top.
    let (below, above): (Vec<usize>, Vec<usize>) = (0..count).partition(|at| !author.selection().contains(at));
    for at in below.into_iter().chain(above) {
        let points = board.points(&plan.outlines[at]);
        if points.len() < 3 {
            continue;
        }
        let class = author.catalog().by_name(&author.scene().objects[at].class);
        let fill = class.map_or(Color32::GRAY, |class| colour(class.color));
        let is_hidden =
            is_hidden(author, at) && !author.hidden().is_stale || is_hidden(author, at) && author.gesture().is_some();
        let edge = if ink.is_dark { Color32::from_black_alpha(150) } else { Color32::from_black_alpha(90) };
        painter.add(Shape::convex_polygon(points.clone(), fill, Stroke::new(1.0, edge)));
        if hovered == Some(at) && author.gesture().is_none() {
            painter.add(Shape::convex_polygon(points.clone(), Color32::from_white_alpha(28), Stroke::NONE));
        }
        if is_hidden {
            dashed(painter, &points, Ink::on(fill));
        }
        let is_wrong = plan.problems.contains_key(&at);
        if is_wrong {
            hatch(painter, &points, ink.wrong);
            outline(painter, &points, Stroke::new(2.5, ink.wrong));
        }
        let title = author.scene().objects[at].class.replace('_', " ");
        label(painter, &points, &title, is_hidden, fill, is_wrong);
        if author.selection().contains(&at) {
            chosen(painter, ink, &points);
        }
    }
    words(painter, ink, board, author);
}

fn outline(painter: &Painter, points: &[Pos2], stroke: Stroke) {
    painter.add(Shape::closed_line(points.to_vec(), stroke));
}

/// A dashed line just inside an outline.
fn dashed(painter: &Painter, points: &[Pos2], ink: Color32) {
    let middle = middle(points);
    let mut path: Vec<Pos2> = points
        .iter()
        .map(|point| {
            let away = *point - middle;
            middle + away * ((away.length() - 4.0) / away.length().max(1.0)).max(0.0)
        })
        .collect();
    path.extend(path.first().copied());
    for dash in Shape::dashed_line(&path, Stroke::new(1.3, ink.gamma_multiply(0.8)), 4.0, 3.5) {
        painter.add(dash);
    }
}

/// Two rings around an outline, one of them readable on any ground, with marks at its corners.
fn chosen(painter: &Painter, ink: &Ink, points: &[Pos2]) {
    let middle = middle(points);
    let grown = |by: f32| -> Vec<Pos2> {
        let out = |point: &Pos2| *point + (*point - middle).normalized() * by;
        points.iter().map(out).collect()
    };
    outline(painter, &grown(2.5), Stroke::new(2.0, ink.accent));
    let bounds = Rect::from_points(&grown(6.0));
    for (corner, along) in [
        (bounds.left_top(), [1.0, 1.0]),
        (bounds.right_top(), [-1.0, 1.0]),
        (bounds.left_bottom(), [1.0, -1.0]),
        (bounds.right_bottom(), [-1.0, -1.0]),
    ] {
        let stroke = Stroke::new(1.5, ink.accent);
        painter.line_segment([corner, corner + Vec2::new(8.0 * along[0], 0.0)], stroke);
        painter.line_segment([corner, corner + Vec2::new(0.0, 8.0 * along[1])], stroke);
    }
}

fn middle(points: &[Pos2]) -> Pos2 {
    Rect::from_points(points).center()
}

/// Slanted lines within a convex outline.
fn hatch(painter: &Painter, points: &[Pos2], ink: Color32) {
    let along = |point: &Pos2| point.x + point.y;
    let low = points.iter().map(along).fold(f32::INFINITY, f32::min);
    let high = points.iter().map(along).fold(f32::NEG_INFINITY, f32::max);
    let mut at = (low / HATCH).ceil() * HATCH;
    while at < high {
        let mut crossings = Vec::with_capacity(2);
        for i in 0..points.len() {
            let (a, b) = (points[i], points[(i + 1) % points.len()]);
            let (from, to) = (along(&a) - at, along(&b) - at);
            if (from < 0.0) != (to < 0.0) {
                crossings.push(a + (b - a) * (from / (from - to)));
            }
        }
        if let [a, b] = crossings[..] {
            painter.line_segment([a, b], Stroke::new(1.2, ink.gamma_multiply(0.85)));
        }
        at += HATCH;
    }
}

/// An object's name within its outline, in the largest letters that fit, on one line or two; and that it is hidden.
fn label(painter: &Painter, points: &[Pos2], title: &str, is_hidden: bool, fill: Color32, on_hatch: bool) {
    let bounds = Rect::from_points(points);
    let room = bounds.size() - Vec2::splat(8.0);
    let ink = Ink::on(fill);
    let wrapped = title.replace(' ', "\n");
    for size in NAME_SIZES {
        let mark = if is_hidden { size + 3.0 } else { 0.0 };
        for text in [title, wrapped.as_str()] {
            let job = egui::text::LayoutJob {
                halign: egui::Align::Center,
                ..egui::text::LayoutJob::simple(text.to_owned(), FontId::proportional(size), ink, f32::INFINITY)
            };
            let galley = painter.layout_job(job);
            if galley.size().x > room.x || galley.size().y + mark > room.y {
                continue;
            }
            let top = bounds.center().y - 0.5 * (galley.size().y + mark);
            let at = Pos2::new(bounds.center().x, top);
            if on_hatch {
                let ground = Rect::from_center_size(at + Vec2::new(0.0, 0.5 * galley.size().y), galley.size());
                painter.rect_filled(ground.expand2(Vec2::new(3.0, 1.0)), 3.0, fill);
            }
            if is_hidden {
                eye_closed(painter, at + Vec2::new(0.0, galley.size().y + 0.5 * mark), ink);
            }
            painter.galley(at, galley, ink);
            return;
        }
    }
    if is_hidden {
        eye_closed(painter, bounds.center(), ink);
    }
}

/// A closed eye: a lid with three lashes.
fn eye_closed(painter: &Painter, at: Pos2, ink: Color32) {
    let stroke = Stroke::new(1.3, ink);
    let lid = |t: f32| at + Vec2::new(6.5 * t, 2.6 * (1.0 - t * t) - 1.6);
    painter.line((-4..=4).map(|i| lid(i as f32 / 4.0)).collect(), stroke);
    for t in [-0.62_f32, 0.0, 0.62] {
        let from = lid(t);
        painter.line_segment([from, from + Vec2::new(2.2 * t, 2.6)], stroke);
    }
}

/// What is wrong with what is held or chosen, beside it.
fn words(painter: &Painter, ink: &Ink, board: &Board, author: &Author) {
    let held = match author.gesture() {
        Some(Gesture::Move { grabbed, .. }) => Some(*grabbed),
        Some(Gesture::Turn { object, .. }) => Some(*object),
        _ => author.only_selected(),
    };
    let Some(at) = held else { return };
    let Some(problem) = author.plan().problems.get(&at).and_then(|words| words.first()) else { return };
    let bounds = Rect::from_points(&board.points(&author.plan().outlines[at]));
    let galley = painter.layout_no_wrap(format!("⚠ {problem}"), FontId::proportional(12.0), Color32::WHITE);
    let size = galley.size() + Vec2::new(12.0, 6.0);
    let mut place = Rect::from_min_size(Pos2::new(bounds.center().x - 0.5 * size.x, bounds.bottom() + 10.0), size);
    let within = painter.clip_rect().shrink(4.0);
    if place.bottom() > within.bottom() {
        place = place.translate(Vec2::new(0.0, bounds.top() - 10.0 - place.bottom()));
    }
    let shift = (within.left() - place.left()).max(0.0) + (within.right() - place.right()).min(0.0);
    let place = place.translate(Vec2::new(shift, 0.0));
    let ground = if ink.is_dark { Color32::from_rgb(150, 24, 32) } else { ink.wrong };
    painter.rect_filled(place, 4.0, ground);
    painter.galley(place.min + Vec2::new(6.0, 3.0), galley, Color32::WHITE);
}

/// The handle that turns an object.
pub(super) fn handle(painter: &Painter, ink: &Ink, from: Pos2, at: Pos2, radius: f32) {
    painter.line_segment([from + (at - from).normalized() * 4.0, at], Stroke::new(1.2, ink.accent.gamma_multiply(0.7)));
    painter.circle(at, radius, ink.board, Stroke::new(2.0, ink.accent));
    // An arrow that runs most of the way around.
    let arc: Vec<Pos2> = (0..=9).map(|i| at + Vec2::angled(0.4 + i as f32 * 0.5) * (radius - 3.6)).collect();
    let tip = arc[arc.len() - 1];
    painter.line(arc, Stroke::new(1.2, ink.accent));
    painter.circle_filled(tip, 1.5, ink.accent);
}

/// The rectangle of a selection.
pub(super) fn band(painter: &Painter, ink: &Ink, rect: Rect) {
    painter.rect(rect, 0.0, ink.accent.gamma_multiply(0.12), Stroke::new(1.0, ink.accent), StrokeKind::Inside);
}

/// Something that does not stand yet.
pub(super) fn ghost(painter: &Painter, ink: &Ink, points: Vec<Pos2>, fill: Color32) {
    painter.add(Shape::convex_polygon(points, fill.gamma_multiply(0.55), Stroke::new(1.5, ink.accent)));
}

/// Numbers at the top right.
pub(super) fn readout(painter: &Painter, ink: &Ink, space: Rect, text: &str) {
    painter.text(
        space.right_top() + Vec2::new(-8.0, 8.0),
        Align2::RIGHT_TOP,
        text,
        FontId::monospace(LEAST_SIZE),
        ink.weak,
    );
}

/// What to do where there is nothing.
pub(super) fn hint(painter: &Painter, ink: &Ink, rect: Rect, title: &str, text: &str) {
    let middle = rect.center();
    painter.text(middle - Vec2::new(0.0, 11.0), Align2::CENTER_CENTER, title, FontId::proportional(17.0), ink.text);
    painter.text(middle + Vec2::new(0.0, 13.0), Align2::CENTER_CENTER, text, FontId::proportional(13.0), ink.weak);
}
