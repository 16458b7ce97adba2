//! The scenes that went worst and best, with pictures and the way back to their episodes.

use super::results::{Cell, Finished, Metric, Results};
use super::tables::reference;
use crate::bench::EpisodeId;
use crate::figure::{RasterStyle, Svg, escape};
use crate::picture::{self, View};
use crate::planner_args;
use nudge_core::Result;
use nudge_core::camera::NoiseModel;
use nudge_core::scene::{Catalog, ObjectId};
use nudge_core::score::{mean, scores_without};
use std::path::{Path, PathBuf};

/// Whether episodes have pages of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pages {
    /// Those of the scenes that are shown, where they were recorded.
    Made,
    /// None.
    Left,
}

/// How many scenes of each end are shown.
const SHOWN: usize = 3;
/// Width of a picture, pixels.
const WIDTH: u32 = 360;

/// What a set holds that no view shows, and how well a map can be that lacks it, in words.
pub fn without_hidden(results: &Results, set: usize, catalog: &Catalog) -> Result<String> {
    let scenes = &results.plan.sets[set].scenes;
    let (mut hidden, mut iou, mut miou) = (Vec::new(), Vec::new(), Vec::new());
    for (at, plan) in scenes.iter().enumerate() {
        let cells = results.policies(set).into_iter().map(|(_, _, cell)| cell);
        let Some(finished) = cells.filter_map(|cell| cell.scenes.get(&at)?.first()).next() else { continue };
        let missing: Vec<ObjectId> = finished.result.hidden.iter().copied().map(ObjectId).collect();
        let scores = scores_without(&plan.scene.grid(), &plan.scene.bodies(catalog)?, &missing);
        hidden.push(missing.len() as f64);
        iou.push(Metric::OccupancyIou.of(&scores));
        miou.push(Metric::SemanticMiou.of(&scores));
    }
    Ok(format!(
        "At the start no view shows {:.1} objects of a scene. A perfect map that lacks them has occupancy IoU {:.3} and \
         semantic mIoU {:.3} (means over {} scenes): what is beyond that has to be pushed free, or guessed.",
        mean(&hidden),
        mean(&iou),
        mean(&miou),
        hidden.len()
    ))
}

/// The scenes that went worst and best, each with its mean mIoU at the end.
fn worst_and_best(results: &Results, cell: &Cell) -> [(&'static str, Vec<(usize, f64)>); 2] {
    let budget = results.plan.budget;
    let mut order: Vec<(usize, f64)> =
        cell.by_scene(|result| Metric::SemanticMiou.of(result.scores(budget))).into_iter().collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let worst = order.len().min(SHOWN);
    let best = (order.len() - worst).min(SHOWN);
    [("Worst", order[..worst].to_vec()), ("Best", order[order.len() - best..].to_vec())]
}

/// The recorded episodes of the scenes that [`extremes`] shows.
pub fn recorded(results: &Results, set: usize) -> Vec<&Finished> {
    let Some(cell) = results.cell(set, reference(results)) else { return Vec::new() };
    let shown = worst_and_best(results, cell).into_iter().flat_map(|(_, scenes)| scenes);
    let episodes = shown.flat_map(|(scene, _)| &cell.scenes[&scene]);
    episodes.filter(|finished| finished.recording.is_some()).collect()
}

/// Where the page of an episode lies, seen from the report.
pub fn page_of(results: &Results, id: EpisodeId) -> PathBuf {
    let mut page = Path::new("pages").join(results.plan.place(id)).into_os_string();
    page.push(".html");
    page.into()
}

/// A path as the address of a link.
fn address(path: &Path) -> String {
    let marks = [('%', "%25"), (' ', "%20"), ('#', "%23"), ('?', "%3F")];
    let path = path.to_string_lossy().into_owned();
    escape(&marks.iter().fold(path, |path, (mark, code)| path.replace(*mark, code)))
}

/// The worst and the best scenes of a set for the reference policy. `bench_from_page` leads from the page to the bench's
/// directory.
pub fn extremes(
    results: &Results,
    set: usize,
    catalog: &Catalog,
    bench_from_page: &Path,
    pages: Pages,
) -> Result<String> {
    let at = reference(results);
    let Some(cell) = results.cell(set, at) else { return Ok(String::new()) };
    let policy = results.plan.policies[at].policy;
    let budget = results.plan.budget;
    let value = |finished: &Finished| Metric::SemanticMiou.of(finished.result.scores(budget));
    let mut html = String::new();
    for (title, scenes) in worst_and_best(results, cell).into_iter().filter(|(_, scenes)| !scenes.is_empty()) {
        html += &format!("<h3>{title} scenes for {policy}, by semantic mIoU at the end</h3>\n<div class=\"cards\">\n");
        for (scene, miou) in scenes {
            let plan = &results.plan.sets[set].scenes[scene];
            let picture = picture::thumbnail(&plan.scene, catalog, View::Above, WIDTH)?;
            let size = [picture.width() as f32, picture.height() as f32];
            let mut svg = Svg::new(size);
            svg.raster([0.0, 0.0], size, &picture, RasterStyle::Smooth);
            html += &format!(
                "<section class=\"card\">{}<h4>{}</h4><p>{}</p><p>mIoU {miou:.3}</p><ul>",
                svg.document(),
                escape(&plan.id),
                escape(&plan.scene.description)
            );
            for finished in &cell.scenes[&scene] {
                html += &format!("<li>seed {}: mIoU {:.3}, ", finished.id.seed, value(finished));
                if pages == Pages::Made && finished.recording.is_some() {
                    let page = page_of(results, finished.id);
                    html += &format!("<a href=\"{}\">page</a>, ", address(&page));
                }
                html += &way_back(results, finished, &plan.file, bench_from_page);
                html += "</li>";
            }
            html += "</ul></section>\n";
        }
        html += "</div>\n";
    }
    Ok(html)
}

/// A link to the recording, or the command that makes it again.
fn way_back(results: &Results, finished: &Finished, file: &str, bench_from_page: &Path) -> String {
    if let Some(recording) = &finished.recording {
        let path = bench_from_page.join(recording);
        let link = |name: &str| address(&path.join(name));
        return format!(
            "<a href=\"{}\">summary</a>, <a href=\"{}\">recording</a>",
            link(crate::driver::SUMMARY),
            link(crate::driver::RECORDING)
        );
    }
    let (result, plan) = (&finished.result, &results.plan);
    let views = match plan.views.as_str() {
        "standard300" => String::new(),
        other => format!(" --views {other}"),
    };
    let noise = plan.noise.map_or(String::new(), |noise| format!(" --noise {}", NoiseModel::name_of(Some(noise))));
    format!(
        "<code>nudge run {} --policy {} --belief {} --seed {} --budget {}{}{}{}</code>",
        escape(file),
        result.policy,
        escape(&result.belief),
        result.seed,
        result.budget,
        escape(&views),
        escape(&noise),
        planner_args::to_type(plan.planner_of(finished.id.policy), &result.belief)
    )
}
