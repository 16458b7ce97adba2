//! `nudge train export`: a checkpoint becomes weights with a card.

use super::session::is_weights;
use super::{ExportArgs, Network, lineage};
use crate::commands::progress::Progress;
use crate::commands::{calibrate, print};
use nudge_core::Error;
use nudge_core::belief::{BeliefUpdate, Classical};
use nudge_core::cnabu::{Card, Cnabu, Layout, OBSERVE_WEIGHTS, PUSH_WEIGHTS, Tensor, UPDATES, half, write_tensors};
use nudge_core::learn::{
    Dataset, MapSample, ObserveTrainer, PushSample, PushTrainer, Sample, Stretch, TrainSettings, evaluate,
    evaluate_pushes, fit_change_temperature,
};
use nudge_core::scene::GenerateConfig;
use nudge_core::score::Scores;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

pub(super) fn run(args: &ExportArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&args.out).map_err(|error| Error::io(&args.out, error))?;
    match args.network {
        Network::Observe => observe(args),
        Network::Push => push(args),
    }
}

fn observe(args: &ExportArgs) -> anyhow::Result<()> {
    let test = open::<MapSample>(&args.test, args.scenes)?;
    let settings = ObserveTrainer::logged_settings(&args.run)?;
    let device = nudge_core::cnabu::device("cpu")?;
    let trainer = ObserveTrainer::load(&args.run, settings.clone(), Layout::new(&test.grid())?, device)?;
    let path = args.out.join(OBSERVE_WEIGHTS);
    let mut card = trainer.card();
    describe::<MapSample>(&mut card, args, &settings, trainer.updates())?;
    card.data.insert("test".into(), command(&test));
    write(&path, &card, &trainer.mean_weights(), args.half)?;
    // What is scored is what was written, rounding included.
    let progress = Progress::new("sigma_o on views", test.len());
    let tallies = evaluate(&test, &Cnabu::load_file(&path)?, &mut |done| progress.at(done))?;
    progress.finish();
    card.scores = calibrate::scored(1, &tallies);
    card.write(&path)?;
    print(&format!("{}\n{}", path.display(), calibrate::table("sigma_o", &card.scores)))
}

fn push(args: &ExportArgs) -> anyhow::Result<()> {
    let test = open::<PushSample>(&args.test, args.scenes)?;
    let layout = Layout::new(&test.grid())?;
    let device = nudge_core::cnabu::device("cpu")?;
    let path = args.out.join(PUSH_WEIGHTS);
    let (trainer, mut card) = if is_weights(&args.run) {
        let card = Card::read(&args.run, "sigma_m")?;
        let settings = TrainSettings { width: card.width, ..TrainSettings::default() };
        (PushTrainer::begin_with(&args.run, settings, layout, device)?, card)
    } else {
        let settings = PushTrainer::logged_settings(&args.run)?;
        let trainer = PushTrainer::load(&args.run, settings.clone(), layout, device)?;
        let mut card = trainer.card();
        describe::<PushSample>(&mut card, args, &settings, trainer.updates())?;
        (trainer, card)
    };
    card.data.insert("test".into(), command(&test));
    if let Some(val) = &args.val {
        let val = open::<PushSample>(val, usize::MAX)?;
        let untempered = trainer.with(Cnabu::load_file(&args.out.join(OBSERVE_WEIGHTS))?);
        let progress = Progress::new("temperature of sigma_m", val.len());
        let temperature = fit_change_temperature(&val, &untempered, &mut |done| progress.at(done))?;
        progress.finish();
        card.change_temperature = Some(temperature as f32);
        card.data.insert("val".into(), command(&val));
    }
    write(&path, &card, &trainer.mean_weights(), args.half)?;
    let update = Cnabu::load(&args.out)?;
    let tallies = |what: &str, predict: &dyn BeliefUpdate| {
        let progress = Progress::new(what, test.len());
        let tallies = evaluate_pushes(&test, &update, predict, &mut |done| progress.at(done));
        progress.finish();
        tallies
    };
    let ours = tallies("sigma_m on pushes", &update)?;
    let classical = tallies("classical on pushes", &Classical)?;
    for (name, scores) in [
        ("sigma_m", ours.predicted.scores()),
        ("unchanged", ours.unchanged.scores()),
        ("classical", classical.predicted.scores()),
    ] {
        card.pushes.extend(rows(name, &scores));
    }
    card.write(&path)?;
    let lines: String = card.pushes.iter().map(|(name, score)| format!("{name:<28} {score:.3}\n")).collect();
    print(&format!("{}\n{lines}", path.display()))
}

fn rows(name: &str, scores: &Scores) -> [(String, f64); 3] {
    [
        (format!("{name}_occupied_iou"), scores.occupied_iou),
        (format!("{name}_semantic_miou"), scores.semantic_miou),
        (format!("{name}_mece_occupancy"), scores.mece_occupancy),
    ]
}

fn open<S: Sample>(directory: &Path, scenes: usize) -> anyhow::Result<Dataset<S>> {
    let mut test = Dataset::<S>::open(directory)?;
    test.truncate(scenes);
    Ok(test)
}

fn write(path: &Path, card: &Card, weights: &[(String, Tensor)], halved: bool) -> nudge_core::Result<()> {
    let kept = |tensor: &Tensor| if halved { half(tensor) } else { tensor.shallow_clone() };
    let tensors: Vec<_> = weights.iter().map(|(name, tensor)| (name.clone(), kept(tensor))).collect();
    write_tensors(path, &tensors)?;
    card.write(path)
}

/// Writes to the card how its weights were made: the command that makes the data, and the settings.
fn describe<S: Sample>(
    card: &mut Card,
    args: &ExportArgs,
    settings: &TrainSettings,
    updates: u64,
) -> anyhow::Result<()> {
    if let Some(data) = &args.data {
        card.data.insert("train".into(), command(&Dataset::<S>::open(data)?));
    }
    card.training = strings(settings)?;
    card.training.insert(UPDATES.into(), updates.to_string());
    Ok(lineage::tell(&args.run, card)?)
}

/// The command that makes the samples of a directory.
fn command<S: Sample>(data: &Dataset<S>) -> String {
    let (card, usual) = (data.card(), GenerateConfig::default());
    let mut command =
        format!("nudge data {} --seed {} --count {} --noise {}", S::KIND, card.seed, data.len(), card.noise_share);
    if card.fill != usual.fill {
        let [low, high] = card.fill;
        command += &format!(" --fill {low}-{high}");
    }
    if card.rho != usual.rho {
        command += &format!(" --rho {}", card.rho);
    }
    if card.stretch.share > 0.0 {
        let Stretch { share, range: [low, high] } = card.stretch;
        command += &format!(" --stretch {low}-{high} --stretch-share {share}");
    }
    command
}

/// Settings as the card's words.
fn strings(settings: &impl Serialize) -> anyhow::Result<BTreeMap<String, String>> {
    let serde_json::Value::Object(table) = serde_json::to_value(settings)? else { return Ok(BTreeMap::new()) };
    Ok(table.into_iter().map(|(name, value)| (name, value.to_string())).collect())
}
