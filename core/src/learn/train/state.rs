//! The state of a network in training, and checkpoints of it: everything that a run needs to continue as if it had not
//! been stopped.

use super::adam::Adam;
use crate::cnabu::{read_tensors, write_tensors};
use crate::files::write_atomically;
use crate::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use tch::nn::VarStore;
use tch::{Device, Kind, Tensor};

/// The checkpoint of a run named `out`.
pub fn checkpoint_path(out: &Path) -> PathBuf {
    with_suffix(out, ".safetensors")
}

/// The settings of a run named `out`.
pub fn settings_path(out: &Path) -> PathBuf {
    with_suffix(out, ".toml")
}

fn with_suffix(out: &Path, suffix: &str) -> PathBuf {
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!("{name}{suffix}"))
}

/// Counters: updates, batches, Adam's steps.
const COUNTERS: &str = "counters";

/// Weights, their running mean, Adam's moments and counters.
#[derive(Debug)]
pub(super) struct State {
    /// Variables by name, in order.
    pub(super) variables: Vec<(String, Tensor)>,
    mean: Vec<Tensor>,
    adam: Adam,
    /// Updates of the weights so far.
    pub(super) updates: u64,
    /// Batches so far.
    pub(super) batches: u64,
}

impl State {
    /// The state of a network whose variables are fresh.
    pub(super) fn new(store: &VarStore) -> Self {
        let variables: Vec<(String, Tensor)> =
            store.variables().into_iter().collect::<BTreeMap<_, _>>().into_iter().collect();
        let mean = variables.iter().map(|(_, variable)| variable.detach().copy()).collect();
        let adam = Adam::new(&variables);
        Self { variables, mean, adam, updates: 0, batches: 0 }
    }

    /// Number of parameters.
    pub(super) fn parameters(&self) -> i64 {
        self.variables.iter().map(|(_, variable)| variable.numel() as i64).sum()
    }

    /// Moves the weights against their gradients, and the running mean after them; `mean_decay` is the old mean's share.
    pub(super) fn update(&mut self, learning_rate: f64, mean_decay: f64) {
        self.updates += 1;
        self.adam.step(&self.variables, learning_rate);
        let young = (1.0 + self.updates as f64) / (10.0 + self.updates as f64);
        let follow = 1.0 - mean_decay.min(young);
        tch::no_grad(|| {
            for (mean, (_, variable)) in self.mean.iter_mut().zip(&self.variables) {
                let _ = mean.lerp_(variable, follow);
            }
        });
    }

    /// The running mean of the weights by name.
    pub(super) fn mean_weights(&self) -> Vec<(String, Tensor)> {
        self.variables.iter().zip(&self.mean).map(|((name, _), mean)| (name.clone(), mean.shallow_clone())).collect()
    }

    /// Copies the running mean into the variables of a network of the same shape.
    pub(super) fn copy_mean(&self, store: &VarStore) {
        let variables: BTreeMap<String, Tensor> = store.variables().into_iter().collect();
        tch::no_grad(|| {
            for (variable, mean) in variables.values().zip(&self.mean) {
                variable.shallow_clone().copy_(mean);
            }
        });
    }

    /// Writes a checkpoint of the run named `out`, whole or not at all: the one before survives a full disk.
    pub(super) fn save(&self, out: &Path, settings: &impl Serialize) -> Result<()> {
        let path = settings_path(out);
        let text = toml::to_string(settings).map_err(|error| Error::input(&path, "", error.to_string()))?;
        let counters = Tensor::from_slice(&[self.updates, self.batches, self.adam.steps].map(|count| count as i64));
        let mut tensors = vec![(COUNTERS.to_owned(), counters)];
        let states = self.mean.iter().zip(self.adam.first.iter().zip(&self.adam.second));
        for ((name, variable), (mean, (first, second))) in self.variables.iter().zip(states) {
            for (part, tensor) in [("net", variable), ("mean", mean), ("first", first), ("second", second)] {
                tensors.push((format!("{part}.{name}"), tensor.detach().to_device(Device::Cpu)));
            }
        }
        write_atomically(&path, text.as_bytes())?;
        write_tensors(&checkpoint_path(out), &tensors)
    }

    /// Takes over the checkpoint of the run named `out`.
    pub(super) fn load(&mut self, out: &Path) -> Result<()> {
        let path = checkpoint_path(out);
        let tensors = read_tensors(&path)?;
        let states = self.mean.iter_mut().zip(self.adam.first.iter_mut().zip(&mut self.adam.second));
        for ((name, variable), (mean, (first, second))) in self.variables.iter().zip(states) {
            take(&tensors, "net", name, &mut variable.shallow_clone(), &path)?;
            take(&tensors, "mean", name, mean, &path)?;
            take(&tensors, "first", name, first, &path)?;
            take(&tensors, "second", name, second, &path)?;
        }
        let counters = tensors.get(COUNTERS).filter(|t| t.size() == [3] && t.kind() == Kind::Int64);
        let counters = counters.ok_or_else(|| Error::input(&path, COUNTERS, "are missing"))?;
        let counter = |at: i64| counters.int64_value(&[at]).max(0) as u64;
        (self.updates, self.batches, self.adam.steps) = (counter(0), counter(1), counter(2));
        Ok(())
    }

    /// Takes over the weights in `store`, with the number of updates from their card. Adam starts anew.
    pub(super) fn begin_with(&mut self, store: &VarStore, updates: u64) {
        let variables: BTreeMap<String, Tensor> = store.variables().into_iter().collect();
        tch::no_grad(|| {
            for ((mean, (_, variable)), weights) in self.mean.iter_mut().zip(&self.variables).zip(variables.values()) {
                mean.copy_(weights);
                variable.shallow_clone().copy_(weights);
            }
        });
        self.updates = updates;
    }
}

/// Copies a tensor of a checkpoint into its place.
fn take(tensors: &BTreeMap<String, Tensor>, part: &str, name: &str, into: &mut Tensor, path: &Path) -> Result<()> {
    let name = format!("{part}.{name}");
    let tensor = tensors.get(&name).ok_or_else(|| Error::input(path, name.as_str(), "is missing"))?;
    if tensor.size() != into.size() || tensor.kind() != Kind::Float {
        let message = format!("has shape {:?}, the network {:?}", tensor.size(), into.size());
        return Err(Error::input(path, name.as_str(), message));
    }
    if tensor.isfinite().all().int64_value(&[]) != 1 {
        return Err(Error::input(path, name.as_str(), "holds numbers that are not finite"));
    }
    tch::no_grad(|| into.copy_(tensor));
    Ok(())
}

/// The settings of the run named `out`.
pub(super) fn logged_settings<T: DeserializeOwned>(out: &Path) -> Result<T> {
    let path = settings_path(out);
    let text = std::fs::read_to_string(&path).map_err(|error| Error::io(&path, error))?;
    toml::from_str(&text).map_err(|error| Error::input(&path, "", error.message().to_owned()))
}

/// Refuses to continue the run named `out` with other settings than it was started with; names the first that differs.
pub(super) fn same_settings(out: &Path, wanted: &impl Serialize) -> Result<()> {
    let path = settings_path(out);
    let there: toml::Table = logged_settings(out)?;
    let wanted = toml::Table::try_from(wanted).map_err(|error| Error::input(&path, "", error.to_string()))?;
    for (name, value) in &wanted {
        if there.get(name) != Some(value) {
            let was = there.get(name).map_or_else(|| "missing".to_owned(), ToString::to_string);
            return Err(Error::input(path, name.as_str(), format!("is {was} in this run, not {value}")));
        }
    }
    Ok(())
}
