//! Sparse voxel maps: only voxels that carry information, and of solid regions only the surface.

use crate::colors::{self, Colormap, Rgb};
use crate::picture;
use nudge_core::belief::{Belief, Prediction, bernoulli_entropy, beta_mean};
use nudge_core::grid::{Grid, Voxel, VoxelSet};
use nudge_core::scene::{BACKGROUND, Catalog, ClassId};
use nudge_core::world::TruthMap;
use rerun::VoxelGridMap;
use rerun::components::Colormap as Scale;

/// From this probability on a voxel is believed occupied; a voxel about which nothing is known is not.
const OCCUPIED: f32 = 0.5;
/// Edge of the blocks in which undecided space is shown, voxels.
const BLOCK: usize = 2;
/// A block whose mean entropy is below this is decided, nats.
const DECIDED: f32 = 0.35;

/// The voxels of a set that show from outside: those with a face neighbour beyond the set. The board counts as more
/// of the set, since nobody looks from below.
pub(crate) fn surface(grid: &Grid, inside: &[bool]) -> Vec<usize> {
    let [width, depth, height] = grid.dims;
    let strides = [depth * height, height, 1];
    let mut shown = Vec::new();
    for (index, _) in inside.iter().enumerate().filter(|(_, inside)| **inside) {
        let Voxel { x, y, z } = grid.voxel(index);
        let at = [x, y, z].map(usize::from);
        let open = [width, depth, height].iter().enumerate().any(|(axis, &size)| {
            let below = if at[axis] > 0 { !inside[index - strides[axis]] } else { axis != 2 };
            below || at[axis] + 1 == size || !inside[index + strides[axis]]
        });
        if open {
            shown.push(index);
        }
    }
    shown
}

/// The voxels at `indices` in place.
pub(crate) fn map(grid: &Grid, indices: &[usize]) -> VoxelGridMap {
    let positions = indices.iter().map(|&index| {
        let Voxel { x, y, z } = grid.voxel(index);
        [i32::from(x), i32::from(y), i32::from(z)]
    });
    VoxelGridMap::new(positions.map(rerun::datatypes::IVec3D), [grid.voxel_m; 3]).with_translation(grid.origin)
}

pub(crate) fn colored(grid: &Grid, indices: &[usize], rgb: impl Fn(usize) -> Rgb) -> VoxelGridMap {
    map(grid, indices).with_colors(indices.iter().map(|&index| rerun::Color::from(rgb(index))))
}

fn believed(belief: &Belief) -> Vec<usize> {
    let inside: Vec<bool> = belief.occupancy.iter().map(|a| beta_mean(*a) > OCCUPIED).collect();
    surface(&belief.grid, &inside)
}

/// Voxels believed occupied, by probability (viridis).
pub fn believed_occupied(belief: &Belief) -> VoxelGridMap {
    let shown = believed(belief);
    map(&belief.grid, &shown)
        .with_values(shown.iter().map(|&index| belief.probability(index)))
        .with_value_range([0.0, 1.0])
        .with_colormap(Scale::Viridis)
}

/// Voxels believed occupied, in the colour of the floor cell's likeliest class; grey where that is background or
/// unknown.
pub fn believed_classes(belief: &Belief, catalog: &Catalog) -> VoxelGridMap {
    let shown = believed(belief);
    let rgb_of_cell: Vec<Rgb> = (0..belief.grid.cell_count())
        .map(|cell| match picture::believed_class(belief, cell) {
            None | Some(BACKGROUND) => colors::UNKNOWN_RGB,
            Some(class) => colors::of_class(catalog, class),
        })
        .collect();
    colored(&belief.grid, &shown, |index| rgb_of_cell[index / belief.grid.dims[2]])
}

/// Space whose occupancy is undecided, in blocks, by entropy (magma).
pub fn undecided(belief: &Belief) -> VoxelGridMap {
    let fine = &belief.grid;
    let coarse =
        Grid { voxel_m: fine.voxel_m * BLOCK as f32, dims: fine.dims.map(|n| n.div_ceil(BLOCK)), origin: fine.origin };
    let mut sums = vec![(0.0_f32, 0_u32); coarse.voxel_count()];
    for (index, a) in belief.occupancy.iter().enumerate() {
        let Voxel { x, y, z } = fine.voxel(index);
        let [x, y, z] = [x, y, z].map(|i| i / BLOCK as u16);
        let sum = &mut sums[coarse.index(Voxel { x, y, z })];
        *sum = (sum.0 + bernoulli_entropy(beta_mean(*a)), sum.1 + 1);
    }
    let entropy: Vec<f32> = sums.into_iter().map(|(sum, count)| sum / count.max(1) as f32).collect();
    let inside: Vec<bool> = entropy.iter().map(|h| *h > DECIDED).collect();
    let shown = surface(&coarse, &inside);
    map(&coarse, &shown)
        .with_values(shown.iter().map(|&index| entropy[index]))
        .with_value_range([0.0, f64::from(std::f32::consts::LN_2)])
        .with_colormap(Scale::Magma)
        .with_opacity(0.35)
}

/// The true objects in the colours of their classes.
pub fn true_classes(grid: &Grid, truth: &TruthMap, catalog: &Catalog) -> VoxelGridMap {
    let inside: Vec<bool> = truth.occupancy.iter().map(|o| *o == 1).collect();
    colored(grid, &surface(grid, &inside), |index| {
        colors::of_class(catalog, ClassId(truth.labels[index / grid.dims[2]]))
    })
}

/// Orange where a voxel is believed occupied and is free, blue where it is occupied and not believed so.
pub fn errors(belief: &Belief, truth: &TruthMap) -> VoxelGridMap {
    let grid = &belief.grid;
    let believed = |index: usize| belief.probability(index) > OCCUPIED;
    let side = |more: bool| {
        let wrong = |index: usize| believed(index) == more && (truth.occupancy[index] == 1) != more;
        let inside: Vec<bool> = (0..grid.voxel_count()).map(wrong).collect();
        surface(grid, &inside)
    };
    let mut shown = [side(false), side(true)].concat();
    shown.sort_unstable();
    colored(grid, &shown, |index| if believed(index) { colors::HALLUCINATED_RGB } else { colors::MISSED_RGB })
}

/// The voxels of a gain that are drawn: those with next to no gain are left out.
pub(crate) fn telling(nats: &[(usize, f32)], top: f32) -> Vec<(usize, f32)> {
    nats.iter().copied().filter(|(_, nats)| *nats > 0.05 * top).collect()
}

/// The gain per voxel at the top of the colour scale, nats: what only one voxel in a hundred exceeds.
pub fn gain_top(nats: &[(usize, f32)]) -> f32 {
    let mut sorted: Vec<f32> = nats.iter().map(|(_, nats)| *nats).collect();
    sorted.sort_unstable_by(f32::total_cmp);
    sorted.get(sorted.len().saturating_sub(1) * 99 / 100).copied().unwrap_or(1.0)
}

/// Where a gain comes from (cividis, up to the 99th percentile so that a few voxels do not hide the rest).
pub fn gains(grid: &Grid, nats: &[(usize, f32)]) -> VoxelGridMap {
    let top = gain_top(nats);
    let telling = telling(nats, top);
    let shown: Vec<usize> = telling.iter().map(|(index, _)| *index).collect();
    colored(grid, &shown, |index| {
        let at = telling.binary_search_by_key(&index, |(index, _)| *index).unwrap_or(0);
        Colormap::Cividis.of(telling[at].1, [0.0, top])
    })
}

/// The space that the tool swept, see-through.
pub fn swept(grid: &Grid, swept: &VoxelSet) -> VoxelGridMap {
    let mut inside = vec![false; grid.voxel_count()];
    swept.iter().for_each(|index| inside[index] = true);
    colored(grid, &surface(grid, &inside), |_| [120, 200, 255]).with_opacity(0.25)
}

/// Voxels predicted occupied inside the push's window, by probability (viridis).
pub fn predicted(grid: &Grid, prediction: &Prediction) -> VoxelGridMap {
    let height = grid.dims[2];
    let mut probability = vec![0.0_f32; grid.voxel_count()];
    for (at, cell) in prediction.window.cells(grid).enumerate() {
        for (level, index) in grid.column(cell).enumerate() {
            probability[index] = beta_mean(prediction.occupancy[at * height + level]);
        }
    }
    let inside: Vec<bool> = probability.iter().map(|p| *p > OCCUPIED).collect();
    let shown = surface(grid, &inside);
    map(grid, &shown)
        .with_values(shown.iter().map(|&index| probability[index]))
        .with_value_range([0.0, 1.0])
        .with_colormap(Scale::Viridis)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_of_a_block_is_its_hull_without_the_floor() {
        let grid = Grid::for_shelf([0.05, 0.05, 0.05], 0.01);
        let mut inside = vec![false; grid.voxel_count()];
        for x in 1..4 {
            for y in 1..4 {
                for z in 0..3 {
                    inside[grid.index(Voxel { x, y, z })] = true;
                }
            }
        }
        // 27 voxels; the middle one and the one below it are hidden.
        let shown = surface(&grid, &inside);
        assert_eq!(shown.len(), 25);
        assert!(!shown.contains(&grid.index(Voxel { x: 2, y: 2, z: 0 })));
        assert!(!shown.contains(&grid.index(Voxel { x: 2, y: 2, z: 1 })));
    }

    #[test]
    fn a_voxel_at_the_grids_face_shows() {
        let grid = Grid::for_shelf([0.02, 0.02, 0.02], 0.01);
        assert_eq!(surface(&grid, &[true; 8]).len(), 8);
    }
}
