//! Drawing candidates until enough of them are feasible.

use super::Candidate;
use crate::rng::{ChaCha8Rng, stream};
use rand::Rng;
use rayon::prelude::*;

/// Draws that are checked together; fixed, so that it never matters who checks them.
const BATCH: usize = 32;

/// Draws with `draw` and checks what was drawn, each with a stream of its own, until `count` are feasible or `draws` were
/// drawn; all of them, rejected ones too, in the order drawn. The result does not depend on the number of threads.
pub(super) fn draw_until<T: Send>(
    count: usize,
    draws: usize,
    rng: &mut ChaCha8Rng,
    mut draw: impl FnMut(&mut ChaCha8Rng) -> T,
    check: impl Fn(T, &mut ChaCha8Rng) -> Candidate + Sync,
) -> Vec<Candidate> {
    let seed = rng.random();
    let mut candidates = Vec::new();
    let mut feasible = 0;
    for first in (0..draws).step_by(BATCH) {
        if feasible == count {
            break;
        }
        let drawn: Vec<(u64, T)> = (first..draws.min(first + BATCH)).map(|number| (number as u64, draw(rng))).collect();
        let checked: Vec<Candidate> =
            drawn.into_par_iter().map(|(number, drawn)| check(drawn, &mut stream(seed, "arm", number))).collect();
        for candidate in checked {
            if feasible < count {
                feasible += usize::from(candidate.rejection.is_none());
                candidates.push(candidate);
            }
        }
    }
    candidates
}
