//! The tables of a report.

use super::results::{Cell as Episodes, Metric, Results};
use super::table::{Cell, Table};
use crate::bench::{EpisodeResult, VerdictCounts};
use nudge_core::plan::PolicyKind;
use nudge_core::score::Interval;
use std::collections::BTreeSet;

/// Steps that tables look at: half of the budget and all of it.
pub fn looked_at(budget: usize) -> Vec<usize> {
    let half = budget.div_ceil(2);
    if half == budget { vec![budget] } else { vec![half, budget] }
}

/// The policy that the others are compared with: `mem`, or the first.
pub fn reference(results: &Results) -> usize {
    results.position(PolicyKind::Mem).unwrap_or(0)
}

/// Area under a curve: the mean over the steps 1 to the last.
fn area(result: &EpisodeResult, metric: Metric) -> f64 {
    let steps = result.steps.len().max(1);
    (1..=steps).map(|step| metric.of(result.scores(step))).sum::<f64>() / steps as f64
}

fn with_interval(interval: Interval) -> Cell {
    let Interval { mean, low, high } = interval;
    Cell::new(format!("{mean:.3}")).with_note(format!("[{low:.3}, {high:.3}]"))
}

/// How good the maps are.
pub fn scores(results: &Results, set: usize) -> Table {
    let budget = results.plan.budget;
    let mut table = Table::new(
        "Maps: mean over scenes with its 95 % interval. “Set” is over one confusion matrix of the whole set at the end. AUC \
         is the mean over the steps.",
        &["policy"],
    );
    let metrics = [(Metric::OccupancyIou, "IoU"), (Metric::SemanticMiou, "mIoU")];
    for (_, name) in metrics {
        table.titles.extend(looked_at(budget).iter().map(|step| format!("{name} at {step}")));
        table.titles.extend([format!("{name} set"), format!("{name} AUC")]);
    }
    table.titles.extend(["occupied IoU", "mECE occupancy", "mECE semantics"].map(str::to_owned));
    for (_, policy, cell) in results.policies(set) {
        let tally = cell.tally(budget).scores();
        let number = |value: f64| Cell::new(format!("{value:.3}"));
        let mut row = vec![Cell::named(policy)];
        for (metric, _) in metrics {
            row.extend(looked_at(budget).into_iter().map(|s| with_interval(cell.interval(|r| metric.of(r.scores(s))))));
            row.push(number(metric.of(&tally)));
            row.push(number(cell.mean(|result| area(result, metric))));
        }
        row.push(number(cell.mean(|result| result.scores(budget).occupied_iou)));
        row.push(number(tally.mece_occupancy));
        row.push(number(tally.mece_semantics));
        table.rows.push(row);
    }
    table
}

/// What the robot did for it.
pub fn actions(results: &Results, set: usize) -> Table {
    let mut table = Table::new(
        "Actions. A drop is a push or pick after which an object lay off the board; “revealed” are the objects unseen from every \
         view at the start and found at the end.",
        &["policy", "episodes", "pushes per episode", "drops", "displacement per episode", "decision", "revealed"],
    );
    for (_, policy, cell) in results.policies(set) {
        let sum = |of: fn(&EpisodeResult) -> usize| cell.episodes().map(|finished| of(&finished.result)).sum::<usize>();
        let (pushes, drops) = (sum(EpisodeResult::pushes), sum(EpisodeResult::drops));
        let (hidden, revealed) = (sum(|result| result.hidden.len()), sum(EpisodeResult::revealed));
        let seconds = cell.seconds_per_decision();
        table.rows.push(vec![
            Cell::named(policy),
            Cell::new(cell.episodes().count()),
            Cell::new(format!("{:.1}", cell.mean(|result| result.pushes() as f64))),
            share(drops, pushes + sum(EpisodeResult::picks), "moves"),
            Cell::new(format!("{:.2} m", cell.mean(EpisodeResult::displacement_m))),
            Cell::new(seconds.map_or("-".to_owned(), |seconds| format!("{seconds:.2} s"))),
            share(revealed, hidden, "objects"),
        ]);
    }
    table
}

fn share(part: usize, whole: usize, of_what: &str) -> Cell {
    if whole == 0 {
        return Cell::new("-");
    }
    let percent = 100.0 * part as f64 / whole as f64;
    Cell::new(format!("{percent:.0} %")).with_note(format!("({part} of {whole} {of_what})"))
}

/// What became of the objects.
pub fn verdicts(results: &Results, set: usize) -> Table {
    let mut table = Table::new(
        "Objects at the end, summed over all episodes; the share is of the objects that have a verdict.",
        &["policy", "found", "misclassified", "not found", "hallucinated"],
    );
    for (_, policy, cell) in results.policies(set) {
        let mut sum = VerdictCounts::default();
        for finished in cell.episodes() {
            let counts = VerdictCounts::of(&finished.result.verdicts);
            sum.found += counts.found;
            sum.misclassified += counts.misclassified;
            sum.not_found += counts.not_found;
            sum.hallucinated += counts.hallucinated;
        }
        let judged = sum.found + sum.misclassified + sum.not_found;
        let of_judged = |count: usize| {
            Cell::new(count).with_note(format!("({:.0} %)", 100.0 * count as f64 / judged.max(1) as f64))
        };
        table.rows.push(vec![
            Cell::named(policy),
            of_judged(sum.found),
            of_judged(sum.misclassified),
            of_judged(sum.not_found),
            Cell::new(sum.hallucinated),
        ]);
    }
    table
}

/// Every other policy against the reference, scene by scene, if there is another.
pub fn differences(results: &Results, set: usize) -> Option<Table> {
    let reference = reference(results);
    let cell = results.cell(set, reference)?;
    let name = results.plan.policies[reference].policy;
    let budget = results.plan.budget;
    let caption = format!(
        "Paired differences: {name} minus the other policy, scene by scene, with the 95 % interval of the bootstrap over {} \
         scenes; bold where it excludes zero.",
        cell.scenes.len()
    );
    let mut table = Table::new(&caption, &[&format!("{name} against")]);
    let metrics = [(Metric::OccupancyIou, "IoU"), (Metric::SemanticMiou, "mIoU")];
    for (_, title) in metrics {
        table.titles.extend(looked_at(budget).iter().map(|step| format!("{title} at {step}")));
        table.titles.push(format!("{title} AUC"));
    }
    for (position, policy, other) in results.policies(set) {
        if position == reference {
            continue;
        }
        let mut row = vec![Cell::named(policy)];
        for (metric, _) in metrics {
            for step in looked_at(budget) {
                row.push(signed(cell.difference(other, |result| metric.of(result.scores(step)))));
            }
            row.push(signed(cell.difference(other, |result| area(result, metric))));
        }
        table.rows.push(row);
    }
    (!table.rows.is_empty()).then_some(table)
}

fn signed(interval: Interval) -> Cell {
    let Interval { mean, low, high } = interval;
    let cell = Cell::new(format!("{mean:+.3}")).with_note(format!("[{low:+.3}, {high:+.3}]"));
    if interval.excludes_zero() { cell.bold() } else { cell }
}

/// The entropy that choosing views by their gain leaves, against the clairvoyant oracle's, in a sentence; `None` where one
/// of the two did not run.
pub fn against_oracle(results: &Results, set: usize) -> Option<String> {
    let cell = |policy| results.position(policy).and_then(|at| results.cell(set, at));
    let (gain, oracle) = (cell(PolicyKind::MemNoPush)?, cell(PolicyKind::Oracle)?);
    let excess: Vec<f64> = (1..=results.plan.budget)
        .map(|step| {
            let entropy = |cell: &Episodes| cell.mean(|result| result.scores(step).entropy_nats);
            entropy(gain) / entropy(oracle).max(f64::MIN_POSITIVE) - 1.0
        })
        .collect();
    let worst = (0..excess.len()).max_by(|a, b| excess[*a].total_cmp(&excess[*b])).unwrap_or(0);
    let last = excess.last().copied().unwrap_or(0.0);
    Some(format!(
        "Views chosen by their gain (mem-no-push) leave {:+.1} % of the entropy that the clairvoyant oracle leaves at the \
         end, and {:+.1} % at step {}, the worst.",
        100.0 * last,
        100.0 * excess[worst],
        worst + 1
    ))
}

/// Sets that hold the same scenes, object sizes apart: in distribution against out of it.
pub fn across_sets(results: &Results) -> Vec<Table> {
    let plan = &results.plan;
    let mut tables = Vec::new();
    for one in 0..plan.sets.len() {
        for other in 0..plan.sets.len() {
            let ids = |set: usize| plan.sets[set].scenes.iter().map(|scene| scene.id.as_str()).collect::<BTreeSet<_>>();
            let both = ids(one).intersection(&ids(other)).count();
            // The set that is out of distribution says so; of two that do not, the later one.
            let is_out = |set: usize| plan.sets[set].name.contains("ood");
            let in_order = is_out(other) && !is_out(one) || (is_out(one) == is_out(other) && one < other);
            if in_order && 2 * both > ids(one).len() {
                tables.extend(across(results, one, other));
            }
        }
    }
    tables
}

fn across(results: &Results, one: usize, other: usize) -> Option<Table> {
    let (plan, budget) = (&results.plan, results.plan.budget);
    let names = [one, other].map(|set| &plan.sets[set].name);
    let caption = format!(
        "{} against {}: the same scenes, their objects in other sizes; differences scene by scene at step {budget}.",
        names[1], names[0]
    );
    let mut table = Table::new(&caption, &["policy"]);
    for metric in ["IoU", "mIoU"] {
        table.titles.extend(names.map(|name| format!("{metric} {name}")));
        table.titles.push("difference".to_owned());
    }
    for (position, policy, here) in results.policies(one) {
        let Some(there) = results.cell(other, position) else { continue };
        let mut row = vec![Cell::named(policy)];
        for metric in [Metric::OccupancyIou, Metric::SemanticMiou] {
            let value = |result: &EpisodeResult| metric.of(result.scores(budget));
            let (here, there) = (here.by_scene(value), there.by_scene(value));
            let counterpart = |scene: usize| {
                let id = &plan.sets[other].scenes[scene].id;
                here.get(&plan.sets[one].scenes.iter().position(|scene| scene.id == *id)?).copied()
            };
            let both: Vec<(f64, f64)> =
                there.iter().filter_map(|(scene, there)| Some((counterpart(*scene)?, *there))).collect();
            let (here, there): (Vec<f64>, Vec<f64>) = both.into_iter().unzip();
            row.push(Cell::new(format!("{:.3}", Interval::of(&here).mean)));
            row.push(Cell::new(format!("{:.3}", Interval::of(&there).mean)));
            row.push(signed(Interval::of_difference(&there, &here)));
        }
        table.rows.push(row);
    }
    (!table.rows.is_empty()).then_some(table)
}
