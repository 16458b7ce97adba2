//! What is kept of decisions: the history, and files.

use super::*;

#[test]
fn a_history_takes_down_what_was_done() {
    let table = Table::new();
    let look = table.decide(PolicyKind::MemNoPush);
    let mut history = History::default();
    history.record(&look, false, None);
    assert_eq!((history.actions.len(), history.used_views.len()), (1, 1));
    assert_eq!(history.best_gains, [look.best_gain().expect("a gain")]);

    let candidate = CandidateRecord { gain: Some(1.0), view: Some(ViewId(3)), ..CandidateRecord::of(push()) };
    let pushed = Decision {
        action: Action::Manipulate(push().into()),
        candidates: vec![candidate],
        best_push: Some(0),
        ..look.clone()
    };
    history.record(&pushed, false, None);
    assert!(history.just_pushed() && history.used_views.is_empty());
    assert_eq!((history.view_of_push, history.best_gains.len()), (Some(ViewId(3)), 1));
    // A push by hand is not the one that was weighed; after a drop there is nothing to look at.
    let by_hand = Push { length_m: 0.07, ..push() };
    history.record(&Decision { action: Action::Manipulate(by_hand.into()), ..pushed.clone() }, false, None);
    assert_eq!((history.view_of_push, history.dropped), (None, false));
    history.record(&pushed, true, None);
    assert_eq!((history.view_of_push, history.dropped), (None, true));
    history.record(&look, false, None);
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
