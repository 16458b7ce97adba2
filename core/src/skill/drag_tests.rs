use super::*;
use crate::arm::ArmTool;
use crate::belief::{BeliefUpdate, Classical, evidence};
use crate::rng::stream;
use crate::scene::{Body, ClassId, ObjectId, Shelf};
use crate::skill::PickPlace;
use crate::skill::{PushSampler, SkillKind};
use crate::solid::Solid;
use crate::world::World;
use crate::{Pose, Vector};
use std::sync::Arc;

const SIZE_M: [f32; 3] = [0.80, 0.40, 0.40];
/// A low box: where its middle stands, and its size.
const BOX: ([f32; 2], [f32; 3]) = ([0.02, 0.20], [0.10, 0.06, 0.07]);

/// A shelf that is believed free but for boxes, each with its class.
fn believed(boxes: &[([f32; 2], [f32; 3], usize)]) -> Belief {
    let grid = Grid::for_shelf(SIZE_M, 0.005);
    let mut belief = Belief::uniform(grid);
    belief.occupancy.fill(evidence(-3.0, 30.0));
    for cell in 0..grid.cell_count() {
        let at = grid.cell_center(grid.cell(cell));
        for &([x, y], [dx, dy, dz], class) in boxes {
            if (at.x - x).abs() < 0.5 * dx && (at.y - y).abs() < 0.5 * dy {
                let levels = grid.levels_below(dz);
                belief.occupancy[grid.column(cell)][..levels].fill(evidence(3.0, 30.0));
                belief.semantics[cell][class] += 4.0;
            }
        }
    }
    belief
}

fn arm() -> ArmTool {
    ArmTool::standard(Shelf::new(SIZE_M))
}

fn drawn(belief: &Belief, arm: &ArmTool) -> Vec<Candidate> {
    let ground =
        Ground { belief, seen: None, arm, sampler: PushSampler::Frontier, place: PickPlace::Shelf, unsealed: &[] };
    SkillKind::Drag.sample(&ground, 6, &mut stream(1, "drags", 0))
}

#[test]
fn a_low_box_with_free_space_behind_it_is_pulled_towards_the_entrance() {
    let belief = believed(&[(BOX.0, BOX.1, 5)]);
    let arm = arm();
    let candidates = drawn(&belief, &arm);
    let feasible: Vec<&Candidate> = candidates.iter().filter(|candidate| candidate.rejection.is_none()).collect();
    assert!(feasible.len() >= 3, "{:?}", candidates.iter().map(|c| c.rejection.clone()).collect::<Vec<_>>());

    let shelf = Shelf::new(SIZE_M);
    let [x, y] = BOX.0;
    let body = Body {
        id: ObjectId(0),
        class: ClassId(5),
        solid: Arc::new(Solid::standing_box(Vector::from(BOX.1))),
        world_from_body: Pose::translation(x, y, 0.0),
        mass_kg: 0.3,
        friction: 0.4,
    };
    let mut world = World::new(shelf, vec![body]);
    world.settle();
    let moved = feasible.iter().map(|candidate| {
        let mut world = world.clone();
        let motion = candidate.motion.as_ref().expect("of a feasible one");
        let outcome = world.execute(&arm.arm, motion);
        let after = world.bodies().first().map_or(-1.0, |body| body.world_from_body.translation.y);
        assert!(candidate.manipulation.skill().is_done_by(motion, &arm.arm, &arm.ready.expect("it waits")));
        (after - y, outcome.way_m)
    });
    let moved: Vec<(f32, f32)> = moved.collect();
    assert!(moved.iter().any(|(towards, _)| *towards < -0.02), "{moved:?}");
    assert!(moved.iter().all(|(towards, _)| *towards < 0.01), "never into the shelf: {moved:?}");
}

#[test]
fn what_is_dragged_is_believed_nearer_to_the_entrance_and_gone_from_where_it_stood() {
    let belief = believed(&[(BOX.0, BOX.1, 5)]);
    let arm = arm();
    let candidates = drawn(&belief, &arm);
    let candidate = candidates.iter().find(|candidate| candidate.rejection.is_none()).expect("a feasible one");
    let Manipulation::Drag(drag) = candidate.manipulation else { panic!("no drag") };
    let solid = FloorPlan::new(&belief, SOLID);
    let intervention = drag.intervention(&belief, &solid, candidate.swept.clone());
    let ways: Vec<[f32; 2]> = intervention.flow.displacement_m.iter().flatten().copied().collect();
    assert_eq!(ways.len(), 20 * 12, "all cells of the box");
    assert!(ways.iter().all(|way| *way == ways[0] && way[1] < -0.01), "as a whole towards the entrance: {:?}", ways[0]);
    let mut after = belief.clone();
    after.apply(&Classical.predict(&belief, &[intervention]).remove(0));
    let rows = |belief: &Belief| -> Vec<usize> {
        let column = |y: usize| belief.grid.column(belief.grid.cell_index(Cell { x: 84, y: y as u16 })).start + 4;
        (0..80).filter(|y| belief.probability(column(*y)) > 0.5).collect()
    };
    let (before, after) = (rows(&belief), rows(&after));
    assert_eq!(before, (34..46).collect::<Vec<_>>());
    assert!(after.first() < before.first() && after.last() < before.last(), "{before:?} {after:?}");
}

#[test]
fn nothing_is_dragged_against_a_wall_nor_where_something_likely_stands_behind() {
    let arm = arm();
    let at_the_back = believed(&[([0.0, 0.37], [0.10, 0.06, 0.07], 5)]);
    assert!(drawn(&at_the_back, &arm).is_empty());
    // What is right behind an object no view shows: that it is unknown does not count against it, that it is filled does.
    let with_behind = |evidence: [f32; 2]| {
        let mut belief = believed(&[(BOX.0, BOX.1, 5)]);
        for index in 0..belief.grid.voxel_count() {
            if belief.grid.center(belief.grid.voxel(index)).y > 0.23 {
                belief.occupancy[index] = evidence;
            }
        }
        belief
    };
    assert!(!drawn(&with_behind([1.0, 1.0]), &arm).is_empty());
    assert!(drawn(&with_behind([2.0, 1.0]), &arm).is_empty());
}

#[test]
fn nothing_tall_is_reached_over() {
    let tall = believed(&[(BOX.0, [0.10, 0.06, 0.25], 5)]);
    let candidates = drawn(&tall, &arm());
    assert!(!candidates.is_empty() && candidates.iter().all(|candidate| candidate.rejection.is_some()));
}

#[test]
fn a_drag_tells_its_numbers_and_shows_the_gripper_over_what_it_pulls() {
    let drag = Drag { start: [0.1, 0.25, 0.05], direction_deg: -90.0, length_m: 0.08, pitch_deg: 45.0 };
    let (description, outline) = (drag.describe(), drag.outline());
    assert_eq!(description.words, "drag 80 mm towards -90°");
    assert_eq!((description.value("pitch_deg"), description.value("length_m")), (Some(45.0), Some(0.08)));
    assert!((outline.arrows[0].end() - Point::new(0.1, 0.17, 0.05)).norm() < 1e-6);
    let top = outline.lines[0][1];
    assert!(top.y < 0.25 && top.z > 0.05, "up and towards the entrance: {top}");
    assert!(!Drag { pitch_deg: f32::NAN, ..drag }.is_finite() && drag.is_finite());
    assert_eq!(drag.shortened(0.03), Drag { length_m: 0.03, ..drag }.into());
}
