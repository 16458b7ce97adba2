//! The tables of what a suction cup took: how picks ended, and what maps come to where a pick counts as two actions.

use super::results::{Cell as Episodes, Metric, Results};
use super::table::{Cell, Table};
use super::tables::looked_at;
use crate::bench::EpisodeResult;
use nudge_core::world::GripEnd;

/// How the picks of each policy that picks ended; `None` where nothing was picked.
pub fn ends(results: &Results, set: usize) -> Option<Table> {
    let mut table = Table::new(
        "Picks. A pick that holds is set down where it was to be; the others found no seal or came off on the way.",
        &["policy", "picks per episode", "held", "no seal", "came off", "picks that dropped something"],
    );
    for (_, policy, cell) in results.policies(set) {
        let picks = sum(cell, EpisodeResult::picks);
        if picks == 0 {
            continue;
        }
        let ended = |is: fn(GripEnd) -> bool| cell.episodes().map(|finished| finished.result.picks_ended(is)).sum();
        let share = |part: usize| {
            let percent = 100.0 * part as f64 / picks as f64;
            Cell::new(format!("{percent:.0} %")).with_note(format!("({part} of {picks})"))
        };
        table.rows.push(vec![
            Cell::named(policy),
            Cell::new(format!("{:.1}", cell.mean(|result| result.picks() as f64))),
            share(ended(GripEnd::is_held)),
            share(ended(|end| end == GripEnd::NoSeal)),
            share(ended(|end| end == GripEnd::CameOff)),
            share(sum(cell, EpisodeResult::picks_that_dropped)),
        ]);
    }
    (!table.rows.is_empty()).then_some(table)
}

/// The maps of all policies where a pick takes two actions: one to take, one to set down. `None` where nothing was picked.
pub fn counted_twice(results: &Results, set: usize) -> Option<Table> {
    results.policies(set).into_iter().find(|(_, _, cell)| sum(cell, EpisodeResult::picks) > 0)?;
    let mut table = Table::new(
        "The same maps where a pick counts as two actions, one to take and one to set down: scores after as many actions as \
         then fit, mean over scenes.",
        &["policy"],
    );
    let budget = results.plan.budget;
    let metrics = [(Metric::OccupancyIou, "IoU"), (Metric::SemanticMiou, "mIoU")];
    for (_, name) in metrics {
        table.titles.extend(looked_at(budget).iter().map(|step| format!("{name} at {step}")));
    }
    for (_, policy, cell) in results.policies(set) {
        let mut row = vec![Cell::named(policy)];
        for (metric, _) in metrics {
            for step in looked_at(budget) {
                let mean = cell.mean(|result| metric.of(result.scores(result.steps_within(step))));
                row.push(Cell::new(format!("{mean:.3}")));
            }
        }
        table.rows.push(row);
    }
    Some(table)
}

fn sum(cell: &Episodes, of: fn(&EpisodeResult) -> usize) -> usize {
    cell.episodes().map(|finished| of(&finished.result)).sum()
}
