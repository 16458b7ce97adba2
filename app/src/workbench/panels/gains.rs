//! The gain of every view: one heat map per look-at target, and where the chosen view's gain comes from.

use super::facts::{self, fact};
use super::legend::{self, Bar};
use super::{NO_EPISODE, Panel, Touched, decision, empty, heading, spark, weighed, words};
use crate::colors::Colormap;
use crate::workbench::command::Command;
use crate::workbench::model::{GainSource, Hovered, Model};
use crate::workbench::session::{Session, SessionId};
use nudge_core::camera::{View, ViewArray, ViewId};
use nudge_core::grid::Grid;
use nudge_core::plan::{Counted, Decision};
use re_viewer::external::egui::{
    self, Align2, Color32, Painter, Rect, RichText, Sense, Stroke, StrokeKind, Tooltip, Ui, WidgetInfo, WidgetType,
    pos2, vec2,
};
use std::collections::BTreeSet;

/// Into how many ranges of height and of depth a view's gain is parted.
const PARTS: usize = 8;

/// What the panel remembers.
#[derive(Default)]
pub struct State {
    hovering: bool,
    spread: Option<Spread>,
}

/// How a view's gain spreads over the shelf.
struct Spread {
    of: (SessionId, usize, ViewId),
    by_height: [f32; PARTS],
    by_depth: [f32; PARTS],
    total: f32,
}

impl Panel for State {
    /// Draws the heat maps and the chosen view's numbers.
    fn show(&mut self, ui: &mut Ui, model: &mut Model, ask: &mut Vec<Command>) {
        let touched = draw(self, ui, model, ask);
        if let Some(view) = touched.view {
            ask.push(Command::GainOf(view));
        }
        touched.apply(model, &mut self.hovering);
    }
}

fn draw(state: &mut State, ui: &mut Ui, model: &Model, ask: &mut Vec<Command>) -> Touched {
    let mut touched = Touched::default();
    let Some(session) = model.session() else {
        empty(ui, NO_EPISODE);
        return touched;
    };
    let Some(decision) = session.decision_after(model.cursor) else {
        decision::nothing(ui, session, "the gain of every view", ask);
        return touched;
    };
    if decision.gains.iter().all(|gain| !gain.is_finite()) {
        empty(ui, "This policy weighs no views");
        return touched;
    }
    let map = HeatMap::new(session, decision, model);
    egui::ScrollArea::vertical().id_salt("gains").auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        let step = model.cursor.min(session.steps()) + 1;
        heading(ui, format!("Gain of every view before step {step}"), decision.counted().of_a_view());
        map.show(ui, &mut touched);
        ui.add_space(6.0);
        let Some(view) = model.view.and_then(|view| session.setup.views.view(view)) else {
            ui.weak("Click a view to see where its gain comes from");
            return;
        };
        map.numbers(ui, view);
        spread(state, ui, model, session, view.id);
    });
    touched
}

struct HeatMap<'a> {
    views: &'a ViewArray,
    decision: &'a Decision,
    used: BTreeSet<ViewId>,
    selected: Option<ViewId>,
    hovered: Option<ViewId>,
    range: [f32; 2],
}

impl<'a> HeatMap<'a> {
    fn new(session: &'a Session, decision: &'a Decision, model: &Model) -> Self {
        let gains = decision.gains.iter().copied().filter(|gain| gain.is_finite());
        let range = gains.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], gain| [low.min(gain), high.max(gain)]);
        let hovered = match model.hovered {
            Hovered::View(view) => Some(view),
            _ => None,
        };
        Self {
            views: &session.setup.views,
            decision,
            used: weighed::used_views(&session.record, model.cursor),
            selected: model.view,
            hovered,
            range,
        }
    }

    fn gain(&self, view: ViewId) -> f32 {
        self.decision.gains.get(usize::from(view.0)).copied().unwrap_or(f32::NAN)
    }

    /// The maps of all targets, side by side where there is room, with one scale.
    fn show(&self, ui: &mut Ui, touched: &mut Touched) {
        let [across, up, targets] = self.views.layout;
        let gap = 12.0;
        let room = ui.available_width();
        let columns = targets.min(((room + gap) / (130.0 + gap)).floor().max(1.0) as usize).max(1);
        let side = ((room - gap * (columns - 1) as f32) / columns as f32 / across.max(1) as f32).clamp(3.0, 34.0);
        let all: Vec<usize> = (0..targets).collect();
        for row in all.chunks(columns) {
            ui.horizontal_top(|ui| {
                ui.spacing_mut().item_spacing.x = gap;
                for target in row {
                    ui.vertical(|ui| {
                        ui.set_width(side * across as f32);
                        self.one(ui, *target as u16, vec2(side * across as f32, side * up as f32), side, touched);
                    });
                }
            });
        }
        ui.add_space(4.0);
        ui.scope(|ui| {
            ui.set_max_width(room.min(420.0));
            let ends = self.range.map(|nats| words::significant(f64::from(nats), 3));
            let hint = "One scale for all targets, from the smallest to the largest gain of this step";
            legend::bar(ui, &Bar { name: "gain", ends, unit: "nats", hint }, |t| Colormap::Cividis.rgb(t));
        });
        ui.label(
            RichText::new("framed 1 and 2: best pair; hatched: used since the last push; as seen from the robot")
                .small()
                .weak(),
        );
    }

    fn one(&self, ui: &mut Ui, target: u16, size: egui::Vec2, side: f32, touched: &mut Touched) {
        let views: Vec<&View> = self.views.views.iter().filter(|view| view.slot[2] == target).collect();
        let title = views.first().map_or("no views".to_owned(), |view| {
            let [x, y, z] = view.target.map(words::metres);
            format!("at {x}, {y}, {z} m")
        });
        ui.label(RichText::new(title).small())
            .on_hover_text("The look-at target: x to the right, y into the shelf, z up");
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        response.widget_info(|| {
            WidgetInfo::labeled(WidgetType::Image, true, format!("Gain of the views at target {}", target + 1))
        });
        let cell = |view: &View| {
            let at = pos2(
                rect.left() + f32::from(view.slot[0]) * side,
                // The lowest camera positions at the bottom.
                rect.bottom() - f32::from(view.slot[1] + 1) * side,
            );
            Rect::from_min_size(at, vec2(side, side))
        };
        let over = response.hover_pos().and_then(|at| views.iter().find(|view| cell(view).contains(at)));
        if ui.is_rect_visible(rect) {
            let painter = ui.painter_at(rect.expand(3.0));
            painter.rect_filled(rect, 0.0, ui.visuals().extreme_bg_color);
            for view in &views {
                let gain = self.gain(view.id);
                let square = cell(view).shrink(0.5);
                if gain.is_finite() {
                    painter.rect_filled(square, 0.0, legend::ink(Colormap::Cividis.of(gain, self.range)));
                }
                if self.used.contains(&view.id) {
                    hatch(&painter, square);
                }
            }
            for (rank, id) in self.decision.pair.iter().enumerate() {
                if let Some(view) = views.iter().find(|view| view.id == *id) {
                    framed(&painter, cell(view), &(rank + 1).to_string(), ui);
                }
            }
            let ring = |view: &View, width: f32| {
                let square = cell(view).expand(1.0);
                painter.rect_stroke(square, 1.0, Stroke::new(width + 1.5, Color32::BLACK), StrokeKind::Outside);
                painter.rect_stroke(square, 1.0, Stroke::new(width, Color32::WHITE), StrokeKind::Outside);
            };
            views.iter().filter(|view| self.selected == Some(view.id)).for_each(|view| ring(view, 2.0));
            let pointed = over.map(|view| view.id).or(self.hovered);
            views.iter().filter(|view| pointed == Some(view.id)).for_each(|view| ring(view, 1.0));
        }
        if let Some([right, up]) = super::arrow_keys(ui, &response) {
            let slot = views
                .iter()
                .find(|view| self.selected == Some(view.id))
                .map_or([0, 0], |view| [i64::from(view.slot[0]), i64::from(view.slot[1])]);
            let wanted = [slot[0] + i64::from(right), slot[1] + i64::from(up)];
            let beside = |view: &&&View| [i64::from(view.slot[0]), i64::from(view.slot[1])] == wanted;
            touched.view = views.iter().find(beside).map(|view| view.id);
        } else if response.clicked() && over.is_none() {
            touched.view = views.first().map(|view| view.id);
        }
        if let Some(view) = over {
            touched.over = Some(Hovered::View(view.id));
            let text = format!("View {}: {}{}", view.id.0, words::nats(self.gain(view.id)), self.note(view.id));
            Tooltip::for_widget(&response).at_pointer().gap(12.0).show(|ui| ui.label(text));
            if response.clicked() {
                touched.view = Some(view.id);
            }
        }
    }

    fn note(&self, view: ViewId) -> String {
        let pair = match self.decision.pair.iter().position(|other| *other == view) {
            Some(0) => "\nfirst of the best pair",
            Some(_) => "\nsecond of the best pair",
            None => "",
        };
        let used = if self.used.contains(&view) { "\nused since the last push" } else { "" };
        format!("{pair}{used}")
    }

    /// Position, target and gain of the chosen view.
    fn numbers(&self, ui: &mut Ui, view: &View) {
        let (gain, best) = (self.gain(view.id), weighed::best_gain(self.decision));
        let place = |at: [f32; 3]| {
            format!("x {}, y {}, z {} m", words::metres(at[0]), words::metres(at[1]), words::metres(at[2]))
        };
        heading(ui, format!("View {}", view.id.0), "The view that was clicked");
        let at = view.position();
        let used = if self.used.contains(&view.id) { "since the last push" } else { "not since the last push" };
        let facts = [
            fact("gain", words::nats(gain), "Gain of this view alone, under the belief before the step"),
            fact("of the best", words::percent(gain / best), "Share of the best view's gain"),
            fact("camera at", place([at.x, at.y, at.z]), "x to the right, y into the shelf, z up"),
            fact("looks at", place(view.target), "The look-at target"),
            fact("used", used, "A view is not looked from twice until a push has moved something"),
        ];
        facts::show(ui, "view numbers", 1, &facts);
    }
}

/// Where the view's gain comes from, by height and by depth.
fn spread(state: &mut State, ui: &mut Ui, model: &Model, session: &Session, view: ViewId) {
    let step = model.cursor.min(session.steps());
    let key = (session.id, step, view);
    let answered = |source: &&GainSource| (source.of.0, source.of.1, source.view) == key;
    if let Some(source) = model.gain_source.as_ref().filter(answered) {
        let grid = session.moment(step).belief.grid();
        if state.spread.as_ref().is_none_or(|spread| spread.of != key) {
            state.spread = Some(Spread::of(source, grid));
        }
    }
    let Some(spread) = state.spread.as_ref().filter(|spread| spread.of == key) else {
        let known = session.moment(step).is_whole;
        ui.weak(if known {
            "Click the view to ask where its gain comes from"
        } else {
            "Where its gain comes from is known once the episode's log is checked"
        });
        return;
    };
    let [_, depth_m, height_m] = session.moment(step).belief.grid().size_m();
    ui.add_space(4.0);
    ui.horizontal_top(|ui| {
        let width = 0.5 * (ui.available_width() - 12.0);
        let parts = [
            ("By height", height_m, &spread.by_height, "Nats by height above the board, summed over voxels"),
            ("By depth", depth_m, &spread.by_depth, "Nats by distance from the front edge, summed over voxels"),
        ];
        for (title, size_m, nats, hint) in parts {
            ui.vertical(|ui| {
                ui.set_width(width);
                heading(ui, title, hint);
                let largest = nats.iter().copied().fold(1e-6, f32::max);
                // The highest, and the farthest, on top.
                for part in (0..PARTS).rev() {
                    let edge = |part: usize| size_m * part as f32 / PARTS as f32;
                    let bar = spark::Bar {
                        name: format!("{:.2}–{:.2} m", edge(part), edge(part + 1)),
                        share: nats[part] / largest,
                        value: words::significant(f64::from(nats[part]), 3),
                        colour: legend::ink(Colormap::Cividis.rgb(nats[part] / largest)),
                        strong: false,
                    };
                    spark::bar(ui, &bar, 84.0, 40.0);
                }
            });
        }
    });
    let counted = match session.record.config.planner.counted {
        Counted::All => "all voxels",
        Counted::Unseen => "all unseen voxels",
    };
    ui.label(RichText::new(format!("{} from {counted} together", words::nats(spread.total))).small().weak());
}

impl Spread {
    fn of(source: &GainSource, grid: &Grid) -> Self {
        let mut spread = Self {
            of: (source.of.0, source.of.1, source.view),
            by_height: [0.0; PARTS],
            by_depth: [0.0; PARTS],
            total: 0.0,
        };
        let part = |at: u16, of: usize| (usize::from(at) * PARTS / of.max(1)).min(PARTS - 1);
        for &(voxel, nats) in source.nats.iter().filter(|(voxel, nats)| *voxel < grid.voxel_count() && nats.is_finite())
        {
            let at = grid.voxel(voxel);
            spread.by_height[part(at.z, grid.dims[2])] += nats;
            spread.by_depth[part(at.y, grid.dims[1])] += nats;
            spread.total += nats;
        }
        spread
    }
}

/// Two diagonal strokes: used.
fn hatch(painter: &Painter, square: Rect) {
    let lines = [
        [square.left_bottom(), square.right_top()],
        [square.left_center(), square.center_top()],
        [square.center_bottom(), square.right_center()],
    ];
    for line in lines {
        painter.line_segment(line, Stroke::new(2.4, Color32::from_black_alpha(150)));
        painter.line_segment(line, Stroke::new(1.0, Color32::WHITE));
    }
}

/// A frame with a number: one of the best pair.
fn framed(painter: &Painter, square: Rect, rank: &str, ui: &Ui) {
    let orange = Color32::from_rgb(230, 97, 1);
    painter.rect_stroke(square, 1.0, Stroke::new(3.5, Color32::BLACK), StrokeKind::Middle);
    painter.rect_stroke(square, 1.0, Stroke::new(2.0, orange), StrokeKind::Middle);
    if square.width() >= 9.0 {
        let font = legend::small(ui);
        for offset in [vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0)] {
            painter.text(square.center() + offset, Align2::CENTER_CENTER, rank, font.clone(), Color32::WHITE);
        }
        painter.text(square.center(), Align2::CENTER_CENTER, rank, font, Color32::BLACK);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::grid::Voxel;

    #[test]
    fn a_gain_is_parted_by_height_and_depth() {
        let grid = Grid::for_shelf([0.8, 0.4, 0.4], 0.01);
        let at = |y: u16, z: u16| grid.index(Voxel { x: 3, y, z });
        let nats =
            vec![(at(0, 39), 1.0), (at(39, 0), 2.0), (at(39, 5), 4.0), (grid.voxel_count(), 9.0), (at(1, 1), f32::NAN)];
        let source = GainSource::new((SessionId(0), 1), ViewId(3), nats);
        let spread = Spread::of(&source, &grid);
        assert_eq!((spread.by_height[0], spread.by_height[1], spread.by_height[7]), (2.0, 4.0, 1.0));
        assert_eq!((spread.by_depth[0], spread.by_depth[7], spread.total), (1.0, 6.0, 7.0));
    }
}
