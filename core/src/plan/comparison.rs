//! What a decision compared: looking with the best push, in nats, by which thresholds, what won and why.
//!
//! The terms of `max(patience IGV, floor) > IGM + gamma Reg` ([`look_or_push`](super::look_or_push)), and the order of the
//! push candidates. Whoever shows a decision prints these; nobody compares again.

use super::{Action, CandidateRecord, Counted, Decision, PlannerSettings, PolicyKind, Reason};
use serde::{Deserialize, Serialize};

/// Whose rule a decision follows, and the thresholds in it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// The policy.
    pub policy: PolicyKind,
    /// Its thresholds.
    pub settings: PlannerSettings,
}

impl Default for Rule {
    /// The paper's.
    fn default() -> Self {
        Self { policy: PolicyKind::Mem, settings: PlannerSettings::default() }
    }
}

impl Rule {
    /// What `IGM + gamma Reg` of a push has to reach where looking promises `igv`, nats.
    fn needed(&self, igv: f32) -> f32 {
        (self.settings.patience * igv).max(self.settings.push_floor)
    }

    /// What IGM counts, as the end of a sentence.
    fn of_pushes(&self) -> &'static str {
        match self.policy {
            PolicyKind::ClairvoyantPush => "what is unknown of the space that the best push really opens",
            _ => self.settings.counted.of_pushes(),
        }
    }
}

/// Which term of the rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TermKind {
    /// IGV, what looking gains.
    Look,
    /// `max(patience IGV, floor)`, what a push has to reach, where that is not IGV itself.
    Threshold,
    /// IGM, what the best push is worth.
    Push,
    /// `gamma Reg`, what the best push makes uncertain.
    Disturbance,
}

/// A term of the rule.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// Which.
    pub kind: TermKind,
    /// Its value, nats.
    pub nats: f32,
    /// What it counts, as the end of a sentence.
    pub words: String,
    /// Whether it is on the side that won by the rule.
    pub decides: bool,
}

/// What won.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Winner {
    /// Looking.
    Look,
    /// Pushing.
    Push,
}

/// What a decision compared, by what, what won and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The terms, in the order of [`TermKind`]; only the first where no push was compared.
    pub terms: Vec<Term>,
    /// What `IGM + gamma Reg` had to reach, nats.
    pub needed: f32,
    /// `IGM + gamma Reg` of the best push, nats; `None` where no push was compared.
    pub pushing: Option<f32>,
    /// What was chosen.
    pub winner: Winner,
    /// Whether the rule chose it, and not a guard, a schedule or a person.
    pub by_rule: bool,
    /// Why, in one of the planner's own cases.
    pub reason: Reason,
    /// Why, as the end of a sentence, with the thresholds that led to it.
    pub because: String,
}

impl Comparison {
    /// A term, if it was compared.
    pub fn term(&self, kind: TermKind) -> Option<&Term> {
        self.terms.iter().find(|term| term.kind == kind)
    }

    /// What was needed less what the best push is worth, nats: the rule looks above 0, else it pushes.
    pub fn margin(&self) -> Option<f32> {
        self.pushing.map(|pushing| self.needed - pushing)
    }
}

/// What `gamma Reg` is, with the formula.
pub const DISTURBANCE: &str = "What the push makes uncertain of the classes, nats, at most 0: γ times Reg = min(0, H(classes now) − H(classes \
     predicted)), H the entropy of the semantic map";

impl Decision {
    /// Whose rule it follows: the paper's where none was taken down.
    pub fn ruled_by(&self) -> Rule {
        self.rule.unwrap_or_default()
    }

    /// What counts as a gain.
    pub fn counted(&self) -> Counted {
        self.ruled_by().settings.counted
    }

    /// What was compared, by what, what won and why.
    pub fn comparison(&self) -> Comparison {
        let rule = self.ruled_by();
        let winner = match self.action {
            Action::Look { .. } => Winner::Look,
            Action::Manipulate(_) => Winner::Push,
        };
        let by_rule = matches!(self.reason, Reason::LookTellsMore | Reason::PushTellsLittle | Reason::PushTellsMore);
        let mut terms = Vec::new();
        let mut term = |kind: TermKind, nats: f32, words: String| {
            let side = match kind {
                TermKind::Look | TermKind::Threshold => Some(Winner::Look),
                TermKind::Push => Some(Winner::Push),
                TermKind::Disturbance => None,
            };
            terms.push(Term { kind, nats, words, decides: by_rule && side == Some(winner) });
        };
        let needed = rule.needed(self.igv);
        let pushing = self.compares_a_push().then_some(self.igm + rule.settings.gamma * self.reg);
        term(TermKind::Look, self.igv, rule.settings.counted.of_looks().to_owned());
        if pushing.is_some() {
            if needed != self.igv {
                term(TermKind::Threshold, needed, self.of_threshold(needed));
            }
            term(TermKind::Push, self.igm, rule.of_pushes().to_owned());
            let words = "what it makes uncertain of the classes, at most 0".to_owned();
            term(TermKind::Disturbance, rule.settings.gamma * self.reg, words);
        }
        Comparison { terms, needed, pushing, winner, by_rule, reason: self.reason, because: self.because() }
    }

    /// Whether the best push was weighed, and not drawn at random.
    fn compares_a_push(&self) -> bool {
        self.best_candidate().is_some_and(|at| self.candidates[at].gain.is_some())
    }

    /// What a push has to reach, as the end of a sentence.
    fn of_threshold(&self, needed: f32) -> String {
        let PlannerSettings { patience, push_floor, .. } = self.ruled_by().settings;
        if needed > patience * self.igv {
            format!("a push has to be worth {push_floor} nats at least, whatever looking gains")
        } else {
            format!("a push has to be worth {patience} times what looking gains (patience)")
        }
    }

    /// What a candidate is worth, nats: `gain + gamma Reg`; `None` if it was rejected or not weighed.
    pub fn value_of(&self, candidate: &CandidateRecord) -> Option<f32> {
        let value = candidate.gain? + self.disturbance_of(candidate).unwrap_or(0.0);
        value.is_finite().then_some(value)
    }

    /// What a candidate makes uncertain, nats: `gamma Reg`; `None` if it was rejected or not weighed.
    pub fn disturbance_of(&self, candidate: &CandidateRecord) -> Option<f32> {
        candidate.reg.map(|reg| self.ruled_by().settings.gamma * reg)
    }

    /// What the action promised, nats: the gain of its view, the worth of its push; `None` where that was not weighed.
    pub fn promised(&self) -> Option<f32> {
        match self.action {
            Action::Look { view } => self.gains.get(usize::from(view.0)).copied(),
            Action::Manipulate(_) if self.pushed() == self.best_candidate() => {
                self.compares_a_push().then_some(self.igm)
            }
            Action::Manipulate(_) => self.pushed().and_then(|at| self.candidates[at].gain),
        }
    }

    /// Position in `candidates` of the push that is the action.
    pub fn pushed(&self) -> Option<usize> {
        match self.action {
            Action::Look { .. } => None,
            Action::Manipulate(done) => self.candidates.iter().position(|candidate| candidate.manipulation == done),
        }
    }

    /// Position of the best push, if there is one.
    fn best_candidate(&self) -> Option<usize> {
        self.best_push.filter(|at| *at < self.candidates.len())
    }

    /// Positions of the candidates as the planner ranks them: the best push, then the others by falling gain and of equals
    /// in the order drawn, then those that were not weighed, then the rejected ones.
    ///
    /// Where all voxels count the gains of the others are coarse, and of a clairvoyant policy they are promises: one of
    /// them may be larger than that of the best.
    pub fn ranked_candidates(&self) -> Vec<usize> {
        let mut order = ranked(self.best_candidate(), self.candidates.iter().map(|candidate| candidate.gain));
        let is_rejected = |at: usize| self.candidates[at].rejection.is_some() && self.best_push != Some(at);
        order.sort_by_key(|at| is_rejected(*at));
        order
    }
}

/// Positions of pushes as the planner ranks them by their gains: the best one, then the others by falling gain and of equals
/// in their order, then those without a gain.
pub fn ranked(best: Option<usize>, gains: impl Iterator<Item = Option<f32>>) -> Vec<usize> {
    let of = |gain: Option<f32>| gain.filter(|gain| !gain.is_nan()).unwrap_or(f32::NEG_INFINITY);
    let mut order: Vec<(usize, f32)> = gains.map(of).enumerate().collect();
    order.sort_by(|a, b| (best == Some(b.0)).cmp(&(best == Some(a.0))).then(b.1.total_cmp(&a.1)).then(a.0.cmp(&b.0)));
    order.into_iter().map(|(at, _)| at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skill::{Push, Rejection};

    fn push(length_m: f32) -> Push {
        Push { start: [0.0, 0.1, 0.06], direction_deg: 90.0, length_m }
    }

    /// Pushes of 1 cm, 2 cm ... that promise so much.
    fn candidates(gains: &[f32]) -> Vec<CandidateRecord> {
        let of = |(at, gain): (usize, &f32)| CandidateRecord {
            gain: Some(*gain),
            reg: Some(-50.0),
            ..CandidateRecord::of(push(0.01 * (at + 1) as f32))
        };
        gains.iter().enumerate().map(of).collect()
    }

    /// IGV 300, IGM 400, Reg -50: decided by some thresholds.
    fn weighed(patience: f32, push_floor: f32, reason: Reason) -> Decision {
        let settings = PlannerSettings { patience, push_floor, ..PlannerSettings::default() };
        let action = match reason {
            Reason::PushTellsMore => Action::Manipulate(push(0.01).into()),
            _ => Action::Look { view: crate::camera::ViewId(0) },
        };
        Decision {
            igv: 300.0,
            igm: 400.0,
            reg: -50.0,
            candidates: candidates(&[400.0]),
            best_push: Some(0),
            rule: Some(Rule { policy: PolicyKind::Mem, settings }),
            ..Decision::unweighed(action, reason)
        }
    }

    #[test]
    fn what_looking_gains_is_not_told_as_a_multiple_of_it() {
        let terms = |patience, push_floor, reason| -> Vec<(TermKind, f32)> {
            let comparison = weighed(patience, push_floor, reason).comparison();
            assert_eq!(comparison.margin(), Some(comparison.needed - 390.0));
            comparison.terms.iter().map(|term| (term.kind, term.nats)).collect()
        };
        let look = (TermKind::Look, 300.0);
        let push = [(TermKind::Push, 400.0), (TermKind::Disturbance, -10.0)];
        let paper = terms(1.0, 0.0, Reason::PushTellsMore);
        assert_eq!(paper, [look, push[0], push[1]], "the rule of the paper compares IGV itself");
        for (patience, floor, needed) in [(10.0, 2000.0, 3000.0), (1.0, 2000.0, 2000.0)] {
            let threshold = (TermKind::Threshold, needed);
            assert_eq!(terms(patience, floor, Reason::PushTellsLittle), [look, threshold, push[0], push[1]]);
        }
        let words = |patience, floor| {
            let comparison = weighed(patience, floor, Reason::PushTellsLittle).comparison();
            comparison.term(TermKind::Threshold).expect("a threshold").words.clone()
        };
        assert!(words(10.0, 5000.0).contains("5000 nats at least"), "{}", words(10.0, 5000.0));
        assert!(words(10.0, 2000.0).contains("10 times what looking gains"), "{}", words(10.0, 2000.0));
    }

    #[test]
    fn the_side_that_won_by_the_rule_is_marked_and_no_other() {
        let marked = |decision: &Decision| -> Vec<TermKind> {
            decision.comparison().terms.iter().filter(|term| term.decides).map(|term| term.kind).collect()
        };
        assert_eq!(marked(&weighed(1.0, 0.0, Reason::PushTellsMore)), [TermKind::Push]);
        assert_eq!(marked(&weighed(10.0, 0.0, Reason::LookTellsMore)), [TermKind::Look, TermKind::Threshold]);
        let by_hand = weighed(1.0, 0.0, Reason::Manual);
        assert!(marked(&by_hand).is_empty() && by_hand.comparison().winner == Winner::Look);
    }

    #[test]
    fn a_push_drawn_at_random_is_not_compared_and_promises_nothing() {
        let mut decision = weighed(1.0, 0.0, Reason::Schedule);
        decision.action = Action::Manipulate(push(0.01).into());
        assert_eq!(decision.promised(), Some(400.0));
        (decision.candidates[0].gain, decision.candidates[0].reg, decision.igm) = (None, None, 0.0);
        let comparison = decision.comparison();
        assert_eq!((comparison.terms.len(), comparison.pushing, comparison.margin()), (1, None, None));
        assert_eq!((decision.promised(), comparison.winner), (None, Winner::Push));
        decision.best_push = Some(9999);
        assert_eq!((decision.comparison().pushing, decision.ranked_candidates()), (None, vec![0]));
    }

    #[test]
    fn the_best_push_stands_on_top_and_equals_in_the_order_drawn() {
        let mut decision = weighed(1.0, 0.0, Reason::PushTellsMore);
        decision.candidates = candidates(&[100.0, 400.0, f32::NAN, 400.0, 50.0, 400.0]);
        decision.best_push = Some(1);
        assert_eq!(decision.ranked_candidates(), [1, 3, 5, 0, 4, 2]);
        // By the truth another one is best: it stands on top though others promise more.
        decision.best_push = Some(4);
        assert_eq!(decision.ranked_candidates(), [4, 1, 3, 5, 0, 2]);
        // Rejected ones come last, even after those that were not weighed.
        (decision.candidates[0].rejection, decision.candidates[0].gain) = (Some(Rejection::NoWay), None);
        decision.candidates[5].gain = None;
        assert_eq!(decision.ranked_candidates(), [4, 1, 3, 2, 5, 0]);
    }

    #[test]
    fn candidates_are_valued_by_the_decisions_own_gamma() {
        let mut decision = weighed(1.0, 0.0, Reason::PushTellsMore);
        assert_eq!(decision.value_of(&decision.candidates[0]), Some(390.0));
        decision.rule.as_mut().expect("a rule").settings.gamma = 3.0;
        assert_eq!(decision.value_of(&decision.candidates[0]), Some(250.0));
        assert_eq!(decision.disturbance_of(&decision.candidates[0]), Some(-150.0));
        decision.candidates[0].gain = Some(f32::NAN);
        assert_eq!(decision.value_of(&decision.candidates[0]), None);
    }
}
