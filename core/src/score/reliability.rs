//! Calibration: reliability bins per true class and the expected calibration error (ECE).
//!
//! ECE is that of Guo et al., "On calibration of modern neural networks" (2017): cells are binned by their confidence
//! (the largest probability), and the bins' `|accuracy - confidence|` is averaged, weighted by their size. Taken over
//! the cells of each true class alone and then averaged over the classes it is the mECE of Marques et al., "On the
//! overconfidence problem in semantic 3D mapping" (2024): a rare class counts as much as the background.

use serde::{Deserialize, Serialize};

/// Number of equally wide bins of confidence in (0, 1].
pub const BIN_COUNT: usize = 10;

/// The cells whose confidence falls into one bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReliabilityBin {
    /// Number of cells.
    pub count: u64,
    /// Number of cells whose prediction is right.
    pub correct: u64,
    /// Sum of the cells' confidences.
    pub confidence: f64,
}

impl ReliabilityBin {
    /// Share of right cells minus mean confidence: below zero where the belief is too sure of itself.
    pub fn gap(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.correct as f64 - self.confidence) / self.count as f64)
    }
}

/// Reliability bins per true class. Bin `i` holds confidences in `(i / 10, (i + 1) / 10]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reliability {
    /// The bins of each true class.
    pub bins: Vec<[ReliabilityBin; BIN_COUNT]>,
}

impl Reliability {
    /// Empty bins for `classes` classes.
    pub fn new(classes: usize) -> Self {
        Self { bins: vec![[ReliabilityBin::default(); BIN_COUNT]; classes] }
    }

    /// Counts one cell of class `truth` that was predicted as `predicted` with probability `confidence`.
    pub fn add(&mut self, truth: usize, predicted: usize, confidence: f32) {
        let bin = &mut self.bins[truth][bin_of(confidence)];
        bin.count += 1;
        bin.correct += u64::from(truth == predicted);
        bin.confidence += f64::from(confidence);
    }

    /// Adds the bins of `other`, over the same classes.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!(self.bins.len(), other.bins.len(), "reliability over different classes");
        for (bin, other) in self.bins.iter_mut().flatten().zip(other.bins.iter().flatten()) {
            bin.count += other.count;
            bin.correct += other.correct;
            bin.confidence += other.confidence;
        }
    }

    /// ECE over the cells of one true class; `None` for a class without cells.
    pub fn ece(&self, truth: usize) -> Option<f64> {
        let bins = &self.bins[truth];
        let cells: u64 = bins.iter().map(|bin| bin.count).sum();
        let off: f64 = bins.iter().map(|bin| (bin.correct as f64 - bin.confidence).abs()).sum();
        (cells > 0).then(|| off / cells as f64)
    }

    /// mECE: the mean of [`Reliability::ece`] over the classes in the truth; 0 when nothing was counted.
    pub fn mean_ece(&self) -> f64 {
        let present: Vec<f64> = (0..self.bins.len()).filter_map(|class| self.ece(class)).collect();
        if present.is_empty() { 0.0 } else { present.iter().sum::<f64>() / present.len() as f64 }
    }
}

fn bin_of(confidence: f32) -> usize {
    let upper = (f64::from(confidence) * BIN_COUNT as f64).ceil();
    (upper.max(1.0) as usize).min(BIN_COUNT) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_own_their_upper_edge() {
        for (confidence, bin) in [(0.0, 0), (0.05, 0), (0.5, 4), (0.51, 5), (0.99, 9), (1.0, 9)] {
            assert_eq!(bin_of(confidence), bin, "{confidence}");
        }
    }

    #[test]
    fn calibration_error_is_that_computed_by_hand() {
        let mut reliability = Reliability::new(3);
        // Class 0: four cells at 0.75, three right: calibrated. Two at 0.95, none right: off by 0.95.
        (0..4).for_each(|i| reliability.add(0, usize::from(i == 0), 0.75));
        (0..2).for_each(|_| reliability.add(0, 1, 0.95));
        // Class 1: one cell at 0.6, right: off by 0.4.
        reliability.add(1, 1, 0.6);
        let class_0 = (4.0 * 0.0 + 2.0 * 0.95) / 6.0;
        assert!((reliability.ece(0).expect("cells") - class_0).abs() < 1e-6);
        assert!((reliability.ece(1).expect("cells") - 0.4).abs() < 1e-6);
        assert_eq!(reliability.ece(2), None);
        assert!((reliability.mean_ece() - 0.5 * (class_0 + 0.4)).abs() < 1e-6);
        assert!((reliability.bins[0][9].gap().expect("cells") + 0.95).abs() < 1e-6);
    }

    #[test]
    fn cells_in_one_bin_cancel_and_cells_in_two_do_not() {
        let mut one = Reliability::new(1);
        one.add(0, 0, 0.75);
        one.add(0, 1, 0.75);
        assert!((one.mean_ece() - 0.25).abs() < 1e-6);
        let mut two = Reliability::new(1);
        two.add(0, 0, 0.75);
        let mut other = Reliability::new(1);
        other.add(0, 1, 0.25);
        two.merge(&other);
        assert!((two.mean_ece() - 0.25).abs() < 1e-6);
        two.add(0, 1, 0.75);
        assert!((two.mean_ece() - (2.0 * 0.25 + 0.25) / 3.0).abs() < 1e-6);
    }
}
