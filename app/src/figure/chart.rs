//! Line charts over a common axis, with bands, and names at the ends of the lines.

use super::plot::{counting_ticks, nice_ticks};
use super::svg::{Anchor, HAIRLINE, SOFT_INK, Stroke, Svg, Text};
use crate::colors::Rgb;

/// One line of a chart.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its name, written beside its end.
    pub name: String,
    /// Its colour.
    pub rgb: Rgb,
    /// Lengths of dash and gap; zeros for a full line.
    pub dash: [f32; 2],
    /// Points, by rising x.
    pub points: Vec<[f64; 2]>,
    /// Lower and upper edge of the band at each point; empty for none.
    pub band: Vec<[f64; 2]>,
}

/// Axes with lines.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What the vertical axis shows, with its unit.
    pub title: String,
    /// What the horizontal axis shows.
    pub x_title: String,
    /// Whether the horizontal axis counts something, so that only whole numbers stand on it.
    pub x_counts: bool,
    /// Ends of the horizontal axis.
    pub x_range: [f64; 2],
    /// Ends of the vertical axis.
    pub y_range: [f64; 2],
    /// The lines.
    pub series: Vec<Series>,
    /// Whether to draw the line y = x, for reliability diagrams.
    pub diagonal: bool,
}

/// Room for numbers of six digits, also in a browser's wider type.
const LEFT: f32 = 56.0;
const TOP: f32 = 30.0;
const BOTTOM: f32 = 36.0;
/// Least distance of the baselines of two names.
const PITCH: f32 = 14.0;
/// Room for a name, also in a browser's wider type.
const NAMES: f32 = 204.0;

impl Chart {
    /// The chart as a drawing of its own.
    pub fn svg(&self, size: [f32; 2]) -> Svg {
        let mut svg = Svg::new(size);
        let axes = [LEFT, TOP, size[0] - LEFT - NAMES, size[1] - TOP - BOTTOM];
        let scale = |value: f64, [low, high]: [f64; 2]| {
            ((value - low) / (high - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0) as f32
        };
        let x = |value: f64| axes[0] + axes[2] * scale(value, self.x_range);
        let y = |value: f64| axes[1] + axes[3] * (1.0 - scale(value, self.y_range));
        svg.text(&Text::new(&self.title, [8.0, 17.0], 14.0));
        for (value, label) in nice_ticks(self.y_range, 5) {
            svg.line([axes[0], y(value)], [axes[0] + axes[2], y(value)], Stroke::new(HAIRLINE, 0.8));
            let text = Text::new(label, [axes[0] - 6.0, y(value) + 3.8], 11.0);
            svg.text(&text.anchored(Anchor::End).colored(SOFT_INK));
        }
        let floor = axes[1] + axes[3];
        let x_ticks = if self.x_counts { counting_ticks } else { nice_ticks };
        for (value, label) in x_ticks(self.x_range, 8) {
            svg.line([x(value), floor], [x(value), floor + 3.0], Stroke::new(SOFT_INK, 0.9));
            let text = Text::new(label, [x(value), floor + 15.0], 11.0);
            svg.text(&text.anchored(Anchor::Middle).colored(SOFT_INK));
        }
        svg.line([axes[0], floor], [axes[0] + axes[2], floor], Stroke::new(SOFT_INK, 0.9));
        let title = Text::new(&self.x_title, [axes[0] + 0.5 * axes[2], floor + 30.0], 11.0);
        svg.text(&title.anchored(Anchor::Middle).colored(SOFT_INK));
        if self.diagonal {
            let from = self.x_range[0].max(self.y_range[0]);
            let to = self.x_range[1].min(self.y_range[1]);
            svg.line([x(from), y(from)], [x(to), y(to)], Stroke::new(SOFT_INK, 1.0).dashed(3.0, 3.0));
        }
        for series in self.series.iter().filter(|series| !series.band.is_empty()) {
            let xs = series.points.iter().map(|[at, _]| x(*at));
            let upper = xs.clone().zip(&series.band).map(|(x, [_, high])| [x, y(*high)]);
            let lower = xs.zip(&series.band).map(|(x, [low, _])| [x, y(*low)]);
            let mut corners: Vec<[f32; 2]> = upper.collect();
            corners.extend(lower.collect::<Vec<_>>().into_iter().rev());
            svg.area(&corners, series.rgb, 0.11);
        }
        // The first on top.
        for series in self.series.iter().rev() {
            let points: Vec<[f32; 2]> = series.points.iter().map(|[at, value]| [x(*at), y(*value)]).collect();
            let [dash, gap] = series.dash;
            svg.polyline(&points, Stroke::new(series.rgb, 2.0).dashed(dash, gap));
        }
        self.names(&mut svg, axes, y);
        svg
    }

    /// Writes every line's last value and name beside its end, apart from each other, with a sample of its stroke.
    fn names(&self, svg: &mut Svg, axes: [f32; 4], y: impl Fn(f64) -> f32) {
        let last = |series: &Series| series.points.last().map(|[_, value]| *value);
        let mut ends: Vec<(f32, f64, &Series)> =
            self.series.iter().filter_map(|series| last(series).map(|value| (y(value), value, series))).collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        for at in 1..ends.len() {
            ends[at].0 = ends[at].0.max(ends[at - 1].0 + PITCH);
        }
        let mut floor = axes[1] + axes[3] + 4.0;
        for end in ends.iter_mut().rev() {
            end.0 = end.0.min(floor);
            floor = end.0 - PITCH;
        }
        let span = self.y_range[1] - self.y_range[0];
        let digits = if span > 50.0 {
            0
        } else if span > 2.0 {
            1
        } else {
            3
        };
        let left = axes[0] + axes[2];
        for (at, value, series) in ends {
            let [dash, gap] = series.dash;
            let sample = Stroke::new(series.rgb, 2.0).dashed(dash, gap);
            svg.line([left + 3.0, y(value)], [left + 9.0, at], Stroke::new(series.rgb, 0.7).faint(0.6));
            svg.line([left + 10.0, at], [left + 27.0, at], sample);
            let name = if self.diagonal { series.name.clone() } else { format!("{} {value:.digits$}", series.name) };
            svg.text(&Text::new(name, [left + 31.0, at + 3.8], 11.0).colored(series.rgb));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_bands_and_names_are_drawn_and_names_stay_apart() {
        let line = |name: &str, value: f64| Series {
            name: name.to_owned(),
            rgb: [200, 0, 0],
            dash: [0.0; 2],
            points: vec![[0.0, 0.0], [10.0, value]],
            band: vec![[0.0, 0.0], [value - 0.1, value + 0.1]],
        };
        let chart = Chart {
            title: "IoU".to_owned(),
            x_title: "step".to_owned(),
            x_counts: true,
            x_range: [0.0, 10.0],
            y_range: [0.0, 1.0],
            series: vec![line("one", 0.80), line("two", 0.801), line("three", 0.802)],
            diagonal: false,
        };
        let document = chart.svg([480.0, 260.0]).document();
        let baselines: Vec<f32> = ["one 0.800", "two 0.801", "three 0.802"]
            .iter()
            .map(|name| {
                let element = document.lines().find(|line| line.contains(name)).expect("its name is there");
                let y = element.split(" y=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("y");
                y.parse().expect("a number")
            })
            .collect();
        assert!(
            baselines[0] - baselines[1] >= PITCH - 0.1 && baselines[1] - baselines[2] >= PITCH - 0.1,
            "{baselines:?}"
        );
        let image = chart.svg([480.0, 260.0]).render(1.0).expect("drawn");
        // Where the line ends, and in the band beside it.
        let ink = |x: u32, y: u32| image.get_pixel(x, y).0;
        let right = (480.0 - NAMES) as u32 - 1;
        let at = |value: f32| (TOP + (260.0 - TOP - BOTTOM) * (1.0 - value)) as u32;
        assert!(ink(right, at(0.80))[1] < 120, "{:?}", ink(right, at(0.80)));
        let band = ink(right, at(0.86));
        assert!(band[0] > 230 && band[1] < 245, "{band:?}");
    }
}
