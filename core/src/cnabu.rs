//! Calibrated neural-accelerated belief update (CNABU): sigma_o for observations, sigma_m for pushes, as networks.
//!
//! Both are residual U-Nets over the floor plan whose channels are the heights; they give evidence, a Beta per voxel and a
//! Dirichlet per floor cell, and are trained with evidential losses on our own simulated data ([`crate::learn`]).
//!
//! libtorch (by `tch`) does the arithmetic, behind the cargo feature `cnabu`. A build without the feature has only
//! [`AVAILABLE`], which is false, and [`load`], which returns an error.

#[cfg(feature = "cnabu")]
mod layout;
#[cfg(feature = "cnabu")]
mod loss;
#[cfg(feature = "cnabu")]
mod module;
#[cfg(feature = "cnabu")]
mod net;
#[cfg(feature = "cnabu")]
mod observe_net;
#[cfg(feature = "cnabu")]
mod own;
#[cfg(feature = "cnabu")]
mod pool;
#[cfg(feature = "cnabu")]
mod predict;
#[cfg(feature = "cnabu")]
mod push_net;
mod scored;
#[cfg(feature = "cnabu")]
mod update;
#[cfg(feature = "cnabu")]
mod weights;

#[cfg(feature = "cnabu")]
pub(crate) use layout::SUBS;
#[cfg(feature = "cnabu")]
pub use layout::{LEVELS, Layout, Mirror};
#[cfg(feature = "cnabu")]
pub use loss::{LossForm, expected_log_loss, kl_to_uniform, marginal_log_loss, occupancy_loss, semantics_loss};
#[cfg(feature = "cnabu")]
pub use net::Network;
#[cfg(feature = "cnabu")]
pub(crate) use net::seeded;
#[cfg(feature = "cnabu")]
pub use observe_net::{Evidence, ObserveNet};
#[cfg(feature = "cnabu")]
pub(crate) use predict::{Numbers, Windowed, push_planes};
#[cfg(feature = "cnabu")]
pub use push_net::{PriorParts, PushNet, PushPlanes, Pushed};
#[cfg(feature = "cnabu")]
pub(crate) use push_net::{WINDOW, windows};
pub use scored::Scored;
#[cfg(feature = "cnabu")]
pub use tch::{Device, Tensor};
#[cfg(feature = "cnabu")]
pub use update::Cnabu;
#[cfg(feature = "cnabu")]
pub(crate) use update::{belief_of, observation_planes};
#[cfg(feature = "cnabu")]
pub use weights::{Card, UPDATES, card_path, load_network, read_tensors, write_tensors};

use crate::belief::BeliefUpdate;
use crate::{Result, places};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// File name of sigma_m's weights; its card is beside it, with `.toml`.
pub const PUSH_WEIGHTS: &str = "sigma_m.safetensors";
/// Whether this build can run the networks.
pub const AVAILABLE: bool = cfg!(feature = "cnabu");
/// File name of sigma_o's weights in a models directory; its card is beside it, with `.toml`.
pub const OBSERVE_WEIGHTS: &str = "sigma_o.safetensors";
/// The device that weights are loaded onto: `cpu`, `cuda`, or `auto`.
pub const DEVICE_ENV: &str = "NUDGE_DEVICE";

/// The directory of weights, where [`places`] finds it.
pub fn models_dir() -> Option<PathBuf> {
    places::MODELS.find().map(|found| found.path)
}

/// The device that [`choose_device`] chose.
static CHOSEN: OnceLock<String> = OnceLock::new();

/// Chooses the device that weights are loaded onto, before [`DEVICE_ENV`]; the first choice holds.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) for another name than `auto`, `cpu` and `cuda`, and for `cuda` where there is none.
pub fn choose_device(name: &str) -> Result<()> {
    #[cfg(feature = "cnabu")]
    device(name)?;
    #[cfg(not(feature = "cnabu"))]
    match name {
        "auto" | "cpu" => (),
        "cuda" => return Err(crate::Error::Usage("device cuda: this build has no networks to run on it".to_owned())),
        other => return Err(unknown_device(other)),
    }
    CHOSEN.get_or_init(|| name.to_owned());
    Ok(())
}

fn unknown_device(name: &str) -> crate::Error {
    crate::Error::Usage(format!("unknown device \"{name}\"; there are auto, cpu, cuda"))
}

/// The device that was chosen or that [`DEVICE_ENV`] names, CUDA when it is there otherwise.
#[cfg(feature = "cnabu")]
fn chosen_device() -> Result<Device> {
    let named = CHOSEN.get().cloned().or_else(|| std::env::var(DEVICE_ENV).ok());
    device(named.as_deref().unwrap_or("auto"))
}

/// The name of the device that weights are loaded onto: `cpu` or `cuda`.
///
/// # Errors
/// As [`device`], for what [`choose_device`] or [`DEVICE_ENV`] named.
#[cfg(feature = "cnabu")]
pub fn device_name() -> Result<&'static str> {
    Ok(if chosen_device()?.is_cuda() { "cuda" } else { "cpu" })
}

/// Number of threads that libtorch computes with.
#[cfg(feature = "cnabu")]
pub fn threads() -> usize {
    tch::get_num_threads().try_into().unwrap_or(0)
}

/// Sets the number of threads that libtorch computes with.
#[cfg(feature = "cnabu")]
pub fn set_threads(threads: usize) {
    tch::set_num_threads(threads.clamp(1, 1024) as i32);
}

/// Has libtorch compute on the thread that asks, as rayon's threads share the work; once, before weights are loaded.
/// (Training has libtorch's own threads: `set_threads`.)
pub fn compute_beside_rayon() {
    #[cfg(feature = "cnabu")]
    set_threads(1);
}

/// The device of a name: `cpu`, `cuda`, or `auto` for CUDA when libtorch has it.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) for another name, and for `cuda` where there is none.
#[cfg(feature = "cnabu")]
pub fn device(name: &str) -> Result<Device> {
    match name {
        "auto" => Ok(Device::cuda_if_available()),
        "cpu" => Ok(Device::Cpu),
        "cuda" if tch::Cuda::is_available() => Ok(Device::Cuda(0)),
        "cuda" => Err(crate::Error::Usage("device cuda: this libtorch finds no CUDA device".to_owned())),
        other => Err(unknown_device(other)),
    }
}

/// A tensor rounded to 16 bits.
#[cfg(feature = "cnabu")]
pub fn half(tensor: &Tensor) -> Tensor {
    tensor.to_kind(tch::Kind::Half)
}

/// The networks with the weights in `directory`, as a belief update.
///
/// # Errors
/// In a build without networks; for weights that are missing, damaged, not finite, or of another grid, class list or version.
#[cfg(feature = "cnabu")]
pub fn load(directory: &Path) -> Result<Arc<dyn BeliefUpdate>> {
    Ok(Arc::new(Cnabu::load(directory)?))
}

/// TorchScript modules of the user's own in place of sigma_o, sigma_m or both; `rest` does what is not given. What a module
/// is given and has to answer is told in `cnabu/own.rs` and in docs/bring-your-own.md.
///
/// # Errors
/// In a build without networks; for a file that is missing or no TorchScript module. What a module answers is checked by
/// [`BeliefUpdate::check_grid`].
#[cfg(feature = "cnabu")]
pub fn load_own(
    sigma_o: Option<&Path>,
    sigma_m: Option<&Path>,
    rest: Arc<dyn BeliefUpdate>,
) -> Result<Arc<dyn BeliefUpdate>> {
    Ok(Arc::new(own::Own::load(sigma_o, sigma_m, rest, chosen_device()?)?))
}

/// Modules of the user's own: not in this build.
///
/// # Errors
/// Always.
#[cfg(not(feature = "cnabu"))]
pub fn load_own(
    _sigma_o: Option<&Path>,
    _sigma_m: Option<&Path>,
    rest: Arc<dyn BeliefUpdate>,
) -> Result<Arc<dyn BeliefUpdate>> {
    drop(rest);
    Err(crate::Error::Usage("this program was built without networks".to_owned()))
}

/// sigma_o alone with its weights in `directory`, to score observations.
///
/// # Errors
/// As [`load`].
#[cfg(feature = "cnabu")]
pub fn load_observation(directory: &Path) -> Result<Arc<dyn BeliefUpdate>> {
    Ok(Arc::new(Cnabu::load_observation(directory)?))
}

/// sigma_o alone: not in this build.
///
/// # Errors
/// Always.
#[cfg(not(feature = "cnabu"))]
pub fn load_observation(directory: &Path) -> Result<Arc<dyn BeliefUpdate>> {
    load(directory)
}

/// The networks with the weights in `directory`: not in this build.
///
/// # Errors
/// Always.
#[cfg(not(feature = "cnabu"))]
pub fn load(_directory: &Path) -> Result<Arc<dyn BeliefUpdate>> {
    Err(crate::Error::Usage("this program was built without networks".to_owned()))
}
