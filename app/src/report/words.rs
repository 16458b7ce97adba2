//! What a report says in sentences, the same on the page and in Markdown.

use super::results::Results;
use super::table::{Cell, Table};
use crate::bench::{AlsoMadeBy, Plan};
use crate::made_by::facts;
use std::collections::BTreeSet;

/// A paragraph in plain text.
pub enum Paragraph {
    /// To know.
    Plain(String),
    /// To be aware of.
    Warning(String),
}

/// The names of the sets.
pub fn set_names(plan: &Plan) -> String {
    plan.sets.iter().map(|set| set.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// `1 scene`, `25 scenes`.
pub fn count(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

/// What the bench consists of, and what is not as it should be.
pub fn head(results: &Results) -> Vec<Paragraph> {
    let plan = &results.plan;
    let scenes: usize = plan.sets.iter().map(|set| set.scenes.len()).sum();
    let all = plan.episodes().len();
    let mut head = vec![Paragraph::Plain(format!(
        "{}, {} and {} in {} of {}. A value is averaged over a scene's seeds first, then over scenes.",
        count(scenes, "scene"),
        if plan.policies.len() == 1 { "one policy".to_owned() } else { format!("{} policies", plan.policies.len()) },
        count(plan.seeds as usize, "seed"),
        count(all, "episode"),
        count(plan.budget, "action"),
    ))];
    if results.missing > 0 {
        let missing = results.missing;
        head.push(Paragraph::Warning(format!(
            "Unfinished: {missing} of {all} episodes are missing from everything below."
        )));
    }
    if let Some(shard) = plan.shard {
        head.push(Paragraph::Warning(format!("This is shard {shard} only.")));
    }
    for AlsoMadeBy { differs, .. } in plan.also_made_by.iter().filter(|also| also.mixed) {
        head.push(Paragraph::Warning(format!("Mixed: not all results were made alike: {}.", differs.join("; "))));
    }
    head.extend(plan.broken.iter().map(|broken| Paragraph::Warning(format!("Left out: {}", broken.error))));
    let beliefs: BTreeSet<&str> = plan.policies.iter().map(|policy| policy.belief.as_str()).collect();
    if beliefs.len() > 1 {
        let each: Vec<String> =
            plan.policies.iter().map(|p| format!("{} on the {} belief", p.policy, p.belief)).collect();
        head.push(Paragraph::Plain(format!("{}.", each.join(", "))));
    } else if let Some(belief) = beliefs.first() {
        head.push(Paragraph::Plain(format!("All policies on the {belief} belief.")));
    }
    head
}

/// What made the numbers.
pub fn made_by(plan: &Plan) -> Table {
    let mut table = Table::new("What made these numbers.", &["made by", ""]);
    let mut tell = |name: &str, value: String| table.rows.push(vec![Cell::new(name), Cell::new(value)]);
    match &plan.made_by {
        Some(made_by) => facts(made_by).into_iter().for_each(|(name, value)| tell(name, value)),
        None => tell("program", format!("nudge {}, which told no more", plan.version)),
    }
    for also in &plan.also_made_by {
        tell(if also.mixed { "mixed with" } else { "and" }, also.differs.join("; "));
    }
    tell("views", plan.views.clone());
    tell("format", plan.format.to_string());
    table
}

/// How numbers come about.
pub fn method() -> String {
    format!(
        "Scores are of the volume below 0.27 m. Intervals: percentile bootstrap over scenes, {} resamples (1,000 for bands).",
        nudge_core::score::RESAMPLES
    )
}
