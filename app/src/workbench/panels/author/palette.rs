//! The classes: a click adds one where there is room, a drag puts it where it is let go.

use super::common::{Carried, colour};
use crate::colors;
use crate::workbench::author::Author;
use re_viewer::external::egui::{self, Align2, Sense, TextStyle, WidgetInfo, WidgetType};

const ROW_HEIGHT: f32 = 34.0;
const SWATCH: f32 = 16.0;

/// Draws the list; returns the class that is being carried to the board.
pub(super) fn show(ui: &mut egui::Ui, author: &mut Author) -> Option<Carried> {
    ui.add_space(6.0);
    ui.strong("Add an object");
    ui.weak("Click, or drag onto the board");
    ui.add_space(4.0);
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| rows(ui, author)).inner
}

fn rows(ui: &mut egui::Ui, author: &mut Author) -> Option<Carried> {
    let mut carried = None;
    let mut clicked = None;
    ui.spacing_mut().item_spacing.y = 1.0;
    let catalog = author.catalog().clone();
    for class in &catalog.classes {
        let title = colors::class_title(&catalog, class.id);
        let size = class.solid.bounds().size() * 1000.0;
        let (rect, response) =
            ui.allocate_exact_size(egui::vec2(ui.available_width(), ROW_HEIGHT), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Button, true, format!("Add {title}")));
        if ui.is_rect_visible(rect) {
            let visuals = *ui.style().interact(&response);
            let painter = ui.painter();
            if response.hovered() || response.has_focus() || response.dragged() {
                painter.rect_filled(rect, 4.0, visuals.weak_bg_fill);
            }
            if response.has_focus() {
                painter.rect_stroke(rect, 4.0, ui.visuals().selection.stroke, egui::StrokeKind::Inside);
            }
            let swatch = egui::Rect::from_center_size(
                egui::pos2(rect.left() + 8.0 + 0.5 * SWATCH, rect.center().y),
                egui::Vec2::splat(SWATCH),
            );
            let rounding = if class.shape.is_round() { 0.5 * SWATCH } else { 3.0 };
            painter.rect_filled(swatch, rounding, colour(class.color));
            painter.rect_stroke(swatch, rounding, ui.visuals().window_stroke(), egui::StrokeKind::Outside);
            let left = swatch.right() + 9.0;
            let line = |dy: f32, text: String, style: TextStyle, ink: egui::Color32| {
                let at = egui::pos2(left, rect.center().y + dy);
                painter.text(at, Align2::LEFT_CENTER, text, style.resolve(ui.style()), ink);
            };
            line(-7.5, title.clone(), TextStyle::Body, ui.visuals().text_color());
            let millimetres = format!("{:.0} × {:.0} × {:.0} mm", size.x, size.y, size.z);
            line(7.5, millimetres, TextStyle::Small, ui.visuals().weak_text_color());
        }
        if response.dragged() || response.drag_stopped() {
            ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
            if let Some(at) = ui.input(|input| input.pointer.latest_pos()) {
                carried = Some(Carried { class: class.id, at, is_let_go: response.drag_stopped() });
            }
        }
        if response.clicked() {
            clicked = Some(class.name.clone());
        }
        response.on_hover_text(format!(
            "{title}: width, depth and height {:.0} × {:.0} × {:.0} mm, {:.0} g",
            size.x,
            size.y,
            size.z,
            1000.0 * class.mass_kg
        ));
    }
    if let Some(class) = clicked {
        author.add(&class);
    }
    carried
}
