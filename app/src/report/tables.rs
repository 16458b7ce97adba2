//! The tables of a report, as HTML.

use super::results::{Cell, Metric, Results};
use crate::bench::{EpisodeResult, VerdictCounts};
use crate::figure::escape;
use nudge_core::plan::PolicyKind;
use nudge_core::score::Interval;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// A table: a caption, column titles, and rows that start with their name.
struct Table {
    caption: String,
    titles: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn html(&self) -> String {
        let mut html = format!(
            "<figure class=\"table\"><figcaption>{}</figcaption><div class=\"wide\"><table><thead><tr>",
            self.caption
        );
        for title in &self.titles {
            let _ = write!(html, "<th scope=\"col\">{title}</th>");
        }
        html += "</tr></thead><tbody>";
        for row in &self.rows {
            html += "<tr>";
            for (at, cell) in row.iter().enumerate() {
                let (tag, scope) = if at == 0 { ("th", " scope=\"row\"") } else { ("td", "") };
                let _ = write!(html, "<{tag}{scope}>{cell}</{tag}>");
            }
            html += "</tr>";
        }
        html + "</tbody></table></div></figure>\n"
    }
}

fn titles(titles: &[&str]) -> Vec<String> {
    titles.iter().map(|title| (*title).to_owned()).collect()
}

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

fn with_interval(interval: Interval) -> String {
    format!("{:.3} <small>[{:.3}, {:.3}]</small>", interval.mean, interval.low, interval.high)
}

/// How good the maps are.
pub fn scores(results: &Results, set: usize) -> String {
    let budget = results.plan.budget;
    let mut table = Table {
        caption:
            "Maps: mean over scenes with its 95 % interval. <i>Set</i> is over one confusion matrix of the whole set \
                  at the end. AUC is the mean over the steps."
                .to_owned(),
        titles: titles(&["policy"]),
        rows: Vec::new(),
    };
    let metrics = [(Metric::OccupancyIou, "IoU"), (Metric::SemanticMiou, "mIoU")];
    for (_, name) in metrics {
        table.titles.extend(looked_at(budget).iter().map(|step| format!("{name} at {step}")));
        table.titles.extend([format!("{name} set"), format!("{name} AUC")]);
    }
    table.titles.extend(titles(&["occupied IoU", "mECE occupancy", "mECE semantics"]));
    for (_, policy, cell) in results.policies(set) {
        let tally = cell.tally(budget).scores();
        let mut row = vec![policy.to_string()];
        for (metric, _) in metrics {
            row.extend(looked_at(budget).into_iter().map(|s| with_interval(cell.interval(|r| metric.of(r.scores(s))))));
            row.push(format!("{:.3}", metric.of(&tally)));
            row.push(format!("{:.3}", cell.mean(|result| area(result, metric))));
        }
        row.push(format!("{:.3}", cell.mean(|result| result.scores(budget).occupied_iou)));
        row.push(format!("{:.3}", tally.mece_occupancy));
        row.push(format!("{:.3}", tally.mece_semantics));
        table.rows.push(row);
    }
    table.html()
}

/// What the robot did for it.
pub fn actions(results: &Results, set: usize) -> String {
    let mut table = Table {
        caption:
            "Actions. A drop is a push after which an object lay off the board; <i>revealed</i> are the objects unseen \
                  from every view at the start and found at the end."
                .to_owned(),
        titles: titles(&[
            "policy",
            "episodes",
            "pushes per episode",
            "drops",
            "displacement per episode",
            "decision",
            "revealed",
        ]),
        rows: Vec::new(),
    };
    for (_, policy, cell) in results.policies(set) {
        let sum = |of: fn(&EpisodeResult) -> usize| cell.episodes().map(|finished| of(&finished.result)).sum::<usize>();
        let (pushes, drops) = (sum(EpisodeResult::pushes), sum(EpisodeResult::drops));
        let (hidden, revealed) = (sum(|result| result.hidden.len()), sum(EpisodeResult::revealed));
        table.rows.push(vec![
            policy.to_string(),
            cell.episodes().count().to_string(),
            format!("{:.1}", cell.mean(|result| result.pushes() as f64)),
            share(drops, pushes, "pushes"),
            format!("{:.2} m", cell.mean(EpisodeResult::displacement_m)),
            cell.seconds_per_decision().map_or("-".to_owned(), |seconds| format!("{seconds:.2} s")),
            share(revealed, hidden, "objects"),
        ]);
    }
    table.html()
}

fn share(part: usize, whole: usize, of_what: &str) -> String {
    match whole {
        0 => "-".to_owned(),
        _ => format!("{:.0} % <small>({part} of {whole} {of_what})</small>", 100.0 * part as f64 / whole as f64),
    }
}

/// What became of the objects.
pub fn verdicts(results: &Results, set: usize) -> String {
    let mut table = Table {
        caption: "Objects at the end, summed over all episodes; the share is of the objects that have a verdict."
            .to_owned(),
        titles: titles(&["policy", "found", "misclassified", "not found", "hallucinated"]),
        rows: Vec::new(),
    };
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
        let of_judged =
            |count: usize| format!("{count} <small>({:.0} %)</small>", 100.0 * count as f64 / judged.max(1) as f64);
        table.rows.push(vec![
            policy.to_string(),
            of_judged(sum.found),
            of_judged(sum.misclassified),
            of_judged(sum.not_found),
            sum.hallucinated.to_string(),
        ]);
    }
    table.html()
}

/// Every other policy against the reference, scene by scene.
pub fn differences(results: &Results, set: usize) -> String {
    let reference = reference(results);
    let Some(cell) = results.cell(set, reference) else { return String::new() };
    let name = results.plan.policies[reference].policy;
    let budget = results.plan.budget;
    let mut table = Table {
        caption: format!(
            "Paired differences: {name} minus the other policy, scene by scene, with the 95 % interval of the bootstrap \
             over {} scenes; bold where it excludes zero.",
            cell.scenes.len()
        ),
        titles: vec![format!("{name} against")],
        rows: Vec::new(),
    };
    let metrics = [(Metric::OccupancyIou, "IoU"), (Metric::SemanticMiou, "mIoU")];
    for (_, title) in metrics {
        table.titles.extend(looked_at(budget).iter().map(|step| format!("{title} at {step}")));
        table.titles.push(format!("{title} AUC"));
    }
    for (position, policy, other) in results.policies(set) {
        if position == reference {
            continue;
        }
        let mut row = vec![policy.to_string()];
        for (metric, _) in metrics {
            for step in looked_at(budget) {
                row.push(signed(cell.difference(other, |result| metric.of(result.scores(step)))));
            }
            row.push(signed(cell.difference(other, |result| area(result, metric))));
        }
        table.rows.push(row);
    }
    if table.rows.is_empty() { String::new() } else { table.html() }
}

fn signed(interval: Interval) -> String {
    let Interval { mean, low, high } = interval;
    let text = format!("{mean:+.3} <small>[{low:+.3}, {high:+.3}]</small>");
    if interval.excludes_zero() { format!("<b>{text}</b>") } else { text }
}

/// The entropy that choosing views by their gain leaves, against the clairvoyant oracle's.
pub fn against_oracle(results: &Results, set: usize) -> String {
    let cell = |policy| results.position(policy).and_then(|at| results.cell(set, at));
    let (Some(gain), Some(oracle)) = (cell(PolicyKind::MemNoPush), cell(PolicyKind::Oracle)) else {
        return String::new();
    };
    let excess: Vec<f64> = (1..=results.plan.budget)
        .map(|step| {
            let entropy = |cell: &Cell| cell.mean(|result| result.scores(step).entropy_nats);
            entropy(gain) / entropy(oracle).max(f64::MIN_POSITIVE) - 1.0
        })
        .collect();
    let worst = (0..excess.len()).max_by(|a, b| excess[*a].total_cmp(&excess[*b])).unwrap_or(0);
    let last = excess.last().copied().unwrap_or(0.0);
    format!(
        "<p>Views chosen by their gain (mem-no-push) leave {:+.1} % of the entropy that the clairvoyant oracle leaves at the \
         end, and {:+.1} % at step {}, the worst.</p>\n",
        100.0 * last,
        100.0 * excess[worst],
        worst + 1
    )
}

/// Sets that hold the same scenes, object sizes apart: in distribution against out of it.
pub fn across_sets(results: &Results) -> String {
    let plan = &results.plan;
    let mut html = String::new();
    for one in 0..plan.sets.len() {
        for other in 0..plan.sets.len() {
            let ids = |set: usize| plan.sets[set].scenes.iter().map(|scene| scene.id.as_str()).collect::<BTreeSet<_>>();
            let both = ids(one).intersection(&ids(other)).count();
            // The set that is out of distribution says so; of two that do not, the later one.
            let is_out = |set: usize| plan.sets[set].name.contains("ood");
            let in_order = is_out(other) && !is_out(one) || (is_out(one) == is_out(other) && one < other);
            if in_order && 2 * both > ids(one).len() {
                html += &across(results, one, other);
            }
        }
    }
    html
}

fn across(results: &Results, one: usize, other: usize) -> String {
    let (plan, budget) = (&results.plan, results.plan.budget);
    let names = [one, other].map(|set| escape(&plan.sets[set].name));
    let mut table = Table {
        caption: format!(
            "{} against {}: the same scenes, their objects in other sizes; differences scene by scene at step {budget}.",
            names[1], names[0]
        ),
        titles: vec![
            "policy".to_owned(),
            format!("IoU {}", names[0]),
            format!("IoU {}", names[1]),
            "difference".to_owned(),
            format!("mIoU {}", names[0]),
            format!("mIoU {}", names[1]),
            "difference".to_owned(),
        ],
        rows: Vec::new(),
    };
    for (position, policy, here) in results.policies(one) {
        let Some(there) = results.cell(other, position) else { continue };
        let mut row = vec![policy.to_string()];
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
            row.push(format!("{:.3}", Interval::of(&here).mean));
            row.push(format!("{:.3}", Interval::of(&there).mean));
            row.push(signed(Interval::of_difference(&there, &here)));
        }
        table.rows.push(row);
    }
    if table.rows.is_empty() { String::new() } else { table.html() }
}
