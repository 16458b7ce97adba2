//! The table of what looks and manipulations promised, and what they brought.

use super::results::Results;
use super::table::{Cell, Table};
use crate::bench::EpisodeResult;
use nudge_core::episode::{Acted, Delivered, MapState, delivered};
use nudge_core::plan::{Action, PolicyKind};
use nudge_core::score::{Scores, mean, rank_correlation};

/// What the actions of each policy promised and brought.
pub fn table(results: &Results, set: usize) -> Table {
    let mut table = Table::new(
        "Promised and delivered. A look brings what it changes at once; a push or pick what changes over it and the looks after it, until the \
         next one. Rank is Spearman's correlation of the promise with the fall of entropy and with the objects found.",
        &[
            "policy",
            "actions",
            "promised, nats",
            "entropy fell, nats",
            "rank",
            "mIoU",
            "objects found",
            "rank",
            "lowered the map",
        ],
    );
    for (_, policy, cell) in results.policies(set) {
        let all: Vec<Delivered> = cell.episodes().flat_map(|finished| of(&finished.result)).collect();
        for (kind, is_manipulation) in [("looks", false), ("pushes and picks", true)] {
            let some: Vec<&Delivered> = all.iter().filter(|one| one.is_manipulation == is_manipulation).collect();
            if !some.is_empty() {
                table.rows.push(row(policy, kind, &some));
            }
        }
    }
    table
}

fn row(policy: PolicyKind, kind: &str, some: &[&Delivered]) -> Vec<Cell> {
    let over =
        |value: &dyn Fn(&Delivered) -> Option<f64>| some.iter().filter_map(|one| value(one)).collect::<Vec<f64>>();
    let mean_of = |values: &[f64], digits: usize| match values {
        [] => Cell::new("–"),
        values => Cell::new(format!("{:.digits$}", mean(values))),
    };
    let promise = |one: &Delivered| one.promised.map(f64::from).filter(|nats| nats.is_finite());
    let rank = |brought: &dyn Fn(&Delivered) -> Option<f64>| {
        let pairs = some.iter().filter_map(|one| Some((promise(one)?, brought(one)?)));
        let (promised, brought): (Vec<f64>, Vec<f64>) = pairs.unzip();
        rank_correlation(&promised, &brought).map_or(Cell::new("–"), |rank| Cell::new(format!("{rank:.2}")))
    };
    let entropy = |one: &Delivered| Some(one.entropy_nats);
    let found = |one: &Delivered| one.judged.map(|gained| gained.found as f64);
    let miou = |one: &Delivered| one.judged.map(|gained| gained.semantic_miou);
    let lowered = some.iter().filter(|one| one.lowered()).count();
    vec![
        Cell::named(policy),
        Cell::new(some.len()).with_note(kind.to_owned()),
        mean_of(&over(&promise), 0),
        mean_of(&over(&entropy), 0),
        rank(&entropy),
        mean_of(&over(&miou), 3),
        mean_of(&over(&found), 2),
        rank(&found),
        Cell::new(format!("{:.0} %", 100.0 * lowered as f64 / some.len() as f64)),
    ]
}

/// What the actions of an episode promised and brought.
fn of(result: &EpisodeResult) -> Vec<Delivered> {
    let state = |scores: &Scores, found: usize| MapState {
        entropy_nats: scores.entropy_nats,
        judged: Some((scores.occupancy_iou, scores.semantic_miou, found)),
    };
    let acted: Vec<Acted> = (result.steps.iter())
        .map(|step| {
            let is_manipulation = matches!(step.action, Action::Manipulate(_));
            // Of a push at random nothing is promised.
            let weighed = (is_manipulation && step.igm > 0.0).then_some(step.igm);
            let promised = if is_manipulation { weighed } else { step.gain };
            Acted { is_manipulation, promised, after: state(&step.scores, step.verdicts.found) }
        })
        .collect();
    delivered(state(&result.prior, 0), &acted)
}
