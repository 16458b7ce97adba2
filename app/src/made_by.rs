//! This program as a maker of numbers, and what made numbers in words.

use nudge_core::belief::{ModuleFiles, Weights};
use nudge_core::made_by::{Build, MadeBy, UNKNOWN};
use nudge_core::plan::SETTINGS;

/// The commit that this program was built from, as its build script found it.
pub fn build() -> Build {
    match env!("NUDGE_COMMIT") {
        "" => Build::default(),
        commit => Build { commit: commit.to_owned(), dirty: env!("NUDGE_DIRTY").parse().ok() },
    }
}

/// What made numbers, by name.
pub fn facts(made_by: &MadeBy) -> Vec<(&'static str, String)> {
    let commit = match (made_by.commit.as_str(), made_by.dirty) {
        (UNKNOWN, _) => "commit unknown (not built in a git checkout)".to_owned(),
        (commit, Some(true)) => format!("commit {commit} and changes that it does not hold"),
        (commit, _) => format!("commit {commit}"),
    };
    let mut facts =
        vec![("program", format!("nudge {}, {commit}", made_by.version)), ("method", made_by.method.clone())];
    if let Some(weights) = &made_by.weights {
        facts.extend(networks(weights, made_by.modules.as_ref()));
    }
    if let Some(libtorch) = &made_by.libtorch {
        let device = made_by.device.as_deref().map_or(String::new(), |device| format!(" on {device}"));
        facts.push(("libtorch", format!("{libtorch}{device}")));
    }
    facts.push(("threads", made_by.threads.to_string()));
    let settings = SETTINGS.iter().map(|setting| format!("{} {}", setting.name, setting.value(&made_by.planner)));
    facts.push(("settings", settings.collect::<Vec<_>>().join(", ")));
    facts
}

/// sigma_o and sigma_m: the hashes of their files, and the names of those that are the user's own.
pub fn networks(weights: &Weights, modules: Option<&ModuleFiles>) -> [(&'static str, String); 2] {
    let Weights { sigma_o, sigma_m, change_temperature } = weights;
    let temperature = change_temperature.map_or(String::new(), |value| format!(", temperature {value}"));
    let words = |hash: &Option<String>, file: Option<&String>| {
        let hash = hash.clone().unwrap_or_else(|| "absent".to_owned());
        file.map_or(hash.clone(), |file| format!("{hash}, {file}"))
    };
    [
        ("sigma_o", words(sigma_o, modules.and_then(|modules| modules.sigma_o.as_ref()))),
        ("sigma_m", words(sigma_m, modules.and_then(|modules| modules.sigma_m.as_ref())) + &temperature),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nudge_core::plan::PlannerSettings;

    #[test]
    fn the_build_names_a_commit_or_says_that_it_is_unknown() {
        let Build { commit, dirty } = build();
        if commit == UNKNOWN {
            assert_eq!(dirty, None);
        } else {
            assert!(commit.len() == 40 && commit.chars().all(|c| c.is_ascii_hexdigit()), "{commit}");
            assert!(dirty.is_some());
        }
    }

    #[test]
    fn every_fact_is_told_once() {
        let build = Build { commit: "a".repeat(40), dirty: Some(true) };
        let mut made_by = MadeBy::new(build, None, PlannerSettings::default(), 4);
        let told = |made_by: &MadeBy| -> String {
            facts(made_by).into_iter().map(|(name, value)| format!("{name}: {value}\n")).collect()
        };
        let words = told(&made_by);
        assert!(words.contains(&format!("commit {} and changes", "a".repeat(40))), "{words}");
        assert!(words.contains("threads: 4") && words.contains("certain 0.85") && !words.contains("sigma"), "{words}");
        let (one, other) = ("b".repeat(64), "c".repeat(64));
        made_by.weights =
            Some(Weights { sigma_o: Some(one.clone()), sigma_m: Some(other.clone()), change_temperature: None });
        made_by.modules = Some(ModuleFiles { sigma_o: Some("mine.pt".to_owned()), sigma_m: None });
        (made_by.libtorch, made_by.device) = (Some("2.13.0".to_owned()), Some("cpu".to_owned()));
        made_by.commit = UNKNOWN.to_owned();
        let words = told(&made_by);
        for part in [&*one, &*other, "libtorch: 2.13.0 on cpu", "commit unknown", ", mine.pt\n"] {
            assert_eq!(words.matches(part).count(), 1, "{part}: {words}");
        }
    }
}
