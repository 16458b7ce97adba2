//! What the pushes of a decision tell together: rank correlation and regret, and their means over decisions.

use super::{ProbedPush, StepProbe};
use crate::score::{mean, rank_correlation};
use serde::Serialize;

/// By what a push is worth it, in truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Objects won minus objects lost.
    Objects,
    /// The space that is opened, litres.
    Volume,
}

impl Measure {
    /// What a push is worth.
    pub fn of(self, push: &ProbedPush) -> f64 {
        match self {
            Self::Objects => push.won.len() as f64 - push.lost.len() as f64,
            Self::Volume => push.opened_l,
        }
    }
}

/// How well promises serve to choose a push, by one measure of the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeasureSummary {
    /// Spearman's rank correlation of promise and truth; `None` where nothing was promised or all pushes are worth the same.
    pub rank_correlation: Option<f64>,
    /// What the push is worth that the planner held to be best.
    pub chosen: Option<f64>,
    /// What the best push is worth.
    pub best: f64,
    /// The mean over all pushes: what one at random is worth.
    pub random: f64,
    /// The best push's worth minus the chosen one's.
    pub regret: Option<f64>,
}

/// The summary of one decision, or the means of several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StepSummary {
    /// Number of pushes.
    pub pushes: f64,
    /// Number of objects that no view shows before.
    pub hidden: f64,
    /// Share of pushes that bring a hidden object into sight.
    pub winning_share: f64,
    /// By objects.
    pub objects: MeasureSummary,
    /// By volume, litres.
    pub volume: MeasureSummary,
    /// By objects, where the push that truly opens most space is chosen.
    pub objects_by_space: MeasureSummary,
    /// By objects, where the push is chosen that wins most in the mean over completions of the shelf; without a choice where there
    /// are none.
    pub objects_by_completions: MeasureSummary,
    /// Share of pushes that jammed.
    pub jammed_share: f64,
    /// Share of pushes that dropped an object.
    pub dropped_share: f64,
    /// Share of pushes that toppled an object.
    pub toppled_share: f64,
    /// Mean displacement, metres.
    pub displacement_m: f64,
    /// Mean cross-entropy of what is occupied after a push by its prediction, nats.
    pub predicted_nats: f64,
    /// The same by the belief as it is, as if nothing changed, nats.
    pub unchanged_nats: f64,
}

impl StepProbe {
    /// What its pushes tell together.
    pub fn summary(&self) -> StepSummary {
        let share = |is_one: fn(&ProbedPush) -> bool| {
            let count = self.pushes.iter().filter(|push| is_one(push)).count();
            count as f64 / self.pushes.len().max(1) as f64
        };
        let over = |value: fn(&ProbedPush) -> f64| mean(&self.pushes.iter().map(value).collect::<Vec<_>>());
        StepSummary {
            pushes: self.pushes.len() as f64,
            hidden: self.hidden.len() as f64,
            winning_share: share(|push| !push.won.is_empty()),
            objects: self.by(Measure::Objects),
            volume: self.by(Measure::Volume),
            objects_by_space: self.judged(Measure::Objects, |push| Some(push.opened_l)),
            objects_by_completions: self.judged(Measure::Objects, |push| push.completed),
            jammed_share: share(|push| push.jammed),
            dropped_share: share(|push| !push.dropped.is_empty()),
            toppled_share: share(|push| !push.toppled.is_empty()),
            displacement_m: over(|push| push.displacement_m),
            predicted_nats: over(|push| push.predicted_nats),
            unchanged_nats: over(|push| push.unchanged_nats),
        }
    }

    fn by(&self, measure: Measure) -> MeasureSummary {
        self.chosen_by(measure, self.chosen, |push| push.promised_gain.map(f64::from))
    }

    /// Where another judge chooses, the first of equals.
    fn judged(&self, measure: Measure, judge: fn(&ProbedPush) -> Option<f64>) -> MeasureSummary {
        let better = |best: Option<(usize, f64)>, (at, judged): (usize, Option<f64>)| match (best, judged) {
            (Some((_, most)), Some(judged)) if judged <= most => best,
            (_, Some(judged)) => Some((at, judged)),
            (_, None) => best,
        };
        let chosen = self.pushes.iter().map(judge).enumerate().fold(None, better);
        self.chosen_by(measure, chosen.map(|(at, _)| at), judge)
    }

    fn chosen_by(
        &self,
        measure: Measure,
        chosen: Option<usize>,
        judge: fn(&ProbedPush) -> Option<f64>,
    ) -> MeasureSummary {
        let worths: Vec<f64> = self.pushes.iter().map(|push| measure.of(push)).collect();
        let (promises, promised): (Vec<f64>, Vec<f64>) =
            self.pushes.iter().zip(&worths).filter_map(|(push, worth)| Some((judge(push)?, *worth))).unzip();
        let best = worths.iter().copied().reduce(f64::max).unwrap_or(0.0);
        let chosen = chosen.map(|at| worths[at]);
        MeasureSummary {
            rank_correlation: rank_correlation(&promises, &promised),
            chosen,
            best,
            random: mean(&worths),
            regret: chosen.map(|chosen| best - chosen),
        }
    }
}

impl StepSummary {
    /// The means of several decisions, each counting alike; where a decision has no value it is left out of that mean.
    pub fn mean_of(summaries: &[Self]) -> Self {
        let over = |value: fn(&Self) -> f64| mean(&summaries.iter().map(value).collect::<Vec<_>>());
        Self {
            pushes: over(|s| s.pushes),
            hidden: over(|s| s.hidden),
            winning_share: over(|s| s.winning_share),
            objects: MeasureSummary::mean_of(summaries.iter().map(|s| s.objects)),
            volume: MeasureSummary::mean_of(summaries.iter().map(|s| s.volume)),
            objects_by_space: MeasureSummary::mean_of(summaries.iter().map(|s| s.objects_by_space)),
            objects_by_completions: MeasureSummary::mean_of(summaries.iter().map(|s| s.objects_by_completions)),
            jammed_share: over(|s| s.jammed_share),
            dropped_share: over(|s| s.dropped_share),
            toppled_share: over(|s| s.toppled_share),
            displacement_m: over(|s| s.displacement_m),
            predicted_nats: over(|s| s.predicted_nats),
            unchanged_nats: over(|s| s.unchanged_nats),
        }
    }
}

impl MeasureSummary {
    fn mean_of(summaries: impl Iterator<Item = Self>) -> Self {
        let summaries: Vec<Self> = summaries.collect();
        let known = |value: fn(&Self) -> Option<f64>| {
            let values: Vec<f64> = summaries.iter().filter_map(value).collect();
            (!values.is_empty()).then(|| mean(&values))
        };
        let over = |value: fn(&Self) -> f64| mean(&summaries.iter().map(value).collect::<Vec<_>>());
        Self {
            rank_correlation: known(|s| s.rank_correlation),
            chosen: known(|s| s.chosen),
            best: over(|s| s.best),
            random: over(|s| s.random),
            regret: known(|s| s.regret),
        }
    }
}
