//! What a training run does beside training: reports, checkpoints, validation, and stopping.

use super::curve::Curve;
use super::{SessionArgs, lineage};
use crate::commands::warn;
use nudge_core::Error;
use nudge_core::cnabu::{Device, Layout, Network, set_threads};
use nudge_core::learn::{Dataset, Sample, TrainSettings, Trainer, checkpoint_path};
use std::path::Path;
use std::time::{Duration, Instant};

/// A line of losses is printed and kept this often.
const REPORT_EVERY: Duration = Duration::from_secs(30);

/// A network in training, as a session sees it.
pub(super) trait Pupil {
    /// Trains a little; `rate` scales the step size.
    fn train(&mut self, rate: f64, curve: &mut Curve) -> nudge_core::Result<()>;
    /// Writes a checkpoint.
    fn save(&self, out: &Path) -> nudge_core::Result<()>;
    /// Updates of the weights so far.
    fn updates(&self) -> u64;
    /// Validates the running mean of the weights; returns the error, lower is better.
    fn validate(&self, curve: &mut Curve) -> anyhow::Result<f64>;
}

impl SessionArgs {
    /// The settings, with a network's own width and views.
    pub(super) fn settings(&self, width: i64, max_views: usize) -> TrainSettings {
        TrainSettings {
            seed: self.seed,
            width,
            batch: self.batch,
            learning_rate: self.learning_rate,
            max_views,
            kl_weight: self.kl,
            ..TrainSettings::default()
        }
    }

    /// Sets the threads and gives the device.
    pub(super) fn device(&self) -> nudge_core::Result<Device> {
        set_threads(self.threads);
        nudge_core::cnabu::device(&self.device)
    }

    /// The network at the start of the run: fresh, from its own checkpoint, from that of another run, or from finished
    /// weights. Refuses to write over a run that is there.
    pub(super) fn trainer<N: Network>(
        &self,
        settings: TrainSettings,
        layout: Layout,
        device: Device,
    ) -> nudge_core::Result<Trainer<N>> {
        let there = checkpoint_path(&self.out);
        if self.resume {
            return Trainer::resume(&self.out, settings, layout, device);
        }
        if there.exists() && !self.force {
            return Err(Error::input(there, "", "is there already; --resume goes on with it, --force replaces it"));
        }
        let weights = self.from.as_deref().filter(|from| is_weights(from));
        let trainer = match (weights, self.from.as_deref()) {
            (Some(weights), _) => Trainer::begin_with(weights, settings, layout, device)?,
            (None, Some(run)) => Trainer::load(run, settings, layout, device)?,
            (None, None) => Trainer::new(settings, layout, device)?,
        };
        lineage::keep(&self.out, weights, N::NAME)?;
        Ok(trainer)
    }

    /// The training data, and the validation data if there is some.
    pub(super) fn open<S: Sample>(&self) -> nudge_core::Result<(Dataset<S>, Option<Dataset<S>>)> {
        let data = open::<S>(&self.data)?;
        let mut val = self.val.as_deref().map(open::<S>).transpose()?;
        if let Some(val) = &mut val {
            val.truncate(self.validate_scenes);
        }
        Ok((data, val))
    }

    /// The step size's share: 1, and a half cosine down to 0 over the cooldown.
    fn rate(&self, updates: u64) -> f64 {
        let left = self.updates.map_or(u64::MAX, |end| end.saturating_sub(updates));
        if left >= self.cooldown {
            return 1.0;
        }
        0.5 - 0.5 * (std::f64::consts::PI * left as f64 / self.cooldown as f64).cos()
    }

    /// Trains until it is over.
    pub(super) fn run(&self, pupil: &mut dyn Pupil) -> anyhow::Result<()> {
        // Early, so that a place that cannot be written is told at once.
        pupil.save(&self.out)?;
        let mut curve = Curve::open(&self.out, self.resume, self.follow, pupil.updates())?;
        let (started, begun_at) = (Instant::now(), pupil.updates());
        let (mut reported, mut saved, mut validated) = (started, started, started);
        let (mut least, mut stale) = (f64::INFINITY, 0);
        while !self.is_over(pupil.updates(), started) {
            pupil.train(self.rate(pupil.updates()), &mut curve)?;
            if reported.elapsed() >= REPORT_EVERY {
                reported = Instant::now();
                curve.report(pupil.updates(), self.left(begun_at, pupil.updates(), started.elapsed()))?;
            }
            if saved.elapsed().as_secs_f64() >= 60.0 * self.checkpoint_minutes {
                saved = Instant::now();
                // The last checkpoint is still there; the next try may find room.
                if let Err(error) = pupil.save(&self.out) {
                    warn(&format!("no checkpoint: {error}"));
                }
            }
            if self.val.is_some() && validated.elapsed().as_secs_f64() >= 60.0 * self.validate_minutes {
                let error = pupil.validate(&mut curve)?;
                stale = if error < least { 0 } else { stale + 1 };
                least = least.min(error);
                if self.patience.is_some_and(|patience| stale >= patience) {
                    eprintln!("stopped: {stale} validations in a row did not improve");
                    break;
                }
                validated = Instant::now();
            }
        }
        pupil.save(&self.out)?;
        curve.report(pupil.updates(), None)?;
        if self.val.is_some() {
            pupil.validate(&mut curve)?;
        }
        crate::commands::print(&format!("{}: {} updates\n", checkpoint_path(&self.out).display(), pupil.updates()))
    }

    /// Time to the end that was asked for, as far as one was: `--patience` may stop it sooner.
    fn left(&self, begun_at: u64, updates: u64, elapsed: Duration) -> Option<Duration> {
        let (made, elapsed) = (updates.saturating_sub(begun_at) as f64, elapsed.as_secs_f64());
        let by_updates = self.updates.map(|end| elapsed * end.saturating_sub(updates) as f64 / made);
        let by_minutes = self.minutes.map(|minutes| (60.0 * minutes - elapsed).max(0.0));
        // What is no time, or longer than can be told, is left out.
        let times = by_updates.into_iter().chain(by_minutes).filter_map(|time| Duration::try_from_secs_f64(time).ok());
        times.min()
    }

    fn is_over(&self, updates: u64, started: Instant) -> bool {
        self.updates.is_some_and(|end| updates >= end)
            || self.minutes.is_some_and(|minutes| started.elapsed().as_secs_f64() >= 60.0 * minutes)
    }
}

/// Whether a path is of finished weights, not of a run.
pub(super) fn is_weights(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "safetensors")
}

/// Opens a data directory and names what it has to skip.
pub(super) fn open<S: Sample>(directory: &Path) -> nudge_core::Result<Dataset<S>> {
    let data = Dataset::open(directory)?;
    data.skipped().iter().for_each(|skipped| warn(&format!("skipped: {skipped}")));
    Ok(data)
}
