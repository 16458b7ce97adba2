//! `nudge run`: map a scene with a policy and write the episode.

use crate::driver::{Driver, belief_update, default_out};
use crate::record::mishaps;
use indicatif::{ProgressBar, ProgressStyle};
use nudge_core::Error;
use nudge_core::camera::NoiseModel;
use nudge_core::episode::{DirectoryState, EpisodeConfig, EpisodeDir, EpisodeRecord, Overwrite, StepRecord};
use nudge_core::plan::{Action, PolicyKind, Reason};
use nudge_core::scene::{Catalog, Scene};
use nudge_core::score::{Scores, Verdict};
use std::path::PathBuf;
use std::sync::Arc;

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The scene file
    scene: PathBuf,
    /// The rule that chooses actions
    #[arg(long, default_value = "mem")]
    policy: PolicyKind,
    /// Number of actions
    #[arg(long, default_value_t = 20)]
    budget: usize,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    planning: super::PlanningArgs,
    /// The episode's directory (default: out/SCENE-POLICY-SEED)
    #[arg(long)]
    out: Option<PathBuf>,
    /// Replace the episode that is in the directory
    #[arg(long, conflicts_with = "resume")]
    force: bool,
    /// Go on with the episode that is in the directory
    #[arg(long)]
    resume: bool,
    /// Print episode.json instead of the table
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    args.planning.device.choose()?;
    let catalog = Arc::new(Catalog::standard());
    let (scene, warnings) = Scene::load(&args.scene, &catalog)?;
    for warning in warnings {
        super::warn(&format!("{}: {warning}", args.scene.display()));
    }
    let (update, note) = belief_update(args.planning.belief.as_deref(), args.policy)?;
    if let Some(note) = note {
        super::warn(&note);
    }
    let config = EpisodeConfig {
        policy: args.policy,
        belief: update.name().to_owned(),
        seed: args.seed,
        budget: args.budget,
        views: args.planning.views.clone(),
        planner: args.planning.planner.settings(update.name())?,
        noise: NoiseModel::named(&args.planning.noise)?,
    };
    let out = args.out.clone().unwrap_or_else(|| default_out(&scene, args.policy, args.seed));
    let mut driver = if args.resume && EpisodeDir::state(&out)? == DirectoryState::Episode {
        let logged = EpisodeDir::open(&out)?.record()?;
        same_episode(&logged, &scene, &config, &out)?;
        let bar = bar(logged.steps.len(), "repeating");
        let driver = Driver::resume(&out, catalog, update, &mut |episode, _| {
            bar.set_position(episode.record().steps.len() as u64);
            Ok(())
        })?;
        bar.finish_and_clear();
        driver
    } else {
        let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
        Driver::start(scene, catalog, config, update, &out, overwrite)?
    };

    if let Some(why) = driver.episode().why_no_push() {
        super::warn(&why);
    }
    if !args.json {
        print_header(driver.episode().record());
        driver.episode().record().steps.iter().for_each(|step| print_step(step, args.budget));
    }
    let bar = bar(args.budget, "");
    while !driver.episode().is_finished() {
        bar.set_position(driver.episode().record().steps.len() as u64);
        bar.set_message("deciding");
        let decision = driver.decide();
        bar.set_message(match decision.action {
            Action::Look { .. } => "looking",
            Action::Push(_) => "pushing",
        });
        let outcome = driver.act(decision)?;
        if !args.json {
            bar.suspend(|| print_step(&outcome.record, args.budget));
        }
    }
    bar.finish_and_clear();
    let episode = driver.finish()?;
    if args.json {
        super::print(&episode.record().to_json())?;
    } else {
        print_summary(episode.record(), &out);
    }
    Ok(())
}

/// Refuses to go on with an episode of another scene or with other settings; names the first that differs.
fn same_episode(
    logged: &EpisodeRecord,
    scene: &Scene,
    config: &EpisodeConfig,
    out: &std::path::Path,
) -> Result<(), Error> {
    let settings = |config: &EpisodeConfig| {
        [
            ("policy", config.policy.to_string()),
            ("belief", config.belief.clone()),
            ("seed", config.seed.to_string()),
            ("budget", config.budget.to_string()),
            ("views", config.views.clone()),
            ("noise", NoiseModel::name_of(config.noise)),
        ]
    };
    if logged.scene != *scene {
        let message = format!(
            "the episode there is of another scene ({}); leave out --resume or choose another --out",
            logged.scene.name
        );
        return Err(Error::input(out, "", message));
    }
    let both = settings(&logged.config).into_iter().zip(settings(config));
    let mut whole = both.map(|((name, before), (_, now))| (name, before, now)).filter(|(_, before, now)| before != now);
    let planner = || config.planner.difference(&logged.config.planner);
    let differs = whole.next().or_else(|| planner().map(|(setting, before, now)| (setting.name, before, now)));
    differs.map_or(Ok(()), |(name, before, now)| {
        Err(Error::input(out, "", format!("the episode there was run with --{name} {before}, not {now}")))
    })
}

fn bar(length: usize, message: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:24} {pos}/{len} {msg} {elapsed}").expect("a valid template");
    ProgressBar::new(length as u64).with_style(style).with_message(message)
}

fn print_header(record: &EpisodeRecord) {
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
    print_row("0", "prior", None, &record.prior, None);
}

fn print_step(step: &StepRecord, budget: usize) {
    let gain = match step.action {
        Action::Look { view } => step.decision.gains.get(usize::from(view.0)).copied(),
        Action::Push(_) => Some(step.decision.igm),
    };
    let mut action = action_words(step);
    for mishap in mishaps(step) {
        action += &format!(", {mishap}");
    }
    print_row(&format!("{}/{budget}", step.index), &action, gain, &step.scores, Some(step.seconds.total()));
}

fn print_row(step: &str, action: &str, gain: Option<f32>, scores: &Scores, seconds: Option<f64>) {
    let gain = gain.map_or(String::new(), |gain| format!("{gain:.1}"));
    let seconds = seconds.map_or(String::new(), |seconds| format!("{seconds:.2}"));
    println!(
        "{step:>6}  {action:<34} {gain:>9}  {:>6.3}  {:>6.3}  {:>9.0}  {seconds:>6}",
        scores.occupancy_iou, scores.semantic_miou, scores.entropy_nats
    );
}

/// `look 143`, `look 143 (after the push)`, `push 0.12 m at 75 deg`.
fn action_words(step: &StepRecord) -> String {
    match step.action {
        Action::Look { view } if step.decision.reason == Reason::ViewOfPush => {
            format!("look {} (view of the push)", view.0)
        }
        Action::Look { view } => format!("look {}", view.0),
        Action::Push(push) => {
            let [x, y, _] = push.start;
            format!("push {:.0} mm at {:.0}° from ({x:.2}, {y:.2})", push.length_m * 1e3, push.direction_deg)
        }
    }
}

fn print_summary(record: &EpisodeRecord, out: &std::path::Path) {
    let Some(last) = record.steps.last() else { return };
    let count = |verdict: Verdict| last.objects.iter().filter(|object| object.verdict == verdict).count();
    let pushes = record.steps.iter().filter(|step| matches!(step.action, Action::Push(_))).count();
    let seconds = |part: fn(&StepRecord) -> f64| record.steps.iter().map(part).sum::<f64>();
    let displaced: f64 = record.steps.iter().map(|step| step.displacement_m).sum();
    let dropped: usize = record.steps.iter().map(|step| step.dropped.len()).sum();
    println!();
    println!("  looks, pushes        {}, {pushes}", record.steps.len() - pushes);
    println!("  occupancy IoU        {:.3} (occupied {:.3})", last.scores.occupancy_iou, last.scores.occupied_iou);
    println!("  semantic mIoU        {:.3}", last.scores.semantic_miou);
    println!(
        "  mECE                 {:.3} occupancy, {:.3} semantics",
        last.scores.mece_occupancy, last.scores.mece_semantics
    );
    println!(
        "  map entropy          {:.0} nats, {:.0} at the start",
        last.scores.entropy_nats, record.prior.entropy_nats
    );
    println!(
        "  objects              {} found, {} misclassified, {} not found, {} hallucinated",
        count(Verdict::Found),
        count(Verdict::Misclassified),
        count(Verdict::NotFound),
        count(Verdict::Hallucinated)
    );
    println!("  moved, dropped       {displaced:.2} m, {dropped}");
    println!("  the arm moved        {:.0} s of its own time", seconds(|step| step.motion_s));
    println!(
        "  time                 {:.1} s: decide {:.1}, act {:.1}, update {:.1}, record {:.1}",
        seconds(|step| step.seconds.total()),
        seconds(|step| step.seconds.decide),
        seconds(|step| step.seconds.act),
        seconds(|step| step.seconds.update),
        seconds(|step| step.seconds.record)
    );
    println!("  written to           {}", out.display());
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::plan::{SETTINGS, Values};

    /// An episode whose gamma was another one was gone on with, without a word.
    #[test]
    fn going_on_with_other_settings_is_refused_whichever_it_is() {
        let logged = crate::fixture::play(1).record;
        let (scene, config) = (logged.scene.clone(), logged.config.clone());
        let out = std::path::Path::new("there");
        let refused = |config: &EpisodeConfig| same_episode(&logged, &scene, config, out).err().map(|e| e.to_string());
        assert_eq!(refused(&config), None);
        for setting in SETTINGS {
            let other = match &setting.values {
                Values::Whole { range: [_, high], .. } => high.to_string(),
                Values::Real { range: [_, high], .. } => high.to_string(),
                Values::Choice { choices, .. } => choices[1].name.to_owned(),
            };
            let mut planner = config.planner;
            setting.set(&mut planner, &other).expect("allowed");
            let said = refused(&EpisodeConfig { planner, ..config.clone() }).expect(setting.name);
            let before = setting.value(&config.planner);
            assert_eq!(said, format!("there: the episode there was run with --{} {before}, not {other}", setting.name));
        }
        let noisy = EpisodeConfig { noise: Some(NoiseModel::STANDARD), ..config };
        let said = refused(&noisy).expect("other noise");
        assert_eq!(said, "there: the episode there was run with --noise none, not standard");
    }
}
