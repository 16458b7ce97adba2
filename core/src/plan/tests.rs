//! Decisions on a small shelf: 1 cm voxels, a dozen views, a few boxes.

use super::*;
use crate::belief::{Classical, FloorPlan, Intervention, Prediction, SOLID, evidence};
use crate::camera::{Intrinsics, MapObservation, View};
use crate::gain::{Coverage, GainField, Openings, RayDensity, gain_of_views, gain_together};
use crate::grid::{Grid, VoxelSet, Window};
use crate::scene::{CLASS_COUNT, Shelf};
use crate::skill::push::{Push, SweptPush};
use crate::{Point, Pose, Vector};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

mod clairvoyant;
mod kept;
mod mem;
mod picks;
mod policies;

const BUDGET: usize = 20;

fn looking_from(id: u16, from: Point, target: Point) -> View {
    let forward = (target - from).normalize();
    let right = forward.cross(&Vector::z()).normalize();
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    View {
        id: ViewId(id),
        world_from_camera: Pose::from_parts(Translation3::from(from.coords), rotation),
        target: target.coords.into(),
        slot: [id % 4, id / 4, 0],
    }
}

/// Twelve views, four across and three up.
fn views() -> ViewArray {
    let view = |id: u16| {
        let from = Point::new(-0.3 + 0.2 * f32::from(id % 4), -0.25, 0.08 + 0.08 * f32::from(id / 4));
        looking_from(id, from, Point::new(0.0, 0.2, 0.1))
    };
    ViewArray {
        name: "test".to_owned(),
        intrinsics: Intrinsics { width: 160, height: 120, focal_px: 108.0, depth_range_m: [0.07, 1.5] },
        layout: [4, 3, 1],
        views: (0..12).map(view).collect(),
    }
}

/// A shelf with two known boxes, the space behind them unknown, the rest known free.
fn half_seen() -> Belief {
    let grid = Grid::for_shelf([0.80, 0.40, 0.40], 0.01);
    let mut belief = Belief::uniform(grid);
    let boxes = [(-0.20, -0.10, 5), (0.10, 0.18, 7)];
    for index in 0..grid.voxel_count() {
        let at = grid.center(grid.voxel(index));
        let beside = |margin: f32| boxes.iter().any(|&(x0, x1, _)| (x0 - margin..x1 + margin).contains(&at.x));
        belief.occupancy[index] = if beside(0.0) && (0.15..0.20).contains(&at.y) && at.z < 0.15 {
            evidence(3.4, 40.0)
        } else if beside(0.02) && at.y >= 0.20 && at.z < 0.18 {
            [1.0, 1.0]
        } else {
            evidence(-3.4, 40.0)
        };
    }
    for cell in 0..grid.cell_count() {
        let at = grid.cell_center(grid.cell(cell));
        for (x0, x1, class) in boxes {
            if (x0..x1).contains(&at.x) && (0.15..0.20).contains(&at.y) {
                belief.semantics[cell][class] += 3.0;
            }
        }
    }
    belief
}

/// Predicts that a push leaves nothing known, or nothing unknown, of the whole shelf.
#[derive(Clone, Copy)]
enum Prophet {
    Forgets,
    Knows,
}

impl BeliefUpdate for Prophet {
    fn name(&self) -> &str {
        "prophet"
    }

    fn observe(&self, belief: &Belief, _: &MapObservation) -> Belief {
        belief.clone()
    }

    fn predict(&self, belief: &Belief, pushes: &[Intervention]) -> Vec<Prediction> {
        let grid = &belief.grid;
        let voxel = match self {
            Self::Forgets => [1.0, 1.0],
            Self::Knows => [1.0, 1000.0],
        };
        let prediction = Prediction {
            window: Window::whole(grid),
            occupancy: vec![voxel; grid.voxel_count()],
            semantics: vec![[1.0; CLASS_COUNT]; grid.cell_count()],
            change: vec![1.0; grid.cell_count()],
        };
        vec![prediction; pushes.len()]
    }
}

/// Everything that a decision needs, to be changed by each test.
struct Table {
    belief: Belief,
    update: Box<dyn BeliefUpdate>,
    views: ViewArray,
    arm: ArmTool,
    seen: VoxelSet,
    history: History,
    settings: PlannerSettings,
    seed: u64,
    /// What pushes really do, in the order of the feasible ones: numbers of objects won and lost, voxels opened. Nothing
    /// for those that are not told.
    really: Vec<[usize; 3]>,
}

impl Table {
    fn new() -> Self {
        let belief = half_seen();
        Self {
            seen: VoxelSet::empty(&belief.grid),
            belief,
            update: Box::new(Classical),
            views: views(),
            arm: ArmTool::standard(Shelf::new([0.80, 0.40, 0.40])),
            history: History::default(),
            settings: PlannerSettings { candidates: 6, ..PlannerSettings::default() },
            seed: 7,
            really: Vec::new(),
        }
    }

    /// After `count` looks from views that do not matter.
    fn after_looks(count: usize) -> Self {
        let mut table = Self::new();
        table.history.actions = vec![Action::Look { view: ViewId(0) }; count];
        table
    }

    fn decide(&self, policy: PolicyKind) -> Decision {
        // The clairvoyant look knows most from view 9: it gives the Betas the most evidence for free.
        let really_look = |view: ViewId| {
            let mut belief = self.belief.clone();
            let sure = if view == ViewId(9) { 100.0 } else { 3.0 + f32::from(view.0) };
            belief.occupancy.iter_mut().for_each(|voxel| voxel[1] += sure);
            belief
        };
        let really_push = |motions: &[PhasedMotion]| {
            let told = |at: usize| self.really.get(at).copied().unwrap_or_default();
            (0..motions.len()).map(|at| self.truth(told(at))).collect()
        };
        let situation = Situation {
            belief: &self.belief,
            update: self.update.as_ref(),
            views: &self.views,
            arm: &self.arm,
            unreachable: &[],
            history: &self.history,
            seen: &self.seen,
            budget: BUDGET,
            seed: self.seed,
            really_look: &really_look,
            really_push: &really_push,
        };
        decide(policy, &self.settings, &situation)
    }

    /// The truth of a push that wins and loses so many objects and opens so many voxels, the unknown ones first.
    fn truth(&self, [won, lost, opened]: [usize; 3]) -> PushTruth {
        let objects = |count: usize| (0..count as u16).map(crate::scene::ObjectId).collect();
        let mut space = VoxelSet::empty(&self.belief.grid);
        let unknown = (0..self.belief.grid.voxel_count()).filter(|at| self.belief.occupancy[*at] == [1.0, 1.0]);
        unknown.take(opened).for_each(|at| space.insert(at));
        PushTruth {
            won: objects(won),
            lost: objects(lost),
            opened: space,
            displacement_m: 0.1,
            pushed_m: 0.1,
            jammed: false,
            dropped: Vec::new(),
            toppled: Vec::new(),
            shown: Vec::new(),
            grip: None,
            occupied: VoxelSet::empty(&self.belief.grid),
        }
    }

    /// Decides and takes down `count` steps in which the belief stays as it is.
    fn run(&mut self, policy: PolicyKind, count: usize) -> Vec<Decision> {
        (0..count)
            .map(|_| {
                let decision = self.decide(policy);
                self.history.record(&decision, false, None);
                decision
            })
            .collect()
    }
}

fn is_push(decision: &Decision) -> bool {
    matches!(decision.action, Action::Manipulate(_))
}

/// Numbers, from 1, of the steps that push.
fn pushes_at(decisions: &[Decision]) -> Vec<usize> {
    decisions.iter().enumerate().filter(|(_, d)| is_push(d)).map(|(at, _)| at + 1).collect()
}

fn push() -> Push {
    Push { start: [-0.15, 0.13, 0.06], direction_deg: 90.0, length_m: 0.1 }
}

#[test]
fn the_first_look_comes_from_above_where_only_unseen_voxels_count() {
    let mut table = Table::new();
    table.belief = Belief::uniform(table.belief.grid);
    let best_height = |table: &Table| {
        let Action::Look { view } = table.decide(PolicyKind::MemNoPush).action else { panic!("a look") };
        table.views.view(view).expect("a view").position().z
    };
    let heights: Vec<f32> = table.views.views.iter().map(|view| view.position().z).collect();
    let highest = heights.iter().copied().fold(0.0, f32::max);
    assert!(heights.iter().any(|height| *height < highest - 0.05), "views of several heights");
    table.settings = table.settings.counting(Counted::Unseen);
    assert!((best_height(&table) - highest).abs() < 1e-6);

    // It is worth it for what it sees past the front: with p = 0.5 everywhere nothing of the back half would be reached.
    let nothing = VoxelSet::empty(&table.belief.grid);
    let view = table.decide(PolicyKind::MemNoPush).pair[0];
    let share_of_back = |sources: Vec<(usize, f32)>| {
        let grid = &table.belief.grid;
        let behind = |voxel: usize| 2 * usize::from(grid.voxel(voxel).y) >= grid.dims[1];
        let sum = |of: &dyn Fn(usize) -> bool| -> f32 { sources.iter().filter(|s| of(s.0)).map(|s| s.1).sum() };
        sum(&behind) / sum(&|_| true)
    };
    let standing = Gain::new(Counted::Unseen, &table.belief, &nothing);
    let share = share_of_back(standing.per_voxel(&table.views, view, RayDensity::FULL));
    assert!(share > 0.05, "{share}");
    let flat = GainField::new(&table.belief).with_seen(&nothing);
    assert!(share_of_back(Coverage::new(&flat, &table.views, &[view], RayDensity::FULL).per_voxel(0)) < 0.01);
}

#[test]
fn where_only_unseen_voxels_count_each_counts_once() {
    let mut table = Table::after_looks(1);
    table.settings = table.settings.counting(Counted::Unseen);
    let ids: Vec<ViewId> = table.views.views.iter().map(|view| view.id).collect();
    let field = GainField::new(&table.belief);
    let mut seen = VoxelSet::empty(&table.belief.grid);
    (0..table.belief.grid.voxel_count()).step_by(2).for_each(|voxel| seen.insert(voxel));
    let field = field.with_seen(&seen);
    let coverage = Coverage::new(&field, &table.views, &ids, RayDensity::FULL);
    table.seen = seen;
    let decision = table.decide(PolicyKind::MemNoPush);
    assert_eq!(decision.gains, coverage.gains());
    let offered = |view: &ViewId| !table.history.used_views.contains(view);
    let pair = coverage.best_pair(&decision.gains, offered).expect("a pair");
    assert_eq!(decision.action, Action::Look { view: pair.first });
    assert_eq!(decision.pair, [pair.first, pair.second.expect("a second view")]);
    // What a view's gain comes from is counted alike.
    let gain = Gain::new(Counted::Unseen, &table.belief, &table.seen);
    let sources = gain.per_voxel(&table.views, pair.first, RayDensity::FULL);
    let sum: f64 = sources.iter().map(|(_, nats)| f64::from(*nats)).sum();
    assert!((sum / f64::from(pair.first_gain) - 1.0).abs() < 1e-4, "{sum} {}", pair.first_gain);
}

#[test]
fn where_unseen_voxels_count_a_push_is_worth_what_it_opens() {
    // The boxes leave; what stood behind them is as unknown as before.
    struct Clears;
    impl BeliefUpdate for Clears {
        fn name(&self) -> &str {
            "clears"
        }

        fn observe(&self, belief: &Belief, _: &MapObservation) -> Belief {
            belief.clone()
        }

        fn predict(&self, belief: &Belief, pushes: &[Intervention]) -> Vec<Prediction> {
            let cleared = |a: &[f32; 2]| if a[0] > a[1] { [1.0, 100.0] } else { *a };
            let prediction = Prediction {
                window: Window::whole(&belief.grid),
                occupancy: belief.occupancy.iter().map(cleared).collect(),
                semantics: belief.semantics.clone(),
                change: vec![1.0; belief.grid.cell_count()],
            };
            vec![prediction; pushes.len()]
        }
    }
    let mut table = Table::after_looks(6);
    table.update = Box::new(Clears);
    table.settings = table.settings.counting(Counted::Unseen);
    table.seen.insert(0);
    let field = GainField::new(&table.belief).with_seen(&table.seen);
    let ids: Vec<ViewId> = (0..12).map(ViewId).collect();
    let decision = table.decide(PolicyKind::Mem);
    let gapless = RayDensity::gapless(&table.belief.grid, &table.views);
    assert_eq!(decision.igv, gain_together(&field, &table.views, &decision.pair, gapless));
    let prediction = Clears.predict(&table.belief, &[swept(&table.belief)]).remove(0);
    let opened =
        Openings::new(&field, &table.views, &ids, RayDensity::COARSE).under_each(std::slice::from_ref(&prediction))[0];
    let gain = Gain::new(Counted::Unseen, &table.belief, &table.seen);
    let sources = gain.push_sources(&table.views, &ids, &prediction, None).expect("it opens something");
    assert_eq!(sources.words, "what it opens to all views together");
    let sum: f32 = sources.nats.iter().map(|(_, nats)| nats).sum();
    assert!((sum - opened).abs() < 1e-3 * opened, "what the push opens is told by voxel: {sum}, {opened}");
    assert!(opened > 1.0 && decision.igm == opened, "{opened} {}", decision.igm);
    let best = &decision.candidates[decision.best_push.expect("a push")];
    assert!(best.gain == Some(opened) && best.view.is_some());

    // It pushes once looking has less to tell than the push, by far.
    assert_eq!(decision.reason, Reason::LookTellsMore);
    table.settings.patience = 0.9 * decision.igm / decision.igv;
    table.settings.push_floor = 0.0;
    let decision = table.decide(PolicyKind::Mem);
    assert_eq!((decision.reason, decision.action), (Reason::PushTellsMore, Action::Manipulate(best.manipulation)));

    // What a push only blurs is worth nothing.
    (0..table.belief.grid.voxel_count()).for_each(|voxel| table.seen.insert(voxel));
    table.update = Box::new(Prophet::Forgets);
    assert_eq!(table.decide(PolicyKind::Mem).igm, 0.0);
}

#[test]
fn where_all_voxels_count_what_was_seen_makes_no_difference() {
    let mut table = Table::after_looks(6);
    let before = table.decide(PolicyKind::Mem);
    (0..table.belief.grid.voxel_count()).for_each(|voxel| table.seen.insert(voxel));
    assert_eq!(table.decide(PolicyKind::Mem), before);
    table.settings = table.settings.counting(Counted::Unseen);
    assert!(table.decide(PolicyKind::Mem).gains.iter().all(|gain| *gain == 0.0));
}

#[test]
fn the_push_that_the_planner_holds_to_be_best_stands_on_top_by_whatever_it_is_best() {
    for (policy, counted) in [
        (PolicyKind::Mem, Counted::All),
        (PolicyKind::Mem, Counted::Unseen),
        (PolicyKind::ClairvoyantPush, Counted::All),
        (PolicyKind::RandomPush5, Counted::All),
    ] {
        let mut table = Table::after_looks(if policy == PolicyKind::RandomPush5 { 4 } else { 6 });
        table.settings = table.settings.counting(counted);
        table.update = Box::new(Prophet::Forgets);
        table.really = vec![[0, 0, 1], [0, 0, 2], [1, 0, 3]];
        let decision = table.decide(policy);
        let order = decision.ranked_candidates();
        assert_eq!(order.first().copied(), decision.best_push, "{policy}, {counted}");
        assert_eq!(order.len(), decision.candidates.len());
        let best = |at: &usize| decision.candidates[*at].rejection.is_some();
        assert!(order.is_sorted_by_key(best), "rejected ones come last");
        let rule = Rule { policy, settings: table.settings };
        assert_eq!((decision.rule, decision.comparison().reason), (Some(rule), decision.reason));
    }
}

#[test]
fn mem_looks_where_a_push_would_tell_nothing() {
    let mut table = Table::after_looks(6);
    table.update = Box::new(Prophet::Knows);
    let decision = table.decide(PolicyKind::Mem);
    assert_eq!(decision.reason, Reason::LookTellsMore);
    assert_eq!(decision.action, Action::Look { view: decision.pair[0] });
    assert!(decision.igm < decision.igv && decision.best_push.is_some(), "what was weighed is kept");
    assert_eq!(decision.candidates.iter().filter(|c| c.gain.is_some()).count(), 6);
    assert!(decision.candidates.iter().all(|c| c.gain.is_some() != c.rejection.is_some()));
}

#[test]
fn disturbance_counts_blurred_labels_and_never_rewards() {
    let mut table = Table::after_looks(6);
    table.update = Box::new(Prophet::Forgets);
    let decision = table.decide(PolicyKind::Mem);
    let blank = Belief::uniform(table.belief.grid);
    let reg = (table.belief.semantic_entropy() - blank.semantic_entropy()) as f32;
    assert!(reg < -1.0 && (decision.reg - reg).abs() < 1e-2, "{reg} {}", decision.reg);
    // With enough weight it turns the decision.
    table.settings.gamma = 1.1 * (decision.igm - decision.igv) / -decision.reg;
    assert_eq!(table.decide(PolicyKind::Mem).reason, Reason::LookTellsMore);

    // So does a floor, and patience.
    table.settings = PlannerSettings { push_floor: 1.1 * decision.igm, ..PlannerSettings::default() };
    assert_eq!(table.decide(PolicyKind::Mem).reason, Reason::PushTellsLittle);
    table.settings = PlannerSettings { patience: 1.1 * decision.igm / decision.igv, ..PlannerSettings::default() };
    assert_eq!(table.decide(PolicyKind::Mem).reason, Reason::LookTellsMore);

    let mut sharper = Prophet::Forgets.predict(&table.belief, &[swept(&table.belief)]).remove(0);
    sharper.semantics.iter_mut().for_each(|a| a[14] += 100.0);
    assert_eq!(disturbance(&table.belief, &sharper), 0.0);
}

fn swept(belief: &Belief) -> Intervention {
    let grid = half_seen().grid;
    let mut swept = VoxelSet::empty(&grid);
    (0..grid.voxel_count()).step_by(97).for_each(|index| swept.insert(index));
    SweptPush { push: push(), swept }.intervention(belief, &FloorPlan::new(belief, SOLID))
}

#[test]
fn mem_looks_when_no_push_is_feasible() {
    let mut table = Table::after_looks(6);
    table.belief = Belief::uniform(table.belief.grid);
    let decision = table.decide(PolicyKind::Mem);
    assert_eq!(decision.reason, Reason::NoCandidate);
    assert!(!is_push(&decision) && decision.best_push.is_none());
}

#[test]
fn a_map_that_has_nothing_left_to_tell_is_still_looked_at() {
    let mut table = Table::new();
    table.belief.occupancy.fill(evidence(-3.5, 40.0));
    table.history.used_views = vec![ViewId(0), ViewId(1)];
    let decision = table.decide(PolicyKind::Mem);
    assert_eq!(decision.action, Action::Look { view: ViewId(2) });
    assert_eq!((decision.igv, decision.pair.len()), (0.0, 0));
    table.history.used_views = (0..12).map(ViewId).collect();
    assert_eq!(table.decide(PolicyKind::Mem).action, Action::Look { view: ViewId(0) });
    assert!(matches!(table.decide(PolicyKind::Random).action, Action::Look { .. }));
}

#[test]
fn decisions_do_not_depend_on_the_number_of_threads() {
    let on = |threads: usize, policy: PolicyKind| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let table = Table::after_looks(4);
        pool.install(|| table.decide(policy))
    };
    for policy in PolicyKind::ALL {
        assert_eq!(on(1, policy), on(3, policy), "{policy}");
    }
}
