//! A decision in words and tables, and the scores as series.

use super::Setting;
use nudge_core::episode::StepRecord;
use nudge_core::plan::{Action, CandidateRecord, Decision, PlannerSettings, Reason};
use nudge_core::push::Rejection;
use nudge_core::score::Scores;
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
        reason(record.decision.reason),
        scores_line(record.scores(), record.entropy_nats)
    )
}

/// What went wrong in a step, one line each.
pub(crate) fn mishaps(record: &StepRecord) -> Vec<String> {
    let mut words: Vec<String> = record.dropped().iter().map(|name| format!("dropped {name}")).collect();
    if let Some(push) = &record.push {
        if push.stalled {
            words.push(format!("the arm was blocked after {} of its push", length(record).unwrap_or_default()));
        }
        words.extend(push.contacts.iter().map(|touch| format!("the arm's {} touched {}", touch.link, touch.object)));
        words.extend(push.against_wall.iter().map(|name| format!("{name} was pressed against a wall")));
    }
    words
}

/// How far a push went of what was planned: `50 of 140 mm`; of an episode that does not tell, what was planned.
pub(crate) fn length(record: &StepRecord) -> Option<String> {
    let Action::Push(planned) = record.action else { return None };
    let planned_mm = planned.length_m * 1e3;
    Some(match &record.push {
        Some(push) => format!("{:.0} of {planned_mm:.0} mm", push.pushed_m * 1e3),
        None => format!("{planned_mm:.0} mm"),
    })
}

/// An action in words.
pub(crate) fn action(action: &Action) -> String {
    match action {
        Action::Look { view } => format!("look from view {}", view.0),
        Action::Push(push) => format!("push {:.0} mm towards {:.0}°", push.length_m * 1e3, push.direction_deg),
    }
}

/// A reason in words.
pub(crate) fn reason(reason: Reason) -> &'static str {
    match reason {
        Reason::LookTellsMore => "looking tells more",
        Reason::PushTellsLittle => "no push promises enough",
        Reason::PushTellsMore => "pushing tells more",
        Reason::PushReveals => "the push really brings something hidden into sight",
        Reason::ViewOfPush => "the view that made the push worth it",
        Reason::TooEarly => "no push in the first steps",
        Reason::LastStep => "no push in the last steps",
        Reason::JustPushed => "no push soon after a push",
        Reason::MapComplete => "the map is complete",
        Reason::Dropped => "an object was dropped, so no more pushes",
        Reason::NoCandidate => "no feasible push",
        Reason::Schedule => "the policy's schedule",
        Reason::Manual => "chosen by hand",
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
        capital(reason(decision.reason))
    );
    weighed(&mut page, decision, setting);
    views(&mut page, setting, decision);
    pushes(&mut page, decision, setting.planner.gamma);
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

fn weighed(page: &mut String, decision: &Decision, setting: &Setting<'_>) {
    let PlannerSettings { counted, gamma, .. } = *setting.planner;
    let sign = |holds: bool| if holds { " ◀" } else { "" };
    let push = decision.igm + gamma * decision.reg;
    let (looks, pushed) = (matches!(decision.action, Action::Look { .. }), decision.best_push.is_some());
    page.push_str("| weighed | nats |\n|:--|--:|\n");
    let _ = writeln!(page, "| look: IGV, {}{} | {:.1} |", counted.of_looks(), sign(looks), decision.igv);
    if pushed {
        let asked = setting.planner.asked_of_pushes(decision.igv);
        if asked != decision.igv {
            let _ = writeln!(page, "|    what a push has to promise | {asked:.1} |");
        }
        let _ = writeln!(page, "| push: IGM + γ·Reg{} | {push:.1} |", sign(!looks));
        let _ = writeln!(page, "|    IGM, {} | {:.1} |", counted.of_pushes(), decision.igm);
        let _ = writeln!(page, "|    γ·Reg, what it would blur | {:.1} |", gamma * decision.reg);
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

fn pushes(page: &mut String, decision: &Decision, gamma: f32) {
    if decision.candidates.is_empty() {
        return;
    }
    let value = |c: &CandidateRecord| c.gain.map(|gain| gain + gamma * c.reg.unwrap_or(0.0));
    let mut feasible: Vec<(usize, f32, &CandidateRecord)> =
        decision.candidates.iter().enumerate().filter_map(|(at, c)| Some((at, value(c)?, c))).collect();
    feasible.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let count = |is: fn(&Rejection) -> bool| {
        decision.candidates.iter().filter(|c| c.rejection.as_ref().is_some_and(is)).count()
    };
    let _ = write!(
        page,
        "**Pushes**: {} drawn, {} feasible; {} without a target, {} out of reach, {} blocked, {} without a free way\n\n",
        decision.candidates.len(),
        feasible.len(),
        count(|r| matches!(r, Rejection::NoTarget)),
        count(|r| matches!(r, Rejection::Unreachable { .. })),
        count(|r| matches!(r, Rejection::ArmBlocked { .. })),
        count(|r| matches!(r, Rejection::NoWay)),
    );
    reasons(page, decision);
    if feasible.is_empty() {
        return;
    }
    page.push_str(
        "| push | from x, y (m) | towards | length | arm | gain | Reg | value, nats |\n|--:|:--|--:|--:|--:|--:|--:|--:|\n",
    );
    for (at, value, c) in feasible.iter().take(LISTED) {
        let best = if decision.best_push == Some(*at) { " ●" } else { "" };
        let [x, y, _] = c.push.start;
        let _ = writeln!(
            page,
            "| {at}{best} | {x:.2}, {y:.2} | {:.0}° | {:.0} mm | {:.1} s | {:.1} | {:.1} | {value:.1} |",
            c.push.direction_deg,
            c.push.length_m * 1e3,
            c.motion_s.unwrap_or(0.0),
            c.gain.unwrap_or(0.0),
            c.reg.unwrap_or(0.0)
        );
    }
    page.push('\n');
}

/// The commonest reasons why candidates were rejected.
fn reasons(page: &mut String, decision: &Decision) {
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    for rejection in decision.candidates.iter().filter_map(|candidate| candidate.rejection.as_ref()) {
        *counts.entry(rejection.kind_words()).or_default() += 1;
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
    use nudge_core::arm::{ArmTool, Push};
    use nudge_core::episode::PushReport;

    #[test]
    fn the_page_of_a_push_shows_what_it_had_to_promise() {
        let played = fixture::play(4);
        let push = Push { start: [0.0, 0.1, 0.06], direction_deg: 90.0, length_m: 0.1 };
        let (mut record, arm) = (played.record.steps[3].clone(), ArmTool::standard(played.record.scene.shelf));
        record.decision = Decision {
            action: Action::Push(push),
            reason: Reason::PushTellsMore,
            igv: 30.0,
            igm: 400.0,
            reg: -50.0,
            best_push: Some(0),
            ..record.decision
        };
        let page = |planner: &PlannerSettings| {
            let setting = Setting {
                shelf: &played.record.scene.shelf,
                catalog: &played.catalog,
                views: &played.views,
                budget: 4,
                planner,
                arm: &arm,
                unreachable: &[],
            };
            markdown(&setting, &record)
        };
        let patient = PlannerSettings { patience: 10.0, push_floor: 50.0, ..PlannerSettings::default() };
        let with = page(&patient);
        assert!(with.contains("what a push has to promise | 300.0 |") && with.contains("γ·Reg ◀ | 390.0 |"), "{with}");
        assert!(!page(&PlannerSettings::default()).contains("has to promise"), "the paper's rule compares IGV itself");
    }

    #[test]
    fn a_blocked_push_tells_how_far_it_was_to_go() {
        let played = fixture::play(1);
        let push = Push { start: [0.0, 0.1, 0.06], direction_deg: 90.0, length_m: 0.14 };
        let mut record = played.record.steps[0].clone();
        record.action = Action::Push(push);
        record.push = Some(PushReport {
            pushed_m: 0.05,
            stalled: true,
            contacts: Vec::new(),
            against_wall: Vec::new(),
            arm_in_shelf_m: 0.0,
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
