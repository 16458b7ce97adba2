//! Confusion matrices and the IoUs that follow from them.

use serde::{Deserialize, Serialize};

/// Counts of cells by true and predicted class. Merged over a set of scenes it gives the set's IoU.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Confusion {
    classes: usize,
    /// `[truth][predicted]`, row-major.
    counts: Vec<u64>,
}

impl Confusion {
    /// The empty matrix over `classes` classes.
    pub fn new(classes: usize) -> Self {
        Self { classes, counts: vec![0; classes * classes] }
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }

    /// Counts one cell.
    pub fn add(&mut self, truth: usize, predicted: usize) {
        self.counts[truth * self.classes + predicted] += 1;
    }

    /// Number of cells of class `truth` that were predicted as `predicted`.
    pub fn count(&self, truth: usize, predicted: usize) -> u64 {
        self.counts[truth * self.classes + predicted]
    }

    /// Adds the counts of `other`, a matrix over the same classes.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!(self.classes, other.classes, "confusion matrices over different classes");
        for (count, other) in self.counts.iter_mut().zip(&other.counts) {
            *count += other;
        }
    }

    /// Intersection over union of a class; `None` for one that is neither in the truth nor predicted.
    pub fn iou(&self, class: usize) -> Option<f64> {
        let hit = self.count(class, class);
        let of_truth: u64 = (0..self.classes).map(|predicted| self.count(class, predicted)).sum();
        let of_prediction: u64 = (0..self.classes).map(|truth| self.count(truth, class)).sum();
        let union = of_truth + of_prediction - hit;
        (union > 0).then(|| hit as f64 / union as f64)
    }

    /// Mean IoU over the classes present in truth or prediction; 1 when nothing was counted.
    pub fn mean_iou(&self) -> f64 {
        let present: Vec<f64> = (0..self.classes).filter_map(|class| self.iou(class)).collect();
        if present.is_empty() { 1.0 } else { present.iter().sum::<f64>() / present.len() as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::Confusion;

    fn example() -> Confusion {
        // 3 of class 0 right, 1 taken for class 1; 2 of class 1 right, 2 taken for class 0; class 2 nowhere.
        let mut confusion = Confusion::new(3);
        for (truth, predicted, times) in [(0, 0, 3), (0, 1, 1), (1, 1, 2), (1, 0, 2)] {
            (0..times).for_each(|_| confusion.add(truth, predicted));
        }
        confusion
    }

    #[test]
    fn ious_are_those_computed_by_hand() {
        let confusion = example();
        assert_eq!(confusion.iou(0), Some(3.0 / 6.0));
        assert_eq!(confusion.iou(1), Some(2.0 / 5.0));
        assert_eq!(confusion.iou(2), None);
        assert!((confusion.mean_iou() - 0.45).abs() < 1e-12);
        assert_eq!(Confusion::new(4).mean_iou(), 1.0);
    }

    #[test]
    fn a_class_that_is_only_predicted_counts_as_zero() {
        let mut confusion = example();
        confusion.add(0, 2);
        assert_eq!(confusion.iou(2), Some(0.0));
        assert!((confusion.mean_iou() - (3.0 / 7.0 + 0.4) / 3.0).abs() < 1e-12);
    }

    #[test]
    fn merging_sums_counts_rather_than_ious() {
        let mut set = example();
        let mut other = Confusion::new(3);
        other.add(0, 0);
        set.merge(&other);
        assert_eq!(set.iou(0), Some(4.0 / 7.0));
        assert_eq!(set.count(0, 0), 4);
    }
}
