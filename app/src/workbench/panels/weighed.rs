//! What a decision weighed, in order: views by gain, pushes by value; as rows of tables.

use super::table::{Cell, Column, Row};
use super::words;
use nudge_core::camera::{ViewArray, ViewId};
use nudge_core::episode::EpisodeRecord;
use nudge_core::plan::{Action, Counted, DISTURBANCE, Decision, ranked};
use nudge_core::skill::{Parameter, SkillKind, Unit};
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
            Action::Manipulate(_) => used.clear(),
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
        Action::Manipulate(_) => None,
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

/// The numbers of the candidates that have a column: title and meaning, in the order in which skills tell them.
fn numbers(decision: &Decision) -> Vec<(&'static str, &'static str)> {
    let mut columns: Vec<(&str, &str)> = Vec::new();
    let mut kinds: Vec<SkillKind> = Vec::new();
    for candidate in &decision.candidates {
        // Candidates of one skill have the same numbers.
        if kinds.contains(&candidate.manipulation.kind()) {
            continue;
        }
        kinds.push(candidate.manipulation.kind());
        for parameter in candidate.manipulation.describe().parameters {
            let Some(title) = parameter.column else { continue };
            if !columns.iter().any(|(known, _)| *known == title) {
                columns.push((title, parameter.hint));
            }
        }
    }
    columns
}

/// Columns of [`push_rows`].
pub fn push_columns(decision: &Decision) -> Vec<Column> {
    let mut columns = vec![
        Column { title: "Push", hint: "Number of the candidate, in the order drawn", width: 34.0 },
        Column { title: "Value", hint: "Gain + γ·Reg, nats: what is compared with looking", width: 50.0 },
        Column { title: "Gain", hint: decision.counted().of_a_push(), width: 50.0 },
        Column { title: "γ·Reg", hint: DISTURBANCE, width: 42.0 },
    ];
    let width = |title: &str| if title == "mm" { 30.0 } else { 34.0 };
    columns.extend(numbers(decision).into_iter().map(|(title, hint)| Column { title, hint, width: width(title) }));
    let hint = "Whether it is chosen or the best, or why it was rejected";
    columns.push(Column { title: "Note", hint, width: 40.0 });
    columns
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
    let columns = numbers(decision);
    let several = candidates.iter().any(|candidate| candidate.manipulation.kind() != candidates[0].manipulation.kind());
    let row = |at: usize| {
        let candidate = &candidates[at];
        let told = candidate.manipulation.describe();
        let skill = words::capital(candidate.manipulation.kind().name());
        let (note, hint) = match &candidate.rejection {
            _ if pushed == Some(at) => ("chosen".to_owned(), String::new()),
            _ if decision.best_push == Some(at) => ("best".to_owned(), String::new()),
            Some(rejection) => ("rejected".to_owned(), words::capital(&candidate.manipulation.against(rejection))),
            None => (String::new(), String::new()),
        };
        let hint = candidate.makes_way_for().map_or(hint, |then| format!("Makes way for {}", then.replace('-', "−")));
        let place = told
            .facts
            .first()
            .map_or_else(String::new, |fact| words::capital(&format!("{} {}", fact.name, fact.text.replace('-', "−"))));
        let view = candidate.view.map_or_else(String::new, |view| format!("; best seen from view {}", view.0));
        let name = match (&candidate.rejection, decision.value_of(candidate)) {
            (Some(rejection), _) => {
                format!("{skill} {at}, rejected: {}", candidate.manipulation.against(rejection))
            }
            (None, Some(value)) => format!("{skill} {at}, value {}", words::nats(value)),
            (None, None) => format!("{skill} {at}, not weighed"),
        };
        let mut cells = vec![
            Cell::number(at),
            Cell::nats(decision.value_of(candidate)),
            Cell::nats(candidate.gain),
            Cell::nats(decision.disturbance_of(candidate)),
        ];
        cells.extend(columns.iter().map(|(title, _)| {
            match told.parameters.iter().find(|parameter| parameter.column == Some(*title)) {
                Some(parameter) => Cell::Figure(f64::from(parameter.value), figure(parameter)),
                None => Cell::Word(String::new()),
            }
        }));
        // Where there are several skills, the note says which one it is.
        let note = if several { format!("{} {note}", candidate.manipulation.kind().name()) } else { note };
        cells.push(Cell::Word(note.trim_end().to_owned()));
        Row {
            key: at,
            cells,
            chosen: pushed == Some(at),
            selected: selected == Some(at),
            grey: candidate.rejection.is_some(),
            name,
            hint: if hint.is_empty() { format!("{place}{view}") } else { format!("{hint}\n{place}") },
        }
    };
    order.into_iter().map(row).collect()
}

/// A number as it stands in a table: degrees have their sign, lengths none.
fn figure(parameter: &Parameter) -> String {
    let sign = if parameter.unit == Unit::Degrees { parameter.sign() } else { "" };
    (parameter.number() + sign).replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::fixture;
    use nudge_core::plan::CandidateRecord;
    use nudge_core::skill::Manipulation;

    #[test]
    fn candidates_of_two_skills_share_a_table_and_say_which_they_are() {
        let mut decision = fixture::session(1).moments[4].decision().expect("step 4").clone();
        let candidate = |json: &str| CandidateRecord {
            gain: Some(1.0),
            ..CandidateRecord::of(serde_json::from_str::<Manipulation>(json).expect("a manipulation"))
        };
        decision.candidates = vec![
            candidate(r#"{"kind": "push", "start": [0, 0.1, 0.06], "direction_deg": 90, "length_m": 0.1}"#),
            candidate(
                r#"{"kind": "drag", "start": [0, 0.2, 0.05], "direction_deg": -90, "length_m": 0.08, "pitch_deg": 45}"#,
            ),
        ];
        decision.best_push = Some(0);
        let titles: Vec<&str> = push_columns(&decision).iter().map(|column| column.title).collect();
        assert_eq!(titles, ["Push", "Value", "Gain", "γ·Reg", "To", "mm", "Down", "Note"]);
        let rows = push_rows(&decision, Listed::All, None);
        assert!(rows.iter().all(|row| row.cells.len() == titles.len()));
        assert!(rows[0].name.starts_with("Push 0, value") && rows[1].name.starts_with("Drag 1, value"));
        // With pushes alone the table is as it was.
        decision.candidates.truncate(1);
        assert_eq!(push_columns(&decision).len(), 7);
    }

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
