//! The page itself: everything in one file, legible on a phone and on paper.

use super::charts::{self, Figure, SIZE};
use super::results::Results;
use super::scenes::Pages;
use super::words::{self, Paragraph, count};
use super::{picks, promises, scenes, tables};
use crate::bench::SetPlan;
use crate::figure::{PIXELS_PER_UNIT, escape};
use crate::picture;
use crate::share::{self, Source};
use nudge_core::files::write_atomically;
use nudge_core::scene::Catalog;
use nudge_core::{Error, Result};
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
    /// Makes the page of a bench. `bench_from_page` leads from the page to the bench's directory, for links; pages of
    /// episodes are linked where they are made.
    ///
    /// # Errors
    /// When a picture cannot be drawn.
    pub fn new(results: &Results, bench_from_page: &Path, pages: Pages) -> Result<Self> {
        let catalog = Catalog::standard();
        let plan = &results.plan;
        let mut charts = Vec::new();
        let mut body = head(results);
        for (set, in_set) in plan.sets.iter().enumerate() {
            if results.policies(set).is_empty() {
                continue;
            }
            body += &set_title(in_set);
            body += &format!("<p>{}</p>\n", escape(&scenes::without_hidden(results, set, &catalog)?));
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
            if let Some(sentence) = tables::against_oracle(results, set) {
                body += &format!("<p>{}</p>\n", escape(&sentence));
            }
            body += &tables::scores(results, set).html();
            body += &tables::differences(results, set).map_or(String::new(), |table| table.html());
            body += &tables::actions(results, set).html();
            body += &picks::ends(results, set).map_or(String::new(), |table| table.html());
            body += &picks::counted_twice(results, set).map_or(String::new(), |table| table.html());
            body += &promises::table(results, set).html();
            body += &tables::verdicts(results, set).html();
            body += &scenes::extremes(results, set, &catalog, bench_from_page, pages)?;
        }
        let across = tables::across_sets(results);
        if !across.is_empty() {
            let across: String = across.iter().map(|table| table.html()).collect();
            body += &format!("<h2>Out of distribution</h2>\n{across}");
        }
        body += &colophon(results);
        let html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <link rel=\"icon\" href=\"data:,\">\n\
             <title>Nudge bench: {}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
            escape(&words::set_names(plan))
        );
        Ok(Self { html, charts })
    }
}

fn head(results: &Results) -> String {
    let mut html = format!("<h1>Nudge bench: {}</h1>\n", escape(&words::set_names(&results.plan)));
    for paragraph in words::head(results) {
        html += &match paragraph {
            Paragraph::Plain(words) => format!("<p>{}</p>\n", escape(&words)),
            Paragraph::Warning(words) => format!("<p class=\"warning\">{}</p>\n", escape(&words)),
        };
    }
    html
}

fn set_title(set: &SetPlan) -> String {
    format!("<h2>{} <small>{}</small></h2>\n", escape(&set.name), count(set.scenes.len(), "scene"))
}

fn colophon(results: &Results) -> String {
    format!("<footer>{}<p>{}</p></footer>\n", words::made_by(&results.plan).html(), escape(&words::method()))
}

/// Writes the report of the results of the bench in `bench` into `out`: the page last. Returns the page's path.
///
/// # Errors
/// What cannot be written; nothing is written before everything has been made, but for the pages of episodes.
pub fn write(results: &Results, bench: &Path, out: &Path, pages: Pages) -> Result<PathBuf> {
    let page = Page::new(results, &way(bench, out)?, pages)?;
    if pages == Pages::Made {
        share_episodes(results, bench, out)?;
    }
    fs::create_dir_all(out).map_err(|error| Error::io(out, error))?;
    for (name, png) in &page.charts {
        write_atomically(&out.join(format!("{name}.png")), png)?;
    }
    let index = out.join(INDEX);
    write_atomically(&index, page.html.as_bytes())?;
    Ok(index)
}

/// Writes the pages of the episodes that the report links.
fn share_episodes(results: &Results, bench: &Path, out: &Path) -> Result<()> {
    for finished in (0..results.plan.sets.len()).flat_map(|set| scenes::recorded(results, set)) {
        let Some(recording) = &finished.recording else { continue };
        let page = out.join(scenes::page_of(results, finished.id));
        let folder = page.parent().unwrap_or(out);
        fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        share::write(&[Source::filed(&bench.join(recording))], &page, &|_| true)?;
    }
    Ok(())
}

/// The way from the page's folder to the bench: `..` where the page lies inside it.
fn way(bench: &Path, out: &Path) -> Result<PathBuf> {
    if out.parent() == Some(bench) {
        return Ok(PathBuf::from(".."));
    }
    bench.canonicalize().map_err(|error| Error::io(bench, error))
}
