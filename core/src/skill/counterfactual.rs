//! What pushes really do: each is carried out in a copy of the world, and what can be seen before and after is compared.
//!
//! It is for whoever may know the truth: [`crate::probe`], which tells how good choices were, and policies that are
//! ceilings. Two things count:
//!
//! * Objects: those of which a view of the array shows 25 pixels or more ([`crate::camera::UNSEEN_PX`]) after the push and
//!   none did before, and the other way round. Exact, at the array's full resolution, from all its views.
//! * Space: voxels that no look has seen, that no view reaches before the push and one reaches after it ([`TrueReach`]). What was
//!   inside an object before is not counted: that it is free now is no news of anything else. All views, one ray in
//!   [`REACH_DENSITY`] pixels along both axes: rays of many views fill each other's gaps.
//!
//! A push moves few objects. So only what they were before, what they come before, and they themselves are looked at again
//! ([`HiddenWatch`], [`TrueReach::after`]); the result is the same as that of looking at everything.

use crate::arm::{ArmTool, PhasedMotion};
use crate::belief::{Belief, bernoulli_entropy, beta_mean};
use crate::camera::{HiddenWatch, ViewArray};
use crate::gain::{RayDensity, TrueReach};
use crate::grid::{Grid, VoxelSet};
use crate::scene::{Body, ObjectId};
use crate::solid::Bounds;
use crate::world::{GripEnd, TruthMap, World};
use crate::{Pose, Vector};
use rayon::prelude::*;

/// How densely views are sampled for what they reach.
pub const REACH_DENSITY: RayDensity = RayDensity::FULL;
/// Cosine of the tilt from which an object that stood has toppled: 45 degrees.
const TOPPLED_COSINE: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// What a push really does.
#[derive(Clone, Debug, PartialEq)]
pub struct PushTruth {
    /// Objects that a view shows after it and none showed before, in the scene's order.
    pub won: Vec<ObjectId>,
    /// Objects that a view showed before it and none shows after, in the scene's order; dropped ones too, hidden or not. What
    /// was laid down beside the robot is known, and not lost.
    pub lost: Vec<ObjectId>,
    /// The space that it opens.
    pub opened: VoxelSet,
    /// Sum of the objects' displacements, metres.
    pub displacement_m: f64,
    /// How far the tip moved along the push, metres.
    pub pushed_m: f32,
    /// Whether the arm was blocked and gave up before the push's end.
    pub jammed: bool,
    /// Objects that left the board.
    pub dropped: Vec<ObjectId>,
    /// Objects that stood and no longer do, dropped ones left out.
    pub toppled: Vec<ObjectId>,
    /// How many voxels of each object a view reaches after it, of every fourth view of the array, in the scene's order; 0 of
    /// dropped ones.
    pub shown: Vec<u32>,
    /// How holding an object ended, of what was to hold one.
    pub grip: Option<GripEnd>,
    /// Voxels that are occupied after it.
    pub occupied: VoxelSet,
}

impl PushTruth {
    /// Objects won minus objects lost.
    pub fn balance(&self) -> i32 {
        self.won.len() as i32 - self.lost.len() as i32
    }

    /// Object voxels that come into sight and that go out of it: over all objects, by how much what is shown of each grows
    /// or shrinks from `before`, which is [`Counterfactual::shown`].
    pub fn appeared_and_vanished(&self, before: &[u32]) -> [u32; 2] {
        let pairs = || before.iter().zip(&self.shown);
        [pairs().map(|(a, b)| b.saturating_sub(*a)).sum(), pairs().map(|(a, b)| a.saturating_sub(*b)).sum()]
    }

    /// What is unknown of the space that it opens under a belief, nats.
    pub fn opened_nats(&self, belief: &Belief) -> f32 {
        let of = |voxel: usize| f64::from(bernoulli_entropy(beta_mean(belief.occupancy[voxel])));
        self.opened.iter().map(of).sum::<f64>() as f32
    }
}

/// A world as it stands, prepared for carrying out pushes in copies of it.
pub struct Counterfactual<'a> {
    world: &'a World,
    arm: &'a ArmTool,
    grid: Grid,
    bodies: Vec<Body>,
    hidden: Vec<ObjectId>,
    watch: HiddenWatch<'a>,
    reach: TrueReach,
    /// How many voxels of each body a view reaches.
    shown: Vec<u32>,
    /// Voxels that no push opens: seen, or inside an object.
    known: VoxelSet,
    /// Voxels that are occupied now.
    occupied: VoxelSet,
}

impl<'a> Counterfactual<'a> {
    /// Looks from all views at the world as it stands; `seen` are the voxels that looks have seen.
    pub fn new(world: &'a World, arm: &'a ArmTool, views: &'a ViewArray, seen: &VoxelSet) -> Self {
        let (grid, bodies) = (world.shelf().grid(), world.bodies());
        let truth = TruthMap::of(&grid, &bodies);
        let mut known = seen.clone();
        let occupied = occupied(&grid, &truth);
        occupied.iter().for_each(|at| known.insert(at));
        let watch = HiddenWatch::new(world.shelf(), &bodies, views);
        let reach = TrueReach::new(&grid, &truth, views, REACH_DENSITY);
        let shown = in_order(&bodies, &reach.shown(&TruthMap::owners(&grid, &bodies), ids(&bodies)));
        Self { hidden: watch.hidden(), watch, reach, shown, world, arm, grid, bodies, known, occupied }
    }

    /// The bodies as they stand now, dropped ones left out.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// How many voxels of each body a view reaches now, in the order of [`Self::bodies`].
    pub fn shown(&self) -> &[u32] {
        &self.shown
    }

    /// The objects that no view shows now, in the scene's order.
    pub fn hidden(&self) -> &[ObjectId] {
        &self.hidden
    }

    /// Carries out a push in a copy of the world. The world itself stays as it is.
    pub fn of(&self, motion: &PhasedMotion) -> PushTruth {
        let mut world = self.world.clone();
        let outcome = world.execute(&self.arm.arm, motion);
        let after = world.bodies();
        let mut truth = PushTruth {
            won: Vec::new(),
            lost: Vec::new(),
            opened: VoxelSet::empty(&self.grid),
            displacement_m: outcome.disturbed_m(),
            pushed_m: outcome.way_m,
            jammed: outcome.stalled,
            dropped: outcome.dropped,
            toppled: Vec::new(),
            shown: self.shown.clone(),
            grip: outcome.grip.map(|grip| grip.end),
            occupied: self.occupied.clone(),
        };
        let now = |id: ObjectId| after.iter().find(|body| body.id == id);
        let stays = |body: &Body| now(body.id).is_some_and(|now| now.world_from_body == body.world_from_body);
        if self.bodies.iter().all(stays) {
            return truth;
        }
        let hidden = self.watch.hidden_after(&after);
        for body in &self.bodies {
            let was_hidden = self.hidden.contains(&body.id);
            match now(body.id) {
                None if truth.dropped.contains(&body.id) => truth.lost.push(body.id),
                Some(_) if was_hidden && !hidden.contains(&body.id) => truth.won.push(body.id),
                Some(_) if !was_hidden && hidden.contains(&body.id) => truth.lost.push(body.id),
                _ => {}
            }
            if now(body.id).is_some_and(|now| stands(&body.world_from_body) && !stands(&now.world_from_body)) {
                truth.toppled.push(body.id);
            }
        }
        let moved = after.iter().filter(|now| {
            !self.bodies.iter().any(|body| body.id == now.id && body.world_from_body == now.world_from_body)
        });
        let filled: Vec<Bounds> = moved.map(|body| body.solid.bounds_at(&body.world_from_body)).collect();
        let map = TruthMap::of(&self.grid, &after);
        let reach = self.reach.after(&map, &filled);
        truth.occupied = occupied(&self.grid, &map);
        truth.shown = in_order(&self.bodies, &reach.shown(&TruthMap::owners(&self.grid, &after), ids(&self.bodies)));
        truth.opened = reach.opened;
        truth.opened.subtract(&self.known);
        truth
    }

    /// Carries out each of some pushes, in parallel; `done` is called after each, from any thread. The result does not depend
    /// on the number of threads.
    pub fn of_each(&self, motions: &[PhasedMotion], done: &(dyn Fn() + Sync)) -> Vec<PushTruth> {
        let carried_out = |motion: &PhasedMotion| {
            let truth = self.of(motion);
            done();
            truth
        };
        motions.par_iter().with_max_len(1).map(carried_out).collect()
    }
}

/// The voxels that are occupied.
fn occupied(grid: &Grid, truth: &TruthMap) -> VoxelSet {
    let mut occupied = VoxelSet::empty(grid);
    truth.occupancy.iter().enumerate().filter(|(_, filled)| **filled != 0).for_each(|(at, _)| occupied.insert(at));
    occupied
}

/// One more than the largest id of some bodies.
fn ids(bodies: &[Body]) -> usize {
    bodies.iter().map(|body| usize::from(body.id.0) + 1).max().unwrap_or(0)
}

/// What is known by id, in the order of some bodies.
fn in_order(bodies: &[Body], by_id: &[u32]) -> Vec<u32> {
    bodies.iter().map(|body| by_id[usize::from(body.id.0)]).collect()
}

/// Whether an object at a pose stands more than it lies.
fn stands(world_from_body: &Pose) -> bool {
    (world_from_body.rotation * Vector::z()).z > TOPPLED_COSINE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::stream;
    use crate::scene::{ClassId, Shelf};
    use crate::skill::{ArmClearance, Push, Skill};
    use crate::solid::Solid;
    use std::sync::Arc;

    /// A wide, tall box with two small ones: the first right behind it, the second beside it, where only the box's far end
    /// comes when it is pushed to the right.
    fn shelf_with_a_screen() -> World {
        let shelf = Shelf { voxel_m: 0.01, ..Shelf::new([0.80, 0.40, 0.40]) };
        let body = |id: u16, size: [f32; 3], x: f32, y: f32| Body {
            id: ObjectId(id),
            class: ClassId(id as u8),
            solid: Arc::new(Solid::standing_box(Vector::from(size))),
            world_from_body: Pose::translation(x, y, 0.0),
            mass_kg: 0.3,
            friction: 0.4,
        };
        let screen = body(0, [0.24, 0.06, 0.28], 0.0, 0.16);
        let behind = body(1, [0.03, 0.03, 0.05], -0.04, 0.23);
        let beside = body(2, [0.03, 0.03, 0.05], 0.20, 0.23);
        let mut world = World::new(shelf, vec![screen, behind, beside]);
        world.settle();
        world
    }

    fn motion(arm: &ArmTool, push: &Push) -> PhasedMotion {
        let belief = Belief::uniform(arm.shelf.grid());
        let clearance = ArmClearance::new(arm, &belief);
        let motion = push.plan(&clearance, &mut stream(1, "test pushes", 0));
        motion.expect("within reach")
    }

    /// Along the screen to the right, from beside its left end.
    const ASIDE: Push = Push { start: [-0.19, 0.16, 0.06], direction_deg: 0.0, length_m: 0.19 };
    /// Into free space at the right.
    const BESIDE_ALL: Push = Push { start: [0.28, 0.05, 0.06], direction_deg: 90.0, length_m: 0.08 };

    #[test]
    fn a_push_that_moves_a_screen_wins_what_is_behind_it_and_loses_what_it_comes_before() {
        let world = shelf_with_a_screen();
        let arm = ArmTool::standard(*world.shelf());
        let views = ViewArray::named("standard300").expect("shipped");
        let nothing = VoxelSet::empty(&world.shelf().grid());
        let known = Counterfactual::new(&world, &arm, &views, &nothing);
        assert_eq!(known.hidden(), [ObjectId(1)]);
        let (aside, beside_all) = (motion(&arm, &ASIDE), motion(&arm, &BESIDE_ALL));
        let truth = known.of(&aside);
        assert_eq!((&truth.won[..], &truth.lost[..]), (&[ObjectId(1)][..], &[ObjectId(2)][..]), "{truth:?}");
        assert_eq!(truth.balance(), 0);
        assert!(truth.displacement_m > 0.08 && !truth.jammed && truth.dropped.is_empty(), "{truth:?}");
        assert!(truth.toppled.is_empty() && (truth.pushed_m - ASIDE.length_m).abs() < 1e-4);
        // Where the screen's shadow was; not what was inside an object before.
        let grid = world.shelf().grid();
        let at = |x: f32, y: f32| grid.index(grid.voxel_at(crate::Point::new(x, y, 0.02)).expect("inside"));
        assert!(truth.opened.contains(at(-0.085, 0.215)));
        assert!(!truth.opened.contains(at(-0.04, 0.23)) && !truth.opened.contains(at(-0.085, 0.16)));
        assert!(truth.opened.len() > 200, "{}", truth.opened.len());

        // The same as by looking at everything anew.
        let (mut pushed, owners_of) = (world.clone(), |bodies: &[Body]| TruthMap::owners(&grid, bodies));
        pushed.execute(&arm.arm, &aside);
        let anew = TrueReach::new(&grid, &TruthMap::of(&grid, &pushed.bodies()), &views, REACH_DENSITY);
        assert_eq!(truth.shown, anew.shown(&owners_of(&pushed.bodies()), 3));
        assert_eq!(crate::camera::hidden_objects(pushed.shelf(), &pushed.bodies(), &views), [ObjectId(2)]);
        let [appeared, vanished] = truth.appeared_and_vanished(known.shown());
        assert!(appeared > 20 && vanished > 20, "{appeared} {vanished}");
        let mut opened = anew.reached();
        opened.subtract(&known.reach.reached());
        opened.subtract(&known.known);
        assert!(truth.opened == opened);

        // What was seen already is not opened; half of the shelf as if it had been.
        let mut left = nothing.clone();
        (0..grid.voxel_count()).filter(|at| grid.center(grid.voxel(*at)).x < 0.0).for_each(|at| left.insert(at));
        let partly = Counterfactual::new(&world, &arm, &views, &left).of(&aside);
        let mut expected = truth.opened.clone();
        expected.subtract(&left);
        assert!(partly == PushTruth { opened: expected, ..truth.clone() } && partly.opened.len() < truth.opened.len());

        let idle = known.of(&beside_all);
        assert_eq!((idle.won.len(), idle.lost.len(), idle.opened.len()), (0, 0, 0));
        assert_eq!((idle.displacement_m, idle.jammed), (0.0, false));
        // The world is as it was, and does what the copy did.
        let mut really = world.clone();
        let outcome = really.execute(&arm.arm, &aside);
        let moved: f64 = outcome.displacement_m.iter().map(|m| f64::from(*m)).sum();
        assert_eq!(moved.to_bits(), truth.displacement_m.to_bits());

        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| known.of_each(&[aside.clone(), beside_all.clone()], &|| ()))
        };
        let (one, three) = (on(1), on(3));
        assert!(one == three && one == [truth, idle]);
    }

    #[test]
    fn an_object_that_a_push_tips_over_has_toppled() {
        let screen = shelf_with_a_screen();
        let mut bodies = screen.bodies();
        // In the screen's place a thin box that a push above its middle tips over.
        bodies[0].solid = Arc::new(Solid::standing_box(Vector::new(0.06, 0.02, 0.10)));
        let mut world = World::new(*screen.shelf(), bodies);
        world.settle();
        let arm = ArmTool::standard(*world.shelf());
        let views = ViewArray::named("real75").expect("shipped");
        let known = Counterfactual::new(&world, &arm, &views, &VoxelSet::empty(&world.shelf().grid()));
        let push = Push { start: [0.0, 0.10, 0.08], direction_deg: 90.0, length_m: 0.12 };
        let truth = known.of(&motion(&arm, &push));
        assert_eq!(truth.toppled, [ObjectId(0)], "{truth:?}");
    }
}
