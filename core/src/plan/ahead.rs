//! Looking two manipulations ahead: what a pick makes way for.
//!
//! What stands before an object may open nothing itself. A pick is worth the larger of what it opens, and half of what it
//! and the best pick that it makes feasible open together: nats for each of the two.

use super::worth::Worth;
use super::{CandidateRecord, PlannerSettings, Situation};
use crate::belief::{Belief, FloorPlan, Intervention, Prediction, SOLID};
use crate::rng::stream;
use crate::skill::{Candidate, Ground, Manipulation, Pick, SkillKind};
use rayon::prelude::*;

/// How far apart two picks touch different faces, metres.
const APART_M: f32 = 0.03;

/// Raises the gain of picks to what they make way for. `picks` are the feasible ones: their positions in `candidates`, and what
/// each is predicted to do.
pub(super) fn weigh_ahead(
    settings: &PlannerSettings,
    situation: &Situation<'_>,
    worth: &Worth<'_>,
    candidates: &mut [CandidateRecord],
    picks: &[(usize, &Prediction)],
) {
    let now: Vec<Pick> = picks.iter().filter_map(|(at, _)| pick_of(&candidates[*at].manipulation)).collect();
    let pairs: Vec<(usize, Manipulation, Prediction)> = picks
        .par_iter()
        .flat_map_iter(|&(at, first)| {
            let then = made_feasible(settings, situation, first, &now);
            then.into_iter().map(move |(second, both)| (at, second, both))
        })
        .collect();
    let both: Vec<Prediction> = pairs.iter().map(|(_, _, both)| both.clone()).collect();
    for ((at, second, _), (_, gain)) in pairs.iter().zip(worth.of_each(&both)) {
        let candidate = &mut candidates[*at];
        if candidate.gain.is_some_and(|alone| 0.5 * gain > alone) {
            (candidate.gain, candidate.then) = (Some(0.5 * gain), Some(*second));
        }
    }
}

fn pick_of(manipulation: &Manipulation) -> Option<Pick> {
    match manipulation {
        Manipulation::Pick(pick) => Some(*pick),
        _ => None,
    }
}

/// The picks that are feasible after the first one and were not before, and what both together are predicted to do.
fn made_feasible(
    settings: &PlannerSettings,
    situation: &Situation<'_>,
    first: &Prediction,
    now: &[Pick],
) -> Vec<(Manipulation, Prediction)> {
    let mut after = situation.belief.clone();
    after.apply(first);
    let ground = Ground { belief: &after, ..situation.ground(settings) };
    let mut rng = stream(situation.seed, "picks ahead", situation.history.actions.len() as u64);
    let is_new = |candidate: &Candidate| {
        let apart =
            |a: &Pick, b: &Pick| (0..3).map(|i| (a.contact[i] - b.contact[i]).powi(2)).sum::<f32>().sqrt() > APART_M;
        candidate.rejection.is_none()
            && pick_of(&candidate.manipulation).is_some_and(|pick| now.iter().all(|other| apart(&pick, other)))
    };
    let drawn = SkillKind::Pick.sample(&ground, settings.candidates, &mut rng);
    let solid = FloorPlan::new(&after, SOLID);
    let (seconds, interventions): (Vec<Manipulation>, Vec<Intervention>) = drawn
        .into_iter()
        .filter(is_new)
        .map(|drawn| (drawn.manipulation, drawn.manipulation.skill().intervention(&after, &solid, drawn.swept)))
        .unzip();
    let predicted = situation.update.predict(&after, &interventions);
    let both = predicted.iter().map(|second| together(situation.belief, first, &after, second));
    seconds.into_iter().zip(both).collect()
}

/// What two manipulations in turn are predicted to do: the first before `after`, the second in it.
fn together(before: &Belief, first: &Prediction, after: &Belief, second: &Prediction) -> Prediction {
    let grid = &before.grid;
    let window = first.window.hull(&second.window);
    let mut belief = after.clone();
    belief.apply(second);
    let mut unchanged = vec![1.0; grid.cell_count()];
    for prediction in [first, second] {
        for (cell, change) in prediction.window.cells(grid).zip(&prediction.change) {
            unchanged[cell] *= 1.0 - change;
        }
    }
    Prediction {
        window,
        occupancy: window.cells(grid).flat_map(|cell| belief.occupancy[grid.column(cell)].iter().copied()).collect(),
        semantics: window.cells(grid).map(|cell| belief.semantics[cell]).collect(),
        change: window.cells(grid).map(|cell| 1.0 - unchanged[cell]).collect(),
    }
}
