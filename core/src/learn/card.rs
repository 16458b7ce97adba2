//! The card of a data directory: everything that determines its samples.

use super::worth::{self, WorthRecipe};
use super::{Kind, Recipe, SAMPLES_PER_SHARD, Stretch, VIEWS};
use crate::belief::{Weights, short};
use crate::files::write_atomically;
use crate::grid::Grid;
use crate::scene::Family;
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
    /// Views in a sample; of what pushes are worth the most looks that come before a state.
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
    /// What else determines states and pushes, of data of what pushes are worth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worth: Option<WorthCard>,
}

/// What determines states and pushes beside what every card has ([`super::worth`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorthCard {
    /// The families that shelves are drawn from, each as often as it is listed.
    pub families: Vec<Family>,
    /// States of each episode.
    pub states_per_episode: usize,
    /// Pushes from each state, where so many are feasible.
    pub pushes_per_state: usize,
    /// Share of states for which it is filed too what the map gains by some pushes.
    pub followed_share: f32,
    /// Name of the belief update.
    pub belief: String,
    /// What a record holds, in order.
    pub record: Vec<String>,
    /// Weights of its networks, none for an update without any.
    pub weights: Weights,
}

/// Views in a sample of a kind.
fn views_of(kind: Kind) -> usize {
    if kind == Kind::Worth { worth::MOST_LOOKS } else { VIEWS }
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
                Kind::Pushes | Kind::Worth => recipe.arm.arm.name.clone(),
            },
            stretch: recipe.stretch,
            worth: None,
        }
    }

    /// The card of `count` states made with a recipe.
    pub fn of_worth(recipe: &WorthRecipe, seed: u64, count: usize) -> Self {
        let fills = recipe.families.iter().map(|family| family.fill());
        let [low, high] =
            fills.fold([f32::INFINITY, 0.0_f32], |[low, high], fill| [low.min(fill[0]), high.max(fill[1])]);
        Self {
            samples_per_shard: 1,
            views_per_sample: views_of(Kind::Worth),
            fill: [low, high],
            worth: Some(WorthCard {
                families: recipe.families.clone(),
                states_per_episode: worth::STATES_PER_EPISODE,
                pushes_per_state: recipe.pushes,
                followed_share: recipe.followed_share,
                belief: recipe.update.name().to_owned(),
                weights: recipe.update.networks_used().map(|used| used.weights).unwrap_or_default(),
                record: worth::LAYOUT.iter().map(|line| (*line).to_owned()).collect(),
            }),
            ..Self::new(Kind::Worth, &recipe.base, seed, count)
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
            && card.views_per_sample == views_of(card.kind)
            && (card.kind == Kind::Worth) == card.worth.is_some()
            && card.dims.iter().all(|n| (1..=4096).contains(n))
            && card.voxel_m.is_finite()
            && card.voxel_m > 0.0;
        if !sane {
            return Err(Error::input(&path, "", format!("is no card of data in format {FORMAT}")));
        }
        Ok(Some(card))
    }

    /// Begins a directory of a kind with this card, or goes on with the one that is there.
    ///
    /// # Errors
    /// For a card of another kind, a directory that was started with other settings, and what cannot be written.
    pub(super) fn begin(&self, kind: Kind, directory: &Path) -> Result<()> {
        if self.kind != kind {
            return Err(Error::Usage(format!("a card of {} for samples of {kind}", self.kind)));
        }
        std::fs::create_dir_all(directory).map_err(|error| Error::io(directory, error))?;
        match Self::read(directory)? {
            Some(there) => {
                self.same_recipe(&there, directory)?;
                if there.count < self.count {
                    self.write(directory)?;
                }
                Ok(())
            }
            None => self.write(directory),
        }
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
        let of_worth = |card: &Self| {
            let worth = card.worth.as_ref();
            let words = |of: &dyn Fn(&WorthCard) -> String| worth.map_or_else(String::new, of);
            let [sigma_o, sigma_m] = [|w: &Weights| w.sigma_o.clone(), |w: &Weights| w.sigma_m.clone()];
            let hash = |hash: Option<String>| hash.map_or("none".to_owned(), |hash| short(&hash).to_owned());
            [
                ("families", words(&|w| w.families.iter().map(Family::to_string).collect::<Vec<_>>().join(","))),
                ("pushes per state", words(&|w| w.pushes_per_state.to_string())),
                ("states per episode", words(&|w| w.states_per_episode.to_string())),
                ("share that is followed", words(&|w| w.followed_share.to_string())),
                ("belief", words(&|w| w.belief.clone())),
                ("weights sigma_o", words(&|w| hash(sigma_o(&w.weights)))),
                ("weights sigma_m", words(&|w| hash(sigma_m(&w.weights)))),
                ("record", words(&|w| w.record.join("; "))),
            ]
        };
        let all = |card: &Self| settings(card).into_iter().chain(of_worth(card));
        for ((name, here), (_, there)) in all(self).zip(all(other)) {
            if here != there {
                let message = format!("holds data with {name} {there}, not {here}; choose another directory");
                return Err(Error::input(directory, "", message));
            }
        }
        Ok(())
    }
}
