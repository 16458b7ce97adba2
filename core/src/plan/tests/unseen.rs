//! Decisions where only what no look has seen counts.

use super::*;

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
