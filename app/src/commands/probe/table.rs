//! What `nudge probe` prints and writes: the pushes of one decision, a line per decision, means, and CSV.

use super::{Probed, ProbedStep};
use nudge_core::episode::EpisodeRecord;
use nudge_core::probe::{MeasureSummary, ProbedPush, StepProbe, StepSummary};
use nudge_core::skill::SkillKind;
use std::fmt::Write as _;

/// Width of the column that names a decision.
const NAME: usize = 34;

/// The pushes of one decision, the planner's best first, and what they tell together.
pub(super) fn pushes(probed: &Probed, step: &ProbedStep) -> String {
    let ProbedStep { probe, summary } = step;
    let hidden = match &probe.hidden[..] {
        [] => "nothing is hidden".to_owned(),
        hidden => format!("hidden: {}", hidden.join(", ")),
    };
    let mut text = format!(
        "{}, {} on the {} belief, seed {}, step {}: {} pushes carried out; {hidden}\n\n",
        probed.scene,
        probed.policy,
        probed.belief,
        probed.seed,
        probe.step,
        probe.pushes.len()
    );
    let _ = writeln!(
        text,
        "   {:<33} {:>12} {:>9}  {:>8} {:>4} {:>4}  {:>12} {:>7}",
        "push", "promise nats", "reg nats", "opens l", "won", "lost", "came mm", "moved m"
    );
    for at in probe.ranked() {
        let mark = match (probe.chosen == Some(at), probe.made == Some(at)) {
            (true, true) => "*!",
            (true, false) => "* ",
            (false, true) => " !",
            (false, false) => "  ",
        };
        text += &row(mark, &probe.pushes[at]);
    }
    text += "\n* the planner's best";
    if probe.made.is_some() {
        text += "; ! the one that was made";
    }
    let _ = write!(
        text,
        "\n\n{}{}{}",
        headings(),
        line(&format!("step {}", probe.step), summary),
        judges(summary) + &predicted(summary)
    );
    text
}

fn row(mark: &str, probed: &ProbedPush) -> String {
    let (done, mut name) = (&probed.manipulation, probed.manipulation.describe().short);
    if done.kind() != SkillKind::default() {
        name = format!("{} {name}", done.kind().name());
    }
    let nats = |value: Option<f32>| value.map_or("-".to_owned(), |value| format!("{value:.1}"));
    let mut remarks: Vec<String> = Vec::new();
    let mut remark = |what: &str, names: &[String]| {
        if !names.is_empty() {
            remarks.push(format!("{what} {}", names.join(", ")));
        }
    };
    remark("wins", &probed.won);
    remark("loses", &probed.lost);
    remark("drops", &probed.dropped);
    remark("topples", &probed.toppled);
    if probed.jammed {
        remarks.push("jams".to_owned());
    }
    if let Some(grip) = probed.grip {
        remarks.push(grip.to_string());
    }
    let came = format!("{:.0} of {:.0}", probed.pushed_m * 1e3, done.skill().way_m() * 1e3);
    let text = format!(
        "{mark} {name:<33} {:>12} {:>9}  {:>8.3} {:>4} {:>4}  {came:>12} {:>7.3}  {}",
        nats(probed.promised_gain),
        nats(probed.promised_reg),
        probed.opened_l,
        probed.won.len(),
        probed.lost.len(),
        probed.displacement_m,
        remarks.join("; ")
    );
    format!("{}\n", text.trim_end())
}

/// The headings of a line per decision.
pub(super) fn headings() -> String {
    let [objects, volume] = ["objects won - lost", "space opened, litres"];
    format!(
        "{:<NAME$} {:>14}  {objects:^39}  {volume:^39}  {}\n{:<NAME$} {:>6} {:>7}  {}  {}  {:>5} {:>5} {:>7}\n",
        "",
        "",
        "share of pushes",
        "decision",
        "pushes",
        "hidden",
        "   rank  chosen    best  random  regret",
        "   rank  chosen    best  random  regret",
        "jams",
        "drops",
        "topples"
    )
}

/// A line of the table over decisions.
pub(super) fn step(record: &EpisodeRecord, probe: &StepProbe) -> String {
    let name = format!("{} {} {}", record.scene.name, record.config.policy, record.config.seed);
    let end = format!(", step {}", probe.step);
    let room = NAME.saturating_sub(end.chars().count());
    let short: String = name.chars().take(room).collect();
    line(&(short + &end), &probe.summary())
}

/// The last line: means over decisions.
pub(super) fn mean(mean: &StepSummary, decisions: usize) -> String {
    line(&format!("mean of {decisions} decisions"), mean) + &judges(mean) + &predicted(mean)
}

/// What other judges would have chosen, by objects.
fn judges(summary: &StepSummary) -> String {
    let told = |by: &str, judged: &MeasureSummary| {
        judged.chosen.map_or(String::new(), |chosen| {
            let rank = judged.rank_correlation.map_or("-".to_owned(), |rank| format!("{rank:.2}"));
            format!("objects won - lost, chosen {by}: {chosen:.2} (rank {rank})\n")
        })
    };
    let by_space = told("by the space that each truly opens", &summary.objects_by_space);
    let by_completions = told("by completions of the shelf", &summary.objects_by_completions);
    format!("\n{by_space}{by_completions}")
}

/// How well the belief predicts what is occupied afterwards.
fn predicted(summary: &StepSummary) -> String {
    format!(
        "\noccupancy afterwards, cross-entropy over all voxels: {:.0} nats as predicted, {:.0} if nothing had changed\n",
        summary.predicted_nats, summary.unchanged_nats
    )
}

fn line(name: &str, summary: &StepSummary) -> String {
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
    let measure = |of: &MeasureSummary| {
        let columns = [of.rank_correlation, of.chosen, Some(of.best), Some(of.random), of.regret];
        columns.map(|value| format!("{:>7}", number(value))).join(" ")
    };
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    format!(
        "{name:<NAME$} {:>6.0} {:>7.1}  {}  {}  {:>5} {:>5} {:>7}\n",
        summary.pushes,
        summary.hidden,
        measure(&summary.objects),
        measure(&summary.volume),
        percent(summary.jammed_share),
        percent(summary.dropped_share),
        percent(summary.toppled_share)
    )
}

/// The columns of the CSV, units in their names.
const COLUMNS: [&str; 30] = [
    "episode",
    "scene",
    "policy",
    "belief",
    "seed",
    "step",
    "candidate",
    "chosen",
    "made",
    "start_x_m",
    "start_y_m",
    "start_z_m",
    "direction_deg",
    "length_m",
    "promised_gain_nats",
    "promised_reg_nats",
    "opened_voxels",
    "opened_l",
    "won",
    "lost",
    "came_m",
    "jammed",
    "dropped",
    "toppled",
    "displacement_m",
    "hidden_before",
    "grip",
    "predicted_nats",
    "unchanged_nats",
    "completed",
];

/// Every push as CSV (RFC 4180), one a line, of each decision the planner's best first; of objects the names, with spaces between them.
pub(super) fn csv(episodes: &[Probed]) -> String {
    let mut text = COLUMNS.join(",") + "\r\n";
    for probed in episodes {
        for ProbedStep { probe, .. } in &probed.steps {
            for at in probe.ranked() {
                let fields = fields(probed, probe, at, &probe.pushes[at]).map(|field| quoted(&field));
                text += &fields.join(",");
                text += "\r\n";
            }
        }
    }
    text
}

fn fields(probed: &Probed, probe: &StepProbe, at: usize, push: &ProbedPush) -> [String; COLUMNS.len()] {
    let flag = |is_so: bool| u8::from(is_so).to_string();
    let nats = |value: Option<f32>| value.map_or(String::new(), |value| value.to_string());
    let told = push.manipulation.describe();
    let number = |field| told.value(field).map_or_else(String::new, |value| value.to_string());
    [
        probed.episode.display().to_string(),
        probed.scene.clone(),
        probed.policy.clone(),
        probed.belief.clone(),
        probed.seed.to_string(),
        probe.step.to_string(),
        push.candidate.to_string(),
        flag(probe.chosen == Some(at)),
        flag(probe.made == Some(at)),
        number("start_x_m"),
        number("start_y_m"),
        number("start_z_m"),
        number("direction_deg"),
        number("length_m"),
        nats(push.promised_gain),
        nats(push.promised_reg),
        push.opened_voxels.to_string(),
        push.opened_l.to_string(),
        push.won.join(" "),
        push.lost.join(" "),
        push.pushed_m.to_string(),
        flag(push.jammed),
        push.dropped.join(" "),
        push.toppled.join(" "),
        push.displacement_m.to_string(),
        probe.hidden.join(" "),
        push.grip.map_or(String::new(), |grip| grip.to_string()),
        push.predicted_nats.to_string(),
        push.unchanged_nats.to_string(),
        push.completed.map_or(String::new(), |worth| worth.to_string()),
    ]
}

/// A field as CSV writes it.
fn quoted(field: &str) -> String {
    if field.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_with_commas_and_quotes_are_quoted() {
        assert_eq!(quoted("out/a"), "out/a");
        assert_eq!(quoted("two, \"or\" more"), "\"two, \"\"or\"\" more\"");
    }
}
