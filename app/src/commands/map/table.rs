//! What `nudge map` prints: which frames are mapped, and what came of it.

use nudge_core::episode::{Episode, NO_TRUTH};
use nudge_core::recording::{Board, Fate, Inspection, Recording, Survey};
use nudge_core::scene::{BACKGROUND, ClassId};
use std::collections::BTreeMap;
use std::path::Path;

/// Skipped frames in a row that have one reason are told in one line from this many on.
const FEW: usize = 4;
/// A cell is said to be of a class from this probability on.
const SURE: f32 = 0.5;

/// The frames.
pub(super) fn frames(recording: &Recording, survey: &Survey, board: &Board, from: &str) -> anyhow::Result<()> {
    let mut text = format!("{}: {} ({} frames)\n", recording.path().display(), recording.format(), recording.len());
    let [w, d, h] = board.shelf.size;
    let at = board.recording_from_board.translation.vector;
    let (roll, pitch, yaw) = board.recording_from_board.rotation.euler_angles();
    let degrees = [roll, pitch, yaw].map(|angle| format!("{:.1}", angle.to_degrees() + 0.0)).join(", ");
    text += &format!(
        "board {from}: {w} x {d} x {h} m, front edge at [{:.3}, {:.3}, {:.3}] m, turned by {degrees} degrees\n\n",
        at.x, at.y, at.z
    );
    text += &format!("{:<20} {:>12}  {:>10}  {:>9}  {}\n", "frame", "time s", "with depth", "in shelf", "");
    let rows = &survey.rows;
    let mut next = 0;
    while next < rows.len() {
        let row = &rows[next];
        let time = row.time_s.map_or(String::new(), |time| format!("{time:.3}"));
        match &row.fate {
            Fate::Used { with_depth, in_shelf, labelled } => {
                let percent = |share: &f32| format!("{:.1} %", 100.0 * share);
                let labels = if *labelled { "" } else { "no labels" };
                let line = format!(
                    "{:<20} {time:>12}  {:>10}  {:>9}  {labels}",
                    row.name,
                    percent(with_depth),
                    percent(in_shelf)
                );
                text += line.trim_end();
                text.push('\n');
                next += 1;
            }
            Fate::Skipped(why) => {
                let alike = rows[next..].iter().take_while(|other| other.fate == row.fate).count();
                if alike < FEW {
                    text += &format!("{:<20} {time:>12}  skipped: {why}\n", row.name);
                    next += 1;
                } else {
                    let last = &rows[next + alike - 1];
                    text += &format!("{} to {} ({alike} frames)  skipped: {why}\n", row.name, last.name);
                    next += alike;
                }
            }
        }
    }
    let used = survey.used().len();
    text += &format!("\n{used} of {} frames are mapped", rows.len());
    let mut reasons = BTreeMap::<&str, usize>::new();
    for row in rows {
        if let Fate::Skipped(why) = &row.fate {
            *reasons.entry(why.split(':').next().unwrap_or(why)).or_default() += 1;
        }
    }
    for (why, count) in reasons {
        text += &format!("; {count} skipped: {why}");
    }
    text += "\n";
    if survey.labelled() == 0 {
        text += "no labels: only occupancy is mapped, and the semantic map stays as unsure as it was\n";
    }
    super::super::print(&text)
}

/// What is in an MCAP file, and which of it to map.
pub(super) fn inspection(path: &Path, found: &Inspection) -> anyhow::Result<()> {
    let mut text = String::new();
    for line in &found.topics {
        let encoding = if line.encoding.is_empty() { String::new() } else { format!("  ({})", line.encoding) };
        text += &format!("# {:<46} {:>6}  {}{encoding}\n", line.topic, line.count, line.kind);
    }
    match &found.proposal {
        Ok(proposal) => text += &format!("\n{proposal}"),
        Err(words) => super::super::warn(&format!("{}: {words}", path.display())),
    }
    super::super::print(&text)
}

/// What came of it.
pub(super) fn summary(episode: &Episode, labelled: usize, out: &Path, [seconds, mapping_s]: [f64; 2]) {
    let record = episode.record();
    let (first, last) = (record.prior.entropy_nats, record.entropy_after(record.steps.len()));
    println!();
    println!("  {:<20} {}", "frames", record.steps.len());
    println!("  {:<20} {last:.0} nats of {first:.0}", "map entropy");
    let classes = if labelled > 0 { believed(episode) } else { "no labels, so none".to_owned() };
    println!("  {:<20} {classes}", "believed classes");
    println!("  {:<20} {NO_TRUTH}", "scores");
    println!("  {:<20} {seconds:.1} s, {:.1} frames a second", "time", record.steps.len() as f64 / mapping_s.max(1e-9));
    let parts = record
        .steps
        .iter()
        .map(|step| step.seconds)
        .fold([0.0; 4], |sum, s| [sum[0] + s.decide, sum[1] + s.act, sum[2] + s.update, sum[3] + s.record]);
    for (name, seconds) in ["decide", "read", "update", "record"].into_iter().zip(parts) {
        println!("  {:<20} {seconds:.1}", format!("  {name}"));
    }
    println!("  {:<20} {}", "written to", out.display());
}

/// The classes that some of the floor is believed to be, with their area.
fn believed(episode: &Episode) -> String {
    let belief = episode.belief();
    let mut cells = BTreeMap::<u8, usize>::new();
    for alpha in &belief.semantics {
        let sum: f32 = alpha.iter().sum();
        let best = (0..alpha.len()).max_by(|a, b| alpha[*a].total_cmp(&alpha[*b])).unwrap_or(0);
        if best as u8 != BACKGROUND.0 && alpha[best] > SURE * sum {
            *cells.entry(best as u8).or_default() += 1;
        }
    }
    let cell_cm2 = (100.0 * belief.grid.voxel_m).powi(2);
    let name = |class: u8| episode.catalog().name(ClassId(class)).replace('_', " ");
    let words: Vec<String> =
        cells.into_iter().map(|(class, count)| format!("{} {:.0} cm2", name(class), count as f32 * cell_cm2)).collect();
    if words.is_empty() { "none".to_owned() } else { words.join(", ") }
}
