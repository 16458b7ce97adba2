//! Training sigma_m: the frozen sigma_o over a sample's views gives the belief, then each of its pushes is to be predicted.
//!
//! The loss is that of occupancy and semantics after the push, mostly of the cells that it changes, plus that of the change
//! mask (does anything of a floor cell change, voxels or label), plus a small consistency term: where nothing changes the
//! evidence is to stay as it was (squared difference of the logarithms).

use super::Trainer;
use super::kept::Kept;
use crate::Result;
use crate::belief::{Moved, Stroke};
use crate::cnabu::{
    Cnabu, Evidence, Layout, LossForm, Mirror, Numbers, PriorParts, PushNet, PushPlanes, Pushed, SUBS, WINDOW,
    Windowed, belief_of, observation_planes, occupancy_loss, push_planes, semantics_loss, windows,
};
use crate::learn::{Dataset, PushSample};
use crate::rng::stream;
use crate::scene::CLASS_COUNT;
use rand::Rng;
use std::ops::Range;
use std::sync::Arc;
use tch::{Kind, Tensor};

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
pub type PushTrainer = Trainer<PushNet>;

impl PushTrainer {
    /// `observe` with the running mean of the weights as its sigma_m.
    pub fn with(&self, observe: Cnabu) -> Cnabu {
        let (net, store) = self.mean_net();
        observe.with_push(net, store, 1.0)
    }

    /// Trains on the pushes of the next scenes, one update; `rate` scales the step size.
    ///
    /// # Errors
    /// When a sample cannot be read, and [`crate::Error::Check`] when the loss is no longer finite.
    pub fn train(&mut self, data: &Dataset<PushSample>, priors: &mut Priors, rate: f64) -> Result<PushLoss> {
        let mut rng = stream(self.settings.seed, "push training batch", self.state.batches);
        let mut scenes = Vec::new();
        while scenes.len() < self.settings.batch {
            let (at, mirror) = (rng.random_range(0..data.len()), Mirror::either(&mut rng));
            let sample = data.get(at)?;
            if !sample.pushes.is_empty() {
                scenes.push(Scene::new(&self.layout, &sample, mirror, &priors.of(&self.layout, at, &sample)));
            }
        }
        let device = self.store.device();
        let stacked = |part: &dyn Fn(&Scene) -> Tensor| Tensor::cat(&scenes.iter().map(part).collect::<Vec<_>>(), 0);
        let parts: Vec<PriorParts> =
            scenes.iter().map(|scene| self.net.prior_parts(&scene.evidence).windows(&scene.xs)).collect();
        let parts = PriorParts::stacked(&parts);
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

        let pushed = self.net.forward(&parts, &prior, &pushes);
        let (loss, parts) = self.loss(&pushed, &prior, &Targets { truth, classes, changed }, &mut rng);
        self.descend(&loss, &[parts.occupancy, parts.semantics, parts.change], rate)?;
        self.state.batches += 1;
        Ok(parts)
    }

    fn loss(&self, pushed: &Pushed, prior: &Evidence, to: &Targets, rng: &mut impl Rng) -> (Tensor, PushLoss) {
        let kl = self.kl();
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

/// The belief of the frozen sigma_o after the views of a sample, and the objects that its pushes move according to that
/// belief.
#[derive(Debug)]
struct Prior {
    evidence: Evidence,
    moved: Arc<[Moved]>,
}

impl Prior {
    /// After the views of `sample`, with evidence rounded to 16 bits.
    fn of(layout: &Layout, sample: &PushSample, observe: &Cnabu) -> Self {
        let mut evidence = Evidence::uniform(1, layout.pixels().map(|n| n as i64), observe.device());
        for view in &sample.views {
            let (observed, labels) = observation_planes(layout, &view.observation, Mirror::No);
            evidence = observe.observe_planes(layout, &evidence, &observed, &labels);
        }
        let evidence = evidence.to_kind(Kind::Half);
        let belief = belief_of(layout, &evidence.to_kind(Kind::Float));
        let interventions = sample.interventions(&belief);
        let moved = interventions.iter().map(|intervention| intervention.flow.moved(layout.grid())).collect();
        Self { evidence, moved }
    }

    /// The same with evidence of 32 bits: rounded, so that a run that is resumed is the run that was not stopped.
    fn single(&self) -> Self {
        Self { evidence: self.evidence.to_kind(Kind::Float), moved: Arc::clone(&self.moved) }
    }
}

/// The frozen sigma_o and its beliefs after the views of the samples seen so far: they do not change during training,
/// and computing them takes most of an update's time.
#[derive(Debug)]
pub struct Priors {
    observe: Cnabu,
    kept: Kept<Prior>,
}

impl Priors {
    /// Those of a sigma_o, of samples of one data directory.
    pub fn of_network(observe: Cnabu) -> Self {
        Self { observe, kept: Kept::default() }
    }

    /// The sigma_o.
    pub fn network(&self) -> &Cnabu {
        &self.observe
    }

    /// The prior of sample `number`, not mirrored.
    fn of(&mut self, layout: &Layout, number: usize, sample: &PushSample) -> Prior {
        let observe = &self.observe;
        self.kept.of(number, || Prior::of(layout, sample, observe), |prior| prior.evidence.bytes()).single()
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
        let strokes: Vec<Stroke> = sample.pushes.iter().map(|pushed| pushed.push.push.stroke()).collect();
        let around = |stroke: &Stroke| {
            let x = layout.around(stroke, WINDOW);
            if mirror == Mirror::X { layout.mirrored(&x) } else { x }
        };
        let xs: Vec<Range<usize>> = strokes.iter().map(around).collect();
        let windowed: Vec<_> = sample
            .pushes
            .iter()
            .zip(&strokes)
            .zip(prior.moved.iter())
            .zip(&xs)
            .map(|(((pushed, stroke), moved), x)| Windowed { swept: &pushed.push.swept, stroke, moved, x: x.clone() })
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
