//! The tour of the window: five stops, each at a real part of it, shown once to whoever is new and again from the help menu.

use re_viewer::external::egui::{
    self, Align2, Area, Button, Color32, Context, Frame, Id, Key, Order, Rect, RichText, Stroke, StrokeKind, pos2, vec2,
};

/// A part of the window that a stop is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spot {
    /// The three-dimensional views.
    Space,
    /// The panel at the right.
    Right,
    /// The buttons that decide and act.
    Doing,
    /// The time bar.
    Clock,
    /// The tabs of the layouts.
    Layouts,
}

/// Notes where a part of the window is drawn in this frame.
pub fn mark(ctx: &Context, spot: Spot, place: Rect) {
    ctx.data_mut(|data| data.insert_temp(spot.id(), place));
}

/// Where a part of the window was drawn last.
pub fn marked(ctx: &Context, spot: Spot) -> Option<Rect> {
    ctx.data(|data| data.get_temp(spot.id()))
}

impl Spot {
    fn id(self) -> Id {
        Id::new(("tour", self as usize))
    }
}

/// A stop.
struct Stop {
    spot: Spot,
    title: &'static str,
    words: &'static str,
}

const STOPS: [Stop; 5] = [
    Stop {
        spot: Spot::Space,
        title: "The belief",
        words: "What the robot holds to be in the shelf, after the looks so far. A voxel is drawn where it is probably occupied; white \
                outlines are the true objects. Drag to turn, scroll to zoom, click a voxel to ask about it.",
    },
    Stop {
        spot: Spot::Right,
        title: "The decision",
        words: "What the planner weighed at this step: what the best looks promise, what the best push promises, in nats of \
                uncertainty, and why one of them won. Below it you can write a note, and see which objects were found.",
    },
    Stop {
        spot: Spot::Doing,
        title: "Step by step",
        words: "Decide shows what the planner would do next and does nothing. Do it carries it out. Run goes on to the end of the \
                budget.",
    },
    Stop {
        spot: Spot::Clock,
        title: "The clock",
        words: "Every picture, map and curve shows the step that is marked here. Click a step, or use the arrow keys. Branch from here \
                begins another episode that shares the steps so far.",
    },
    Stop {
        spot: Spot::Layouts,
        title: "Other questions",
        words: "Why: what a voxel is believed to be, and which looks made it so. Gains: what each view would show. Push: what a push \
                would do. Compare: two episodes on one clock. Author: a scene of your own.",
    },
];

/// What a person does at a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Move {
    /// To this stop.
    To(usize),
    /// To the end, reached or skipped.
    End,
}

/// Width of the words, points.
const WIDTH: f32 = 330.0;

/// Draws the stop at a position of the tour; `place` tells where a part of the window was drawn, if it is there.
pub fn show(ctx: &Context, at: usize, place: impl Fn(Spot) -> Option<Rect>) -> Option<Move> {
    let Some(stop) = STOPS.get(at) else { return Some(Move::End) };
    let screen = ctx.content_rect();
    let target = place(stop.spot).unwrap_or(Rect::NOTHING).intersect(screen);
    let accent = ctx.global_style().visuals.selection.bg_fill;
    let painter = ctx.layer_painter(egui::LayerId::new(Order::Middle, Id::new("tour shade")));
    if target.is_positive() {
        for part in around(screen, target) {
            painter.rect_filled(part, 0.0, Color32::from_black_alpha(120));
        }
        painter.rect_stroke(target.shrink(1.0), 4.0, Stroke::new(2.0, accent), StrokeKind::Inside);
    } else {
        painter.rect_filled(screen, 0.0, Color32::from_black_alpha(120));
    }
    let (anchor, pivot) = beside(screen, target);
    let mut moved = None;
    Area::new(Id::new("tour")).order(Order::Foreground).fixed_pos(anchor).pivot(pivot).constrain(true).show(
        ctx,
        |ui| {
            Frame::popup(ui.style()).inner_margin(14.0).show(ui, |ui| {
                ui.set_width(WIDTH);
                ui.horizontal(|ui| {
                    ui.label(RichText::new(stop.title).heading().strong());
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        ui.weak(format!("{} of {}", at + 1, STOPS.len()));
                    });
                });
                ui.add_space(4.0);
                ui.label(stop.words);
                ui.add_space(8.0);
                ui.horizontal(|ui| {
                    let is_last = at + 1 == STOPS.len();
                    let next = Button::new(if is_last { "Done" } else { "Next" }).fill(accent);
                    if ui.add(next).on_hover_text("To the next stop of the tour (Enter)").clicked() {
                        moved = Some(if is_last { Move::End } else { Move::To(at + 1) });
                    }
                    if at > 0 && ui.button("Back").on_hover_text("To the stop before").clicked() {
                        moved = Some(Move::To(at - 1));
                    }
                    if !is_last
                        && ui.button("Skip the tour").on_hover_text("Help > Tour shows it again (Esc)").clicked()
                    {
                        moved = Some(Move::End);
                    }
                });
            });
        },
    );
    let key = |key| ctx.input_mut(|input| input.consume_key(egui::Modifiers::NONE, key));
    if key(Key::Escape) {
        moved = Some(Move::End);
    } else if key(Key::Enter) {
        moved = Some(if at + 1 == STOPS.len() { Move::End } else { Move::To(at + 1) });
    }
    moved
}

/// What of the screen is not the target: above, below, left and right of it.
fn around(screen: Rect, target: Rect) -> [Rect; 4] {
    [
        Rect::from_min_max(screen.min, pos2(screen.right(), target.top())),
        Rect::from_min_max(pos2(screen.left(), target.bottom()), screen.max),
        Rect::from_min_max(pos2(screen.left(), target.top()), pos2(target.left(), target.bottom())),
        Rect::from_min_max(pos2(target.right(), target.top()), pos2(screen.right(), target.bottom())),
    ]
}

/// Where the words stand, and by which corner: beside the target where there is room, else at its foot within it.
fn beside(screen: Rect, target: Rect) -> (egui::Pos2, Align2) {
    const GAP: f32 = 12.0;
    let room = WIDTH + 2.0 * GAP + 30.0;
    let y = target.center().y;
    if !target.is_positive() {
        (screen.center(), Align2::CENTER_CENTER)
    } else if screen.right() - target.right() >= room {
        (pos2(target.right() + GAP, y), Align2::LEFT_CENTER)
    } else if target.left() - screen.left() >= room {
        (pos2(target.left() - GAP, y), Align2::RIGHT_CENTER)
    } else if target.top() > screen.center().y {
        (target.center_top() - vec2(0.0, GAP), Align2::CENTER_BOTTOM)
    } else if target.bottom() < screen.center().y {
        (target.right_bottom() + vec2(0.0, GAP), Align2::RIGHT_TOP)
    } else {
        (target.center_bottom() - vec2(0.0, GAP), Align2::CENTER_BOTTOM)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    struct Stage {
        at: Option<usize>,
    }

    fn harness(at: usize) -> Harness<'static, Stage> {
        let draw = |ui: &mut egui::Ui, stage: &mut Stage| {
            let place = |_| Some(Rect::from_min_size(pos2(10.0, 10.0), vec2(200.0, 100.0)));
            if let Some(at) = stage.at {
                match show(ui.ctx(), at, place) {
                    Some(Move::To(at)) => stage.at = Some(at),
                    Some(Move::End) => stage.at = None,
                    None => (),
                }
            }
        };
        let mut harness = Harness::builder().with_size([900.0, 600.0]).build_ui_state(draw, Stage { at: Some(at) });
        harness.run_steps(2);
        harness
    }

    #[test]
    fn the_tour_goes_through_its_stops_and_ends_where_it_is_skipped() {
        let mut tour = harness(0);
        for stop in &STOPS {
            assert!(tour.query_by_label(stop.title).is_some(), "{}", stop.title);
            tour.key_press(Key::Enter);
            tour.run_steps(2);
        }
        assert_eq!(tour.state().at, None);
        let mut tour = harness(1);
        tour.get_by_label("Back").click();
        tour.run_steps(2);
        assert_eq!(tour.state().at, Some(0));
        tour.get_by_label("Skip the tour").click();
        tour.run_steps(2);
        assert_eq!(tour.state().at, None);
    }

    #[test]
    fn the_words_of_a_stop_never_cover_a_small_target() {
        let screen = Rect::from_min_size(pos2(0.0, 0.0), vec2(1280.0, 800.0));
        let targets = [
            Rect::from_min_size(pos2(240.0, 30.0), vec2(500.0, 500.0)),
            Rect::from_min_size(pos2(1000.0, 30.0), vec2(280.0, 700.0)),
            Rect::from_min_size(pos2(0.0, 780.0), vec2(1280.0, 20.0)),
            Rect::from_min_size(pos2(980.0, 0.0), vec2(300.0, 20.0)),
        ];
        for target in targets {
            let (anchor, pivot) = beside(screen, target);
            let words = pivot.anchor_size(anchor, vec2(WIDTH + 30.0, 160.0));
            assert!(!words.intersects(target), "{words:?} {target:?}");
        }
    }
}
