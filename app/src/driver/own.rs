//! Modules of the user's own in place of sigma_o and sigma_m, chosen once for the life of the program.

use super::update_of;
use nudge_core::Result;
use nudge_core::belief::{BeliefUpdate, CLASSICAL, OWN, mixed_name, mixed_parts};
use nudge_core::cnabu;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The files of modules of the user's own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OwnFiles {
    /// In place of sigma_o.
    pub sigma_o: Option<PathBuf>,
    /// In place of sigma_m.
    pub sigma_m: Option<PathBuf>,
}

static CHOSEN: OnceLock<OwnFiles> = OnceLock::new();

/// Says which modules belief updates with parts of the user's own are made of; the first choice holds.
pub fn choose(files: OwnFiles) {
    if files != OwnFiles::default() {
        CHOSEN.get_or_init(|| files);
    }
}

/// The name of the belief update with the modules that were chosen: `rest`, by default the classical one, does what they do
/// not. What was named where none were chosen.
pub fn with_own(rest: Option<&str>) -> Option<String> {
    match CHOSEN.get() {
        Some(OwnFiles { sigma_o, sigma_m }) if rest.is_none_or(|rest| mixed_parts(rest).is_none()) => {
            Some(mixed_name(sigma_o.is_some(), sigma_m.is_some(), rest.unwrap_or(CLASSICAL)))
        }
        _ => rest.map(str::to_owned),
    }
}

/// The update that observes and predicts with these parts, or what this program was not told of it.
///
/// # Errors
/// For modules that cannot be read, and what is wrong with networks that do the rest.
pub(super) fn update(parts: [&str; 2]) -> Result<std::result::Result<Arc<dyn BeliefUpdate>, &'static str>> {
    static LOADED: Mutex<BTreeMap<String, Arc<dyn BeliefUpdate>>> = Mutex::new(BTreeMap::new());
    let chosen = CHOSEN.get().cloned().unwrap_or_default();
    let [observes, predicts] = parts.map(|part| part == OWN);
    let sigma_o = chosen.sigma_o.filter(|_| observes);
    let sigma_m = chosen.sigma_m.filter(|_| predicts);
    if !cnabu::AVAILABLE {
        return Ok(Err(super::WITHOUT_NETWORKS));
    }
    if observes && sigma_o.is_none() {
        return Ok(Err("its sigma_o is a module of the user's own; name the file with --sigma-o"));
    }
    if predicts && sigma_m.is_none() {
        return Ok(Err("its sigma_m is a module of the user's own; name the file with --sigma-m"));
    }
    let name = parts.join("+");
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(update) = loaded.get(&name) {
        return Ok(Ok(update.clone()));
    }
    let rest = match update_of(parts.into_iter().find(|part| *part != OWN).unwrap_or(CLASSICAL))? {
        Ok(rest) => rest,
        Err(why) => return Ok(Err(why)),
    };
    cnabu::compute_beside_rayon();
    let update = cnabu::load_own(sigma_o.as_deref(), sigma_m.as_deref(), rest)?;
    loaded.insert(name, update.clone());
    Ok(Ok(update))
}
