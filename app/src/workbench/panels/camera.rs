//! What the camera saw last: depth and labels of the last look at or before the cursor.

use super::legend::{self, Bar};
use super::textures::Textures;
use super::{NO_EPISODE, Panel, empty, heading};
use crate::colors::{self, Rgb};
use crate::workbench::command::Command;
use crate::workbench::model::Model;
use crate::workbench::session::{Session, SessionId};
use nudge_core::camera::{Frame, UNLABELLED};
use nudge_core::plan::Action;
use nudge_core::scene::{CLASS_COUNT, ClassId};
use re_viewer::external::egui::{
    self, Color32, ColorImage, Pos2, Rect, Sense, Stroke, StrokeKind, TextureFilter, TextureHandle, TextureOptions,
    Tooltip, Ui, WidgetInfo, WidgetType, pos2, vec2,
};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The depth image where the sensor gave nothing.
const NO_DEPTH_RGB: Rgb = [64, 34, 54];
/// Pictures are not sent to the graphics card with more pixels than this along a side.
const LARGEST_PX: usize = 1024;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shown {
    Depth,
    Labels,
}

/// What the panel remembers.
#[derive(Default)]
pub struct State {
    textures: Textures<(SessionId, usize, Shown)>,
    /// The last image, unpacked.
    frame: Option<((SessionId, usize), Arc<Frame>)>,
    /// The classes in the last label image.
    seen: Option<(SessionId, usize, Vec<ClassId>)>,
}

impl Panel for State {
    /// Draws both images, side by side where there is room.
    fn show(&mut self, ui: &mut Ui, model: &mut Model, _ask: &mut Vec<Command>) {
        draw(self, ui, model);
    }
}

fn draw(state: &mut State, ui: &mut Ui, model: &Model) {
    let Some(session) = model.session() else { return empty(ui, NO_EPISODE) };
    let until = model.cursor.min(session.steps());
    let mut moments = session.moments[..=until].iter().rev();
    let found = moments.find_map(|moment| {
        let outcome = moment.outcome.as_ref()?;
        Some((moment.step, outcome.record.action, moment.frame.as_ref()?))
    });
    let unpacked = found.and_then(|(step, action, packed)| {
        let known = state.frame.take().filter(|(of, _)| *of == (session.id, step)).map(|(_, frame)| frame);
        let frame = known.or_else(|| packed.frame().map(Arc::new))?;
        state.frame = Some(((session.id, step), frame.clone()));
        Some((step, action, frame))
    });
    let Some((step, action, frame)) = unpacked else {
        return empty(ui, "No image yet: decide, or choose a view to look from");
    };
    let when =
        if step == until { format!("step {step}") } else { format!("step {step}, the last look before {until}") };
    heading(
        ui,
        match action {
            Action::Look { view } => format!("Camera: view {} at {when}", view.0),
            _ => format!("Camera at {when}"),
        },
        "What the robot's camera saw; the belief was updated with it",
    );
    let gap = 10.0;
    let columns = if ui.available_width() < 300.0 { 1 } else { 2 };
    let width = ((ui.available_width() - gap * (columns - 1) as f32) / columns as f32).floor().max(40.0);
    let range = frame.intrinsics().depth_range_m;
    for shown in [Shown::Depth, Shown::Labels].chunks(columns) {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = gap;
            for &shown in shown {
                ui.vertical(|ui| {
                    ui.set_width(width);
                    one(state, ui, session, step, &frame, shown, range);
                });
            }
        });
    }
}

fn one(state: &mut State, ui: &mut Ui, session: &Session, step: usize, frame: &Frame, shown: Shown, range: [f32; 2]) {
    let labels = frame.labels();
    let options = match shown {
        Shown::Depth => TextureOptions::LINEAR,
        Shown::Labels => TextureOptions { magnification: TextureFilter::Nearest, ..TextureOptions::LINEAR },
    };
    let picture = state.textures.get_with(ui.ctx(), (session.id, step, shown), options, || match shown {
        Shown::Depth => paint(frame, |at| depth_rgb(frame.depth_m()[at], range)),
        Shown::Labels => paint(frame, |at| label_rgb(session, labels[at])),
    });
    let name = match shown {
        Shown::Depth => "Depth image",
        Shown::Labels => "Label image",
    };
    image_widget(ui, &picture, frame.size(), name, |at| match shown {
        Shown::Depth if frame.depth_m()[at] > 0.0 => format!("{:.3} m", frame.depth_m()[at]),
        Shown::Depth => "no reading".to_owned(),
        Shown::Labels => label_name(session, labels[at]),
    });
    match shown {
        Shown::Depth => {
            let ends = range.map(|m| format!("{m:.2}"));
            let hint = "Distance along the optical axis; pixels without a reading are dark red";
            legend::bar(ui, &Bar { name: "depth", ends, unit: "depth, m", hint }, |t| {
                depth_rgb(egui::lerp(range[0]..=range[1], t), range)
            });
        }
        Shown::Labels => {
            let known = state.seen.as_ref().is_some_and(|seen| (seen.0, seen.1) == (session.id, step));
            if !known {
                let labels: BTreeSet<u8> = labels.iter().copied().filter(|label| *label != UNLABELLED).collect();
                state.seen = Some((session.id, step, labels.into_iter().map(ClassId).collect()));
            }
            let catalog = &session.setup.catalog;
            let classes = state.seen.iter().flat_map(|seen| &seen.2);
            let named = |class: &ClassId| (colors::of_class(catalog, *class), colors::class_title(catalog, *class));
            legend::swatches(ui, classes.map(named));
        }
    }
}

/// An image with a read-out of the pixel under the pointer.
fn image_widget(
    ui: &mut Ui,
    picture: &TextureHandle,
    [columns, rows]: [usize; 2],
    name: &str,
    read: impl Fn(usize) -> String,
) {
    let width = ui.available_width();
    let size = vec2(width, width * rows as f32 / columns.max(1) as f32);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Image, true, name));
    if ui.is_rect_visible(rect) {
        let painter = ui.painter();
        painter.image(picture.id(), rect, Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)), Color32::WHITE);
        let edge = Stroke::new(1.0, ui.visuals().weak_text_color().gamma_multiply(0.6));
        painter.rect_stroke(rect, 0.0, edge, StrokeKind::Inside);
    }
    let Some(at) = response.hover_pos() else { return };
    let pixel = |share: f32, pixels: usize| ((share * pixels as f32) as usize).min(pixels.saturating_sub(1));
    let column = pixel((at.x - rect.left()) / rect.width(), columns);
    let row = pixel((at.y - rect.top()) / rect.height(), rows);
    let at = row * columns + column;
    Tooltip::for_widget(&response).at_pointer().gap(12.0).show(|ui| ui.label(read(at)));
}

/// Paints an image pixel by pixel, coarser where it is larger than is sensible.
fn paint(frame: &Frame, rgb: impl Fn(usize) -> Rgb) -> ColorImage {
    let [columns, rows] = frame.size();
    let every = columns.max(rows).div_ceil(LARGEST_PX).max(1);
    let size = [columns.div_ceil(every), rows.div_ceil(every)];
    let pixels = (0..size[1]).flat_map(|row| (0..size[0]).map(move |column| (row * columns + column) * every));
    ColorImage::new(size, pixels.map(|at| legend::ink(rgb(at))).collect())
}

/// Near is light, far is dark.
fn depth_rgb(depth_m: f32, [near, far]: [f32; 2]) -> Rgb {
    if depth_m > 0.0 {
        let t = ((depth_m - near) / (far - near).max(1e-6)).clamp(0.0, 1.0);
        // Most of a shelf is within half of the range: the root spreads it.
        [(245.0 - 225.0 * t.sqrt()) as u8; 3]
    } else {
        NO_DEPTH_RGB
    }
}

fn label_rgb(session: &Session, label: u8) -> Rgb {
    let known = usize::from(label) < CLASS_COUNT;
    if known { colors::of_class(&session.setup.catalog, ClassId(label)) } else { colors::UNKNOWN_RGB }
}

fn label_name(session: &Session, label: u8) -> String {
    let known = usize::from(label) < CLASS_COUNT;
    if known { colors::class_title(&session.setup.catalog, ClassId(label)) } else { "no label".to_owned() }
}
