//! What an episode needs to be begun.

use super::super::record::EpisodeConfig;
use crate::belief::BeliefUpdate;
use crate::scene::Scene;
use crate::{Error, Result};

/// Whether an episode can be begun.
pub(super) fn check(scene: &Scene, config: &EpisodeConfig, update: &dyn BeliefUpdate) -> Result<()> {
    if config.belief != update.name() {
        let message = format!("the episode is about belief `{}`, not `{}`", config.belief, update.name());
        return Err(Error::Usage(message));
    }
    if config.budget == 0 {
        return Err(Error::Usage("the budget must be at least one action".to_owned()));
    }
    update.check_grid(&scene.grid())?;
    sound(update)
}

/// Whether nothing that the update answered was wrong.
pub(super) fn sound(update: &dyn BeliefUpdate) -> Result<()> {
    update.fault().map_or(Ok(()), Err)
}
