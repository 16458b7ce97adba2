//! What a gain is, against paper and against a slow computation of its own.

mod change;
pub(super) mod support;

use super::*;
use crate::belief::{Belief, Prediction, bernoulli_entropy};
use crate::grid::{VoxelSet, Window};
use crate::scene::CLASS_COUNT;
use proptest::prelude::*;
use support::{exactly, facing, patchy, slow_gain, small_grid, standard};

/// A row of voxels of 0.1 m into the shelf, and a camera of one pixel that looks straight into it.
fn row(probabilities: &[f32]) -> (Belief, ViewArray) {
    let grid = Grid::for_shelf([0.1, 0.1 * probabilities.len() as f32, 0.1], 0.1);
    (exactly(grid, |voxel| probabilities[usize::from(voxel.y)]), facing([0.0, -0.3, 0.05]))
}

fn gain_of_row(probabilities: &[f32]) -> f32 {
    let (belief, array) = row(probabilities);
    gain_of_views(&GainField::new(&belief), &array, &[ViewId(0)], RayDensity { stride_px: 1 })[0]
}

#[test]
fn a_world_of_three_voxels_as_on_paper() {
    // H(0.5) = 0.6931, H(0.25) = 0.5623, H(0.9) = 0.3251:
    // 0.6931 + 0.5 * 0.5623 + 0.5 * 0.75 * 0.3251 = 1.0962 nats.
    let gain = gain_of_row(&[0.5, 0.25, 0.9]);
    assert!((gain - 1.0962).abs() < 0.006, "{gain}");
}

#[test]
fn what_passes_is_one_minus_p() {
    let h = bernoulli_entropy(0.2);
    let (right, with_p) = (h * (1.0 + 0.8 + 0.64), h * (1.0 + 0.2 + 0.04));
    let gain = gain_of_row(&[0.2, 0.2, 0.2]);
    assert!((gain - right).abs() < 0.01 && (gain - with_p).abs() > 0.5, "{gain}");
}

#[test]
fn sure_voxels_carry_no_information_and_block_or_pass_wholly() {
    let half = std::f32::consts::LN_2;
    assert_eq!(gain_of_row(&[0.04, 0.01, 0.5]), half);
    assert_eq!(gain_of_row(&[0.5, 0.96, 0.5]), half);
    assert_eq!(gain_of_row(&[0.96, 0.5, 0.5]), 0.0);
    assert!((gain_of_row(&[0.5, 0.5, 0.5]) - 1.75 * half).abs() < 1e-6);
    // The bounds themselves are not sure.
    assert!(gain_of_row(&[0.05, 0.01, 0.01]) > 0.19);
    assert!(gain_of_row(&[0.95, 0.5, 0.5]) > 0.19);
}

#[test]
fn what_a_push_blurs_of_what_was_seen_is_no_gain_but_blocks() {
    let (belief, array) = row(&[0.01, 0.5]);
    let mut seen = VoxelSet::empty(&belief.grid);
    seen.insert(0);
    let prediction = Prediction {
        window: Window { x: [0, 1], y: [0, 1] },
        occupancy: vec![[1.0, 1.0]],
        semantics: vec![[1.0; CLASS_COUNT]],
        change: vec![1.0],
    };
    let gain = |field: &GainField| gain_of_views(field, &array, &[ViewId(0)], RayDensity { stride_px: 1 })[0];
    let (all, half) = (GainField::new(&belief), std::f32::consts::LN_2);
    let unseen = all.with_seen(&seen);
    assert_eq!((gain(&all), gain(&unseen)), (half, half));
    assert!((gain(&all.with_prediction(&prediction)) - 1.5 * half).abs() < 1e-5);
    assert!((gain(&unseen.with_prediction(&prediction)) - 0.5 * half).abs() < 1e-5);
}

#[test]
fn only_rays_through_the_open_front_see() {
    let belief = Belief::uniform(small_grid());
    let field = GainField::new(&belief);
    let gain = |array: &ViewArray| gain_of_views(&field, array, &[ViewId(0)], RayDensity { stride_px: 1 })[0];
    assert!(gain(&facing([0.0, -0.3, 0.2])) > 1.0);
    // Past the side walls, above the ceiling, below the board, and from inside or behind.
    for outside in [[0.41, -0.3, 0.2], [-0.41, -0.3, 0.2], [0.0, -0.3, 0.41], [0.0, -0.3, -0.01], [0.0, 0.6, 0.2]] {
        assert_eq!(gain(&facing(outside)), 0.0, "{outside:?}");
    }
}

#[test]
fn rays_are_counted_as_in_the_design() {
    assert_eq!(RayDensity::FULL.rays([640, 480]), [80, 60]);
    assert_eq!(RayDensity::COARSE.rays([640, 480]), [40, 30]);
    assert_eq!(RayDensity { stride_px: 3 }.rays([7, 1]), [2, 0]);
    let grid = Grid::for_shelf([0.80, 0.40, 0.40], 0.005);
    assert_eq!(RayDensity::gapless(&grid, &standard()).stride_px, 2);
}

#[test]
fn voxels_share_out_the_gain() {
    let field = GainField::new(&patchy(small_grid(), 5));
    let array = standard();
    let view = ViewId(137);
    let parts = gain_per_voxel(&field, &array, view, RayDensity::COARSE);
    assert!(parts.len() > 100 && parts.is_sorted_by(|a, b| a.0 < b.0) && parts.iter().all(|part| part.1 > 0.0));
    let sum: f64 = parts.iter().map(|part| f64::from(part.1)).sum();
    let gain = f64::from(gain_of_views(&field, &array, &[view], RayDensity::COARSE)[0]);
    assert!((sum / gain - 1.0).abs() < 1e-5, "{sum} {gain}");
    let informed = informed_voxels(&field, &array, view, RayDensity::COARSE);
    assert!(!informed.is_empty() && informed.iter().all(|index| parts.iter().any(|part| part.0 == index)));
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (array, belief) = (standard(), patchy(small_grid(), 8));
    let ids: Vec<ViewId> = (0..300).map(ViewId).collect();
    let all = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let field = GainField::new(&belief);
            let gains = gain_of_views(&field, &array, &ids, RayDensity::FULL);
            let pair = best_pair(&field, &array, &gains, RayDensity::FULL).unwrap();
            (gains.iter().map(|gain| gain.to_bits()).collect::<Vec<_>>(), pair)
        })
    };
    let alone = all(1);
    assert_eq!(alone, all(2));
    assert_eq!(alone, all(5));
}

#[test]
fn skipping_changes_no_digit() {
    for seed in 0..4 {
        let array = standard();
        let ids: Vec<ViewId> = (seed..300).step_by(4).map(ViewId).collect();
        let field = GainField::new(&patchy(small_grid(), u64::from(seed)));
        let mut plodding = field.clone();
        plodding.codes.iter_mut().filter(|code| skip::is_transparent(**code)).for_each(|code| *code = 0);
        assert_ne!(field.codes, plodding.codes);
        let gains = |field| gain_of_views(field, &array, &ids, RayDensity::FULL);
        assert_eq!(gains(&field), gains(&plodding));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Within 1 % of exact probabilities, entropies and traversal: rounding is off by at most 0.0124 in log-odds, and
    /// the gain `H(p) / p` of a ray in uniform space changes by at most 0.75 of that.
    #[test]
    fn the_gain_is_that_of_a_slow_computation(seed in 0_u64..1_000_000, view in 0_u16..300) {
        let belief = patchy(small_grid(), seed);
        let (array, density) = (standard(), RayDensity { stride_px: 20 });
        let fast = f64::from(gain_of_views(&GainField::new(&belief), &array, &[ViewId(view)], density)[0]);
        let slow = slow_gain(&belief, &array, ViewId(view), density);
        prop_assert!((fast - slow).abs() <= 0.01 * slow + 0.01, "{fast} {slow}");
    }

    /// From anywhere in front, in any direction: all three steepest axes, both ways. Probabilities that have a code
    /// of their own leave only rounding of the rays themselves.
    #[test]
    fn poses_of_every_kind_are_walked_exactly(
        seed in 0_u64..1_000_000,
        position in prop::array::uniform3(-1.0_f32..1.0),
        target in prop::array::uniform3(0.0_f32..1.0),
    ) {
        let mut belief = patchy(small_grid(), seed);
        for beta in &mut belief.occupancy {
            let p = crate::belief::beta_mean(*beta);
            *beta = if p < 0.4 { [1.0, 99.0] } else if p > 0.8 { [99.0, 1.0] } else { [1.0, 1.0] };
        }
        let position = [0.9 * position[0], -0.25 + 0.24 * position[1], 0.2 + 0.5 * position[2]];
        let target = [0.8 * target[0] - 0.4, 0.4 * target[1], 0.4 * target[2]];
        let array = support::looking(position, target);
        let density = RayDensity { stride_px: 16 };
        let fast = f64::from(gain_of_views(&GainField::new(&belief), &array, &[ViewId(0)], density)[0]);
        let slow = slow_gain(&belief, &array, ViewId(0), density);
        prop_assert!((fast - slow).abs() <= 0.0005 * slow + 0.7, "{fast} {slow}");
    }
}
