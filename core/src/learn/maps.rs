//! Map samples: a settled random scene, what ten random views of it see, and the truth.

use super::bytes::{Reader, put_set};
use super::{Kind, Record, Sample, VIEWS};
use crate::arm::ArmTool;
use crate::camera::{MapObservation, NoiseModel, View, ViewArray, ViewId, project, render};
use crate::grid::{Grid, VoxelSet};
use crate::rng::{ChaCha8Rng, stream};
use crate::scene::{Body, Catalog, GenerateConfig, Scene, Shelf, generate, rescale_if_room};
use crate::world::{TruthMap, World};
use crate::{Error, Result};
use rand::Rng;
use rand::seq::index;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What samples are made of, beside their seeds.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// The object classes.
    pub catalog: Catalog,
    /// The scenes.
    pub scenes: GenerateConfig,
    /// The views that observations are drawn from.
    pub views: ViewArray,
    /// The arm that carries out the pushes of push samples.
    pub arm: Arc<ArmTool>,
    /// Share of samples that are observed with [`NoiseModel::STANDARD`]; the others are without noise.
    pub noise_share: f32,
    /// Which samples have objects in other sizes than the catalogue's.
    pub stretch: Stretch,
}

/// Which samples have every object stretched, along each axis by a factor of its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stretch {
    /// Share of such samples.
    pub share: f32,
    /// Range of the factors.
    #[serde(deserialize_with = "crate::fixed::array")]
    pub range: [f32; 2],
}

impl Default for Stretch {
    /// None.
    fn default() -> Self {
        Self { share: 0.0, range: [0.8, 1.2] }
    }
}

impl Recipe {
    /// The grid of the samples.
    pub fn grid(&self) -> Grid {
        self.scenes.shelf.grid()
    }

    /// The scene of a sample, before it settles. One that is too full for its objects' stretches keeps their usual sizes.
    pub(super) fn scene(&self, seed: u64) -> Result<Scene> {
        let scene = generate(&self.catalog, &self.scenes, seed)?;
        if stream(seed, "sample stretch", 0).random::<f32>() >= self.stretch.share {
            return Ok(scene);
        }
        Ok(rescale_if_room(&scene, &self.catalog, self.stretch.range, seed)?.unwrap_or(scene))
    }

    /// The settled world of a sample.
    pub(super) fn world(&self, seed: u64) -> Result<World> {
        let scene = self.scene(seed)?;
        let mut world = World::new(scene.shelf, scene.bodies(&self.catalog)?);
        world.settle();
        Ok(world)
    }

    /// What `count` different random views see.
    pub(super) fn look(&self, shelf: &Shelf, bodies: &[Body], count: usize, seed: u64) -> Result<Vec<ViewSample>> {
        if self.views.views.len() < count {
            return Err(Error::Usage(format!("view array {}: has fewer than {count} views", self.views.name)));
        }
        let mut rng: ChaCha8Rng = stream(seed, "sample views", 0);
        let noisy = rng.random::<f32>() < self.noise_share;
        let noise = if noisy { NoiseModel::STANDARD } else { NoiseModel::OFF };
        let chosen = index::sample(&mut rng, self.views.views.len(), count);
        let sample = |(at, view): (usize, usize)| {
            let view = &self.views.views[view];
            let shoot = |view: &View| Ok(render(shelf, bodies, view, &self.views.intrinsics));
            let frame = noise.apply(&noise.aim(view, seed, at as u64, shoot)?, seed, at as u64);
            Ok(ViewSample { view: view.id, observation: project(&frame, shelf) })
        };
        chosen.iter().enumerate().map(sample).collect()
    }
}

/// One view of a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewSample {
    /// Which view.
    pub view: ViewId,
    /// What it says of the grid, as an episode feeds it to the belief.
    pub observation: MapObservation,
}

/// A scene seen from [`VIEWS`] views.
///
/// Its record is `seed` u64, `views` u16 x 10, `labels` u8 per floor cell, `truth` one bit per voxel, `view_labels` u8 per
/// view and floor cell (255 unobserved), `free` and `occupied` one bit per view and voxel; bits are packed lowest first.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSample {
    /// The sample's own seed.
    pub seed: u64,
    /// Voxels inside objects.
    pub truth: VoxelSet,
    /// True class per floor cell.
    pub labels: Vec<u8>,
    /// The views, in the order drawn.
    pub views: Vec<ViewSample>,
}

/// The voxels that a truth map marks as occupied.
pub(super) fn occupied(grid: &Grid, truth: &TruthMap) -> VoxelSet {
    let mut set = VoxelSet::empty(grid);
    truth.occupancy.iter().enumerate().filter(|(_, occupied)| **occupied != 0).for_each(|(at, _)| set.insert(at));
    set
}

/// Appends `views`: labels, then free bits, then occupied bits.
pub(super) fn put_views(out: &mut Vec<u8>, views: &[ViewSample]) {
    views.iter().for_each(|view| out.extend(&view.observation.labels));
    views.iter().for_each(|view| put_set(out, &view.observation.free));
    views.iter().for_each(|view| put_set(out, &view.observation.occupied));
}

/// Reads what [`put_views`] wrote.
pub(super) fn take_views(reader: &mut Reader<'_>, ids: &[u16]) -> Option<Vec<ViewSample>> {
    let labels = ids.iter().map(|_| reader.floor()).collect::<Option<Vec<_>>>()?;
    let free = ids.iter().map(|_| reader.set()).collect::<Option<Vec<_>>>()?;
    let occupied = ids.iter().map(|_| reader.set()).collect::<Option<Vec<_>>>()?;
    let observations = free.into_iter().zip(occupied).zip(labels);
    let views = ids.iter().zip(observations).map(|(&view, ((free, occupied), labels))| ViewSample {
        view: ViewId(view),
        observation: MapObservation { free, occupied, labels },
    });
    Some(views.collect())
}

impl Sample for MapSample {
    fn simulate(recipe: &Recipe, seed: u64) -> Result<Self> {
        let world = recipe.world(seed)?;
        let (grid, bodies) = (recipe.grid(), world.bodies());
        let truth = TruthMap::of(&grid, &bodies);
        let views = recipe.look(world.shelf(), &bodies, VIEWS, seed)?;
        Ok(Self { seed, truth: occupied(&grid, &truth), labels: truth.labels, views })
    }
}

impl Record for MapSample {
    const KIND: Kind = Kind::Maps;

    fn to_bytes(&self) -> Vec<u8> {
        let mut out = self.seed.to_le_bytes().to_vec();
        self.views.iter().for_each(|view| out.extend(view.view.0.to_le_bytes()));
        out.extend(&self.labels);
        put_set(&mut out, &self.truth);
        put_views(&mut out, &self.views);
        out
    }

    fn from_bytes(grid: &Grid, bytes: &[u8]) -> Option<Self> {
        let mut reader = Reader::new(grid, bytes);
        let seed = reader.u64()?;
        let ids = (0..VIEWS).map(|_| reader.u16()).collect::<Option<Vec<_>>>()?;
        let (labels, truth) = (reader.floor()?, reader.set()?);
        let views = take_views(&mut reader, &ids)?;
        reader.is_done().then_some(Self { seed, truth, labels, views })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe(stretch: Stretch) -> Recipe {
        let scenes = GenerateConfig { fill: [0.2, 0.2], ..GenerateConfig::default() };
        Recipe {
            catalog: Catalog::standard(),
            arm: Arc::new(ArmTool::standard(scenes.shelf)),
            scenes,
            views: ViewArray::named("standard300").expect("shipped"),
            noise_share: 0.0,
            stretch,
        }
    }

    #[test]
    fn a_share_of_the_samples_has_objects_in_other_sizes() {
        let [none, some] = [0.0, 0.4].map(|share| recipe(Stretch { share, range: [0.9, 1.1] }));
        let is_stretched = |seed: &u64| {
            let (usual, scene) = (none.scene(*seed).expect("a scene"), some.scene(*seed).expect("a scene"));
            assert!(usual.objects.iter().all(|object| object.scale == [1.0; 3]));
            let factors = || scene.objects.iter().flat_map(|object| object.scale);
            assert!(factors().all(|factor| (0.8999..=1.1001).contains(&factor)));
            // All of its objects, or it is the usual scene.
            let stretched = factors().filter(|factor| *factor != 1.0).count();
            assert!(scene == usual || stretched > 2 * scene.objects.len());
            scene != usual
        };
        let count = (0..60).filter(is_stretched).count();
        assert!((12..=36).contains(&count), "{count} of 60 at a share of 0.4");
    }

    #[test]
    fn a_scene_without_room_for_its_stretches_keeps_its_sizes() {
        let recipe = Recipe {
            scenes: GenerateConfig { fill: [0.5, 0.5], ..GenerateConfig::default() },
            ..recipe(Stretch { share: 1.0, range: [2.0, 2.0] })
        };
        assert!(recipe.scene(1).expect("a scene").objects.iter().all(|object| object.scale == [1.0; 3]));
    }
}
