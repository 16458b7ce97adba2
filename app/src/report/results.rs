//! The results of a bench, by set, policy and scene.

use crate::bench::{BenchDir, EpisodeId, EpisodeResult, EpisodeSeconds, Plan};
use nudge_core::plan::PolicyKind;
use nudge_core::score::{Interval, Scores, Tally, mean};
use nudge_core::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A score that is shown over the steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Mean IoU of free and occupied.
    OccupancyIou,
    /// Mean IoU over classes.
    SemanticMiou,
    /// Entropy of the map, nats.
    Entropy,
}

impl Metric {
    /// Its value in scores.
    pub fn of(self, scores: &Scores) -> f64 {
        match self {
            Self::OccupancyIou => scores.occupancy_iou,
            Self::SemanticMiou => scores.semantic_miou,
            Self::Entropy => scores.entropy_nats,
        }
    }

    /// Its name on axes and in tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::OccupancyIou => "occupancy IoU",
            Self::SemanticMiou => "semantic mIoU",
            Self::Entropy => "map entropy, nats",
        }
    }
}

/// One finished episode with what else is known of it.
#[derive(Debug)]
pub struct Finished {
    /// Which one it is.
    pub id: EpisodeId,
    /// Its result.
    pub result: EpisodeResult,
    /// Where its time went.
    pub seconds: Option<EpisodeSeconds>,
    /// Its recording, seen from the bench's directory, if it was recorded.
    pub recording: Option<PathBuf>,
}

/// Everything that a bench measured.
#[derive(Debug)]
pub struct Results {
    /// What the bench consists of.
    pub plan: Plan,
    /// By set and policy, as they are numbered in the plan.
    cells: BTreeMap<(usize, usize), Cell>,
    /// Number of episodes that are missing.
    pub missing: usize,
}

/// The episodes of a policy in a set.
#[derive(Debug, Default)]
pub struct Cell {
    /// By scene, each with its seeds.
    pub scenes: BTreeMap<usize, Vec<Finished>>,
}

impl Results {
    /// Reads the results of a bench.
    ///
    /// # Errors
    /// For a directory that is no bench, and for an unfinished one unless `partial`: the error says what is missing.
    pub fn read(path: &Path, partial: bool) -> Result<Self> {
        let (directory, plan) = BenchDir::open(path)?;
        let mut cells: BTreeMap<(usize, usize), Cell> = BTreeMap::new();
        let episodes = plan.episodes();
        let mut missing = Vec::new();
        for id in &episodes {
            let Some(result) = directory.result(&plan, *id)? else {
                missing.push(*id);
                continue;
            };
            let recording = BenchDir::recording(&plan, *id);
            let finished = Finished {
                id: *id,
                result,
                seconds: directory.seconds(&plan, *id),
                recording: path.join(&recording).is_dir().then_some(recording),
            };
            cells.entry((id.set, id.policy)).or_default().scenes.entry(id.scene).or_default().push(finished);
        }
        if let Some(first) = missing.first().filter(|_| !partial || missing.len() == episodes.len()) {
            let message = format!(
                "is unfinished: {} of {} episodes are missing, first {}; the same `nudge bench` command goes on with it",
                missing.len(),
                episodes.len(),
                plan.name(*first)
            );
            return Err(Error::input(path, "", message));
        }
        Ok(Self { missing: missing.len(), plan, cells })
    }

    /// The episodes of a policy in a set.
    pub fn cell(&self, set: usize, policy: usize) -> Option<&Cell> {
        self.cells.get(&(set, policy))
    }

    /// The policies that have episodes in a set, in the plan's order.
    pub fn policies(&self, set: usize) -> Vec<(usize, PolicyKind, &Cell)> {
        let named = |policy: usize| Some((policy, self.plan.policies[policy].policy, self.cell(set, policy)?));
        (0..self.plan.policies.len()).filter_map(named).collect()
    }

    /// Position of a policy in the plan.
    pub fn position(&self, policy: PolicyKind) -> Option<usize> {
        self.plan.policies.iter().position(|plan| plan.policy == policy)
    }
}

impl Cell {
    /// All its episodes.
    pub fn episodes(&self) -> impl Iterator<Item = &Finished> {
        self.scenes.values().flatten()
    }

    /// A value of every scene, averaged over its seeds, by scene.
    pub fn by_scene(&self, value: impl Fn(&EpisodeResult) -> f64) -> BTreeMap<usize, f64> {
        let of_seeds = |seeds: &Vec<Finished>| mean(&seeds.iter().map(|f| value(&f.result)).collect::<Vec<_>>());
        self.scenes.iter().map(|(scene, seeds)| (*scene, of_seeds(seeds))).collect()
    }

    /// Mean and interval of a value over scenes.
    pub fn interval(&self, value: impl Fn(&EpisodeResult) -> f64) -> Interval {
        Interval::of(&self.by_scene(value).into_values().collect::<Vec<_>>())
    }

    /// Mean of a value over scenes.
    pub fn mean(&self, value: impl Fn(&EpisodeResult) -> f64) -> f64 {
        mean(&self.by_scene(value).into_values().collect::<Vec<_>>())
    }

    /// Difference of a value to another policy, scene by scene, over the scenes that both have.
    pub fn difference(&self, other: &Self, value: impl Fn(&EpisodeResult) -> f64) -> Interval {
        let (mine, theirs) = (self.by_scene(&value), other.by_scene(&value));
        let both: Vec<(f64, f64)> =
            mine.iter().filter_map(|(scene, mine)| Some((*mine, *theirs.get(scene)?))).collect();
        let (mine, theirs): (Vec<f64>, Vec<f64>) = both.into_iter().unzip();
        Interval::of_difference(&mine, &theirs)
    }

    /// The counts of all episodes together after a number of actions at which tallies are kept.
    pub fn tally(&self, actions: usize) -> Tally {
        let mut sum = Tally::default();
        for finished in self.episodes() {
            for (_, tally) in finished.result.tallies.iter().filter(|(at, _)| *at == actions) {
                sum.merge(tally);
            }
        }
        sum
    }

    /// Seconds per decision, mean over all steps; `None` if no times were kept.
    pub fn seconds_per_decision(&self) -> Option<f64> {
        let steps = self.episodes().filter_map(|finished| finished.seconds.as_ref()).flat_map(|s| &s.steps);
        let seconds: Vec<f64> = steps.map(|step| step.decide).collect();
        (!seconds.is_empty()).then(|| mean(&seconds))
    }
}
