//! Eight bits for an occupancy probability, and the tables that a ray looks up.
//!
//! | code | meaning |
//! |---|---|
//! | 0 to 15 | transparent, `p < 0.05`; the number is the voxel's skip level ([`super::skip`]) |
//! | 16 to 254 | `0.05 <= p <= 0.95`, 239 levels evenly spaced in log-odds; 135 is `p = 0.5` |
//! | 255 | opaque, `p > 0.95`, and everything outside the shelf |

use std::sync::LazyLock;

/// The first code that is not transparent.
pub(super) const FIRST_INFORMATIVE: u8 = 16;
/// A voxel that stops every ray.
pub(super) const OPAQUE: u8 = 255;

/// `p` below this is transparent, above one minus this opaque.
const SURE: f32 = 0.05;
/// Bins of the table from probability to code; 16 of them or more to a code.
const BINS: usize = 16_384;
/// Steps between the first informative code and the last.
const STEPS: f64 = (OPAQUE - 1 - FIRST_INFORMATIVE) as f64;

/// What a code means to a ray.
#[derive(Clone, Copy)]
pub(super) struct Matter {
    /// Entropy `H(p)`, nats.
    pub information: f32,
    /// `1 - p`.
    pub pass: f32,
}

/// [`Matter`] by code.
pub(super) static MATTER: LazyLock<[Matter; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| match code as u8 {
        0..FIRST_INFORMATIVE => Matter { information: 0.0, pass: 1.0 },
        OPAQUE => Matter { information: 0.0, pass: 0.0 },
        code => {
            let p = probability(code);
            Matter { information: (-p * p.ln() - (1.0 - p) * (1.0 - p).ln()) as f32, pass: (1.0 - p) as f32 }
        }
    })
});

/// [`Matter`] by code where the likeliest map stands for the belief: what is at least as likely occupied as not stops
/// a ray, the rest lets it pass.
pub(super) static LIKELIEST: LazyLock<[Matter; 256]> =
    LazyLock::new(|| MATTER.map(|matter| Matter { pass: if matter.pass > 0.5 { 1.0 } else { 0.0 }, ..matter }));

static CODES: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let code = |bin: usize| {
        let p = (bin as f64 + 0.5) / BINS as f64;
        let step = ((p / (1.0 - p)).ln() + largest_log_odds()) / (2.0 * largest_log_odds()) * STEPS;
        FIRST_INFORMATIVE + step.round().clamp(0.0, STEPS) as u8
    };
    (0..BINS).map(code).collect()
});

fn largest_log_odds() -> f64 {
    (f64::from(1.0 - SURE) / f64::from(SURE)).ln()
}

/// The probability that an informative code stands for.
fn probability(code: u8) -> f64 {
    let log_odds = largest_log_odds() * (2.0 * f64::from(code - FIRST_INFORMATIVE) / STEPS - 1.0);
    1.0 / (1.0 + (-log_odds).exp())
}

/// Whether a voxel of this code carries information.
pub(super) fn is_informative(code: u8) -> bool {
    (FIRST_INFORMATIVE..OPAQUE).contains(&code)
}

/// Rounds probabilities to codes; get it once for many voxels.
pub(super) struct Quantiser(&'static [u8]);

impl Quantiser {
    pub(super) fn get() -> Self {
        Self(&CODES)
    }

    /// The code of `p`. Transparent voxels get skip level 0; what is not a number counts as unknown.
    #[inline(always)]
    pub(super) fn code(&self, p: f32) -> u8 {
        if p < SURE {
            0
        } else if p > 1.0 - SURE {
            OPAQUE
        } else if p.is_nan() {
            self.0[BINS / 2]
        } else {
            self.0[(p * BINS as f32) as usize]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_errors_are_within_what_is_promised() {
        let quantiser = Quantiser::get();
        let entropy = |p: f64| -p * p.ln() - (1.0 - p) * (1.0 - p).ln();
        for i in 0..=90_000 {
            let p = f64::from(0.05 + i as f32 * 1e-5).clamp(f64::from(SURE), f64::from(1.0 - SURE));
            let code = quantiser.code(p as f32);
            assert!(is_informative(code), "{p}");
            let matter = MATTER[usize::from(code)];
            let log_odds = |p: f64| (p / (1.0 - p)).ln();
            assert!((log_odds(probability(code)) - log_odds(p)).abs() < 0.014, "{p}");
            assert!((f64::from(matter.pass) / (1.0 - p) - 1.0).abs() < 0.014, "{p}");
            assert!((f64::from(matter.information) - entropy(p)).abs() < 0.0032, "{p}");
        }
        let half = MATTER[usize::from(quantiser.code(0.5))];
        assert_eq!((half.pass, half.information), (0.5, std::f32::consts::LN_2));
        assert_eq!([0.0, 0.049].map(|p| quantiser.code(p)), [0, 0]);
        assert_eq!([0.951, 1.0].map(|p| quantiser.code(p)), [OPAQUE, OPAQUE]);
        assert_eq!(quantiser.code(f32::NAN), quantiser.code(0.5));
    }
}
