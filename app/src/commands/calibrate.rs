//! `nudge calibrate`: how good and how well calibrated belief updates are on held-out scenes, against the number of views.

use super::progress::Progress;
use crate::driver::{belief_update, own};
use crate::figure::{Calibrated, PIXELS_PER_UNIT, VIEWS, VIEWS_AFTER_PUSH, Views, calibration, escape};
use crate::made_by;
use crate::picture;
use nudge_core::Error;
use nudge_core::belief::{BeliefUpdate, CLASSICAL, CNABU, Classical, NetworksUsed, mixed_parts};
use nudge_core::cnabu::{self, Scored};
use nudge_core::files::write_atomically;
use nudge_core::learn::{Dataset, MapSample, PushSample, evaluate, evaluate_after_pushes, evaluate_pushes};
use nudge_core::plan::PolicyKind;
use nudge_core::score::{Scores, Tally};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Held-out data of `nudge data maps`
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Held-out data of `nudge data pushes`: also score predictions on the floor cells that pushes change
    #[arg(long, value_name = "DIR")]
    pushes: Option<PathBuf>,
    /// Scenes of each to use
    #[arg(long, default_value_t = 300)]
    scenes: usize,
    /// Directory of the weights [default: where the shipped ones are]
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// Only these belief updates, beside the one with modules of your own, if there is one
    #[arg(long, value_delimiter = ',', default_value = "cnabu,classical")]
    beliefs: Vec<String>,
    #[command(flatten)]
    own: super::OwnArgs,
    /// Directory for the page and its figures
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON document instead of the table
    #[arg(long)]
    json: bool,
}

/// Scores after each number of views, from `first` on.
pub(super) fn scored(first: usize, tallies: &[Tally]) -> Vec<Scored> {
    let row = |(at, tally): (usize, &Tally)| {
        let scores = tally.scores();
        Scored {
            views: first + at,
            occupancy_iou: scores.occupancy_iou,
            occupied_iou: scores.occupied_iou,
            semantic_miou: scores.semantic_miou,
            mece_occupancy: scores.mece_occupancy,
            mece_semantics: scores.mece_semantics,
        }
    };
    tallies.iter().enumerate().map(row).collect()
}

/// A table of scores, one line per number of views.
pub(super) fn table(name: &str, scores: &[Scored]) -> String {
    let mut text = format!("{name:<10} views  occupancy IoU  occupied IoU  semantic mIoU  mECE occ.  mECE sem.\n");
    for s in scores {
        text += &format!(
            "{:<10} {:>5}  {:>13.3}  {:>12.3}  {:>13.3}  {:>9.3}  {:>9.3}\n",
            "", s.views, s.occupancy_iou, s.occupied_iou, s.semantic_miou, s.mece_occupancy, s.mece_semantics
        );
    }
    text
}

/// Runs the command.
///
/// # Errors
/// For data that is not there, weights that are missing or damaged, and what cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    args.own.choose()?;
    let mut data = Dataset::<MapSample>::open(&args.data)?;
    data.skipped().iter().for_each(|skipped| super::warn(&format!("skipped: {skipped}")));
    data.truncate(args.scenes);
    let mut pushes = args.pushes.as_deref().map(Dataset::<PushSample>::open).transpose()?;
    if let Some(pushes) = &mut pushes {
        pushes.skipped().iter().for_each(|skipped| super::warn(&format!("skipped: {skipped}")));
        pushes.truncate(args.scenes);
    }
    let mut results: Vec<(String, Vec<Tally>)> = Vec::new();
    let mut pushed = Pushed::default();
    let mut networks: Vec<(String, NetworksUsed)> = Vec::new();
    for name in args.beliefs.iter().cloned().chain(own::with_own(None)) {
        let update = update_of(&name, args)?;
        update.check_grid(&data.grid())?;
        networks.extend(update.networks_used().map(|used| (name.clone(), used)));
        let progress = Progress::new(format!("{name} on views"), data.len());
        let tallies = evaluate(&data, &*update, &mut |done| progress.at(done))?;
        progress.finish();
        results.push((name.clone(), tallies));
        if let Some(pushes) = &pushes {
            let progress = Progress::new(format!("{name} on pushes"), pushes.len());
            let tallies = evaluate_pushes(pushes, &*update, &*update, &mut |done| progress.at(done))?;
            progress.finish();
            pushed.predictions.push((name.clone(), tallies.predicted.scores()));
            pushed.predictions.push((format!("{name}, as if nothing had changed"), tallies.unchanged.scores()));
            let progress = Progress::new(format!("{name} on views after pushes"), pushes.len());
            let tallies = evaluate_after_pushes(pushes, &*update, &mut |done| progress.at(done))?;
            progress.finish();
            pushed.afterwards.push((name.clone(), tallies));
        }
        update.fault().map_or(Ok(()), Err)?;
    }
    let of_pushes = args
        .pushes
        .as_deref()
        .zip(pushes.as_ref())
        .map(|(directory, pushes)| Source { directory, scenes: pushes.len() });
    let of_views = Source { directory: &args.data, scenes: data.len() };
    let page = args.out.as_deref();
    let page = page.map(|out| write_page(out, of_views, &results, of_pushes, &pushed, &networks)).transpose()?;
    if args.json {
        let rows = |first: usize, of: &[(String, Vec<Tally>)]| -> Vec<serde_json::Value> {
            of.iter()
                .map(|(name, tallies)| {
                    serde_json::json!({ "belief": name, "scores": scored(first, tallies), "tallies": tallies })
                })
                .collect()
        };
        let predictions: Vec<_> = (pushed.predictions.iter())
            .map(|(name, scores)| serde_json::json!({ "prediction": name, "scores": scores }))
            .collect();
        return super::print(&super::to_json(&serde_json::json!({
            "data": args.data,
            "scenes": data.len(),
            "results": rows(VIEWS.first, &results),
            "networks": networks
                .iter()
                .map(|(name, used)| serde_json::json!({ "belief": name, "weights": used.weights, "modules": used.modules }))
                .collect::<Vec<_>>(),
            "changed_cells": predictions,
            "after_pushes": rows(VIEWS_AFTER_PUSH.first, &pushed.afterwards),
        }))?);
    }
    super::print(&format!("{}: {} scenes\n", args.data.display(), data.len()))?;
    for (name, used) in &networks {
        super::print(&format!("{name}: {}\n", words(used)))?;
    }
    for (name, tallies) in &results {
        super::print(&table(name, &scored(VIEWS.first, tallies)))?;
    }
    if !pushed.predictions.is_empty() {
        super::print("\nafter pushes, on the floor cells that change:  occupied IoU  semantic mIoU  mECE occ.\n")?;
        for (name, s) in &pushed.predictions {
            let line =
                format!("{name:<45} {:>13.3} {:>14.3} {:>10.3}\n", s.occupied_iou, s.semantic_miou, s.mece_occupancy);
            super::print(&line)?;
        }
        super::print("\nwhole map after a push and some views:\n")?;
        for (name, tallies) in &pushed.afterwards {
            super::print(&table(name, &scored(VIEWS_AFTER_PUSH.first, tallies)))?;
        }
    }
    page.map_or(Ok(()), |page| super::print(&format!("{}\n", page.display())))
}

/// The belief update of a name.
fn update_of(name: &str, args: &Args) -> anyhow::Result<Arc<dyn BeliefUpdate>> {
    match name {
        CLASSICAL => Ok(Arc::new(Classical)),
        CNABU => {
            let directory = args.models.clone().or_else(cnabu::models_dir);
            let missing = || Error::Usage("no weights found; --models DIR names them".to_owned());
            cnabu::compute_beside_rayon();
            let load = if args.pushes.is_some() { cnabu::load } else { cnabu::load_observation };
            Ok(load(&directory.ok_or_else(missing)?)?)
        }
        mixed if mixed_parts(mixed).is_some() => Ok(belief_update(Some(mixed), PolicyKind::Mem)?),
        other => anyhow::bail!("unknown belief \"{other}\"; there are cnabu, classical"),
    }
}

/// The networks of a belief update, and which of them are the user's own.
fn words(used: &NetworksUsed) -> String {
    let parts = made_by::networks(&used.weights, Some(&used.modules));
    parts.map(|(name, value)| format!("{name} {value}")).join("; ")
}

/// Scores on held-out pushes.
#[derive(Default)]
struct Pushed {
    /// By prediction: scores on the floor cells that pushes change.
    predictions: Vec<(String, Scores)>,
    /// By belief update: counts of the whole map after a push and so many views.
    afterwards: Vec<(String, Vec<Tally>)>,
}

/// The data that scores are of.
struct Source<'a> {
    directory: &'a Path,
    scenes: usize,
}

/// Writes `calibration.html` and `calibration.png` into a directory, with pushes `calibration-pushes.png` too; gives the
/// page's path.
fn write_page(
    out: &Path,
    of_views: Source<'_>,
    results: &[(String, Vec<Tally>)],
    of_pushes: Option<Source<'_>>,
    pushed: &Pushed,
    networks: &[(String, NetworksUsed)],
) -> Result<PathBuf, Error> {
    std::fs::create_dir_all(out).map_err(|error| Error::io(out, error))?;
    let title = format!("Belief updates on {} held-out scenes, random views", of_views.scenes);
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title>\n<style>body {{ font: 15px/1.5 \
         Ubuntu, sans-serif; color: #22242a; max-width: 1060px; margin: 2em auto }} td, th {{ padding: 0 1em 0 0; text-align: \
         right }} td:first-child, th:first-child {{ text-align: left }} svg {{ max-width: 100%; height: auto }} \
         svg text {{ font-family: Ubuntu, sans-serif }}</style></head>\
         <body>\n",
        escape(&title)
    );
    html += &section(&title, &of_views, &VIEWS, results, &out.join("calibration.png"))?;
    if let Some(source) = of_pushes {
        let title = format!("Beliefs after a push, first pushes of {} held-out scenes", source.scenes);
        let picture = out.join("calibration-pushes.png");
        html += &section(&title, &source, &VIEWS_AFTER_PUSH, &pushed.afterwards, &picture)?;
        html += "<h2>Predictions, on the floor cells that pushes change</h2>\n<table><tr><th>prediction</th>\
                 <th>occupied IoU</th><th>semantic mIoU</th><th>mECE occupancy</th></tr>\n";
        for (name, s) in &pushed.predictions {
            html += &row(&escape(name), &[s.occupied_iou, s.semantic_miou, s.mece_occupancy]);
        }
        html += "</table>\n";
    }
    for (name, used) in networks {
        html += &format!("<p>{}: {}</p>\n", escape(name), escape(&words(used)));
    }
    html += "</body></html>\n";
    let page = out.join("calibration.html");
    write_atomically(&page, html.as_bytes())?;
    Ok(page)
}

/// A figure, saved as `picture` too, and its numbers, as HTML.
fn section(
    title: &str,
    source: &Source<'_>,
    over: &Views,
    results: &[(String, Vec<Tally>)],
    picture: &Path,
) -> Result<String, Error> {
    let updates: Vec<Calibrated<'_>> = results.iter().map(|(name, tallies)| Calibrated { name, tallies }).collect();
    let figure = calibration(title, over, &updates);
    picture::save(&figure.render(PIXELS_PER_UNIT)?, picture)?;
    let data = escape(&source.directory.display().to_string());
    let mut html = format!("<h1>{}</h1>\n<p>Data: {data}</p>\n{}\n", escape(title), figure.document());
    for (name, tallies) in results {
        html += &format!(
            "<h2>{}</h2>\n<table><tr><th>{}</th><th>occupancy IoU</th><th>occupied IoU</th><th>semantic mIoU</th>\
             <th>mECE occupancy</th><th>mECE semantics</th></tr>\n",
            escape(name),
            over.name
        );
        for s in scored(over.first, tallies) {
            let numbers = [s.occupancy_iou, s.occupied_iou, s.semantic_miou, s.mece_occupancy, s.mece_semantics];
            html += &row(&s.views.to_string(), &numbers);
        }
        html += "</table>\n";
    }
    Ok(html)
}

fn row(name: &str, numbers: &[f64]) -> String {
    let cells: String = numbers.iter().map(|number| format!("<td>{number:.3}</td>")).collect();
    format!("<tr><td>{name}</td>{cells}</tr>\n")
}
