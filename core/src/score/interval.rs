//! Means with confidence intervals, by the bootstrap over scenes.
//!
//! Scenes are what a result should carry over to, so scenes are what is resampled: the values of a scene's seeds are
//! averaged first. Two policies are compared scene by scene (paired), which takes out how hard a scene is. Intervals are
//! percentiles of [`RESAMPLES`] resampled means (Efron 1979); with a handful of scenes they are narrower than they should be.

use crate::rng::stream;
use rand::Rng;
use serde::{Deserialize, Serialize};

/// Number of resampled means.
pub const RESAMPLES: usize = 10_000;
/// Share of resampled means outside an interval.
const OUTSIDE: f64 = 0.05;

/// A mean with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The mean.
    pub mean: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Mean and interval of one value per scene. The same values give the same interval. Zero without values.
    pub fn of(values: &[f64]) -> Self {
        Self::with_resamples(values, RESAMPLES)
    }

    /// The same with another number of resampled means.
    pub fn with_resamples(values: &[f64], resamples: usize) -> Self {
        let count = values.len();
        if count == 0 {
            return Self::default();
        }
        let mean = mean(values);
        let mut rng = stream(0, "bootstrap", count as u64);
        let mut means: Vec<f64> = (0..resamples)
            .map(|_| (0..count).map(|_| values[rng.random_range(0..count)]).sum::<f64>() / count as f64)
            .collect();
        means.sort_by(f64::total_cmp);
        let at = |share: f64| means[((share * resamples as f64) as usize).min(resamples - 1)];
        Self { mean, low: at(0.5 * OUTSIDE), high: at(1.0 - 0.5 * OUTSIDE) }
    }

    /// Interval of the differences `a - b`, scene by scene.
    pub fn of_difference(a: &[f64], b: &[f64]) -> Self {
        let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        Self::of(&differences)
    }

    /// Whether zero lies outside.
    pub fn excludes_zero(&self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }
}

/// The mean; zero without values.
pub fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

/// Sample standard deviation; zero with fewer than two values.
pub fn deviation(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return 0.0;
    }
    let mean = mean(values);
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_normal_sample_is_about_two_standard_errors_wide() {
        // 200 draws, each the sum of twelve uniforms: mean 6, deviation 1.
        let mut rng = stream(3, "stats-test", 0);
        let values: Vec<f64> = (0..200).map(|_| (0..12).map(|_| rng.random::<f64>()).sum()).collect();
        let interval = Interval::of(&values);
        let error = deviation(&values) / 200_f64.sqrt();
        let half = 0.5 * (interval.high - interval.low);
        assert!((half / (1.96 * error) - 1.0).abs() < 0.06, "{half} against {}", 1.96 * error);
        assert!((interval.mean - 6.0).abs() < 0.25 && interval.low < interval.mean && interval.mean < interval.high);
        assert_eq!(interval, Interval::of(&values));
    }

    #[test]
    fn pairs_take_out_how_hard_a_scene_is() {
        let hard: Vec<f64> = (0..25).map(|k| f64::from(k) * 0.03).collect();
        let better: Vec<f64> =
            hard.iter().enumerate().map(|(k, v)| v + 0.02 + 0.005 * f64::from(k as u32 % 3)).collect();
        let paired = Interval::of_difference(&better, &hard);
        assert!(paired.excludes_zero() && paired.low > 0.02 && paired.high < 0.03, "{paired:?}");
        let (one, other) = (Interval::of(&better), Interval::of(&hard));
        assert!(one.low < other.high, "unpaired, the two overlap");
    }

    #[test]
    fn few_values_are_no_crash() {
        assert_eq!(Interval::of(&[]), Interval::default());
        assert_eq!(Interval::of(&[0.5]), Interval { mean: 0.5, low: 0.5, high: 0.5 });
        assert!(!Interval::of(&[-1.0, 1.0]).excludes_zero());
    }
}
