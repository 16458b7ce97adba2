//! The page itself: everything in one file, legible on a phone and on paper.

use super::charts::{self, Figure, SIZE};
use super::results::Results;
use super::{scenes, tables};
use crate::bench::{Plan, SetPlan};
use crate::figure::{PIXELS_PER_UNIT, escape};
use crate::picture;
use nudge_core::files::write_atomically;
use nudge_core::scene::Catalog;
use nudge_core::{Error, Result};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const STYLE: &str = include_str!("page.css");
/// Name of the page's file.
const INDEX: &str = "index.html";

/// A page and its charts, ready to be written.
pub struct Page {
    html: String,
    charts: Vec<(String, Vec<u8>)>,
}

impl Page {
    /// Makes the page of a bench. `bench_from_page` leads from the page to the bench's directory, for links.
    ///
    /// # Errors
    /// When a picture cannot be drawn.
    pub fn new(results: &Results, bench_from_page: &Path) -> Result<Self> {
        let catalog = Catalog::standard();
        let plan = &results.plan;
        let mut charts = Vec::new();
        let mut body = head(results);
        for (set, in_set) in plan.sets.iter().enumerate() {
            if results.policies(set).is_empty() {
                continue;
            }
            body += &set_title(in_set);
            body += &scenes::without_hidden(results, set, &catalog)?;
            body += "<div class=\"figures\">\n";
            for Figure { name, caption, chart } in charts::of_set(results, set) {
                let svg = chart.svg(SIZE);
                let label = escape(&chart.title);
                let drawing =
                    svg.document().replacen("<svg ", &format!("<svg role=\"img\" aria-label=\"{label}\" "), 1);
                body += &format!("<figure>{drawing}<figcaption>{caption}</figcaption></figure>\n");
                charts.push((name, picture::png(&svg.render(PIXELS_PER_UNIT)?)));
            }
            body += "</div>\n";
            body += &tables::against_oracle(results, set);
            body += &tables::scores(results, set);
            body += &tables::differences(results, set);
            body += &tables::actions(results, set);
            body += &tables::verdicts(results, set);
            body += &scenes::extremes(results, set, &catalog, bench_from_page)?;
        }
        let across = tables::across_sets(results);
        if !across.is_empty() {
            body += &format!("<h2>Out of distribution</h2>\n{across}");
        }
        body += &colophon(results);
        let html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <link rel=\"icon\" href=\"data:,\">\n\
             <title>Nudge bench: {}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
            escape(&set_names(plan))
        );
        Ok(Self { html, charts })
    }
}

fn set_names(plan: &Plan) -> String {
    plan.sets.iter().map(|set| set.name.as_str()).collect::<Vec<_>>().join(", ")
}

fn count(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

fn head(results: &Results) -> String {
    let plan = &results.plan;
    let scenes: usize = plan.sets.iter().map(|set| set.scenes.len()).sum();
    let mut html = format!(
        "<h1>Nudge bench: {}</h1>\n<p>{}, {} and {} in {} of {}. A value is averaged over a scene's seeds first, then over \
         scenes.</p>\n",
        escape(&set_names(plan)),
        count(scenes, "scene"),
        if plan.policies.len() == 1 { "one policy".to_owned() } else { format!("{} policies", plan.policies.len()) },
        count(plan.seeds as usize, "seed"),
        count(plan.episodes().len(), "episode"),
        count(plan.budget, "action"),
    );
    if results.missing > 0 {
        let all = plan.episodes().len();
        html += &format!(
            "<p class=\"warning\">Unfinished: {} of {all} episodes are missing from everything below.</p>\n",
            results.missing
        );
    }
    if let Some(shard) = plan.shard {
        html += &format!("<p class=\"warning\">This is shard {shard} only.</p>\n");
    }
    for broken in &plan.broken {
        html += &format!("<p class=\"warning\">Left out: {}</p>\n", escape(&broken.error));
    }
    let beliefs: BTreeSet<&str> = plan.policies.iter().map(|policy| policy.belief.as_str()).collect();
    if beliefs.len() > 1 {
        let each: Vec<String> =
            plan.policies.iter().map(|p| format!("{} on the {} belief", p.policy, escape(&p.belief))).collect();
        html += &format!("<p>{}.</p>\n", each.join(", "));
    } else if let Some(belief) = beliefs.first() {
        html += &format!("<p>All policies on the {} belief.</p>\n", escape(belief));
    }
    html
}

fn set_title(set: &SetPlan) -> String {
    format!("<h2>{} <small>{}</small></h2>\n", escape(&set.name), count(set.scenes.len(), "scene"))
}

fn colophon(results: &Results) -> String {
    let plan = &results.plan;
    format!(
        "<footer><p>nudge {}, views {}, {} push candidates, format {}. Scores are of the volume below 0.27 m. Intervals: \
         percentile bootstrap over scenes, {} resamples (1,000 for bands).</p></footer>\n",
        escape(&plan.version),
        escape(&plan.views),
        plan.planner.candidates,
        plan.format,
        nudge_core::score::RESAMPLES
    )
}

/// Writes the report of the bench in `bench` into `out`: the page last. Returns the page's path.
///
/// # Errors
/// What [`Results::read`] refuses, and what cannot be written; nothing is written before everything has been made.
pub fn write(bench: &Path, out: &Path, partial: bool) -> Result<PathBuf> {
    let results = Results::read(bench, partial)?;
    let page = Page::new(&results, &way(bench, out)?)?;
    fs::create_dir_all(out).map_err(|error| Error::io(out, error))?;
    for (name, png) in &page.charts {
        write_atomically(&out.join(format!("{name}.png")), png)?;
    }
    let index = out.join(INDEX);
    write_atomically(&index, page.html.as_bytes())?;
    Ok(index)
}

/// The way from the page's folder to the bench: `..` where the page lies inside it.
fn way(bench: &Path, out: &Path) -> Result<PathBuf> {
    if out.parent() == Some(bench) {
        return Ok(PathBuf::from(".."));
    }
    bench.canonicalize().map_err(|error| Error::io(bench, error))
}
