use super::*;
use crate::Vector;
use crate::arm::ArmTool;
use crate::belief::Belief;
use crate::rng::stream;
use crate::scene::ClassId;
use crate::skill::{ArmClearance, Push, Skill};
use crate::solid::{ConvexPart, Solid};
use nalgebra::{Translation3, UnitQuaternion};
use std::sync::Arc;

/// Carries a push out by the standard arm, by its motion in a shelf of which nothing is known.
fn push_in(world: &mut World, arm: &ArmTool, push: &Push) -> ManipulationOutcome {
    let belief = Belief::uniform(shelf().grid());
    let clearance = ArmClearance::new(arm, &belief);
    let motion = push.plan(&clearance, &mut stream(1, "test pushes", 0));
    world.execute(&arm.arm, &motion.expect("within reach"))
}

fn arm() -> ArmTool {
    ArmTool::standard(shelf())
}

fn shelf() -> Shelf {
    Shelf::new([0.80, 0.40, 0.40])
}

fn body(id: u16, solid: Solid, x: f32, y: f32, yaw: f32) -> Body {
    let rotation = UnitQuaternion::from_axis_angle(&Vector::z_axis(), yaw);
    Body {
        id: ObjectId(id),
        class: ClassId((id % 14) as u8),
        solid: Arc::new(solid),
        world_from_body: Pose::from_parts(Translation3::new(x, y, 0.0), rotation),
        mass_kg: 0.4,
        friction: 0.5,
    }
}

fn cylinder(radius: f32, height: f32) -> Solid {
    let ring = (0..24).flat_map(|i| {
        let (sin, cos) = (i as f32 * std::f32::consts::TAU / 24.0).sin_cos();
        [0.0, height].map(|z| Point::new(radius * cos, radius * sin, z))
    });
    Solid { parts: ConvexPart::hull(&ring.collect::<Vec<_>>()).into_iter().collect() }
}

/// Fifteen boxes and cans, three rows deep, close together.
fn crowd() -> Vec<Body> {
    (0..15)
        .map(|i| {
            let (x, y) = (-0.30 + 0.15 * (i % 5) as f32, 0.07 + 0.12 * (i / 5) as f32);
            let solid = match i % 3 {
                0 => cylinder(0.035, 0.10),
                1 => Solid::standing_box(Vector::new(0.06, 0.09, 0.2)),
                _ => Solid::standing_box(Vector::new(0.1, 0.05, 0.13)),
            };
            body(i, solid, x, y, 0.2 * i as f32)
        })
        .collect()
}

fn into_the_crowd() -> Push {
    Push { start: [0.0, 0.02, 0.06], direction_deg: 100.0, length_m: 0.12 }
}

fn poses(world: &World) -> Vec<[u32; 7]> {
    let bits = |body: &Body| {
        let (t, q) = (body.world_from_body.translation.vector, body.world_from_body.rotation.coords);
        [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(f32::to_bits)
    };
    world.bodies().iter().map(bits).collect()
}

#[test]
fn standing_objects_stay_where_they_stand() {
    let mut world = World::new(shelf(), crowd());
    let moved = world.settle();
    // A can that stands on a sliver of its base creeps by centimetres.
    assert!(moved < 0.0002, "{moved}");
    assert_eq!(world.bodies().len(), 15);
    assert!(world.deepest_overlap_m() < 0.002, "{}", world.deepest_overlap_m());
    assert!(world.kinetic_energy_j() < 1e-6);
    // Settled is settled.
    assert_eq!(world.settle(), 0.0);
}

#[test]
fn a_push_moves_what_it_meets_and_nothing_else() {
    let block = Solid::standing_box(Vector::new(0.06, 0.06, 0.12));
    let mut world = World::new(shelf(), vec![body(0, block.clone(), 0.0, 0.15, 0.0), body(1, block, 0.3, 0.3, 0.0)]);
    world.settle();
    let before = poses(&world)[1];
    // The tip touches the block after 2 cm and carries it 8 cm on.
    let push = Push { start: [0.0, 0.10, 0.06], direction_deg: 90.0, length_m: 0.10 };
    let outcome = push_in(&mut world, &arm(), &push);
    assert!((outcome.displacement_m[0] - 0.08).abs() < 0.006, "{:?}", outcome);
    assert!((world.bodies()[0].world_from_body.translation.y - 0.23).abs() < 0.006);
    assert_eq!((outcome.displacement_m[1], poses(&world)[1]), (0.0, before));
    assert!(!outcome.stalled && (outcome.way_m - 0.10).abs() < 1e-6 && outcome.dropped.is_empty());
    // Along 0.1 m at 0.1 m/s at least, and a rest.
    assert!(outcome.arm_s > 1.0 && outcome.duration_s >= outcome.arm_s, "{outcome:?}");
    assert!(outcome.link_contacts.is_empty() && outcome.arm_in_shelf_m < 0.002, "{outcome:?}");
}

#[test]
fn snapshots_and_fresh_worlds_have_the_same_future() {
    let arm = arm();
    let run = |mut world: World| {
        let first = push_in(&mut world, &arm, &into_the_crowd());
        let second =
            push_in(&mut world, &arm, &Push { start: [-0.15, 0.05, 0.06], direction_deg: 60.0, length_m: 0.1 });
        (poses(&world), first, second)
    };
    let mut world = World::new(shelf(), crowd());
    world.settle();
    let snapshot = world.clone();
    let mut fresh = World::new(shelf(), crowd());
    fresh.settle();
    let expected = run(world);
    assert!(expected.1.displacement_m.iter().any(|&moved| moved > 0.03), "the push moves something");
    assert_eq!(run(snapshot.clone()), expected);
    assert_eq!(run(fresh), expected);
    // A snapshot between two pushes, and one on another thread.
    let mut branch = snapshot.clone();
    push_in(&mut branch, &arm, &into_the_crowd());
    let mut branch = branch.clone();
    push_in(&mut branch, &arm, &Push { start: [-0.15, 0.05, 0.06], direction_deg: 60.0, length_m: 0.1 });
    assert_eq!(poses(&branch), expected.0);
    let elsewhere = std::thread::scope(|scope| scope.spawn(|| run(snapshot)).join().expect("joins"));
    assert_eq!(elsewhere, expected);
}

#[test]
fn an_object_pushed_over_the_edge_is_dropped() {
    let block = Solid::standing_box(Vector::new(0.06, 0.06, 0.12));
    let mut world = World::new(shelf(), vec![body(5, block.clone(), -0.08, 0.02, 0.0), body(6, block, 0.2, 0.2, 0.0)]);
    world.settle();
    // The gripper goes in beside the block and takes it along, sideways and towards the front.
    let arm = arm();
    let push = Push { start: [0.02, 0.10, 0.06], direction_deg: 203.0, length_m: 0.15 };
    let outcome = push_in(&mut world, &arm, &push);
    assert_eq!(outcome.dropped, vec![ObjectId(5)]);
    assert_eq!(world.bodies().iter().map(|body| body.id).collect::<Vec<_>>(), vec![ObjectId(6)]);
    // To where it was found below the board, not to where it would be after seconds of falling.
    assert!((0.05..0.4).contains(&outcome.displacement_m[0]) && outcome.displacement_m[1] == 0.0, "{outcome:?}");
    // Once dropped, it is not dropped again.
    let again = push_in(&mut world, &arm, &push);
    assert!(again.dropped.is_empty() && again.displacement_m == vec![0.0, 0.0]);
}

#[test]
fn a_jammed_tool_stalls_and_nothing_explodes() {
    // Boxes one behind the other up to the back wall, with 2 cm of play, and a push that wants 10 cm.
    let block = Solid::standing_box(Vector::new(0.12, 0.12, 0.15));
    let row = (0..3).map(|i| body(i, block.clone(), 0.0, 0.07 + 0.123 * f32::from(i), 0.0));
    let mut world = World::new(shelf(), row.collect());
    world.settle();
    let push = Push { start: [0.0, 0.0, 0.06], direction_deg: 90.0, length_m: 0.12 };
    let outcome = push_in(&mut world, &arm(), &push);
    assert!(outcome.stalled, "{outcome:?}");
    // 1 cm to the first box, then the play of 2 x 3 mm and 2.4 cm to the wall.
    assert!(outcome.way_m > 0.02 && outcome.way_m < 0.06, "{outcome:?}");
    assert!(world.deepest_overlap_m() < 0.002, "{}", world.deepest_overlap_m());
    assert!(world.kinetic_energy_j() < 1e-6);
    assert!(outcome.dropped.is_empty());
    for body in world.bodies() {
        let up = body.world_from_body.rotation * Vector::z();
        assert!(up.z > 0.99 && body.world_from_body.translation.z.abs() < 0.003, "{:?}", body.world_from_body);
    }
}

#[test]
fn pushes_into_a_crowd_stay_sane() {
    let arm = arm();
    for i in 0..12 {
        let mut world = World::new(shelf(), crowd());
        world.settle();
        let push = Push {
            start: [-0.33 + 0.06 * i as f32, 0.02, 0.06],
            direction_deg: 40.0 + 10.0 * i as f32,
            length_m: 0.15,
        };
        let outcome = push_in(&mut world, &arm, &push);
        assert!(world.deepest_overlap_m() < 0.002, "push {i}: {}", world.deepest_overlap_m());
        assert!(world.kinetic_energy_j() < 1e-6);
        for (at, moved) in outcome.displacement_m.iter().enumerate() {
            // A toppled box moves by its height at most beyond the push.
            assert!(*moved < 0.45, "push {i} moved object {at} by {moved} m");
        }
        for body in world.bodies() {
            let bounds = body.solid.bounds_at(&body.world_from_body);
            assert!(bounds.max.x < 0.403 && bounds.min.x > -0.403 && bounds.max.y < 0.403, "push {i}: {bounds:?}");
            assert!(bounds.min.z > -0.003, "push {i}: {bounds:?}");
        }
    }
}
