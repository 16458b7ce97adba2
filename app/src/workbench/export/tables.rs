//! Scores, decisions and verdicts as CSV (RFC 4180): one row a step, or an object and step; units in the headings.

use super::super::session::{Moment, Session};
use crate::verdicts::verdict_title;
use nudge_core::episode::StepOutcome;
use nudge_core::files::write_atomically;
use nudge_core::plan::Action;
use nudge_core::score::Scores;
use nudge_core::{Error, Result};
use std::path::{Path, PathBuf};

/// A table on its way: rows of fields, quoted where that is needed.
struct Table {
    text: String,
}

impl Table {
    fn new(headings: &[&str]) -> Self {
        let mut table = Self { text: String::new() };
        table.row(headings.iter().map(|heading| (*heading).to_owned()));
        table
    }

    fn row(&mut self, fields: impl IntoIterator<Item = String>) {
        let fields: Vec<String> = fields.into_iter().map(|field| quoted(&field)).collect();
        self.text += &fields.join(",");
        self.text += "\r\n";
    }
}

/// A field as CSV writes it.
fn quoted(field: &str) -> String {
    if field.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

fn steps(session: &Session) -> impl Iterator<Item = (&Moment, &StepOutcome)> {
    session.moments.iter().filter_map(|moment| Some((&**moment, moment.outcome.as_deref()?)))
}

/// Scores, and what each step cost, by step; the prior is step 0.
pub fn scores_csv(session: &Session) -> String {
    let mut table = Table::new(&[
        "step",
        "action",
        "occupancy_iou",
        "occupied_iou",
        "semantic_miou",
        "entropy_nats",
        "mece_occupancy",
        "mece_semantics",
        "displacement_m",
        "dropped",
        "decide_s",
        "act_s",
        "update_s",
        "record_s",
        "note",
    ]);
    for moment in &session.moments {
        let record = moment.outcome.as_ref().map(|outcome| &outcome.record);
        let of_step = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let score = |of: fn(&Scores) -> f64| of_step(moment.scores.as_ref().map(of));
        let mut row = vec![
            moment.step.to_string(),
            record.map_or("prior", |record| kind(&record.action)).to_owned(),
            score(|s| s.occupancy_iou),
            score(|s| s.occupied_iou),
            score(|s| s.semantic_miou),
            moment.entropy_nats.to_string(),
            score(|s| s.mece_occupancy),
            score(|s| s.mece_semantics),
            of_step(record.and_then(|record| record.displacement_m())),
            record.map_or(String::new(), |record| record.dropped().join(" ")),
        ];
        let seconds = record.map(|record| record.seconds);
        row.extend([
            of_step(seconds.map(|seconds| seconds.decide)),
            of_step(seconds.map(|seconds| seconds.act)),
            of_step(seconds.map(|seconds| seconds.update)),
            of_step(seconds.map(|seconds| seconds.record)),
            session.annotations.notes.get(&moment.step).cloned().unwrap_or_default(),
        ]);
        table.row(row);
    }
    table.text
}

/// What was weighed and chosen, by step.
pub fn decisions_csv(session: &Session) -> String {
    let mut table = Table::new(&[
        "step",
        "action",
        "reason",
        "view",
        "start_x_m",
        "start_y_m",
        "start_z_m",
        "direction_deg",
        "length_m",
        "igv_nats",
        "igm_nats",
        "reg_nats",
        "first_view",
        "second_view",
        "first_view_gain_nats",
        "push_candidates",
        "push_candidates_feasible",
        "best_push",
    ]);
    for (moment, outcome) in steps(session) {
        let decision = &outcome.record.decision;
        let reason = serde_json::to_value(decision.reason).ok().and_then(|value| Some(value.as_str()?.to_owned()));
        let mut row = vec![
            moment.step.to_string(),
            kind(&decision.action).to_owned(),
            reason.unwrap_or_else(|| format!("{:?}", decision.reason)),
        ];
        match decision.action {
            Action::Look { view } => {
                row.push(view.0.to_string());
                row.extend((0..5).map(|_| String::new()));
            }
            Action::Manipulate(manipulation) => {
                row.push(String::new());
                let told = manipulation.describe();
                let number = |field| told.value(field).map_or_else(String::new, |value| value.to_string());
                row.extend(["start_x_m", "start_y_m", "start_z_m", "direction_deg", "length_m"].map(number));
            }
        }
        let pair = |at: usize| decision.pair.get(at).map_or(String::new(), |view| view.0.to_string());
        let feasible = decision.candidates.iter().filter(|candidate| candidate.rejection.is_none()).count();
        row.extend([
            decision.igv.to_string(),
            decision.igm.to_string(),
            decision.reg.to_string(),
            pair(0),
            pair(1),
            decision.best_gain().map_or(String::new(), |gain| gain.to_string()),
            decision.candidates.len().to_string(),
            feasible.to_string(),
            decision.best_push.map_or(String::new(), |at| at.to_string()),
        ]);
        table.row(row);
    }
    table.text
}

/// What became of each object, by step.
pub fn verdicts_csv(session: &Session) -> String {
    let mut table = Table::new(&["step", "object", "class", "x_m", "y_m", "scorer_says", "verdict", "overruled"]);
    for (moment, outcome) in steps(session) {
        for judged in session.annotations.judge(moment.step, outcome.record.objects()) {
            let [x, y] = judged.proposed.position;
            table.row([
                moment.step.to_string(),
                judged.name.clone(),
                judged.proposed.class.clone(),
                x.to_string(),
                y.to_string(),
                verdict_title(judged.proposed.verdict).to_owned(),
                verdict_title(judged.verdict()).to_owned(),
                if judged.overruled.is_some() { "yes" } else { "no" }.to_owned(),
            ]);
        }
    }
    table.text
}

/// Writes `scores.csv`, `decisions.csv` and `verdicts.csv` into a directory; returns their paths.
///
/// # Errors
/// For files that are there already, and what the system refuses.
pub fn write_tables(session: &Session, into: &Path) -> Result<Vec<PathBuf>> {
    let tables = [
        ("scores.csv", scores_csv(session)),
        ("decisions.csv", decisions_csv(session)),
        ("verdicts.csv", verdicts_csv(session)),
    ];
    if let Some((name, _)) = tables.iter().find(|(name, _)| into.join(name).exists()) {
        return Err(Error::input(into.join(name), "", "is there already: choose another directory"));
    }
    std::fs::create_dir_all(into).map_err(|error| Error::io(into, error))?;
    let mut paths = Vec::with_capacity(tables.len());
    for (name, text) in tables {
        let path = into.join(name);
        write_atomically(&path, text.as_bytes())?;
        paths.push(path);
    }
    Ok(paths)
}

fn kind(action: &Action) -> &'static str {
    match action {
        Action::Look { .. } => "look",
        Action::Manipulate(manipulation) => manipulation.kind().name(),
    }
}
