//! Picks: what they make way for, how many looks close them, and where the cup failed.

use super::*;
use crate::arm::Arm;
use crate::scene::{RobotFile, RobotPlacement};
use crate::skill::{Manipulation, Pick, PickPlace, Rejection};
use crate::world::GripEnd;

/// A wide, tall box that hides the back of the shelf, and a small one before it.
fn behind_two() -> Belief {
    let grid = Grid::for_shelf([0.80, 0.40, 0.40], 0.005);
    let mut belief = Belief::uniform(grid);
    let boxes = [([-0.035, 0.035, 0.05, 0.10], 0.10, 3), ([-0.15, 0.15, 0.15, 0.20], 0.30, 5)];
    for index in 0..grid.voxel_count() {
        let at = grid.center(grid.voxel(index));
        let filled = boxes
            .iter()
            .any(|([x0, x1, y0, y1], top, _)| (*x0..*x1).contains(&at.x) && (*y0..*y1).contains(&at.y) && at.z < *top);
        belief.occupancy[index] = if filled {
            evidence(3.4, 40.0)
        } else if (-0.07..0.07).contains(&at.x) && at.y >= 0.20 && at.z < 0.20 {
            // No view reaches it: the box is in the way from either side.
            [1.0, 1.0]
        } else {
            evidence(-3.4, 40.0)
        };
    }
    for cell in 0..grid.cell_count() {
        let at = grid.cell_center(grid.cell(cell));
        for ([x0, x1, y0, y1], _, class) in boxes {
            if (x0..x1).contains(&at.x) && (y0..y1).contains(&at.y) {
                belief.semantics[cell][class] += 20.0;
            }
        }
    }
    belief
}

/// With a suction cup before that shelf, after `looks` looks.
fn table(looks: usize) -> Table {
    let mut table = Table::after_looks(looks);
    table.belief = behind_two();
    table.seen = VoxelSet::empty(&table.belief.grid);
    let placement = RobotPlacement { urdf: Some(RobotFile::suction()), ..RobotPlacement::default() };
    table.arm = ArmTool::new(Arm::placed(&placement).expect("shipped"), Shelf::new([0.80, 0.40, 0.40]));
    table.settings = PlannerSettings { place: PickPlace::Tray, ..table.settings.counting(Counted::Unseen) };
    table
}

/// The candidate to pick what stands at a depth.
fn pick_at(decision: &Decision, y: f32) -> (Pick, &CandidateRecord) {
    let found = decision.candidates.iter().find_map(|candidate| match candidate.manipulation {
        Manipulation::Pick(pick) if (pick.contact[1] - y).abs() < 0.01 => Some((pick, candidate)),
        _ => None,
    });
    found.unwrap_or_else(|| panic!("no pick at {y}: {:?}", decision.candidates))
}

#[test]
fn what_stands_before_what_hides_is_taken_for_what_it_makes_way_for() {
    let table = table(4);
    let decision = table.decide(PolicyKind::MemPick);
    let (small, first) = pick_at(&decision, 0.05);
    let Some(Manipulation::Pick(then)) = first.then else { panic!("it makes way for nothing: {first:?}") };
    assert!((then.contact[1] - 0.15).abs() < 0.01, "{then:?}");
    assert_eq!(pick_at(&decision, 0.15).1.rejection, Some(Rejection::NoWayOut));
    assert_eq!(decision.action, Action::Manipulate(small.into()));
    // Half of what both open, and the wide box opens nearly all of it.
    let mut alone = table;
    for voxel in 0..alone.belief.grid.voxel_count() {
        let at = alone.belief.grid.center(alone.belief.grid.voxel(voxel));
        if at.y < 0.12 {
            alone.belief.occupancy[voxel] = evidence(-3.4, 40.0);
        }
    }
    let decision = alone.decide(PolicyKind::MemPick);
    let wide = pick_at(&decision, 0.15).1.gain.expect("feasible");
    let share = first.gain.expect("feasible") / wide;
    assert!((0.3..0.6).contains(&share), "{share} of {wide}");
}

#[test]
fn one_look_closes_a_pick_and_more_close_a_push() {
    let mut table = table(4);
    let picked = table.decide(PolicyKind::MemPick);
    assert!(is_push(&picked), "a pick");
    table.history.record(&picked, false, Some(GripEnd::Stowed));
    let next = table.decide(PolicyKind::MemPick);
    assert_eq!((is_push(&next), next.reason), (false, Reason::JustPushed));
    table.history.record(&next, false, None);
    assert!(is_push(&table.decide(PolicyKind::MemPick)), "after one look");
    let pushed = Decision { action: Action::Manipulate(push().into()), ..picked };
    table.history.record(&pushed, false, None);
    table.history.record(&next, false, None);
    assert_eq!(table.decide(PolicyKind::MemPick).reason, Reason::JustPushed);
}

#[test]
fn a_cup_that_did_not_seal_is_not_set_on_the_same_spot_again() {
    let mut table = table(4);
    let picked = table.decide(PolicyKind::MemPick);
    let (small, _) = pick_at(&picked, 0.05);
    table.history.record(&picked, false, Some(GripEnd::NoSeal));
    table.history.record(&Decision::unweighed(Action::Look { view: ViewId(0) }, Reason::Schedule), false, None);
    let again = table.decide(PolicyKind::MemPick);
    let (other, _) = pick_at(&again, 0.05);
    let apart = (0..3).map(|i| (small.contact[i] - other.contact[i]).powi(2)).sum::<f32>().sqrt();
    assert!(apart > 0.014 || pick_at(&again, 0.05).1.rejection == Some(Rejection::NoFace), "{apart}");
}
