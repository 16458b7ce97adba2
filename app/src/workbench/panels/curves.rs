//! The scores over the steps, with the pushes and the cursor; of two episodes when they are compared.

use super::legend;
use super::{NO_EPISODE, compare, empty, words};
use crate::record::decision::{SERIES, Series};
use crate::workbench::command::Command;
use crate::workbench::model::{LayoutKind, Model};
use crate::workbench::session::Session;
use egui_plot::{AxisHints, GridMark, Line, LineStyle, MarkerShape, Plot, PlotPoint, Points, VLine};
use nudge_core::plan::Action;
use re_viewer::external::egui::{
    Color32, CursorIcon, Label, Rangef, RichText, Sense, Stroke, Ui, WidgetInfo, WidgetType, vec2,
};

/// The scores between 0 and 1 that are drawn.
const SHARES: [&str; 3] = ["occupancy_iou", "occupied_iou", "semantic_miou"];
const ENTROPY: &str = "entropy_nats";

/// Draws the curves: shares and entropy side by side, or below each other where there is little room; entropy alone where
/// nothing is scored.
pub fn show(ui: &mut Ui, model: &mut Model, ask: &mut Vec<Command>) {
    let Some(session) = model.session() else { return empty(ui, NO_EPISODE) };
    let other = model.other_session().filter(|_| model.kept.layout == LayoutKind::Compare);
    let asked = ask.len();
    let curves = Curves { session, other, cursor: model.cursor };
    let shares: Vec<&Series> =
        SHARES.iter().filter_map(|key| SERIES.iter().find(|series| series.key == *key)).collect();
    let entropy: Vec<&Series> = SERIES.iter().filter(|series| series.key == ENTROPY).collect();
    let gap = 12.0;
    ui.set_min_height(ui.available_height());
    // Measured from the panel's own edge: what is drawn must never be taller than the panel, or the panel would grow with
    // every frame.
    let (top, bottom) = (ui.cursor().top(), ui.max_rect().bottom());
    if !curves.is_scored() {
        curves.plot(ui, "Entropy", &entropy, curves.entropy_range(), bottom, ask);
    } else if ui.available_width() >= 560.0 {
        let left = (0.6 * (ui.available_width() - gap)).floor();
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = gap;
            ui.vertical(|ui| {
                ui.set_width(left);
                curves.plot(ui, "Scores", &shares, [0.0, 1.0], bottom, ask);
            });
            ui.vertical(|ui| {
                ui.set_width(ui.available_width());
                curves.plot(ui, "Entropy", &entropy, curves.entropy_range(), bottom, ask);
            });
        });
    } else {
        curves.plot(ui, "Scores", &shares, [0.0, 1.0], 0.5 * (top + bottom), ask);
        curves.plot(ui, "Entropy", &entropy, curves.entropy_range(), bottom, ask);
    }
    // A drag that stays within a step asks for nothing new.
    let cursor = model.cursor;
    let mut at = 0;
    ask.retain(|command| {
        at += 1;
        at <= asked || !matches!(command, Command::GoTo(step) if *step == cursor)
    });
}

struct Curves<'a> {
    session: &'a Session,
    other: Option<&'a Session>,
    cursor: usize,
}

impl Curves<'_> {
    /// Whether the truth is known of one of the episodes.
    fn is_scored(&self) -> bool {
        std::iter::once(self.session).chain(self.other).any(|session| session.record.has_truth())
    }

    /// From 0 to a little above the largest entropy.
    fn entropy_range(&self) -> [f64; 2] {
        let sessions = std::iter::once(self.session).chain(self.other);
        let largest = sessions
            .flat_map(|session| &session.moments)
            .map(|moment| moment.entropy_nats)
            .filter(|nats| nats.is_finite())
            .fold(0.0, f64::max);
        [0.0, if largest > 0.0 { 1.08 * largest } else { 1.0 }]
    }

    /// The number of actions that the longer episode may take.
    fn budget(&self) -> usize {
        let sessions = std::iter::once(self.session).chain(self.other);
        sessions.map(|session| session.record.config.budget.max(session.steps())).max().unwrap_or(1).max(1)
    }

    /// A plot with its legend above, down to the height `bottom` on the screen.
    fn plot(&self, ui: &mut Ui, name: &str, series: &[&Series], range: [f64; 2], bottom: f32, ask: &mut Vec<Command>) {
        self.legend(ui, series);
        let height = (bottom - ui.cursor().top() - ui.spacing().item_spacing.y - 1.0).max(60.0);
        let (budget, last) = (self.budget(), self.session.steps());
        let margin = 0.025 * budget as f64;
        let font = legend::small(ui);
        let axis = |hints: AxisHints<'static>| {
            hints.label("").tick_label_font(font.clone()).tick_label_color(ui.visuals().text_color())
        };
        let x_axis = axis(AxisHints::new_x())
            .label_spacing(Rangef::new(12.0, 16.0))
            .formatter(|mark, _| if mark.value < -0.5 { String::new() } else { format!("{:.0}", mark.value) });
        let y_axis = axis(AxisHints::new_y())
            .label_spacing(Rangef::new(14.0, 22.0))
            .min_thickness(34.0)
            .formatter(move |mark, _| tick(mark.value, range[1]));
        let every = (budget as f32 * 26.0 / ui.available_width().max(60.0)).ceil().max(1.0) as usize;
        let ink = ui.visuals().strong_text_color();
        let lines = self.lines(ui, series);
        let differs = self.other.and_then(|other| compare::first_difference(self.session, other));
        let (cursor, pushes) = (self.cursor.min(last), self.pushes(range));
        let push_ink = ui.visuals().text_color();
        let response = Plot::new(name)
            .height(height)
            .custom_x_axes(vec![x_axis])
            .custom_y_axes(vec![y_axis])
            .x_grid_spacer(move |input| steps(input.bounds, every))
            .y_grid_spacer(move |_| marks(range))
            .allow_zoom(false)
            .allow_drag(false)
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_axis_zoom_drag(false)
            .allow_double_click_reset(false)
            .cursor_color(Color32::TRANSPARENT)
            .sense(Sense::click_and_drag())
            .label_formatter(|at| match at {
                egui_plot::HoverPosition::NearDataPoint { plot_name, position, .. } if !plot_name.is_empty() => {
                    Some(format!("{plot_name}\nstep {:.0}: {}", position.x, words::significant(position.y, 3)))
                }
                _ => None,
            })
            .show(ui, move |plot| {
                plot.set_plot_bounds_x(-margin..=budget as f64 + margin);
                plot.set_plot_bounds_y(range[0]..=range[1]);
                plot.vline(VLine::new("", cursor as f64).stroke(Stroke::new(1.5, ink)).allow_hover(false));
                if let Some(step) = differs {
                    let line = VLine::new("", step as f64).stroke(Stroke::new(1.0, ink));
                    plot.vline(line.style(LineStyle::dotted_dense()).allow_hover(false));
                }
                for line in lines {
                    plot.line(line);
                }
                let marks = Points::new("push", pushes).shape(MarkerShape::Up).radius(5.0).color(push_ink);
                plot.points(marks.allow_hover(false));
                plot.pointer_coordinate()
            });
        let pointer: Option<PlotPoint> = response.inner;
        let response = response.response.on_hover_cursor(CursorIcon::PointingHand);
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Image, true, format!("{name} over the steps")));
        let moved = response.clicked() || response.dragged();
        if let Some(at) = pointer.filter(|_| moved) {
            ask.push(Command::GoTo(at.x.round().clamp(0.0, last as f64) as usize));
        }
    }

    /// What the lines are, with their values at the cursor.
    fn legend(&self, ui: &mut Ui, series: &[&Series]) {
        let at = |session: &Session, series: &Series| {
            let value = session.moment(self.cursor).score(series);
            value.map_or_else(|| "n/a".to_owned(), |value| words::significant(value, 3))
        };
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing = vec2(12.0, 1.0);
            for series in series {
                let value = match self.other {
                    None => at(self.session, series),
                    Some(other) => format!("A {} B {}", at(self.session, series), at(other, series)),
                };
                legend::line(ui, series.rgb, series.title, &value).on_hover_text(series.hint);
            }
            let mut remark = |words: &str| {
                ui.add(Label::new(RichText::new(words).small().weak()).extend());
            };
            if self.other.is_some() && series.len() > 1 {
                remark("A solid, B dashed, dotted: first difference");
            } else if !self.pushes([0.0, 1.0]).is_empty() {
                remark("triangle: push");
            }
        });
    }

    fn lines(&self, ui: &Ui, series: &[&Series]) -> Vec<Line<'static>> {
        let mut lines = Vec::new();
        let sessions = [(Some(self.session), LineStyle::Solid), (self.other, LineStyle::dashed_dense())];
        for (session, style) in sessions.into_iter().filter_map(|(session, style)| Some((session?, style))) {
            for series in series {
                let values: Vec<[f64; 2]> = session
                    .moments
                    .iter()
                    .filter_map(|moment| Some([moment.step as f64, moment.score(series)?]))
                    .filter(|point| point[1].is_finite())
                    .collect();
                let name = match (self.other, style) {
                    (None, _) => series.title.to_owned(),
                    (Some(_), LineStyle::Solid) => format!("A: {}", series.title),
                    (Some(_), _) => format!("B: {}", series.title),
                };
                let ink = legend::line_ink(ui, series.rgb);
                lines.push(Line::new(name, values).stroke(Stroke::new(2.0, ink)).style(style));
            }
        }
        lines
    }

    /// Where the pushes are marked: at the foot of the plot.
    fn pushes(&self, [low, high]: [f64; 2]) -> Vec<[f64; 2]> {
        let y = low + 0.04 * (high - low);
        let steps = self.session.record.steps.iter();
        steps.filter(|step| matches!(step.action, Action::Manipulate(_))).map(|step| [step.index as f64, y]).collect()
    }
}

/// A number on an axis: shares with one decimal, thousands of nats with a k.
fn tick(value: f64, largest: f64) -> String {
    match largest {
        l if l <= 2.0 => format!("{value:.1}"),
        l if l >= 5_000.0 => format!("{:.0}k", value / 1e3),
        _ => format!("{value:.0}"),
    }
}

/// About five marks from 0 up, at round numbers.
fn marks([_, high]: [f64; 2]) -> Vec<GridMark> {
    let rough = high / 5.0;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step_size = [1.0, 2.0, 5.0, 10.0].map(|n| n * power).into_iter().find(|step| *step >= 0.999 * rough);
    let step_size = step_size.unwrap_or(high);
    (0..=(high / step_size + 1e-6) as usize).map(|n| GridMark { value: n as f64 * step_size, step_size }).collect()
}

/// Marks at whole steps.
fn steps((low, high): (f64, f64), every: usize) -> Vec<GridMark> {
    let first = (low.max(0.0) / every as f64).ceil() as usize;
    let last = (high.max(0.0) / every as f64).floor() as usize;
    (first..=last).map(|n| GridMark { value: (n * every) as f64, step_size: every as f64 }).collect()
}
