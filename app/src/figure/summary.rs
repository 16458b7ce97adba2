//! The figure of one episode.

use super::plot::{Curve, Plot, push_mark};
use super::svg::{Anchor, HAIRLINE, INK, RasterStyle, SOFT_INK, Stroke, Svg, Text, text_width};
use super::{PIXELS_PER_UNIT, nice_ticks};
use crate::colors::{self, Colormap, Rgb};
use crate::picture::{self, CellError, RgbImage, View};
use nudge_core::belief::Belief;
use nudge_core::episode::{EpisodeRecord, NO_TRUTH};
use nudge_core::plan::Action;
use nudge_core::scene::{Body, Catalog, ClassId};
use nudge_core::score::{Scores, Verdict};
use nudge_core::world::TruthMap;
use nudge_core::{Point, Result};
use std::collections::BTreeSet;

/// Belief and truth after a step.
#[derive(Clone, Copy)]
pub struct Moment<'a> {
    /// Number of actions so far; 0 is the prior.
    pub step: usize,
    /// What is believed.
    pub belief: &'a Belief,
    /// What is, if that is known.
    pub truth: Option<&'a TruthMap>,
}

/// What the figure of an episode is made from.
#[derive(Clone, Copy)]
pub struct Summary<'a> {
    /// Scene, policy, scores.
    pub record: &'a EpisodeRecord,
    /// Names and colours of the classes.
    pub catalog: &'a Catalog,
    /// The bodies before the first step.
    pub start: &'a [Body],
    /// The columns of maps: usually after the first, the middle and the last step. At most three are shown.
    pub moments: &'a [Moment<'a>],
    /// Another episode of the same scene, whose scores are drawn dashed beside this one's.
    pub beside: Option<&'a EpisodeRecord>,
}

const WIDTH: f32 = 1240.0;
const MARGIN: f32 = 32.0;
const PICTURE_WIDTH: f32 = 360.0;
const MAPS_LEFT: f32 = MARGIN + PICTURE_WIDTH + 30.0;
const LEGEND_WIDTH: f32 = 84.0;
const GAP: f32 = 12.0;
/// From a row's title to its maps.
const TITLE_HEIGHT: f32 = 38.0;
/// From a title's baseline down to what it names.
const TITLE_DROP: f32 = 9.0;
const PLOT_HEIGHT: f32 = 176.0;

/// The figure of an episode, [`PIXELS_PER_UNIT`] pixels per unit: 2480 pixels wide.
pub fn summary(summary: &Summary<'_>) -> Result<RgbImage> {
    draw(summary).render(PIXELS_PER_UNIT)
}

fn draw(summary: &Summary<'_>) -> Svg {
    let columns = summary.moments.len().clamp(1, 3) as f32;
    let map_width = (WIDTH - MARGIN - LEGEND_WIDTH - MAPS_LEFT - GAP * 3.0) / 3.0;
    let [w, d, _] = summary.record.scene.shelf.size;
    let map = [map_width, (map_width * d / w).min(1.2 * map_width)];
    let maps_top = 72.0;
    let maps_height = map_rows(summary) as f32 * (TITLE_HEIGHT + map[1]);
    let legend = class_legend(summary, WIDTH - 2.0 * MARGIN);
    let pictures_height = pictures_height(summary);
    let legend_top = maps_top + maps_height.max(pictures_height) + 20.0;
    let plots_top = legend_top + legend.height + 22.0;
    let mut svg = Svg::new([WIDTH, plots_top + PLOT_HEIGHT + 18.0]);
    title(&mut svg, summary);
    pictures(&mut svg, summary, maps_top);
    maps(&mut svg, summary, [MAPS_LEFT, maps_top], map, columns);
    legend.draw(&mut svg, [MARGIN, legend_top]);
    plots(&mut svg, summary, plots_top);
    svg
}

fn title(svg: &mut Svg, summary: &Summary<'_>) {
    let record = summary.record;
    svg.text(&Text::new(&record.scene.name, [MARGIN, 44.0], 23.0));
    let pushes = push_steps(record).len();
    let mut facts = vec![
        format!("policy {}", record.config.policy.name()),
        format!("{} belief", record.config.belief),
        format!("seed {}", record.config.seed),
        format!("{}, {}", count(record.steps.len(), "action"), count(pushes, "push")),
    ];
    if !record.has_truth() {
        facts.push(NO_TRUTH.to_owned());
    } else if let Some(last) = record.steps.last() {
        let of = |verdict: Verdict| last.objects().iter().filter(|object| object.verdict == verdict).count();
        facts.push(format!(
            "{}: {} found, {} misclassified, {} not found, {} hallucinated",
            count(record.scene.objects.len(), "object"),
            of(Verdict::Found),
            of(Verdict::Misclassified),
            of(Verdict::NotFound),
            of(Verdict::Hallucinated)
        ));
    }
    svg.text(&Text::new(facts.join("   ·   "), [MARGIN, 64.0], 12.5).colored(SOFT_INK));
}

fn count(number: usize, thing: &str) -> String {
    let plural = if thing.ends_with('h') { "es" } else { "s" };
    format!("{number} {thing}{}", if number == 1 { "" } else { plural })
}

/// Heights of the two pictures.
fn picture_heights(summary: &Summary<'_>) -> [f32; 2] {
    let shelf = &summary.record.scene.shelf;
    [View::Front, View::Above].map(|view| PICTURE_WIDTH / view.aspect(shelf))
}

fn pictures_height(summary: &Summary<'_>) -> f32 {
    picture_heights(summary).iter().map(|height| TITLE_HEIGHT + height).sum()
}

/// The scene before the first step from the front and from above, with the pushes as arrows.
fn pictures(svg: &mut Svg, summary: &Summary<'_>, top: f32) {
    let shelf = &summary.record.scene.shelf;
    let mut y = top;
    let views = [(View::Front, "Scene from the front"), (View::Above, "Scene from above")];
    for ((view, name), height) in views.into_iter().zip(picture_heights(summary)) {
        svg.text(&Text::new(name, [MARGIN, y + TITLE_HEIGHT - TITLE_DROP], 13.0));
        y += TITLE_HEIGHT;
        let pixels = [PICTURE_WIDTH, height].map(|n| (n * PIXELS_PER_UNIT).round() as u32);
        let raster = picture::of_bodies(shelf, summary.start, summary.catalog, view, pixels);
        svg.raster([MARGIN, y], [PICTURE_WIDTH, height], &raster, RasterStyle::Smooth);
        if view == View::Above {
            push_arrows(svg, summary, [MARGIN, y], height);
        }
        y += height;
    }
    if !push_steps(summary.record).is_empty() {
        let at = [MARGIN + PICTURE_WIDTH, y - picture_heights(summary)[1] - TITLE_DROP];
        svg.text(&Text::new("arrows: pushes by step", at, 11.0).anchored(Anchor::End).colored(SOFT_INK));
    }
}

/// The pushes on the picture from above.
fn push_arrows(svg: &mut Svg, summary: &Summary<'_>, [left, top]: [f32; 2], height: f32) {
    let eye = View::Above.eye(&summary.record.scene.shelf, PICTURE_WIDTH / height);
    let size = [PICTURE_WIDTH, height].map(|n| (n * 10.0) as u32);
    let place = |point: Point| {
        let [x, y] = eye.project(point, size);
        [left + x / 10.0, top + y / 10.0]
    };
    for step in &summary.record.steps {
        let Action::Manipulate(manipulation) = step.action else { continue };
        let arrow = manipulation.arrow();
        let (from, to) = (place(arrow.start), place(arrow.end()));
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.hypot(dy).max(1e-3);
        let (ux, uy) = (dx / length, dy / length);
        let neck = [to[0] - 8.0 * ux, to[1] - 8.0 * uy];
        let head = |grow: f32| {
            [
                [to[0] + grow * ux, to[1] + grow * uy],
                [neck[0] - (4.6 + grow) * uy - grow * ux, neck[1] + (4.6 + grow) * ux - grow * uy],
                [neck[0] + (4.6 + grow) * uy - grow * ux, neck[1] - (4.6 + grow) * ux - grow * uy],
            ]
        };
        svg.polygon(&head(1.6), [255; 3]);
        svg.line(from, neck, Stroke::new([255; 3], 5.2));
        svg.line(from, neck, Stroke::new(INK, 2.2));
        svg.polygon(&head(0.0), INK);
        let inside = |at: f32, low: f32, size: f32| at.clamp(low + 9.0, low + size - 9.0);
        let disc = [inside(from[0] - 8.0 * ux, left, PICTURE_WIDTH), inside(from[1] - 8.0 * uy, top, height)];
        svg.dot(disc, 7.4, INK);
        let number = Text::new(step.index.to_string(), [disc[0], disc[1] + 3.5], 9.8);
        svg.text(&number.anchored(Anchor::Middle).colored([255; 3]));
    }
}

/// Number of rows of maps: without a truth there is no error to show.
fn map_rows(summary: &Summary<'_>) -> usize {
    if summary.record.has_truth() { 3 } else { 2 }
}

/// Rows of semantic belief, entropy and error; a column for each moment.
fn maps(svg: &mut Svg, summary: &Summary<'_>, [left, top]: [f32; 2], map: [f32; 2], columns: f32) {
    let rows = &["Semantic belief", "Entropy", "Semantic error"][..map_rows(summary)];
    let legend = left + columns * (map[0] + GAP);
    for (row, name) in rows.iter().copied().enumerate() {
        let title = top + row as f32 * (TITLE_HEIGHT + map[1]);
        let y = title + TITLE_HEIGHT;
        svg.text(&Text::new(name, [left, y - TITLE_DROP], 13.0));
        for (column, moment) in summary.moments.iter().take(3).enumerate() {
            let x = left + column as f32 * (map[0] + GAP);
            let raster = match (row, moment.truth) {
                (0, _) => picture::paint_semantics(moment.belief, summary.catalog),
                (2.., Some(truth)) => picture::paint_errors(moment.belief, truth),
                _ => picture::paint_entropy(moment.belief),
            };
            svg.raster([x, y], map, &raster, RasterStyle::Cells);
            // Dark lines, with a light rim where the map itself can be dark.
            if let Some(truth) = moment.truth {
                if row == 1 {
                    outline(svg, truth, [x, y], map, Stroke::new([255; 3], 2.2).faint(0.5));
                }
                outline(svg, truth, [x, y], map, Stroke::new(INK, 0.9).faint(0.85));
            }
            svg.frame([x, y], map, Stroke::new(SOFT_INK, 0.7));
            if row == 0 {
                let at = [x + map[0], y - TITLE_DROP];
                let after = if moment.step == 0 {
                    "before the first step".into()
                } else {
                    format!("after step {}", moment.step)
                };
                svg.text(&Text::new(after, at, 11.5).anchored(Anchor::End).colored(SOFT_INK));
            }
        }
        match row {
            0 => semantic_key(svg, [legend, y]),
            1 => entropy_key(svg, summary, [legend, y], map[1]),
            _ => error_key(svg, [legend, y]),
        }
    }
}

/// The true objects' outlines over a map.
fn outline(svg: &mut Svg, truth: &TruthMap, [left, top]: [f32; 2], map: [f32; 2], stroke: Stroke) {
    let unit = [map[0] / truth.dims[0] as f32, map[1] / truth.dims[1] as f32];
    let place = |[x, y]: [usize; 2]| [left + x as f32 * unit[0], top + y as f32 * unit[1]];
    let lines: Vec<Vec<[f32; 2]>> = picture::outlines(truth).into_iter().map(|run| run.map(place).to_vec()).collect();
    svg.paths(&lines, stroke);
}

fn semantic_key(svg: &mut Svg, [x, y]: [f32; 2]) {
    for (line, words) in ["paler where", "less certain"].into_iter().enumerate() {
        svg.text(&Text::new(words, [x, y + 10.0 + 13.0 * line as f32], 10.5).colored(SOFT_INK));
    }
    svg.frame([x + 0.5, y + 40.5], [13.0, 10.0], Stroke::new(INK, 1.0));
    svg.text(&Text::new("true outline", [x + 19.0, y + 49.0], 10.5).colored(SOFT_INK));
}

fn entropy_key(svg: &mut Svg, summary: &Summary<'_>, [x, y]: [f32; 2], height: f32) {
    let Some(moment) = summary.moments.first() else { return };
    let [low, high] = picture::entropy_range(&moment.belief.grid);
    let bar = RgbImage::from_fn(1, 256, |_, row| image::Rgb(Colormap::Magma.rgb(1.0 - row as f32 / 255.0)));
    svg.raster([x, y], [11.0, height], &bar, RasterStyle::Smooth);
    for (value, label) in nice_ticks([f64::from(low), f64::from(high)], 4) {
        let at = y + height * (1.0 - (value as f32 - low) / (high - low));
        svg.line([x + 11.0, at], [x + 14.0, at], Stroke::new(SOFT_INK, 0.8));
        svg.text(&Text::new(label, [x + 18.0, at + 3.6], 10.5).colored(SOFT_INK));
    }
    for (line, words) in ["nats per", "floor cell"].into_iter().enumerate() {
        let at = [x + 36.0, y + 0.5 * height - 3.0 + 13.0 * line as f32];
        svg.text(&Text::new(words, at, 10.5).colored(SOFT_INK));
    }
}

fn error_key(svg: &mut Svg, [x, y]: [f32; 2]) {
    for (line, error) in CellError::ALL.into_iter().enumerate() {
        let at = y + 20.0 * line as f32;
        swatch(svg, [x, at], error.rgb());
        svg.text(&Text::new(error.title(), [x + 19.0, at + 9.6], 10.5).colored(SOFT_INK));
    }
}

fn swatch(svg: &mut Svg, at: [f32; 2], rgb: Rgb) {
    svg.rect(at, [13.0, 11.0], rgb);
    svg.frame(at, [13.0, 11.0], Stroke::new(colors::mix(rgb, INK, 0.35), 0.6));
}

/// A strip of swatches with names, wrapped to a width.
struct Legend {
    entries: Vec<(Rgb, String, [f32; 2])>,
    height: f32,
}

const LEGEND_PITCH: f32 = 20.0;

impl Legend {
    fn flow(entries: impl IntoIterator<Item = (Rgb, String)>, width: f32) -> Self {
        let mut placed = Vec::new();
        let (mut x, mut y) = (0.0, 0.0);
        for (rgb, name) in entries {
            let wide = 19.0 + text_width(&name, 12.0) + 22.0;
            if x > 0.0 && x + wide - 22.0 > width {
                (x, y) = (0.0, y + LEGEND_PITCH);
            }
            placed.push((rgb, name, [x, y]));
            x += wide;
        }
        Self { entries: placed, height: y + LEGEND_PITCH }
    }

    fn draw(&self, svg: &mut Svg, [left, top]: [f32; 2]) {
        for (rgb, name, [x, y]) in &self.entries {
            swatch(svg, [left + x, top + y], *rgb);
            svg.text(&Text::new(name, [left + x + 19.0, top + y + 10.0], 12.0));
        }
        let at = top + self.height + 4.0;
        svg.line([left, at], [WIDTH - MARGIN, at], Stroke::new(HAIRLINE, 0.8));
    }
}

/// The classes that the scene or a shown belief has, background, and unknown.
fn class_legend(summary: &Summary<'_>, width: f32) -> Legend {
    let mut present: BTreeSet<ClassId> = summary.start.iter().map(|body| body.class).collect();
    for moment in summary.moments {
        let cells = 0..moment.belief.grid.cell_count();
        present.extend(cells.filter_map(|cell| picture::believed_class(moment.belief, cell)));
    }
    present.remove(&nudge_core::scene::BACKGROUND);
    let classes = present.into_iter().chain([nudge_core::scene::BACKGROUND]);
    let mut entries: Vec<(Rgb, String)> = classes
        .map(|class| (colors::of_class(summary.catalog, class), colors::class_title(summary.catalog, class)))
        .collect();
    entries.push((colors::UNKNOWN_RGB, "unknown".to_owned()));
    Legend::flow(entries, width)
}

fn push_steps(record: &EpisodeRecord) -> Vec<usize> {
    let pushed = |action: &Action| matches!(action, Action::Manipulate(_));
    record.steps.iter().filter(|step| pushed(&step.action)).map(|step| step.index).collect()
}

/// What a curve shows of an episode after a number of actions, if it is known.
type Value<'a> = &'a dyn Fn(&EpisodeRecord, usize) -> Option<f64>;

fn values(record: &EpisodeRecord, value: Value<'_>) -> Vec<f64> {
    (0..=record.steps.len()).filter_map(|step| value(record, step)).collect()
}

/// The curves of occupancy IoU, semantic mIoU and entropy; without a truth that of entropy alone.
fn plots(svg: &mut Svg, summary: &Summary<'_>, top: f32) {
    let record = summary.record;
    let beside = summary.beside.map(|other| (other.config.policy.name(), other));
    let steps = summary.beside.map_or(0, |other| other.steps.len()).max(record.steps.len());
    // The episode itself, and the one beside it: the same colour, paler and dashed.
    let curves = |name: &str, rgb: Rgb, value: Value| -> Vec<Curve> {
        let own = if beside.is_some() { record.config.policy.name() } else { name };
        let mine = Curve { name: own.to_owned(), rgb, dash: [0.0; 2], values: values(record, value) };
        let other = beside.as_ref().map(|(policy, other)| Curve {
            name: (*policy).to_owned(),
            rgb: colors::mix(rgb, [255; 3], 0.35),
            dash: [5.0, 3.0],
            values: values(other, value),
        });
        std::iter::once(mine).chain(other).collect()
    };
    let pushes = push_steps(record);
    let marked: Vec<usize> = summary.moments.iter().map(|moment| moment.step).collect();
    let plot = |title: &str, curves: Vec<Curve>, range: [f64; 2]| Plot {
        title: title.to_owned(),
        curves,
        range,
        steps,
        pushes: pushes.clone(),
        marked: marked.clone(),
    };
    let most = (0..=record.steps.len()).map(|step| record.entropy_after(step)).fold(1.0, f64::max) / 1e3;
    let score =
        |value: fn(&Scores) -> f64| move |record: &EpisodeRecord, step: usize| record.scores_after(step).map(value);
    let mut occupancy = curves("mean", [31, 90, 150], &score(|s| s.occupancy_iou));
    if beside.is_none() {
        occupancy.extend(curves("occupied", [110, 168, 214], &score(|s| s.occupied_iou)));
    }
    let entropy = curves("", [140, 41, 129], &|record, step| Some(record.entropy_after(step) / 1e3));
    let mut plots = vec![
        plot("Occupancy IoU", occupancy, [0.0, 1.0]),
        plot("Semantic mIoU", curves("", [20, 120, 90], &score(|s| s.semantic_miou)), [0.0, 1.0]),
        plot("Map entropy, thousand nats", entropy, [0.0, most * 1.02]),
    ];
    if !record.has_truth() {
        plots.drain(..2);
    }
    let width = (WIDTH - 2.0 * MARGIN - 2.0 * 24.0) / 3.0;
    for (at, plot) in plots.iter().enumerate() {
        plot.draw(svg, [MARGIN + at as f32 * (width + 24.0), top], [width, PLOT_HEIGHT]);
    }
    if !pushes.is_empty() {
        let at = [WIDTH - MARGIN - 26.0, top + 6.5];
        push_mark(svg, [at[0] - 8.0, at[1] - 1.0]);
        svg.text(&Text::new("push", [at[0], top + 10.0], 11.0).colored(SOFT_INK));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn the_figure_of_an_episode_is_drawn() {
        let played = fixture::play(12);
        let moments =
            [1, 6, 12].map(|step| Moment { step, belief: &played.beliefs[step], truth: Some(&played.truths[step]) });
        let summary_of = Summary {
            record: &played.record,
            catalog: &played.catalog,
            start: &played.bodies[0],
            moments: &moments,
            beside: None,
        };
        let image = summary(&summary_of).expect("drawn");
        assert_eq!(image.width(), 2480);
        if let Some(kept) = std::env::var_os("NUDGE_KEEP") {
            image.save(std::path::Path::new(&kept).join("summary.png")).expect("saved");
        }
        // Another episode beside it adds its curves, and its name.
        let mut other = played.record.clone();
        other.config.policy = nudge_core::plan::PolicyKind::MemNoPush;
        other.steps.truncate(8);
        let both = draw(&Summary { beside: Some(&other), ..summary_of }).document();
        let alone = draw(&summary_of).document();
        let named = |document: &str| document.matches(">mem-no-push<").count();
        assert_eq!((named(&alone), named(&both)), (0, 3), "at the end of one curve a plot");
        // An episode without steps has a figure too.
        let mut empty = played.record.clone();
        empty.steps.clear();
        let prior = [Moment { step: 0, ..moments[0] }];
        summary(&Summary { record: &empty, moments: &prior, ..summary_of }).expect("drawn");
        // One without a truth shows the rest and says so once.
        let untold = fixture::without_truth(&played.record);
        let blind = moments.map(|moment| Moment { truth: None, ..moment });
        let drawn = draw(&Summary { record: &untold, moments: &blind, start: &[], ..summary_of }).document();
        assert_eq!(drawn.matches("no ground truth").count(), 1);
        assert!(!drawn.contains("mIoU") && drawn.contains("Map entropy") && !drawn.contains("Semantic error"));
    }
}
