//! The ground truth map of a scene: its bodies voxelised.
//!
//! A voxel is occupied where its centre is inside a body. A body that has no centre inside, because it is thinner than a
//! voxel, is taken to fill every voxel that it touches: so it is there for the map, for the scores, and for a verdict.

use crate::grid::Grid;
use crate::scene::{BACKGROUND, Body};
use crate::solid::{HalfSpace, levels_inside};
use rayon::prelude::*;

/// A body of this thickness, in edges of a voxel, has a voxel's centre inside however it lies (the diagonal of a cube).
const THIN_VOXELS: f32 = 1.75;

/// The ground truth: the same shape as a belief's argmax (`ToMap(c)`).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TruthMap {
    /// Numbers of voxels along x, y, z.
    pub dims: [usize; 3],
    /// 1 where a voxel's centre is inside an object.
    pub occupancy: Vec<u8>,
    /// Class of the tallest occupied voxel above a floor cell, else background.
    pub labels: Vec<u8>,
    /// Object with the tallest occupied voxel above a floor cell, [`u16::MAX`] where none.
    pub objects: Vec<u16>,
}

/// A convex part in the shelf's frame with the cells that it may cover.
struct PlacedPart {
    faces: Vec<HalfSpace>,
    x: std::ops::Range<usize>,
    y: std::ops::Range<usize>,
    label: u8,
    object: u16,
}

impl TruthMap {
    /// Per floor cell, whether anything in its column differs from another truth over the same grid: a voxel, the class,
    /// or which object it is.
    pub fn changed_cells(&self, after: &Self) -> Vec<bool> {
        let height = self.dims[2];
        let columns = self.occupancy.chunks(height).zip(after.occupancy.chunks(height));
        let tops = self.labels.iter().zip(&self.objects).zip(after.labels.iter().zip(&after.objects));
        columns.zip(tops).map(|((a, b), (top_a, top_b))| a != b || top_a != top_b).collect()
    }

    /// Voxelises bodies exactly: point in shape at voxel centres; a body without any, by the voxels that it touches.
    /// Where two bodies reach the same level of a column, its label is the earlier one's.
    pub fn of(grid: &Grid, bodies: &[Body]) -> Self {
        let mut truth = Self::of_centers(grid, bodies);
        let mut is_there = vec![false; bodies.iter().map(|body| usize::from(body.id.0) + 1).max().unwrap_or(0)];
        for object in truth.objects.iter().filter(|object| **object != u16::MAX) {
            is_there[usize::from(*object)] = true;
        }
        let is_thin = |body: &Body| body.thickness_m() < THIN_VOXELS * grid.voxel_m;
        for body in bodies.iter().filter(|body| !is_there[usize::from(body.id.0)] && is_thin(body)) {
            truth.add_thin(grid, body);
        }
        truth
    }

    /// Per voxel, the object that has its centre inside, the later one where two overlap; [`u16::MAX`] where none has.
    pub fn owners(grid: &Grid, bodies: &[Body]) -> Vec<u16> {
        let parts = placed_parts(grid, bodies);
        let [_, depth, height] = grid.dims;
        let mut owners = vec![u16::MAX; grid.voxel_count()];
        owners.par_chunks_mut(depth * height).enumerate().with_min_len(grid.dims[0].div_ceil(16)).for_each(
            |(x, owners)| {
                for part in parts.iter().filter(|part| part.x.contains(&x)) {
                    for y in part.y.clone() {
                        let levels = levels_inside(grid, x * depth + y, &part.faces);
                        owners[y * height..(y + 1) * height][levels].fill(part.object);
                    }
                }
            },
        );
        owners
    }

    /// Adds a thin body if no voxel's centre is inside. Of the cells that it touches it names those where nothing
    /// is taller, or all where there is none of these.
    fn add_thin(&mut self, grid: &Grid, body: &Body) {
        let mut parts = placed_parts(grid, std::slice::from_ref(body));
        let [_, depth, height] = self.dims;
        let columns = |parts: &[PlacedPart]| {
            let mut columns = Vec::new();
            for part in parts {
                for x in part.x.clone() {
                    let cells = part.y.clone().map(|y| x * depth + y);
                    let levels = cells.map(|cell| (cell, levels_inside(grid, cell, &part.faces)));
                    columns.extend(levels.filter(|(_, levels)| !levels.is_empty()));
                }
            }
            columns
        };
        if !columns(&parts).is_empty() {
            // Something stands over it.
            return;
        }
        for face in parts.iter_mut().flat_map(|part| &mut part.faces) {
            // A face moved out by this much has the centres of all voxels inside that it cuts.
            face.offset += 0.5 * grid.voxel_m * face.normal.abs().sum();
        }
        let touched = columns(&parts);
        let top = |cell: usize| self.occupancy[cell * height..(cell + 1) * height].iter().rposition(|o| *o == 1);
        let mut named: Vec<usize> = touched
            .iter()
            .filter(|(cell, levels)| top(*cell).is_none_or(|top| top < levels.end))
            .map(|(c, _)| *c)
            .collect();
        if named.is_empty() {
            named = touched.iter().map(|(cell, _)| *cell).collect();
        }
        for cell in named {
            (self.labels[cell], self.objects[cell]) = (body.class.0, body.id.0);
        }
        for (cell, levels) in touched {
            self.occupancy[cell * height..(cell + 1) * height][levels].fill(1);
        }
    }

    fn of_centers(grid: &Grid, bodies: &[Body]) -> Self {
        let parts = placed_parts(grid, bodies);
        let [width, depth, height] = grid.dims;
        let mut truth = Self {
            dims: grid.dims,
            occupancy: vec![0; grid.voxel_count()],
            labels: vec![BACKGROUND.0; grid.cell_count()],
            objects: vec![u16::MAX; grid.cell_count()],
        };
        let slabs = truth
            .occupancy
            .par_chunks_mut(depth * height)
            .zip(truth.labels.par_chunks_mut(depth).zip(truth.objects.par_chunks_mut(depth)));
        slabs.enumerate().with_min_len(width.div_ceil(16)).for_each(|(x, (occupancy, (labels, objects)))| {
            // One past the highest occupied level so far.
            let mut tops = vec![0; depth];
            for part in parts.iter().filter(|part| part.x.contains(&x)) {
                for y in part.y.clone() {
                    let levels = levels_inside(grid, x * depth + y, &part.faces);
                    if levels.is_empty() {
                        continue;
                    }
                    if levels.end > tops[y] {
                        (tops[y], labels[y], objects[y]) = (levels.end, part.label, part.object);
                    }
                    occupancy[y * height..(y + 1) * height][levels].fill(1);
                }
            }
        });
        truth
    }
}

fn placed_parts(grid: &Grid, bodies: &[Body]) -> Vec<PlacedPart> {
    let mut placed = Vec::new();
    for body in bodies {
        let pose = &body.world_from_body;
        for part in &body.solid.parts {
            let Some(bounds) = crate::solid::Bounds::around(part.vertices.iter().map(|v| pose * v)) else { continue };
            let cells = |axis: usize| {
                let clip = |m: f32| ((m - grid.origin[axis]) / grid.voxel_m).clamp(0.0, grid.dims[axis] as f32);
                clip(bounds.min[axis]).floor() as usize..clip(bounds.max[axis]).ceil() as usize
            };
            let faces = part.planes.iter().map(|plane| {
                let normal = pose.rotation * plane.normal;
                HalfSpace { normal, offset: plane.offset + normal.dot(&pose.translation.vector) }
            });
            placed.push(PlacedPart {
                faces: faces.collect(),
                x: cells(0),
                y: cells(1),
                label: body.class.0,
                object: body.id.0,
            });
        }
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ClassId, ObjectId};
    use crate::solid::{ConvexPart, Solid};
    use crate::{Point, Pose, Vector};
    use nalgebra::{Translation3, UnitQuaternion};
    use proptest::prelude::*;
    use std::sync::Arc;

    fn grid() -> Grid {
        Grid::for_shelf([0.80, 0.40, 0.40], 0.005)
    }

    fn body(id: u16, class: u8, solid: Solid, pose: Pose) -> Body {
        Body {
            id: ObjectId(id),
            class: ClassId(class),
            solid: Arc::new(solid),
            world_from_body: pose,
            mass_kg: 0.4,
            friction: 0.5,
        }
    }

    fn cylinder(radius: f32, height: f32) -> Solid {
        let ring = (0..64).flat_map(|i| {
            let (sin, cos) = (i as f32 * std::f32::consts::TAU / 64.0).sin_cos();
            [0.0, height].map(|z| Point::new(radius * cos, radius * sin, z))
        });
        Solid { parts: ConvexPart::hull(&ring.collect::<Vec<_>>()).into_iter().collect() }
    }

    #[test]
    fn volumes_are_the_analytic_ones() {
        let voxel: f32 = 0.005_f32.powi(3);
        let volume = |solid: Solid, pose: Pose| {
            let truth = TruthMap::of(&grid(), &[body(0, 3, solid, pose)]);
            truth.occupancy.iter().map(|&o| f32::from(o)).sum::<f32>() * voxel
        };
        let turned = Pose::from_parts(
            Translation3::new(0.013, 0.2, 0.0),
            UnitQuaternion::from_axis_angle(&Vector::z_axis(), 0.6),
        );
        let box_m3 = volume(Solid::standing_box(Vector::new(0.12, 0.06, 0.2)), turned);
        assert!((box_m3 / (0.12 * 0.06 * 0.2) - 1.0).abs() < 0.02, "{box_m3}");
        let can_m3 = volume(cylinder(0.05, 0.2), turned);
        assert!((can_m3 / (std::f32::consts::PI * 0.05 * 0.05 * 0.2) - 1.0).abs() < 0.02, "{can_m3}");
        let lying =
            Pose::from_parts(Translation3::new(0.0, 0.3, 0.1), UnitQuaternion::from_axis_angle(&Vector::x_axis(), 1.1));
        let tilted_m3 = volume(cylinder(0.05, 0.2), lying);
        assert!((tilted_m3 / (std::f32::consts::PI * 0.05 * 0.05 * 0.2) - 1.0).abs() < 0.02, "{tilted_m3}");
    }

    #[test]
    fn the_tallest_body_names_the_cell() {
        let low = body(4, 1, Solid::standing_box(Vector::new(0.2, 0.2, 0.05)), Pose::translation(0.0, 0.2, 0.0));
        let high = body(7, 2, Solid::standing_box(Vector::new(0.05, 0.05, 0.05)), Pose::translation(0.0, 0.2, 0.05));
        let grid = grid();
        for bodies in [[low.clone(), high.clone()], [high, low]] {
            let truth = TruthMap::of(&grid, &bodies);
            let at = |x: f32, y: f32| grid.cell_index(grid.cell_at(Point::new(x, y, 0.0)).expect("inside"));
            assert_eq!((truth.labels[at(0.0, 0.2)], truth.objects[at(0.0, 0.2)]), (2, 7));
            assert_eq!((truth.labels[at(0.05, 0.2)], truth.objects[at(0.05, 0.2)]), (1, 4));
            assert_eq!((truth.labels[at(0.3, 0.2)], truth.objects[at(0.3, 0.2)]), (14, u16::MAX));
        }
    }

    #[test]
    fn a_body_thinner_than_a_voxel_fills_what_it_touches() {
        let grid = grid();
        let sheet = |id: u16, y: f32| {
            body(id, 11, Solid::standing_box(Vector::new(0.10, 0.001, 0.10)), Pose::translation(0.0, y, 0.0))
        };
        // Between two rows of centres, where no centre is inside.
        let truth = TruthMap::of(&grid, &[sheet(0, 0.2)]);
        let cells: Vec<usize> = (0..truth.objects.len()).filter(|cell| truth.objects[*cell] == 0).collect();
        assert!((20..=2 * 22).contains(&cells.len()), "{} cells", cells.len());
        assert!(cells.iter().all(|cell| truth.labels[*cell] == 11));
        let column = grid.column(cells[0]);
        let tall = truth.occupancy[column].iter().filter(|o| **o == 1).count();
        assert!((20..=21).contains(&tall), "{tall} levels");
        // A taller body beside it keeps its own cells; the sheet still has some.
        let tower = body(1, 2, Solid::standing_box(Vector::new(0.10, 0.05, 0.2)), Pose::translation(0.0, 0.2256, 0.0));
        let alone = TruthMap::of(&grid, std::slice::from_ref(&tower));
        let both = TruthMap::of(&grid, &[sheet(0, 0.2), tower]);
        let of = |truth: &TruthMap, object: u16| truth.objects.iter().filter(|o| **o == object).count();
        assert!(of(&both, 0) > 0 && of(&both, 1) == of(&alone, 1), "{} {}", of(&both, 0), of(&both, 1));
        // What is inside another body altogether has voxels and no cells, as before.
        let inner = body(2, 3, Solid::standing_box(Vector::new(0.05, 0.05, 0.05)), Pose::translation(0.2, 0.2, 0.0));
        let outer = body(3, 4, Solid::standing_box(Vector::new(0.10, 0.10, 0.10)), Pose::translation(0.2, 0.2, 0.0));
        assert_eq!(of(&TruthMap::of(&grid, &[inner, outer]), 2), 0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// The columns' answer is that of testing every voxel centre, in any pose, up to rounding on the surface.
        #[test]
        fn columns_agree_with_points(
            x in -0.4_f32..0.4, y in 0.0_f32..0.4, z in -0.1_f32..0.3,
            axis in prop::array::uniform3(-1.0_f32..1.0), angle in 0.0_f32..3.1,
        ) {
            let axis = nalgebra::Unit::try_new(Vector::from(axis), 0.1);
            let rotation = axis.map_or(UnitQuaternion::identity(), |axis| UnitQuaternion::from_axis_angle(&axis, angle));
            let solid = cylinder(0.04, 0.15);
            let placed = body(0, 5, solid.clone(), Pose::from_parts(Translation3::new(x, y, z), rotation));
            let grid = grid();
            let truth = TruthMap::of(&grid, std::slice::from_ref(&placed));
            for index in 0..grid.voxel_count() {
                let local = placed.world_from_body.inverse_transform_point(&grid.center(grid.voxel(index)));
                let height = |p: &HalfSpace| p.normal.dot(&local.coords) - p.offset;
                let outside = solid.parts[0].planes.iter().map(height).fold(f32::NEG_INFINITY, f32::max);
                if outside.abs() > 1e-5 {
                    prop_assert_eq!(truth.occupancy[index] == 1, outside < 0.0);
                }
            }
        }
    }
}
