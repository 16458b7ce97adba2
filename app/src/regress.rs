//! The regression gate: a small fixed bench whose scores must stay what they were.
//!
//! A golden file names scenes, policies and a budget, and holds for every policy what its episodes scored, with a tolerance
//! for each score. A change that means to alter scores shows how, and [`Golden::bless`] takes the new ones over. Tolerances
//! are measured, not chosen: [`SPREADS`] times the spread of the scores between seeds, which is how far they move when
//! nothing but chance changes, and never below a floor for what another machine's rounding can do.

use crate::bench::{
    BenchDir, EpisodeResult, Event, FORMAT as BENCH_FORMAT, Plan, PolicyPlan, ScenePlan, SetPlan, Workers, run,
};
use crate::driver::belief_update;
use nudge_core::files::write_atomically;
use nudge_core::plan::{PlannerSettings, PolicyKind};
use nudge_core::scene::{Catalog, Scene};
use nudge_core::score::{deviation, mean};
use nudge_core::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The format number of golden files.
const FORMAT: u32 = 1;
/// Standard deviations between seeds that a tolerance spans.
pub const SPREADS: f64 = 3.0;
/// Seeds that the spread is measured over.
const SEEDS: u64 = 5;

/// A golden file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Golden {
    /// Format number.
    format: u32,
    /// Scene files, relative to the golden file.
    scenes: Vec<PathBuf>,
    /// The policies.
    policies: Vec<PolicyKind>,
    /// The belief update that all of them run with.
    belief: String,
    /// Number of actions.
    budget: usize,
    /// What is expected; empty until the first blessing.
    #[serde(default)]
    scores: Vec<GoldenScore>,
}

/// What a policy is expected to score, mean over the scenes with seed 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoldenScore {
    /// The policy.
    pub policy: PolicyKind,
    /// Name of the score.
    pub name: String,
    /// Its value.
    pub golden: f64,
    /// How far off it may be.
    pub tolerance: f64,
}

/// A score now, beside the golden one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// The policy.
    pub policy: PolicyKind,
    /// Name of the score.
    pub name: String,
    /// The golden value; `None` if there is none yet.
    pub golden: Option<f64>,
    /// How far off it may be.
    pub tolerance: Option<f64>,
    /// The value now.
    pub now: f64,
    /// Whether it is within its tolerance.
    pub ok: bool,
}

/// A score that the gate watches.
struct Watched {
    name: &'static str,
    of: fn(&EpisodeResult) -> f64,
    /// The least tolerance: a number, or a share of the value.
    floor: Floor,
}

enum Floor {
    Number(f64),
    Share(f64),
}

static WATCHED: [Watched; 7] = [
    Watched { name: "occupancy_iou", of: |r| r.scores(r.steps.len()).occupancy_iou, floor: Floor::Number(0.004) },
    Watched { name: "occupied_iou", of: |r| r.scores(r.steps.len()).occupied_iou, floor: Floor::Number(0.004) },
    Watched { name: "semantic_miou", of: |r| r.scores(r.steps.len()).semantic_miou, floor: Floor::Number(0.004) },
    Watched { name: "mece_occupancy", of: |r| r.scores(r.steps.len()).mece_occupancy, floor: Floor::Number(0.004) },
    Watched { name: "mece_semantics", of: |r| r.scores(r.steps.len()).mece_semantics, floor: Floor::Number(0.004) },
    Watched { name: "entropy_nats", of: |r| r.scores(r.steps.len()).entropy_nats, floor: Floor::Share(0.005) },
    Watched { name: "gain_nats", of: mean_gain, floor: Floor::Share(0.005) },
];

/// Gain of the best pair of views, mean over the steps.
fn mean_gain(result: &EpisodeResult) -> f64 {
    mean(&result.steps.iter().map(|step| f64::from(step.igv)).collect::<Vec<_>>())
}

impl Golden {
    /// Reads a golden file.
    ///
    /// # Errors
    /// For a file that is none, with its line.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
        let golden: Self = serde_json::from_str(&text).map_err(|error| {
            let words = error.to_string();
            let words = words.rsplit_once(" at line ").map_or(words.as_str(), |(words, _)| words);
            Error::input(path, format!("line {}", error.line()), words)
        })?;
        let wrong = |place: &str, message: String| Err(Error::input(path, place, message));
        if golden.format != FORMAT {
            return wrong("format", format!("is {}, this version reads {FORMAT}", golden.format));
        }
        if golden.scenes.is_empty() || golden.policies.is_empty() || golden.budget == 0 {
            return wrong("", "names no scenes, no policies or no actions".to_owned());
        }
        Ok(golden)
    }

    /// Number of episodes of a comparison.
    pub fn episodes(&self) -> usize {
        self.scenes.len() * self.policies.len()
    }

    /// Runs the episodes and holds their scores against the golden ones. `done` is called after each episode.
    ///
    /// # Errors
    /// For scenes that cannot be read and episodes that cannot be run.
    pub fn compare(&self, path: &Path, workers: Workers, done: &mut dyn FnMut()) -> Result<Vec<Compared>> {
        let results = self.run(path, 1, workers, done)?;
        let compared = |policy: PolicyKind, watched: &Watched| {
            let now = self.value(&results, policy, 0, watched);
            let expected = self.scores.iter().find(|score| score.policy == policy && score.name == watched.name);
            Compared {
                policy,
                name: watched.name.to_owned(),
                golden: expected.map(|score| score.golden),
                tolerance: expected.map(|score| score.tolerance),
                now,
                // Written so that what is not a number is not ok.
                ok: expected.is_some_and(|score| (now - score.golden).abs() <= score.tolerance),
            }
        };
        let of_policy =
            |policy: &PolicyKind| WATCHED.iter().map(|watched| compared(*policy, watched)).collect::<Vec<_>>();
        Ok(self.policies.iter().flat_map(of_policy).collect())
    }

    /// Runs the episodes with several seeds and takes over what they score.
    ///
    /// # Errors
    /// Those of [`Self::compare`].
    pub fn bless(&self, path: &Path, workers: Workers, done: &mut dyn FnMut()) -> Result<Self> {
        let results = self.run(path, SEEDS, workers, done)?;
        let score = |policy: PolicyKind, watched: &Watched| {
            let seeds = if policy.is_seeded() { SEEDS } else { 1 };
            let values: Vec<f64> = (0..seeds).map(|seed| self.value(&results, policy, seed, watched)).collect();
            let floor = match watched.floor {
                Floor::Number(floor) => floor,
                Floor::Share(share) => share * values[0].abs(),
            };
            // The golden value is that of seed 0, which may lie at one end of what the seeds bring.
            let farthest = values.iter().map(|value| (value - values[0]).abs()).fold(0.0, f64::max);
            let tolerance = floor.max(SPREADS * deviation(&values)).max(farthest);
            GoldenScore { policy, name: watched.name.to_owned(), golden: values[0], tolerance }
        };
        let of_policy = |policy: &PolicyKind| WATCHED.iter().map(|watched| score(*policy, watched)).collect::<Vec<_>>();
        Ok(Self { scores: self.policies.iter().flat_map(of_policy).collect(), ..self.clone() })
    }

    /// Number of episodes of a blessing.
    pub fn episodes_to_bless(&self) -> usize {
        let seeds = |policy: &PolicyKind| if policy.is_seeded() { SEEDS as usize } else { 1 };
        self.scenes.len() * self.policies.iter().map(seeds).sum::<usize>()
    }

    /// What is expected of a score.
    pub fn expected(&self, policy: PolicyKind, name: &str) -> Option<&GoldenScore> {
        self.scores.iter().find(|score| score.policy == policy && score.name == name)
    }

    /// Everything that is expected.
    pub fn scores(&self) -> &[GoldenScore] {
        &self.scores
    }

    /// Writes the file, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).map_err(|error| Error::input(path, "", error.to_string()))?;
        write_atomically(path, (text + "\n").as_bytes())
    }

    /// Mean of a score over the scenes.
    fn value(&self, results: &[EpisodeResult], policy: PolicyKind, seed: u64, watched: &Watched) -> f64 {
        let of_policy = results.iter().filter(|result| (result.policy, result.seed) == (policy, seed));
        mean(&of_policy.map(watched.of).collect::<Vec<_>>())
    }

    fn run(&self, path: &Path, seeds: u64, workers: Workers, done: &mut dyn FnMut()) -> Result<Vec<EpisodeResult>> {
        let plan = self.plan(path, seeds)?;
        let scratch = tempfile::tempdir().map_err(|error| Error::io(std::env::temp_dir(), error))?;
        let directory = BenchDir::prepare(scratch.path(), &plan)?;
        let (mut results, mut failed) = (Vec::new(), None);
        run(&plan, &directory, &plan.episodes(), workers, false, &mut |event| {
            match event {
                Event::Done { result, .. } => results.push(*result),
                Event::Failed { error, .. } => failed = Some(error),
            }
            done();
        })?;
        // In the order of the plan, whichever was ready first: sums do not depend on the number of workers.
        results.sort_by(|a, b| (&a.scene, a.seed).cmp(&(&b.scene, b.seed)));
        failed.map_or(Ok(results), Err)
    }

    fn plan(&self, path: &Path, seeds: u64) -> Result<Plan> {
        let catalog = Catalog::standard();
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut scenes = Vec::new();
        for (at, file) in self.scenes.iter().enumerate() {
            let file = folder.join(file);
            let (scene, _) = Scene::load(&file, &catalog)?;
            scenes.push(ScenePlan { id: format!("{at:03}"), file: file.display().to_string(), scene });
        }
        let mut policies = Vec::new();
        for policy in &self.policies {
            let (update, _) = belief_update(Some(&self.belief), *policy)?;
            policies.push(PolicyPlan { policy: *policy, belief: update.name().to_owned(), planner: None });
        }
        Ok(Plan {
            format: BENCH_FORMAT,
            version: nudge_core::VERSION.to_owned(),
            budget: self.budget,
            seeds,
            views: "standard300".to_owned(),
            planner: PlannerSettings::default(),
            noise: None,
            policies,
            sets: vec![SetPlan { name: "regress".to_owned(), scenes }],
            broken: Vec::new(),
            shard: None,
        })
    }
}
