//! Curves over the steps of an episode.

use super::svg::{Anchor, HAIRLINE, INK, SOFT_INK, Stroke, Svg, Text};
use crate::colors::Rgb;

/// One curve: a value per step, drawn from step 0 on.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Its name, written where it ends; empty for none.
    pub name: String,
    /// Its colour.
    pub rgb: Rgb,
    /// Lengths of dash and gap; zeros for a full line.
    pub dash: [f32; 2],
    /// Values by step.
    pub values: Vec<f64>,
}

/// Axes with curves over steps.
#[derive(Clone, Debug)]
pub struct Plot {
    /// What the vertical axis shows, with its unit.
    pub title: String,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Smallest and largest value of the vertical axis.
    pub range: [f64; 2],
    /// The last step of the horizontal axis.
    pub steps: usize,
    /// Steps that were pushes.
    pub pushes: Vec<usize>,
    /// Steps whose maps the figure shows.
    pub marked: Vec<usize>,
}

/// Room left of the axes for their numbers, and right of them for the curves' ends.
const LEFT: f32 = 30.0;
const RIGHT: f32 = 62.0;
const TOP: f32 = 24.0;
const BOTTOM: f32 = 30.0;
/// Least distance of the baselines of two labels.
const LABEL_PITCH: f32 = 24.0;

impl Plot {
    /// Draws the plot into a rectangle of the page.
    pub fn draw(&self, svg: &mut Svg, [left, top]: [f32; 2], [width, height]: [f32; 2]) {
        let axes = [left + LEFT, top + TOP, width - LEFT - RIGHT, height - TOP - BOTTOM];
        let x = |step: usize| axes[0] + axes[2] * step as f32 / self.steps.max(1) as f32;
        let span = (self.range[1] - self.range[0]).max(f64::MIN_POSITIVE);
        let y = |value: f64| {
            let share = ((value - self.range[0]) / span).clamp(0.0, 1.0) as f32;
            axes[1] + axes[3] * (1.0 - share)
        };
        svg.text(&Text::new(&self.title, [left, top + 10.0], 13.0));
        for (value, label) in nice_ticks(self.range, 4) {
            svg.line([axes[0], y(value)], [axes[0] + axes[2], y(value)], Stroke::new(HAIRLINE, 0.8));
            let text = Text::new(label, [axes[0] - 6.0, y(value) + 3.6], 10.5);
            svg.text(&text.anchored(Anchor::End).colored(SOFT_INK));
        }
        for &step in &self.pushes {
            let line = Stroke::new(SOFT_INK, 0.9).dashed(2.0, 3.0);
            svg.line([x(step), axes[1] - 1.0], [x(step), axes[1] + axes[3]], line);
            push_mark(svg, [x(step), axes[1] - 6.0]);
        }
        svg.line([axes[0], axes[1] + axes[3]], [axes[0] + axes[2], axes[1] + axes[3]], Stroke::new(SOFT_INK, 0.9));
        for (step, label) in counting_ticks([0.0, self.steps.max(1) as f64], 6) {
            let at = [x(step as usize), axes[1] + axes[3] + 14.0];
            svg.text(&Text::new(label, at, 10.5).anchored(Anchor::Middle).colored(SOFT_INK));
        }
        let at = [axes[0] + 0.5 * axes[2], axes[1] + axes[3] + 27.0];
        svg.text(&Text::new("step", at, 10.5).anchored(Anchor::Middle).colored(SOFT_INK));
        for curve in &self.curves {
            let points: Vec<[f32; 2]> = curve.values.iter().enumerate().map(|(step, v)| [x(step), y(*v)]).collect();
            let [dash, gap] = curve.dash;
            svg.polyline(&points, Stroke::new(curve.rgb, 2.0).dashed(dash, gap));
            for &step in self.marked.iter().filter(|&&step| step < points.len() && dash == 0.0) {
                svg.dot(points[step], 3.4, curve.rgb);
            }
        }
        self.name_ends(svg, axes, y);
    }

    /// Writes each curve's last value and name beside its end, apart from each other.
    fn name_ends(&self, svg: &mut Svg, axes: [f32; 4], y: impl Fn(f64) -> f32) {
        let mut ends: Vec<(f32, f64, &Curve)> =
            self.curves.iter().filter_map(|c| c.values.last().map(|&v| (y(v), v, c))).collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        for at in 1..ends.len() {
            ends[at].0 = ends[at].0.max(ends[at - 1].0 + LABEL_PITCH);
        }
        // Back up where the lowest one has left the axes.
        let mut floor = axes[1] + axes[3] + 2.0;
        for end in ends.iter_mut().rev() {
            end.0 = end.0.min(floor);
            floor = end.0 - LABEL_PITCH;
        }
        for (at, value, curve) in ends {
            let x = axes[0] + axes[2] + 8.0;
            let digits = if self.range[1] > 10.0 { 0 } else { 2 };
            svg.text(&Text::new(format!("{value:.digits$}"), [x, at + 3.0], 12.0).colored(curve.rgb));
            if !curve.name.is_empty() {
                svg.text(&Text::new(&curve.name, [x, at + 13.0], 9.5).colored(SOFT_INK));
            }
        }
    }
}

/// The sign of a push: a small triangle, its tip down at `at` plus five.
pub fn push_mark(svg: &mut Svg, [x, y]: [f32; 2]) {
    svg.polygon(&[[x - 4.2, y - 2.6], [x + 4.2, y - 2.6], [x, y + 4.6]], INK);
}

/// Round numbers in a range, about `count` of them, each with its label.
pub fn nice_ticks(range: [f64; 2], count: usize) -> Vec<(f64, String)> {
    ticks(range, count, &[1.0, 2.0, 2.5, 5.0, 10.0])
}

/// The same for what is counted: whole numbers only.
pub fn counting_ticks([low, high]: [f64; 2], count: usize) -> Vec<(f64, String)> {
    let count = count.min((high - low).ceil().max(1.0) as usize);
    ticks([low, high], count, &[1.0, 2.0, 5.0, 10.0])
}

/// Multiples of one of `steps`, or of its tenths, tens and so on.
fn ticks([low, high]: [f64; 2], count: usize, steps: &[f64]) -> Vec<(f64, String)> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return vec![(low, format!("{low}"))];
    }
    let rough = span / count as f64;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = steps.iter().map(|k| k * power).find(|s| *s >= rough * 0.999).unwrap_or(rough);
    let digits =
        (0..6).find(|d| ((step * 10.0_f64.powi(*d)).fract()).min(1.0 - (step * 10.0_f64.powi(*d)).fract()) < 1e-6);
    let digits = digits.unwrap_or(6) as usize;
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).map(|value| (value, format!("{value:.digits$}"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let labels = |range, count| nice_ticks(range, count).into_iter().map(|t| t.1).collect::<Vec<_>>().join(" ");
        assert_eq!(labels([0.0, 1.0], 4), "0.00 0.25 0.50 0.75 1.00");
        assert_eq!(labels([0.0, 20.0], 6), "0 5 10 15 20");
        assert_eq!(labels([0.0, 513.0], 4), "0 200 400");
        assert_eq!(labels([0.0, 1.0], 6), "0.0 0.2 0.4 0.6 0.8 1.0");
        assert_eq!(nice_ticks([2.0, 2.0], 4).len(), 1);
        assert_eq!(labels([1.0, 20.0], 8), "2.5 5.0 7.5 10.0 12.5 15.0 17.5 20.0");
        let counted = |range| counting_ticks(range, 8).into_iter().map(|t| t.1).collect::<Vec<_>>().join(" ");
        assert_eq!(counted([1.0, 20.0]), "5 10 15 20");
        assert_eq!(counted([1.0, 5.0]), "1 2 3 4 5", "no half of a step");
        assert_eq!(counted([0.0, 1.0]), "0 1");
    }
}
