//! Evidential losses: of Dirichlet (and, with two classes, Beta) parameters against the truth.
//!
//! With evidence parameters `a`, `S = sum a` and one-hot truth `y`:
//!
//! * expected: `sum_j y_j (digamma(S) - digamma(a_j))`, the cross-entropy expected under the Dirichlet (Sensoy et al. 2018);
//! * marginal: `sum_j y_j (ln S - ln a_j)`, the cross-entropy of the Dirichlet's mean (type II likelihood), which costs a
//!   logarithm in place of a digamma and is what the networks are trained with;
//! * plus `k KL(Dir(a~) || Dir(1))` with `a~ = y + (1 - y) a`, which drives the evidence for wrong classes to zero.
//!
//! Networks give `z` with `a = 1 + e^z`, so that `a` is above one, `ln a = softplus(z)`, and the gradient never
//! vanishes altogether. The training losses take `z` and truths that may be shared between two classes (a level that an
//! object's top cuts in half): every term is linear in `y`.

use tch::Tensor;

/// Which likelihood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossForm {
    /// With digamma.
    Expected,
    /// With logarithms.
    Marginal,
}

/// `sum_j y_j (digamma(S) - digamma(a_j))` over dimension `dim`; `a` and `y` have the same shape.
pub fn expected_log_loss(a: &Tensor, y: &Tensor, dim: i64) -> Tensor {
    let sum = a.sum_dim_intlist(dim, true, a.kind()).digamma();
    (y * (sum - a.digamma())).sum_dim_intlist(dim, false, a.kind())
}

/// `sum_j y_j (ln S - ln a_j)` over dimension `dim`; `a` and `y` have the same shape.
pub fn marginal_log_loss(a: &Tensor, y: &Tensor, dim: i64) -> Tensor {
    let sum = a.sum_dim_intlist(dim, true, a.kind()).log();
    (y * (sum - a.log())).sum_dim_intlist(dim, false, a.kind())
}

/// `KL(Dir(a) || Dir(1))` over dimension `dim`: `ln G(S) - ln G(K) - sum ln G(a) + sum (a - 1)(digamma(a) - digamma(S))`.
pub fn kl_to_uniform(a: &Tensor, dim: i64) -> Tensor {
    let classes = a.size()[dim as usize] as f64;
    let sum = a.sum_dim_intlist(dim, true, a.kind());
    let spread = ((a - 1.0) * (a.digamma() - sum.digamma())).sum_dim_intlist(dim, true, a.kind());
    let volume = sum.lgamma() - a.lgamma().sum_dim_intlist(dim, true, a.kind()) - ln_factorial(classes - 1.0);
    (volume + spread).squeeze_dim(dim)
}

/// `ln n!` of a small whole number.
fn ln_factorial(n: f64) -> f64 {
    (1..=n as u64).map(|i| (i as f64).ln()).sum()
}

/// `KL(Beta(1, b) || Beta(1, 1)) = ln b - (b - 1) / b`, from `z` with `b = 1 + e^z`: `softplus(z) - sigmoid(z)`.
fn beta_kl(z: &Tensor) -> Tensor {
    z.softplus() - z.sigmoid()
}

/// The mean of a loss, weighted where there are weights; they broadcast to it and have a mean of 1.
fn mean(loss: &Tensor, weights: Option<&Tensor>) -> Tensor {
    match weights {
        Some(weights) => (loss * weights).mean(loss.kind()),
        None => loss.mean(loss.kind()),
    }
}

/// Mean loss of Beta evidence: `z_occupied` and `z_free` against the share `y` of occupied, all of one shape.
pub fn occupancy_loss(
    z_occupied: &Tensor,
    z_free: &Tensor,
    y: &Tensor,
    form: LossForm,
    kl_weight: f64,
    weights: Option<&Tensor>,
) -> Tensor {
    let (log_occupied, log_free) = (z_occupied.softplus(), z_free.softplus());
    let likelihood = match form {
        // ln S - ln a_free - y (ln a_occ - ln a_free)
        LossForm::Marginal => log_occupied.logaddexp(&log_free) - &log_free - y * (&log_occupied - &log_free),
        LossForm::Expected => {
            let (occupied, free) = (z_occupied.exp() + 1.0, z_free.exp() + 1.0);
            let (psi_occupied, psi_free) = (occupied.digamma(), free.digamma());
            (occupied + free).digamma() - &psi_free - y * (psi_occupied - &psi_free)
        }
    };
    let mut loss = mean(&likelihood, weights);
    if kl_weight > 0.0 {
        // Where it is occupied the evidence for free is wrong, and the other way round.
        let (wrong_free, wrong_occupied) = (beta_kl(z_free), beta_kl(z_occupied));
        let kl = &wrong_occupied + y * (wrong_free - &wrong_occupied);
        loss += mean(&kl, weights) * kl_weight;
    }
    loss
}

/// Mean loss of Dirichlet evidence: `z` of shape `[B, K, ...]` against class numbers of shape `[B, 1, ...]`; weights are of
/// the latter shape.
pub fn semantics_loss(
    z: &Tensor,
    classes: &Tensor,
    form: LossForm,
    kl_weight: f64,
    weights: Option<&Tensor>,
) -> Tensor {
    let a = z.exp() + 1.0;
    let sum = a.sum_dim_intlist(1, true, a.kind());
    let right = a.gather(1, classes, false);
    let likelihood = match form {
        LossForm::Marginal => sum.log() - right.log(),
        LossForm::Expected => sum.digamma() - right.digamma(),
    };
    let mut loss = mean(&likelihood, weights);
    if kl_weight > 0.0 {
        let wrong = a.scatter_value(1, classes, 1.0);
        let kl = kl_to_uniform(&wrong, 1);
        loss += kl.mean(kl.kind()) * kl_weight;
    }
    loss
}

#[cfg(test)]
mod tests {
    use super::*;
    use tch::Kind;

    /// Values of SciPy 1.16 (`digamma`, `gammaln`) at the same arguments.
    const PARAMETERS: [f64; 9] = [1.5, 2.25, 7.0, 1.0001, 40.0, 3.5, 1.2, 1.3, 1.1];
    const TRUTH: [f64; 9] = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.25, 0.5, 0.25];
    const EXPECTED: [f64; 3] = [0.454_889_302_510_211_2, 4.361_264_610_153_142_5, 1.398_456_991_073_076_9];
    const MARGINAL: [f64; 3] = [0.428_995_605_518_358_36, 3.795_391_441_360_348, 1.080_343_777_078_748_7];
    const KL: [f64; 3] = [1.174_147_744_625_822_8, 3.986_256_432_460_806, 0.030_859_026_334_585_15];
    const KL_WEIGHT: f64 = 0.3;

    fn assert_near(tensor: &Tensor, expected: &[f64]) {
        let values = Vec::<f64>::try_from(tensor.flatten(0, -1)).expect("doubles");
        assert_eq!(values.len(), expected.len());
        for (value, expected) in values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-8 * (1.0 + expected.abs()), "{value} is not {expected}");
        }
    }

    fn z_occupancy() -> (Tensor, Tensor, Tensor) {
        let of = |values: [f64; 4]| Tensor::from_slice(&values);
        (of([-1.5, 0.5, 3.0, 2.0]), of([2.0, -0.25, -2.0, 1.0]), of([0.0, 1.0, 0.5, 1.0]))
    }

    fn z_semantics() -> (Tensor, Tensor) {
        let z = [0.5, -1.0, 2.0, 1.5, 0.0, -3.0, -0.5, 1.0, 0.25, 3.0, -2.0, 0.75];
        (Tensor::from_slice(&z).reshape([1, 4, 3]), Tensor::from_slice(&[0_i64, 1, 3]).reshape([1, 1, 3]))
    }

    #[test]
    fn losses_are_those_of_scipy() {
        let (a, y) = (Tensor::from_slice(&PARAMETERS).reshape([3, 3]), Tensor::from_slice(&TRUTH).reshape([3, 3]));
        assert_near(&expected_log_loss(&a, &y, 1), &EXPECTED);
        assert_near(&marginal_log_loss(&a, &y, 1), &MARGINAL);
        assert_near(&kl_to_uniform(&a, 1), &KL);
        let (occupied, free, y) = z_occupancy();
        let loss = |form| occupancy_loss(&occupied, &free, &y, form, KL_WEIGHT, None);
        assert_near(&loss(LossForm::Expected), &[0.854_338_646_734_955_5]);
        assert_near(&loss(LossForm::Marginal), &[0.766_844_401_892_764_4]);
        let (z, classes) = z_semantics();
        let loss = |form| semantics_loss(&z, &classes, form, KL_WEIGHT, None);
        assert_near(&loss(LossForm::Expected), &[2.679_744_267_940_27]);
        assert_near(&loss(LossForm::Marginal), &[2.503_968_462_868_297]);
    }

    /// Compares the gradient of a scalar function at `at` with central differences.
    fn assert_gradient(at: &Tensor, loss: &dyn Fn(&Tensor) -> Tensor) {
        const STEP: f64 = 1e-5;
        let leaf = at.copy().set_requires_grad(true);
        loss(&leaf).backward();
        let gradient = Vec::<f64>::try_from(leaf.grad().flatten(0, -1)).expect("doubles");
        let values = Vec::<f64>::try_from(at.flatten(0, -1)).expect("doubles");
        assert!(gradient.iter().any(|g| g.abs() > 1e-3));
        for (i, gradient) in gradient.iter().enumerate() {
            let moved = |by: f64| {
                let mut values = values.clone();
                values[i] += by;
                loss(&Tensor::from_slice(&values).reshape(at.size())).double_value(&[])
            };
            let difference = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
            assert!((difference - gradient).abs() < 1e-7, "{i}: {difference} is not {gradient}");
        }
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        let (occupied, free, y) = z_occupancy();
        let (z, classes) = z_semantics();
        for form in [LossForm::Expected, LossForm::Marginal] {
            assert_gradient(&occupied, &|z| occupancy_loss(z, &free, &y, form, KL_WEIGHT, None));
            assert_gradient(&free, &|z| occupancy_loss(&occupied, z, &y, form, KL_WEIGHT, None));
            assert_gradient(&z, &|z| semantics_loss(z, &classes, form, KL_WEIGHT, None));
        }
        let a = Tensor::from_slice(&PARAMETERS).reshape([3, 3]);
        assert_gradient(&a, &|a| kl_to_uniform(a, 1).sum(Kind::Double));
    }

    #[test]
    fn weights_choose_what_the_mean_is_of() {
        let (occupied, free, y) = z_occupancy();
        let half = |t: &Tensor| t.narrow(0, 0, 2);
        let weights = Tensor::from_slice(&[2.0, 2.0, 0.0, 0.0]);
        let loss = |weights| occupancy_loss(&occupied, &free, &y, LossForm::Marginal, KL_WEIGHT, weights);
        let first = occupancy_loss(&half(&occupied), &half(&free), &half(&y), LossForm::Marginal, KL_WEIGHT, None);
        assert_near(&loss(Some(&weights)), &[first.double_value(&[])]);
        assert_near(&loss(Some(&weights.ones_like())), &[loss(None).double_value(&[])]);
        let (z, classes) = z_semantics();
        let weights = Tensor::from_slice(&[0.0, 3.0, 0.0]).reshape([1, 1, 3]);
        let loss = semantics_loss(&z, &classes, LossForm::Marginal, 0.0, Some(&weights));
        let one = semantics_loss(&z.narrow(2, 1, 1), &classes.narrow(2, 1, 1), LossForm::Marginal, 0.0, None);
        assert_near(&loss, &[one.double_value(&[])]);
    }

    #[test]
    fn the_kl_of_a_beta_has_a_short_form() {
        let z = Tensor::from_slice(&[-4.0, -0.5, 0.0, 1.5, 6.0]);
        let beta = Tensor::stack(&[z.ones_like(), z.exp() + 1.0], 1);
        let long = Vec::<f64>::try_from(kl_to_uniform(&beta, 1)).expect("doubles");
        assert_near(&beta_kl(&z), &long);
    }

    #[test]
    fn the_loss_is_least_at_the_truth_s_share_and_punishes_wrong_evidence() {
        // Of ten cells seven are occupied: the best Beta's mean is 0.7.
        let y = Tensor::cat(&[Tensor::from_slice(&[1.0_f64; 7]), Tensor::from_slice(&[0.0_f64; 3])], 0);
        let loss = |mean: f64| {
            let (occupied, free) = (100.0 * mean - 1.0, 100.0 * (1.0 - mean) - 1.0);
            let z = |e: f64| Tensor::full([10], e.ln(), (Kind::Double, tch::Device::Cpu));
            occupancy_loss(&z(occupied), &z(free), &y, LossForm::Marginal, 0.0, None).double_value(&[])
        };
        assert!(loss(0.7) < loss(0.65) && loss(0.7) < loss(0.75));
        let wrong = |z: f64, kl: f64| {
            let of = |z: f64| Tensor::from_slice(&[z]);
            occupancy_loss(&of(-20.0), &of(z), &of(1.0), LossForm::Marginal, kl, None).double_value(&[])
        };
        assert!(wrong(3.0, 1.0) - wrong(3.0, 0.0) > 1.0 && wrong(-20.0, 1.0) - wrong(-20.0, 0.0) < 1e-6);
    }
}
