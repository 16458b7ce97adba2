//! The policy that knows what pushes do, on made-up truths.

use super::*;

#[test]
fn the_clairvoyant_pushes_what_really_wins_objects_and_of_equals_what_opens_most() {
    let mut table = Table::after_looks(6);
    let decide = |table: &Table| table.decide(PolicyKind::ClairvoyantPush);
    let nth_feasible = |decision: &Decision, nth: usize| {
        let feasible = (0..decision.candidates.len()).filter(|at| decision.candidates[*at].rejection.is_none());
        feasible.clone().nth(nth).expect("as many feasible ones")
    };
    // Won minus lost counts first, then the space.
    table.really = vec![[0, 0, 900], [2, 2, 900], [2, 1, 3], [1, 0, 4], [1, 0, 4], [3, 3, 0]];
    let decision = decide(&table);
    let at = nth_feasible(&decision, 3);
    assert_eq!((decision.best_push, decision.reason), (Some(at), Reason::PushReveals));
    assert_eq!(decision.action, Action::Manipulate(decision.candidates[at].manipulation));
    assert!(decision.motion.is_some() && (decision.igm - 4.0 * std::f32::consts::LN_2).abs() < 1e-5);
    assert!(decision.comparison().term(TermKind::Push).is_some_and(|term| term.words.contains("really opens")));
    // What the planner promised of each is kept, and is that of `mem`.
    assert_eq!(
        table.decide(PolicyKind::Mem).candidates.iter().map(|c| c.reg).collect::<Vec<_>>(),
        decision.candidates.iter().map(|c| c.reg).collect::<Vec<_>>()
    );

    // Where nothing is won the rule holds, for the space that is really opened.
    table.really = vec![[0, 0, 3], [0, 0, 500], [0, 1, 9000]];
    let decision = decide(&table);
    assert_eq!(decision.best_push, Some(nth_feasible(&decision, 1)));
    assert!((decision.igm - 500.0 * std::f32::consts::LN_2).abs() < 1e-2, "{}", decision.igm);
    for (patience, reason) in [(1.1, Reason::LookTellsMore), (0.9, Reason::PushTellsMore)] {
        table.settings.patience = patience * decision.igm / decision.igv;
        let decision = decide(&table);
        assert_eq!((decision.reason, is_push(&decision)), (reason, reason == Reason::PushTellsMore));
    }
    // A push that only hides is worth nothing, however much it opens.
    table.really = vec![[0, 1, 9000]; 6];
    let decision = decide(&table);
    assert_eq!((decision.igm, is_push(&decision)), (0.0, false));

    // The guards are those of `mem`.
    let mut early = Table::after_looks(2);
    early.really = vec![[1, 0, 1]; 6];
    assert_eq!(decide(&early).reason, Reason::TooEarly);
    table.really = vec![[1, 0, 1]; 6];
    table.settings = table.settings.counting(Counted::Unseen);
    table.history.actions.extend([Action::Manipulate(push().into()), Action::Look { view: ViewId(0) }]);
    assert_eq!(decide(&table).reason, Reason::JustPushed);
    table.belief = Belief::uniform(table.belief.grid);
    table.history.actions = vec![Action::Look { view: ViewId(0) }; 6];
    assert_eq!(decide(&table).reason, Reason::NoCandidate);
}
