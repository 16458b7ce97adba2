//! `nudge train observe`.

use super::ObserveArgs;
use super::curve::Curve;
use super::session::{self, Pupil};
use crate::commands::calibrate;
use crate::commands::progress::Progress;
use nudge_core::Error;
use nudge_core::cnabu::{self, Cnabu, Layout};
use nudge_core::learn::{AfterPushes, Dataset, MapSample, ObserveTrainer, TrainSettings, evaluate};
use std::path::Path;

struct Observer {
    trainer: ObserveTrainer,
    data: Dataset<MapSample>,
    after: Option<AfterPushes>,
    val: Option<Dataset<MapSample>>,
}

pub(super) fn run(args: &ObserveArgs) -> anyhow::Result<()> {
    let session = &args.session;
    let device = session.device()?;
    let (data, val) = session.open::<MapSample>()?;
    let after = args.pushes.as_deref().map(after_pushes).transpose()?;
    let push_share = if after.is_some() { args.push_share } else { 0.0 };
    let settings =
        TrainSettings { push_share, move_share: args.move_share, ..session.settings(args.width, args.max_views) };
    let layout = Layout::new(&data.grid())?;
    let trainer: ObserveTrainer = session.trainer(settings, layout, device)?;
    let (parameters, updates) = (trainer.parameters(), trainer.updates());
    eprintln!("sigma_o: {parameters} parameters, {} scenes, {updates} updates so far", data.len());
    session.run(&mut Observer { trainer, data, after, val })
}

/// Pushes to begin sequences with, as the shipped networks predict them.
fn after_pushes(directory: &Path) -> anyhow::Result<AfterPushes> {
    let missing =
        || Error::Usage("no weights found to predict pushes with; NUDGE_MODELS names their folder".to_owned());
    let models = cnabu::models_dir().ok_or_else(missing)?;
    Ok(AfterPushes::new(session::open(directory)?, Cnabu::load(&models)?))
}

impl Pupil for Observer {
    fn train(&mut self, rate: f64, curve: &mut Curve) -> nudge_core::Result<()> {
        for loss in self.trainer.train(&self.data, self.after.as_mut(), rate)? {
            if loss.after_push {
                curve.add("occupancy_after_push", loss.occupancy);
                curve.add("semantics_after_push", loss.semantics);
                continue;
            }
            curve.add("occupancy", loss.occupancy);
            curve.add("semantics", loss.semantics);
            let names = match loss.views {
                1 => ("occupancy_1", "semantics_1"),
                3 => ("occupancy_3", "semantics_3"),
                10 => ("occupancy_10", "semantics_10"),
                _ => continue,
            };
            curve.add(names.0, loss.occupancy);
            curve.add(names.1, loss.semantics);
        }
        Ok(())
    }

    fn save(&self, out: &Path) -> nudge_core::Result<()> {
        self.trainer.save(out)
    }

    fn updates(&self) -> u64 {
        self.trainer.updates()
    }

    /// The errors of both maps, averaged over the views.
    fn validate(&self, curve: &mut Curve) -> anyhow::Result<f64> {
        let Some(val) = &self.val else { return Ok(0.0) };
        let progress = Progress::new("validation", val.len());
        let tallies = evaluate(val, &self.trainer.update(), &mut |done| progress.at(done))?;
        progress.finish();
        let scores = calibrate::scored(1, &tallies);
        crate::output::print_error(&calibrate::table("sigma_o", &scores));
        curve.validation(self.trainer.updates(), serde_json::to_value(&scores)?)?;
        Ok(scores.iter().map(|s| 2.0 - s.occupancy_iou - s.semantic_miou).sum::<f64>() / scores.len() as f64)
    }
}
