//! The space that an arm sweeps: every voxel that one of its parts touches along a way.

use super::{Arm, DistanceField, Frame, Joints, Part, Role, pose_of};
use crate::grid::{Cell, Grid, VoxelSet};
use crate::solid::{Bounds, ConvexPart, HalfSpace, levels_inside};
use crate::{Pose, Vector};
use nalgebra::Vector3;

/// Largest movement of the tool between two poses whose voxels are taken, metres.
const STEP_M: f64 = 0.005;
/// Contact shallower than this is none, metres.
const TOUCH_M: f32 = 1e-5;

impl Arm {
    /// Adds every voxel that a part touches along the way to `swept`. Poses are at most about 5 mm apart, so what two
    /// of them miss of a moving corner is less than half a voxel.
    pub fn sweep(&self, path: &[Joints], grid: &Grid, swept: &mut VoxelSet) {
        let Some(first) = path.first() else { return };
        self.insert(first, grid, swept);
        for pair in path.windows(2) {
            let steps = (self.tool_travel_m(&pair[0], &pair[1]) / STEP_M).ceil().max(1.0);
            for step in 1..=steps as usize {
                self.insert(&pair[0].toward(&pair[1], step as f64 / steps), grid, swept);
            }
        }
    }

    /// The first voxel for which `blocked` holds that the gripper touches with its tip at `world_from_tool`; parts that are
    /// farther from every voxel of `field` than their size are not looked at.
    pub fn gripper_touches(
        &self,
        world_from_tool: &Frame,
        field: &DistanceField,
        blocked: impl Fn(usize) -> bool,
    ) -> Option<usize> {
        let world_from_last = world_from_tool * self.last_from_tool.inverse();
        for part in self.gripper() {
            if field.distance_m(&(world_from_last * part.around.center)) > part.around.radius_m {
                continue;
            }
            let mut met = None;
            voxels_of(field.grid(), &part.shape, &pose_of(&world_from_last), |index| {
                if met.is_none() && blocked(index) {
                    met = Some(index);
                }
            });
            if met.is_some() {
                return met;
            }
        }
        None
    }

    /// Adds every voxel that the gripper alone touches when it is moved straight along `travel` with its tip from `from`.
    pub fn sweep_gripper(&self, from: &Frame, travel: &Vector3<f64>, grid: &Grid, swept: &mut VoxelSet) {
        let steps = (travel.norm() / STEP_M).ceil().max(1.0);
        for step in 0..=steps as usize {
            let at = from.translation.vector + travel * (step as f64 / steps);
            let world_from_last = Frame::from_parts(at.into(), from.rotation) * self.last_from_tool.inverse();
            for part in self.gripper() {
                voxels_of(grid, &part.shape, &pose_of(&world_from_last), |index| swept.insert(index));
            }
        }
    }

    /// The parts of the gripper.
    fn gripper(&self) -> impl Iterator<Item = &Part> {
        self.bodies.last().into_iter().flatten().filter(|part| part.role == Role::Tool)
    }

    fn tool_travel_m(&self, a: &Joints, b: &Joints) -> f64 {
        (self.world_from_tool(a).translation.vector - self.world_from_tool(b).translation.vector).norm()
    }

    fn insert(&self, joints: &Joints, grid: &Grid, swept: &mut VoxelSet) {
        let poses = self.body_poses(joints);
        let (min, max) = (grid.min(), grid.max());
        for (body, part) in self.parts() {
            // Most of the arm is outside the shelf most of the time.
            let touches = |ball: &super::Ball| {
                let center = (poses[body] * ball.center).map(|v| v as f32);
                let radius = ball.radius_m as f32;
                (0..3).all(|axis| center[axis] + radius > min[axis] && center[axis] - radius < max[axis])
            };
            if part.balls.iter().any(touches) {
                voxels_of(grid, &part.shape, &pose_of(&poses[body]), |index| swept.insert(index));
            }
        }
    }
}

/// Calls `touch` with every voxel whose box touches a part at `pose`: those whose centre is inside the part grown by a
/// voxel's box.
fn voxels_of(grid: &Grid, part: &ConvexPart, pose: &Pose, mut touch: impl FnMut(usize)) {
    let half = 0.5 * grid.voxel_m;
    let faces: Vec<HalfSpace> = part
        .planes
        .iter()
        .map(|plane| {
            let normal: Vector = pose.rotation * plane.normal;
            let offset = plane.offset + normal.dot(&pose.translation.vector) + half * normal.abs().sum() - TOUCH_M;
            HalfSpace { normal, offset }
        })
        .collect();
    let Some(bounds) = Bounds::around(part.vertices.iter().map(|v| pose * v)) else { return };
    let cells = |axis: usize| {
        let clip = |at: f32| at.clamp(0.0, grid.dims[axis] as f32) as usize;
        let voxels = |m: f32| (m - grid.origin[axis]) / grid.voxel_m;
        clip(voxels(bounds.min[axis]).floor())..clip(voxels(bounds.max[axis]).floor() + 1.0)
    };
    // Growing every face grows edges and corners too far; the part's own box keeps that in bounds.
    let level = |z: f32| ((z - grid.origin[2]) / grid.voxel_m).clamp(0.0, grid.dims[2] as f32);
    let (bottom, top) = (level(bounds.min.z + TOUCH_M).floor() as usize, level(bounds.max.z - TOUCH_M).ceil() as usize);
    for x in cells(0) {
        for y in cells(1) {
            let cell = grid.cell_index(Cell { x: x as u16, y: y as u16 });
            let column = grid.column(cell).start;
            for z in levels_inside(grid, cell, &faces) {
                if (bottom..top).contains(&z) {
                    touch(column + z);
                }
            }
        }
    }
}
