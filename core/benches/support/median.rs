//! How long work takes; for the benchmarks of this crate and of the end-to-end tests.

use std::hint::black_box;
use std::time::Instant;

/// The median wall-clock time of `runs` runs, seconds.
pub fn median<T>(runs: usize, mut work: impl FnMut() -> T) -> f64 {
    let mut seconds: Vec<f64> = (0..runs)
        .map(|_| {
            let started = Instant::now();
            black_box(work());
            started.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[runs / 2]
}
