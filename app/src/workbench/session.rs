//! One open episode as the window sees it: every state it went through, and what is being done with it.

use super::half_belief::HalfBelief;
use super::packed_frame::PackedFrame;
use crate::annotations::Annotations;
use crate::driver::default_out;
use crate::record::decision::Series;
use nudge_core::arm::ArmTool;
use nudge_core::belief::BeliefUpdate;
use nudge_core::camera::{ViewArray, ViewId};
use nudge_core::episode::{EpisodeRecord, StepOutcome};
use nudge_core::grid::VoxelSet;
use nudge_core::plan::Decision;
use nudge_core::scene::{Body, Catalog};
use nudge_core::score::Scores;
use nudge_core::world::TruthMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// An open episode, by the order of opening; never used twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SessionId(pub u32);

/// What stands between a branch's step and the name of the episode that it comes from.
const BRANCHED: &str = "-from-step-";

/// What a branch's directory has behind the name of the episode.
pub fn branch_suffix(step: usize) -> String {
    format!("{BRANCHED}{step}")
}

/// What stands behind an episode's own name in that of its directory, in words: `-from-step-6-2` is `from step 6 (2)`; `None`
/// for what this program does not put there.
fn words_of_suffix(suffix: &str) -> Option<String> {
    let Some(branch) = suffix.strip_prefix(BRANCHED) else { return again(suffix) };
    let (step, rest) = branch.split_at(branch.find('-').unwrap_or(branch.len()));
    match (is_number(step), rest) {
        (true, "") => Some(format!("from step {step}")),
        (true, rest) => Some(format!("from step {step} {}", again(rest)?)),
        (false, _) => None,
    }
}

/// `(2)` of `-2`.
fn again(suffix: &str) -> Option<String> {
    suffix.strip_prefix('-').filter(|number| is_number(number)).map(|number| format!("({number})"))
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// The state after a number of actions, and the step that led to it.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Number of actions so far; 0 is the prior.
    pub step: usize,
    /// What is believed, in half precision.
    pub belief: HalfBelief,
    /// Voxels that looks have seen and that no push has probably changed since.
    pub seen: Arc<VoxelSet>,
    /// What is, if that is known; shared by all moments between two pushes.
    pub truth: Option<Arc<TruthMap>>,
    /// The bodies where they stand, dropped ones left out; shared like the truth.
    pub bodies: Arc<Vec<Body>>,
    /// How belief and truth compare, if that is known.
    pub scores: Option<Scores>,
    /// Entropy of what is believed, nats.
    pub entropy_nats: f64,
    /// What the step brought, but for the camera's image; `None` for the prior.
    pub outcome: Option<Arc<StepOutcome>>,
    /// What the camera saw in the step, if it was a look.
    pub frame: Option<PackedFrame>,
    /// Whether all of it is there. Of an episode that was opened a moment ago there is only what its files hold: no
    /// observations, motions and predictions, nothing of what was seen, and no bodies after the first push.
    pub is_whole: bool,
}

impl Moment {
    /// What was weighed before the step; `None` for the prior.
    pub fn decision(&self) -> Option<&Decision> {
        self.outcome.as_ref().map(|outcome| &outcome.record.decision)
    }

    /// All that the step brought, with the camera's image.
    pub fn whole_outcome(&self) -> Option<StepOutcome> {
        let frame = self.frame.as_ref().and_then(PackedFrame::frame);
        Some(StepOutcome { frame, ..(**self.outcome.as_ref()?).clone() })
    }

    /// A score of the state; without a truth there is the entropy alone.
    pub fn score(&self, series: &Series) -> Option<f64> {
        series.at(self.scores.as_ref(), self.entropy_nats)
    }
}

/// What an episode's worker is at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Activity {
    /// Waits for an order.
    #[default]
    Idle,
    /// Begins an episode, or repeats the steps that a branch shares: steps done, steps in all.
    Opening {
        /// Steps repeated so far.
        done: usize,
        /// Steps in the log.
        of: usize,
    },
    /// Repeats the log of an episode that is shown already, and compares it with the files.
    Checking {
        /// Steps repeated so far.
        done: usize,
        /// Steps in the log.
        of: usize,
    },
    /// Weighs what to do.
    Deciding,
    /// Looks or pushes and updates the belief.
    Acting,
    /// Runs to the budget.
    Running,
}

/// What does not change while an episode is open.
#[derive(Clone)]
pub struct Setup {
    /// Names, shapes and colours of the classes.
    pub catalog: Arc<Catalog>,
    /// The candidate views.
    pub views: Arc<ViewArray>,
    /// How beliefs change; `None` where this program does not have what the episode was made with.
    pub update: Option<Arc<dyn BeliefUpdate>>,
    /// The arm before the shelf.
    pub arm: Arc<ArmTool>,
    /// Views that its hand cannot be at.
    pub unreachable: Arc<Vec<ViewId>>,
    /// Objects that no view saw at the start, by name; `None` until they are counted.
    pub hidden: Option<Arc<Vec<String>>>,
}

/// An open episode. Cheap to clone: its states are shared.
#[derive(Clone)]
pub struct Session {
    /// Its id.
    pub id: SessionId,
    /// Its directory.
    pub path: PathBuf,
    /// Scene, configuration and the steps so far, as `episode.json` keeps them.
    pub record: EpisodeRecord,
    /// What does not change.
    pub setup: Setup,
    /// `moments[n]` is the state after `n` actions; never empty.
    pub moments: Vec<Arc<Moment>>,
    /// What the policy would do next, once it was asked.
    pub pending: Option<Arc<Decision>>,
    /// What the worker is at.
    pub activity: Activity,
    /// Whether it has been told to decide or to run as soon as its log is checked.
    pub queued: bool,
    /// Why nothing more can be done with it, if it can only be looked at.
    pub read_only: Option<String>,
    /// Whether its run ends after the action that it is at.
    pub pausing: bool,
    /// Notes and verdicts of a person.
    pub annotations: Annotations,
    /// Whether something has changed since it was last saved.
    pub unsaved: bool,
}

impl Session {
    /// `tunnel, mem, seed 3`; of a branch, and of one that was started again, with what its directory is named behind that:
    /// `tunnel, mem, seed 3 from step 6`, `tunnel, mem, seed 3 (2)`.
    pub fn title(&self) -> String {
        let (scene, config) = (&self.record.scene, &self.record.config);
        let plain = format!("{}, {}, seed {}", scene.name, config.policy, config.seed);
        let own = default_out(scene, config.policy, config.seed);
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let behind = name(&self.path).strip_prefix(&name(&own)).and_then(words_of_suffix);
        behind.map_or_else(|| plain.clone(), |behind| format!("{plain} {behind}"))
    }

    /// Number of actions done.
    pub fn steps(&self) -> usize {
        self.moments.len() - 1
    }

    /// Whether the budget is used up.
    pub fn is_finished(&self) -> bool {
        self.steps() >= self.record.config.budget
    }

    /// Whether something more can be done in it.
    pub fn is_open(&self) -> bool {
        self.read_only.is_none() && !self.is_finished()
    }

    /// Whether it is at something that a person asked for.
    pub fn can_be_cancelled(&self) -> bool {
        match self.activity {
            Activity::Idle | Activity::Checking { .. } => self.queued,
            _ => true,
        }
    }

    /// Whether it can be told to decide or to run: idle, or to do so once its log is checked.
    pub fn takes_orders(&self) -> bool {
        self.is_open() && !self.queued && matches!(self.activity, Activity::Idle | Activity::Checking { .. })
    }

    /// The state after `step` actions, or the last one there is.
    pub fn moment(&self, step: usize) -> &Arc<Moment> {
        &self.moments[step.min(self.moments.len() - 1)]
    }

    /// The decision to explain at `step`: the one that was taken after `step` actions, or, at the last state, the one
    /// that is pending.
    pub fn decision_after(&self, step: usize) -> Option<&Decision> {
        match self.moments.get(step + 1) {
            Some(next) => next.decision(),
            None => self.pending.as_deref(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::fixture;

    #[test]
    fn an_episode_its_branch_and_one_started_again_have_different_names() {
        let mut session = fixture::session(1);
        let own = default_out(&session.record.scene, session.record.config.policy, session.record.config.seed);
        let mut title = |behind: &str| {
            session.path = PathBuf::from(format!("{}{behind}", own.display()));
            session.title()
        };
        let plain = title("");
        assert_eq!(plain, "small shelf, mem, seed 1");
        assert_eq!(title(&branch_suffix(6)), format!("{plain} from step 6"));
        assert_eq!(title("-from-step-6-2"), format!("{plain} from step 6 (2)"));
        assert_eq!(title("-3"), format!("{plain} (3)"));
        for other in ["-of-mine", "-from-step-", "-from-step-x", "-from-step-6-x", "2"] {
            assert_eq!(title(other), plain, "{other}");
        }
    }
}
