//! The card of a data directory: everything that determines its samples.

use super::{Kind, Recipe, SAMPLES_PER_SHARD, Stretch, VIEWS};
use crate::files::write_atomically;
use crate::grid::Grid;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// File name of the card.
pub const NAME: &str = "card.toml";
/// Number of this layout of directory and records.
const FORMAT: u32 = 2;

/// The card: what the samples follow from, and how many there are to be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Card {
    format: u32,
    /// What the samples are.
    pub kind: Kind,
    /// Version of the program that began the directory.
    pub version: String,
    /// The directory's seed; each sample's own follows from it and the sample's number.
    pub seed: u64,
    /// Number of samples when all shards are there.
    pub count: usize,
    /// Samples in a shard; the last one may hold fewer.
    pub samples_per_shard: usize,
    /// Views in a sample.
    pub views_per_sample: usize,
    /// Name of the view array that they are drawn from.
    pub view_array: String,
    /// Numbers of voxels along x, y, z.
    #[serde(deserialize_with = "crate::fixed::array")]
    pub dims: [usize; 3],
    /// Edge of a voxel, metres.
    pub voxel_m: f32,
    /// Classes by number, background last.
    pub classes: Vec<String>,
    /// Range of the floor share that objects cover.
    #[serde(deserialize_with = "crate::fixed::array")]
    pub fill: [f32; 2],
    /// How strongly objects line up.
    pub rho: f32,
    /// Share of samples with sensor noise.
    pub noise_share: f32,
    /// The arm that carried out the pushes; maps have `none`.
    #[serde(default = "no_pusher")]
    pub pusher: String,
    /// Which samples have objects in other sizes.
    #[serde(default)]
    pub stretch: Stretch,
}

fn no_pusher() -> String {
    "none".to_owned()
}

impl Card {
    /// The card of `count` samples made with a recipe.
    pub fn new(kind: Kind, recipe: &Recipe, seed: u64, count: usize) -> Self {
        let grid = recipe.grid();
        let classes = recipe.catalog.classes.iter().map(|class| class.name.clone());
        Self {
            format: FORMAT,
            kind,
            version: crate::VERSION.to_owned(),
            seed,
            count,
            samples_per_shard: SAMPLES_PER_SHARD,
            views_per_sample: VIEWS,
            view_array: recipe.views.name.clone(),
            dims: grid.dims,
            voxel_m: grid.voxel_m,
            classes: classes.chain(["background".to_owned()]).collect(),
            fill: recipe.scenes.fill,
            rho: recipe.scenes.rho,
            noise_share: recipe.noise_share,
            pusher: match kind {
                Kind::Maps => no_pusher(),
                Kind::Pushes => recipe.arm.arm.name.clone(),
            },
            stretch: recipe.stretch,
        }
    }

    /// The grid of the samples.
    pub fn grid(&self) -> Grid {
        Grid::for_shelf(self.dims.map(|n| n as f32 * self.voxel_m), self.voxel_m)
    }

    /// The seed of sample `number`.
    pub fn sample_seed(&self, number: usize) -> u64 {
        crate::rng::derived_seed(self.seed, "data sample", number as u64)
    }

    /// Number of shards when all are there.
    pub fn shard_count(&self) -> usize {
        self.count.div_ceil(self.samples_per_shard)
    }

    /// The numbers of the samples of a shard.
    pub fn shard_samples(&self, shard: usize) -> std::ops::Range<usize> {
        let first = shard * self.samples_per_shard;
        first..(first + self.samples_per_shard).min(self.count)
    }

    /// Reads the card of a directory; `None` when it has none.
    ///
    /// # Errors
    /// For a card that cannot be read or is of another format.
    pub fn read(directory: &Path) -> Result<Option<Self>> {
        let path = directory.join(NAME);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Error::io(path, error)),
        };
        let card: Self = toml::from_str(&text).map_err(|error| {
            let line = error.span().map(|span| text[..span.start].lines().count().max(1));
            Error::input(&path, line.map_or(String::new(), |line| format!("line {line}")), error.message().to_owned())
        })?;
        let sane = card.format == FORMAT
            && (1..=1 << 20).contains(&card.samples_per_shard)
            && card.views_per_sample == VIEWS
            && card.dims.iter().all(|n| (1..=4096).contains(n))
            && card.voxel_m.is_finite()
            && card.voxel_m > 0.0;
        if !sane {
            return Err(Error::input(&path, "", format!("is no card of data in format {FORMAT}")));
        }
        Ok(Some(card))
    }

    /// Writes the card into its directory.
    pub fn write(&self, directory: &Path) -> Result<()> {
        let path = directory.join(NAME);
        let text = toml::to_string(self).map_err(|error| Error::input(&path, "", error.to_string()))?;
        write_atomically(&path, text.as_bytes())
    }

    /// Refuses a directory that was started with other settings; names the first that differs. The count may differ.
    pub fn same_recipe(&self, other: &Self, directory: &Path) -> Result<()> {
        let settings = |card: &Self| {
            [
                ("kind", card.kind.to_string()),
                ("seed", card.seed.to_string()),
                ("version", card.version.clone()),
                ("views", card.view_array.clone()),
                ("grid", format!("{:?} of {} m", card.dims, card.voxel_m)),
                ("classes", card.classes.join(" ")),
                ("fill", format!("{:?}", card.fill)),
                ("rho", card.rho.to_string()),
                ("noise", card.noise_share.to_string()),
                ("stretch", format!("{:?} of {}", card.stretch.range, card.stretch.share)),
                ("pushes by", card.pusher.clone()),
                ("samples_per_shard", card.samples_per_shard.to_string()),
            ]
        };
        for ((name, here), (_, there)) in settings(self).into_iter().zip(settings(other)) {
            if here != there {
                let message = format!("holds data with {name} {there}, not {here}; choose another directory");
                return Err(Error::input(directory, "", message));
            }
        }
        Ok(())
    }
}
