//! What `nudge run` prints: a line per step, and what came of it in the end.

use super::Column;
use crate::record::mishaps;
use nudge_core::camera::NoiseModel;
use nudge_core::episode::{EpisodeRecord, NO_TRUTH, StepRecord};
use nudge_core::plan::{Action, Reason};
use nudge_core::score::{Scores, Verdict};
use nudge_core::world::GripEnd;

pub(super) fn header(record: &EpisodeRecord) {
    let config = &record.config;
    println!(
        "{}: {} objects, policy {}, {} belief, seed {}, {} actions{}",
        record.scene.name,
        record.scene.objects.len(),
        config.policy,
        config.belief,
        config.seed,
        config.budget,
        config.noise.map_or(String::new(), |noise| format!(", noise {}", NoiseModel::name_of(Some(noise))))
    );
    println!(
        "{:>6}  {:<34} {:>9}  {:>6}  {:>6}  {:>9}  {:>6}",
        "step", "action", "gain nats", "IoU", "mIoU", "H nats", "s"
    );
    row("0", "prior", None, (record.prior.scores.as_ref(), record.prior.entropy_nats), None);
    if !record.has_truth() {
        println!("        {NO_TRUTH}");
    }
}

pub(super) fn step(step: &StepRecord, budget: usize) {
    let mut action = action_words(step);
    for mishap in mishaps(step) {
        action += &format!(", {mishap}");
    }
    row(
        &format!("{}/{budget}", step.index),
        &action,
        step.decision.promised(),
        (step.scores(), step.entropy_nats),
        Some(step.seconds.total()),
    );
}

fn row(step: &str, action: &str, gain: Option<f32>, state: (Option<&Scores>, f64), seconds: Option<f64>) {
    let (scores, entropy_nats) = state;
    let score = |of: fn(&Scores) -> f64| scores.map_or(String::new(), |scores| format!("{:.3}", of(scores)));
    let gain = gain.map_or(String::new(), |gain| format!("{gain:.1}"));
    let seconds = seconds.map_or(String::new(), |seconds| format!("{seconds:.2}"));
    let (iou, miou) = (score(|s| s.occupancy_iou), score(|s| s.semantic_miou));
    println!("{step:>6}  {action:<34} {gain:>9}  {iou:>6}  {miou:>6}  {entropy_nats:>9.0}  {seconds:>6}");
}

/// `look 143`, `look 143 (after the push)`, `push 0.12 m at 75 deg`.
fn action_words(step: &StepRecord) -> String {
    match step.action {
        Action::Look { view } if step.decision.reason == Reason::ViewOfPush => {
            format!("look {} (view of the push)", view.0)
        }
        Action::Look { view } => format!("look {}", view.0),
        Action::Manipulate(manipulation) => {
            format!("{} {}", manipulation.kind().name(), manipulation.describe().short)
        }
    }
}

/// What came of an episode, and of the one beside it: a line for each score, a column for each episode.
pub(super) fn summary(columns: &[Column]) {
    println!();
    if columns.len() > 1 {
        line("", columns, |column| column.record.config.policy.to_string());
    }
    line("looks, pushes", columns, |column| {
        let (pushes, picks) = (pushes(&column.record), picks(&column.record));
        format!("{}, {pushes}", column.record.steps.len() - pushes - picks)
    });
    if columns.iter().any(|column| picks(&column.record) > 0) {
        line("picks, held", columns, |column| {
            let held = column.record.steps.iter().filter(|step| step.grip().is_some_and(GripEnd::is_held)).count();
            format!("{}, {held}", picks(&column.record))
        });
    }
    line("occupancy IoU", columns, |column| {
        scored(column, |s| format!("{:.3} (occupied {:.3})", s.occupancy_iou, s.occupied_iou))
    });
    line("semantic mIoU", columns, |column| scored(column, |s| format!("{:.3}", s.semantic_miou)));
    line("mECE", columns, |column| {
        scored(column, |s| format!("{:.3} occupancy, {:.3} semantics", s.mece_occupancy, s.mece_semantics))
    });
    line("map entropy", columns, |column| {
        let record = &column.record;
        let (first, last) = (record.prior.entropy_nats, record.entropy_after(record.steps.len()));
        if record.steps.is_empty() { String::new() } else { format!("{last:.0} nats of {first:.0}") }
    });
    if columns.iter().any(|column| column.record.has_truth()) {
        judged(columns);
    }
    line("the arm moved for", columns, |column| format!("{:.0} s", total(column, |step| step.motion_s)));
    line("time", columns, |column| format!("{:.1} s", column.seconds));
    for (name, of) in PARTS {
        line(&format!("  {name}"), columns, |column| format!("{:.1}", total(column, of)));
    }
    line("written to", columns, |column| column.out.display().to_string());
}

/// What only the truth tells: which objects were found, and what was moved.
fn judged(columns: &[Column]) {
    line("objects found", columns, |column| {
        format!("{} of {}", count(column, Verdict::Found), column.record.scene.objects.len())
    });
    line("hidden ones found", columns, |column| format!("{} of {}", hidden_found(column), column.hidden.len()));
    line("mistaken, made up", columns, |column| {
        format!("{}, {}", count(column, Verdict::Misclassified), count(column, Verdict::Hallucinated))
    });
    line("moved, dropped", columns, |column| {
        let dropped: usize = column.record.steps.iter().map(|step| step.dropped().len()).sum();
        format!("{:.2} m, {dropped}", total(column, |step| step.displacement_m().unwrap_or(0.0)))
    });
}

/// The seconds that a part of a step took.
type Seconds = fn(&StepRecord) -> f64;

/// Where the time of an episode went; the rest is reading the scene and the weights.
const PARTS: [(&str, Seconds); 4] = [
    ("decide", |step| step.seconds.decide),
    ("act", |step| step.seconds.act),
    ("update", |step| step.seconds.update),
    ("record", |step| step.seconds.record),
];

fn line(name: &str, columns: &[Column], value: impl Fn(&Column) -> String) {
    let values: String = columns.iter().map(|column| format!("{:<34}", value(column))).collect();
    println!("  {name:<20} {}", values.trim_end());
}

fn scored(column: &Column, words: impl Fn(&Scores) -> String) -> String {
    column.record.steps.last().and_then(StepRecord::scores).map_or(String::new(), words)
}

fn count(column: &Column, verdict: Verdict) -> usize {
    let last = column.record.steps.last();
    last.map_or(0, |last| last.objects().iter().filter(|object| object.verdict == verdict).count())
}

/// How many of the objects that no view shows at the start were found in the end.
fn hidden_found(column: &Column) -> usize {
    let Some(last) = column.record.steps.last() else { return 0 };
    let found = |id: u16| last.objects().iter().any(|v| v.object == Some(id) && v.verdict == Verdict::Found);
    column.hidden.iter().filter(|id| found(id.0)).count()
}

fn pushes(record: &EpisodeRecord) -> usize {
    record.steps.iter().filter(|step| matches!(step.action, Action::Manipulate(_))).count() - picks(record)
}

fn picks(record: &EpisodeRecord) -> usize {
    record.steps.iter().filter(|step| step.grip().is_some()).count()
}

fn total(column: &Column, part: impl Fn(&StepRecord) -> f64) -> f64 {
    column.record.steps.iter().map(part).sum()
}
