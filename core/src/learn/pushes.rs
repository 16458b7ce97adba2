//! Push samples: what is known of a scene after some views, pushes that the planner would consider then, and what each
//! of them really does.
//!
//! Pushes are sampled as the planner samples them, from the classical belief after the sample's views, and carried out
//! by the arm in copies of the same world. Pushes that drop an object are left out: an episode pushes no more after one.
//!
//! sigma_m predicts a push twice: when it is weighed, with the volume that it is planned to sweep, and after it is
//! done, with the volume that it really swept. The two differ where the arm was blocked; of such pushes, every other
//! sample has the latter.
//!
//! What some views see after the first of a sample's pushes is kept too: sigma_o has to learn how much of a predicted
//! belief to believe.

use super::bytes::{Reader, put_set};
use super::maps::{occupied, put_views, take_views};
use super::{Kind, Recipe, Record, Sample, VIEWS, ViewSample};
use crate::Result;
use crate::arm::ArmTool;
use crate::belief::{Belief, BeliefUpdate, Classical, FloorPlan, Intervention, SOLID};
use crate::grid::{Grid, VoxelSet};
use crate::rng::{derived_seed, stream};
use crate::skill::push::{Push, PushSampler, SweptPush, sample};
use crate::skill::{Candidate, Manipulation, SweptManipulation};
use crate::world::{TruthMap, World};
use rand::Rng;

/// Pushes that a sample holds at most.
pub const PUSHES: usize = 4;
/// Views after the first of a sample's pushes.
pub const VIEWS_AFTER: usize = 4;
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
/// sample, `swept`, `truth_after` (bits per push and voxel), `labels_after` (u8 per push and floor cell), and of the views
/// after the first push `views_after` u16 x 4, `view_labels_after`, `free_after`, `occupied_after` as before. Unused views
/// and pushes are zero.
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
    /// [`VIEWS_AFTER`] views after the first push, if there is one.
    pub after: Vec<ViewSample>,
}

impl PushSample {
    /// What a belief update is told of the pushes, in a belief.
    pub fn interventions(&self, belief: &Belief) -> Vec<Intervention> {
        let solid = FloorPlan::new(belief, SOLID);
        self.pushes.iter().map(|pushed| pushed.push.intervention(belief, &solid)).collect()
    }

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
        let candidates = sample(PushSampler::Frontier, &belief, None, &recipe.arm, PUSHES, &mut rng);
        let (mut pushes, mut after) = (Vec::new(), Vec::new());
        for candidate in candidates.into_iter().filter(|candidate| candidate.rejection.is_none()) {
            let mut world = world.clone();
            let Some(push) = carry_out(&mut world, &recipe.arm, candidate, seed % 2 == 1, &grid) else { continue };
            let bodies = world.bodies();
            if pushes.is_empty() {
                let seed = derived_seed(scene_seed, "views after", 0);
                after = recipe.look(world.shelf(), &bodies, VIEWS_AFTER, seed)?;
            }
            let truth = TruthMap::of(&grid, &bodies);
            pushes.push(PushedSample { push, truth: occupied(&grid, &truth), labels: truth.labels });
        }
        Ok(Self { seed, truth: occupied(&grid, &truth), labels: truth.labels, views, pushes, after })
    }
}

/// Carries out a push, and says what it was planned to sweep or, `as_done`, what it really swept; `None` when an object
/// drops.
fn carry_out(world: &mut World, arm: &ArmTool, candidate: Candidate, as_done: bool, grid: &Grid) -> Option<SweptPush> {
    let outcome = world.execute(&arm.arm, candidate.motion.as_ref()?);
    if !outcome.dropped.is_empty() {
        return None;
    }
    let SweptManipulation { manipulation, swept } = if as_done && outcome.stalled {
        candidate.manipulation.done(&outcome, &arm.arm, grid)
    } else {
        SweptManipulation { manipulation: candidate.manipulation, swept: candidate.swept }
    };
    match manipulation {
        Manipulation::Push(push) => Some(SweptPush { push, swept }),
        _ => None,
    }
}

/// Appends zeros.
fn pad(out: &mut Vec<u8>, count: usize) {
    out.resize(out.len() + count, 0);
}

/// Appends views as [`put_views`], each part padded to that of `count` views.
fn put_padded(out: &mut Vec<u8>, views: &[ViewSample], count: usize, sample: &PushSample) {
    let (cells, bits) = (sample.labels.len(), sample.truth.words().len() * 8);
    let mut packed = Vec::new();
    put_views(&mut packed, views);
    let (labels, sets) = packed.split_at(views.len() * cells);
    let (free, occupied) = sets.split_at(views.len() * bits);
    for (part, size) in [(labels, cells), (free, bits), (occupied, bits)] {
        out.extend(part);
        pad(out, (count - views.len()) * size);
    }
}

impl Sample for PushSample {
    fn simulate(recipe: &Recipe, seed: u64) -> Result<Self> {
        let mut sample = Self::attempt(recipe, seed, seed)?;
        for attempt in 1..TRIES {
            if !sample.pushes.is_empty() {
                break;
            }
            sample = Self::attempt(recipe, seed, derived_seed(seed, "push scene", attempt))?;
        }
        Ok(sample)
    }
}

impl Record for PushSample {
    const KIND: Kind = Kind::Pushes;

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
        put_padded(&mut out, &self.views, VIEWS, self);
        let (cells, bits) = (self.labels.len(), self.truth.words().len() * 8);
        let missing = PUSHES - self.pushes.len();
        self.pushes.iter().for_each(|pushed| put_set(&mut out, &pushed.push.swept));
        pad(&mut out, missing * bits);
        self.pushes.iter().for_each(|pushed| put_set(&mut out, &pushed.truth));
        pad(&mut out, missing * bits);
        self.pushes.iter().for_each(|pushed| out.extend(&pushed.labels));
        pad(&mut out, missing * cells);
        let ids = (0..VIEWS_AFTER).map(|at| self.after.get(at).map_or(0, |view| view.view.0));
        out.extend(ids.flat_map(u16::to_le_bytes));
        put_padded(&mut out, &self.after, VIEWS_AFTER, self);
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
        let ids = (0..VIEWS_AFTER).map(|_| reader.u16()).collect::<Option<Vec<_>>>()?;
        let mut seen_after = take_views(&mut reader, &ids)?;
        seen_after.truncate(if push_count == 0 { 0 } else { VIEWS_AFTER });
        let done = pushes.into_iter().zip(swept).zip(after.into_iter().zip(labels_after)).take(push_count);
        let pushes = done
            .map(|((push, swept), (truth, labels))| PushedSample { push: SweptPush { push, swept }, truth, labels })
            .collect();
        reader.is_done().then_some(Self { seed, truth, labels, views, pushes, after: seen_after })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::ViewArray;
    use crate::learn::Stretch;
    use crate::scene::{Catalog, GenerateConfig};
    use std::sync::Arc;

    #[test]
    fn a_sample_survives_its_record_and_its_last_views_see_what_the_push_left() {
        let scenes = GenerateConfig::default();
        let recipe = Recipe {
            catalog: Catalog::standard(),
            arm: Arc::new(ArmTool::standard(scenes.shelf)),
            scenes,
            views: ViewArray::named("standard300").expect("shipped"),
            noise_share: 0.0,
            stretch: Stretch::default(),
        };
        let sample = PushSample::simulate(&recipe, 3).expect("simulated");
        assert!(!sample.pushes.is_empty() && sample.after.len() == VIEWS_AFTER);
        let back = PushSample::from_bytes(&recipe.grid(), &sample.to_bytes()).expect("a record");
        assert_eq!((&back.views, &back.after), (&sample.views, &sample.after));
        assert_eq!((&back.truth, &back.labels), (&sample.truth, &sample.labels));
        for (back, pushed) in back.pushes.iter().zip(&sample.pushes) {
            assert_eq!((back.push.push, &back.truth, &back.labels), (pushed.push.push, &pushed.truth, &pushed.labels));
            assert!(back.push.swept == pushed.push.swept);
        }
        // What the views see as free was left free by the push; something of it was not free before.
        let seen = |truth: &VoxelSet| {
            let free = sample.after.iter().flat_map(|view| view.observation.free.iter());
            free.filter(|voxel| truth.contains(*voxel)).count()
        };
        let (before, after) = (seen(&sample.truth), seen(&sample.pushes[0].truth));
        assert!(after * 3 < before, "{after} voxels of things are seen through, {before} of what stood there before");
    }
}
