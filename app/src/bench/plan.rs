//! What a bench consists of: sets of scenes, policies, seeds, a budget, and which share of it is this shard's.

use nudge_core::camera::NoiseModel;
use nudge_core::files::names_in;
use nudge_core::made_by::MadeBy;
use nudge_core::plan::{PlannerSettings, PolicyKind};
use nudge_core::scene::{Catalog, Scene};
use nudge_core::shard::Shard;
use nudge_core::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The format number of `bench.json`.
pub const FORMAT: u32 = 1;

/// Most episodes that a bench may have.
const MAX_EPISODES: u64 = 1_000_000;

/// `bench.json`: which episodes a bench consists of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Format number, [`FORMAT`].
    pub format: u32,
    /// Version of the program that began it.
    pub version: String,
    /// What made its results; not there in benches of programs that did not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_by: Option<MadeBy>,
    /// What else made some of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub also_made_by: Vec<AlsoMadeBy>,
    /// Number of actions of every episode.
    pub budget: usize,
    /// Seeds 0 to `seeds - 1`, for policies that draw at random; the others run once.
    pub seeds: u64,
    /// Name of the view array.
    pub views: String,
    /// The planner's numbers, of policies that have no own.
    pub planner: PlannerSettings,
    /// What the camera gets wrong; nothing unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseModel>,
    /// The policies, in the order of tables.
    pub policies: Vec<PolicyPlan>,
    /// The sets.
    pub sets: Vec<SetPlan>,
    /// Scene files that could not be read; the rest runs.
    pub broken: Vec<BrokenScene>,
    /// The share of the episodes that this directory holds; all of them without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
}

/// A policy and the belief update that it runs with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PolicyPlan {
    /// The policy.
    pub policy: PolicyKind,
    /// Name of the belief update.
    pub belief: String,
    /// The planner's numbers, where its belief is best served by others than the plan's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub planner: Option<PlannerSettings>,
}

/// A set of scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetPlan {
    /// Name of the set: of its folder, or of its file.
    pub name: String,
    /// Its scenes, in the order of their files.
    pub scenes: Vec<ScenePlan>,
}

/// A scene of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScenePlan {
    /// Name of its file without `.toml`: what results are filed under.
    pub id: String,
    /// Where it was read from.
    pub file: String,
    /// The scene itself.
    pub scene: Scene,
}

/// A scene file that could not be read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BrokenScene {
    /// The set that it belongs to.
    pub set: String,
    /// Name of its file without `.toml`.
    pub id: String,
    /// What is wrong, file and place named.
    pub error: String,
}

/// Another maker of a bench's results, beside the one that began it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlsoMadeBy {
    /// What made them; `None` where nothing tells.
    pub made_by: Option<MadeBy>,
    /// What is other than in the bench's own `made_by`, in words.
    pub differs: Vec<String>,
    /// Whether it keeps results from standing together: `--allow-mixed` let it in. Another commit with the same code of the
    /// method, for one, does not.
    pub mixed: bool,
}

/// One episode of a bench, by positions in its plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EpisodeId {
    /// Its set.
    pub set: usize,
    /// Its scene in the set.
    pub scene: usize,
    /// Its policy.
    pub policy: usize,
    /// Its seed.
    pub seed: u64,
}

impl Plan {
    /// All episodes of the plan, or of its shard, in the order in which they run: first every scene and policy with
    /// seed 0, so that an early look at the results sees all of them.
    pub fn episodes(&self) -> Vec<EpisodeId> {
        let shard = self.shard.unwrap_or_default();
        let mine = self.all_episodes().into_iter().enumerate().filter(|(at, _)| shard.has(*at));
        mine.map(|(_, episode)| episode).collect()
    }

    fn all_episodes(&self) -> Vec<EpisodeId> {
        let mut all = Vec::new();
        for seed in 0..self.seeds {
            for (set, in_set) in self.sets.iter().enumerate() {
                for scene in 0..in_set.scenes.len() {
                    let runs = |policy: &usize| seed == 0 || self.policies[*policy].policy.is_seeded();
                    let policies = (0..self.policies.len()).filter(runs);
                    all.extend(policies.map(|policy| EpisodeId { set, scene, policy, seed }));
                }
            }
        }
        all
    }

    /// Checks a plan that was read from `path`: how many episodes it has, the numbers of scenes and settings, and names that
    /// lead out of the bench's directory.
    ///
    /// # Errors
    /// For what no bench of this program has.
    pub(super) fn check(&self, path: &Path) -> Result<()> {
        let scenes: usize = self.sets.iter().map(|set| set.scenes.len()).sum();
        let of_a_seed = scenes as u64 * self.policies.len() as u64;
        if of_a_seed.checked_mul(self.seeds).is_none_or(|count| count > MAX_EPISODES) {
            let message = format!("{} seeds of {of_a_seed} episodes; the limit is {MAX_EPISODES} episodes", self.seeds);
            return Err(Error::input(path, "seeds", message));
        }
        let is_one_name = |name: &str| Path::new(name).file_name().is_some_and(|file| file == name);
        for set in &self.sets {
            let mut names = std::iter::once(&set.name).chain(set.scenes.iter().map(|scene| &scene.id));
            if let Some(name) = names.find(|name| !is_one_name(name)) {
                return Err(Error::input(path, "sets", format!("`{name}` is no name of a set or a scene")));
            }
            set.scenes.iter().try_for_each(|scene| scene.scene.check_numbers(path))?;
        }
        let planners = self.policies.iter().filter_map(|policy| policy.planner.as_ref());
        for planner in std::iter::once(&self.planner).chain(planners) {
            planner.check().map_err(|fault| Error::input(path, "planner", fault.to_string()))?;
        }
        Ok(())
    }

    /// An episode in words: `high/box-wall, random, seed 2`.
    pub fn name(&self, id: EpisodeId) -> String {
        let (set, policy) = (&self.sets[id.set], self.policies[id.policy].policy);
        format!("{}/{}, {policy}, seed {}", set.name, set.scenes[id.scene].id, id.seed)
    }

    /// Where an episode's result lies, seen from the folder of results, without its ending.
    pub fn place(&self, id: EpisodeId) -> PathBuf {
        let set = &self.sets[id.set];
        let file = format!("{}-{}", self.policies[id.policy].policy, id.seed);
        Path::new(&set.name).join(&set.scenes[id.scene].id).join(file)
    }

    /// The planner's numbers that a policy runs with.
    pub fn planner_of(&self, policy: usize) -> &PlannerSettings {
        self.policies[policy].planner.as_ref().unwrap_or(&self.planner)
    }

    /// Why this plan is not of the same episodes as `before`: the first thing that differs, in words. Where scene files lie
    /// does not matter, and one that could not be read may have been mended. Whether what made their results is the same is
    /// another question: [`Plan::join`].
    pub fn difference(&self, before: &Self) -> Option<String> {
        let policies = |plan: &Self| {
            let name = |p: &PolicyPlan| format!("{} on the {} belief", p.policy, p.belief);
            plan.policies.iter().map(name).collect::<Vec<_>>().join(", ")
        };
        let shard = |plan: &Self| plan.shard.map_or("no shard".to_owned(), |shard| format!("shard {shard}"));
        let noise = |plan: &Self| NoiseModel::name_of(plan.noise);
        let settings: [(&str, String, String); 6] = [
            ("budget", before.budget.to_string(), self.budget.to_string()),
            ("number of seeds", before.seeds.to_string(), self.seeds.to_string()),
            ("view array", before.views.clone(), self.views.clone()),
            ("noise", noise(before), noise(self)),
            ("policies", policies(before), policies(self)),
            ("shard", shard(before), shard(self)),
        ];
        let differs = settings.into_iter().find(|(_, before, now)| before != now);
        if let Some((what, before, now)) = differs {
            return Some(format!("the {what} was {before}, now it is {now}"));
        }
        self.untold_difference(before).or_else(|| self.scene_difference(before))
    }

    /// What differs of that which `made_by` tells, where neither has one; and of a policy's own numbers, of which it never
    /// tells.
    fn untold_difference(&self, before: &Self) -> Option<String> {
        if self.made_by.is_some() || before.made_by.is_some() {
            return (self.planner == before.planner).then(|| self.planner_difference(before)).flatten();
        }
        if self.version != before.version {
            return Some(format!("the version was {}, now it is {}", before.version, self.version));
        }
        self.planner_difference(before)
    }

    /// The first of the planner's numbers that differs, by its option, and of which policy if not of all.
    fn planner_difference(&self, before: &Self) -> Option<String> {
        let whole = self.planner.difference(&before.planner).map(|differs| (String::new(), differs));
        let of = |at: usize| {
            let differs = self.planner_of(at).difference(before.planner_of(at))?;
            Some((format!(" of {}", self.policies[at].policy), differs))
        };
        let (of, (setting, before, now)) = whole.or_else(|| (0..self.policies.len()).find_map(of))?;
        Some(format!("--{}{of} was {before}, now it is {now}", setting.name))
    }

    fn scene_difference(&self, before: &Self) -> Option<String> {
        let names = |plan: &Self| plan.sets.iter().map(|set| set.name.clone()).collect::<Vec<_>>();
        if names(self) != names(before) {
            return Some(format!(
                "the sets were {}, now they are {}",
                names(before).join(", "),
                names(self).join(", ")
            ));
        }
        for (now, then) in self.sets.iter().zip(&before.sets) {
            let was_broken = |id: &str| before.broken.iter().any(|b| b.set == now.name && b.id == id);
            for scene in &now.scenes {
                match then.scenes.iter().find(|other| other.id == scene.id) {
                    Some(other) if other.scene == scene.scene => {}
                    Some(_) => return Some(format!("scene {}/{} is another one", now.name, scene.id)),
                    None if was_broken(&scene.id) => {}
                    None => return Some(format!("scene {}/{} was not there", now.name, scene.id)),
                }
            }
            let gone = then.scenes.iter().find(|scene| now.scenes.iter().all(|other| other.id != scene.id));
            if let Some(scene) = gone {
                return Some(format!("scene {}/{} is gone", now.name, scene.id));
            }
        }
        None
    }
}

/// Reads sets of scenes: each a folder of scene files, or a single scene file that makes a set of its own.
///
/// # Errors
/// For a folder without scene files, a path that is not there, two sets of one name, and when no scene at all can be
/// read. Single files that cannot be read come back as broken.
pub fn load_sets(paths: &[PathBuf], catalog: &Catalog) -> Result<(Vec<SetPlan>, Vec<BrokenScene>)> {
    let (mut sets, mut broken) = (Vec::new(), Vec::new());
    let mut names = BTreeSet::new();
    for path in paths {
        let (name, files) = scene_files(path)?;
        if !names.insert(name.clone()) {
            return Err(Error::input(
                path,
                "",
                format!("another set is called {name}, too: rename one of the folders"),
            ));
        }
        let mut scenes = Vec::new();
        for file in files {
            let id = stem(&file);
            match Scene::load(&file, catalog) {
                Ok((scene, _)) => scenes.push(ScenePlan { id, file: file.display().to_string(), scene }),
                Err(error) => broken.push(BrokenScene { set: name.clone(), id, error: error.to_string() }),
            }
        }
        sets.push(SetPlan { name, scenes });
    }
    if sets.iter().all(|set| set.scenes.is_empty()) {
        let first = broken.first().map_or("no set was named", |broken| &broken.error);
        return Err(Error::Usage(format!("no scene can be read: {first}")));
    }
    Ok((sets, broken))
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Name and files of a set.
fn scene_files(path: &Path) -> Result<(String, Vec<PathBuf>)> {
    if path.is_file() {
        return Ok((stem(path), vec![path.to_owned()]));
    }
    // The real path has the name of a folder that was typed as `.` or `scenes/..`.
    let real = path.canonicalize().map_err(|error| Error::io(path, error))?;
    let name = real.file_name().map_or("scenes".to_owned(), |name| name.to_string_lossy().into_owned());
    let is_scene = |name: &String| name.ends_with(".toml") && !name.starts_with('.');
    let files: Vec<PathBuf> =
        names_in(path)?.iter().filter(|name| is_scene(name)).map(|name| path.join(name)).collect();
    if files.is_empty() {
        return Err(Error::input(path, "", "holds no scene files (*.toml): the set is empty"));
    }
    Ok((name, files))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::bench) fn plan(shard: Option<Shard>) -> Plan {
        let scene = |id: &str| ScenePlan {
            id: id.to_owned(),
            file: format!("{id}.toml"),
            scene: Scene {
                name: id.to_owned(),
                description: String::new(),
                shelf: nudge_core::scene::Shelf::new([0.8, 0.4, 0.4]),
                objects: Vec::new(),
                meshes: std::collections::BTreeMap::new(),
                robot: nudge_core::scene::RobotPlacement::default(),
            },
        };
        let policy = |policy| PolicyPlan { policy, belief: "classical".to_owned(), planner: None };
        Plan {
            format: FORMAT,
            version: "1".to_owned(),
            made_by: None,
            also_made_by: Vec::new(),
            budget: 20,
            seeds: 3,
            views: "standard300".to_owned(),
            planner: PlannerSettings::default(),
            noise: None,
            policies: vec![policy(PolicyKind::Mem), policy(PolicyKind::Oracle)],
            sets: vec![SetPlan { name: "a".to_owned(), scenes: vec![scene("x"), scene("y")] }],
            broken: Vec::new(),
            shard,
        }
    }

    #[test]
    fn policies_without_dice_run_once() {
        let episodes = plan(None).episodes();
        assert_eq!(episodes.len(), 2 * (3 + 1));
        assert!(episodes[..4].iter().all(|episode| episode.seed == 0), "seed 0 of everything comes first");
    }

    #[test]
    fn a_bench_of_endless_seeds_never_opened_and_names_led_out_of_its_folder() {
        let refused = |change: &dyn Fn(&mut Plan)| {
            let mut changed = plan(None);
            change(&mut changed);
            changed.check(Path::new("bench.json")).map_err(|error| error.to_string())
        };
        assert_eq!(refused(&|_| ()), Ok(()));
        let line = refused(&|plan| plan.seeds = u64::MAX).expect_err("endless");
        assert!(line.starts_with("bench.json: seeds: 18446744073709551615 seeds of 4 episodes"), "{line}");
        for name in ["../../a", "..", "a/b", "/a", ""] {
            let line = refused(&|plan| name.clone_into(&mut plan.sets[0].name)).expect_err("leads out");
            assert!(line.contains(&format!("`{name}` is no name")), "{line}");
            assert!(refused(&|plan| name.clone_into(&mut plan.sets[0].scenes[1].id)).is_err(), "{name}");
        }
        assert!(refused(&|plan| plan.sets[0].scenes[0].scene.shelf.size[0] = 1e30).is_err());
        assert!(refused(&|plan| plan.planner.candidates = usize::MAX).is_err());
    }

    #[test]
    fn shards_share_all_episodes_and_none_twice() {
        let mut all: Vec<EpisodeId> =
            (0..3).flat_map(|index| plan(Some(Shard { index, count: 3 })).episodes()).collect();
        all.sort();
        let mut expected = plan(None).episodes();
        expected.sort();
        assert_eq!(all, expected);
    }

    #[test]
    fn what_differs_is_named() {
        let before = plan(None);
        assert_eq!(before.difference(&before), None);
        let mut moved = before.clone();
        moved.sets[0].scenes[0].file = "elsewhere/x.toml".to_owned();
        assert_eq!(moved.difference(&before), None);
        let mut other = before.clone();
        other.budget = 40;
        assert_eq!(other.difference(&before).as_deref(), Some("the budget was 20, now it is 40"));
        let mut eager = before.clone();
        eager.planner.patience = 3.0;
        assert_eq!(eager.difference(&before).as_deref(), Some("--patience was 1, now it is 3"));
        let mut own = before.clone();
        own.policies[1].planner = Some(PlannerSettings { gamma: 0.5, ..before.planner });
        assert_eq!(own.difference(&before).as_deref(), Some("--gamma of oracle was 0.2, now it is 0.5"));
        let told = |plan: &Plan| Plan {
            made_by: Some(MadeBy::new(Default::default(), None, plan.planner, 1)),
            ..plan.clone()
        };
        let words = told(&own).difference(&told(&before));
        assert_eq!(words.as_deref(), Some("--gamma of oracle was 0.2, now it is 0.5"), "no maker tells of it");
        assert_eq!(told(&eager).difference(&told(&before)), None, "makers tell of it: `join`");
        let noisy = Plan { noise: Some(NoiseModel::STANDARD), ..before.clone() };
        assert_eq!(noisy.difference(&before).as_deref(), Some("the noise was none, now it is standard"));
        let mut fewer = before.clone();
        let gone = fewer.sets[0].scenes.remove(1);
        assert_eq!(fewer.difference(&before).as_deref(), Some("scene a/y is gone"));
        assert_eq!(before.difference(&fewer).as_deref(), Some("scene a/y was not there"));
        fewer.broken.push(BrokenScene { set: "a".to_owned(), id: gone.id, error: "torn".to_owned() });
        assert_eq!(before.difference(&fewer), None, "a mended scene may join");
    }
}
