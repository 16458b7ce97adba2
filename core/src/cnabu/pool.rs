//! The networks, once for each thread that may ask at once.

use super::observe_net::ObserveNet;
use super::push_net::PushNet;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tch::Device;
use tch::nn::VarStore;

/// The same networks several times, one for each thread that may ask at once: libtorch's tensors may be sent to another
/// thread but not be used by two.
#[derive(Debug)]
pub(super) struct Pool(pub(super) Vec<Mutex<Networks>>);

#[derive(Debug)]
pub(super) struct Networks {
    pub(super) observe: ObserveNet,
    /// sigma_m, and the temperature of its probabilities of change.
    pub(super) push: Option<(PushNet, f32)>,
    /// They hold the variables, and say on which device.
    pub(super) stores: Vec<VarStore>,
}

impl Pool {
    /// Networks that no other thread uses now, or the next to be free. Whoever holds them asks nothing of rayon, whose
    /// thread might take up work that wants them too.
    pub(super) fn take(&self) -> MutexGuard<'_, Networks> {
        let free = self.0.iter().find_map(|networks| networks.try_lock().ok());
        let mine = rayon::current_thread_index().unwrap_or(0) % self.0.len();
        free.unwrap_or_else(|| self.0[mine].lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Networks {
    pub(super) fn device(&self) -> Device {
        self.stores.first().map_or(Device::Cpu, VarStore::device)
    }
}
