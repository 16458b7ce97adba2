//! What a click in a three-dimensional view is about: the first drawn voxel under the pointer, or the floor cell.
//!
//! It follows the ray from the eye through the pointer by itself. The viewer's own answer is of the frame before, may be an
//! outline that lies in front, and does not come when the same instance is clicked again.

use super::Drawn;
use crate::workbench::picked::Picked;
use crate::workbench::ray::Ray;
use nudge_core::grid::{Grid, VoxelSet};

/// How far a ray is followed, metres: beyond any shelf.
const FAR_M: f32 = 100.0;

/// The first voxel of an entity that the ray meets, or else the floor cell that it meets.
pub fn first(grid: &Grid, drawn: &Drawn, entity: &str, ray: Ray) -> Option<Picked> {
    let mut voxels = VoxelSet::empty(grid);
    let count = grid.voxel_count();
    drawn.voxels(entity).iter().filter(|voxel| **voxel < count).for_each(|voxel| voxels.insert(*voxel));
    let hit = grid.traverse(ray.origin, ray.direction, FAR_M).map(|step| step.index).find(|at| voxels.contains(*at));
    hit.map(Picked::Voxel).or_else(|| floor(grid, ray).map(Picked::Cell))
}

/// The floor cell that a ray meets.
fn floor(grid: &Grid, ray: Ray) -> Option<usize> {
    let t = (grid.min().z - ray.origin.z) / ray.direction.z;
    let at = ray.origin + ray.direction * t;
    (t.is_finite() && t > 0.0).then(|| grid.cell_at(at)).flatten().map(|cell| grid.cell_index(cell))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::{Point, Vector};

    #[test]
    fn a_ray_meets_the_nearest_drawn_voxel_and_else_the_floor() {
        let grid = Grid::for_shelf([0.1, 0.1, 0.1], 0.01);
        let drawn = Drawn::default();
        let at = |x, y, z| grid.index(grid.voxel_at(Point::new(x, y, z)).expect("inside"));
        let (near, far) = (at(0.005, 0.025, 0.055), at(0.005, 0.085, 0.055));
        drawn.set("belief", vec![far, near]);
        // From the front, level: the nearer of two in a row.
        let direction = Vector::new(0.0, 1.0, 0.0);
        let level = Ray { origin: grid.center(grid.voxel(near)) - 0.5 * direction, direction };
        assert_eq!(first(&grid, &drawn, "belief", level), Some(Picked::Voxel(near)));
        drawn.set("belief", vec![far]);
        assert_eq!(first(&grid, &drawn, "belief", level), Some(Picked::Voxel(far)));
        assert_eq!(first(&grid, &drawn, "other", level), None, "level, it never meets the floor");
        // From above.
        let cell = grid.cell_at(grid.center(grid.voxel(near))).expect("a cell");
        let down =
            Ray { origin: grid.cell_center(cell) + Vector::new(0.0, 0.0, 1.0), direction: Vector::new(0.0, 0.0, -1.0) };
        drawn.set("belief", Vec::new());
        assert_eq!(first(&grid, &drawn, "belief", down), Some(Picked::Cell(grid.cell_index(cell))));
        let up = Ray { direction: -down.direction, ..down };
        assert_eq!(first(&grid, &drawn, "belief", up), None);
    }
}
