//! Floor maps, their scales, and the heat maps of the views, for two-dimensional views.

use super::paths;
use super::shapes::segmentation;
use crate::colors::{self, Colormap, Rgb};
use crate::picture::{self, FloorPlan, RgbImage};
use nudge_core::belief::{Belief, MOST_SURPRISING, Prediction};
use nudge_core::camera::ViewArray;
use nudge_core::grid::Grid;
use nudge_core::plan::{Action, Decision};
use nudge_core::scene::{BACKGROUND, CLASS_COUNT, Catalog, ClassId, OBJECT_CLASS_COUNT};
use nudge_core::world::TruthMap;

/// The id in label images of what is not known; the viewer has no colour for the largest 8-bit id.
const UNKNOWN: u8 = CLASS_COUNT as u8;

/// Names and colours of the class ids in label images.
pub fn class_names(catalog: &Catalog) -> rerun::AnnotationContext {
    let classes = (0..OBJECT_CLASS_COUNT as u8).map(ClassId).chain([BACKGROUND]);
    let mut entries: Vec<(u16, String, Rgb)> = classes
        .map(|class| (u16::from(class.0), colors::class_title(catalog, class), colors::of_class(catalog, class)))
        .collect();
    entries.push((u16::from(UNKNOWN), "unknown".to_owned(), colors::UNKNOWN_RGB));
    rerun::AnnotationContext::new(
        entries.iter().map(|(id, name, [r, g, b])| (*id, name.as_str(), rerun::Rgba32::from_rgb(*r, *g, *b))),
    )
}

/// Entries of the legend in a row, and how far they are apart against its rows: a name is wider than high.
const LEGEND_COLUMNS: usize = 6;
const LEGEND_COLUMN: f32 = 5.0;
/// Where an entry's name is, seen from its colour. Rerun draws labels below their point.
const LEGEND_NAME: [f32; 2] = [2.45, -0.75];

/// The classes' colours and their names beside them.
pub struct ClassLegend {
    /// A dot for each class.
    pub colors: rerun::Points2D,
    /// The names, in a colour that reads on any of the viewer's own.
    pub names: rerun::Points2D,
}

impl ClassLegend {
    /// What a view has to show of it, x and y from and to: a wide strip.
    pub const BOUNDS: [[f64; 2]; 2] = {
        let rows = (OBJECT_CLASS_COUNT + 2).div_ceil(LEGEND_COLUMNS);
        [[-0.5, LEGEND_COLUMNS as f64 * LEGEND_COLUMN as f64 - 0.5], [-0.7, rows as f64 - 0.3]]
    };

    /// The legend of a catalogue.
    pub fn new(catalog: &Catalog) -> Self {
        let classes = (0..OBJECT_CLASS_COUNT as u8).map(ClassId).chain([BACKGROUND]);
        let mut entries: Vec<(String, Rgb)> =
            classes.map(|class| (colors::class_title(catalog, class), colors::of_class(catalog, class))).collect();
        entries.push(("unknown".to_owned(), colors::UNKNOWN_RGB));
        let place = |at: usize| [(at % LEGEND_COLUMNS) as f32 * LEGEND_COLUMN, (at / LEGEND_COLUMNS) as f32];
        let beside = |at: usize| [place(at)[0] + LEGEND_NAME[0], place(at)[1] + LEGEND_NAME[1]];
        let count = entries.len();
        Self {
            colors: rerun::Points2D::new((0..count).map(place))
                .with_colors(entries.iter().map(|(_, rgb)| rerun::Color::from(*rgb)))
                .with_radii([rerun::Radius::new_ui_points(5.0)]),
            names: rerun::Points2D::new((0..count).map(beside))
                .with_colors([rerun::Color::from([190, 190, 195])])
                .with_labels(entries.iter().map(|(name, _)| name.as_str()))
                .with_show_labels(true)
                .with_radii([rerun::Radius::new_ui_points(0.0)]),
        }
    }
}

/// A coloured picture.
pub fn picture(picture: &RgbImage) -> rerun::Image {
    rerun::Image::from_rgb24(picture.as_raw().clone(), [picture.width(), picture.height()])
}

/// Labels by floor cell as an image.
pub fn labels(grid: &Grid, labels: &[u8]) -> rerun::SegmentationImage {
    let plan = FloorPlan::of(grid);
    segmentation(plan.cells().map(|cell| labels[cell]).collect(), plan.size.map(|n| n as u32))
}

/// The likeliest class per cell.
pub fn classes(belief: &Belief) -> rerun::SegmentationImage {
    let cells = 0..belief.grid.cell_count();
    let believed: Vec<u8> =
        cells.map(|cell| picture::believed_class(belief, cell).map_or(UNKNOWN, |class| class.0)).collect();
    labels(&belief.grid, &believed)
}

/// The likeliest class's probability per cell (viridis).
pub fn certainty(belief: &Belief) -> rerun::Image {
    picture(&picture::paint_certainty(belief))
}

/// Classes after a push where it can reach, unknown elsewhere.
pub fn predicted_classes(grid: &Grid, prediction: &Prediction) -> rerun::SegmentationImage {
    let mut believed = vec![UNKNOWN; grid.cell_count()];
    for (at, cell) in prediction.window.cells(grid).enumerate() {
        let a = &prediction.semantics[at];
        let best = (1..a.len()).fold(0, |best, k| if a[k] > a[best] { k } else { best });
        let untold = a.iter().all(|other| *other >= 0.95 * a[best]);
        believed[cell] = if untold { UNKNOWN } else { best as u8 };
    }
    labels(grid, &believed)
}

/// Probability per cell that a push changes it (viridis).
pub fn predicted_change(grid: &Grid, prediction: &Prediction) -> rerun::Image {
    let mut change = vec![0.0; grid.cell_count()];
    for (at, cell) in prediction.window.cells(grid).enumerate() {
        change[cell] = prediction.change[at];
    }
    picture(&picture::paint(grid, |cell| Colormap::Viridis.rgb(change[cell])))
}

/// The true objects' outlines over a floor map.
pub fn outlines(truth: &TruthMap) -> rerun::LineStrips2D {
    let runs = picture::outlines(truth).into_iter().map(|run| run.map(|[x, y]| [x as f32, y as f32]));
    rerun::LineStrips2D::new(runs)
        .with_colors([rerun::Color::from([20, 20, 24])])
        .with_radii([rerun::Radius::new_ui_points(0.6)])
        .with_draw_order(20.0)
}

/// A colour scale below a floor map.
pub struct Scale {
    /// The colours.
    pub bar: rerun::LineStrips2D,
    /// The numbers.
    pub labels: rerun::Points2D,
}

/// The scales of the floor maps that have one, by the map's path.
pub fn legends(grid: &Grid) -> Vec<(&'static str, Scale)> {
    let nats = picture::entropy_range(grid)[1];
    vec![
        (paths::BELIEF_ENTROPY, scale(grid, Colormap::Magma, ["0", &format!("{nats:.0} nats")])),
        (paths::BELIEF_CERTAINTY, scale(grid, Colormap::Viridis, ["0", "1"])),
        (paths::PREDICTED_CHANGE, scale(grid, Colormap::Viridis, ["0", "1"])),
        (paths::PREDICTED_SURPRISE, scale(grid, Colormap::Magma, ["0", &format!("{MOST_SURPRISING:.1} nats")])),
    ]
}

fn scale(grid: &Grid, map: Colormap, ends: [&str; 2]) -> Scale {
    const STEPS: usize = 64;
    let [width, depth] = FloorPlan::of(grid).size.map(|n| n as f32);
    let (left, right, y) = (0.30 * width, 0.70 * width, depth + 0.085 * depth);
    let x = |at: usize| left + (right - left) * at as f32 / STEPS as f32;
    let bar = rerun::LineStrips2D::new((0..STEPS).map(|at| [[x(at), y], [x(at + 1), y]]))
        .with_colors((0..STEPS).map(|at| rerun::Color::from(map.rgb((at as f32 + 0.5) / STEPS as f32))))
        .with_radii([0.022 * depth]);
    let labels = rerun::Points2D::new([[left - 0.07 * width, y], [right + 0.09 * width, y]])
        .with_labels(ends)
        .with_show_labels(true)
        .with_radii([0.01_f32])
        .with_colors([rerun::Color::from([210, 212, 218])]);
    Scale { bar, labels }
}

/// Where a view is in the heat maps: one map per look-at target, side by side with a gap, highest row on top.
fn heat_pixel(array: &ViewArray, slot: [u16; 3]) -> [usize; 2] {
    let [columns, rows, _] = array.layout;
    let [column, row, target] = slot.map(usize::from);
    [target * (columns + 1) + column, rows - 1 - row.min(rows - 1)]
}

/// The views' gains as heat maps (cividis), one per look-at target.
pub fn gain_map(array: &ViewArray, gains: &[f32], range: [f32; 2]) -> rerun::Image {
    let [columns, rows, targets] = array.layout;
    let size = [(targets * (columns + 1)).saturating_sub(1).max(1), rows.max(1)];
    let mut heat = RgbImage::from_pixel(size[0] as u32, size[1] as u32, image::Rgb([38, 40, 46]));
    for (view, gain) in array.views.iter().zip(gains) {
        let [x, y] = heat_pixel(array, view.slot);
        if x < size[0] && y < size[1] {
            heat.put_pixel(x as u32, y as u32, image::Rgb(Colormap::Cividis.of(*gain, range)));
        }
    }
    picture(&heat)
}

/// Frames around the views that were weighed as the best pair; the one that is looked from is white.
pub fn chosen_views(array: &ViewArray, decision: &Decision) -> rerun::LineStrips2D {
    let looked = match decision.action {
        Action::Look { view } => Some(view),
        Action::Manipulate(_) => None,
    };
    let ids = decision.pair.iter().copied().filter(|id| Some(*id) != looked).chain(looked);
    let shown: Vec<_> = ids.filter_map(|id| Some((id, array.views.get(usize::from(id.0))?))).collect();
    let frames = shown.iter().map(|(_, view)| {
        let [x, y] = heat_pixel(array, view.slot).map(|at| at as f32);
        [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0], [x, y]]
    });
    let colors = shown.iter().map(|(id, _)| {
        let rgb = if Some(*id) == looked { [255, 255, 255] } else { [255, 112, 67] };
        rerun::Color::from(rgb)
    });
    rerun::LineStrips2D::new(frames)
        .with_colors(colors)
        .with_radii([rerun::Radius::new_ui_points(1.2)])
        .with_draw_order(30.0)
}
