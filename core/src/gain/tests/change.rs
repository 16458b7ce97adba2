//! Skip levels, predictions, and what a second view adds.

use super::super::*;
use super::support::{patchy, small_grid, standard};
use crate::belief::{Belief, Prediction};
use crate::grid::Window;
use crate::rng::stream;
use proptest::prelude::*;
use rand::Rng;

/// A random window of another belief over the same grid.
fn prediction(grid: &Grid, seed: u64) -> Prediction {
    let mut rng = stream(seed, "window", 0);
    let other = patchy(*grid, seed + 1_000_000);
    let mut range = |n: usize| {
        let from = rng.random_range(0..n);
        [from, (from + rng.random_range(1..=12)).min(n)]
    };
    let window = Window { x: range(grid.dims[0]), y: range(grid.dims[1]) };
    let cells: Vec<usize> = window.cells(grid).collect();
    Prediction {
        window,
        occupancy: cells.iter().flat_map(|&cell| other.occupancy[grid.column(cell)].to_vec()).collect(),
        semantics: cells.iter().map(|&cell| other.semantics[cell]).collect(),
        change: vec![0.5; cells.len()],
    }
}

fn after(belief: &Belief, prediction: &Prediction) -> Belief {
    let mut belief = belief.clone();
    belief.apply(prediction);
    belief
}

/// The largest level whose box is transparent, looked up voxel by voxel.
fn slow_level(field: &GainField, voxel: [usize; 3]) -> usize {
    let dims = field.grid().dims.map(|n| n as i64);
    let [x, y, z] = voxel.map(|at| at as i64);
    let clear = |radius: i64| {
        (x - radius..=x + radius).all(|x| {
            (y..=y + 2 * radius).all(|y| {
                (z - radius..=z + radius).all(|z| {
                    [x, y, z].iter().zip(dims).all(|(&at, n)| (0..n).contains(&at))
                        && skip::is_transparent(field.codes[field.layout.at([x, y, z].map(|at| at as usize))])
                })
            })
        })
    };
    (0..skip::LEVELS).take_while(|&level| clear(i64::from(skip::RADII[level]))).last().unwrap_or(0)
}

fn each_transparent(field: &GainField, mut check: impl FnMut(usize, usize)) {
    for index in 0..field.grid().voxel_count() {
        let code = field.codes[field.layout.padded(index)];
        if skip::is_transparent(code) {
            let voxel = field.grid().voxel(index);
            check(usize::from(code), slow_level(field, [voxel.x, voxel.y, voxel.z].map(usize::from)));
        }
    }
}

#[test]
fn skip_levels_tell_the_transparent_room_ahead() {
    let mut highest = 0;
    // A height above 64 takes two words per column; one that is no multiple of 8 leaves a rest.
    for (seed, dims) in [[40, 20, 20], [30, 25, 70], [9, 40, 13]].into_iter().enumerate() {
        let grid = Grid { voxel_m: 0.02, dims, origin: [0.0; 3] };
        each_transparent(&GainField::new(&patchy(grid, seed as u64)), |level, slow| {
            highest = highest.max(level);
            assert_eq!(level, slow);
        });
    }
    assert!(highest >= 3);
}

#[test]
fn a_second_look_from_the_same_place_gains_next_to_nothing() {
    let (array, density) = (standard(), RayDensity::FULL);
    let field = GainField::new(&patchy(Grid::for_shelf([0.80, 0.40, 0.40], 0.01), 3));
    let ids = [ViewId(100), ViewId(290)];
    let single = gain_of_views(&field, &array, &ids, density);
    let second = gain_of_views(&field.with_view(&array, ids[0]), &array, &ids, density);
    assert!(single[0] > 100.0 && second[0] < 0.03 * single[0], "{single:?} {second:?}");
    assert!(second[1] > 0.06 * single[1], "{single:?} {second:?}");
}

#[test]
fn seen_voxels_block_but_no_longer_inform() {
    let (array, density) = (standard(), RayDensity::COARSE);
    let field = GainField::new(&Belief::uniform(small_grid()));
    let ids = [ViewId(150)];
    let parts = gain_per_voxel(&field, &array, ids[0], density);
    let mut seen = VoxelSet::empty(field.grid());
    parts.iter().take(parts.len() / 2).for_each(|part| seen.insert(part.0));
    let rest: f64 = parts.iter().filter(|part| !seen.contains(part.0)).map(|part| f64::from(part.1)).sum();
    let gain = f64::from(gain_of_views(&field.with_seen(&seen), &array, &ids, density)[0]);
    assert!(rest > 1.0 && (gain - rest).abs() < 1e-4 * rest, "{gain} {rest}");
    // Seeing more later keeps what was seen before.
    let mut others = VoxelSet::empty(field.grid());
    parts.iter().filter(|part| !seen.contains(part.0)).for_each(|part| others.insert(part.0));
    assert_eq!(gain_of_views(&field.with_seen(&seen).with_seen(&others), &array, &ids, density), [0.0]);
}

#[test]
fn after_a_push_only_what_was_unseen_before_it_is_gained() {
    let (array, density, grid) = (standard(), RayDensity::COARSE, small_grid());
    let ids: Vec<ViewId> = (0..300).step_by(37).map(ViewId).collect();
    let mut half = VoxelSet::empty(&grid);
    (0..grid.voxel_count()).step_by(2).for_each(|index| half.insert(index));
    let mut most = 0.0_f32;
    for seed in 0..12 {
        let belief = patchy(grid, seed);
        let prediction = prediction(&grid, seed);
        let predicted = GainField::new(&after(&belief, &prediction));
        let seen = GainField::new(&belief).with_seen(&half);
        let gained = gain_of_views(&seen.with_prediction(&prediction), &array, &ids, density);
        for (&view, gained) in ids.iter().zip(&gained) {
            let parts = gain_per_voxel(&predicted, &array, view, density);
            let unseen: f64 = parts.iter().filter(|part| !half.contains(part.0)).map(|part| f64::from(part.1)).sum();
            assert!((f64::from(*gained) - unseen).abs() < 1e-3 * unseen.max(1.0), "{gained} {unseen}");
            most = most.max(*gained);
        }
        assert_eq!(RayGains::new(&seen, &array, &ids, density).under(&prediction), gained);
    }
    assert!(most > 1.0, "{most}");
}

#[test]
fn the_lazy_pair_is_the_greedy_pair() {
    let (array, density) = (standard(), RayDensity { stride_px: 24 });
    let ids: Vec<ViewId> = (0..300).map(ViewId).collect();
    for seed in 0..5 {
        let field = GainField::new(&patchy(small_grid(), seed));
        let mut gains = gain_of_views(&field, &array, &ids, density);
        // Some views are used.
        gains.iter_mut().skip(seed as usize).step_by(7).for_each(|gain| *gain = 0.0);
        let best = |gains: &[f32]| (0..300).rev().max_by(|&a, &b| gains[a].total_cmp(&gains[b])).unwrap();
        let first = best(&gains);
        let mut added = gain_of_views(&field.with_view(&array, ViewId(first as u16)), &array, &ids, density);
        (0..300).filter(|&view| view == first || gains[view] == 0.0).for_each(|view| added[view] = -1.0);
        let second = best(&added);
        let pair = best_pair(&field, &array, &gains, density).unwrap();
        assert_eq!((pair.first, pair.first_gain), (ViewId(first as u16), gains[first]));
        assert_eq!((pair.second, pair.second_gain), (Some(ViewId(second as u16)), added[second]));
        assert_eq!(pair.total(), gains[first] + added[second]);
    }
    let field = GainField::new(&patchy(small_grid(), 0));
    let mut gains = vec![0.0; 300];
    assert_eq!(best_pair(&field, &array, &gains, density), None);
    gains[7] = 1.0;
    let alone = best_pair(&field, &array, &gains, density).unwrap();
    assert_eq!((alone.first, alone.second, alone.total()), (ViewId(7), None, 1.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_predicted_field_is_that_of_the_predicted_belief(seed in 0_u64..1_000_000) {
        let grid = small_grid();
        let (belief, prediction, array) = (patchy(grid, seed), prediction(&grid, seed), standard());
        let ids: Vec<ViewId> = (0..300).step_by(11).map(ViewId).collect();
        let (field, fresh) = (GainField::new(&belief), GainField::new(&after(&belief, &prediction)));
        let predicted = field.with_prediction(&prediction);
        for (code, fresh) in predicted.codes.iter().zip(&fresh.codes) {
            prop_assert!(code == fresh || skip::is_transparent(*code) && code < fresh && skip::is_transparent(*fresh));
        }
        let full = gain_of_views(&fresh, &array, &ids, RayDensity::COARSE);
        prop_assert_eq!(&gain_of_views(&predicted, &array, &ids, RayDensity::COARSE), &full);
        let rays = RayGains::new(&field, &array, &ids, RayDensity::COARSE);
        prop_assert_eq!(rays.gains(), gain_of_views(&field, &array, &ids, RayDensity::COARSE));
        prop_assert_eq!(rays.under(&prediction), full);
    }

    #[test]
    fn a_second_view_never_adds_more_than_it_tells_alone(seed in 0_u64..1_000_000, first in 0_u16..300) {
        let (array, field) = (standard(), GainField::new(&patchy(small_grid(), seed)));
        let ids: Vec<ViewId> = (0..300).step_by(7).map(ViewId).collect();
        let alone = gain_of_views(&field, &array, &ids, RayDensity::COARSE);
        let added = gain_of_views(&field.with_view(&array, ViewId(first)), &array, &ids, RayDensity::COARSE);
        prop_assert!(alone.iter().zip(&added).all(|(alone, added)| added <= alone && *added >= 0.0));
    }
}
