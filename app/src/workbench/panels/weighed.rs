//! What a decision weighed, in order: views by gain, pushes by value; as rows of tables.

use super::table::{Cell, Column, Row};
use super::words;
use nudge_core::camera::{ViewArray, ViewId};
use nudge_core::episode::EpisodeRecord;
use nudge_core::plan::{Action, Counted, DISTURBANCE, Decision, ranked};
use std::collections::BTreeSet;

/// How many views and pushes the tables list.
pub const LISTED: usize = 10;

/// The views that looks since the last push have used up after `step` actions.
pub fn used_views(record: &EpisodeRecord, step: usize) -> BTreeSet<ViewId> {
    let mut used = BTreeSet::new();
    for step in record.steps.iter().take(step) {
        match step.action {
            Action::Look { view } => {
                used.insert(view);
            }
            Action::Push(_) => used.clear(),
        }
    }
    used
}

/// Views in the order of falling gain; what is no number comes last.
fn falling(gains: &[f32]) -> Vec<usize> {
    ranked(None, gains.iter().map(|gain| gain.is_finite().then_some(*gain)))
}

/// The best gain of all views, nats.
pub fn best_gain(decision: &Decision) -> f32 {
    decision.gains.iter().copied().filter(|gain| gain.is_finite()).fold(0.0, f32::max)
}

/// The view that a decision looks from.
pub fn looked_from(decision: &Decision) -> Option<ViewId> {
    match decision.action {
        Action::Look { view } => Some(view),
        Action::Push(_) => None,
    }
}

/// The candidate that is looked at unless another one is chosen: the one that is pushed, else the best one.
pub fn looked_at_first(decision: &Decision) -> Option<usize> {
    decision.pushed().or(decision.best_push).filter(|at| *at < decision.candidates.len())
}

/// Columns of [`view_rows`].
pub fn view_columns(counted: Counted) -> [Column; 5] {
    [
        Column { title: "View", hint: "Number of the view in its array", width: 34.0 },
        Column { title: "Gain", hint: counted.of_a_view(), width: 52.0 },
        Column { title: "Of best", hint: "Share of the best view's gain", width: 46.0 },
        Column { title: "Camera at", hint: "Column, row and look-at target in the array, counted from 1", width: 62.0 },
        Column {
            title: "Note",
            hint: "Whether it is chosen, in the best pair, or used since the last push",
            width: 60.0,
        },
    ]
}

/// The best views of a decision.
pub fn view_rows(
    decision: &Decision,
    views: &ViewArray,
    used: &BTreeSet<ViewId>,
    selected: Option<ViewId>,
) -> Vec<Row> {
    let best = best_gain(decision);
    let looked = looked_from(decision);
    let order = falling(&decision.gains);
    let row = |at: usize| {
        let (id, gain) = (ViewId(at as u16), decision.gains[at]);
        let note = match decision.pair.iter().position(|view| *view == id) {
            _ if looked == Some(id) => "chosen",
            Some(0) => "first of pair",
            Some(_) => "second of pair",
            None if used.contains(&id) => "used",
            None => "",
        };
        let slot = views.view(id).map_or_else(String::new, |view| {
            format!("{}, {}, {}", view.slot[0] + 1, view.slot[1] + 1, view.slot[2] + 1)
        });
        let share = if best > 0.0 { gain / best } else { f32::NAN };
        Row {
            key: at,
            cells: vec![
                Cell::number(at),
                Cell::nats(Some(gain)),
                Cell::Figure(f64::from(share), words::percent(share)),
                Cell::Word(slot),
                Cell::Word(note.to_owned()),
            ],
            chosen: looked == Some(id),
            selected: selected == Some(id),
            grey: used.contains(&id) && looked != Some(id),
            name: format!("View {at}, gain {}", words::nats(gain)),
            hint: String::new(),
        }
    };
    order.into_iter().take(LISTED).map(row).collect()
}

/// Columns of [`push_rows`].
pub fn push_columns(counted: Counted) -> [Column; 7] {
    [
        Column { title: "Push", hint: "Number of the candidate, in the order drawn", width: 34.0 },
        Column { title: "Value", hint: "Gain + γ·Reg, nats: what is compared with looking", width: 50.0 },
        Column { title: "Gain", hint: counted.of_a_push(), width: 50.0 },
        Column { title: "γ·Reg", hint: DISTURBANCE, width: 42.0 },
        Column { title: "To", hint: "Direction, degrees; 90 is into the shelf, 0 to the right", width: 34.0 },
        Column { title: "mm", hint: "Planned length of the push, millimetres", width: 30.0 },
        Column { title: "Note", hint: "Whether it is chosen or the best, or why it was rejected", width: 40.0 },
    ]
}

/// Which candidates a table lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Listed {
    /// The best feasible ones.
    Best,
    /// All, the rejected ones last.
    All,
}

/// Push candidates of a decision, as the planner ranks them.
pub fn push_rows(decision: &Decision, listed: Listed, selected: Option<usize>) -> Vec<Row> {
    let pushed = decision.pushed();
    let candidates = &decision.candidates;
    let mut order = decision.ranked_candidates();
    if listed == Listed::Best {
        order.retain(|at| candidates[*at].rejection.is_none());
        order.truncate(LISTED);
    }
    let row = |at: usize| {
        let candidate = &candidates[at];
        let push = &candidate.push;
        let (note, hint) = match &candidate.rejection {
            _ if pushed == Some(at) => ("chosen".to_owned(), String::new()),
            _ if decision.best_push == Some(at) => ("best".to_owned(), String::new()),
            Some(rejection) => ("rejected".to_owned(), words::capital(&rejection.to_string())),
            None => (String::new(), String::new()),
        };
        let place = format!("From x {}, y {} m", words::metres(push.start[0]), words::metres(push.start[1]));
        let view = candidate.view.map_or_else(String::new, |view| format!("; best seen from view {}", view.0));
        let name = match (&candidate.rejection, decision.value_of(candidate)) {
            (Some(rejection), _) => format!("Push {at}, rejected: {}", rejection),
            (None, Some(value)) => format!("Push {at}, value {}", words::nats(value)),
            (None, None) => format!("Push {at}, not weighed"),
        };
        Row {
            key: at,
            cells: vec![
                Cell::number(at),
                Cell::nats(decision.value_of(candidate)),
                Cell::nats(candidate.gain),
                Cell::nats(decision.disturbance_of(candidate)),
                Cell::Figure(f64::from(push.direction_deg), format!("{:.0}°", push.direction_deg).replace('-', "−")),
                Cell::Figure(f64::from(push.length_m), format!("{:.0}", push.length_m * 1e3)),
                Cell::Word(note),
            ],
            chosen: pushed == Some(at),
            selected: selected == Some(at),
            grey: candidate.rejection.is_some(),
            name,
            hint: if hint.is_empty() { format!("{place}{view}") } else { format!("{hint}\n{place}") },
        }
    };
    order.into_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::fixture;

    #[test]
    fn the_best_push_stands_on_top_of_the_table_though_another_one_has_a_larger_value() {
        let mut decision = fixture::session(1).moments[4].decision().expect("step 4").clone();
        let best = decision.candidates.iter().position(|push| push.rejection.is_none()).expect("a feasible push");
        let other = decision.candidates.len();
        decision.candidates.push(decision.candidates[best].clone());
        (decision.candidates[other].gain, decision.candidates[other].reg) = (Some(1e6), Some(0.0));
        decision.best_push = Some(best);
        for listed in [Listed::Best, Listed::All] {
            let rows = push_rows(&decision, listed, None);
            assert_eq!([rows[0].key, rows[1].key], [best, other]);
        }
        assert_eq!(push_rows(&decision, Listed::All, None).len(), decision.candidates.len());
    }
}
