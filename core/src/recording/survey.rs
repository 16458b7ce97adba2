//! The table of frames: which can be mapped, and why not the others.

use super::read::{depth, labels};
use super::{Board, Recording};
use crate::camera::Pinhole;
use crate::scene::Shelf;
use crate::{Error, Point, Pose, Result};
use rayon::prelude::*;

/// Only every so many rows and columns are asked where they are; odd, since cameras leave out every other one.
const SPARSE: usize = 3;
/// Within this of the shelf a point still counts as something of it, metres.
const NEAR_M: f32 = 0.01;
/// A camera that goes farther than this between two frames, and faster than [`FAST_M_PER_S`], or where no times are told ten
/// times as far as it mostly goes, jumps, metres.
const FAR_M: f32 = 0.3;
/// Faster than any hand or arm carries a camera, metres per second.
const FAST_M_PER_S: f64 = 3.0;
/// Median depths beyond these are not what a depth camera before a shelf gives, metres.
const LIKELY_M: [f32; 2] = [0.03, 15.0];

/// What becomes of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// It is mapped.
    Used {
        /// Share of its pixels that have a depth.
        with_depth: f32,
        /// Share of those that show the shelf or what is in it.
        in_shelf: f32,
        /// Whether it has labels.
        labelled: bool,
    },
    /// It is not, for this reason.
    Skipped(String),
}

/// A line of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What the frame is called in its recording.
    pub name: String,
    /// When it was taken, seconds of the recording's clock.
    pub time_s: Option<f64>,
    /// What becomes of it.
    pub fate: Fate,
    /// Its pose in the board's frame.
    pub board_from_camera: Option<Pose>,
}

/// All lines, in the recording's order.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// A line per frame.
    pub rows: Vec<Row>,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// What was found out about a frame's images.
struct Seen {
    row: Row,
    median_m: Option<f32>,
    /// Smallest and largest coordinates of what it shows, in the board's frame.
    bounds: Option<[Point; 2]>,
}

impl Survey {
    /// Positions of the frames that are mapped.
    pub fn used(&self) -> Vec<usize> {
        let is_used = |at: &usize| matches!(self.rows[*at].fate, Fate::Used { .. });
        (0..self.rows.len()).filter(is_used).collect()
    }

    /// Number of frames that are mapped and have labels.
    pub fn labelled(&self) -> usize {
        self.rows.iter().filter(|row| matches!(row.fate, Fate::Used { labelled: true, .. })).count()
    }
}

impl Recording {
    /// Reads every image once and says what becomes of each frame.
    ///
    /// # Errors
    /// Those of [`Recording::frame`]; where no frame can be mapped, what stands against it.
    pub fn survey(&self, board: &Board) -> Result<Survey> {
        let all = || (0..self.len()).into_par_iter();
        let seen: Vec<Seen> = all().map(|at| self.look_at(at, board)).collect::<Result<_>>()?;
        let mut warnings = self.warnings.clone();
        let medians: Vec<f32> = seen.iter().filter_map(|seen| seen.median_m).collect();
        let unit = unit_warning(median(medians));
        if !seen.iter().any(|seen| matches!(seen.row.fate, Fate::Used { .. })) {
            return Err(Error::input(&self.path, "", self.nothing_used(&seen, board, unit)));
        }
        warnings.extend(unit);
        let rows: Vec<Row> = seen.into_iter().map(|seen| seen.row).collect();
        warnings.extend(jumps(&rows));
        let survey = Survey { rows, warnings };
        let (used, labelled) = (survey.used().len(), survey.labelled());
        let mut survey = survey;
        if labelled > 0 && labelled < used {
            survey.warnings.push(format!("{} of {used} frames have no labels", used - labelled));
        }
        Ok(survey)
    }

    fn look_at(&self, at: usize, board: &Board) -> Result<Seen> {
        let entry = &self.entries[at];
        let board_from_camera = entry.pose.as_ref().ok().map(|pose| board.board_from_camera(pose));
        let row = |fate| Row { name: entry.name.clone(), time_s: entry.time_s, fate, board_from_camera };
        let skipped = |words: &str| Seen { row: row(Fate::Skipped(words.to_owned())), median_m: None, bounds: None };
        let pose = match (&entry.pose, board_from_camera) {
            (Err(words), _) => return Ok(skipped(words)),
            (_, None) => return Ok(skipped("no pose")),
            (Ok(_), Some(pose)) => pose,
        };
        let depth_m = match depth(entry, &self.settings)? {
            Ok(depth_m) => depth_m,
            Err(words) => return Ok(skipped(&words)),
        };
        let labelled = labels(entry, &self.settings)?.is_some();
        let points = sparse_points(&depth_m, &entry.camera, &pose);
        if points.is_empty() {
            return Ok(skipped("no depth: no pixel has any"));
        }
        let inside = points.iter().filter(|(point, _)| is_inside(&board.shelf, *point)).count();
        let with_depth = depth_m.iter().filter(|depth| **depth > 0.0).count() as f32 / depth_m.len() as f32;
        let in_shelf = inside as f32 / points.len() as f32;
        let fate = match inside {
            0 => Fate::Skipped("shows nothing of the shelf".to_owned()),
            _ => Fate::Used { with_depth, in_shelf, labelled },
        };
        let first = points[0].0;
        let bounds = points.iter().fold([first, first], |[low, high], (p, _)| [low.inf(p), high.sup(p)]);
        let median_m = median(points.iter().map(|(_, depth)| *depth).collect());
        Ok(Seen { row: row(fate), median_m, bounds: Some(bounds) })
    }

    /// Why no frame can be mapped, in one line.
    fn nothing_used(&self, seen: &[Seen], board: &Board, unit: Option<String>) -> String {
        let reasons =
            || seen.iter().filter_map(|seen| if let Fate::Skipped(why) = &seen.row.fate { Some(why) } else { None });
        let bounds = seen.iter().filter_map(|seen| seen.bounds).reduce(|a, b| [a[0].inf(&b[0]), a[1].sup(&b[1])]);
        let Some([low, high]) = bounds else {
            let first = reasons().next().map_or("", String::as_str);
            return format!("none of its {} frames can be mapped ({first})", seen.len());
        };
        let [w, d, h] = board.shelf.size;
        let range = |axis: usize| format!("{:.2} to {:.2}", low[axis], high[axis]);
        let unit = unit.map_or(String::new(), |words| format!(", {words}"));
        format!(
            "none of its {} frames shows anything of the shelf of {w} x {d} x {h} m: what they show lies at x {}, y {}, z {} m \
             from the middle of the board's front edge{unit}; --board FILE says where the board is, --find-board finds it",
            seen.len(),
            range(0),
            range(1),
            range(2)
        )
    }
}

/// Points that a frame shows with their depths: of every third row and column.
pub(super) fn sparse_points(depth_m: &[f32], camera: &Pinhole, pose: &Pose) -> Vec<(Point, f32)> {
    let (rotation, from) = (pose.rotation.to_rotation_matrix(), Point::from(pose.translation.vector));
    let mut points = Vec::new();
    for row in (SPARSE / 2..camera.height.max(SPARSE)).step_by(SPARSE) {
        for column in (SPARSE / 2..camera.width.max(SPARSE)).step_by(SPARSE) {
            let (row, column) = (row.min(camera.height - 1), column.min(camera.width - 1));
            let depth = depth_m[row * camera.width + column];
            if depth > 0.0 {
                points.push((from + rotation * camera.ray(column, row) * depth, depth));
            }
        }
    }
    points
}

fn is_inside(shelf: &Shelf, point: Point) -> bool {
    let (min, max) = (shelf.min(), shelf.max());
    (0..3).all(|axis| (min[axis] - NEAR_M..=max[axis] + NEAR_M).contains(&point[axis]))
}

pub(super) fn median(mut values: Vec<f32>) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

fn unit_warning(median_m: Option<f32>) -> Option<String> {
    let median_m = median_m?;
    let [low, high] = LIKELY_M;
    let hint = if median_m > high { "; are these millimetres? --depth-unit 0.001 says so" } else { "" };
    let unlikely = !(low..=high).contains(&median_m);
    unlikely.then(|| format!("half of what the depth images show is farther away than {median_m:.3} m{hint}"))
}

/// Places where the camera jumps, in one line.
fn jumps(rows: &[Row]) -> Option<String> {
    let posed: Vec<(&Row, Point)> =
        rows.iter().filter_map(|row| Some((row, Point::from(row.board_from_camera?.translation.vector)))).collect();
    let steps: Vec<f32> = posed.windows(2).map(|pair| (pair[1].1 - pair[0].1).norm()).collect();
    let usual = median(steps.clone())?;
    let is_jump = |at: &usize| {
        let (before, after) = (posed[*at].0, posed[*at + 1].0);
        let fast = match (before.time_s, after.time_s) {
            (Some(before), Some(after)) => f64::from(steps[*at]) > FAST_M_PER_S * (after - before).abs(),
            _ => steps[*at] > 10.0 * usual,
        };
        steps[*at] > FAR_M && fast
    };
    let found: Vec<usize> = (0..steps.len()).filter(is_jump).collect();
    let first = *found.first()?;
    let others = if found.len() > 1 { format!(", and at {} other places", found.len() - 1) } else { String::new() };
    Some(format!(
        "the camera jumps by {:.2} m between frames {} and {}{others}: are the poses right?",
        steps[first],
        posed[first].0.name,
        posed[first + 1].0.name
    ))
}
