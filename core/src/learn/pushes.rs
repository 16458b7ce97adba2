//! Push samples: what is known of a scene after some views, pushes that the planner would consider then, and what each
//! of them really does.
//!
//! Pushes are sampled as the planner samples them, from the classical belief after the sample's views, and carried out
//! by the arm in copies of the same world. Pushes that drop an object are left out: an episode pushes no more after one.
//!
//! sigma_m is asked twice about a push: when it is weighed, with what it is planned to sweep, and when it is done, with
//! what it really swept. The two differ where the arm was blocked; of such pushes, every other sample has the latter.

use super::bytes::{Reader, put_set};
use super::maps::{occupied, put_views, take_views};
use super::{Kind, Recipe, Sample, VIEWS, ViewSample};
use crate::Result;
use crate::arm::ArmTool;
use crate::arm::Push;
use crate::belief::{Belief, BeliefUpdate, Classical, SweptPush};
use crate::grid::{Grid, VoxelSet};
use crate::push::{self, Candidate};
use crate::rng::stream;
use crate::world::{TruthMap, World};
use rand::Rng;

/// Pushes that a sample holds at most.
pub const PUSHES: usize = 4;
/// Scenes that are tried for one whose belief offers a push.
const TRIES: u64 = 8;

/// A push and what it left.
#[derive(Clone, Debug)]
pub struct PushedSample {
    /// The push and the voxels that its tool sweeps.
    pub push: SweptPush,
    /// Voxels inside objects afterwards.
    pub truth: VoxelSet,
    /// True class per floor cell afterwards.
    pub labels: Vec<u8>,
}

/// A scene seen from some views, and pushes.
///
/// Its record is `seed` u64, `view_count` and `push_count` u16, `views` u16 x 10, `pushes` f32 x 4 x 5 (start x y z in
/// metres, direction in degrees, length in metres), then `labels`, `truth`, `view_labels`, `free`, `occupied` as in a map
/// sample, and `swept`, `truth_after` (bits per push and voxel), `labels_after` (u8 per push and floor cell). Unused views and
/// pushes are zero.
#[derive(Clone, Debug)]
pub struct PushSample {
    /// The sample's own seed.
    pub seed: u64,
    /// Voxels inside objects before any push.
    pub truth: VoxelSet,
    /// True class per floor cell before any push.
    pub labels: Vec<u8>,
    /// One to [`VIEWS`] views.
    pub views: Vec<ViewSample>,
    /// One to [`PUSHES`] pushes, each from the same state.
    pub pushes: Vec<PushedSample>,
}

impl PushSample {
    /// Per floor cell whether a push of this sample changes anything: a voxel of its column, or its label.
    pub fn changed_by(&self, pushed: &PushedSample) -> Vec<bool> {
        let height = self.truth.voxel_count() / self.labels.len();
        let mut changed: Vec<bool> =
            self.labels.iter().zip(&pushed.labels).map(|(before, after)| before != after).collect();
        let differing = self.truth.words().iter().zip(pushed.truth.words()).enumerate();
        for (word, (before, after)) in differing.filter(|(_, (before, after))| before != after) {
            let mut bits = before ^ after;
            while bits != 0 {
                changed[(word * 64 + bits.trailing_zeros() as usize) / height] = true;
                bits &= bits - 1;
            }
        }
        changed
    }

    fn attempt(recipe: &Recipe, seed: u64, scene_seed: u64) -> Result<Self> {
        let world = recipe.world(scene_seed)?;
        let (grid, bodies) = (recipe.grid(), world.bodies());
        let truth = TruthMap::of(&grid, &bodies);
        let count = stream(scene_seed, "sample view count", 0).random_range(1..=VIEWS);
        let views = recipe.look(world.shelf(), &bodies, count, scene_seed)?;
        let belief =
            views.iter().fold(Belief::uniform(grid), |belief, view| Classical.observe(&belief, &view.observation));
        let mut rng = stream(scene_seed, "sample pushes", 0);
        let candidates = push::sample(&belief, &recipe.arm, PUSHES, &mut rng);
        let pushes = candidates
            .into_iter()
            .filter(|candidate| candidate.rejection.is_none())
            .filter_map(|candidate| pushed(&grid, &world, &recipe.arm, candidate, seed % 2 == 1))
            .collect();
        Ok(Self { seed, truth: occupied(&grid, &truth), labels: truth.labels, views, pushes })
    }
}

/// Carries out a push in a copy of the world, and says what it was planned to sweep or, `as_done`, what it really swept;
/// `None` when an object drops.
fn pushed(grid: &Grid, world: &World, arm: &ArmTool, candidate: Candidate, as_done: bool) -> Option<PushedSample> {
    let mut world = world.clone();
    let outcome = world.execute(&arm.arm, candidate.motion.as_ref()?);
    if !outcome.dropped.is_empty() {
        return None;
    }
    let push = if as_done && outcome.stalled {
        SweptPush::done(&candidate.swept.push, &outcome, &arm.arm, grid)
    } else {
        candidate.swept
    };
    let truth = TruthMap::of(grid, &world.bodies());
    Some(PushedSample { push, truth: occupied(grid, &truth), labels: truth.labels })
}

impl Sample for PushSample {
    const KIND: Kind = Kind::Pushes;

    fn simulate(recipe: &Recipe, seed: u64) -> Result<Self> {
        let mut sample = Self::attempt(recipe, seed, seed)?;
        for attempt in 1..TRIES {
            if !sample.pushes.is_empty() {
                break;
            }
            sample = Self::attempt(recipe, seed, crate::rng::derived_seed(seed, "push scene", attempt))?;
        }
        Ok(sample)
    }

    fn to_bytes(&self) -> Vec<u8> {
        let mut out = self.seed.to_le_bytes().to_vec();
        out.extend((self.views.len() as u16).to_le_bytes());
        out.extend((self.pushes.len() as u16).to_le_bytes());
        let ids = (0..VIEWS).map(|at| self.views.get(at).map_or(0, |view| view.view.0));
        out.extend(ids.flat_map(u16::to_le_bytes));
        for at in 0..PUSHES {
            let push = self
                .pushes
                .get(at)
                .map_or(Push { start: [0.0; 3], direction_deg: 0.0, length_m: 0.0 }, |p| p.push.push);
            let numbers = [push.start[0], push.start[1], push.start[2], push.direction_deg, push.length_m];
            out.extend(numbers.into_iter().flat_map(f32::to_le_bytes));
        }
        out.extend(&self.labels);
        put_set(&mut out, &self.truth);
        // Padded to the record's fixed size: what is missing is zero.
        let (cells, bits) = (self.labels.len(), self.truth.words().len() * 8);
        let pad = |out: &mut Vec<u8>, missing: usize, size: usize| out.resize(out.len() + missing * size, 0);
        let missing = VIEWS - self.views.len();
        let mut views = Vec::new();
        put_views(&mut views, &self.views);
        let (labels, sets) = views.split_at(self.views.len() * cells);
        let (free, occupied) = sets.split_at(self.views.len() * bits);
        for (part, size) in [(labels, cells), (free, bits), (occupied, bits)] {
            out.extend(part);
            pad(&mut out, missing, size);
        }
        let missing = PUSHES - self.pushes.len();
        self.pushes.iter().for_each(|pushed| put_set(&mut out, &pushed.push.swept));
        pad(&mut out, missing, bits);
        self.pushes.iter().for_each(|pushed| put_set(&mut out, &pushed.truth));
        pad(&mut out, missing, bits);
        self.pushes.iter().for_each(|pushed| out.extend(&pushed.labels));
        pad(&mut out, missing, cells);
        out
    }

    fn from_bytes(grid: &Grid, bytes: &[u8]) -> Option<Self> {
        let mut reader = Reader::new(grid, bytes);
        let (seed, view_count, push_count) = (reader.u64()?, usize::from(reader.u16()?), usize::from(reader.u16()?));
        if !(1..=VIEWS).contains(&view_count) || push_count > PUSHES {
            return None;
        }
        let ids = (0..VIEWS).map(|_| reader.u16()).collect::<Option<Vec<_>>>()?;
        let mut pushes = Vec::new();
        for _ in 0..PUSHES {
            let start = [reader.f32()?, reader.f32()?, reader.f32()?];
            pushes.push(Push { start, direction_deg: reader.f32()?, length_m: reader.f32()? });
        }
        let (labels, truth) = (reader.floor()?, reader.set()?);
        let mut views = take_views(&mut reader, &ids)?;
        views.truncate(view_count);
        let swept = (0..PUSHES).map(|_| reader.set()).collect::<Option<Vec<_>>>()?;
        let after = (0..PUSHES).map(|_| reader.set()).collect::<Option<Vec<_>>>()?;
        let labels_after = (0..PUSHES).map(|_| reader.floor()).collect::<Option<Vec<_>>>()?;
        let done = pushes.into_iter().zip(swept).zip(after.into_iter().zip(labels_after)).take(push_count);
        let pushes = done
            .map(|((push, swept), (truth, labels))| PushedSample { push: SweptPush { push, swept }, truth, labels })
            .collect();
        reader.is_done().then_some(Self { seed, truth, labels, views, pushes })
    }
}
