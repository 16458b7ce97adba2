//! Scores and calibration of belief updates against the number of views, and reliability diagrams.

use super::plot::nice_ticks;
use super::svg::{Anchor, HAIRLINE, INK, SOFT_INK, Stroke, Svg, Text};
use crate::colors::Rgb;
use nudge_core::score::{BIN_COUNT, Reliability, ReliabilityBin, Scores, Tally};

/// What the figure shows of one belief update.
pub struct Calibrated<'a> {
    /// Its name.
    pub name: &'a str,
    /// Counts after each number of views, from the axis' first on.
    pub tallies: &'a [Tally],
}

/// The numbers of views that a figure goes over.
pub struct Views {
    /// What they are, as the axes' name.
    pub name: &'static str,
    /// The first number.
    pub first: usize,
    /// Those that have a reliability diagram.
    pub shown: [usize; 3],
}

/// Views of an unseen scene, from the uniform belief on.
pub const VIEWS: Views = Views { name: "views", first: 1, shown: [1, 3, 10] };
/// Views of what a push left; before the first there is the prediction of the push.
pub const VIEWS_AFTER_PUSH: Views = Views { name: "views after the push", first: 0, shown: [0, 1, 4] };

/// Colours of the updates, in their order.
const COLORS: [Rgb; 4] = [[27, 94, 166], [214, 96, 20], [90, 90, 100], [94, 60, 120]];
/// Size of the page and of its panels.
const SIZE: [f32; 2] = [1060.0, 736.0];
const PANEL: [f32; 2] = [250.0, 220.0];

/// A score that has a panel: its title, and how it is read.
type Measure = (&'static str, fn(&Scores) -> f64);

const MEASURES: [Measure; 4] = [
    ("occupancy IoU", |s| s.occupancy_iou),
    ("semantic mIoU", |s| s.semantic_miou),
    ("mECE of occupancy", |s| s.mece_occupancy),
    ("mECE of semantics", |s| s.mece_semantics),
];

/// Draws the figure; `title` says what data it is of.
pub fn calibration(title: &str, over: &Views, updates: &[Calibrated<'_>]) -> Svg {
    let mut svg = Svg::new(SIZE);
    svg.text(&Text::new(title, [24.0, 30.0], 17.0));
    let mut x = 24.0;
    for (update, rgb) in updates.iter().zip(COLORS) {
        svg.line([x, 50.0], [x + 22.0, 50.0], Stroke::new(rgb, 2.4));
        svg.text(&Text::new(update.name, [x + 28.0, 54.0], 12.0));
        x += 60.0 + super::text_width(update.name, 12.0);
    }
    for (at, measure) in MEASURES.iter().enumerate() {
        against_views(&mut svg, [24.0 + at as f32 * 258.0, 78.0], measure, over, updates);
    }
    svg.text(&Text::new(
        "Reliability: share that is right against confidence, mean over the true classes",
        [24.0, 334.0],
        14.0,
    ));
    let there = |views: usize| updates.iter().all(|update| update.tallies.len() > views - over.first);
    let shown: Vec<usize> = over.shown.into_iter().filter(|views| there(*views)).collect();
    for (row, what) in ["occupancy", "semantics"].into_iter().enumerate() {
        for (column, &views) in shown.iter().enumerate() {
            let corner = [24.0 + 346.0 * column as f32, 352.0 + 196.0 * row as f32];
            let counts = updates.iter().map(|update| {
                let tally = &update.tallies[views - over.first];
                if row == 0 { &tally.occupancy_reliability } else { &tally.semantics_reliability }
            });
            let name = if views == 1 { over.name.replacen("views", "view", 1) } else { over.name.to_owned() };
            reliability(&mut svg, corner, &format!("{what}, {views} {name}"), &counts.collect::<Vec<_>>());
        }
    }
    svg
}

/// Axes with numbers: the rectangle inside (left, top, width, height).
fn axes(svg: &mut Svg, [left, top]: [f32; 2], [width, height]: [f32; 2], title: &str, x_name: &str) -> [f32; 4] {
    let inner = [left + 30.0, top + 22.0, width - 48.0, height - 60.0];
    svg.text(&Text::new(title, [left, top + 10.0], 12.5));
    svg.line([inner[0], inner[1] + inner[3]], [inner[0] + inner[2], inner[1] + inner[3]], Stroke::new(SOFT_INK, 0.9));
    let at = [inner[0] + 0.5 * inner[2], inner[1] + inner[3] + 30.0];
    svg.text(&Text::new(x_name, at, 10.5).anchored(Anchor::Middle).colored(SOFT_INK));
    inner
}

fn against_views(svg: &mut Svg, corner: [f32; 2], measure: &Measure, over: &Views, updates: &[Calibrated<'_>]) {
    let inner = axes(svg, corner, PANEL, measure.0, over.name);
    let values: Vec<Vec<f64>> =
        updates.iter().map(|update| update.tallies.iter().map(|tally| measure.1(&tally.scores())).collect()).collect();
    let largest = values.iter().flatten().copied().fold(0.0, f64::max);
    let top = if measure.0.contains("IoU") { 1.0 } else { (largest * 11.0).ceil() / 10.0 };
    let count = updates.iter().map(|update| update.tallies.len()).max().unwrap_or(1).max(2);
    let x = |at: usize| inner[0] + inner[2] * at as f32 / (count - 1) as f32;
    let y = |value: f64| inner[1] + inner[3] * (1.0 - (value / top.max(1e-9)) as f32);
    for (value, label) in nice_ticks([0.0, top], 4) {
        svg.line([inner[0], y(value)], [inner[0] + inner[2], y(value)], Stroke::new(HAIRLINE, 0.8));
        svg.text(&Text::new(label, [inner[0] - 5.0, y(value) + 3.6], 10.0).anchored(Anchor::End).colored(SOFT_INK));
    }
    for view in (0..count).filter(|at| count < 7 || at % 2 == 0 || at + 1 == count) {
        let at = [x(view), inner[1] + inner[3] + 14.0];
        svg.text(&Text::new((over.first + view).to_string(), at, 10.0).anchored(Anchor::Middle).colored(SOFT_INK));
    }
    for (values, rgb) in values.iter().zip(COLORS) {
        let points: Vec<[f32; 2]> = values.iter().enumerate().map(|(at, value)| [x(at), y(*value)]).collect();
        svg.polyline(&points, Stroke::new(rgb, 2.0));
        if let (Some(last), Some(value)) = (points.last(), values.last()) {
            svg.text(&Text::new(format!("{value:.2}"), [last[0] + 4.0, last[1] + 4.0], 11.0).colored(rgb));
        }
    }
}

/// A bin over all true classes, each class with the same weight.
fn balanced(reliability: &Reliability, bin: usize) -> Option<[f64; 2]> {
    let of = |bins: &[ReliabilityBin; BIN_COUNT]| {
        let cells: u64 = bins.iter().map(|bin| bin.count).sum();
        let b = bins[bin];
        (cells > 0).then(|| [b.count as f64, b.correct as f64, b.confidence].map(|n| n / cells as f64))
    };
    let sums =
        reliability.bins.iter().filter_map(of).fold([0.0; 3], |sum, class| std::array::from_fn(|i| sum[i] + class[i]));
    (sums[0] > 1e-4).then(|| [sums[2] / sums[0], sums[1] / sums[0]])
}

fn reliability(svg: &mut Svg, corner: [f32; 2], title: &str, updates: &[&Reliability]) {
    let inner = axes(svg, corner, [330.0, 190.0], title, "confidence");
    let x = |value: f64| inner[0] + inner[2] * value as f32;
    let y = |value: f64| inner[1] + inner[3] * (1.0 - value as f32);
    for value in [0.0, 0.5, 1.0] {
        svg.line([x(0.0), y(value)], [x(1.0), y(value)], Stroke::new(HAIRLINE, 0.8));
        svg.text(
            &Text::new(format!("{value}"), [x(0.0) - 5.0, y(value) + 3.6], 10.0)
                .anchored(Anchor::End)
                .colored(SOFT_INK),
        );
        let at = [x(value), inner[1] + inner[3] + 14.0];
        svg.text(&Text::new(format!("{value}"), at, 10.0).anchored(Anchor::Middle).colored(SOFT_INK));
    }
    svg.line([x(0.0), y(0.0)], [x(1.0), y(1.0)], Stroke::new(INK, 0.8).dashed(2.0, 3.0));
    for (reliability, rgb) in updates.iter().zip(COLORS) {
        let points: Vec<[f32; 2]> =
            (0..BIN_COUNT).filter_map(|bin| balanced(reliability, bin)).map(|[c, a]| [x(c), y(a)]).collect();
        svg.polyline(&points, Stroke::new(rgb, 1.8));
        points.iter().for_each(|point| svg.dot(*point, 3.0, rgb));
    }
}
