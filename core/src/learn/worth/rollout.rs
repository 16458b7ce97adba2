//! An episode on the way from state to state.

use super::considered::Considered;
use super::{STATES_PER_EPISODE, WorthRecipe};
use crate::Result;
use crate::belief::{Belief, FloorPlan, Intervention, SOLID, Sightings, look};
use crate::camera::{HiddenWatch, NoiseModel, View, ViewId, project, render};
use crate::gain::{Openings, RayDensity, ViewPair};
use crate::learn::Recipe;
use crate::plan::{Counted, Gain, coarse, disturbance};
use crate::rng::{derived_seed, stream};
use crate::scene::{Family, GenerateConfig};
use crate::skill::Candidate;
use crate::skill::push::{PushSampler, sample};
use crate::world::World;
use rand::Rng;
use std::cell::OnceCell;
use std::ops::RangeInclusive;

/// One of so many pushes is drawn before what is hidden, the others from the frontier.
const ONE_HIDDEN_IN: usize = 4;
/// Chance of a push before a state, the first one left out.
const PUSH_CHANCE: f32 = 0.6;
/// Looks before a state at most.
const LOOKS: usize = 3;
/// Hidden objects that a shelf is drawn to have at least: a number from this range.
const HIDDEN: RangeInclusive<usize> = 1..=6;
/// Shelves that are drawn at most for one that hides so many.
const DRAWS: u64 = 16;

/// What happens before a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leg {
    /// The push that comes first, if one does.
    pub push: Option<Earlier>,
    /// The looks that follow.
    pub looks: usize,
}

/// Which push of the state before is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Earlier {
    /// The one that promises most.
    Best,
    /// The one at this share of their list.
    AtRandom(f32),
}

/// What happens in the episode of a seed.
pub(super) fn legs(seed: u64) -> [Leg; STATES_PER_EPISODE] {
    let mut rng = stream(seed, "worth legs", 0);
    std::array::from_fn(|leg| {
        let (pushes, best, which): (f32, bool, f32) = (rng.random(), rng.random(), rng.random());
        let push = if best { Earlier::Best } else { Earlier::AtRandom(which) };
        let looks = rng.random_range(1..=LOOKS);
        Leg { push: (leg > 0 && pushes < PUSH_CHANCE).then_some(push), looks }
    })
}

/// A settled shelf that hides so many objects, or of those that are drawn the one that hides most: most shelves hide too little for
/// a push to show anything.
fn world_that_hides(recipe: &Recipe, wanted: usize, seed: u64) -> Result<World> {
    let mut best: Option<(usize, u64)> = None;
    for draw in 0..DRAWS {
        let seed = derived_seed(seed, "worth shelf", draw);
        let scene = recipe.scene(seed)?;
        let hidden = HiddenWatch::new(&scene.shelf, &scene.bodies(&recipe.catalog)?, &recipe.views).hidden().len();
        if best.is_none_or(|(most, _)| hidden > most) {
            best = Some((hidden, seed));
        }
        if hidden >= wanted {
            break;
        }
    }
    recipe.world(best.map_or(seed, |(_, seed)| seed))
}

/// An episode as far as it has come. A clone is a branch.
#[derive(Clone)]
pub(super) struct Rollout<'a> {
    pub recipe: &'a WorthRecipe,
    pub seed: u64,
    pub family: Family,
    pub world: World,
    pub belief: Belief,
    pub sightings: Sightings,
    /// Views that were looked from, in order.
    pub looks: Vec<u16>,
    pub pushes: u8,
    pub noise: NoiseModel,
    /// Whether an object was dropped.
    dropped: bool,
    /// Views used since the last push.
    used: Vec<ViewId>,
    /// Views that the hand cannot be at.
    unreachable: Vec<ViewId>,
    /// Chance that a look is a random one.
    random_looks: f32,
    actions: u64,
    /// [`Self::best_views`], once it is known.
    best: OnceCell<(Option<ViewPair>, f32)>,
}

impl<'a> Rollout<'a> {
    /// The episode of a seed, before anything is seen.
    pub fn new(recipe: &'a WorthRecipe, seed: u64) -> Result<Self> {
        let base = &recipe.base;
        let mut rng = stream(seed, "worth episode", 0);
        let family = recipe.families[rng.random_range(0..recipe.families.len())];
        let noisy = rng.random::<f32>() < base.noise_share;
        let random_looks = [0.0, 0.0, 0.5, 1.0][rng.random_range(0..4_usize)];
        let scenes = GenerateConfig { fill: family.fill(), rho: family.rho(), family, ..base.scenes.clone() };
        let world = world_that_hides(&Recipe { scenes, ..base.clone() }, rng.random_range(HIDDEN), seed)?;
        let grid = base.grid();
        let hands = base.views.hand_poses(&base.arm);
        Ok(Self {
            recipe,
            seed,
            family,
            world,
            belief: Belief::uniform(grid),
            sightings: Sightings::none(&grid),
            looks: Vec::new(),
            pushes: 0,
            noise: if noisy { NoiseModel::STANDARD } else { NoiseModel::OFF },
            dropped: false,
            used: Vec::new(),
            unreachable: base.views.unreachable(&hands),
            random_looks,
            actions: 0,
            best: OnceCell::new(),
        })
    }

    /// The views that the hand can be at.
    pub fn offered(&self) -> Vec<ViewId> {
        let all = self.recipe.base.views.views.iter().map(|view| view.id);
        all.filter(|view| !self.unreachable.contains(view)).collect()
    }

    /// The best two views, as the planner would choose them, and what they promise together, nats.
    pub fn best_views(&self) -> (Option<ViewPair>, f32) {
        *self.best.get_or_init(|| self.find_best_views())
    }

    fn find_best_views(&self) -> (Option<ViewPair>, f32) {
        let offered = |view: &ViewId| !self.used.contains(view) && !self.unreachable.contains(view);
        let gain = Gain::new(Counted::Unseen, &self.belief, self.sightings.seen());
        let looking = gain.of_looking(&self.recipe.base.views, offered);
        (looking.pair, looking.igv)
    }

    /// Draws pushes from here and weighs them.
    pub fn considered(&self) -> Considered {
        let (belief, seen) = (&self.belief, self.sightings.seen());
        let (base, wanted) = (&self.recipe.base, self.recipe.pushes);
        let of_hidden = wanted / ONE_HIDDEN_IN;
        let (mut pushes, mut samplers) = (Vec::new(), Vec::new());
        let draws = [(PushSampler::Frontier, wanted - of_hidden), (PushSampler::Hidden, of_hidden)];
        for (which, (sampler, count)) in draws.into_iter().enumerate() {
            let mut rng = stream(self.seed, "worth pushes", (2 * self.looks.len() + which) as u64);
            let drawn = sample(sampler, belief, Some(seen), &base.arm, count, &mut rng);
            let feasible = drawn.into_iter().filter(|candidate| candidate.rejection.is_none());
            pushes.extend(feasible);
            samplers.resize(pushes.len(), sampler);
        }
        let solid = FloorPlan::new(belief, SOLID);
        let told = |push: &Candidate| push.manipulation.skill().intervention(belief, &solid, push.swept.clone());
        let interventions: Vec<Intervention> = pushes.iter().map(told).collect();
        let predictions = self.recipe.update.predict(belief, &interventions);
        let gain = Gain::new(Counted::Unseen, belief, seen);
        let openings = Openings::new(gain.field(), &base.views, &coarse(&self.offered()), RayDensity::COARSE);
        let gains = openings.under_each(&predictions);
        let regs = predictions.iter().map(|prediction| disturbance(belief, prediction)).collect();
        let arm = &base.arm.arm;
        let duration = |push: &Candidate| push.motion.as_ref().map_or(0.0, |motion| motion.duration_s(arm) as f32);
        let motions_s = pushes.iter().map(duration).collect();
        Considered { pushes, samplers, predictions, gains, regs, motions_s }
    }

    /// Looks once, in the way of this episode.
    pub fn look(&mut self) {
        let mut rng = stream(self.seed, "worth looks", self.actions);
        if rng.random::<f32>() < self.random_looks {
            let offered = self.offered();
            let unused: Vec<ViewId> = offered.iter().copied().filter(|view| !self.used.contains(view)).collect();
            let from = if unused.is_empty() { offered } else { unused };
            if !from.is_empty() {
                self.look_from(from[rng.random_range(0..from.len())]);
            }
        } else {
            self.look_best();
        }
    }

    /// Looks from the view that tells most.
    pub fn look_best(&mut self) {
        let first_unused = || self.offered().into_iter().find(|view| !self.used.contains(view));
        let chosen = self.best_views().0.map(|pair| pair.first).or_else(first_unused);
        self.look_from(chosen.unwrap_or(ViewId(0)));
    }

    fn look_from(&mut self, view: ViewId) {
        let (views, update) = (&self.recipe.base.views, &self.recipe.update);
        let Some(view) = views.view(view) else { return };
        let shelf = *self.world.shelf();
        self.actions += 1;
        let bodies = self.world.bodies();
        let shoot = |view: &View| Ok(render(&shelf, &bodies, view, &views.intrinsics));
        let Ok(sensed) = self.noise.aim(view, self.seed, self.actions, shoot) else { return };
        let observation = project(&self.noise.apply(&sensed, self.seed, self.actions), &shelf);
        self.belief = look(&**update, &self.belief, &observation, &mut self.sightings);
        self.used.push(view.id);
        self.looks.push(view.id.0);
        self.best = OnceCell::new();
    }

    /// Makes one of the pushes that are considered, if one is and nothing was dropped before.
    pub fn push(&mut self, considered: &Considered, which: Earlier) {
        let count = considered.pushes.len();
        let chosen = match which {
            Earlier::Best => considered.best(),
            Earlier::AtRandom(share) => (count > 0).then(|| ((share * count as f32) as usize).min(count - 1)),
        };
        if let (Some(at), false) = (chosen, self.dropped) {
            self.make(considered, at);
        }
    }

    /// Makes the push at a position of those that are considered.
    pub fn make(&mut self, considered: &Considered, at: usize) {
        let Some(motion) = &considered.pushes[at].motion else { return };
        let arm = &self.recipe.base.arm.arm;
        let outcome = self.world.execute(arm, motion);
        self.actions += 1;
        self.pushes += 1;
        self.used.clear();
        self.best = OnceCell::new();
        self.dropped |= !outcome.dropped.is_empty();
        let swept = considered.pushes[at].manipulation.done(&outcome, arm, &self.belief.grid);
        let predicted = self.recipe.update.predict(&self.belief, &[swept.intervention(&self.belief)]);
        for prediction in predicted {
            self.belief.apply(&prediction);
            self.sightings.forget_changed(&prediction);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_have_one_to_twelve_looks_and_up_to_three_pushes_behind_them() {
        let mut pushes = [0; 4];
        for seed in 0..200 {
            let legs = legs(seed);
            assert!(legs.iter().all(|leg| (1..=LOOKS).contains(&leg.looks)) && legs[0].push.is_none());
            pushes[legs.iter().filter(|leg| leg.push.is_some()).count()] += 1;
        }
        assert!(pushes.iter().all(|count| *count >= 5), "{pushes:?}");
    }
}
