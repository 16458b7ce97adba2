//! From a situation to the next action.

use super::rule::{PUSH_EVERY, closing_steps, look_or_push, push_guard, saturated, still_closing};
use super::weigh::{Weighed, front_most, random_push, weigh_clairvoyantly, weigh_pushes};
use super::{Action, Counted, Decision, Gain, PlannerSettings, PolicyKind, Reason, Rule, Situation};
use crate::belief::Belief;
use crate::camera::ViewId;
use crate::rng::stream;
use crate::skill::{PushTruth, SkillKind, SkillSet};
use rand::Rng;
use rayon::prelude::*;

/// Decides the next action: the same situation decides the same, on any number of threads.
///
/// Gains of all views and the best pair are weighed whatever the policy makes of them, so that decisions of different
/// policies compare. Pushes are drawn and predicted only where the policy may push now.
pub fn decide(policy: PolicyKind, settings: &PlannerSettings, situation: &Situation<'_>) -> Decision {
    let settings = &policy.settings(settings);
    let (history, views) = (situation.history, situation.views);
    let step = history.actions.len();
    let gain = Gain::new(settings.counted, situation.belief, situation.seen);
    let offered = |view: &ViewId| !history.used_views.contains(view) && !situation.unreachable.contains(view);
    let looking = gain.of_looking(views, offered);
    let best_look = looking.pair.map_or_else(|| fallback_view(situation), |pair| pair.first);
    let mut decision = Decision {
        igv: looking.igv,
        pair: looking.views(),
        gains: looking.gains,
        rule: Some(Rule { policy, settings: *settings }),
        ..Decision::unweighed(Action::Look { view: best_look }, Reason::Schedule)
    };
    let complete = || situation.belief.certain_share(settings.certain) >= settings.complete;
    let guarded = |settings: &PlannerSettings| push_guard(history, situation.budget, complete(), settings);
    let guard = || guarded(settings);
    match policy {
        PolicyKind::Mem | PolicyKind::MemPick | PolicyKind::ClairvoyantPush => {
            if let (Counted::All, true, Some(view)) = (gain.counted(), history.just_pushed(), history.view_of_push) {
                decision.action = Action::Look { view };
                decision.reason = Reason::ViewOfPush;
            } else if let Some(reason) = guarded(&closed_by_last(policy, settings)) {
                decision.reason = reason;
            } else if still_closing(history, settings) {
                decision.reason = Reason::JustPushed;
            } else if policy == PolicyKind::ClairvoyantPush {
                let (weighed, truth) = weigh_clairvoyantly(settings, situation, &gain);
                choose_clairvoyantly(&mut decision, weighed, truth.as_ref(), settings, situation.belief);
            } else {
                // Towards the end there may be looks enough left for a pick, and not for a push.
                let skills = guard().map_or(settings.skills, |_| SkillSet::of(&[SkillKind::Pick]));
                let settings = &PlannerSettings { skills, ..*settings };
                let weighed = weigh_pushes(settings, situation, &gain);
                choose(&mut decision, weighed, settings);
            }
        }
        PolicyKind::MemNoPush => (),
        PolicyKind::Random | PolicyKind::RandomCnabu => decision.action = random_look(situation),
        PolicyKind::RandomPush5
        | PolicyKind::RandomPush5Blind
        | PolicyKind::RandomViewPush5
        | PolicyKind::RandomPick5
        | PolicyKind::GreedyFrontPick => {
            if policy == PolicyKind::RandomViewPush5 {
                decision.action = random_look(situation);
            }
            if (step + 1).is_multiple_of(PUSH_EVERY) {
                push_instead(&mut decision, guard(), || match policy {
                    PolicyKind::GreedyFrontPick => front_most(situation, settings),
                    _ => random_push(situation, settings),
                });
            }
        }
        PolicyKind::Saturation => {
            let previous = history.best_gains.last().copied();
            let current = decision.best_gain().unwrap_or(0.0);
            if previous.is_some_and(|previous| saturated(previous, current, settings.saturation)) {
                push_instead(&mut decision, guard(), || random_push(situation, settings));
            }
        }
        PolicyKind::Oracle => decision.action = clairvoyant_look(situation),
    }
    decision
}

/// The settings with the fewest closing looks of what the policy may do.
fn closed_by_last(policy: PolicyKind, settings: &PlannerSettings) -> PlannerSettings {
    let picks = (policy == PolicyKind::MemPick).then(|| closing_steps(SkillKind::Pick, settings));
    PlannerSettings { closing_steps: picks.unwrap_or(settings.closing_steps).min(settings.closing_steps), ..*settings }
}

/// Applies the rule to what was weighed. What is held goes where it is set down, so a pick keeps what it promises and has to
/// promise no more than looking does, as in the paper's rule: patience and floor are for pushes, whose outcomes surprise.
fn choose(decision: &mut Decision, mut weighed: Weighed, settings: &PlannerSettings) {
    let mut settings = *settings;
    if let Some(pick) = weighed.best_of(SkillKind::Pick) {
        let rule = |at: usize, settings: &PlannerSettings| {
            let candidate = &weighed.candidates[at];
            let (igm, reg) = (candidate.gain.unwrap_or(0.0), candidate.reg.unwrap_or(0.0));
            let looking = settings.patience * decision.igv;
            look_or_push(looking, settings.push_floor, igm, reg, settings.gamma)
        };
        let paper = PlannerSettings { patience: 1.0, push_floor: 0.0, ..settings };
        let pushes = weighed.best.is_some_and(|best| best != pick && rule(best, &settings) == Reason::PushTellsMore);
        if !pushes && rule(pick, &paper) == Reason::PushTellsMore {
            (weighed.best, settings) = (Some(pick), paper);
            decision.rule = decision.rule.map(|rule| Rule { settings, ..rule });
        }
    }
    let settings = &settings;
    let Some(best) = take_over(decision, weighed).map(|at| &decision.candidates[at]) else { return };
    decision.igm = best.gain.unwrap_or(0.0);
    decision.reg = best.reg.unwrap_or(0.0);
    decision.reason = ruled(decision, settings);
    if decision.reason == Reason::PushTellsMore {
        decision.action = Action::Manipulate(best.manipulation);
    }
}

/// Pushes if the best push really wins objects; else applies the rule, to what is unknown of the space that it really opens
/// in place of what it promises. A push that loses more objects than it wins is worth nothing.
fn choose_clairvoyantly(
    decision: &mut Decision,
    weighed: Weighed,
    truth: Option<&PushTruth>,
    settings: &PlannerSettings,
    belief: &Belief,
) {
    let (Some(at), Some(truth)) = (take_over(decision, weighed), truth) else { return };
    decision.igm = if truth.balance() < 0 { 0.0 } else { truth.opened_nats(belief) };
    decision.reason = if truth.balance() > 0 { Reason::PushReveals } else { ruled(decision, settings) };
    if matches!(decision.reason, Reason::PushReveals | Reason::PushTellsMore) {
        decision.action = Action::Manipulate(decision.candidates[at].manipulation);
    }
}

/// Takes what was weighed into the decision, and says which push is best; where none is, that is the reason to look.
fn take_over(decision: &mut Decision, mut weighed: Weighed) -> Option<usize> {
    decision.motion = weighed.take_motion();
    decision.candidates = weighed.candidates;
    decision.best_push = weighed.best;
    if weighed.best.is_none() {
        decision.reason = Reason::NoCandidate;
    }
    weighed.best
}

/// The rule, for what the decision holds of looking and of the best push.
fn ruled(decision: &Decision, settings: &PlannerSettings) -> Reason {
    let (looking, floor) = (settings.patience * decision.igv, settings.push_floor);
    look_or_push(looking, floor, decision.igm, decision.reg, settings.gamma)
}

/// Replaces the look by the best of what `draw` brings, if nothing forbids it and there is one.
fn push_instead(decision: &mut Decision, guard: Option<Reason>, draw: impl FnOnce() -> Weighed) {
    if let Some(reason) = guard {
        decision.reason = reason;
        return;
    }
    if let Some(at) = take_over(decision, draw()) {
        decision.action = Action::Manipulate(decision.candidates[at].manipulation);
    }
}

/// Views that were not used since the last push; all of them once every one was.
fn unused_views(situation: &Situation<'_>) -> Vec<ViewId> {
    let all = situation.offered();
    let unused: Vec<ViewId> = all.iter().copied().filter(|view| !situation.history.used_views.contains(view)).collect();
    if unused.is_empty() { all } else { unused }
}

/// Where to look when no unused view promises anything: the first unused one.
fn fallback_view(situation: &Situation<'_>) -> ViewId {
    unused_views(situation).first().copied().unwrap_or(ViewId(0))
}

/// An unused view, each as likely as the other.
fn random_look(situation: &Situation<'_>) -> Action {
    let unused = unused_views(situation);
    let mut rng = stream(situation.seed, "views", situation.history.actions.len() as u64);
    let view = unused.get(rng.random_range(0..unused.len().max(1))).copied().unwrap_or(ViewId(0));
    Action::Look { view }
}

/// The unused view whose real observation leaves the map with the least entropy, the first of equals.
fn clairvoyant_look(situation: &Situation<'_>) -> Action {
    let unused = unused_views(situation);
    let entropies: Vec<f64> = unused.par_iter().map(|&view| (situation.really_look)(view).entropy()).collect();
    let best = (0..unused.len()).min_by(|&a, &b| entropies[a].total_cmp(&entropies[b]));
    Action::Look { view: best.map_or(ViewId(0), |at| unused[at]) }
}
