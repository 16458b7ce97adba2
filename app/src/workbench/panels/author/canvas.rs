//! The board from above: the front edge, the robot's side, is at the bottom.

mod board;
mod draw;

use super::common::{Carried, choice, colour};
use crate::workbench::author::{Author, Choose, Gesture, Snap, name};
use board::{Board, is_hidden};
use draw::Ink;
use nudge_core::scene::outline;
use re_viewer::external::egui::{self, CursorIcon, Pos2, Rect, Sense, Vec2, WidgetInfo, WidgetType};

/// From an object's outline to the middle of its handle, points.
const HANDLE_AWAY: f32 = 24.0;
const HANDLE_RADIUS: f32 = 7.0;
/// Arrow keys move what is chosen, not the focus.
const ARROWS: egui::EventFilter =
    egui::EventFilter { tab: false, horizontal_arrows: true, vertical_arrows: true, escape: true };

/// Draws the board in what is left of `ui`, and carries out what the pointer does there. Returns whether the keyboard's
/// focus is on the board.
pub(super) fn show(ui: &mut egui::Ui, author: &mut Author, carried: Option<Carried>) -> bool {
    let (space, canvas) = ui.allocate_exact_size(ui.available_size().max(Vec2::splat(80.0)), Sense::click_and_drag());
    let board = Board::fitting(&author.scene().shelf, space);
    canvas.widget_info(|| WidgetInfo::labeled(WidgetType::Other, true, "Board from above"));
    let has_focus = objects_for_keyboard(ui, author, &board) || canvas.has_focus();
    if let Some(focus) = ui.memory(|memory| memory.focused()).filter(|_| has_focus) {
        ui.memory_mut(|memory| memory.set_focus_lock_filter(focus, ARROWS));
    }
    pointer(ui, author, &board, &canvas);
    drop_class(author, &board, carried, space);

    let ink = Ink::of(ui.visuals());
    let painter = ui.painter().with_clip_rect(space);
    draw::ground(&painter, &ink, &board, &author.scene().shelf);
    let hovered = canvas.hover_pos().and_then(|at| author.plan().at(board.board(at), |_| false));
    draw::objects(&painter, &ink, &board, author, hovered);
    if let Some((at, handle)) = handle(author, &board) {
        draw::handle(&painter, &ink, board.screen(author.scene().objects[at].position), handle, HANDLE_RADIUS);
    }
    if let Some(Gesture::Band { from, to, .. }) = author.gesture() {
        draw::band(&painter, &ink, Rect::from_two_pos(board.screen(*from), board.screen(*to)));
    }
    ghost(&painter, &ink, author, &board, carried, space);
    readout(&painter, &ink, author, &board, canvas.hover_pos(), space);
    if author.scene().objects.is_empty() && carried.is_none() {
        draw::hint(
            &painter,
            &ink,
            board.rect,
            "An empty shelf",
            "Add a class from the left, drag one here, or generate objects",
        );
    }
    tooltip(canvas, author, hovered);
    has_focus
}

/// Every object as something that the keyboard and a screen reader can reach; choosing it is what focus does. Returns
/// whether one has the focus.
fn objects_for_keyboard(ui: &egui::Ui, author: &mut Author, board: &Board) -> bool {
    let mut any = false;
    for at in 0..author.scene().objects.len() {
        let outline = board.points(&author.plan().outlines[at]);
        let rect = Rect::from_points(&outline);
        if !rect.is_finite() {
            continue;
        }
        let id = ui.id().with(("author object", at));
        let response = ui.interact(rect, id, Sense::focusable_noninteractive());
        let label = describe(author, at);
        let chosen = author.selection().contains(&at);
        response.widget_info(|| WidgetInfo::selected(WidgetType::SelectableLabel, true, chosen, label.as_str()));
        any |= response.has_focus();
        if response.gained_focus() {
            author.choose(at, Choose::Only);
        }
    }
    any
}

/// An object in words: `tomato_can#3, hidden, overlaps gum_tin#2 by 3.0 mm`.
fn describe(author: &Author, at: usize) -> String {
    let mut words = name(author.scene(), at);
    if is_hidden(author, at) {
        words += ", hidden";
    }
    for problem in author.plan().problems.get(&at).into_iter().flatten() {
        words += ", ";
        words += problem;
    }
    words
}

/// The handle that turns the one chosen object.
fn handle(author: &Author, board: &Board) -> Option<(usize, Pos2)> {
    let at = author.only_selected()?;
    let object = &author.scene().objects[at];
    let reach = author.plan().outlines[at]
        .iter()
        .map(|[x, y]| (x - object.position[0]).hypot(y - object.position[1]))
        .fold(0.0, f32::max);
    let (sin, cos) = (object.yaw_deg + 90.0).to_radians().sin_cos();
    let away = reach * board.scale + HANDLE_AWAY;
    Some((at, board.screen(object.position) + Vec2::new(cos, -sin) * away))
}

fn pointer(ui: &egui::Ui, author: &mut Author, board: &Board, canvas: &egui::Response) {
    let modifiers = ui.input(|input| input.modifiers);
    let on_handle = |author: &Author, pos: Pos2| {
        handle(author, board).filter(|(_, handle)| handle.distance(pos) <= HANDLE_RADIUS + 5.0).map(|(at, _)| at)
    };
    let snap = if modifiers.alt { Snap::Off } else { author.snap };
    if canvas.drag_started_by(egui::PointerButton::Primary) {
        canvas.request_focus();
        // Where the button went down, not where the pointer is after the first movement.
        if let Some(from) = ui.input(|input| input.pointer.press_origin()) {
            match on_handle(author, from) {
                Some(at) => author.take_handle(at, board.board(from)),
                None => author.take_hold(board.board(from), choice(modifiers)),
            }
        }
    }
    if canvas.dragged()
        && author.gesture().is_some()
        && let Some(to) = canvas.interact_pointer_pos()
    {
        author.drag_to(board.board(to), snap);
    }
    if canvas.drag_stopped() {
        author.end_gesture();
    }
    if canvas.clicked()
        && let Some(at) = canvas.interact_pointer_pos()
    {
        canvas.request_focus();
        match author.plan().at(board.board(at), |_| false) {
            Some(object) => author.choose(object, choice(modifiers)),
            None if choice(modifiers) == Choose::Only => author.choose_none(),
            None => {}
        }
    }
    let cursor = match (author.gesture(), canvas.hover_pos()) {
        (Some(Gesture::Move { .. } | Gesture::Turn { .. }), _) => CursorIcon::Grabbing,
        (Some(Gesture::Band { .. }), _) => CursorIcon::Crosshair,
        (None, Some(at)) if on_handle(author, at).is_some() => CursorIcon::Grab,
        (None, Some(at)) if author.plan().at(board.board(at), |_| false).is_some() => CursorIcon::Move,
        _ => return,
    };
    ui.ctx().set_cursor_icon(cursor);
}

fn drop_class(author: &mut Author, board: &Board, carried: Option<Carried>, space: Rect) {
    if let Some(Carried { class, at, is_let_go: true }) = carried
        && space.contains(at)
    {
        let class = author.catalog().class(class).name.clone();
        author.add_at(&class, board.board(at));
    }
}

/// The class that is carried, where it would come to stand.
fn ghost(painter: &egui::Painter, ink: &Ink, author: &Author, board: &Board, carried: Option<Carried>, space: Rect) {
    let Some(Carried { class, at, is_let_go: false }) = carried else { return };
    let class = author.catalog().class(class);
    let position = board.board(at);
    let position = if space.contains(at) { position.map(|v| author.snap.position(v)) } else { position };
    let points = board.points(&outline::placed(&class.footprint, position, 0.0));
    // Also over the palette, from where it is carried.
    let painter = painter.with_clip_rect(painter.ctx().content_rect());
    draw::ghost(&painter, ink, points, colour(class.color));
}

/// What the pointer is at, in numbers.
fn readout(painter: &egui::Painter, ink: &Ink, author: &Author, board: &Board, hover: Option<Pos2>, space: Rect) {
    let text = match author.gesture() {
        Some(Gesture::Move { grabbed: at, .. }) | Some(Gesture::Turn { object: at, .. }) => {
            let Some(object) = author.scene().objects.get(*at) else { return };
            let [x, y] = object.position.map(|v| 1000.0 * v);
            format!("{}   x {x:.1} mm   y {y:.1} mm   {:.1}°", name(author.scene(), *at), object.yaw_deg)
        }
        _ => {
            let Some(at) = hover.filter(|at| board.rect.contains(*at)) else { return };
            let [x, y] = board.board(at).map(|v| 1000.0 * v);
            format!("x {x:.0} mm   y {y:.0} mm")
        }
    };
    draw::readout(painter, ink, space, &text);
}

fn tooltip(canvas: egui::Response, author: &Author, hovered: Option<usize>) {
    let Some(at) = hovered.filter(|_| author.gesture().is_none()) else { return };
    canvas.on_hover_ui_at_pointer(|ui| {
        ui.strong(name(author.scene(), at));
        if is_hidden(author, at) {
            ui.label("Hidden: none of the 300 views shows it");
        }
        for problem in author.plan().problems.get(&at).into_iter().flatten() {
            ui.colored_label(ui.visuals().error_fg_color, format!("⚠ {problem}"));
        }
    });
}
