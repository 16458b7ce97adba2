//! What `mem` looks at, and when it weighs no push.

use super::*;

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
    table.history.record(&first, false, None);
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
    pushed.history.actions.push(Action::Manipulate(push().into()));
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
    assert_eq!(decision.action, Action::Manipulate(best.manipulation));
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
    table.history.record(&decision, false, None);
    assert!(table.history.used_views.is_empty(), "a push clears the used views");
    let next = table.decide(PolicyKind::Mem);
    assert_eq!((next.action, next.reason), (Action::Look { view: worth }, Reason::ViewOfPush));
    assert!(next.candidates.is_empty());
    // Where unseen voxels count, it looks where most is to be gained now: the push may have done something else.
    let settings = table.settings;
    table.settings = settings.counting(Counted::Unseen);
    assert_eq!(table.decide(PolicyKind::Mem).reason, Reason::JustPushed);
    table.settings = settings;
    table.history.record(&next, false, None);
    assert_eq!(table.history.view_of_push, None);
    assert_ne!(table.decide(PolicyKind::Mem).reason, Reason::ViewOfPush);
}
