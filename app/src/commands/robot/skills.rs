//! What each skill can do in a scene, by class of what it is aimed at, and what stops the rest.

use nudge_core::belief::{CLASSICAL, Classical};
use nudge_core::episode::{Episode, EpisodeConfig};
use nudge_core::grid::Cell;
use nudge_core::plan::{PlannerSettings, PolicyKind};
use nudge_core::scene::{Catalog, Scene};
use nudge_core::skill::{Candidate, PickPlace, SkillKind, SkillSet};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Arc;

/// After so many looks, with the classical belief, it is counted.
const LOOKS: usize = 6;

/// The candidates of a skill, and what stops the others.
#[derive(Serialize)]
pub(super) struct SkillReport {
    skill: &'static str,
    #[serde(flatten)]
    all: Count,
    /// The same by the class that is believed to stand where they are aimed at.
    classes: BTreeMap<String, Count>,
}

#[derive(Default, Serialize)]
struct Count {
    drawn: usize,
    feasible: usize,
    /// Number of rejected candidates, by reason.
    rejected: BTreeMap<String, usize>,
}

impl Count {
    fn add(&mut self, kind: SkillKind, candidate: &Candidate) {
        self.drawn += 1;
        match &candidate.rejection {
            None => self.feasible += 1,
            Some(rejection) => *self.rejected.entry(rejection.kind_words(kind)).or_default() += 1,
        }
    }

    /// Reasons, the most frequent first.
    fn reasons(&self) -> Vec<(&String, usize)> {
        let mut reasons: Vec<_> = self.rejected.iter().map(|(words, count)| (words, *count)).collect();
        reasons.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        reasons
    }
}

/// What each skill can do in a scene after some looks.
///
/// # Errors
/// Those of setting up and running an episode.
pub(super) fn of(scene: Scene, place: PickPlace) -> nudge_core::Result<Vec<SkillReport>> {
    let skills = SkillSet::of(SkillKind::ALL);
    let planner = PlannerSettings { skills, place, ..PlannerSettings::of_belief(CLASSICAL) };
    let config = EpisodeConfig {
        policy: PolicyKind::MemNoPush,
        belief: CLASSICAL.to_owned(),
        seed: 0,
        budget: LOOKS + 1,
        views: "standard300".to_owned(),
        planner,
        noise: None,
    };
    let catalog = Arc::new(Catalog::standard());
    let mut episode = Episode::new(scene, catalog.clone(), config, Arc::new(Classical))?;
    for _ in 0..LOOKS {
        let decision = episode.decide();
        episode.act(decision)?;
    }
    let (drawn, belief) = (episode.draw_candidates(), episode.belief());
    let class = |candidate: &Candidate| {
        let cell = belief.grid.cell_index(Cell { x: candidate.contact.x, y: candidate.contact.y });
        catalog.name(belief.likeliest(cell).0).to_owned()
    };
    let of_kind = |kind: &SkillKind| {
        let mut report = SkillReport { skill: kind.name(), all: Count::default(), classes: BTreeMap::new() };
        for candidate in drawn.iter().filter(|candidate| candidate.manipulation.kind() == *kind) {
            report.all.add(*kind, candidate);
            report.classes.entry(class(candidate)).or_default().add(*kind, candidate);
        }
        report
    };
    Ok(SkillKind::ALL.iter().map(of_kind).collect())
}

impl SkillReport {
    /// As text: a line for the skill, one a reason, one a class.
    pub(super) fn table(&self) -> String {
        let Self { skill, all, classes } = self;
        // Writing into a string cannot fail.
        let mut text =
            format!("  {skill:<10} {} of {} drawn are feasible after {LOOKS} looks\n", all.feasible, all.drawn);
        for (words, count) in all.reasons() {
            let _ = writeln!(text, "             {count} not: {words}");
        }
        for (class, count) in classes {
            let mut reasons: Vec<String> =
                count.reasons().into_iter().map(|(words, count)| format!("{count} {words}")).collect();
            reasons.truncate(2);
            let stopped = if reasons.is_empty() { String::new() } else { format!("; not: {}", reasons.join(", ")) };
            let _ = writeln!(text, "             {class:<16} {} of {}{stopped}", count.feasible, count.drawn);
        }
        text
    }
}
