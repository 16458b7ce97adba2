//! A decision in words and tables, and the scores as series.

use super::Setting;
use nudge_core::episode::StepRecord;
use nudge_core::plan::{Action, CandidateRecord, Comparison, Decision, Term, TermKind, Winner};
use nudge_core::score::Scores;
use nudge_core::skill::{Manipulation, Rejection, SkillKind, Unit};
use std::fmt::Write as _;

/// One score over the steps.
pub struct Series {
    /// Its key in `episode.json`.
    pub key: &'static str,
    /// Its name with unit.
    pub title: &'static str,
    /// What it is, with its range.
    #[cfg_attr(not(feature = "workbench"), allow(dead_code, reason = "the window shows it"))]
    pub hint: &'static str,
    /// Its colour.
    pub rgb: [u8; 3],
    /// Its value.
    pub value: fn(&Scores) -> f64,
}

impl Series {
    /// Its value in a state; without a truth there is the entropy alone.
    pub fn at(&self, scores: Option<&Scores>, entropy_nats: f64) -> Option<f64> {
        scores.map(self.value).or_else(|| (self.key == "entropy_nats").then_some(entropy_nats))
    }
}

/// The scores that are recorded.
pub const SERIES: &[Series] = &[
    Series {
        key: "occupancy_iou",
        title: "occupancy IoU",
        hint: "Intersection over union of free and of occupied voxels, the mean of both, 0 to 1",
        rgb: [86, 156, 214],
        value: |s| s.occupancy_iou,
    },
    Series {
        key: "occupied_iou",
        title: "occupied IoU",
        hint: "Intersection over union of occupied voxels alone, 0 to 1",
        rgb: [150, 200, 240],
        value: |s| s.occupied_iou,
    },
    Series {
        key: "semantic_miou",
        title: "semantic mIoU",
        hint: "Mean intersection over union of the classes on the floor, 0 to 1",
        rgb: [98, 196, 140],
        value: |s| s.semantic_miou,
    },
    Series {
        key: "entropy_nats",
        title: "map entropy (nats)",
        hint: "Entropy of the occupancy map and the semantic map together, nats; less as more is known",
        rgb: [220, 110, 170],
        value: |s| s.entropy_nats,
    },
    Series {
        key: "mece_occupancy",
        title: "mECE of occupancy",
        hint: "Expected calibration error of occupancy, the mean over free and occupied, 0 (calibrated) to 1",
        rgb: [240, 180, 80],
        value: |s| s.mece_occupancy,
    },
    Series {
        key: "mece_semantics",
        title: "mECE of semantics",
        hint: "Expected calibration error of the classes, the mean over them, 0 (calibrated) to 1",
        rgb: [230, 130, 60],
        value: |s| s.mece_semantics,
    },
];

/// How many views and pushes the tables list.
const LISTED: usize = 5;

/// The scores in one line; without a truth the entropy alone.
pub fn scores_line(scores: Option<&Scores>, entropy_nats: f64) -> String {
    let entropy = format!("entropy {} nats", thousands(entropy_nats));
    match scores {
        Some(scores) => format!("IoU {:.3}, mIoU {:.3}, {entropy}", scores.occupancy_iou, scores.semantic_miou),
        None => entropy,
    }
}

/// A step in one line.
pub fn line(record: &StepRecord) -> String {
    format!(
        "step {}: {} ({}); {}",
        record.index,
        action(&record.action),
        record.decision.reason.words(),
        scores_line(record.scores(), record.entropy_nats)
    )
}

/// What went wrong in a step, one line each.
pub(crate) fn mishaps(record: &StepRecord) -> Vec<String> {
    let mut words: Vec<String> = record.dropped().iter().map(|name| format!("dropped {name}")).collect();
    if let Some(push) = &record.push {
        if push.stalled {
            let name = manipulated(record).map_or("way", |manipulation| manipulation.kind().name());
            words.push(format!("the arm was blocked after {} of its {name}", length(record).unwrap_or_default()));
        }
        words.extend(push.contacts.iter().map(|touch| format!("the arm's {} touched {}", touch.link, touch.object)));
        words.extend(push.against_wall.iter().map(|name| format!("{name} was pressed against a wall")));
    }
    words
}

/// The manipulation that a step did.
fn manipulated(record: &StepRecord) -> Option<Manipulation> {
    match record.action {
        Action::Manipulate(manipulation) => Some(manipulation),
        Action::Look { .. } => None,
    }
}

/// How far a manipulation went of what was planned: `50 of 140 mm`; of an episode that does not tell, what was planned.
pub(crate) fn length(record: &StepRecord) -> Option<String> {
    let planned_mm = manipulated(record)?.skill().way_m() * 1e3;
    Some(match &record.push {
        Some(push) => format!("{:.0} of {planned_mm:.0} mm", push.pushed_m * 1e3),
        None => format!("{planned_mm:.0} mm"),
    })
}

/// An action in words.
pub(crate) fn action(action: &Action) -> String {
    match action {
        Action::Look { view } => format!("look from view {}", view.0),
        Action::Manipulate(manipulation) => manipulation.describe().words,
    }
}

/// The decision of a step as a page.
pub fn markdown(setting: &Setting<'_>, record: &StepRecord) -> String {
    let decision = &record.decision;
    let mut page = format!(
        "### Step {} of {}: {}\n\n*{}*\n\n",
        record.index,
        setting.budget,
        action(&record.action),
        capital(&decision.comparison().because)
    );
    weighed(&mut page, &decision.comparison());
    views(&mut page, setting, decision);
    for kind in SkillKind::ALL {
        manipulations(&mut page, decision, *kind);
    }
    let Some(scores) = record.scores() else {
        let entropy = thousands(record.entropy_nats);
        let _ = write!(page, "**After the step**\n\n| entropy, nats |\n|--:|\n| {entropy} |\n");
        return page;
    };
    let _ = write!(
        page,
        "**After the step**\n\n| occupancy IoU | occupied IoU | semantic mIoU | entropy, nats |\n|--:|--:|--:|--:|\n\
         | {:.3} | {:.3} | {:.3} | {} |\n",
        scores.occupancy_iou,
        scores.occupied_iou,
        scores.semantic_miou,
        thousands(scores.entropy_nats)
    );
    page
}

fn weighed(page: &mut String, comparison: &Comparison) {
    let sign = |winner: Winner| if comparison.winner == winner { " ◀" } else { "" };
    page.push_str("| weighed | nats |\n|:--|--:|\n");
    for Term { kind, nats, words, .. } in &comparison.terms {
        let row = match kind {
            TermKind::Look => format!("look: IGV, {words}{}", sign(Winner::Look)),
            TermKind::Threshold => format!("   what a push has to promise: {words}"),
            TermKind::Push => format!("   IGM, {words}"),
            TermKind::Disturbance => format!("   γ·Reg, {words}"),
        };
        if let (TermKind::Push, Some(pushing)) = (kind, comparison.pushing) {
            let _ = writeln!(page, "| push: IGM + γ·Reg{} | {pushing:.1} |", sign(Winner::Push));
        }
        let _ = writeln!(page, "| {row} | {nats:.1} |");
    }
    page.push('\n');
}

fn views(page: &mut String, setting: &Setting<'_>, decision: &Decision) {
    let mut order: Vec<usize> = (0..decision.gains.len()).collect();
    order.sort_by(|a, b| decision.gains[*b].total_cmp(&decision.gains[*a]).then(a.cmp(b)));
    page.push_str("**Views**\n\n| view | column, row, target | gain, nats |\n|--:|:--|--:|\n");
    for &at in order.iter().take(LISTED) {
        let slot = setting.views.views.get(at).map_or([0; 3], |view| view.slot);
        let paired = if decision.pair.iter().any(|id| usize::from(id.0) == at) { " ●" } else { "" };
        let _ = writeln!(
            page,
            "| {at}{paired} | {}, {}, {} | {:.1} |",
            slot[0] + 1,
            slot[1] + 1,
            slot[2] + 1,
            decision.gains[at]
        );
    }
    page.push_str("\n● best pair\n\n");
}

/// The candidates of a skill.
fn manipulations(page: &mut String, decision: &Decision, kind: SkillKind) {
    let ranked = decision.ranked_candidates().into_iter().map(|at| (at, &decision.candidates[at]));
    let all: Vec<(usize, &CandidateRecord)> = ranked.filter(|(_, c)| c.manipulation.kind() == kind).collect();
    if all.is_empty() {
        return;
    }
    let feasible: Vec<_> = all.iter().filter(|(_, c)| c.rejection.is_none()).collect();
    let count = |is: fn(&Rejection) -> bool| all.iter().filter(|(_, c)| c.rejection.as_ref().is_some_and(is)).count();
    let _ = write!(
        page,
        "**{}**: {} drawn, {} feasible; {} without a target, {} out of reach, {} blocked, {} without a free way\n\n",
        capital(kind.plural()),
        all.len(),
        feasible.len(),
        count(|r| matches!(r, Rejection::NoTarget)),
        count(|r| matches!(r, Rejection::Unreachable { .. })),
        count(|r| matches!(r, Rejection::ArmBlocked { .. })),
        count(|r| matches!(r, Rejection::NoWay)),
    );
    reasons(page, all.iter().filter_map(|(_, c)| c.rejection.as_ref().map(|rejection| rejection.kind_words(kind))));
    let Some((_, first)) = feasible.first() else { return };
    let (mut numbers, mut lines) = (String::new(), String::new());
    for parameter in &first.manipulation.describe().parameters {
        let unit = if parameter.unit == Unit::Metres { " (m)" } else { "" };
        let _ = write!(numbers, " {}{unit} |", parameter.name);
        lines.push_str("--:|");
    }
    let name = kind.name();
    let _ = write!(page, "| {name} |{numbers} arm | gain | Reg | value, nats |\n|--:|{lines}--:|--:|--:|--:|\n");
    let nats = |value: Option<f32>| value.map_or("–".to_owned(), |value| format!("{value:.1}"));
    for (at, c) in feasible.iter().take(LISTED) {
        let best = if decision.best_push == Some(*at) { " ●" } else { "" };
        let _ = write!(page, "| {at}{best} |");
        for parameter in c.manipulation.describe().parameters {
            let unit = match parameter.unit {
                Unit::Metres => "",
                Unit::Millimetres => " mm",
                Unit::Degrees => "°",
            };
            let _ = write!(page, " {}{unit} |", parameter.number());
        }
        let _ = writeln!(
            page,
            " {:.1} s | {} | {} | {} |",
            c.motion_s.unwrap_or(0.0),
            nats(c.gain),
            nats(c.reg),
            nats(decision.value_of(c))
        );
    }
    page.push('\n');
    let listed = feasible.iter().take(LISTED);
    for (at, then) in listed.filter_map(|(at, c)| Some((at, c.makes_way_for()?))) {
        let _ = writeln!(page, "- {name} {at} makes way for {then}: its gain is half of what both open together");
    }
    page.push('\n');
}

/// The commonest reasons why candidates were rejected.
fn reasons(page: &mut String, rejections: impl Iterator<Item = String>) {
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    for words in rejections {
        *counts.entry(words).or_default() += 1;
    }
    let mut counts: Vec<(String, usize)> = counts.into_iter().collect();
    counts.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
    for (words, count) in counts.iter().take(LISTED) {
        let _ = writeln!(page, "* {count} rejected: {words}");
    }
    page.push('\n');
}

pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A whole number with its thousands apart.
pub(crate) fn thousands(number: f64) -> String {
    let digits = format!("{:.0}", number.max(0.0));
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at) % 3 == 0 {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;
    use nudge_core::arm::ArmTool;
    use nudge_core::episode::PushReport;
    use nudge_core::plan::{PlannerSettings, PolicyKind, Reason, Rule};
    use nudge_core::skill::Push;

    #[test]
    fn the_page_of_a_push_shows_what_it_had_to_promise_and_lists_the_best_push_first() {
        let played = fixture::play(4);
        let (mut record, arm) = (played.record.steps[3].clone(), ArmTool::standard(played.record.scene.shelf));
        let push = |length_m| Push { start: [0.0, 0.1, 0.06], direction_deg: 90.0, length_m };
        let weighed = |gain, length_m| CandidateRecord { gain: Some(gain), ..CandidateRecord::of(push(length_m)) };
        let mut page = |settings: PlannerSettings| {
            record.decision = Decision {
                igv: 30.0,
                igm: 400.0,
                reg: -50.0,
                candidates: vec![weighed(500.0, 0.11), weighed(400.0, 0.12), weighed(600.0, 0.13)],
                best_push: Some(1),
                rule: Some(Rule { policy: PolicyKind::Mem, settings }),
                ..Decision::unweighed(Action::Manipulate(push(0.12).into()), Reason::PushTellsMore)
            };
            let setting = Setting {
                shelf: &played.record.scene.shelf,
                catalog: &played.catalog,
                views: &played.views,
                budget: 4,
                planner: &PlannerSettings::default(),
                arm: &arm,
                unreachable: &[],
            };
            markdown(&setting, &record)
        };
        let with = page(PlannerSettings { patience: 10.0, push_floor: 50.0, ..PlannerSettings::default() });
        assert!(with.contains("what a push has to promise: ") && with.contains("(patience) | 300.0 |"), "{with}");
        assert!(with.contains("γ·Reg ◀ | 390.0 |"), "{with}");
        let rows: Vec<&str> = with.lines().filter(|line| line.contains(" mm | ")).collect();
        let lengths = |row: &&str| ["110", "120", "130"].iter().position(|mm| row.contains(&format!("{mm} mm")));
        assert_eq!(rows.iter().filter_map(lengths).collect::<Vec<_>>(), [1, 2, 0], "{with}");
        assert!(rows[0].starts_with("| 1 ● |"), "{with}");
        assert!(!page(PlannerSettings::default()).contains("has to promise"), "the paper's rule compares IGV itself");
    }

    #[test]
    fn every_skill_has_its_own_table_with_its_own_numbers() {
        let mut decision = fixture::play(1).record.steps[0].decision.clone();
        let candidate = |json: &str| CandidateRecord {
            gain: Some(1.0),
            ..CandidateRecord::of(serde_json::from_str::<Manipulation>(json).expect("a manipulation"))
        };
        decision.candidates = vec![
            candidate(r#"{"kind": "push", "start": [0, 0.1, 0.06], "direction_deg": 90, "length_m": 0.1}"#),
            candidate(
                r#"{"kind": "drag", "start": [0, 0.2, 0.05], "direction_deg": -90, "length_m": 0.08, "pitch_deg": 45}"#,
            ),
        ];
        let mut page = String::new();
        SkillKind::ALL.iter().for_each(|kind| manipulations(&mut page, &decision, *kind));
        assert!(page.contains("**Pushes**: 1 drawn") && page.contains("**Drags**: 1 drawn"), "{page}");
        assert!(page.contains("| 0.00 | 0.20 | 0.05 | -90° | 80 mm | 45° |"), "{page}");
        assert!(page.contains("| 0.00 | 0.10 | 0.06 | 90° | 100 mm | 0.0 s |"), "{page}");
    }

    #[test]
    fn a_blocked_push_tells_how_far_it_was_to_go() {
        let played = fixture::play(1);
        let push = Push { start: [0.0, 0.1, 0.06], direction_deg: 90.0, length_m: 0.14 };
        let mut record = played.record.steps[0].clone();
        record.action = Action::Manipulate(push.into());
        record.push = Some(PushReport {
            pushed_m: 0.05,
            stalled: true,
            contacts: Vec::new(),
            against_wall: Vec::new(),
            arm_in_shelf_m: 0.0,
            grip: None,
        });
        assert_eq!(mishaps(&record), ["the arm was blocked after 50 of 140 mm of its push"]);
        assert_eq!(length(&record).as_deref(), Some("50 of 140 mm"));
        record.push = None;
        assert_eq!(length(&record).as_deref(), Some("140 mm"));
    }

    #[test]
    fn numbers_are_grouped() {
        assert_eq!(thousands(0.2), "0");
        assert_eq!(thousands(999.6), "1,000");
        assert_eq!(thousands(1_234_567.0), "1,234,567");
    }
}
