//! What a recording shows when it is opened: the shelf in three dimensions, floor maps, camera image, score curves,
//! and the decision in words.

use super::blueprint::{Layout, Part, View};
use super::eye::Eye;
use super::floor::ClassLegend;
use super::paths;
use crate::picture::FloorPlan;
use rerun::external::re_sdk_types::blueprint::{archetypes as bp, components as bpc};

/// The floor maps with a colour scale below them.
const SCALED: [&str; 4] =
    [paths::BELIEF_ENTROPY, paths::BELIEF_CERTAINTY, paths::PREDICTED_CHANGE, paths::PREDICTED_SURPRISE];

/// The layout for an episode recorded under `root`, on a floor plan of the given size.
pub fn standard(root: &str, plan: FloorPlan) -> Layout {
    let at = |path: &str| format!("{root}/{path}");
    let space = |name: &str, shown: &[&str]| {
        let always = [paths::SHELF, paths::SHELF_EDGES];
        Part::View(spatial(
            name,
            root,
            Eye::SHELF,
            Ground::Dark,
            always.iter().chain(shown).map(|path| at(path)).collect(),
        ))
    };
    let objects = "world/objects/**";
    let spaces = Part::Tabs(vec![
        space(
            "Belief",
            &[
                paths::BELIEF_OCCUPANCY,
                objects,
                paths::CAMERA_VIEWS,
                paths::CAMERA_CURRENT,
                paths::PUSH_CHOSEN,
                paths::PUSH_LINES,
            ],
        ),
        space(
            "Classes",
            &[paths::BELIEF_CLASSES, objects, paths::CAMERA_CURRENT, paths::PUSH_CHOSEN, paths::PUSH_LINES],
        ),
        space("Undecided", &[paths::BELIEF_OPEN, paths::BELIEF_OCCUPANCY, paths::CAMERA_CURRENT]),
        space("Gain", &[paths::GAIN_VOXELS, paths::GAIN_LABEL, objects, paths::CAMERA_VIEWS, paths::CAMERA_CURRENT]),
        space(
            "Pushes",
            &[
                paths::PUSH_CANDIDATES,
                paths::PUSH_CHOSEN,
                paths::PUSH_LINES,
                paths::PUSH_SWEPT,
                paths::BELIEF_OCCUPANCY,
                objects,
            ],
        ),
        Part::View(spatial("Robot", root, Eye::ROBOT, Ground::Dark, {
            let robot = [paths::CAMERA_REACH, paths::ROBOT_PATH, "robot/bodies/**", paths::CAMERA_CURRENT];
            let shelf =
                [paths::SHELF, paths::SHELF_EDGES, paths::PUSH_CHOSEN, paths::PUSH_LINES, paths::PUSH_SWEPT, objects];
            robot.iter().chain(&shelf).map(|path| at(path)).collect()
        })),
        space("Predicted", &[paths::PREDICTED_OCCUPANCY, paths::PUSH_CHOSEN, paths::PUSH_LINES, objects]),
        space("Truth", &[paths::TRUTH_OCCUPANCY]),
        space("Error", &[paths::ERROR_OCCUPANCY, objects]),
    ]);
    let map = |name: &str, path: &str, outline: bool| {
        let mut shown = vec![at(path), format!("{}/{}/**", at(path), paths::SCALE)];
        if outline {
            shown.push(at(paths::TRUTH_OUTLINES));
        }
        let [width, depth] = plan.size.map(|n| n as f64);
        let below = if SCALED.contains(&path) { 0.30 } else { 0.02 };
        let bounds = [[-0.01 * width, 1.01 * width], [-0.02 * depth, (1.0 + below) * depth]];
        Part::View(within(View::new("2D", name, root_or_slash(root), shown), bounds))
    };
    let legend = View::new("2D", "Legend", root_or_slash(root), [format!("{}/**", at(paths::CLASS_LEGEND))]);
    let legend = Part::View(within(legend, ClassLegend::BOUNDS));
    let left_maps = vec![
        (1.0, map("Semantic belief", paths::BELIEF_SEMANTICS, true)),
        (1.0, map("Entropy", paths::BELIEF_ENTROPY, false)),
    ];
    let error_maps = vec![
        map("Semantic error", paths::ERROR_SEMANTICS, true),
        map("Truth", paths::TRUTH_LABELS, false),
        map("Predicted", paths::PREDICTED_SEMANTICS, false),
    ];
    let certainty_maps = vec![
        map("Certainty", paths::BELIEF_CERTAINTY, false),
        map("Predicted change", paths::PREDICTED_CHANGE, true),
        map("Surprise", paths::PREDICTED_SURPRISE, true),
    ];
    let right_maps = vec![(1.0, Part::Tabs(error_maps)), (1.0, Part::Tabs(certainty_maps))];
    let maps = Part::Row(vec![(1.0, Part::Column(left_maps)), (1.0, Part::Column(right_maps))]);
    let flat = |name: &str, path: &str| {
        Part::View(View::new("2D", name, root_or_slash(root), [at(path), format!("{}/**", at(path))]))
    };
    let camera = Part::Row(vec![
        (1.0, flat("Labels", paths::OBSERVATION_LABELS)),
        (1.0, flat("Depth", paths::OBSERVATION_DEPTH)),
        (1.4, flat("Gain of views by target", paths::GAIN_VIEWS)),
    ]);
    let page = |name: &str, path: &str| Part::View(View::new("TextDocument", name, &at(path), [at(path)]));
    let words = Part::Tabs(vec![
        page("Decision", paths::DECISION),
        page("Verdicts", paths::VERDICTS),
        page("Notes", paths::NOTES),
        Part::View(View::new("TextLog", "Log", &at(paths::LOG), [at(paths::LOG)])),
    ]);
    let curves = |name: &str, corner: bpc::Corner2D, keys: &[&str]| {
        let shown: Vec<String> = keys.iter().map(|key| at(&paths::score(key))).collect();
        let legend = bp::PlotLegend::new().with_corner(corner);
        View::new("TimeSeries", name, root_or_slash(root), shown).with("PlotLegend", &legend)
    };
    let unit = bp::ScalarAxis::new().with_range([0.0, 1.0]);
    let scores = Part::Row(vec![
        (
            1.0,
            Part::View(
                curves(
                    "IoU",
                    bpc::Corner2D::LeftTop,
                    &["occupancy_iou", "occupied_iou", "semantic_miou", paths::SCORE_PUSH],
                )
                .with("ScalarAxis", &unit),
            ),
        ),
        (
            1.0,
            Part::Tabs(vec![
                Part::View(curves("Entropy, nats", bpc::Corner2D::LeftBottom, &["entropy_nats", paths::SCORE_PUSH])),
                Part::View(curves(
                    "Calibration error",
                    bpc::Corner2D::LeftBottom,
                    &["mece_occupancy", "mece_semantics", paths::SCORE_PUSH],
                )),
            ]),
        ),
    ]);
    let left = Part::Column(vec![(2.7, spaces), (1.0, scores)]);
    let right = Part::Column(vec![(1.3, maps), (0.46, legend), (0.75, camera), (1.0, words)]);
    Layout { root: Part::Row(vec![(1.25, left), (1.0, right)]) }
}

/// A plane view that shows x and y from and to.
fn within(view: View, [x, y]: [[f64; 2]; 2]) -> View {
    let bounds = rerun::datatypes::Range2D { x_range: x.into(), y_range: y.into() };
    view.with("VisualBounds2D", &bp::VisualBounds2D::new(bounds))
}

fn root_or_slash(root: &str) -> &str {
    if root.is_empty() { "/" } else { root }
}

/// What is behind the things in three dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ground {
    /// For screens.
    Dark,
    /// For print.
    #[cfg_attr(not(feature = "workbench"), allow(dead_code, reason = "recordings are dark; the window chooses"))]
    Light,
}

impl Ground {
    /// The colour of the ground, and of the grid on it.
    fn rgb(self) -> [[u8; 3]; 2] {
        match self {
            Self::Dark => [[30, 32, 38], [74, 77, 86]],
            Self::Light => [[250, 250, 251], [206, 209, 215]],
        }
    }
}

/// A view into the shelf from the robot's side, slightly above, with a 10 cm grid on the board.
pub(crate) fn spatial(name: &str, root: &str, eye: Eye, ground: Ground, contents: Vec<String>) -> View {
    let eye = bp::EyeControls3D::new()
        .with_kind(bpc::Eye3DKind::Orbital)
        .with_position(eye.position)
        .with_look_target(eye.target)
        .with_eye_up([0.0, 0.0, 1.0]);
    let [ground, line] = ground.rgb();
    let grid = bp::LineGrid3D::new()
        .with_visible(true)
        .with_spacing(0.1)
        .with_plane(rerun::components::Plane3D::XY)
        .with_stroke_width(0.6)
        .with_color(rerun::Color::from(line));
    let background = bp::Background::new(bpc::BackgroundKind::SolidColor).with_color(rerun::Color::from(ground));
    View::new("3D", name, root_or_slash(root), contents)
        .with("EyeControls3D", &eye)
        .with("LineGrid3D", &grid)
        .with("Background", &background)
}
