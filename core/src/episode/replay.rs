//! Running an episode again from its log and verifying every step.

use super::directory::EpisodeDir;
use super::judgement::NO_TRUTH;
use super::machine::Episode;
use super::npz::StoredTruth;
use super::record::{EpisodeRecord, StepRecord};
use crate::belief::{Belief, BeliefUpdate, CLASSICAL};
use crate::plan::Reason;
use crate::scene::Catalog;
use crate::{Error, Result};
use serde::Serialize;
use serde_json::Value;
use std::fmt;
use std::sync::Arc;

/// How far numbers of a network belief may be off on another machine, relative to their size where that is above one.
pub const TOLERANCE: f64 = 1e-3;

/// How well a replay agreed with its log.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Agreement {
    /// Every decision, score, belief and truth is the same to the last bit.
    BitEqual,
    /// Everything is the same within [`TOLERANCE`].
    Within {
        /// The largest difference found, relative to numbers above one.
        largest: f64,
    },
    /// Something differs.
    Differs,
}

/// The first place of a step where a replay left its log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The step, 0 for the prior.
    pub step: usize,
    /// What differs: a member of the step in `episode.json`, or a file and the array in it.
    pub place: String,
    /// What the log says.
    pub logged: String,
    /// What the replay found.
    pub now: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "step {}: {}: {} in the log, {} now", self.step, self.place, self.logged, self.now)
    }
}

/// What a replay found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReplayReport {
    /// Number of steps in the log, all of which were run again.
    pub steps: usize,
    /// Number of actions that the episode was planned for.
    pub budget: usize,
    /// Version of the program that wrote the log.
    pub version: String,
    /// How well everything agreed.
    pub agreement: Agreement,
    /// The first place that differs in every step that differs.
    pub differences: Vec<Difference>,
}

impl ReplayReport {
    /// An [`Error::Check`] that names the first difference, if there is one.
    pub fn verdict(&self) -> Result<()> {
        match self.differences.first() {
            None => Ok(()),
            Some(first) => Err(Error::Check(format!("the replay differs: {first}"))),
        }
    }
}

/// Runs an episode again from its log: decides anew at every step (but where a person chose), does what the log says,
/// and compares decision, scores, objects, belief and truth with what is filed. Seconds are not compared. Network
/// beliefs may differ by [`TOLERANCE`], all others not by a bit. `progress` is called with the number of steps done and
/// of those in the log.
///
/// # Errors
/// Those of reading the directory and of setting up the episode. A difference is not an error here but in
/// [`ReplayReport::verdict`].
pub fn replay(
    directory: &EpisodeDir,
    catalog: Arc<Catalog>,
    update: Arc<dyn BeliefUpdate>,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<ReplayReport> {
    let logged = directory.record()?;
    if !logged.has_truth() {
        let message = format!("cannot be simulated again: {NO_TRUTH}; its beliefs can be inferred again (--infer)");
        return Err(Error::input(directory.path(), "", message));
    }
    let mut episode = Episode::new(logged.scene.clone(), catalog, logged.config.clone(), update)?;
    let mut comparison = Comparison::new(tolerance(&logged));
    comparison.prior(&logged, episode.record());
    comparison.arrays(directory, &logged, 0, &episode)?;
    progress(0, logged.steps.len());
    for step in &logged.steps {
        comparison.at(step.index);
        if step.decision.reason != Reason::Manual {
            comparison.documents("decision", &step.decision, &episode.decide());
        }
        let outcome = episode.act(step.decision.clone())?;
        comparison.step(step, &outcome.record);
        comparison.arrays(directory, &logged, step.index, &episode)?;
        progress(step.index, logged.steps.len());
    }
    Ok(comparison.report(&logged))
}

/// How far numbers of an episode may be off.
pub(super) fn tolerance(logged: &EpisodeRecord) -> f64 {
    if logged.config.belief == CLASSICAL { 0.0 } else { TOLERANCE }
}

/// Compares what is filed with what is, and remembers the first difference of every step.
pub(super) struct Comparison {
    tolerance: f64,
    step: usize,
    largest: f64,
    differences: Vec<Difference>,
}

impl Comparison {
    pub(super) fn new(tolerance: f64) -> Self {
        Self { tolerance, step: 0, largest: 0.0, differences: Vec::new() }
    }

    pub(super) fn into_first_difference(self) -> Option<Difference> {
        self.differences.into_iter().next()
    }

    pub(super) fn report(self, logged: &EpisodeRecord) -> ReplayReport {
        ReplayReport {
            steps: logged.steps.len(),
            budget: logged.config.budget,
            version: logged.version.clone(),
            agreement: self.agreement(),
            differences: self.differences,
        }
    }

    fn agreement(&self) -> Agreement {
        if !self.differences.is_empty() {
            Agreement::Differs
        } else if self.largest > 0.0 {
            Agreement::Within { largest: self.largest }
        } else {
            Agreement::BitEqual
        }
    }

    pub(super) fn at(&mut self, step: usize) {
        self.step = step;
    }

    pub(super) fn prior(&mut self, logged: &EpisodeRecord, now: &EpisodeRecord) {
        self.at(0);
        self.documents("prior", &logged.prior, &now.prior);
    }

    /// Compares a step as a whole but for its seconds. The decision is the log's own on both sides here.
    pub(super) fn step(&mut self, logged: &StepRecord, now: &StepRecord) {
        self.at(logged.index);
        let now = StepRecord { seconds: logged.seconds, ..now.clone() };
        self.documents("", logged, &now);
    }

    /// Compares belief and truth after `actions` actions with the files.
    pub(super) fn arrays(
        &mut self,
        directory: &EpisodeDir,
        logged: &EpisodeRecord,
        actions: usize,
        episode: &Episode,
    ) -> Result<()> {
        self.belief(directory, actions, episode.belief())?;
        if let Some(truth) = episode.truth().filter(|_| logged.has_new_truth(actions)) {
            let filed = directory.read_truth(actions)?;
            let now = StoredTruth::from(truth);
            self.classes(&format!("truth/{actions:03}.npz: occupancy"), &filed.occupancy, &now.occupancy);
            self.classes(&format!("truth/{actions:03}.npz: labels"), &filed.labels, &now.labels);
        }
        Ok(())
    }

    /// Compares a belief with the one that is filed after `actions` actions.
    pub(super) fn belief(&mut self, directory: &EpisodeDir, actions: usize, belief: &Belief) -> Result<()> {
        let (filed, precision) = directory.read_belief_as_kept(actions)?;
        let place = |array: &str| format!("beliefs/{actions:03}.npz: {array}");
        let occupancy = precision.round_trip(belief.occupancy.as_flattened());
        self.evidence(&place("occupancy"), filed.occupancy.as_flattened(), &occupancy);
        let semantics = precision.round_trip(belief.semantics.as_flattened());
        self.evidence(&place("semantics"), filed.semantics.as_flattened(), &semantics);
        Ok(())
    }

    fn evidence(&mut self, place: &str, logged: &[f32], now: &[f32]) {
        if logged.len() != now.len() {
            self.differ(place, format!("{} numbers", logged.len()), now.len().to_string());
            return;
        }
        for (at, (logged, now)) in logged.iter().zip(now).enumerate() {
            if logged.to_bits() != now.to_bits() && !self.tolerates(f64::from(*logged), f64::from(*now)) {
                return self.differ(&format!("{place}[{at}]"), logged.to_string(), now.to_string());
            }
        }
    }

    fn classes(&mut self, place: &str, logged: &[u8], now: &[u8]) {
        if let Some(at) = (0..logged.len().max(now.len())).find(|at| logged.get(*at) != now.get(*at)) {
            let text = |value: Option<&u8>| value.map_or_else(|| "nothing".to_owned(), u8::to_string);
            self.differ(&format!("{place}[{at}]"), text(logged.get(at)), text(now.get(at)));
        }
    }

    pub(super) fn documents(&mut self, place: &str, logged: &impl Serialize, now: &impl Serialize) {
        // Through text, so that float32 shows as it does in the file.
        let value = |text: serde_json::Result<String>| text.and_then(|text| serde_json::from_str::<Value>(&text));
        match (value(serde_json::to_string(logged)), value(serde_json::to_string(now))) {
            (Ok(logged), Ok(now)) => self.values(place, &logged, &now),
            (logged, now) => self.differ(place, format!("{logged:?}"), format!("{now:?}")),
        }
    }

    fn values(&mut self, place: &str, logged: &Value, now: &Value) {
        match (logged, now) {
            (Value::Object(logged), Value::Object(now)) => {
                let missing: Vec<&String> = now.keys().filter(|key| !logged.contains_key(*key)).collect();
                for (key, logged) in logged {
                    let place = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
                    self.values(&place, logged, now.get(key).unwrap_or(&Value::Null));
                }
                for key in missing {
                    self.values(&format!("{place}.{key}"), &Value::Null, &now[key]);
                }
            }
            (Value::Array(logged), Value::Array(now)) if logged.len() == now.len() => {
                for (at, (logged, now)) in logged.iter().zip(now).enumerate() {
                    self.values(&format!("{place}[{at}]"), logged, now);
                }
            }
            (Value::Array(logged), Value::Array(now)) => {
                self.differ(place, format!("{} entries", logged.len()), now.len().to_string());
            }
            (Value::Number(a), Value::Number(b)) if a.is_f64() && b.is_f64() => {
                let (a, b) = (a.as_f64().unwrap_or(f64::NAN), b.as_f64().unwrap_or(f64::NAN));
                if a.to_bits() != b.to_bits() && !self.tolerates(a, b) {
                    self.differ(place, logged.to_string(), now.to_string());
                }
            }
            _ if logged == now => {}
            _ => self.differ(place, logged.to_string(), now.to_string()),
        }
    }

    fn tolerates(&mut self, logged: f64, now: f64) -> bool {
        let off = (logged - now).abs() / 1.0_f64.max(logged.abs()).max(now.abs());
        let tolerable = off <= self.tolerance && self.tolerance > 0.0;
        if tolerable {
            self.largest = self.largest.max(off);
        }
        tolerable
    }

    fn differ(&mut self, place: &str, logged: String, now: String) {
        if self.differences.last().is_none_or(|last| last.step != self.step) {
            self.differences.push(Difference { step: self.step, place: place.to_owned(), logged, now });
        }
    }
}

#[cfg(test)]
#[path = "replay_tests.rs"]
mod tests;
