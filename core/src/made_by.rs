//! What made numbers: the program and the commit it was built from, the method's source, weights, settings.
//!
//! `episode.json` and `bench.json` carry it as `made_by`. Three questions are asked of it:
//!
//! * **May results stand together?** ([`MadeBy::differences`]) Only those of one version, one [`METHOD`], the same weights
//!   and the same planner settings. The commit is not asked for: one that changes no line of the method, of the files it
//!   embeds or of the crates it computes with makes the same numbers.
//! * **Is it the same program?** ([`MadeBy::is_same_maker`]) Commit, libtorch and device count as well. The number of
//!   threads does not, since results do not depend on it, and neither does whether the checkout had changes.
//! * **Which of several makers made this result?** [`MadeBy::fingerprint`] stands in each result of a bench.

use crate::belief::{ModuleFiles, NetworksUsed, Weights, short};
use crate::files::sha256;
use crate::plan::{PlannerSettings, SETTINGS};
use serde::{Deserialize, Serialize};

#[cfg(test)]
mod source;

/// SHA-256 of the method's source: this crate's code without comments, blank lines and tests, the files that it embeds, and
/// the versions of the crates that it computes with.
pub const METHOD: &str = env!("NUDGE_METHOD");

/// Stands for a commit that is not known.
pub const UNKNOWN: &str = "unknown";

/// The build of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Build {
    /// The git commit that was checked out when it was built, or [`UNKNOWN`] (a source archive, no git).
    pub commit: String,
    /// Whether files that go into the program differed from that commit then; `None` where there is none.
    pub dirty: Option<bool>,
}

impl Default for Build {
    fn default() -> Self {
        Self { commit: UNKNOWN.to_owned(), dirty: None }
    }
}

/// What made an episode or the results of a bench.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MadeBy {
    /// Version of the program.
    pub version: String,
    /// The git commit that it was built from, or [`UNKNOWN`].
    pub commit: String,
    /// Whether files that go into the program differed from the commit when it was built; not there where no commit is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dirty: Option<bool>,
    /// The method's source, [`METHOD`].
    pub method: String,
    /// The networks' weights; not there for the classical belief, and neither are the next two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<Weights>,
    /// The files of modules of the user's own that stood in for networks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modules: Option<ModuleFiles>,
    /// Version of libtorch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub libtorch: Option<String>,
    /// Where the networks ran: `cpu` or `cuda`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// Number of threads. Results do not depend on it, seconds do.
    pub threads: usize,
    /// The planner's settings.
    pub planner: PlannerSettings,
    /// A short name for all that results depend on: results with the same one may stand together.
    pub fingerprint: String,
}

impl MadeBy {
    /// What this program makes with these networks (none for the classical belief) and settings on so many threads.
    pub fn new(build: Build, networks: Option<NetworksUsed>, planner: PlannerSettings, threads: usize) -> Self {
        let Build { commit, dirty } = build;
        let (weights, modules, libtorch, device) = match networks {
            Some(used) => {
                let modules = Some(used.modules).filter(|modules| !modules.is_empty());
                (Some(used.weights), modules, Some(used.libtorch), Some(used.device))
            }
            None => (None, None, None, None),
        };
        let version = crate::VERSION.to_owned();
        let decisive = serde_json::to_string(&(&version, METHOD, &weights, planner)).expect("plain data becomes JSON");
        let fingerprint = sha256(decisive.as_bytes())[..16].to_owned();
        let method = METHOD.to_owned();
        Self { version, commit, dirty, method, weights, modules, libtorch, device, threads, planner, fingerprint }
    }

    /// What keeps results from standing together with those made `before`: version, method, weights and settings that are
    /// other ones, in words. Empty if they may.
    pub fn differences(&self, before: &Self) -> Vec<String> {
        let mut words = Vec::new();
        if self.version != before.version {
            words.push(format!("the version was {}, now it is {}", before.version, self.version));
        }
        if self.method != before.method {
            let (before, now) = (short(&before.method), short(&self.method));
            words.push(format!("the method's source was {before}, now it is {now}"));
        }
        let (now, then) = (self.weights.clone().unwrap_or_default(), before.weights.clone().unwrap_or_default());
        words.extend(now.differences(&then));
        words.extend(settings_differences(&self.planner, &before.planner));
        words
    }

    /// Whether everything but the number of threads and changes to the checkout is the same.
    pub fn is_same_maker(&self, other: &Self) -> bool {
        let (threads, dirty, modules) = (other.threads, other.dirty, other.modules.clone());
        let neutral = Self { threads, dirty, modules, ..self.clone() };
        neutral == *other
    }

    /// All that is other than `before`, in words: the [`differences`](Self::differences) and what does not keep results from
    /// standing together.
    pub fn remarks(&self, before: &Self) -> Vec<String> {
        let mut words = self.differences(before);
        let named = |name: &Option<String>| name.clone().unwrap_or_else(|| "none".to_owned());
        if self.commit != before.commit {
            words.push(format!("the commit was {}, now it is {}", short(&before.commit), short(&self.commit)));
        }
        for (what, before, now) in
            [("libtorch", &before.libtorch, &self.libtorch), ("the device", &before.device, &self.device)]
        {
            if before != now {
                words.push(format!("{what} was {}, now it is {}", named(before), named(now)));
            }
        }
        words
    }
}

/// The planner's settings that are other than `before`, in words.
pub fn settings_differences(now: &PlannerSettings, before: &PlannerSettings) -> Vec<String> {
    let values = SETTINGS.iter().map(|setting| (setting.name, setting.value(before), setting.value(now)));
    let differing = values.filter(|(_, before, now)| before != now);
    differing.map(|(name, before, now)| format!("--{name} was {before}, now it is {now}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn networks(digit: &str) -> NetworksUsed {
        let weights =
            Weights { sigma_o: Some(digit.repeat(64)), sigma_m: Some("b".repeat(64)), change_temperature: Some(0.75) };
        NetworksUsed {
            weights,
            modules: ModuleFiles::default(),
            libtorch: "2.13.0".to_owned(),
            device: "cpu".to_owned(),
        }
    }

    fn maker(digit: &str) -> MadeBy {
        let build = Build { commit: "c0ffee".repeat(7)[..40].to_owned(), dirty: Some(false) };
        MadeBy::new(build, Some(networks(digit)), PlannerSettings::default(), 8)
    }

    #[test]
    fn threads_changes_and_the_commit_do_not_keep_results_apart() {
        let before = maker("a");
        let now = MadeBy { threads: 1, dirty: Some(true), ..before.clone() };
        assert!(now.differences(&before).is_empty() && now.remarks(&before).is_empty() && now.is_same_maker(&before));
        let other = MadeBy { commit: "d".repeat(40), libtorch: Some("2.12.0".to_owned()), ..before.clone() };
        assert!(other.differences(&before).is_empty() && !other.is_same_maker(&before));
        let expected = ["the commit was c0ffeec0ffee, now it is dddddddddddd", "libtorch was 2.13.0, now it is 2.12.0"];
        assert_eq!(other.remarks(&before), expected);
        assert_eq!(other.fingerprint, before.fingerprint);
    }

    #[test]
    fn weights_method_and_settings_keep_results_apart() {
        let before = maker("a");
        let weights = maker("e");
        assert_eq!(weights.differences(&before), ["the weights sigma_o were aaaaaaaaaaaa, now they are eeeeeeeeeeee"]);
        assert_ne!(weights.fingerprint, before.fingerprint);
        let planner = PlannerSettings { patience: 3.0, ..PlannerSettings::default() };
        let eager = MadeBy::new(Build::default(), Some(networks("a")), planner, 8);
        assert_eq!(eager.differences(&before), ["--patience was 1, now it is 3"]);
        assert_ne!(eager.fingerprint, before.fingerprint);
        let method = MadeBy { method: "f".repeat(64), ..before.clone() };
        let words = method.differences(&before);
        assert!(words.len() == 1 && words[0].starts_with("the method's source was "), "{words:?}");
        let version = MadeBy { version: "9".to_owned(), ..before.clone() };
        assert_eq!(version.differences(&before), [format!("the version was {}, now it is 9", crate::VERSION)]);
        let classical = MadeBy::new(Build::default(), None, PlannerSettings::default(), 8);
        assert_eq!(classical.differences(&before).len(), 3, "two networks and a temperature are gone");
    }

    #[test]
    fn it_is_read_as_it_was_written_and_the_classical_belief_names_no_weights() {
        let classical = MadeBy::new(Build::default(), None, PlannerSettings::default(), 2);
        for made_by in [maker("a"), classical.clone()] {
            let text = serde_json::to_string(&made_by).expect("JSON");
            assert_eq!(serde_json::from_str::<MadeBy>(&text).expect("reads"), made_by);
        }
        let document = serde_json::to_value(&classical).expect("JSON");
        assert_eq!(document["commit"], UNKNOWN);
        for absent in ["weights", "libtorch", "device", "dirty"] {
            assert!(document.get(absent).is_none(), "{absent}");
        }
        let document = serde_json::to_value(maker("a")).expect("JSON");
        assert_eq!(document["weights"]["sigma_o"], "a".repeat(64));
        assert_eq!(document["planner"]["candidates"], 80);
        assert_eq!(METHOD.len(), 64, "the hash of this very source");
    }
}
