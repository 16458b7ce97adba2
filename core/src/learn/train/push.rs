//! Training sigma_m: the frozen sigma_o over a sample's views gives the belief, then each of its pushes is to be predicted.
//!
//! The loss is that of occupancy and semantics after the push, mostly of the cells that it changes, plus that of the change mask (does anything of a floor cell
//! change, voxels or label), plus a small consistency term: where nothing changes the evidence is to stay as it was
//! (squared difference of the logarithms).

use super::TrainSettings;
use super::state::{self, State};
use crate::belief::{Carried, FloorPlan, SOLID};
use crate::cnabu::{
    Card, Cnabu, Evidence, Layout, LossForm, Mirror, Numbers, PushConfig, PushNet, PushPlanes, Pushed, WINDOW,
    Windowed, belief_of, observation_planes, occupancy_loss, push_planes, semantics_loss, windows,
};
use crate::learn::{Dataset, PushSample, PushedSample};
use crate::rng::stream;
use crate::scene::CLASS_COUNT;
use crate::{Error, Result};
use rand::Rng;
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use tch::nn::VarStore;
use tch::{Device, Kind, Tensor};

/// Sub-cells of a pixel.
const SUBS: usize = 4;
/// Memory for beliefs that are kept, bytes.
const BELIEFS_BYTES: usize = 6 << 30;
/// How much a floor cell that does not change counts beside one that does. Next to nothing: the posterior is gated with the
/// probability of change, so what is wanted is the prediction given that the cell changes. (With 0.1 about half of
/// the loss was of unchanged cells: the prediction was hedged towards them, and the gate hedged it once more.)
const UNCHANGED: f64 = 1e-3;
/// Weight of the consistency term.
const CONSISTENCY: f64 = 0.01;

/// The losses of a batch of pushes, nats per level, floor cell, and floor cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PushLoss {
    /// Of occupancy after the push.
    pub occupancy: f64,
    /// Of semantics after the push.
    pub semantics: f64,
    /// Of the change mask.
    pub change: f64,
}

/// A sigma_m in training. Its settings' `max_views` does not matter: a sample has the views that it has.
#[derive(Debug)]
pub struct PushTrainer {
    settings: TrainSettings,
    layout: Layout,
    net: PushNet,
    store: VarStore,
    state: State,
    /// What sigma_o makes of the samples seen so far.
    beliefs: Beliefs,
}

impl PushTrainer {
    /// A network with fresh weights, for samples over the grid of `layout`.
    ///
    /// # Errors
    /// [`Error::Usage`] for settings out of range.
    pub fn new(settings: TrainSettings, layout: Layout, device: Device) -> Result<Self> {
        settings.check()?;
        if layout.is_padded() {
            return Err(Error::Usage("training wants a floor plan of a multiple of 16 cells along x and y".to_owned()));
        }
        tch::manual_seed(settings.seed as i64);
        let store = VarStore::new(device);
        let net = PushNet::new(&store.root(), PushConfig { width: settings.width });
        let state = State::new(&store);
        Ok(Self { settings, layout, net, store, state, beliefs: Beliefs::default() })
    }

    /// Goes on with the run named `out`.
    ///
    /// # Errors
    /// For a run with other settings (names the first that differs), and a checkpoint that is missing or damaged.
    pub fn resume(out: &Path, settings: TrainSettings, layout: Layout, device: Device) -> Result<Self> {
        state::same_settings(out, &settings)?;
        Self::load(out, settings, layout, device)
    }

    /// Begins with the checkpoint of the run named `out`, whatever its settings were.
    ///
    /// # Errors
    /// For a checkpoint that is missing, damaged, or of another network.
    pub fn load(out: &Path, settings: TrainSettings, layout: Layout, device: Device) -> Result<Self> {
        let mut trainer = Self::new(settings, layout, device)?;
        trainer.state.load(out)?;
        Ok(trainer)
    }

    /// The settings of the run named `out`.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn logged_settings(out: &Path) -> Result<TrainSettings> {
        state::logged_settings(out)
    }

    /// Writes a checkpoint of the run named `out`, whole or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self, out: &Path) -> Result<()> {
        self.state.save(out, &self.settings)
    }

    /// Updates of the weights so far.
    pub fn updates(&self) -> u64 {
        self.state.updates
    }

    /// Number of parameters.
    pub fn parameters(&self) -> i64 {
        self.state.parameters()
    }

    /// The running mean of the weights by name.
    pub fn mean_weights(&self) -> Vec<(String, Tensor)> {
        self.state.mean_weights()
    }

    /// A card for the weights.
    pub fn card(&self) -> Card {
        Card::new("sigma_m", self.settings.width, self.parameters())
    }

    /// `observe` with the running mean of the weights as its sigma_m.
    pub fn with(&self, observe: Cnabu) -> Cnabu {
        let store = VarStore::new(self.store.device());
        let net = PushNet::new(&store.root(), PushConfig { width: self.settings.width });
        self.state.copy_mean(&store);
        observe.with_push(net, store)
    }

    /// Trains on the pushes of the next scenes, one update; `rate` scales the step size.
    ///
    /// # Errors
    /// When a sample cannot be read, and [`Error::Check`] when the loss is no longer finite.
    pub fn train(&mut self, data: &Dataset<PushSample>, observe: &Cnabu, rate: f64) -> Result<PushLoss> {
        let mut rng = stream(self.settings.seed, "push training batch", self.state.batches);
        let mut scenes = Vec::new();
        while scenes.len() < self.settings.batch {
            let (at, mirrored) = (rng.random_range(0..data.len()), rng.random());
            let sample = data.get(at)?;
            if !sample.pushes.is_empty() {
                let mirror = if mirrored { Mirror::X } else { Mirror::No };
                scenes.push(Scene::new(
                    &self.layout,
                    &sample,
                    mirror,
                    &self.beliefs.of(&self.layout, at, &sample, observe),
                ));
            }
        }
        let device = self.store.device();
        let stacked = |part: &dyn Fn(&Scene) -> Tensor| Tensor::cat(&scenes.iter().map(part).collect::<Vec<_>>(), 0);
        let stem = stacked(&|scene| windows(&self.net.prior_stem(&scene.evidence), &scene.xs));
        let prior = Evidence {
            occupancy: stacked(&|scene| windows(&scene.evidence.occupancy, &scene.xs)),
            semantics: stacked(&|scene| windows(&scene.evidence.semantics, &scene.xs)),
        };
        let put = |part: &dyn Fn(&Scene) -> Tensor| stacked(part).to_device(device);
        let pushes = PushPlanes {
            swept: put(&|s| s.pushes.swept.shallow_clone()),
            marks: put(&|s| s.pushes.marks.shallow_clone()),
            arriving: Evidence {
                occupancy: put(&|s| s.pushes.arriving.occupancy.shallow_clone()),
                semantics: put(&|s| s.pushes.arriving.semantics.shallow_clone()),
            },
        };
        let (truth, classes) = (put(&|s| s.truth.shallow_clone()), put(&|s| s.classes.shallow_clone()));
        let changed = put(&|s| s.changed.shallow_clone());

        let pushed = self.net.forward(&stem, &prior, &pushes);
        let ramp = (self.state.updates as f64 / self.settings.kl_ramp.max(1) as f64).min(1.0);
        let (loss, parts) = self.loss(&pushed, &prior, &Targets { truth, classes, changed }, ramp, &mut rng);
        if ![parts.occupancy, parts.semantics, parts.change].iter().all(|part| part.is_finite()) {
            let message = format!("training diverged: the loss of update {} is not finite", self.state.updates);
            return Err(Error::Check(message));
        }
        loss.backward();
        self.state.update(self.settings.learning_rate * rate, self.settings.mean_decay);
        self.state.batches += 1;
        Ok(parts)
    }

    fn loss(
        &self,
        pushed: &Pushed,
        prior: &Evidence,
        to: &Targets,
        ramp: f64,
        rng: &mut impl Rng,
    ) -> (Tensor, PushLoss) {
        let kl = self.settings.kl_weight * ramp;
        let at = [rng.random_range(0..2), rng.random_range(0..2)];
        let quarter = |t: &Tensor| t.slice(2, at[0], None, 2).slice(3, at[1], None, 2);
        let levels = pushed.occupancy.size()[1] / 2;
        let weights = (&to.changed + UNCHANGED) / (to.changed.mean(Kind::Float) + UNCHANGED);
        // `[B, 1, sub-cells, ...]`, so that it goes with levels and with classes.
        let weights = weights.unsqueeze(1);
        let by_level = |t: Tensor| {
            let size = t.size();
            t.view([size[0], -1, SUBS as i64, size[2], size[3]])
        };
        let side = |first: i64| by_level(quarter(&pushed.occupancy.narrow(1, first, levels)));
        let occupancy = occupancy_loss(
            &side(0),
            &side(levels),
            &by_level(quarter(&to.truth)),
            LossForm::Marginal,
            kl,
            Some(&weights.slice(3, at[0], None, 2).slice(4, at[1], None, 2)),
        );
        let size = pushed.semantics.size();
        let z = pushed.semantics.view([size[0], CLASS_COUNT as i64, SUBS as i64, size[2], size[3]]);
        let semantics = semantics_loss(&z, &to.classes, LossForm::Marginal, 0.0, Some(&weights));
        let half = |first: usize| pushed.change.narrow(1, (first * SUBS) as i64, SUBS as i64);
        let change = occupancy_loss(&half(0), &half(1), &to.changed, LossForm::Marginal, kl, None);

        let unchanged = (quarter(&to.changed) * -1.0 + 1.0).unsqueeze(1);
        let drift = quarter(&pushed.occupancy).softplus() - quarter(&prior.occupancy);
        let size = drift.size();
        let drift = drift.view([size[0], -1, SUBS as i64, size[2], size[3]]);
        let consistency = (&drift * &drift * unchanged).mean(Kind::Float);

        let loss = &occupancy + &semantics * self.settings.semantic_weight + &change + consistency * CONSISTENCY;
        let value = |tensor: &Tensor| tensor.double_value(&[]);
        let parts = PushLoss { occupancy: value(&occupancy), semantics: value(&semantics), change: value(&change) };
        (loss, parts)
    }
}

/// What the frozen sigma_o makes of a sample, and what its pushes carry along according to that.
#[derive(Debug)]
struct Prior {
    evidence: Evidence,
    carried: Arc<[Option<Carried>]>,
}

impl Prior {
    /// After the views of `sample`, with evidence rounded to 16 bits.
    fn of(layout: &Layout, sample: &PushSample, observe: &Cnabu) -> Self {
        let mut evidence = Evidence::uniform(1, layout.pixels().map(|n| n as i64), observe.device());
        for view in &sample.views {
            let (observed, labels) = observation_planes(layout, &view.observation, Mirror::No);
            evidence = observe.observe_planes(&evidence, &observed, &labels);
        }
        let evidence = evidence.to_kind(Kind::Half);
        let belief = belief_of(layout, &evidence.to_kind(Kind::Float));
        let plan = FloorPlan::new(&belief, SOLID);
        let carried = sample.pushes.iter().map(|pushed| Carried::by(&pushed.push, &belief, &plan)).collect();
        Self { evidence, carried }
    }

    /// The same with evidence of 32 bits: rounded, so that a run that is resumed is the run that was not stopped.
    fn single(&self) -> Self {
        Self { evidence: self.evidence.to_kind(Kind::Float), carried: Arc::clone(&self.carried) }
    }
}

/// The priors of the samples seen so far: as long as training lasts they stay the same, and take most of an update's time.
/// Kept up to [`BELIEFS_BYTES`]; what does not fit is made again.
#[derive(Debug, Default)]
struct Beliefs {
    kept: HashMap<usize, Prior>,
    bytes: usize,
}

impl Beliefs {
    /// The prior of sample `number`, not mirrored.
    fn of(&mut self, layout: &Layout, number: usize, sample: &PushSample, observe: &Cnabu) -> Prior {
        if let Some(kept) = self.kept.get(&number) {
            return kept.single();
        }
        let prior = Prior::of(layout, sample, observe);
        let single = prior.single();
        let bytes = 2 * (prior.evidence.occupancy.numel() + prior.evidence.semantics.numel());
        if self.bytes + bytes <= BELIEFS_BYTES {
            self.bytes += bytes;
            self.kept.insert(number, prior);
        }
        single
    }
}

/// What a batch is to come to, in windows.
struct Targets {
    truth: Tensor,
    classes: Tensor,
    changed: Tensor,
}

/// A sample in the network's layout: evidence of the whole floor plan, the rest in a window per push.
struct Scene {
    evidence: Evidence,
    xs: Vec<Range<usize>>,
    pushes: PushPlanes,
    truth: Tensor,
    classes: Tensor,
    changed: Tensor,
}

impl Scene {
    fn new(layout: &Layout, sample: &PushSample, mirror: Mirror, prior: &Prior) -> Self {
        let evidence = match mirror {
            Mirror::X => prior.evidence.mirrored(),
            Mirror::No => Evidence {
                occupancy: prior.evidence.occupancy.shallow_clone(),
                semantics: prior.evidence.semantics.shallow_clone(),
            },
        };
        let y = layout.pixels()[1] as i64;
        let around = |pushed: &PushedSample| {
            let x = layout.around(&pushed.push.push, WINDOW);
            if mirror == Mirror::X { layout.mirrored(&x) } else { x }
        };
        let xs: Vec<Range<usize>> = sample.pushes.iter().map(around).collect();
        let carried = prior.carried.iter().map(Option::as_ref);
        let windowed: Vec<_> = sample
            .pushes
            .iter()
            .zip(carried)
            .zip(&xs)
            .map(|((pushed, carried), x)| Windowed { push: &pushed.push, carried, x: x.clone() })
            .collect();
        let pushes = push_planes(layout, &Numbers::of(&evidence), &windowed, mirror);
        let plane = xs[0].len() * layout.pixels()[1];
        let levels = pushes.swept.size()[1] as usize;
        let (mut truth, mut classes, mut changed) = (Vec::new(), Vec::new(), Vec::new());
        for (pushed, x) in sample.pushes.iter().zip(&xs) {
            let mut after = vec![0.0_f32; levels * plane];
            layout.put_set(&pushed.truth, mirror, x.clone(), &mut after);
            truth.extend(after);
            let mut labels = vec![0_i64; SUBS * plane];
            layout.put_classes(&pushed.labels, mirror, x.clone(), &mut labels);
            classes.extend(labels);
            let mut mask = vec![0.0_f32; SUBS * plane];
            let by = sample.changed_by(pushed);
            layout.put_cells(|cell| by[cell], mirror, x.clone(), &mut mask);
            changed.extend(mask);
        }
        let shape = |channels: usize| [xs.len() as i64, channels as i64, xs[0].len() as i64, y];
        Self {
            evidence,
            pushes,
            truth: Tensor::from_slice(&truth).reshape(shape(levels)),
            classes: Tensor::from_slice(&classes).reshape(shape(SUBS)).unsqueeze(1),
            changed: Tensor::from_slice(&changed).reshape(shape(SUBS)),
            xs,
        }
    }
}
