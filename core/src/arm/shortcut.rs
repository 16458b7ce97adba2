//! Path shortening: two random points of a path are joined by a straight line wherever that is free.

use super::Joints;
use super::segment::is_segment_free;
use super::space::Space;
use crate::rng::ChaCha8Rng;
use rand::Rng;

/// A point on a path.
struct OnWay {
    /// The segment that it lies on.
    segment: usize,
    at: Joints,
}

/// The path after `attempts` attempts to replace the part between two of its points by a straight line. Never longer
/// than before.
pub(super) fn shortcut(space: &Space<'_>, mut path: Vec<Joints>, attempts: usize, rng: &mut ChaCha8Rng) -> Vec<Joints> {
    if path.len() > 2 && is_segment_free(space, &path[0], &path[path.len() - 1]) {
        return vec![path[0], path[path.len() - 1]];
    }
    for _ in 0..attempts {
        if path.len() <= 2 {
            break;
        }
        let lengths: Vec<f64> = path.windows(2).map(|pair| space.arm.travel_m(&pair[0], &pair[1])).collect();
        let total: f64 = lengths.iter().sum();
        let mut ends = [rng.random_range(0.0..1.0) * total, rng.random_range(0.0..1.0) * total];
        ends.sort_by(f64::total_cmp);
        let [a, b] = ends.map(|along| on_way(&path, &lengths, along));
        if a.segment == b.segment || !is_segment_free(space, &a.at, &b.at) {
            continue;
        }
        let mut shorter = path[..=a.segment].to_vec();
        shorter.extend([a.at, b.at]);
        shorter.extend_from_slice(&path[b.segment + 1..]);
        path = shorter;
    }
    path
}

fn on_way(path: &[Joints], lengths: &[f64], along: f64) -> OnWay {
    let mut rest = along;
    for (segment, &length) in lengths.iter().enumerate() {
        if rest <= length || segment + 1 == lengths.len() {
            let share = if length > 0.0 { (rest / length).clamp(0.0, 1.0) } else { 0.0 };
            return OnWay { segment, at: path[segment].toward(&path[segment + 1], share) };
        }
        rest -= length;
    }
    OnWay { segment: 0, at: path[0] }
}
