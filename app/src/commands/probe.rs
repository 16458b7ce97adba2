//! `nudge probe`: what each push candidate of a decision would really do, beside what was promised of it.

mod table;

use super::progress::Progress;
use super::{print, to_json, warn};
use crate::driver::belief_update;
use nudge_core::Error;
use nudge_core::belief::BeliefUpdate;
use nudge_core::episode::{EpisodeDir, EpisodeRecord};
use nudge_core::files::write_atomically;
use nudge_core::probe::{StepProbe, StepSummary, check_step, probable_steps, probe};
use nudge_core::scene::Catalog;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How it is counted, at the end of the help.
const HOW: &str = "Each episode is gone through again up to the step, and there every feasible push candidate is carried out \
    in a copy of the world. Counted are objects of which any view of the array shows 25 pixels or more after a push and none \
    did before (won), and the other way round (lost), and the space that a push opens: voxels that no look has seen, that no \
    view reaches before and one reaches after, but for what was inside an object. All views count, at full resolution for \
    objects, one ray in 8 x 8 pixels for space. rank is Spearman's correlation of promise and truth over the candidates, \
    regret the best candidate's truth minus that of the one with the largest promise, random the mean over all.";

/// What was typed.
#[derive(clap::Args, Debug)]
#[command(after_help = HOW)]
pub struct Args {
    /// The episodes' directories
    #[arg(required = true, value_name = "EPISODE")]
    episodes: Vec<PathBuf>,
    /// The step whose decision is probed, 1 for the first
    #[arg(long, value_name = "N", required_unless_present = "steps", conflicts_with = "steps")]
    step: Option<usize>,
    /// Several steps: all that have push candidates, or a list
    #[arg(long, value_name = "all|A,B,...")]
    steps: Option<Steps>,
    /// Judge the candidates too by the mean over N completions of the shelf: what no view shows is replaced by objects drawn at
    /// random where no look has seen; the most that a belief can know, N times as slow
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(..=1024))]
    completions: u16,
    #[command(flatten)]
    device: super::DeviceArgs,
    /// Write every push to a table, one a line
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Print everything as one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

/// Which decisions are probed.
#[derive(Clone, Debug, PartialEq)]
enum Steps {
    All,
    These(BTreeSet<usize>),
}

impl std::str::FromStr for Steps {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "all" {
            return Ok(Self::All);
        }
        let steps: Option<BTreeSet<usize>> =
            text.split(',').map(|step| step.trim().parse().ok().filter(|step| *step > 0)).collect();
        steps
            .map(Self::These)
            .ok_or_else(|| "`all`, or numbers of steps with commas between them, is needed".to_owned())
    }
}

/// An episode to probe.
struct Task {
    directory: EpisodeDir,
    record: EpisodeRecord,
    steps: BTreeSet<usize>,
    update: Arc<dyn BeliefUpdate>,
}

/// What the pushes of an episode's decisions do.
#[derive(Serialize)]
struct Probed {
    /// Its directory, as it was typed.
    episode: PathBuf,
    scene: String,
    policy: String,
    belief: String,
    seed: u64,
    /// Where repeating it did not lead where its log says.
    #[serde(skip_serializing_if = "Option::is_none")]
    departs: Option<String>,
    steps: Vec<ProbedStep>,
}

/// What the pushes of a decision do, and what they tell together.
#[derive(Serialize)]
struct ProbedStep {
    #[serde(flatten)]
    probe: StepProbe,
    summary: StepSummary,
}

/// The JSON document.
#[derive(Serialize)]
struct Document<'a> {
    episodes: &'a [Probed],
    /// Means over all steps of all episodes, each step counting alike.
    mean: StepSummary,
}

/// Runs the command.
///
/// # Errors
/// For episodes and steps that cannot be probed, before anything is carried out; for a belief that this build lacks; for
/// files that cannot be read or written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    args.device.choose()?;
    let steps = match (args.step, &args.steps) {
        (Some(step), _) => Steps::These(BTreeSet::from([step])),
        (None, Some(steps)) => steps.clone(),
        (None, None) => return Err(Error::Usage("--step or --steps is needed".to_owned()).into()),
    };
    if let Some(file) = &args.csv {
        check_folder(file)?;
    }
    let mut tasks = Vec::new();
    let mut pushes = 0;
    for path in &args.episodes {
        let (task, count) = task(path, &steps)?;
        tasks.push(task);
        pushes += count;
    }
    let progress = Progress::new("probe", pushes * (1 + usize::from(args.completions)));
    let is_one = tasks.len() == 1 && tasks[0].steps.len() == 1;
    let mut probed = Vec::new();
    for task in &tasks {
        if !args.json && probed.is_empty() && !is_one {
            print(&table::headings())?;
        }
        let found = carry_out(task, usize::from(args.completions), &progress, &mut |probe| {
            if !args.json && !is_one {
                progress.suspend(|| print(&table::step(&task.record, probe)))?;
            }
            Ok(())
        })?;
        probed.push(found);
    }
    progress.finish();
    probed.iter().for_each(tell_departures);
    if let Some(file) = &args.csv {
        write_atomically(file, table::csv(&probed).as_bytes())?;
    }
    let summaries: Vec<StepSummary> = probed.iter().flat_map(|probed| &probed.steps).map(|step| step.summary).collect();
    let mean = StepSummary::mean_of(&summaries);
    if args.json {
        return print(&to_json(&Document { episodes: &probed, mean })?);
    }
    match (is_one, probed.first().and_then(|probed| Some((probed, probed.steps.first()?)))) {
        (true, Some((probed, step))) => print(&table::pushes(probed, step)),
        _ => print(&table::mean(&mean, summaries.len())),
    }
}

/// Checks that the table can be written before the work is begun.
fn check_folder(file: &Path) -> Result<(), Error> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if file.is_dir() {
        return Err(Error::input(file, "", "is a directory; --csv needs the name of a file"));
    }
    if folder.is_dir() {
        Ok(())
    } else {
        Err(Error::input(folder, "", "is no directory, so the table cannot be written there"))
    }
}

/// What is to be done of an episode, and how many pushes that are.
fn task(path: &Path, steps: &Steps) -> Result<(Task, usize), Error> {
    let directory = EpisodeDir::open(path)?;
    let record = directory.record()?;
    let steps = match steps {
        Steps::All => probable_steps(&record).into_iter().map(|(step, _)| step).collect(),
        Steps::These(steps) => steps.clone(),
    };
    if steps.is_empty() {
        return Err(Error::input(path, "", "no step of the episode has a feasible push candidate"));
    }
    let mut pushes = 0;
    for step in &steps {
        pushes += check_step(path, &record, *step)?;
    }
    let update = belief_update(Some(&record.config.belief), record.config.policy)?;
    if let Some(words) = record.other_weights(&*update) {
        warn(&format!("{}: {words}", path.display()));
    }
    Ok((Task { directory, record, steps, update }, pushes))
}

/// Probes an episode; `show` is given every step as it is done.
fn carry_out(
    task: &Task,
    completions: usize,
    progress: &Progress,
    show: &mut dyn FnMut(&StepProbe) -> anyhow::Result<()>,
) -> anyhow::Result<Probed> {
    let mut shown = Ok(());
    let name = &task.record.scene.name;
    let catalog = Arc::new(Catalog::standard());
    let (probes, difference) = probe(
        &task.directory,
        catalog,
        task.update.clone(),
        &task.steps,
        completions,
        &|| progress.inc(),
        &mut |step| {
            if shown.is_ok() {
                shown = show(step);
            }
        },
    )?;
    shown?;
    let config = &task.record.config;
    Ok(Probed {
        episode: task.directory.path().to_owned(),
        scene: name.clone(),
        policy: config.policy.to_string(),
        belief: config.belief.clone(),
        seed: config.seed,
        departs: difference.map(|difference| difference.to_string()),
        steps: probes.into_iter().map(|probe| ProbedStep { summary: probe.summary(), probe }).collect(),
    })
}

/// Warns of what is not quite as it was in the episode.
fn tell_departures(probed: &Probed) {
    let path = probed.episode.display();
    if let Some(departs) = &probed.departs {
        warn(&format!("{path}: repeating it does not lead where its log says: {departs}"));
    }
    for ProbedStep { probe, .. } in &probed.steps {
        let step = probe.step;
        if probe.agrees == Some(false) {
            warn(&format!("{path}: the push of step {step} does not do what it did in the episode"));
        }
        if probe.left_out > 0 {
            warn(&format!(
                "{path}: step {step}: {} candidates left out, for which the arm has no motion now",
                probe.left_out
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_all_or_a_list() {
        let read = |text: &str| text.parse::<Steps>();
        assert_eq!(read("all"), Ok(Steps::All));
        assert_eq!(read("7, 4,7"), Ok(Steps::These(BTreeSet::from([4, 7]))));
        for wrong in ["", "0", "4,", "-1", "every", "1.5"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
