//! Decisions on a small shelf: 1 cm voxels, a dozen views, a few boxes.

use super::*;
use crate::belief::{Classical, PushPrediction, SweptPush, evidence};
use crate::camera::{Intrinsics, MapObservation, View};
use crate::gain::{Coverage, GainField, Openings, RayDensity, gain_of_views, gain_together};
use crate::grid::{Grid, VoxelSet, Window};
use crate::scene::{CLASS_COUNT, Shelf};
use crate::{Point, Pose, Vector};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

mod clairvoyant;

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

    fn predict_pushes(&self, belief: &Belief, pushes: &[SweptPush]) -> Vec<PushPrediction> {
        let grid = &belief.grid;
        let voxel = match self {
            Self::Forgets => [1.0, 1.0],
            Self::Knows => [1.0, 1000.0],
        };
        let prediction = PushPrediction {
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
    seen: Option<VoxelSet>,
    history: History,
    settings: PlannerSettings,
    seed: u64,
    /// What pushes really do, in the order of the feasible ones: numbers of objects won and lost, voxels opened. Nothing
    /// for those that are not told.
    really: Vec<[usize; 3]>,
}

impl Table {
    fn new() -> Self {
        Self {
            belief: half_seen(),
            update: Box::new(Classical),
            views: views(),
            arm: ArmTool::standard(Shelf::new([0.80, 0.40, 0.40])),
            seen: None,
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
        let really_push = |motions: &[PushMotion]| {
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
            seen: self.seen.as_ref(),
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
        }
    }

    /// Decides and takes down `count` steps in which the belief stays as it is.
    fn run(&mut self, policy: PolicyKind, count: usize) -> Vec<Decision> {
        (0..count)
            .map(|_| {
                let decision = self.decide(policy);
                self.history.record(&decision, false);
                decision
            })
            .collect()
    }
}

fn is_push(decision: &Decision) -> bool {
    matches!(decision.action, Action::Push(_))
}

/// Numbers, from 1, of the steps that push.
fn pushes_at(decisions: &[Decision]) -> Vec<usize> {
    decisions.iter().enumerate().filter(|(_, d)| is_push(d)).map(|(at, _)| at + 1).collect()
}

fn push() -> Push {
    Push { start: [-0.15, 0.13, 0.06], direction_deg: 90.0, length_m: 0.1 }
}

#[test]
fn mem_looks_from_the_best_view_and_reports_all_gains() {
    let mut table = Table::new();
    let first = table.decide(PolicyKind::Mem);
    let ids: Vec<ViewId> = table.views.views.iter().map(|view| view.id).collect();
    let gains = gain_of_views(&GainField::new(&table.belief), &table.views, &ids, RayDensity::FULL);
    assert_eq!(first.gains, gains);
    let best = (0..12).max_by(|&a, &b| gains[a].total_cmp(&gains[b])).expect("views");
    assert_eq!(first.action, Action::Look { view: ViewId(best as u16) });
    assert_eq!(first.pair[0], ViewId(best as u16));
    assert_eq!(first.best_gain(), Some(gains[best]));
    assert!(first.igv > gains[best] && first.pair.len() == 2);

    // Used up, it is still reported, but not chosen.
    table.history.record(&first, false);
    let second = table.decide(PolicyKind::Mem);
    assert_eq!(second.gains, first.gains);
    assert!(!second.pair.contains(&ViewId(best as u16)));
    assert_ne!(second.action, first.action);
}

#[test]
fn mem_weighs_no_push_where_none_is_allowed() {
    let check = |table: &Table, reason: Reason| {
        let decision = table.decide(PolicyKind::Mem);
        assert_eq!(decision.reason, reason);
        assert!(!is_push(&decision) && decision.candidates.is_empty() && decision.best_push.is_none());
        assert_eq!((decision.igm, decision.reg), (0.0, 0.0));
    };
    for step in 0..3 {
        check(&Table::after_looks(step), Reason::TooEarly);
    }
    check(&Table::after_looks(BUDGET - 1), Reason::LastStep);
    let mut dropped = Table::after_looks(6);
    dropped.history.dropped = true;
    check(&dropped, Reason::Dropped);
    let mut complete = Table::after_looks(6);
    complete.belief.semantics.iter_mut().for_each(|a| a[14] += 200.0);
    check(&complete, Reason::MapComplete);
    let mut pushed = Table::after_looks(6);
    pushed.history.actions.push(Action::Push(push()));
    check(&pushed, Reason::JustPushed);
}

#[test]
fn after_a_push_mem_takes_the_view_that_made_it_worth_it() {
    let mut table = Table::after_looks(6);
    table.update = Box::new(Prophet::Forgets);
    let decision = table.decide(PolicyKind::Mem);
    assert_eq!(decision.reason, Reason::PushTellsMore);
    assert!(is_push(&decision) && decision.igm > decision.igv);
    let best = &decision.candidates[decision.best_push.expect("a best push")];
    assert_eq!(decision.action, Action::Push(best.push));
    assert_eq!((best.gain, best.reg), (Some(decision.igm), Some(decision.reg)));

    // The winner is scored in full: all views, all rays.
    let blank = Belief::uniform(table.belief.grid);
    let ids: Vec<ViewId> = table.views.views.iter().map(|view| view.id).collect();
    let gains = gain_of_views(&GainField::new(&blank), &table.views, &ids, RayDensity::FULL);
    let worth = best.view.expect("a view");
    assert_eq!(decision.igm, gains[usize::from(worth.0)]);
    assert!(gains.iter().all(|gain| *gain <= decision.igm));
    // The others compare: same prediction, coarse rays, scaled.
    for other in decision.candidates.iter().filter_map(|candidate| candidate.gain) {
        assert!((other / decision.igm - 1.0).abs() < 0.1, "{other} {}", decision.igm);
    }

    table.history.used_views = vec![worth];
    table.history.record(&decision, false);
    assert!(table.history.used_views.is_empty(), "a push clears the used views");
    let next = table.decide(PolicyKind::Mem);
    assert_eq!((next.action, next.reason), (Action::Look { view: worth }, Reason::ViewOfPush));
    assert!(next.candidates.is_empty());
    // Where unseen voxels count, it looks where most is to be gained now: the push may have done something else.
    let settings = table.settings;
    table.settings = settings.counting(Counted::Unseen);
    assert_eq!(table.decide(PolicyKind::Mem).reason, Reason::JustPushed);
    table.settings = settings;
    table.history.record(&next, false);
    assert_eq!(table.history.view_of_push, None);
    assert_ne!(table.decide(PolicyKind::Mem).reason, Reason::ViewOfPush);
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
    table.seen = Some(VoxelSet::empty(&table.belief.grid));
    assert!((best_height(&table) - highest).abs() < 1e-6);

    // It is worth it for what it sees past the front: with p = 0.5 everywhere nothing of the back half would be reached.
    let nothing = VoxelSet::empty(&table.belief.grid);
    let view = table.decide(PolicyKind::MemNoPush).pair[0];
    let share_of_back = |field: &GainField| {
        let grid = &table.belief.grid;
        let sources = gain_sources(field, &table.views, view, RayDensity::FULL);
        let behind = |voxel: usize| 2 * usize::from(grid.voxel(voxel).y) >= grid.dims[1];
        let sum = |of: &dyn Fn(usize) -> bool| -> f32 { sources.iter().filter(|s| of(s.0)).map(|s| s.1).sum() };
        sum(&behind) / sum(&|_| true)
    };
    let (standing, flat) = (gain_field(&table.belief, Some(&nothing)), GainField::new(&table.belief));
    assert!(share_of_back(&standing) > 0.05, "{}", share_of_back(&standing));
    assert!(share_of_back(&flat.with_seen(&nothing)) < 0.01);
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
    table.seen = Some(seen);
    let decision = table.decide(PolicyKind::MemNoPush);
    assert_eq!(decision.gains, coverage.gains());
    let offered = |view: &ViewId| !table.history.used_views.contains(view);
    let pair = coverage.best_pair(&decision.gains, offered).expect("a pair");
    assert_eq!(decision.action, Action::Look { view: pair.first });
    assert_eq!(decision.pair, [pair.first, pair.second.expect("a second view")]);
    // What a view's gain comes from is counted alike.
    let sources = gain_sources(&field, &table.views, pair.first, RayDensity::FULL);
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

        fn predict_pushes(&self, belief: &Belief, pushes: &[SweptPush]) -> Vec<PushPrediction> {
            let cleared = |a: &[f32; 2]| if a[0] > a[1] { [1.0, 100.0] } else { *a };
            let prediction = PushPrediction {
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
    let field = GainField::new(&table.belief);
    let ids: Vec<ViewId> = (0..12).map(ViewId).collect();
    let decision = table.decide(PolicyKind::Mem);
    let gapless = RayDensity::gapless(&table.belief.grid, &table.views);
    assert_eq!(decision.igv, gain_together(&field, &table.views, &decision.pair, gapless));
    let prediction = Clears.predict_pushes(&table.belief, &[swept()]).remove(0);
    let opened =
        Openings::new(&field, &table.views, &ids, RayDensity::COARSE).under_each(std::slice::from_ref(&prediction))[0];
    let sources = push_sources(Counted::Unseen, &field, &table.views, &ids, &prediction, None);
    let sum: f32 = sources.iter().map(|(_, nats)| nats).sum();
    assert!((sum - opened).abs() < 1e-3 * opened, "what the push opens is told by voxel: {sum}, {opened}");
    assert!(opened > 1.0 && decision.igm == opened, "{opened} {}", decision.igm);
    let best = &decision.candidates[decision.best_push.expect("a push")];
    assert!(best.gain == Some(opened) && best.view.is_some());

    // It pushes once looking has less to tell than the push, by far.
    assert_eq!(decision.reason, Reason::LookTellsMore);
    table.settings.patience = 0.9 * decision.igm / decision.igv;
    table.settings.push_floor = 0.0;
    let decision = table.decide(PolicyKind::Mem);
    assert_eq!((decision.reason, decision.action), (Reason::PushTellsMore, Action::Push(best.push)));

    // What a push only blurs is worth nothing.
    table.seen =
        Some((0..table.belief.grid.voxel_count()).fold(VoxelSet::empty(&table.belief.grid), |mut all, voxel| {
            all.insert(voxel);
            all
        }));
    table.update = Box::new(Prophet::Forgets);
    assert_eq!(table.decide(PolicyKind::Mem).igm, 0.0);
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

    let mut sharper = Prophet::Forgets.predict_pushes(&table.belief, &[swept()]).remove(0);
    sharper.semantics.iter_mut().for_each(|a| a[14] += 100.0);
    assert_eq!(disturbance(&table.belief, &sharper), 0.0);
}

fn swept() -> SweptPush {
    let grid = half_seen().grid;
    let mut swept = VoxelSet::empty(&grid);
    (0..grid.voxel_count()).step_by(97).for_each(|index| swept.insert(index));
    SweptPush { push: push(), swept }
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
fn a_policy_that_never_pushes_never_does() {
    for policy in [PolicyKind::MemNoPush, PolicyKind::Random, PolicyKind::RandomCnabu] {
        let mut table = Table::new();
        table.update = Box::new(Prophet::Forgets);
        let decisions = table.run(policy, 11);
        assert!(decisions.iter().all(|d| !is_push(d) && d.reason == Reason::Schedule && d.candidates.is_empty()));
        let mut seen = table.history.used_views.clone();
        seen.sort();
        seen.dedup();
        assert_eq!(seen.len(), 11, "{policy}: no view twice");
    }
}

#[test]
fn random_views_follow_the_seed() {
    let run = |policy, seed| {
        let mut table = Table { seed, ..Table::new() };
        table.run(policy, 8);
        table.history.used_views
    };
    assert_eq!(run(PolicyKind::Random, 1), run(PolicyKind::Random, 1));
    assert_eq!(run(PolicyKind::Random, 1), run(PolicyKind::RandomCnabu, 1), "they differ in the belief alone");
    assert_ne!(run(PolicyKind::Random, 1), run(PolicyKind::Random, 2));
    assert_ne!(run(PolicyKind::Random, 1), run(PolicyKind::MemNoPush, 1));
}

#[test]
fn scheduled_policies_push_every_fifth_step_but_not_in_the_last() {
    for policy in [PolicyKind::RandomPush5, PolicyKind::RandomPush5Blind, PolicyKind::RandomViewPush5] {
        let mut table = Table::new();
        let decisions = table.run(policy, BUDGET);
        assert_eq!(pushes_at(&decisions), [5, 10, 15], "{policy}");
        assert_eq!(decisions[BUDGET - 1].reason, Reason::LastStep);
        assert!(decisions[..BUDGET - 1].iter().all(|d| d.reason == Reason::Schedule));
        let pushed = &decisions[4];
        let chosen = &pushed.candidates[pushed.best_push.expect("the push")];
        assert_eq!((chosen.rejection.as_ref(), chosen.gain, pushed.igm), (None, None, 0.0));
        let by_gain = decisions[5].action == Action::Look { view: decisions[5].pair[0] };
        assert!(by_gain || policy == PolicyKind::RandomViewPush5, "{policy}");
    }
    let mut dropped = Table::after_looks(4);
    dropped.history.dropped = true;
    assert_eq!(dropped.decide(PolicyKind::RandomPush5).reason, Reason::Dropped);
    let mut bare = Table::after_looks(4);
    bare.belief = Belief::uniform(bare.belief.grid);
    assert_eq!(bare.decide(PolicyKind::RandomPush5).reason, Reason::NoCandidate);
}

#[test]
fn saturation_pushes_when_two_gains_in_a_row_are_alike() {
    let mut table = Table::after_looks(6);
    let gain = table.decide(PolicyKind::Saturation).best_gain().expect("a gain");
    let mut with = |previous: f32, steps: usize| {
        table.history.actions = vec![Action::Look { view: ViewId(0) }; steps];
        table.history.best_gains = vec![1e9, previous];
        let decision = table.decide(PolicyKind::Saturation);
        (is_push(&decision), decision.reason)
    };
    assert_eq!(with(gain * 1.01, 6), (true, Reason::Schedule));
    assert_eq!(with(gain * 1.05, 6), (false, Reason::Schedule));
    assert_eq!(with(gain * 1.01, 2), (false, Reason::TooEarly));
    assert_eq!(with(gain * 1.01, BUDGET - 1), (false, Reason::LastStep));
    assert!(!is_push(&Table::after_looks(6).decide(PolicyKind::Saturation)), "no gain to compare with");
}

#[test]
fn the_oracle_takes_the_view_that_really_tells_most() {
    let mut table = Table::new();
    let first = table.decide(PolicyKind::Oracle);
    assert_eq!((first.action, first.reason), (Action::Look { view: ViewId(9) }, Reason::Schedule));
    table.history.record(&first, false);
    assert_eq!(table.decide(PolicyKind::Oracle).action, Action::Look { view: ViewId(11) });
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

#[test]
fn a_history_takes_down_what_was_done() {
    let table = Table::new();
    let look = table.decide(PolicyKind::MemNoPush);
    let mut history = History::default();
    history.record(&look, false);
    assert_eq!((history.actions.len(), history.used_views.len()), (1, 1));
    assert_eq!(history.best_gains, [look.best_gain().expect("a gain")]);

    let candidate = CandidateRecord { gain: Some(1.0), view: Some(ViewId(3)), ..CandidateRecord::of(push()) };
    let pushed =
        Decision { action: Action::Push(push()), candidates: vec![candidate], best_push: Some(0), ..look.clone() };
    history.record(&pushed, false);
    assert!(history.just_pushed() && history.used_views.is_empty());
    assert_eq!((history.view_of_push, history.best_gains.len()), (Some(ViewId(3)), 1));
    // A push by hand is not the one that was weighed; after a drop there is nothing to look at.
    let by_hand = Push { length_m: 0.07, ..push() };
    history.record(&Decision { action: Action::Push(by_hand), ..pushed.clone() }, false);
    assert_eq!((history.view_of_push, history.dropped), (None, false));
    history.record(&pushed, true);
    assert_eq!((history.view_of_push, history.dropped), (None, true));
    history.record(&look, false);
    assert!(history.dropped, "a drop is for ever");
}

#[test]
fn a_decision_survives_its_file() {
    let mut table = Table::after_looks(6);
    table.update = Box::new(Prophet::Forgets);
    let decision = table.decide(PolicyKind::Mem);
    let json = serde_json::to_value(&decision).expect("json");
    assert_eq!(json["action"]["kind"], "push");
    assert!(json["action"]["start"].is_array() && json["action"]["length_m"].is_number());
    assert_eq!(json["reason"], "push_tells_more");
    assert_eq!(serde_json::from_value::<Decision>(json).expect("back"), decision);
}
