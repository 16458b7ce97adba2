//! A TorchScript module in a file, and what it answers, held to a contract of shapes and values.

use crate::files::sha256_of_file;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use tch::jit::IValue;
use tch::{CModule, Device, Kind, Tensor};

/// The least evidence that an answer may hold: 1 is none, less speaks against it.
pub(super) const LEAST_EVIDENCE: f32 = 1e-3;

/// What the numbers of an answer may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Range {
    /// Parameters of a Beta or a Dirichlet: finite, at least [`LEAST_EVIDENCE`].
    Evidence,
    /// From 0 to 1.
    Probability,
}

/// A tensor that a module has to answer.
#[derive(Clone, Debug)]
pub(super) struct Wanted {
    pub(super) name: &'static str,
    pub(super) shape: Vec<i64>,
    pub(super) range: Range,
}

/// A TorchScript module. Several threads may ask it at once.
#[derive(Debug)]
pub(super) struct Module {
    path: PathBuf,
    module: CModule,
    device: Device,
    sha256: String,
}

impl Module {
    /// Reads a file that `torch.jit.save` wrote.
    ///
    /// # Errors
    /// For a file that is missing or no TorchScript module.
    pub(super) fn load(path: &Path, device: Device) -> Result<Self> {
        let sha256 = sha256_of_file(path)?;
        let refused = |error: tch::TchError| {
            let why = in_one_line(&error.to_string());
            Error::input(path, "", format!("is no TorchScript module that can be read ({why})"))
        };
        let mut module = CModule::load_on_device(path, device).map_err(refused)?;
        module.f_set_eval().map_err(refused)?;
        Ok(Self { path: path.to_owned(), module, device, sha256 })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn sha256(&self) -> &str {
        &self.sha256
    }

    /// The name of its file, without folders.
    pub(super) fn file_name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// What it answers to these inputs, in the order of `wanted`, as numbers.
    ///
    /// # Errors
    /// In words: what the module says if it fails, or what in its answer is not as wanted.
    pub(super) fn ask(
        &self,
        inputs: &[(&str, Tensor)],
        wanted: &[Wanted],
    ) -> std::result::Result<Vec<Vec<f32>>, String> {
        let values: Vec<IValue> =
            inputs.iter().map(|(_, tensor)| IValue::Tensor(tensor.to_device(self.device))).collect();
        let answer = tch::no_grad(|| {
            // The first calls would be rewritten as they are watched, and then compute in another order.
            tch::jit::f_set_graph_executor_optimize(false)?;
            self.module.forward_is(&values)
        });
        let answer = answer.map_err(|error| {
            let names: Vec<&str> = inputs.iter().map(|(name, _)| *name).collect();
            format!("fails on ({}): {}", names.join(", "), in_one_line(&error.to_string()))
        })?;
        let tensors = tensors(answer)?;
        if tensors.len() != wanted.len() {
            let names: Vec<&str> = wanted.iter().map(|wanted| wanted.name).collect();
            let count = tensors.len();
            return Err(format!("answers {count} tensors, and {} are wanted ({})", wanted.len(), names.join(", ")));
        }
        tensors.iter().zip(wanted).map(|(tensor, wanted)| wanted.numbers(tensor)).collect()
    }
}

/// The tensors of a tuple or a list.
fn tensors(answer: IValue) -> std::result::Result<Vec<Tensor>, String> {
    let no_tensors = || "answers something else than a tuple of tensors".to_owned();
    match answer {
        IValue::Tensor(tensor) => Ok(vec![tensor]),
        IValue::TensorList(tensors) => Ok(tensors),
        IValue::Tuple(values) | IValue::GenericList(values) => {
            let tensor = |value| if let IValue::Tensor(tensor) = value { Ok(tensor) } else { Err(no_tensors()) };
            values.into_iter().map(tensor).collect()
        }
        _ => Err(no_tensors()),
    }
}

impl Wanted {
    /// The numbers of an answer.
    fn numbers(&self, tensor: &Tensor) -> std::result::Result<Vec<f32>, String> {
        let Self { name, shape, range } = self;
        if tensor.size() != *shape {
            return Err(format!("its {name} has shape {:?}, and {shape:?} is wanted", tensor.size()));
        }
        let unreadable =
            |error: tch::TchError| format!("its {name} cannot be read: {}", in_one_line(&error.to_string()));
        let tensor = tensor.f_to_device(Device::Cpu).and_then(|tensor| tensor.f_to_kind(Kind::Float));
        let tensor = tensor.map_err(unreadable)?.contiguous();
        let mut numbers = vec![0.0_f32; tensor.numel()];
        tensor.f_copy_data(&mut numbers, tensor.numel()).map_err(unreadable)?;
        let (fits, rule): (fn(f32) -> bool, _) = match range {
            Range::Evidence => (|x| x.is_finite() && x >= LEAST_EVIDENCE, "evidence is at least 0.001 and finite"),
            Range::Probability => (|x| (0.0..=1.0).contains(&x), "probabilities are from 0 to 1"),
        };
        match numbers.iter().find(|x| !fits(**x)) {
            Some(wrong) => Err(format!("its {name} holds {wrong}: {rule}")),
            None => Ok(numbers),
        }
    }
}

/// What libtorch says of an error, without the trace below or above it.
fn in_one_line(said: &str) -> String {
    let lines = || said.lines().map(str::trim).filter(|line| !line.is_empty());
    let cause = lines().rev().find(|line| line.contains("Error: ")).or_else(|| lines().next()).unwrap_or_default();
    let cause = cause.strip_prefix("Internal torch error: ").unwrap_or(cause);
    cause.split(" Exception raised from").next().unwrap_or(cause).trim_end_matches('.').chars().take(300).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_libtorch_says_is_cut_to_its_cause() {
        let said = "Internal torch error: The following operation failed in the TorchScript interpreter.\n\
                    Traceback of TorchScript (most recent call last):\n  File \"a.py\", line 3, in forward\n\
                    RuntimeError: The size of tensor a (3) must match\n";
        assert_eq!(in_one_line(said), "RuntimeError: The size of tensor a (3) must match");
        let said = "Internal torch error: forward() expected at most 2 argument(s) but received 5 argument(s).\nmore";
        assert_eq!(in_one_line(said), "forward() expected at most 2 argument(s) but received 5 argument(s)");
    }

    #[test]
    fn an_answer_is_held_to_its_shape_and_its_values() {
        let wanted = Wanted { name: "change", shape: vec![2], range: Range::Probability };
        assert_eq!(wanted.numbers(&Tensor::from_slice(&[0.0_f64, 1.0])), Ok(vec![0.0, 1.0]));
        let said = |numbers: &[f32]| wanted.numbers(&Tensor::from_slice(numbers)).expect_err("refused");
        assert_eq!(said(&[0.5]), "its change has shape [1], and [2] is wanted");
        assert_eq!(said(&[0.5, 1.5]), "its change holds 1.5: probabilities are from 0 to 1");
        let wanted = Wanted { name: "occupancy", shape: vec![2], range: Range::Evidence };
        let said = |numbers: &[f32]| wanted.numbers(&Tensor::from_slice(numbers)).expect_err("refused");
        assert_eq!(said(&[1.0, f32::NAN]), "its occupancy holds NaN: evidence is at least 0.001 and finite");
        assert!(said(&[0.0, 1.0]).starts_with("its occupancy holds 0:"));
        let pair = || IValue::Tuple(vec![IValue::Tensor(Tensor::from(1.0)), IValue::Int(2)]);
        assert_eq!(tensors(pair()).expect_err("an int"), "answers something else than a tuple of tensors");
    }
}
