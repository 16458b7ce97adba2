//! The charts of a report.

use super::palette;
use super::results::{Cell, Metric, Results};
use crate::figure::{Chart, Series};
use nudge_core::score::{Interval, Reliability, ReliabilityBin, mean};

/// Resampled means behind a band: a band needs fewer than a table.
const BAND_RESAMPLES: usize = 1000;
/// Size of a chart, units.
pub const SIZE: [f32; 2] = [640.0, 320.0];

/// A chart with its file's name and what to say below it.
pub struct Figure {
    /// Name of its PNG without ending.
    pub name: String,
    /// What it shows.
    pub caption: String,
    /// The chart.
    pub chart: Chart,
}

/// The charts of a set.
pub fn of_set(results: &Results, set: usize) -> Vec<Figure> {
    let mut figures: Vec<Figure> = [Metric::OccupancyIou, Metric::SemanticMiou, Metric::Entropy]
        .into_iter()
        .map(|metric| over_steps(results, set, metric))
        .collect();
    figures.push(reliability(results, set, "occupancy", |cell| cell.tally(results.plan.budget).occupancy_reliability));
    figures.push(reliability(results, set, "semantics", |cell| cell.tally(results.plan.budget).semantics_reliability));
    figures
}

fn over_steps(results: &Results, set: usize, metric: Metric) -> Figure {
    let budget = results.plan.budget;
    let mut series = Vec::new();
    for (_, policy, cell) in results.policies(set) {
        let (rgb, dash) = palette::of(policy);
        let (mut points, mut band) = (Vec::new(), Vec::new());
        for step in 1..=budget {
            let values: Vec<f64> = cell.by_scene(|result| metric.of(result.scores(step))).into_values().collect();
            let interval = Interval::with_resamples(&values, BAND_RESAMPLES);
            points.push([step as f64, mean(&values)]);
            band.push([interval.low, interval.high]);
        }
        series.push(Series { name: policy.to_string(), rgb, dash, points, band });
    }
    let name = &results.plan.sets[set].name;
    let file = match metric {
        Metric::OccupancyIou => "occupancy-iou",
        Metric::SemanticMiou => "semantic-miou",
        Metric::Entropy => "entropy",
    };
    Figure {
        name: format!("{name}-{file}"),
        caption: format!("{} over the steps, mean over scenes; bands are 95 % intervals of the mean", metric.title()),
        chart: Chart {
            title: format!("{name}: {}", metric.title()),
            x_title: "step".to_owned(),
            x_counts: true,
            x_range: [1.0, budget.max(2) as f64],
            y_range: range(&series, metric),
            series,
            diagonal: false,
        },
    }
}

/// Round ends around everything that is drawn.
fn range(series: &[Series], metric: Metric) -> [f64; 2] {
    let values = series.iter().flat_map(|s| s.band.iter().flatten().copied().chain(s.points.iter().map(|p| p[1])));
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
    if !low.is_finite() {
        return [0.0, 1.0];
    }
    if metric == Metric::Entropy {
        let unit = 10.0_f64.powf(high.max(1.0).log10().floor()) / 2.0;
        return [0.0, (high / unit).ceil() * unit];
    }
    [(low * 20.0).floor() / 20.0, ((high * 20.0).ceil() / 20.0).min(1.0)]
}

fn reliability(results: &Results, set: usize, what: &str, of: impl Fn(&Cell) -> Reliability) -> Figure {
    let mut series = Vec::new();
    for (_, policy, cell) in results.policies(set) {
        let (rgb, dash) = palette::of(policy);
        let points = reliability_points(&of(cell));
        if !points.is_empty() {
            series.push(Series { name: policy.to_string(), rgb, dash, points, band: Vec::new() });
        }
    }
    let name = &results.plan.sets[set].name;
    let lowest = if what == "occupancy" { 0.5 } else { 0.0 };
    Figure {
        name: format!("{name}-reliability-{what}"),
        caption: format!(
            "how often the likeliest {} is right, by how sure the belief is of it at the end; on the dashed line a belief \
             is as right as it is sure, below it too sure",
            if what == "occupancy" { "state of a voxel" } else { "class of a floor cell" }
        ),
        chart: Chart {
            title: format!("{name}: reliability of {what}"),
            x_title: "confidence".to_owned(),
            x_counts: false,
            x_range: [lowest, 1.0],
            y_range: [0.0, 1.0],
            series,
            diagonal: true,
        },
    }
}

/// A bin with fewer of all cells than one in so many is left out: its accuracy is that of a handful of cells.
const CELLS_PER_RARE: u64 = 10_000;

/// Accuracy against confidence over all classes together, bins with next to no cells left out.
fn reliability_points(reliability: &Reliability) -> Vec<[f64; 2]> {
    let bins = reliability.bins.first().map_or(0, |bins| bins.len());
    let all: u64 = reliability.bins.iter().flatten().map(|bin| bin.count).sum();
    (0..bins)
        .filter_map(|bin| {
            let mut sum = ReliabilityBin::default();
            for class in &reliability.bins {
                sum.count += class[bin].count;
                sum.correct += class[bin].correct;
                sum.confidence += class[bin].confidence;
            }
            let count = sum.count as f64;
            (sum.count > all / CELLS_PER_RARE).then(|| [sum.confidence / count, sum.correct as f64 / count])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reliability_is_that_of_all_classes_together() {
        let mut reliability = Reliability::new(2);
        (0..3).for_each(|_| reliability.add(0, 0, 0.9));
        reliability.add(1, 0, 0.9);
        reliability.add(1, 1, 0.6);
        let points = reliability_points(&reliability);
        assert_eq!(points.len(), 2);
        assert!((points[0][0] - 0.6).abs() < 1e-6 && points[0][1] == 1.0);
        assert!((points[1][0] - 0.9).abs() < 1e-6 && points[1][1] == 0.75);
    }
}
