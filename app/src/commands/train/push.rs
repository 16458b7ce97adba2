//! `nudge train push`.

use super::PushArgs;
use super::curve::Curve;
use super::session::Pupil;
use crate::commands::progress::Progress;
use nudge_core::Error;
use nudge_core::cnabu::{self, Cnabu, Layout, OBSERVE_WEIGHTS};
use nudge_core::learn::{Dataset, Priors, PushSample, PushTrainer, VIEWS, evaluate_pushes};
use std::path::{Path, PathBuf};

struct Pusher {
    trainer: PushTrainer,
    priors: Priors,
    weights: PathBuf,
    data: Dataset<PushSample>,
    val: Option<Dataset<PushSample>>,
}

pub(super) fn run(args: &PushArgs) -> anyhow::Result<()> {
    let session = &args.session;
    let device = session.device()?;
    let shipped = || cnabu::models_dir().map(|models| models.join(OBSERVE_WEIGHTS));
    let missing = || Error::Usage("no weights of sigma_o found; --observe FILE names them".to_owned());
    let weights = args.observe.clone().or_else(shipped).ok_or_else(missing)?;
    let priors = Priors::of_network(Cnabu::load_file(&weights)?);
    let (data, val) = session.open::<PushSample>()?;
    let (settings, layout) = (session.settings(args.width, VIEWS), Layout::new(&data.grid())?);
    let trainer: PushTrainer = session.trainer(settings, layout, device)?;
    let (parameters, updates) = (trainer.parameters(), trainer.updates());
    eprintln!("sigma_m: {parameters} parameters, {} scenes, {updates} updates so far", data.len());
    session.run(&mut Pusher { trainer, priors, weights, data, val })
}

impl Pupil for Pusher {
    fn train(&mut self, rate: f64, curve: &mut Curve) -> nudge_core::Result<()> {
        let loss = self.trainer.train(&self.data, &mut self.priors, rate)?;
        curve.add("occupancy", loss.occupancy);
        curve.add("semantics", loss.semantics);
        curve.add("change", loss.change);
        Ok(())
    }

    fn save(&self, out: &Path) -> nudge_core::Result<()> {
        self.trainer.save(out)
    }

    fn updates(&self) -> u64 {
        self.trainer.updates()
    }

    /// The errors of both maps on the cells that change.
    fn validate(&self, curve: &mut Curve) -> anyhow::Result<f64> {
        let Some(val) = &self.val else { return Ok(0.0) };
        let update = self.trainer.with(Cnabu::load_file(&self.weights)?);
        let progress = Progress::new("validation", val.len());
        let tallies = evaluate_pushes(val, self.priors.network(), &update, &mut |done| progress.at(done))?;
        progress.finish();
        let (before, after) = (tallies.unchanged.scores(), tallies.predicted.scores());
        eprintln!(
            "sigma_m   on changed cells: occupied IoU {:.3} ({:.3} as if unchanged), mIoU {:.3} ({:.3}), mECE {:.3} ({:.3})",
            after.occupied_iou,
            before.occupied_iou,
            after.semantic_miou,
            before.semantic_miou,
            after.mece_occupancy,
            before.mece_occupancy
        );
        curve.validation(self.trainer.updates(), serde_json::json!({ "unchanged": before, "predicted": after }))?;
        Ok(2.0 - after.occupied_iou - after.semantic_miou)
    }
}
