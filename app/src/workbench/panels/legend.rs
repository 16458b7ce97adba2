//! Legends: colour bars with numbers and units, and swatches with names.

use crate::colors::Rgb;
use re_viewer::external::egui::{
    self, Align2, Color32, FontId, Mesh, Response, Sense, Shape, Stroke, StrokeKind, TextStyle, Ui, WidgetInfo,
    WidgetType, pos2, vec2,
};

/// A colour for egui.
pub fn ink([r, g, b]: Rgb) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// A colour for thin lines and text, darker on light ground so that it can be seen.
pub fn line_ink(ui: &Ui, rgb: Rgb) -> Color32 {
    if ui.visuals().dark_mode { ink(rgb) } else { ink(crate::colors::mix(rgb, [0, 0, 0], 0.35)) }
}

/// The font of legends and axes.
pub fn small(ui: &Ui) -> FontId {
    TextStyle::Small.resolve(ui.style())
}

/// A colour bar's texts.
pub struct Bar<'a> {
    /// What the scale is of, for screen readers.
    pub name: &'a str,
    /// The numbers at its ends.
    pub ends: [String; 2],
    /// The unit, written in the middle.
    pub unit: &'a str,
    /// What the scale means, with formula and range.
    pub hint: &'a str,
}

/// A colour bar as wide as there is room: colours from 0 to 1, numbers below.
pub fn bar(ui: &mut Ui, texts: &Bar<'_>, colour: impl Fn(f32) -> Rgb) -> Response {
    const STRIP: f32 = 7.0;
    const STEPS: usize = 48;
    let font = small(ui);
    let line = ui.text_style_height(&TextStyle::Small);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), STRIP + 2.0 + line), Sense::hover());
    response.widget_info(|| {
        let [low, high] = &texts.ends;
        let label = format!("Colour scale of {}: {low} to {high} {}", texts.name, texts.unit);
        WidgetInfo::labeled(WidgetType::Image, true, label)
    });
    if ui.is_rect_visible(rect) {
        let strip = rect.with_max_y(rect.top() + STRIP);
        let mut mesh = Mesh::default();
        for step in 0..=STEPS {
            let t = step as f32 / STEPS as f32;
            let x = egui::lerp(strip.x_range(), t);
            let colour = ink(colour(t));
            mesh.colored_vertex(pos2(x, strip.top()), colour);
            mesh.colored_vertex(pos2(x, strip.bottom()), colour);
            if step > 0 {
                let at = 2 * step as u32;
                mesh.add_triangle(at - 2, at - 1, at);
                mesh.add_triangle(at - 1, at, at + 1);
            }
        }
        let painter = ui.painter();
        painter.add(Shape::mesh(mesh));
        let edge = Stroke::new(1.0, ui.visuals().weak_text_color().gamma_multiply(0.5));
        painter.rect_stroke(strip, 0.0, edge, StrokeKind::Inside);
        let (text, weak) = (ui.visuals().text_color(), ui.visuals().weak_text_color());
        let y = strip.bottom() + 2.0;
        painter.text(pos2(rect.left(), y), Align2::LEFT_TOP, &texts.ends[0], font.clone(), text);
        painter.text(pos2(rect.center().x, y), Align2::CENTER_TOP, texts.unit, font.clone(), weak);
        painter.text(pos2(rect.right(), y), Align2::RIGHT_TOP, &texts.ends[1], font, text);
    }
    if texts.hint.is_empty() { response } else { response.on_hover_text(texts.hint) }
}

/// Colours with their names, in as many lines as they need.
pub fn swatches(ui: &mut Ui, entries: impl IntoIterator<Item = (Rgb, String)>) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 2.0);
        for (rgb, name) in entries {
            swatch(ui, rgb, &name);
        }
    });
}

/// A line of one colour with its name and its value: one piece, which no line break parts.
pub fn line(ui: &mut Ui, rgb: Rgb, name: &str, value: &str) -> Response {
    let [sample, gap] = [14.0, 5.0];
    let (text, ink) = (ui.visuals().text_color(), line_ink(ui, rgb));
    let strong = ui.visuals().strong_text_color();
    let name_drawn = ui.painter().layout_no_wrap(name.to_owned(), small(ui), text);
    let value_drawn = ui.painter().layout_no_wrap(value.to_owned(), small(ui), strong);
    let (name_px, value_px) = (name_drawn.size(), value_drawn.size());
    let size = vec2(sample + gap + name_px.x + gap + value_px.x, name_px.y.max(value_px.y));
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Label, true, format!("{name} {value}")));
    if ui.is_rect_visible(rect) {
        let y = rect.center().y;
        ui.painter().hline(rect.left()..=rect.left() + sample, y, Stroke::new(2.0, ink));
        let at = rect.left() + sample + gap;
        ui.painter().galley(pos2(at, y - 0.5 * name_px.y), name_drawn, text);
        ui.painter().galley(pos2(at + name_px.x + gap, y - 0.5 * value_px.y), value_drawn, strong);
    }
    response
}

/// One colour with its name.
pub fn swatch(ui: &mut Ui, rgb: Rgb, name: &str) -> Response {
    const SIDE: f32 = 9.0;
    let galley = ui.painter().layout_no_wrap(name.to_owned(), small(ui), ui.visuals().text_color());
    let size = vec2(SIDE + 4.0 + galley.size().x, galley.size().y.max(SIDE));
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Label, true, name));
    if ui.is_rect_visible(rect) {
        let square = egui::Rect::from_center_size(pos2(rect.left() + 0.5 * SIDE, rect.center().y), vec2(SIDE, SIDE));
        let edge = Stroke::new(1.0, ui.visuals().weak_text_color().gamma_multiply(0.6));
        ui.painter().rect(square, 2.0, ink(rgb), edge, StrokeKind::Inside);
        let at = pos2(rect.left() + SIDE + 4.0, rect.center().y - 0.5 * galley.size().y);
        ui.painter().galley(at, galley, ui.visuals().text_color());
    }
    response
}
