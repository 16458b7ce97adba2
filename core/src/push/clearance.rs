//! Whether the tool can go where a push wants it, as far as the belief knows.

use super::{CONFIDENT, Rejection};
use crate::Pose;
use crate::belief::{Belief, FloorPlan, OBJECT_RADIUS_M, Patch, beta_mean};
use crate::grid::{Cell, Grid, Voxel, VoxelSet};
use crate::tool::{Push, Tool};

/// How finely the path is walked to tell where it is blocked, metres.
const STEP_M: f32 = 0.005;
/// Contact that is shallower than this is none, metres: a tool that slides along a wall or a voxel's face is free.
const TOUCH_M: f32 = 1e-5;

/// What a belief is sure of, prepared for checking many pushes.
pub struct Clearance {
    grid: Grid,
    confident: VoxelSet,
    plan: FloorPlan,
}

impl Clearance {
    /// Collects the belief's high-confidence voxels.
    pub fn new(belief: &Belief) -> Self {
        let mut confident = VoxelSet::empty(&belief.grid);
        for (index, a) in belief.occupancy.iter().enumerate() {
            if beta_mean(*a) >= CONFIDENT {
                confident.insert(index);
            }
        }
        Self { grid: belief.grid, confident, plan: FloorPlan::new(belief, CONFIDENT) }
    }

    /// The object that a frontier voxel belongs to; the tool may touch what stands on its cells.
    pub fn target(&self, frontier: Voxel) -> Patch {
        self.plan.patch(self.grid.cell_index(Cell { x: frontier.x, y: frontier.y }), OBJECT_RADIUS_M)
    }

    /// Why the push that sweeps `swept` cannot be carried out, or `None` if it can.
    ///
    /// Neither the start pose nor the way in nor the push may touch the shelf or a high-confidence voxel that is not the
    /// target's; that holds for the gripper and for the links that trail behind it. What the target itself runs into is
    /// not asked.
    pub fn check(&self, tool: &Tool, push: &Push, swept: &VoxelSet, target: &Patch) -> Option<Rejection> {
        let path = tool.path(push, STEP_M);
        if path.iter().any(|pose| self.touches_shelf(tool, pose)) {
            return Some(Rejection::Shelf);
        }
        let height = self.grid.dims[2];
        let blocking: Vec<usize> =
            swept.iter().filter(|&index| self.confident.contains(index) && !target.contains(index / height)).collect();
        let first = *blocking.first()?;
        let center = |index: usize| self.grid.center(self.grid.voxel(index));
        let met = |pose: &Pose| blocking.iter().copied().find(|&index| self.touches_voxel(tool, pose, index));
        if let Some(index) = met(&Tool::world_from_tool(push.start_point())) {
            return Some(Rejection::StartBlocked { at: center(index).coords.into() });
        }
        let index = path.iter().find_map(met).unwrap_or(first);
        Some(Rejection::PathBlocked { at: center(index).coords.into() })
    }

    /// Whether a part of the tool that is inside the shelf reaches into board, walls or ceiling.
    fn touches_shelf(&self, tool: &Tool, pose: &Pose) -> bool {
        let (min, max) = (self.grid.min(), self.grid.max());
        tool.parts.iter().map(|part| part.bounds_at(pose)).any(|part| {
            let inside = part.max.y > min.y;
            let fits = |axis: usize| part.min[axis] > min[axis] - TOUCH_M && part.max[axis] < max[axis] + TOUCH_M;
            inside && !(fits(0) && fits(2) && part.max.y < max.y + TOUCH_M)
        })
    }

    /// Whether the tool at `pose` reaches into a voxel: the voxel's centre is inside a part grown by half a voxel.
    fn touches_voxel(&self, tool: &Tool, pose: &Pose, index: usize) -> bool {
        let half = 0.5 * self.grid.voxel_m;
        let center = pose.inverse_transform_point(&self.grid.center(self.grid.voxel(index)));
        tool.parts.iter().flat_map(|solid| &solid.parts).any(|part| {
            part.planes.iter().all(|plane| {
                let reach = half * (pose.rotation * plane.normal).abs().sum();
                plane.normal.dot(&center.coords) < plane.offset + reach - TOUCH_M
            })
        })
    }
}
