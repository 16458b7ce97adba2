//! How long the information gain takes, beside its target and beside brute force: `cargo bench --bench gain`.
//!
//! Two mid-episode beliefs over the design's grid: one as sure of itself as a network's (0.02 in seen space, 0.97 on
//! surfaces, 0.5 elsewhere), one of classical log-odds after ten views.

use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use nudge_core::belief::{Belief, Prediction, bernoulli_entropy};
use nudge_core::camera::{Intrinsics, View, ViewArray, ViewId};
use nudge_core::gain::{
    Coverage, GainField, Openings, RayDensity, RayGains, best_pair, gain_of_views, informed_voxels,
};
use nudge_core::grid::{Grid, VoxelSet, Window};
use nudge_core::rng::stream;
use nudge_core::{Point, Pose, Vector};
use rand::Rng;
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;

fn main() {
    let array = standard();
    let grid = Grid::for_shelf([0.80, 0.40, 0.40], 0.005);
    let solid = boxes_and_cylinders(&grid);
    println!("information gain on {} threads", rayon::current_num_threads());
    for (name, belief) in [("network", network(&grid, &array, &solid)), ("classical", classical(&grid, &array, &solid))]
    {
        report(name, &belief, &array);
    }
}

fn report(name: &str, belief: &Belief, array: &ViewArray) {
    let grid = &belief.grid;
    let share = |pick: &dyn Fn(f32) -> bool| {
        (0..grid.voxel_count()).filter(|&i| pick(belief.probability(i))).count() as f64 / grid.voxel_count() as f64
    };
    let (clear, opaque) = (share(&|p| p < 0.05), share(&|p| p > 0.95));
    println!("\n{name} belief: {:.0} % transparent, {:.0} % opaque", 100.0 * clear, 100.0 * opaque);
    let all: Vec<ViewId> = (0..array.views.len() as u16).map(ViewId).collect();
    let field = GainField::new(belief);
    let density = RayDensity::FULL;
    let mut gains = Vec::new();
    let built = best_of(5, || drop(black_box(GainField::new(belief))));
    let full = best_of(5, || gains = gain_of_views(&field, array, &all, density));
    let (mut slow_gains, mut visits) = (Vec::new(), 0);
    let brute = best_of(1, || (slow_gains, visits) = brute_force(belief, array, density));
    let off = gains.iter().zip(&slow_gains).map(|(a, b)| (f64::from(*a) / b - 1.0).abs()).fold(0.0, f64::max);
    print_row("field from belief", built, None, "");
    print_row("all 300 views", full, Some(0.30), &format!("{:.1} times as fast as brute force", brute / full));
    print_row(
        "  brute force",
        brute,
        None,
        &format!("{:.0} M visits; differs by at most {off:.1e}", visits as f64 / 1e6),
    );
    let pair = best_of(3, || _ = black_box(best_pair(&field, array, &gains, density)));
    print_row("best pair, given the gains", pair, None, "");

    let seen = field.with_seen(&seen_by(&field, array, &all));
    let rays = best_of(3, || _ = black_box(gain_of_views(&seen, array, &all, density)));
    let coverage = best_of(3, || {
        let coverage = Coverage::new(&seen, array, &all, density);
        black_box(coverage.best_pair(&coverage.gains(), |_| true));
    });
    print_row("all 300 views after three looks, by rays", rays, Some(0.30), "");
    print_row("  by coverage, with the best pair", coverage, Some(0.30), "");

    let coarse: Vec<ViewId> = all.iter().copied().step_by(5).collect();
    let pushes: Vec<Prediction> = (0..80).map(|index| prediction(belief, index)).collect();
    let base = best_of(3, || drop(black_box(RayGains::new(&field, array, &coarse, RayDensity::COARSE))));
    let rays = RayGains::new(&field, array, &coarse, RayDensity::COARSE);
    let mut under: Vec<Vec<f32>> = Vec::new();
    let rescored = best_of(3, || under = pushes.par_iter().map(|push| rays.under(push)).collect());
    let mut whole = Vec::new();
    let computed = best_of(1, || {
        let gains = |push| gain_of_views(&field.with_prediction(push), array, &coarse, RayDensity::COARSE);
        whole = pushes.iter().map(gains).collect();
    });
    assert!(under == whole, "rescoring is exact");
    print_row("60 coarse views, every ray kept", base, None, "");
    let note = format!("{:.1} times as fast as walking all rays", computed / rescored);
    print_row("80 predicted pushes x 60 coarse views", rescored, Some(0.25), &note);
    let base = best_of(3, || drop(black_box(Openings::new(&field, array, &coarse, RayDensity::COARSE))));
    let openings = Openings::new(&field, array, &coarse, RayDensity::COARSE);
    let opened = best_of(3, || {
        black_box(openings.under_each(&pushes));
    });
    print_row("what 60 coarse views reach together", base, None, "");
    print_row("80 predicted pushes: what they open", opened, None, "");
}

/// What three of the views show.
fn seen_by(field: &GainField, array: &ViewArray, all: &[ViewId]) -> VoxelSet {
    let mut seen = VoxelSet::empty(field.grid());
    for &view in all.iter().skip(30).step_by(100) {
        seen.union_with(&informed_voxels(field, array, view, RayDensity::gapless(field.grid(), array)));
    }
    seen
}

fn print_row(what: &str, seconds: f64, target: Option<f64>, note: &str) {
    let target = target.map_or(String::new(), |target| format!("target {:.0} ms", target * 1e3));
    println!("  {what:40} {:8.1} ms  {target:14}  {note}", seconds * 1e3);
}

fn best_of(times: usize, mut run: impl FnMut()) -> f64 {
    let once = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    (0..times).map(once).fold(f64::INFINITY, f64::min)
}

/// The formula on the belief itself with the grid's own traversal: no codes, no tables, no skipping; stops where the
/// fast one stops.
fn brute_force(belief: &Belief, array: &ViewArray, density: RayDensity) -> (Vec<f64>, u64) {
    let per_view: Vec<(f64, u64)> = array
        .views
        .par_iter()
        .map(|view| {
            let (mut gain, mut visits) = (0.0, 0);
            for_each_pixel(array, density.stride_px, view.id, |from, direction| {
                let Some((entry, direction)) = entry(&belief.grid, from, direction) else { return };
                let mut left = 1.0_f32;
                for crossing in belief.grid.traverse(entry, direction, f32::INFINITY) {
                    visits += 1;
                    let p = belief.probability(crossing.index);
                    if p > 0.95 || left < 1e-4 {
                        break;
                    } else if p >= 0.05 {
                        gain += f64::from(left * bernoulli_entropy(p));
                        left *= 1.0 - p;
                    }
                }
            });
            (gain, visits)
        })
        .collect();
    (per_view.iter().map(|view| view.0).collect(), per_view.iter().map(|view| view.1).sum())
}

/// Where a ray enters the shelf through its open front.
fn entry(grid: &Grid, from: Point, direction: Vector) -> Option<(Point, Vector)> {
    let entry = from - direction * (from.y / direction.y);
    let inside = |axis: usize| entry[axis] >= grid.min()[axis] && entry[axis] < grid.max()[axis];
    (direction.y > 0.0 && inside(0) && inside(2)).then(|| (Point::new(entry.x, 0.0, entry.z), direction))
}

fn for_each_pixel(array: &ViewArray, stride: usize, view: ViewId, mut each: impl FnMut(Point, Vector)) {
    let pose = array.views[usize::from(view.0)].world_from_camera;
    let camera = &array.intrinsics;
    for u in (0..camera.width / stride).map(|i| (i as f32 + 0.5) * stride as f32) {
        for v in (0..camera.height / stride).map(|i| (i as f32 + 0.5) * stride as f32) {
            let right = (u - camera.width as f32 / 2.0) / camera.focal_px;
            let down = (v - camera.height as f32 / 2.0) / camera.focal_px;
            each(pose.translation.vector.into(), pose.rotation * Vector::new(right, down, 1.0));
        }
    }
}

/// Whether each voxel is inside an object: a crowded shelf of boxes and cylinders.
fn boxes_and_cylinders(grid: &Grid) -> Vec<bool> {
    let mut rng = stream(1, "bench scene", 0);
    let mut solid = vec![false; grid.voxel_count()];
    for index in 0..60 {
        let (x, y) = (rng.random_range(-0.36..0.36_f32), rng.random_range(0.04..0.36_f32));
        let (a, b) = (rng.random_range(0.03..0.06_f32), rng.random_range(0.03..0.06_f32));
        let height = rng.random_range(0.08..0.25_f32);
        let covers = |cell: usize| {
            let at = grid.cell_center(grid.cell(cell));
            let (dx, dy) = ((at.x - x).abs(), (at.y - y).abs());
            if index % 2 == 0 { dx < a && dy < b } else { dx.hypot(dy) < a }
        };
        let cells: Vec<usize> = (0..grid.cell_count()).filter(|&cell| covers(cell)).collect();
        if x.abs() + a < 0.4 && y + b < 0.4 && y > b && cells.iter().all(|&cell| !solid[grid.column(cell).start]) {
            cells.iter().for_each(|&cell| solid[grid.column(cell)][..grid.levels_below(height)].fill(true));
        }
    }
    solid
}

/// What a view sees: 1 surface, -1 free, 0 hidden, with the closure of columns.
fn look(grid: &Grid, array: &ViewArray, solid: &[bool], view: ViewId) -> Vec<i8> {
    let mut seen = vec![0_i8; grid.voxel_count()];
    for_each_pixel(array, 2, view, |from, direction| {
        let Some((entry, direction)) = entry(grid, from, direction) else { return };
        for crossing in grid.traverse(entry, direction, f32::INFINITY) {
            if solid[crossing.index] {
                seen[crossing.index] = 1;
                break;
            } else if seen[crossing.index] == 0 {
                seen[crossing.index] = -1;
            }
        }
    });
    for column in seen.chunks_exact_mut(grid.dims[2]) {
        let top = column.iter().rposition(|&seen| seen == 1).map_or(0, |z| z + 1);
        column[..top].fill(1);
        if let Some(free) = column[top..].iter().position(|&seen| seen == -1) {
            column[top + free..].fill(-1);
        }
    }
    seen
}

fn looks(grid: &Grid, array: &ViewArray, solid: &[bool], count: usize) -> Vec<Vec<i8>> {
    (0..count).into_par_iter().map(|k| look(grid, array, solid, ViewId(((k * 67 + 31) % 300) as u16))).collect()
}

/// A network's belief after five views.
fn network(grid: &Grid, array: &ViewArray, solid: &[bool]) -> Belief {
    let mut belief = Belief::uniform(*grid);
    for seen in looks(grid, array, solid, 5) {
        for (beta, seen) in belief.occupancy.iter_mut().zip(seen) {
            match seen {
                1 => *beta = [9.7, 0.3],
                -1 => *beta = [0.2, 9.8],
                _ => {}
            }
        }
    }
    belief
}

/// Log-odds of 0.85 per observation after ten views, clamped at 3.5.
fn classical(grid: &Grid, array: &ViewArray, solid: &[bool]) -> Belief {
    let mut log_odds = vec![0.0_f32; grid.voxel_count()];
    for seen in looks(grid, array, solid, 10) {
        for (log_odds, seen) in log_odds.iter_mut().zip(seen) {
            *log_odds = (*log_odds + 0.85 * f32::from(seen)).clamp(-3.5, 3.5);
        }
    }
    let mut belief = Belief::uniform(*grid);
    for (beta, log_odds) in belief.occupancy.iter_mut().zip(log_odds) {
        let p = 1.0 / (1.0 + (-log_odds).exp());
        *beta = [10.0 * p, 10.0 * (1.0 - p)];
    }
    belief
}

/// A push from the front: a strip of 4 cm is swept free up to 12 cm, and what is near the path, in a window of 0.25 x
/// 0.20 m, loses half of its evidence.
fn prediction(belief: &Belief, index: u64) -> Prediction {
    let grid = &belief.grid;
    let mut rng = stream(2, "bench push", index);
    let (x, y) = (rng.random_range(0..grid.dims[0] - 50), rng.random_range(0..grid.dims[1] - 40));
    let window = Window { x: [x, x + 50], y: [y, y + 40] };
    let mut occupancy = Vec::new();
    for cell in window.cells(grid) {
        let swept = (x + 21..x + 29).contains(&usize::from(grid.cell(cell).x));
        for (z, beta) in belief.occupancy[grid.column(cell)].iter().enumerate() {
            occupancy.push(match (swept && z < 24, z < 50) {
                (true, _) => [0.1, 9.9],
                (false, true) => beta.map(|a| 0.5 * (a + 1.0)),
                (false, false) => *beta,
            });
        }
    }
    let cells: Vec<usize> = window.cells(grid).collect();
    let semantics = cells.iter().map(|&cell| belief.semantics[cell]).collect();
    Prediction { window, occupancy, semantics, change: vec![0.5; cells.len()] }
}

/// The design's 300 views.
fn standard() -> ViewArray {
    let mut views = Vec::new();
    for i in 0..10 {
        for j in 0..10 {
            let (u, v) = (i as f32 / 9.0, j as f32 / 9.0);
            let bulge = (std::f32::consts::PI * u).sin() * (std::f32::consts::PI * v).sin();
            let position = Point::new(-0.3375 + 0.675 * u, -0.20 - 0.10 * bulge, 0.055 + 0.2 * v);
            for (k, x) in [-0.3, 0.0, 0.3].into_iter().enumerate() {
                let target = [x, 0.25, 0.155];
                let forward = (Point::from(target) - position).normalize();
                let right = forward.cross(&Vector::z()).normalize();
                let axes = Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
                let rotation = UnitQuaternion::from_rotation_matrix(&axes);
                views.push(View {
                    id: ViewId(views.len() as u16),
                    world_from_camera: Pose::from_parts(Translation3::from(position.coords), rotation),
                    target,
                    slot: [i, j, k as u16],
                });
            }
        }
    }
    let intrinsics = Intrinsics { width: 640, height: 480, focal_px: 433.0, depth_range_m: [0.07, 1.5] };
    ViewArray { name: "standard300".to_owned(), intrinsics, layout: [10, 10, 3], views }
}
