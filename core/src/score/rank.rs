//! Whether one number orders things as another does.

use super::mean;

/// Spearman's rank correlation of paired values, -1 to 1: Pearson's correlation of their ranks, equal values sharing the
/// mean of theirs (Spearman 1904). `None` where one side has fewer than two different values: nothing is ordered then.
pub fn rank_correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let (a, b) = (ranks(a), ranks(b));
    let centred = |ranks: &[f64]| {
        let middle = mean(ranks);
        ranks.iter().map(|rank| rank - middle).collect::<Vec<_>>()
    };
    let (a, b) = (centred(&a), centred(&b));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let spread = (product(&a, &a) * product(&b, &b)).sqrt();
    (spread > 0.0).then(|| product(&a, &b) / spread)
}

/// The rank of every value, 1 for the smallest; equal values share the mean of their ranks.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&one, &other| values[one].total_cmp(&values[other]));
    let mut ranks = vec![0.0; values.len()];
    for equal in order.chunk_by(|&one, &other| values[one] == values[other]) {
        let before = order.partition_point(|&at| values[at].total_cmp(&values[equal[0]]).is_lt());
        let shared = before as f64 + 0.5 * (equal.len() + 1) as f64;
        equal.iter().for_each(|&at| ranks[at] = shared);
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_of_equal_values_are_shared() {
        assert_eq!(ranks(&[0.3, -1.0, 7.0, 0.3]), [2.5, 1.0, 4.0, 2.5]);
        assert_eq!(ranks(&[5.0, 5.0, 5.0]), [2.0, 2.0, 2.0]);
        assert_eq!(ranks(&[]), [0.0; 0]);
    }

    #[test]
    fn only_the_order_counts() {
        let near = |a: &[f64], b: &[f64], expected: f64| {
            let found = rank_correlation(a, b).expect("ordered");
            assert!((found - expected).abs() < 1e-12, "{found} is not {expected}");
        };
        near(&[1.0, 2.0, 3.0, 4.0], &[1.0, 10.0, 100.0, 1000.0], 1.0);
        near(&[1.0, 2.0, 3.0, 4.0], &[4.0, 3.0, 2.0, 1.0], -1.0);
        // Without ties it is 1 - 6 sum d^2 / (n (n^2 - 1)); ranks 1, 3, 2, 5, 4 differ by 0, 1, 1, 1, 1.
        near(&[1.0, 2.0, 3.0, 4.0, 5.0], &[1.0, 3.0, 2.0, 6.0, 4.0], 1.0 - 6.0 * 4.0 / 120.0);
        // Ranks 1, 2, 3 against 1.5, 1.5, 3.
        near(&[1.0, 2.0, 3.0], &[0.0, 0.0, 9.0], 1.5 / (2.0_f64 * 1.5).sqrt());
        assert_eq!(rank_correlation(&[1.0, 2.0, 3.0], &[7.0; 3]), None, "nothing is ordered");
        assert_eq!((rank_correlation(&[1.0], &[1.0]), rank_correlation(&[], &[])), (None, None));
    }
}
