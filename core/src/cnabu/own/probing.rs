//! What a module is asked once before it is used: a look and a manipulation that hold something of every kind.

use crate::belief::{Flow, Intervention, Stroke};
use crate::camera::{MapObservation, UNOBSERVED};
use crate::grid::{Grid, VoxelSet, Window};
use crate::scene::CLASS_COUNT;
use crate::{Point, Vector};

/// A look: every third voxel is occupied, every third free; of sixteen cells, fifteen have a label.
pub(super) fn probe_observation(grid: &Grid) -> MapObservation {
    let (mut free, mut occupied) = (VoxelSet::empty(grid), VoxelSet::empty(grid));
    for voxel in 0..grid.voxel_count() {
        match voxel % 3 {
            0 => occupied.insert(voxel),
            1 => free.insert(voxel),
            _ => {}
        }
    }
    let label = |cell: usize| if cell % 16 < CLASS_COUNT { (cell % 16) as u8 } else { UNOBSERVED };
    MapObservation { free, occupied, labels: (0..grid.cell_count()).map(label).collect() }
}

/// A push of a tenth of the depth into the middle of the shelf.
pub(super) fn probe_intervention(grid: &Grid) -> Intervention {
    let [width, depth, _] = grid.dims;
    let mut swept = VoxelSet::empty(grid);
    let tenth = depth.div_ceil(10);
    let window = Window { x: [width / 2, width / 2 + 1], y: [0, tenth] };
    window.cells(grid).flat_map(|cell| grid.column(cell)).for_each(|voxel| swept.insert(voxel));
    let length_m = tenth as f32 * grid.voxel_m;
    let flow = Flow { window, displacement_m: vec![Some([0.0, length_m]); window.cell_count()] };
    let start = Point::new(grid.origin[0] + 0.5 * width as f32 * grid.voxel_m, grid.origin[1], grid.origin[2]);
    Intervention { swept, flow, stroke: Stroke { start, direction: Vector::y(), length_m }, held: None }
}
