//! Weights in files: safetensors with a card beside them.

use super::Scored;
use super::layout::LEVELS;
use super::net::{Network, seeded};
use crate::files::{target_of, temporary_of, write_atomically};
use crate::scene::{CLASS_COUNT, Catalog};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use tch::nn::VarStore;
use tch::{Device, Kind, Tensor};

/// Number of this kind of card and of the networks that it is about.
const FORMAT: u32 = 1;
/// Name of the number of updates in [`Card::training`].
pub const UPDATES: &str = "updates";

/// What weights are: which network they are of, what they were trained on, and how well they do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Card {
    format: u32,
    /// `sigma_o` or `sigma_m`.
    pub network: String,
    /// Version of the program that trained them.
    pub version: String,
    /// Edge of a voxel, metres.
    pub voxel_m: f32,
    /// Levels of the networks.
    pub levels: usize,
    /// Channels of the U-Net's first level.
    pub width: i64,
    /// Classes by number, background last.
    pub classes: Vec<String>,
    /// Number of parameters.
    pub parameters: i64,
    /// Directory of the training data, its seed and number of samples; the validation data's.
    #[serde(default)]
    pub data: BTreeMap<String, String>,
    /// The settings of the training run and how far it went.
    #[serde(default)]
    pub training: BTreeMap<String, String>,
    /// Of sigma_m: what the log-odds of its probabilities of change are divided by (temperature scaling, Guo et al. 2017),
    /// fitted on validation pushes; 1 if it is not there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub change_temperature: Option<f32>,
    /// Of sigma_m: scores on the floor cells that held-out pushes change, beside those of other predictions.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub pushes: BTreeMap<String, f64>,
    /// Of sigma_o: scores on held-out scenes.
    #[serde(default, rename = "score", skip_serializing_if = "Vec::is_empty")]
    pub scores: Vec<Scored>,
}

impl Card {
    /// A card of a network of this build.
    pub fn new(network: &str, width: i64, parameters: i64) -> Self {
        Self {
            format: FORMAT,
            network: network.to_owned(),
            version: crate::VERSION.to_owned(),
            voxel_m: 0.005,
            levels: LEVELS,
            width,
            classes: class_names(),
            parameters,
            data: BTreeMap::new(),
            training: BTreeMap::new(),
            change_temperature: None,
            pushes: BTreeMap::new(),
            scores: Vec::new(),
        }
    }

    /// Reads the card beside `weights` and refuses one of another network, grid or class list.
    pub fn read(weights: &Path, network: &str) -> Result<Self> {
        let path = card_path(weights);
        let text = std::fs::read_to_string(&path).map_err(|error| Error::io(&path, error))?;
        let card: Self = toml::from_str(&text).map_err(|error| {
            let line = error.span().map(|span| text[..span.start].lines().count().max(1));
            Error::input(&path, line.map_or(String::new(), |line| format!("line {line}")), error.message().to_owned())
        })?;
        let needed = Self::new(network, card.width, card.parameters);
        let settings = |card: &Self| {
            [
                ("format", card.format.to_string()),
                ("network", card.network.clone()),
                ("voxel_m", card.voxel_m.to_string()),
                ("levels", card.levels.to_string()),
                ("classes", card.classes.join(" ")),
            ]
        };
        for ((name, here), (_, wanted)) in settings(&card).into_iter().zip(settings(&needed)) {
            if here != wanted {
                return Err(Error::input(&path, name, format!("is {here}; this program needs {wanted}")));
            }
        }
        if card.width % 8 != 0 || !(8..=512).contains(&card.width) {
            return Err(Error::input(
                &path,
                "width",
                format!("is {}; a multiple of 8 up to 512 is needed", card.width),
            ));
        }
        if card.change_temperature.is_some_and(|t| !(0.1..=10.0).contains(&t)) {
            return Err(Error::input(&path, "change_temperature", "0.1 to 10 is needed"));
        }
        Ok(card)
    }

    /// Number of updates that the weights were trained for, according to the card.
    pub fn updates(&self) -> u64 {
        self.training.get(UPDATES).and_then(|updates| updates.parse().ok()).unwrap_or(0)
    }

    /// Writes the card beside `weights`.
    pub fn write(&self, weights: &Path) -> Result<()> {
        let path = card_path(weights);
        let text = toml::to_string(self).map_err(|error| Error::input(&path, "", error.to_string()))?;
        write_atomically(&path, text.as_bytes())
    }
}

/// The card's file beside weights.
pub fn card_path(weights: &Path) -> PathBuf {
    weights.with_extension("toml")
}

/// The classes' names by number, background last.
fn class_names() -> Vec<String> {
    let catalog = Catalog::standard();
    let names: Vec<String> =
        catalog.classes.iter().map(|class| class.name.clone()).chain(["background".into()]).collect();
    debug_assert_eq!(names.len(), CLASS_COUNT);
    names
}

/// Writes named tensors to `path`, whole or not at all.
///
/// # Errors
/// When the disk does not take them; what was at `path` is still there then.
pub fn write_tensors(path: &Path, tensors: &[(String, Tensor)]) -> Result<()> {
    let path = &target_of(path)?;
    let temporary = temporary_of(path);
    let written = Tensor::write_safetensors(tensors, &temporary)
        .map_err(|error| Error::input(path, "", format!("cannot be written: {error}")))
        .and_then(|()| std::fs::rename(&temporary, path).map_err(|error| Error::io(path, error)));
    if written.is_err() {
        let _ = std::fs::remove_file(&temporary);
    }
    written
}

/// A tensor as a safetensors header tells of it.
#[derive(Deserialize)]
struct Stored {
    dtype: String,
    shape: Vec<i64>,
    /// First byte and the one after the last, from the end of the header.
    data_offsets: [u64; 2],
}

/// Maps a safetensors file into memory and gives its tensors by name, as views of that memory: nothing is read before it is
/// used. Refuses a file that is damaged.
///
/// # Errors
/// For a file that is missing, truncated or no safetensors.
pub fn read_tensors(path: &Path) -> Result<BTreeMap<String, Tensor>> {
    let damaged = |what: &str| Error::input(path, "", format!("is damaged or no safetensors file: {what}"));
    let mut file = File::open(path).map_err(|error| Error::io(path, error))?;
    let length = file.metadata().map_err(|error| Error::io(path, error))?.len();
    let mut size = [0; 8];
    file.read_exact(&mut size).map_err(|_| damaged("it is too short"))?;
    let begin = u64::from_le_bytes(size).checked_add(8).filter(|begin| *begin <= length);
    let begin = begin.ok_or_else(|| damaged("its header is cut off"))?;
    let mut header = vec![0; begin as usize - 8];
    file.read_exact(&mut header).map_err(|error| Error::io(path, error))?;
    let header: BTreeMap<String, serde_json::Value> =
        serde_json::from_slice(&header).map_err(|error| damaged(&format!("its header: {error}")))?;
    let name = path.to_str().ok_or_else(|| damaged("its path is not UTF-8"))?;
    let bytes = Tensor::f_from_file(name, false, length as i64, (Kind::Uint8, Device::Cpu))
        .map_err(|error| damaged(&one_line(&error)))?;
    let tensor = |name: &str, value: serde_json::Value| {
        let stored: Stored = serde_json::from_value(value).ok()?;
        let (kind, size) = match stored.dtype.as_str() {
            "F32" => (Kind::Float, 4),
            "F16" => (Kind::Half, 2),
            "I64" => (Kind::Int64, 8),
            _ => return None,
        };
        let numbers = stored.shape.iter().try_fold(1_i64, |product, n| product.checked_mul(*n).filter(|n| *n > 0))?;
        let [first, end] = stored.data_offsets.map(|offset| offset.checked_add(begin));
        let (first, end) = (first? as i64, end.filter(|end| *end <= length)? as i64);
        let fits = end.checked_sub(first)? == numbers.checked_mul(size)?;
        let part = fits.then(|| bytes.narrow(0, first, end - first))?;
        // Views of larger numbers have to begin at their multiples.
        let part = if first % size == 0 { part } else { part.copy() };
        Some((name.to_owned(), part.view_dtype(kind).view(&stored.shape[..])))
    };
    let tensors = header.into_iter().filter(|(name, _)| name != "__metadata__").map(|(name, value)| {
        tensor(&name, value).ok_or_else(|| damaged(&format!("{name} is cut off or of an unknown kind")))
    });
    tensors.collect()
}

fn one_line(error: &tch::TchError) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}

/// A network with its weights from a file, its variables, and the card beside it.
///
/// # Errors
/// For weights that are missing, damaged, not finite, or of another network, grid, class list or version.
pub fn load_network<N: Network>(path: &Path, device: Device) -> Result<(N, VarStore, Card)> {
    let card = Card::read(path, N::NAME)?;
    let tensors = read_tensors(path)?;
    let numbers: usize = tensors.values().map(Tensor::numel).sum();
    if numbers < least_numbers(card.width) {
        let message = format!("is {}, but the weights are {numbers} numbers, too few for that", card.width);
        return Err(Error::input(card_path(path), "width", message));
    }
    let store = VarStore::new(device);
    let net = seeded(0, || N::new(&store.root(), card.width));
    fill(&store, &tensors, path)?;
    Ok((net, store, card))
}

/// Numbers that a network has at least: those of its widest convolution, 3 x 3 between eight times `width` channels. A card
/// that names more than its weights can be would have gigabytes made for nothing.
fn least_numbers(width: i64) -> usize {
    9 * (8 * width as usize).pow(2)
}

/// Copies tensors into the variables of a network; all must be there, of the right shape, and finite.
fn fill(store: &VarStore, tensors: &BTreeMap<String, Tensor>, path: &Path) -> Result<()> {
    let variables: BTreeMap<String, Tensor> = store.variables().into_iter().collect();
    for (name, variable) in &variables {
        let tensor = tensors.get(name).ok_or_else(|| Error::input(path, name.as_str(), "is missing"))?;
        if tensor.size() != variable.size() {
            let message = format!("has shape {:?}, the network {:?}", tensor.size(), variable.size());
            return Err(Error::input(path, name.as_str(), message));
        }
        let single = tensor.to_kind(Kind::Float);
        if !single.isfinite().all().int64_value(&[]).eq(&1) {
            return Err(Error::input(path, name.as_str(), "holds numbers that are not finite"));
        }
        tch::no_grad(|| variable.shallow_clone().copy_(&single));
    }
    if let Some(name) = tensors.keys().find(|name| !variables.contains_key(*name)) {
        return Err(Error::input(path, name.as_str(), "is no variable of this network"));
    }
    Ok(())
}
