//! A bench in a few rows: one per set and policy.

use super::result::EpisodeResult;
use nudge_core::plan::PolicyKind;
use nudge_core::score::mean;
use serde::Serialize;

/// Means over the episodes of a policy in a set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SummaryRow {
    /// The set.
    pub set: String,
    /// The policy.
    pub policy: PolicyKind,
    /// Number of episodes.
    pub episodes: usize,
    /// Occupancy IoU at the end.
    pub occupancy_iou: f64,
    /// Semantic mIoU at the end.
    pub semantic_miou: f64,
    /// Entropy at the end, nats.
    pub entropy_nats: f64,
    /// Share of the objects hidden at the start that were found in the end; `None` if none was hidden.
    pub revealed: Option<f64>,
    /// Pushes in an episode.
    pub pushes: f64,
    /// Picks in an episode.
    pub picks: f64,
}

/// Sums results up by set and policy, in the order in which they first appear.
pub fn summarise<'a>(results: impl IntoIterator<Item = &'a EpisodeResult>) -> Vec<SummaryRow> {
    let mut groups: Vec<((&str, PolicyKind), Vec<&EpisodeResult>)> = Vec::new();
    for result in results {
        let key = (result.set.as_str(), result.policy);
        match groups.iter_mut().find(|(other, _)| *other == key) {
            Some((_, group)) => group.push(result),
            None => groups.push((key, vec![result])),
        }
    }
    groups.into_iter().map(|((set, policy), group)| row(set, policy, &group)).collect()
}

fn row(set: &str, policy: PolicyKind, group: &[&EpisodeResult]) -> SummaryRow {
    let of = |value: &dyn Fn(&EpisodeResult) -> f64| mean(&group.iter().map(|r| value(r)).collect::<Vec<_>>());
    let hidden: usize = group.iter().map(|result| result.hidden.len()).sum();
    let revealed: usize = group.iter().map(|result| result.revealed()).sum();
    SummaryRow {
        set: set.to_owned(),
        policy,
        episodes: group.len(),
        occupancy_iou: of(&|result| result.scores(result.steps.len()).occupancy_iou),
        semantic_miou: of(&|result| result.scores(result.steps.len()).semantic_miou),
        entropy_nats: of(&|result| result.scores(result.steps.len()).entropy_nats),
        revealed: (hidden > 0).then(|| revealed as f64 / hidden as f64),
        pushes: of(&|result| result.pushes() as f64),
        picks: of(&|result| result.picks() as f64),
    }
}
