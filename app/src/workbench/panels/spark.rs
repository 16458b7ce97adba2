//! Small drawings: a value over the steps, and bars.

use super::legend;
use re_viewer::external::egui::{
    self, Align2, Color32, Response, Sense, Shape, Stroke, StrokeKind, Ui, WidgetInfo, WidgetType, pos2, vec2,
};

/// A value over the steps of an episode.
pub struct Spark<'a> {
    /// What it is, as it is written beside the line.
    pub name: &'a str,
    /// The values, by number of actions.
    pub values: &'a [f32],
    /// From the bottom to the top of the drawing.
    pub range: [f32; 2],
    /// The step at the cursor.
    pub cursor: usize,
    /// The line's colour.
    pub colour: Color32,
    /// A value as it is written.
    pub write: &'a dyn Fn(f32) -> String,
}

impl Spark<'_> {
    /// Draws it as wide as there is room; gives the step that was clicked.
    pub fn show(&self, ui: &mut Ui, height: f32) -> Option<usize> {
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click());
        let last = self.values.len().saturating_sub(1);
        let now = self.values.get(self.cursor.min(last)).copied().unwrap_or(f32::NAN);
        response.widget_info(|| {
            let label =
                format!("{} over the steps, {} at step {}", self.name, (self.write)(now), self.cursor.min(last));
            WidgetInfo::labeled(WidgetType::Image, true, label)
        });
        let font = legend::small(ui);
        let (text, weak) = (ui.visuals().text_color(), ui.visuals().weak_text_color());
        let plot = egui::Rect::from_min_max(pos2(rect.left() + 70.0, rect.top() + 3.0), rect.max - vec2(88.0, 3.0));
        let [low, high] = self.range;
        let x = |step: usize| egui::lerp(plot.x_range(), if last > 0 { step as f32 / last as f32 } else { 0.5 });
        let y = |value: f32| {
            let t = if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 };
            egui::lerp(plot.bottom()..=plot.top(), if t.is_finite() { t } else { 0.0 })
        };
        let over = response.hover_pos().map(|at| {
            let t = ((at.x - plot.left()) / plot.width().max(1.0)).clamp(0.0, 1.0);
            (t * last as f32).round() as usize
        });
        if ui.is_rect_visible(rect) {
            let painter = ui.painter_at(rect);
            painter.text(rect.left_center(), Align2::LEFT_CENTER, self.name, font.clone(), text);
            painter.text(rect.right_center(), Align2::RIGHT_CENTER, (self.write)(now), font, text);
            painter.rect_filled(plot.expand(3.0), 2.0, ui.visuals().extreme_bg_color);
            let cursor = Stroke::new(1.0, ui.visuals().strong_text_color().gamma_multiply(0.6));
            painter.vline(x(self.cursor.min(last)), plot.expand(3.0).y_range(), cursor);
            let points: Vec<_> = self.values.iter().enumerate().map(|(step, value)| pos2(x(step), y(*value))).collect();
            for point in &points {
                painter.circle_filled(*point, 1.5, self.colour);
            }
            painter.add(Shape::line(points, Stroke::new(1.5, self.colour)));
            if let Some(at) = self.values.get(self.cursor.min(last)) {
                painter.circle(pos2(x(self.cursor.min(last)), y(*at)), 3.5, self.colour, Stroke::new(1.0, text));
            }
            if let Some(step) = over {
                painter.vline(x(step), plot.y_range(), Stroke::new(1.0, weak));
            }
        }
        if let Some(step) = over {
            let value = self.values.get(step).copied().unwrap_or(f32::NAN);
            let text = format!("step {step}: {}", (self.write)(value));
            egui::Tooltip::for_widget(&response).at_pointer().gap(12.0).show(|ui| ui.label(text));
        }
        over.filter(|_| response.clicked())
    }
}

/// One of several bars below each other.
pub struct Bar {
    /// What stands before it.
    pub name: String,
    /// Its length, 0 to 1.
    pub share: f32,
    /// What stands behind it.
    pub value: String,
    /// Its colour.
    pub colour: Color32,
    /// Whether it is set off: bold.
    pub strong: bool,
}

/// A bar with its name in front and its value behind, `names` points for the names and `values` for the values.
pub fn bar(ui: &mut Ui, bar: &Bar, names: f32, values: f32) -> Response {
    let font = legend::small(ui);
    let height = ui.text_style_height(&egui::TextStyle::Small) + 2.0;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Label, true, format!("{}: {}", bar.name, bar.value)));
    if ui.is_rect_visible(rect) {
        let painter = ui.painter_at(rect);
        let ink = if bar.strong { ui.visuals().strong_text_color() } else { ui.visuals().text_color() };
        painter.text(rect.left_center(), Align2::LEFT_CENTER, &bar.name, font.clone(), ink);
        let track = egui::Rect::from_min_max(
            pos2(rect.left() + names, rect.top() + 2.0),
            pos2(rect.right() - values, rect.bottom() - 2.0),
        );
        painter.rect_filled(track, 2.0, ui.visuals().extreme_bg_color);
        let share = if bar.share.is_finite() { bar.share.clamp(0.0, 1.0) } else { 0.0 };
        if share > 0.0 {
            let filled = track.with_max_x((track.left() + share * track.width()).max(track.left() + 1.5));
            let edge = Stroke::new(1.0, ui.visuals().weak_text_color().gamma_multiply(0.5));
            painter.rect(filled, 2.0, bar.colour, edge, StrokeKind::Inside);
        }
        painter.text(rect.right_center(), Align2::RIGHT_CENTER, &bar.value, font, ink);
    }
    response
}
