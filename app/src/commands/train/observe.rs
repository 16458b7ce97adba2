//! `nudge train observe`.

use super::ObserveArgs;
use super::curve::Curve;
use super::session::{Begin, Pupil};
use crate::commands::calibrate;
use nudge_core::cnabu::Layout;
use nudge_core::learn::{Dataset, MapSample, Trainer, evaluate};
use std::path::Path;

struct Observer {
    trainer: Trainer,
    data: Dataset<MapSample>,
    val: Option<Dataset<MapSample>>,
}

pub(super) fn run(args: &ObserveArgs) -> anyhow::Result<()> {
    let session = &args.session;
    let device = session.device()?;
    let (data, val) = session.open::<MapSample>()?;
    let (settings, layout) = (session.settings(args.width, args.max_views), Layout::new(&data.grid())?);
    let trainer = match session.begin()? {
        Begin::Fresh => Trainer::new(settings, layout, device)?,
        Begin::From(run) => Trainer::load(run, settings, layout, device)?,
        Begin::Resume => Trainer::resume(&session.out, settings, layout, device)?,
    };
    let (parameters, updates) = (trainer.parameters(), trainer.updates());
    eprintln!("sigma_o: {parameters} parameters, {} scenes, {updates} updates so far", data.len());
    session.run(&mut Observer { trainer, data, val })
}

impl Pupil for Observer {
    fn train(&mut self, rate: f64, curve: &mut Curve) -> nudge_core::Result<()> {
        for loss in self.trainer.train(&self.data, rate)? {
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
        let scores = calibrate::scored(&evaluate(val, &self.trainer.update(), &mut |_| ())?);
        eprint!("{}", calibrate::table("sigma_o", &scores));
        curve.validation(self.trainer.updates(), serde_json::to_value(&scores)?)?;
        Ok(scores.iter().map(|s| 2.0 - s.occupancy_iou - s.semantic_miou).sum::<f64>() / scores.len() as f64)
    }
}
