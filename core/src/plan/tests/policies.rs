//! The policies beside `mem`.

use super::*;

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
    table.history.record(&first, false, None);
    assert_eq!(table.decide(PolicyKind::Oracle).action, Action::Look { view: ViewId(11) });
}
