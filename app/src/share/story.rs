//! What was done, weighed, scored and said in an episode, as the page's script reads it.

use super::camera::Facts;
use crate::annotations::Annotations;
use crate::picture::entropy_range;
use crate::record::decision::{SERIES, action, capital, mishaps};
use crate::verdicts::verdict_title;
use nudge_core::episode::{EpisodeRecord, StepRecord};
use nudge_core::plan::{Action, CandidateRecord, Comparison, DISTURBANCE, Decision, TermKind, Winner, ranked};
use nudge_core::skill::Manipulation;
use serde::Serialize;
use std::collections::BTreeMap;

/// How many views and manipulations are listed.
const LISTED: usize = 6;

/// An episode.
#[derive(Clone, Debug, Serialize)]
pub struct Story {
    /// `tunnel, mem, seed 3`.
    pub title: String,
    /// What the scene is.
    pub description: String,
    /// What it was run with, and by what it was made: name and value.
    pub facts: Vec<[String; 2]>,
    /// Number of actions that there were to be.
    pub budget: usize,
    /// Whether beliefs are scored.
    pub has_truth: bool,
    /// Voxels along x, y, z.
    pub dims: [usize; 3],
    /// Edge of a voxel, metres.
    pub voxel_m: f32,
    /// The corner of the grid that has the smallest coordinates, metres.
    pub origin: [f32; 3],
    /// The entropy of a floor cell of which nothing is known, nats.
    pub entropy_top: f32,
    /// The numbers of actions whose beliefs are in the page.
    pub kept: Vec<usize>,
    /// Beliefs of every so manyth step are kept.
    pub every: usize,
    /// The numbers of actions from which a truth holds.
    pub truths: Vec<usize>,
    /// The camera's images.
    pub cameras: Vec<Facts>,
    /// The length of the recording in the page, bytes.
    pub recording_bytes: Option<usize>,
    /// Why there is no recording in the page.
    pub recording_left_out: Option<String>,
    /// The states, the one before the first action first.
    pub moments: Vec<Moment>,
}

/// The state after a number of actions, and the action that led to it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Moment {
    /// `look`, or the skill's name; empty for the prior.
    pub kind: &'static str,
    /// What was done.
    pub action: String,
    /// Why, as the end of a sentence.
    pub because: String,
    /// What was compared.
    pub terms: Vec<Weighed>,
    /// What followed from it, in a sentence.
    pub margin: String,
    /// The best views: number, gain in nats, and a word on it.
    pub views: Vec<(usize, f32, &'static str)>,
    /// The best manipulations.
    pub candidates: Vec<Candidate>,
    /// How many manipulations were drawn, and why the others were none.
    pub drawn: String,
    /// By [`SERIES`], `None` where there is no truth.
    pub scores: Vec<Option<f64>>,
    /// Names of the objects by verdict, in the verdicts' own order; those that a person judged end with an asterisk.
    pub verdicts: Vec<(&'static str, Vec<String>)>,
    /// What went wrong.
    pub mishaps: Vec<String>,
    /// A person's note.
    pub note: String,
    /// What the arm did: lines, metres.
    pub lines: Vec<Vec<[f32; 3]>>,
}

/// A term of the comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Weighed {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub nats: f32,
    /// What it counts.
    pub words: String,
    /// Whether it is on the side that won.
    pub decides: bool,
    /// Its place on the scale of gains, 0 to 1.
    pub shade: f32,
}

/// A manipulation that was weighed.
#[derive(Clone, Debug, Serialize)]
pub struct Candidate {
    /// What it is.
    pub words: String,
    /// What it opens, nats.
    pub gain: Option<f32>,
    /// What it is worth, nats.
    pub value: Option<f32>,
    /// `chosen`, `best` or nothing.
    pub mark: &'static str,
}

impl Story {
    /// What was left out of it, in a sentence.
    pub fn thinned(&self) -> Option<String> {
        let steps = self.moments.len() - 1;
        let limit = super::LIMIT / 1_000_000;
        (self.every > 1).then(|| {
            format!(
                "Of {steps} steps the page holds the beliefs and images of every {}, to stay below {limit} MB; scores and \
                 decisions are of all.",
                ordinal(self.every)
            )
        })
    }
}

fn ordinal(number: usize) -> String {
    let ending = match (number % 10, number % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    };
    format!("{number}{ending}")
}

/// All that a record and a person tell of an episode.
pub fn tell(record: &EpisodeRecord, annotations: &Annotations) -> Story {
    let (scene, config, grid) = (&record.scene, &record.config, record.scene.grid());
    let steps = record.steps.len();
    let mut facts = vec![
        ["policy".to_owned(), config.policy.to_string()],
        ["belief".to_owned(), config.belief.clone()],
        ["seed".to_owned(), config.seed.to_string()],
        ["actions".to_owned(), format!("{steps} of {}", config.budget)],
        ["objects".to_owned(), scene.objects.len().to_string()],
        ["made by".to_owned(), format!("nudge {}", record.version)],
    ];
    if !record.has_truth() {
        facts.retain(|[name, _]| name != "objects");
    }
    Story {
        title: format!("{}, {}, seed {}", scene.name, config.policy, config.seed),
        description: capital(&scene.description),
        facts,
        budget: config.budget,
        has_truth: record.has_truth(),
        dims: grid.dims,
        voxel_m: grid.voxel_m,
        origin: grid.origin,
        entropy_top: entropy_range(&grid)[1],
        kept: Vec::new(),
        every: 1,
        truths: record.truth_indices().collect(),
        cameras: Vec::new(),
        recording_bytes: None,
        recording_left_out: None,
        moments: (0..=steps).map(|step| moment(record, annotations, step)).collect(),
    }
}

fn moment(record: &EpisodeRecord, annotations: &Annotations, step: usize) -> Moment {
    let (scores, entropy) = (record.scores_after(step), record.entropy_after(step));
    let state = Moment {
        scores: SERIES.iter().map(|series| series.at(scores, entropy)).collect(),
        note: annotations.notes.get(&step).cloned().unwrap_or_default(),
        ..Moment::default()
    };
    let Some(done) = step.checked_sub(1).map(|at| &record.steps[at]) else { return state };
    let (kind, lines) = match done.action {
        Action::Look { .. } => ("look", Vec::new()),
        Action::Manipulate(manipulation) => (manipulation.kind().name(), lines(&manipulation)),
    };
    let comparison = done.decision.comparison();
    Moment {
        kind,
        action: capital(&action(&done.action)),
        because: comparison.because.clone(),
        terms: comparison.terms.iter().map(weighed).collect(),
        margin: margin(&comparison),
        views: views(&done.decision),
        candidates: candidates(&done.decision),
        drawn: drawn(&done.decision),
        verdicts: verdicts(done, annotations),
        mishaps: mishaps(done).iter().map(|words| capital(words)).collect(),
        lines,
        ..state
    }
}

fn weighed(term: &nudge_core::plan::Term) -> Weighed {
    let (name, shade) = match term.kind {
        TermKind::Look => ("Look (IGV)", 0.85),
        TermKind::Threshold => ("Threshold", 0.7),
        TermKind::Push => ("Push (IGM)", 0.5),
        TermKind::Disturbance => ("Push: γ·Reg", 0.25),
    };
    let words = if term.kind == TermKind::Disturbance { DISTURBANCE.to_owned() } else { term.words.clone() };
    Weighed { name, nats: term.nats, words, decides: term.decides, shade }
}

/// How looking and pushing compared.
fn margin(comparison: &Comparison) -> String {
    let Some(pushing) = comparison.pushing else { return "No push was weighed against it.".to_owned() };
    let chosen = match comparison.winner {
        Winner::Look => "it looks",
        Winner::Push => "it pushes",
    };
    format!("A push is worth {pushing:.0} nats and has to reach {:.0}: {chosen}.", comparison.needed)
}

fn views(decision: &Decision) -> Vec<(usize, f32, &'static str)> {
    let looked = match decision.action {
        Action::Look { view } => Some(usize::from(view.0)),
        Action::Manipulate(_) => None,
    };
    let word = |at: usize| match decision.pair.iter().position(|view| usize::from(view.0) == at) {
        _ if looked == Some(at) => "chosen",
        Some(0) => "first of pair",
        Some(_) => "second of pair",
        None => "",
    };
    let order = ranked(None, decision.gains.iter().map(|gain| gain.is_finite().then_some(*gain)));
    let best = order.into_iter().enumerate().filter(|(place, at)| *place < LISTED || looked == Some(*at));
    best.map(|(_, at)| (at, decision.gains[at], word(at))).collect()
}

fn candidates(decision: &Decision) -> Vec<Candidate> {
    let row = |at: usize, candidate: &CandidateRecord| Candidate {
        words: format!("{} {}", candidate.manipulation.kind().name(), candidate.manipulation.describe().short),
        gain: candidate.gain,
        value: decision.value_of(candidate),
        mark: match at {
            at if decision.pushed() == Some(at) => "chosen",
            at if decision.best_push == Some(at) => "best",
            _ => "",
        },
    };
    let ranked = decision.ranked_candidates().into_iter().map(|at| (at, &decision.candidates[at]));
    ranked.filter(|(_, candidate)| candidate.rejection.is_none()).take(LISTED).map(|(at, c)| row(at, c)).collect()
}

/// How many candidates there were, and the commonest reasons why the others were rejected.
fn drawn(decision: &Decision) -> String {
    if decision.candidates.is_empty() {
        return String::new();
    }
    let mut reasons = BTreeMap::<String, usize>::new();
    for candidate in &decision.candidates {
        if let Some(rejection) = &candidate.rejection {
            *reasons.entry(rejection.kind_words(candidate.manipulation.kind())).or_default() += 1;
        }
    }
    let (all, rejected) = (decision.candidates.len(), reasons.values().sum::<usize>());
    let mut reasons: Vec<(String, usize)> = reasons.into_iter().collect();
    reasons.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
    let told: Vec<String> = reasons.iter().take(3).map(|(words, count)| format!("{count} because {words}")).collect();
    if told.is_empty() {
        return format!("{all} drawn, all feasible.");
    }
    format!("{all} drawn, {} feasible; rejected: {}.", all - rejected, told.join("; "))
}

fn verdicts(step: &StepRecord, annotations: &Annotations) -> Vec<(&'static str, Vec<String>)> {
    let judged = annotations.judge(step.index, step.objects());
    let of = |verdict| {
        let named = judged.iter().filter(move |judged| judged.verdict() == verdict);
        let name = |judged: &crate::verdicts::Judged| {
            format!("{}{}", judged.name, if judged.overruled.is_some() { "*" } else { "" })
        };
        (verdict_title(verdict), named.map(name).collect::<Vec<_>>())
    };
    crate::verdicts::VERDICTS.map(of).into_iter().filter(|(_, names)| !names.is_empty()).collect()
}

/// The ways of the tool, each with the barbs of an arrow, and the lines beside them.
fn lines(manipulation: &Manipulation) -> Vec<Vec<[f32; 3]>> {
    /// Length of a barb, metres.
    const BARB_M: f32 = 0.018;
    let outline = manipulation.outline();
    let mut lines = Vec::new();
    for arrow in &outline.arrows {
        let (start, end) = (arrow.start, arrow.end());
        lines.push(vec![start.coords.into(), end.coords.into()]);
        if let Some(way) = arrow.way.try_normalize(1e-6) {
            // Barbs lie flat, or across the shelf for a way straight up.
            let up = if way.z.abs() > 0.9 { nudge_core::Vector::y() } else { nudge_core::Vector::z() };
            let across = way.cross(&up).normalize() * (0.5 * BARB_M);
            let back = end - way * BARB_M;
            lines.push(vec![(back + across).coords.into(), end.coords.into(), (back - across).coords.into()]);
        }
    }
    lines.extend(outline.lines.iter().map(|line| line.iter().map(|point| point.coords.into()).collect()));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_how_manyth_in_words() {
        assert_eq!([2, 3, 11, 21, 112].map(ordinal), ["2nd", "3rd", "11th", "21st", "112th"]);
    }
}
