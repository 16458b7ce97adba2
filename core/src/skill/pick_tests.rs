use super::*;
use crate::arm::ArmTool;
use crate::belief::evidence;
use crate::grid::Cell;
use crate::rng::stream;
use crate::scene::{Body, ClassId, ObjectId, RobotFile, RobotPlacement, Shelf};
use crate::skill::PushSampler;
use crate::solid::{ConvexPart, Solid};
use crate::world::{Grip, TruthMap, World};
use crate::{Pose, Vector};
use nalgebra::{Translation3, UnitQuaternion};
use std::sync::Arc;

fn shelf() -> Shelf {
    Shelf::new([0.80, 0.40, 0.40])
}

fn arm() -> ArmTool {
    let placement = RobotPlacement { urdf: Some(RobotFile::suction()), ..RobotPlacement::default() };
    ArmTool::new(Arm::placed(&placement).expect("shipped"), shelf())
}

/// A box or can by its size; a can has no depth of its own.
fn body(id: u16, size: [f32; 3], x: f32, y: f32, yaw: f32, mass_kg: f32) -> Body {
    let solid = if size[1] > 0.0 { Solid::standing_box(size.into()) } else { can(0.5 * size[0], size[2]) };
    let turn = UnitQuaternion::from_axis_angle(&Vector::z_axis(), yaw.to_radians());
    Body {
        id: ObjectId(id),
        class: ClassId(1 + id as u8),
        solid: Arc::new(solid),
        world_from_body: Pose::from_parts(Translation3::new(x, y, 0.0), turn),
        mass_kg,
        friction: 0.5,
    }
}

fn can(radius: f32, height: f32) -> Solid {
    let ring = (0..24).flat_map(|i| {
        let (sin, cos) = (i as f32 * std::f32::consts::TAU / 24.0).sin_cos();
        [0.0, height].map(|z| Point::new(radius * cos, radius * sin, z))
    });
    Solid { parts: ConvexPart::hull(&ring.collect::<Vec<_>>()).into_iter().collect() }
}

/// What somebody believes who knows the shelf: what is filled is occupied, all else is free.
fn knowing(bodies: &[Body]) -> Belief {
    let grid = shelf().grid();
    let truth = TruthMap::of(&grid, bodies);
    let mut belief = Belief::uniform(grid);
    for (voxel, filled) in truth.occupancy.iter().enumerate() {
        belief.occupancy[voxel] = evidence(if *filled != 0 { 3.0 } else { -3.0 }, 30.0);
    }
    for body in bodies {
        let alone = TruthMap::of(&grid, std::slice::from_ref(body));
        for cell in 0..grid.cell_count() {
            if grid.column(cell).any(|voxel| alone.occupancy[voxel] != 0) {
                belief.semantics[cell][usize::from(body.class.0)] += 20.0;
            }
        }
    }
    belief
}

fn settled(bodies: Vec<Body>) -> World {
    let mut world = World::new(shelf(), bodies);
    world.settle();
    world
}

fn picks(belief: &Belief, arm: &ArmTool, place: PickPlace) -> Vec<Candidate> {
    let ground = Ground { belief, seen: None, arm, sampler: PushSampler::Frontier, place, unsealed: &[] };
    Pick::sample(&ground, 80, &mut stream(0, "picks", 0))
}

/// The first feasible pick of what stands at a place.
fn pick_at(candidates: &[Candidate], x: f32) -> (Pick, PhasedMotion) {
    let of = |candidate: &Candidate| match candidate.manipulation {
        Manipulation::Pick(pick) if (pick.contact[0] - x).abs() < 0.04 => Some((pick, candidate.motion.clone()?)),
        _ => None,
    };
    candidates.iter().find_map(of).unwrap_or_else(|| {
        let said: Vec<String> = candidates
            .iter()
            .map(|c| {
                let against = c.rejection.as_ref().map(|r| c.manipulation.against(r));
                format!("{}: {against:?}", c.manipulation.describe().short)
            })
            .collect();
        panic!("nothing can be taken at x = {x}: {said:#?}")
    })
}

#[test]
fn a_box_a_can_and_a_turned_box_are_taken_out_and_set_down_where_they_were_to_be() {
    let arm = arm();
    for size in [[0.06, 0.05, 0.12], [0.07, 0.0, 0.10], [0.10, 0.04, 0.18]] {
        for yaw in [0.0, 15.0] {
            let world = settled(vec![body(0, size, -0.1, 0.15, yaw, 0.4)]);
            let bodies = world.bodies();
            let belief = knowing(&bodies);
            let (pick, motion) = pick_at(&picks(&belief, &arm, PickPlace::Shelf), -0.1);
            let mut after = world.clone();
            let outcome = after.execute(&arm.arm, &motion);
            let grip = outcome.grip.expect("suction");
            assert_eq!(grip, Grip { object: Some(ObjectId(0)), end: GripEnd::SetDown }, "{size:?} {yaw}");
            let [dx, dy] = pick.place.expect("in the shelf");
            let moved =
                after.bodies()[0].world_from_body.translation.vector - bodies[0].world_from_body.translation.vector;
            let off = (moved - Vector::new(dx, dy, 0.0)).norm();
            assert!(off < 0.012, "{size:?} {yaw}: it stands {off} m from where it was to be: {moved:?} for {dx} {dy}");
            assert!(after.deepest_overlap_m() < 0.003);
            let upright = after.bodies()[0].world_from_body.rotation * Vector::z();
            assert!(upright.z > 0.999, "{upright:?}");
        }
    }
}

#[test]
fn with_a_tray_the_object_is_gone_for_good_and_no_drop() {
    let arm = arm();
    let world =
        settled(vec![body(0, [0.06, 0.05, 0.12], 0.0, 0.2, 0.0, 0.4), body(1, [0.06, 0.05, 0.10], 0.2, 0.2, 0.0, 0.4)]);
    let belief = knowing(&world.bodies());
    let (pick, motion) = pick_at(&picks(&belief, &arm, PickPlace::Tray), 0.0);
    assert_eq!(pick.place, None);
    let mut after = world.clone();
    let outcome = after.execute(&arm.arm, &motion);
    assert_eq!(outcome.grip.map(|grip| grip.end), Some(GripEnd::Stowed));
    assert!(outcome.dropped.is_empty());
    let left: Vec<ObjectId> = after.bodies().iter().map(|body| body.id).collect();
    assert_eq!(left, [ObjectId(1)]);
    let standing = after.standing();
    assert!(standing[0].stowed && !standing[0].dropped && !standing[1].stowed);
    assert_eq!(after.bodies_at(&standing).expect("the same bodies").len(), 1);
}

#[test]
fn the_cup_seals_on_cans_wherever_their_fronts_are_between_voxels() {
    let arm = arm();
    for i in 0u8..5 {
        let y = 0.15 + 0.001 * f32::from(i);
        for size in [[0.07, 0.0, 0.099], [0.075, 0.0, 0.24], [0.06, 0.05, 0.12]] {
            let world = settled(vec![body(0, size, 0.0, y, 0.0, 0.3)]);
            let (_, motion) = pick_at(&picks(&knowing(&world.bodies()), &arm, PickPlace::Tray), 0.0);
            let outcome = world.clone().execute(&arm.arm, &motion);
            assert_eq!(outcome.grip.map(|grip| grip.end), Some(GripEnd::Stowed), "{size:?} at y = {y}");
        }
    }
}

#[test]
fn the_cup_is_set_where_the_front_is_expected_and_not_at_the_first_sure_voxel() {
    let arm = arm();
    let world = settled(vec![body(0, [0.10, 0.06, 0.16], 0.0, 0.15, 0.0, 0.4)]);
    let mut belief = knowing(&world.bodies());
    let front = |belief: &Belief| pick_at(&picks(belief, &arm, PickPlace::Tray), 0.0).0.contact[1];
    let sure = front(&belief);
    // The front's own voxels are less sure than what is behind them, as the networks have it.
    let grid = belief.grid;
    let row = (sure / grid.voxel_m).round() as u16;
    for x in 0..grid.dims[0] as u16 {
        for voxel in grid.column(grid.cell_index(Cell { x, y: row })) {
            if belief.probability(voxel) > 0.5 {
                belief.occupancy[voxel] = [6.0, 4.0];
            }
        }
    }
    let expected = front(&belief);
    assert!((expected - sure - 0.4 * grid.voxel_m).abs() < 0.001, "{sure} {expected}");
}

#[test]
fn what_is_held_is_not_torn_off_when_the_arm_turns_aside() {
    let arm = arm();
    for x in [-0.28, -0.1, 0.12, 0.28] {
        for size in [[0.07, 0.0, 0.099], [0.158, 0.062, 0.207]] {
            let world = settled(vec![body(0, size, x, 0.12, 0.0, 0.41)]);
            let belief = knowing(&world.bodies());
            let (_, motion) = pick_at(&picks(&belief, &arm, PickPlace::Tray), x);
            let outcome = world.clone().execute(&arm.arm, &motion);
            assert_eq!(outcome.grip.map(|grip| grip.end), Some(GripEnd::Stowed), "{size:?} at x = {x}");
        }
    }
}

#[test]
fn what_stands_before_it_too_narrow_a_front_and_a_full_shelf_are_told_as_reasons() {
    let arm = arm();
    let against = |bodies: Vec<Body>, class: u8| -> Vec<Rejection> {
        let belief = knowing(&settled(bodies).bodies());
        let grid = belief.grid;
        let is_of = |candidate: &&Candidate| {
            let Cell { x, y } = Cell { x: candidate.contact.x, y: candidate.contact.y };
            belief.likeliest(grid.cell_index(Cell { x, y })).0 == ClassId(class)
        };
        let candidates = picks(&belief, &arm, PickPlace::Shelf);
        candidates.iter().filter(is_of).filter_map(|candidate| candidate.rejection.clone()).collect()
    };
    // A wide box that a small one stands before: its front is there beside it, but not its way out.
    let before = vec![body(0, [0.05, 0.05, 0.10], 0.0, 0.1, 0.0, 0.3), body(1, [0.3, 0.05, 0.2], 0.0, 0.25, 0.0, 0.4)];
    assert!(against(before, 2).iter().all(|reason| *reason == Rejection::NoWayOut));
    assert_eq!(against(vec![body(0, [0.03, 0.05, 0.10], 0.0, 0.1, 0.0, 0.3)], 1), [Rejection::NoFace]);
    // Nine boxes that leave no room for one of them, with nine behind them.
    let row = |y: f32| (0..9).map(move |i| body(i, [0.08, 0.16, 0.12], -0.356 + 0.089 * f32::from(i), y, 0.0, 0.4));
    let behind = row(0.29).map(|body| Body { id: ObjectId(9 + body.id.0), class: ClassId(12), ..body });
    let wall = row(0.10).chain(behind).collect();
    assert!(against(wall, 5).iter().all(|reason| *reason == Rejection::NoPlace), "no room");
}

#[test]
fn a_hand_without_a_cup_offers_no_picks_and_says_why() {
    let gripper = ArmTool::standard(shelf());
    let belief = knowing(&settled(vec![body(0, [0.06, 0.05, 0.12], 0.0, 0.15, 0.0, 0.4)]).bodies());
    assert!(picks(&belief, &gripper, PickPlace::Shelf).is_empty());
    let (pick, _) = pick_at(&picks(&belief, &arm(), PickPlace::Shelf), 0.0);
    let against = pick.plan(&ArmClearance::new(&gripper, &belief), &mut stream(0, "test", 0));
    assert_eq!(against, Err(Rejection::NoCup));
}

#[test]
fn a_place_on_something_is_refused_and_one_that_is_free_is_taken() {
    let arm = arm();
    let belief = knowing(
        &settled(vec![
            body(0, [0.06, 0.05, 0.12], 0.0, 0.15, 0.0, 0.4),
            body(1, [0.06, 0.05, 0.12], 0.2, 0.15, 0.0, 0.4),
        ])
        .bodies(),
    );
    let (pick, _) = pick_at(&picks(&belief, &arm, PickPlace::Shelf), 0.0);
    let clearance = ArmClearance::new(&arm, &belief);
    let plan = |place| Pick { place: Some(place), ..pick }.plan(&clearance, &mut stream(0, "test", 0));
    assert_eq!(plan([0.2, 0.0]), Err(Rejection::NoPlace));
    let motion = plan([-0.2, 0.0]).expect("free");
    let there = Pick { place: Some([-0.2, 0.0]), ..pick };
    let ready = arm.ready.expect("within reach");
    assert!(there.is_done_by(&motion, &arm.arm, &ready) && !pick.is_done_by(&motion, &arm.arm, &ready));
    let text = serde_json::to_string(&Manipulation::Pick(there)).expect("JSON");
    assert_eq!(serde_json::from_str::<Manipulation>(&text).expect("a pick"), there.into());
}

#[test]
fn nothing_that_is_not_there_or_too_heavy_is_held() {
    let arm = arm();
    let world = settled(vec![body(0, [0.06, 0.05, 0.12], 0.0, 0.15, 0.0, 0.4)]);
    let belief = knowing(&world.bodies());
    let (_, motion) = pick_at(&picks(&belief, &arm, PickPlace::Shelf), 0.0);
    let of = |bodies: Vec<Body>| {
        let mut world = settled(bodies);
        world.execute(&arm.arm, &motion).grip.map(|grip| grip.end)
    };
    assert_eq!(of(vec![body(0, [0.06, 0.05, 0.12], 0.3, 0.15, 0.0, 0.4)]), Some(GripEnd::NoSeal), "it is elsewhere");
    assert_eq!(
        of(vec![body(0, [0.03, 0.05, 0.12], 0.0, 0.15, 0.0, 0.4)]),
        Some(GripEnd::NoSeal),
        "its front is an edge"
    );
    assert_eq!(of(vec![body(0, [0.06, 0.05, 0.12], 0.0, 0.15, 0.0, 4.0)]), Some(GripEnd::CameOff), "4 kg are too much");
}

#[test]
fn a_front_that_stands_a_centimetre_from_where_it_is_believed_is_felt_and_taken() {
    let arm = arm();
    let size = [0.06, 0.05, 0.12];
    let world = settled(vec![body(0, size, 0.0, 0.15, 0.0, 0.4)]);
    let (_, motion) = pick_at(&picks(&knowing(&world.bodies()), &arm, PickPlace::Tray), 0.0);
    for off in [-0.012, 0.012] {
        let outcome = settled(vec![body(0, size, 0.0, 0.15 + off, 0.0, 0.4)]).execute(&arm.arm, &motion);
        assert_eq!(outcome.grip.map(|grip| grip.end), Some(GripEnd::Stowed), "{off} m off");
    }
    // It is not felt for farther than that, and what is too narrow for the rim is not pushed away while the cup feels for it.
    let far = settled(vec![body(0, size, 0.0, 0.15 + 0.025, 0.0, 0.4)]).execute(&arm.arm, &motion);
    assert_eq!(far.grip.map(|grip| grip.end), Some(GripEnd::NoSeal));
    let edge = settled(vec![body(0, [0.03, 0.05, 0.12], 0.0, 0.15, 0.0, 0.4)]).execute(&arm.arm, &motion);
    let moved_m: f32 = edge.displacement_m.iter().sum();
    assert!(edge.grip.is_some_and(|grip| grip.end == GripEnd::NoSeal) && moved_m < 0.002, "{moved_m} m");
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig { cases: 12, ..Default::default() })]

    /// Whatever stands there: nothing that is held or let go passes through anything, what is set down stands on the board,
    /// and no object is lost or made.
    #[test]
    fn picks_of_any_shelf_keep_every_object_whole_and_out_of_the_others(
        stands in proptest::collection::vec((0.04_f32..0.12, 0.04_f32..0.08, 0.08_f32..0.2, -45.0_f32..45.0, 0.2_f32..0.9), 2..6),
        to_tray in proptest::bool::ANY,
    ) {
        let arm = arm();
        let standing = |(at, (width, depth, height, yaw, mass)): (usize, &(f32, f32, f32, f32, f32))| {
            let x = -0.3 + 0.15 * (at % 5) as f32;
            body(at as u16, [*width, *depth, *height], x, 0.12 + 0.04 * (at % 2) as f32, 0.3 * yaw, *mass)
        };
        let world = settled(stands.iter().enumerate().map(standing).collect());
        let place = if to_tray { PickPlace::Tray } else { PickPlace::Shelf };
        for candidate in picks(&knowing(&world.bodies()), &arm, place).iter().filter(|c| c.motion.is_some()).take(2) {
            let mut after = world.clone();
            let outcome = after.execute(&arm.arm, candidate.motion.as_ref().expect("feasible"));
            proptest::prop_assert!(after.deepest_overlap_m() < 0.004, "{} m", after.deepest_overlap_m());
            let states = after.standing();
            proptest::prop_assert_eq!(states.len(), stands.len());
            let gone = states.iter().filter(|state| state.stowed || state.dropped).count();
            proptest::prop_assert_eq!(after.bodies().len() + gone, stands.len());
            let mass = |world: &World| world.bodies().iter().map(|body| body.mass_kg).sum::<f32>();
            if gone == 0 {
                proptest::prop_assert!((mass(&after) - mass(&world)).abs() < 1e-6);
            }
            if let Some(Grip { object: Some(id), end: GripEnd::SetDown }) = outcome.grip {
                let now = after.bodies().into_iter().find(|body| body.id == id).expect("still there");
                let z = now.world_from_body.translation.z;
                proptest::prop_assert!(z.abs() < 0.002, "it hangs or sinks: {} m", z);
            }
        }
    }
}
