//! Who made the results of a bench, and whose results may join.

use super::plan::{AlsoMadeBy, Plan};
use nudge_core::made_by::MadeBy;

/// Whether results of other weights, other code of the method or other settings may join.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mixing {
    /// They are refused.
    Refused,
    /// They join, and `bench.json` and the report say so.
    Allowed,
}

impl Plan {
    /// Everything that made its results, the first that began it; `None` where nothing tells.
    fn makers(&self) -> impl Iterator<Item = Option<&MadeBy>> {
        std::iter::once(self.made_by.as_ref()).chain(self.also_made_by.iter().map(|also| also.made_by.as_ref()))
    }

    /// Whether results of different weights, code or settings stand in this bench together.
    pub fn is_mixed(&self) -> bool {
        self.also_made_by.iter().any(|also| also.mixed)
    }

    /// Whether results with a version and a fingerprint are of one of its makers. Results and benches of programs that did
    /// not tell pass.
    pub(super) fn knows(&self, version: &str, fingerprint: Option<&str>) -> bool {
        let mut versions = self.makers().flatten().map(|maker| maker.version.as_str());
        let mut fingerprints = self.makers().flatten().map(|maker| maker.fingerprint.as_str()).peekable();
        let is_told = fingerprints.peek().is_some();
        let has_version = self.version == version || versions.any(|known| known == version);
        has_version && fingerprint.is_none_or(|fingerprint| !is_told || fingerprints.any(|known| known == fingerprint))
    }

    /// Takes in who made the results of `other`, which is of the same episodes.
    ///
    /// # Errors
    /// What is other about them, in words, where results may not be mixed.
    pub fn join(&mut self, other: &Self, mixing: Mixing) -> Result<(), String> {
        for maker in other.makers() {
            let is_same = |known: Option<&MadeBy>| match (maker, known) {
                (Some(maker), Some(known)) => maker.is_same_maker(known),
                (maker, known) => maker.is_none() && known.is_none(),
            };
            if self.makers().any(is_same) {
                continue;
            }
            let mixed = self.makers().all(|known| !differences(maker, known).is_empty());
            let first = self.made_by.as_ref();
            if mixed && mixing == Mixing::Refused {
                return Err(differences(maker, first).join("; "));
            }
            let differs = match (maker, first) {
                (Some(maker), Some(first)) => maker.remarks(first),
                _ => differences(maker, first),
            };
            self.also_made_by.push(AlsoMadeBy { made_by: maker.cloned(), differs, mixed });
        }
        Ok(())
    }
}

/// What keeps results of one maker from standing together with those of another, in words.
fn differences(now: Option<&MadeBy>, before: Option<&MadeBy>) -> Vec<String> {
    match (now, before) {
        (Some(now), Some(before)) => now.differences(before),
        (None, None) => Vec::new(),
        _ => vec!["some of the results do not tell what made them".to_owned()],
    }
}

#[cfg(test)]
mod tests {
    use super::super::plan::tests::plan;
    use super::*;
    use nudge_core::belief::{ModuleFiles, NetworksUsed, Weights};
    use nudge_core::made_by::Build;

    fn made(commit: &str, weights: &str, threads: usize) -> Plan {
        let weights = Weights { sigma_o: Some(weights.repeat(64)), ..Weights::default() };
        let networks = NetworksUsed {
            weights,
            modules: ModuleFiles::default(),
            libtorch: "2.13.0".to_owned(),
            device: "cpu".to_owned(),
        };
        let build = Build { commit: commit.repeat(40), dirty: Some(threads == 1) };
        let plan = plan(None);
        Plan { made_by: Some(MadeBy::new(build, Some(networks), plan.planner, threads)), ..plan }
    }

    #[test]
    fn threads_and_changes_leave_a_bench_as_it_is() {
        let before = made("a", "1", 8);
        let mut kept = before.clone();
        kept.join(&made("a", "1", 1), Mixing::Refused).expect("the same maker");
        assert_eq!(kept, before);
    }

    #[test]
    fn another_commit_of_the_same_method_is_noted_and_no_mix() {
        let mut kept = made("a", "1", 8);
        for _ in 0..2 {
            kept.join(&made("b", "1", 8), Mixing::Refused).expect("the same numbers");
        }
        assert_eq!(kept.also_made_by.len(), 1, "once");
        assert_eq!(kept.also_made_by[0].differs, ["the commit was aaaaaaaaaaaa, now it is bbbbbbbbbbbb"]);
        assert!(!kept.is_mixed());
    }

    #[test]
    fn other_weights_are_refused_or_noted() {
        let before = made("a", "1", 8);
        let other = made("a", "2", 8);
        let mut kept = before.clone();
        let words = kept.join(&other, Mixing::Refused).expect_err("refused");
        assert_eq!(words, "the weights sigma_o were 111111111111, now they are 222222222222");
        assert_eq!(kept, before);
        kept.join(&other, Mixing::Allowed).expect("allowed");
        assert!(kept.is_mixed() && kept.also_made_by[0].differs == [words]);
        // What was let in once may go on.
        kept.join(&other, Mixing::Refused).expect("known");
        // The mix joins another bench as a whole.
        let mut third = made("c", "1", 8);
        assert!(third.join(&kept, Mixing::Refused).is_err());
        third = made("c", "1", 8);
        third.join(&kept, Mixing::Allowed).expect("allowed");
        assert_eq!(third.also_made_by.iter().map(|also| also.mixed).collect::<Vec<_>>(), [false, true]);

        let fingerprint = |plan: &Plan| plan.made_by.as_ref().map(|maker| maker.fingerprint.clone());
        let (version, of_other) = (nudge_core::VERSION, fingerprint(&other));
        assert!(kept.knows(version, of_other.as_deref()) && kept.knows(version, None));
        assert!(!before.knows(version, of_other.as_deref()) && !kept.knows("9", of_other.as_deref()));
    }

    #[test]
    fn results_of_programs_that_did_not_tell_join_only_when_allowed() {
        let (old, new) = (plan(None), made("a", "1", 8));
        let mut kept = old.clone();
        kept.join(&old, Mixing::Refused).expect("as before");
        assert!(kept.join(&new, Mixing::Refused).expect_err("refused").contains("do not tell what made them"));
        kept.join(&new, Mixing::Allowed).expect("allowed");
        assert!(kept.is_mixed() && kept.knows("1", None));
    }
}
