//! What pushes: one straight push, the gripper and links that carry it out, and the space they sweep.
//!
//! The tool is a closed two-finger gripper as a triangular prism (base 0.111 m, length 0.085 m, 35 mm thick) with the
//! last two links as boxes 70 mm wide, which trail towards the shelf's entrance. The tool's frame has its origin at
//! the finger tip and +y as the approach axis.

use crate::grid::{Cell, Grid, VoxelSet};
use crate::solid::{ConvexPart, HalfSpace, Solid, levels_inside};
use crate::{Point, Pose, Vector};
use serde::{Deserialize, Serialize};

/// One straight-line manipulation of the shelf: the tip goes in along +y to `start`, then `length_m` along
/// `direction_deg`, then back the same way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Push {
    /// Where the tip starts to push, metres.
    pub start: [f32; 3],
    /// Direction of the push in the plane of the board, degrees counter-clockwise from +x (90 is into the shelf).
    pub direction_deg: f32,
    /// How far the tip moves, metres.
    pub length_m: f32,
}

impl Push {
    /// The tip's position at the start.
    pub fn start_point(&self) -> Point {
        Point::from(self.start)
    }

    /// Unit direction of the push.
    pub fn direction(&self) -> Vector {
        let angle = self.direction_deg.to_radians();
        Vector::new(angle.cos(), angle.sin(), 0.0)
    }

    /// The tip's position at the end.
    pub fn end_point(&self) -> Point {
        self.start_point() + self.direction() * self.length_m
    }
}

/// How far before the shelf's front edge (y = 0) the finger tip is when the approach begins, metres.
pub const CLEARANCE_M: f32 = 0.02;
/// Two shapes that overlap by less than this do not touch, metres: a link whose side lies exactly on a voxel boundary
/// does not sweep the voxels on the other side.
const TOUCH_M: f32 = 1e-5;

/// The tool's shape in its own frame.
#[derive(Clone, Debug)]
pub struct Tool {
    /// Gripper first, then the links; origin at the tip, +y is the approach axis.
    pub parts: Vec<Solid>,
}

impl Default for Tool {
    fn default() -> Self {
        Self::standard()
    }
}

impl Tool {
    /// The closed gripper (triangular prism: base 0.111 m along x, apex at the tip 0.085 m ahead of it, 35 mm thick)
    /// and two links 70 mm wide and high behind it, to 0.25 m and to 0.40 m behind the tip.
    pub fn standard() -> Self {
        let prism = [[0.0, 0.0], [-0.0555, -0.085], [0.0555, -0.085]];
        let gripper: Vec<Point> =
            prism.iter().flat_map(|&[x, y]| [-0.0175, 0.0175].map(|z| Point::new(x, y, z))).collect();
        let link = |near: f32, far: f32| -> Vec<Point> {
            let side = |i: usize| if i & 1 == 1 { 0.035 } else { -0.035 };
            (0..8).map(|i| Point::new(side(i), if i & 4 == 0 { -near } else { -far }, side(i >> 1))).collect()
        };
        let solid = |points: &[Point]| Solid { parts: ConvexPart::hull(points).into_iter().collect() };
        Self { parts: vec![solid(&gripper), solid(&link(0.085, 0.25)), solid(&link(0.25, 0.40))] }
    }

    /// The tool's pose with its tip at `tip`: it never turns, its approach axis stays +y.
    pub fn world_from_tool(tip: Point) -> Pose {
        Pose::translation(tip.x, tip.y, tip.z)
    }

    /// Where the tip is before the approach: straight before the push's start, [`CLEARANCE_M`] before the front edge.
    pub fn approach_point(push: &Push) -> Point {
        let start = push.start_point();
        Point::new(start.x, start.y.min(-CLEARANCE_M), start.z)
    }

    /// Poses of the tool along approach and push, at most `step_m` apart, with both ends and the turn between.
    pub fn path(&self, push: &Push, step_m: f32) -> Vec<Pose> {
        let stops = [Self::approach_point(push), push.start_point(), push.end_point()];
        let mut poses = vec![Self::world_from_tool(stops[0])];
        for leg in stops.windows(2) {
            let travel = leg[1] - leg[0];
            let steps = (travel.norm() / step_m.max(1e-4) - 1e-3).ceil() as usize;
            poses.extend((1..=steps).map(|i| Self::world_from_tool(leg[0] + travel * (i as f32 / steps as f32))));
        }
        poses
    }

    /// How far the tip travels on approach and push together, metres.
    pub fn path_length(&self, push: &Push) -> f32 {
        (push.start_point() - Self::approach_point(push)).norm() + push.length_m
    }

    /// Every voxel that a part of the tool touches on approach or push.
    ///
    /// A convex part that is moved along a straight line sweeps the convex hull of itself at both ends, so the path is
    /// one hull per part and leg. A voxel is touched when its box and the hull overlap, which is decided exactly: the
    /// voxel's centre is tested against the faces of the hull grown by the box (their Minkowski sum).
    pub fn swept_volume(&self, push: &Push, grid: &Grid) -> VoxelSet {
        let mut swept = VoxelSet::empty(grid);
        let approach = Self::approach_point(push);
        let legs = [(approach, push.start_point() - approach), (push.start_point(), push.direction() * push.length_m)];
        for part in self.parts.iter().flat_map(|solid| &solid.parts) {
            for (from, travel) in legs {
                insert_swept(&mut swept, grid, part, from.coords, travel);
            }
        }
        swept
    }
}

/// Adds the voxels touched by `part`, shifted by `at` and moved along `travel`.
fn insert_swept(swept: &mut VoxelSet, grid: &Grid, part: &ConvexPart, at: Vector, travel: Vector) {
    let half = 0.5 * grid.voxel_m;
    let faces: Vec<HalfSpace> = sweep_normals(part, travel)
        .into_iter()
        .map(|normal| {
            let reach = part.vertices.iter().map(|v| normal.dot(&(v.coords + at))).fold(f32::NEG_INFINITY, f32::max);
            let grown = reach + normal.dot(&travel).max(0.0) + half * normal.abs().sum();
            HalfSpace { normal, offset: grown - TOUCH_M }
        })
        .collect();
    // The box of the sweep narrows the columns to look at; the faces then leave one range of levels per column.
    let (mut low, mut high) = (Vector::repeat(f32::INFINITY), Vector::repeat(f32::NEG_INFINITY));
    for vertex in &part.vertices {
        let (a, b) = (vertex.coords + at, vertex.coords + at + travel);
        low = low.inf(&a.inf(&b));
        high = high.sup(&a.sup(&b));
    }
    let cells = |axis: usize| {
        let clip = |at: f32| at.clamp(0.0, grid.dims[axis] as f32) as usize;
        let voxels = |m: f32| (m - grid.origin[axis]) / grid.voxel_m;
        clip(voxels(low[axis]).floor())..clip(voxels(high[axis]).floor() + 1.0)
    };
    for x in cells(0) {
        for y in cells(1) {
            let cell = grid.cell_index(Cell { x: x as u16, y: y as u16 });
            let column = grid.column(cell).start;
            levels_inside(grid, cell, &faces).for_each(|z| swept.insert(column + z));
        }
    }
}

/// Unit normals of all faces of a convex part swept along `travel` and then grown by a box: faces of the part, faces of
/// the box, and the faces spanned by pairs of edges (of the part, of the box, the travel itself). Any direction with its
/// support is a valid half-space, so those that are no face do no harm.
fn sweep_normals(part: &ConvexPart, travel: Vector) -> Vec<Vector> {
    fn push_unit(list: &mut Vec<Vector>, v: Vector, same: impl Fn(f32) -> bool) {
        if let Some(unit) = v.try_normalize(1e-9)
            && !list.iter().any(|known| same(known.dot(&unit)))
        {
            list.push(unit);
        }
    }
    const PARALLEL: f32 = 1.0 - 1e-6;
    let mut edges: Vec<Vector> = vec![Vector::x(), Vector::y(), Vector::z()];
    push_unit(&mut edges, travel, |dot| dot.abs() > PARALLEL);
    for (i, a) in part.planes.iter().enumerate() {
        // Edges of a hull lie where two of its faces meet; those of faces that do not meet do no harm.
        for b in &part.planes[..i] {
            push_unit(&mut edges, a.normal.cross(&b.normal), |dot| dot.abs() > PARALLEL);
        }
    }
    let mut normals: Vec<Vector> = part.planes.iter().map(|plane| plane.normal).collect();
    for (i, a) in edges.iter().enumerate() {
        for b in &edges[..i] {
            let normal = a.cross(b);
            push_unit(&mut normals, normal, |dot| dot > PARALLEL);
            push_unit(&mut normals, -normal, |dot| dot > PARALLEL);
        }
    }
    normals
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid() -> Grid {
        Grid::for_shelf([0.80, 0.40, 0.40], 0.005)
    }

    #[test]
    fn the_standard_tool_has_its_published_size() {
        let tool = Tool::standard();
        let sizes: Vec<Vector> = tool.parts.iter().map(|part| part.bounds().size()).collect();
        let expected = [[0.111, 0.085, 0.035], [0.07, 0.165, 0.07], [0.07, 0.15, 0.07]];
        for (size, expected) in sizes.iter().zip(expected) {
            assert!((size - Vector::from(expected)).norm() < 1e-6, "{size} {expected:?}");
        }
        assert!((tool.parts[0].volume() - 0.111 * 0.085 / 2.0 * 0.035).abs() < 1e-7);
        assert!(tool.parts[0].contains(Point::new(0.0, -0.001, 0.0)));
        assert!(!tool.parts[0].contains(Point::new(0.03, -0.001, 0.0)));
    }

    #[test]
    fn the_path_goes_in_and_then_along_the_push() {
        let tool = Tool::standard();
        let push = Push { start: [0.1, 0.1, 0.06], direction_deg: 0.0, length_m: 0.05 };
        let path = tool.path(&push, 0.01);
        assert_eq!(path.len(), 1 + 12 + 5);
        assert_eq!(path[0].translation.vector, Vector::new(0.1, -0.02, 0.06));
        assert!((path[12].translation.vector - Vector::new(0.1, 0.1, 0.06)).norm() < 1e-6);
        assert!((path[17].translation.vector - Vector::new(0.15, 0.1, 0.06)).norm() < 1e-6);
        assert!((tool.path_length(&push) - 0.17).abs() < 1e-6);
    }

    #[test]
    fn a_straight_approach_sweeps_a_known_number_of_voxels() {
        // A tool of one box, 2 x 1 x 2 voxels, on voxel boundaries: approach and push along +y sweep two columns of
        // voxels, two levels high, to the tip.
        let box_ = Solid::standing_box(Vector::new(0.01, 0.005, 0.01));
        let tool = Tool { parts: vec![box_] };
        let push = Push { start: [0.0, 0.0975, 0.05], direction_deg: 90.0, length_m: 0.10 };
        let swept = tool.swept_volume(&push, &grid());
        assert_eq!(swept.len(), 2 * 2 * 40);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// Points of the tool along the path lie in swept voxels, and a swept voxel is near the tool somewhere.
        #[test]
        fn the_swept_volume_holds_the_tool(
            x in -0.3_f32..0.3, y in 0.0_f32..0.3, z in 0.04_f32..0.2,
            direction_deg in -180.0_f32..180.0, length_m in 0.0_f32..0.15,
        ) {
            let (grid, tool) = (grid(), Tool::standard());
            let push = Push { start: [x, y, z], direction_deg, length_m };
            let swept = tool.swept_volume(&push, &grid);
            let path = tool.path(&push, 0.004);
            let mut near = VoxelSet::empty(&grid);
            for pose in &path {
                for part in tool.parts.iter().flat_map(|solid| &solid.parts) {
                    let center = part.vertices.iter().map(|v| v.coords).sum::<Vector>() / part.vertices.len() as f32;
                    for vertex in &part.vertices {
                        // Just inside the corner: the corner itself may lie on a voxel's boundary.
                        let point = pose * Point::from(center + (vertex.coords - center) * 0.999);
                        if let Some(voxel) = grid.voxel_at(point) {
                            prop_assert!(swept.contains(grid.index(voxel)), "{point} not swept");
                        }
                    }
                    let bounds = Solid { parts: vec![part.clone()] }.bounds_at(pose);
                    let reach = |at: f32, axis: usize| {
                        ((at - grid.origin[axis]) / grid.voxel_m).clamp(0.0, grid.dims[axis] as f32) as u16
                    };
                    // Half a diagonal of a voxel and half a step of the path.
                    let slack = 0.0025 * 3.0_f32.sqrt() + 0.0021;
                    for x in reach(bounds.min.x - 0.005, 0)..reach(bounds.max.x + 0.01, 0) {
                        for y in reach(bounds.min.y - 0.005, 1)..reach(bounds.max.y + 0.01, 1) {
                            for z in reach(bounds.min.z - 0.005, 2)..reach(bounds.max.z + 0.01, 2) {
                                let voxel = crate::grid::Voxel { x, y, z };
                                let local = pose.inverse_transform_point(&grid.center(voxel));
                                let outside = part.planes.iter().any(|p| p.normal.dot(&local.coords) > p.offset + slack);
                                if !outside {
                                    near.insert(grid.index(voxel));
                                }
                            }
                        }
                    }
                }
            }
            let far = swept.iter().find(|&voxel| !near.contains(voxel));
            prop_assert!(far.is_none(), "{:?} is swept but far from the path", far.map(|v| grid.voxel(v)));
        }
    }
}
