//! The regression gate: a small fixed bench whose scores must stay what they were.
//!
//! A golden file names scenes, policies, a belief update and a budget, and holds for every policy what its episodes scored,
//! with a tolerance for each score. A change that means to alter scores shows how, and [`Golden::bless`] takes the new ones
//! over. Tolerances are measured, not chosen: episodes are the same bit for bit on one machine, and libtorch rounds
//! differently where a processor has other instructions. So a blessing runs the networks with the instructions of older
//! processors as well ([`OTHER_PROCESSORS`]); a tolerance is [`ROUNDINGS`] times the farthest that a score moves, and never
//! below a floor.

use crate::bench::{
    BenchDir, EpisodeResult, Event, FORMAT as BENCH_FORMAT, Plan, PolicyPlan, ScenePlan, SetPlan, Workers, run,
};
use crate::driver::belief_update;
use nudge_core::files::write_atomically;
use nudge_core::plan::{Counted, PlannerSettings, PolicyKind};
use nudge_core::scene::{Catalog, Scene};
use nudge_core::score::mean;
use nudge_core::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The format number of golden files.
const FORMAT: u32 = 1;
/// How many times what rounding moves a score a tolerance spans.
pub const ROUNDINGS: f64 = 2.0;
/// The environment in which libtorch computes as on a processor with AVX2 only, and on one without.
pub const OTHER_PROCESSORS: [[(&str, &str); 2]; 2] = [
    [("ATEN_CPU_CAPABILITY", "avx2"), ("ONEDNN_MAX_CPU_ISA", "AVX2")],
    [("ATEN_CPU_CAPABILITY", "default"), ("ONEDNN_MAX_CPU_ISA", "SSE41")],
];

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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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

static WATCHED: [Watched; 10] = [
    Watched { name: "occupancy_iou", of: |r| r.scores(r.steps.len()).occupancy_iou, floor: Floor::Number(0.004) },
    Watched { name: "occupied_iou", of: |r| r.scores(r.steps.len()).occupied_iou, floor: Floor::Number(0.004) },
    Watched { name: "semantic_miou", of: |r| r.scores(r.steps.len()).semantic_miou, floor: Floor::Number(0.004) },
    Watched { name: "mece_occupancy", of: |r| r.scores(r.steps.len()).mece_occupancy, floor: Floor::Number(0.004) },
    Watched { name: "mece_semantics", of: |r| r.scores(r.steps.len()).mece_semantics, floor: Floor::Number(0.004) },
    Watched { name: "entropy_nats", of: |r| r.scores(r.steps.len()).entropy_nats, floor: Floor::Share(0.005) },
    Watched { name: "gain_nats", of: mean_gain, floor: Floor::Share(0.005) },
    Watched { name: "push_nats", of: mean_worth, floor: Floor::Share(0.01) },
    Watched { name: "pushes", of: |r| r.pushes() as f64, floor: Floor::Number(0.0) },
    Watched { name: "hidden_found", of: |r| r.revealed() as f64, floor: Floor::Number(0.0) },
];

/// Worth of the best push, mean over the steps.
fn mean_worth(result: &EpisodeResult) -> f64 {
    mean(&result.steps.iter().map(|step| f64::from(step.igm)).collect::<Vec<_>>())
}

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
        let results = self.run(path, workers, done)?;
        let compared = |policy: PolicyKind, watched: &Watched| {
            let now = self.value(&results, policy, watched);
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

    /// Takes over what was scored now, with tolerances that follow from what was scored with other rounding.
    pub fn bless(&self, now: &[Compared], rounded: &[Vec<Compared>]) -> Self {
        let score = |scored: &Compared| {
            let floor = match WATCHED.iter().find(|watched| watched.name == scored.name).map(|watched| &watched.floor) {
                Some(Floor::Share(share)) => share * scored.now.abs(),
                Some(Floor::Number(floor)) => *floor,
                None => 0.0,
            };
            let same = |other: &&Compared| (other.policy, &other.name) == (scored.policy, &scored.name);
            let others = rounded.iter().filter_map(|run| run.iter().find(same));
            let farthest = others.map(|other| (other.now - scored.now).abs()).fold(0.0, f64::max);
            let tolerance = floor.max(ROUNDINGS * farthest);
            GoldenScore { policy: scored.policy, name: scored.name.clone(), golden: scored.now, tolerance }
        };
        Self { scores: now.iter().map(score).collect(), ..self.clone() }
    }

    /// Whether the episodes run on networks, whose sums depend on the processor.
    pub fn is_rounded(&self) -> bool {
        self.belief == nudge_core::belief::CNABU
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
    fn value(&self, results: &[EpisodeResult], policy: PolicyKind, watched: &Watched) -> f64 {
        let of_policy = results.iter().filter(|result| result.policy == policy);
        mean(&of_policy.map(watched.of).collect::<Vec<_>>())
    }

    fn run(&self, path: &Path, workers: Workers, done: &mut dyn FnMut()) -> Result<Vec<EpisodeResult>> {
        let plan = self.plan(path)?;
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
        results.sort_by(|a, b| a.scene.cmp(&b.scene));
        failed.map_or(Ok(results), Err)
    }

    fn plan(&self, path: &Path) -> Result<Plan> {
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
            let update = belief_update(Some(&self.belief), *policy)?;
            policies.push(PolicyPlan { policy: *policy, belief: update.name().to_owned(), planner: None });
        }
        Ok(Plan {
            format: BENCH_FORMAT,
            version: nudge_core::VERSION.to_owned(),
            budget: self.budget,
            seeds: 1,
            views: "standard300".to_owned(),
            planner: PlannerSettings::default().counting(Counted::of_belief(&self.belief)),
            noise: None,
            policies,
            sets: vec![SetPlan { name: "regress".to_owned(), scenes }],
            broken: Vec::new(),
            shard: None,
            made_by: None,
            also_made_by: Vec::new(),
        })
    }
}
