//! What is in the data, and how well sigma_m's promise serves to choose a push: the baseline of whatever is learned from it.

use super::WorthState;
use crate::Result;
use crate::learn::Dataset;
use crate::scene::Family;
use crate::score::{mean, rank_correlation};
use serde::Serialize;

/// Of some states, or of all.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WorthSummary {
    /// `all`, or the family.
    pub of: String,
    /// Number of states.
    pub states: usize,
    /// Number of states with a push.
    pub states_with_pushes: usize,
    /// Number of pushes.
    pub pushes: usize,
    /// Hidden objects of a state, in the mean.
    pub hidden: f64,
    /// Objects that a push brings into sight, in the mean.
    pub won: f64,
    /// Objects that a push takes out of sight, in the mean.
    pub lost: f64,
    /// Share of pushes that bring an object into sight.
    pub winning_share: f64,
    /// Share of pushes that jammed.
    pub jammed_share: f64,
    /// Share of pushes that dropped an object.
    pub dropped_share: f64,
    /// Objects won minus lost by the push of each state that promises most, summed.
    pub chosen: f64,
    /// The same of the best push of each state.
    pub best: f64,
    /// The same of a push at random.
    pub random: f64,
    /// Spearman's rank correlation, within a state, of what a push promises to open and of objects won minus lost: the mean over
    /// states where the latter differ.
    pub rank_objects: Option<f64>,
    /// The same of what it promises and of the space that it opens.
    pub rank_volume: Option<f64>,
    /// The same of what it promises and of object voxels that come into sight minus those that go out of it.
    pub rank_voxels: Option<f64>,
}

/// One state in numbers.
struct Row {
    family: Family,
    hidden: usize,
    promised: Vec<f64>,
    won: Vec<f64>,
    lost: Vec<f64>,
    opened: Vec<f64>,
    voxels: Vec<f64>,
    jammed: usize,
    dropped: usize,
}

impl Row {
    fn of(state: &WorthState) -> Self {
        let pushes = &state.pushes;
        let each = |of: &dyn Fn(&super::WorthPush) -> f64| pushes.iter().map(of).collect::<Vec<f64>>();
        Self {
            family: state.family,
            hidden: state.objects.iter().filter(|object| object.hidden).count(),
            promised: each(&|push| f64::from(push.promise.gain)),
            won: each(&|push| state.won_and_lost(push)[0] as f64),
            lost: each(&|push| state.won_and_lost(push)[1] as f64),
            opened: each(&|push| f64::from(push.opened)),
            voxels: each(&|push| {
                let [appeared, vanished] = state.appeared_and_vanished(push);
                f64::from(appeared) - f64::from(vanished)
            }),
            jammed: pushes.iter().filter(|push| push.jammed).count(),
            dropped: pushes.iter().filter(|push| push.objects.iter().any(|object| object.dropped)).count(),
        }
    }

    fn net(&self) -> Vec<f64> {
        self.won.iter().zip(&self.lost).map(|(won, lost)| won - lost).collect()
    }

    /// Position of the push that promises most, the first of equals.
    fn chosen(&self) -> Option<usize> {
        (0..self.promised.len()).rev().max_by(|&a, &b| self.promised[a].total_cmp(&self.promised[b]))
    }
}

/// Summarises a data directory: all states first, then each family that is there. `done` is told how many states are read.
///
/// # Errors
/// When a state can no longer be read.
pub fn summarise(data: &Dataset<WorthState>, done: &mut dyn FnMut(usize)) -> Result<Vec<WorthSummary>> {
    let mut rows = Vec::with_capacity(data.len());
    for at in 0..data.len() {
        rows.push(Row::of(&data.get(at)?));
        done(at + 1);
    }
    let mut summaries = vec![summary("all".to_owned(), &rows.iter().collect::<Vec<_>>())];
    for family in Family::ALL {
        let of_it: Vec<&Row> = rows.iter().filter(|row| row.family == family).collect();
        if !of_it.is_empty() {
            summaries.push(summary(family.to_string(), &of_it));
        }
    }
    Ok(summaries)
}

fn summary(of: String, rows: &[&Row]) -> WorthSummary {
    let pushes: usize = rows.iter().map(|row| row.promised.len()).sum();
    let all = |of: fn(&Row) -> Vec<f64>| rows.iter().flat_map(|row| of(row)).collect::<Vec<f64>>();
    let share = |count: usize| count as f64 / pushes.max(1) as f64;
    let won = all(|row| row.won.clone());
    let correlation = |of: fn(&Row) -> Vec<f64>| {
        let known: Vec<f64> = rows.iter().filter_map(|row| rank_correlation(&row.promised, &of(row))).collect();
        (!known.is_empty()).then(|| mean(&known))
    };
    let net_of = |of: fn(&Row, &[f64]) -> f64| {
        rows.iter().filter(|row| !row.promised.is_empty()).map(|row| of(row, &row.net())).sum::<f64>()
    };
    WorthSummary {
        of,
        states: rows.len(),
        states_with_pushes: rows.iter().filter(|row| !row.promised.is_empty()).count(),
        pushes,
        hidden: mean(&rows.iter().map(|row| row.hidden as f64).collect::<Vec<_>>()),
        winning_share: share(won.iter().filter(|won| **won > 0.0).count()),
        won: mean(&won),
        lost: mean(&all(|row| row.lost.clone())),
        jammed_share: share(rows.iter().map(|row| row.jammed).sum()),
        dropped_share: share(rows.iter().map(|row| row.dropped).sum()),
        chosen: net_of(|row, net| row.chosen().map_or(0.0, |at| net[at])),
        best: net_of(|_, net| net.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        random: net_of(|_, net| mean(net)),
        rank_objects: correlation(Row::net),
        rank_volume: correlation(|row| row.opened.clone()),
        rank_voxels: correlation(|row| row.voxels.clone()),
    }
}
