use super::frontier::likely_targets;
use super::*;
use crate::arm::{Hit, Obstacle};
use crate::belief::evidence;
use crate::grid::Grid;
use crate::rng::stream;
use crate::skill::Stage;
use crate::{Point, Vector};

/// A shelf believed free but for boxes `[x0, x1, y0, y1, height]` (metres), each with its class on its cells.
fn believed(boxes: &[([f32; 5], u8)]) -> Belief {
    let grid = Grid::for_shelf([0.80, 0.40, 0.40], 0.005);
    let mut belief = Belief::uniform(grid);
    belief.occupancy.fill(evidence(-3.0, 30.0));
    for &([x0, x1, y0, y1, height], class) in boxes {
        for cell in 0..grid.cell_count() {
            let at = grid.cell_center(grid.cell(cell));
            if (x0..x1).contains(&at.x) && (y0..y1).contains(&at.y) {
                let levels = grid.levels_below(height);
                belief.occupancy[grid.column(cell)][..levels].fill(evidence(3.0, 30.0));
                belief.semantics[cell][usize::from(class)] += 4.0;
            }
        }
    }
    belief
}

fn voxel_at(belief: &Belief, x: f32, y: f32, z: f32) -> Voxel {
    belief.grid.voxel_at(Point::new(x, y, z)).expect("inside the grid")
}

fn arm() -> ArmTool {
    ArmTool::standard(crate::scene::Shelf::new([0.80, 0.40, 0.40]))
}

/// What the checks say to a push towards the object whose front is at `front`.
fn verdict(belief: &Belief, front: [f32; 3], direction_deg: f32, length_m: f32) -> Option<Rejection> {
    let arm = arm();
    let clearance = ArmClearance::new(&arm, belief);
    let frontier = voxel_at(belief, front[0], front[1], front[2]);
    let push = Push { start: start_of(belief, frontier), direction_deg, length_m };
    push.motion(&clearance, &clearance.target(frontier), &mut stream(1, "verdict", 0)).err()
}

/// The push that was drawn.
fn push_of(candidate: &Candidate) -> Push {
    match candidate.manipulation {
        Manipulation::Push(push) => push,
        other => panic!("no push: {other:?}"),
    }
}

/// Where on its way, and which voxel of the map, a blocked push meets.
fn met(rejection: Option<Rejection>) -> (Stage, [f32; 3]) {
    match rejection {
        Some(Rejection::ArmBlocked { stage, hit: Hit { obstacle: Obstacle::Map { at }, .. } }) => (stage, at),
        other => panic!("not blocked by the map: {other:?}"),
    }
}

/// Which panel of the shelf a blocked push meets.
fn panel(rejection: Option<Rejection>) -> String {
    match rejection {
        Some(Rejection::ArmBlocked { hit: Hit { obstacle: Obstacle::Shelf { panel }, .. }, .. }) => panel.to_string(),
        other => panic!("not blocked by the shelf: {other:?}"),
    }
}

const TALL: f32 = 0.20;

#[test]
fn the_frontier_is_the_first_confident_voxel_of_each_column() {
    let mut belief = believed(&[([-0.02, 0.02, 0.20, 0.25, 0.10], 3), ([-0.02, 0.0, 0.30, 0.35, TALL], 5)]);
    let grid = belief.grid;
    let points = frontier(&belief);
    // Eight columns of 20 levels at y = 0.20; behind them four columns show their levels 20 to 39.
    assert_eq!(points.len(), 8 * 20 + 4 * 20);
    assert!(points.iter().all(|v| if v.z < 20 { v.y == 40 } else { v.y == 60 }), "{points:?}");
    assert!(points.is_sorted_by_key(|v| (v.x, v.z)));
    // Below 0.85 a voxel is seen through.
    belief.occupancy[grid.index(Voxel { x: 80, y: 40, z: 0 })] = [8.4, 1.6];
    belief.occupancy[grid.index(Voxel { x: 81, y: 40, z: 0 })] = [8.5, 1.5];
    let points = frontier(&belief);
    assert!(points.contains(&Voxel { x: 80, y: 41, z: 0 }) && points.contains(&Voxel { x: 81, y: 40, z: 0 }));
}

#[test]
fn likely_targets_are_near_and_not_behind_the_start() {
    let belief = believed(&[([-0.2, 0.2, 0.20, 0.35, TALL], 3)]);
    let point = voxel_at(&belief, 0.0, 0.20, 0.06);
    let center = belief.grid.center(point);
    let targets = likely_targets(&belief, point, center.y - STANDOFF_M);
    assert!(!targets.contains(&point));
    assert!(targets.iter().all(|v| (belief.grid.center(*v) - center).norm() < REACH_M + 1e-4));
    // Half a ball of twelve voxels: 2/3 pi 12^3 = 3619 and half its middle slice of 452.
    assert!((3600..4000).contains(&targets.len()), "{}", targets.len());
    let from_within = likely_targets(&belief, point, center.y + 0.021);
    assert!(from_within.len() < targets.len() && !from_within.is_empty());
    assert!(from_within.iter().all(|v| belief.grid.center(*v).y >= center.y + 0.021));
}

#[test]
fn a_lone_box_can_be_pushed() {
    let belief = believed(&[([-0.04, 0.04, 0.20, 0.25, TALL], 3)]);
    assert_eq!(verdict(&belief, [0.0, 0.20, 0.06], 90.0, 0.10), None);
}

#[test]
fn a_wall_before_the_target_blocks_the_start_and_a_gap_in_it_lets_the_arm_through() {
    let walled = |gap: f32| {
        let part = |x0: f32, x1: f32| ([x0, x1, 0.10, 0.15, TALL], 6);
        believed(&[([-0.04, 0.04, 0.30, 0.35, TALL], 3), part(-0.38, -gap), part(gap, 0.38)])
    };
    // At the start the gripper stands where the wall is.
    let (stage, at) = met(verdict(&walled(0.0), [0.0, 0.30, 0.06], 90.0, 0.05));
    assert_eq!(stage, Stage::Start);
    assert!((0.10..0.15).contains(&at[1]) && at[2] < TALL, "{at:?}");
    assert_eq!(verdict(&walled(0.20), [0.0, 0.30, 0.06], 90.0, 0.05), None);
}

#[test]
fn a_box_beside_a_sideways_push_blocks_its_path() {
    let boxes = [([-0.04, 0.00, 0.20, 0.25, TALL], 3), ([0.09, 0.16, 0.02, 0.17, TALL], 6)];
    let belief = believed(&boxes);
    assert_eq!(verdict(&belief, [-0.02, 0.20, 0.06], 90.0, 0.10), None, "straight in there is room");
    let (stage, at) = met(verdict(&belief, [-0.02, 0.20, 0.06], 0.0, 0.14));
    assert_eq!(stage, Stage::Contact);
    assert!((0.09..0.16).contains(&at[0]) && (0.02..0.17).contains(&at[1]), "{at:?}");
    assert_eq!(verdict(&belief, [-0.02, 0.20, 0.06], 0.0, 0.03), None, "a shorter push stays clear of it");
}

#[test]
fn another_class_behind_the_target_blocks_and_its_own_class_does_not() {
    let touching = |class| believed(&[([-0.04, 0.04, 0.20, 0.24, TALL], 3), ([-0.04, 0.04, 0.24, 0.30, TALL], class)]);
    assert_eq!(verdict(&touching(3), [0.0, 0.20, 0.06], 90.0, 0.10), None);
    let (stage, at) = met(verdict(&touching(5), [0.0, 0.20, 0.06], 90.0, 0.10));
    assert!(stage == Stage::Contact && at[1] >= 0.24, "{stage:?} {at:?}");
    assert_eq!(verdict(&touching(5), [0.0, 0.20, 0.06], 90.0, 0.05), None, "before the tip gets there");
}

#[test]
fn walls_are_the_shelf_and_the_back_is_out_of_reach() {
    let near_wall = believed(&[([0.36, 0.39, 0.20, 0.25, TALL], 3)]);
    assert_eq!(panel(verdict(&near_wall, [0.385, 0.20, 0.06], 90.0, 0.05)), "right wall");
    let towards_wall = believed(&[([0.30, 0.33, 0.20, 0.25, TALL], 3)]);
    assert_eq!(panel(verdict(&towards_wall, [0.31, 0.20, 0.06], 0.0, 0.10)), "right wall");
    let near_back = believed(&[([-0.02, 0.02, 0.30, 0.39, TALL], 3)]);
    let too_far = Some(Rejection::Unreachable { stage: Stage::Contact });
    assert_eq!(verdict(&near_back, [0.0, 0.30, 0.06], 90.0, 0.15), too_far);
    assert_eq!(verdict(&near_back, [0.0, 0.30, 0.06], 90.0, 0.05), None);
}

#[test]
fn samples_are_what_the_method_says() {
    let belief = believed(&[
        ([-0.25, -0.17, 0.15, 0.20, TALL], 3),
        ([-0.02, 0.05, 0.22, 0.26, 0.12], 5),
        ([0.20, 0.26, 0.10, 0.16, TALL], 7),
    ]);
    let arm = arm();
    let candidates = sample(PushSampler::Frontier, &belief, None, &arm, 30, &mut stream(1, "pushes", 4));
    assert_eq!(candidates.iter().filter(|c| c.rejection.is_none()).count(), 30);
    assert!(candidates.last().is_some_and(|c| c.rejection.is_none()), "drawing ends with the last one wanted");
    for candidate in &candidates {
        let (push, point) = (&push_of(candidate), belief.grid.center(candidate.contact));
        assert!((0.0..=180.0).contains(&push.direction_deg), "{push:?}");
        assert!((LENGTH_M[0]..LENGTH_M[1]).contains(&push.length_m), "{push:?}");
        assert_eq!(push.start, [point.x, point.y - STANDOFF_M, TOOL_HEIGHT_M]);
        let swept = &candidate.swept;
        match &candidate.motion {
            Some(motion) => {
                let ready = arm.ready.expect("it waits somewhere");
                assert!(candidate.rejection.is_none() && push.is_done_by(motion, &arm.arm, &ready));
                assert_eq!(*swept, motion.swept_volume(&arm.arm, &belief.grid));
            }
            None => assert!(candidate.rejection.is_some()),
        }
        // The tip is in what is swept, from start to end.
        for at in [push.start_point(), push.end_point()] {
            let inside = belief.grid.voxel_at(at - Vector::y() * 0.004);
            assert!(inside.is_none_or(|voxel| swept.contains(belief.grid.index(voxel))), "{push:?}");
        }
    }
    assert!(!candidates.is_sorted_by_key(|c| (c.contact.x, c.contact.z)), "drawn at random, not in order");
    for (i, a) in candidates.iter().enumerate() {
        assert!(candidates[..i].iter().all(|b| a.contact != b.contact), "drawn twice");
    }
}

#[test]
fn sampling_does_not_depend_on_the_number_of_threads_but_on_the_stream() {
    let belief = believed(&[([-0.25, -0.10, 0.15, 0.20, TALL], 3), ([0.0, 0.09, 0.22, 0.26, 0.12], 5)]);
    let arm = arm();
    let on = |sampler: PushSampler, threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let drawn = pool.install(|| sample(sampler, &belief, None, &arm, 20, &mut stream(seed, "pushes", 0)));
        drawn.into_iter().map(|c| (c.contact, push_of(&c), c.rejection)).collect::<Vec<_>>()
    };
    for sampler in PushSampler::ALL {
        assert_eq!(on(sampler, 1, 3), on(sampler, 4, 3));
        assert_ne!(on(sampler, 1, 3), on(sampler, 1, 4));
    }
}

#[test]
fn a_lone_voxel_is_no_target_and_an_empty_shelf_gives_no_candidate() {
    let mut belief = believed(&[]);
    let arm = arm();
    let drawn =
        |sampler: PushSampler, belief: &Belief| sample(sampler, belief, None, &arm, 10, &mut stream(1, "pushes", 0));
    assert!(PushSampler::ALL.iter().all(|sampler| drawn(*sampler, &belief).is_empty()));
    let index = belief.grid.index(voxel_at(&belief, 0.0, 0.2, 0.1));
    belief.occupancy[index] = evidence(3.0, 30.0);
    let candidates = drawn(PushSampler::Frontier, &belief);
    assert_eq!(candidates.len(), 1);
    assert_eq!(candidates[0].rejection, Some(Rejection::NoTarget));
}

#[test]
fn a_shelf_that_is_full_gives_up_after_its_draws() {
    let belief = believed(&[([-0.4, 0.4, 0.0, 0.4, TALL], 3)]);
    for sampler in PushSampler::ALL {
        let candidates = sample(sampler, &belief, None, &arm(), 4, &mut stream(1, "pushes", 0));
        assert!(candidates.len() <= 4 * DRAWS_PER_CANDIDATE);
    }
}

#[test]
fn pushes_before_what_is_hidden_touch_a_side_of_what_hides_it() {
    // A wall on the left with unknown space behind it, and a post on the right with everything seen behind it.
    let mut belief = believed(&[([-0.25, -0.10, 0.15, 0.20, TALL], 3), ([0.15, 0.21, 0.15, 0.20, TALL], 5)]);
    let (grid, arm) = (belief.grid, arm());
    let mut seen = VoxelSet::empty(&grid);
    for index in 0..grid.voxel_count() {
        let at = grid.center(grid.voxel(index));
        if at.x < 0.0 && at.y > 0.20 {
            belief.occupancy[index] = [1.0, 1.0];
        } else {
            seen.insert(index);
        }
    }
    let candidates = sample(PushSampler::Hidden, &belief, Some(&seen), &arm, 60, &mut stream(1, "pushes", 0));
    assert!(candidates.iter().filter(|c| c.rejection.is_none()).count() > 20);
    let at_wall = candidates.iter().filter(|c| grid.center(c.contact).x < 0.0).count();
    assert!(10 * at_wall > 9 * candidates.len(), "{at_wall} of {}", candidates.len());
    let mut across = 0;
    for candidate in candidates.iter().filter(|c| c.rejection != Some(Rejection::NoTarget)) {
        let (push, contact) = (&push_of(candidate), grid.center(candidate.contact));
        assert!(belief.probability(grid.index(candidate.contact)) > CONFIDENT);
        let met = push.start_point() + push.direction() * STANDOFF_M;
        assert!((met.x - contact.x).hypot(met.y - contact.y) < 1e-4, "{push:?}");
        assert!((-20.0..200.0).contains(&push.direction_deg), "{push:?}");
        // The tip starts clear of everything.
        assert!(
            grid.voxel_at(push.start_point()).is_none_or(|at| belief.probability(grid.index(at)) < 0.5),
            "{push:?}"
        );
        across += usize::from(!(45.0..135.0).contains(&push.direction_deg));
    }
    assert!(5 * across > candidates.len(), "{across} of {} across", candidates.len());
}

#[test]
fn rejections_read_as_they_are_filed() {
    let json = serde_json::to_string(&Rejection::Unreachable { stage: Stage::WayIn }).expect("json");
    assert_eq!(json, r#"{"kind":"unreachable","stage":"way_in"}"#);
}

#[test]
fn a_rejection_by_the_arms_own_link_comes_back_from_a_file() {
    let hit = Hit { link: "forearm".to_owned(), obstacle: Obstacle::Arm { link: "base".to_owned() } };
    let rejection = Rejection::ArmBlocked { stage: Stage::Start, hit };
    let text = serde_json::to_string(&rejection).expect("written");
    assert_eq!(text.matches("\"link\"").count(), 1, "{text}");
    assert_eq!(serde_json::from_str::<Rejection>(&text).expect("read"), rejection);
}
