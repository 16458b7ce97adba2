use super::super::synthetic;
use super::*;
use proptest::prelude::*;
use serde_json::Value;

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

#[test]
fn the_document_has_the_published_members() {
    let document: Value = serde_json::from_str(&synthetic::record(3).to_json()).expect("JSON");
    for key in ["format", "scene", "policy", "belief", "seed", "budget", "version", "steps"] {
        assert!(document.get(key).is_some(), "{key}");
    }
    assert_eq!(document["format"], 2);
    assert_eq!(document["policy"], "random-push-5-blind");
    assert_eq!(document["seed"], u64::MAX);
    let look = &document["steps"][0];
    assert_eq!(look["index"], 1);
    assert_eq!(look["action"], serde_json::json!({"kind": "look", "view": 17}));
    for key in ["igv", "igm", "reg"] {
        assert!(look["decision"][key].is_f64(), "{key}");
    }
    assert_eq!(look["decision"]["gains"].as_array().map(Vec::len), Some(300));
    assert_eq!(keys(&look["scores"]).len(), 6);
    for key in ["occupancy_iou", "occupied_iou", "semantic_miou", "entropy_nats", "mece_occupancy", "mece_semantics"] {
        assert!(look["scores"][key].is_f64(), "{key}");
    }
    assert_eq!(look["objects"][0]["verdict"], "not-found");
    assert_eq!(look["dropped"], serde_json::json!([]));
    assert!(look["displacement_m"].is_f64());
    let mut seconds = keys(&look["seconds"]);
    seconds.sort_unstable();
    assert_eq!(seconds, ["act", "decide", "record", "update"]);
    let push = &document["steps"][1]["action"];
    assert_eq!(push["kind"], "push");
    assert_eq!(push["start"].as_array().map(Vec::len), Some(3));
    assert!(push["direction_deg"].is_f64() && push["length_m"].is_f64());
    assert_eq!(keys(push).len(), 4);
}

#[test]
fn lines_stand_for_parts_of_steps() {
    let text = synthetic::record(1).to_json();
    let parse = |text: &str| serde_json::from_str::<Value>(text).expect("JSON");
    let plain = serde_json::to_string(&synthetic::record(1)).expect("JSON");
    assert!(parse(&text) == parse(&plain));
    let line = text.lines().find(|line| line.trim_start().starts_with("\"decision\"")).expect("a line");
    assert!(line.contains("\"gains\": [") && line.ends_with("},"), "{line}");
    assert!(text.contains("\n  \"steps\": [\n    {\n      \"index\": 1,\n"), "{text}");
    assert!(text.ends_with("]\n}\n") && synthetic::record(0).to_json().ends_with("\"steps\": []\n}\n"));
}

#[test]
fn a_decision_of_an_older_version_takes_its_rule_from_the_episode_and_a_newer_one_keeps_its_own() {
    let mut record = synthetic::record(2);
    record.steps[0].decision.rule = None;
    let text = record.to_json();
    assert_eq!(text.matches("\"rule\": {").count(), 1);
    let read = EpisodeRecord::from_json(&text, Path::new("e.json")).expect("reads");
    let kept = record.steps[1].decision.rule;
    assert!(kept.is_some() && kept != Some(record.config.rule()));
    assert_eq!([0, 1].map(|at| read.steps[at].decision.rule), [Some(record.config.rule()), kept]);
}

#[test]
fn an_action_that_is_not_the_decision_s_is_refused() {
    let mut record = synthetic::record(2);
    record.steps[0].action = record.steps[1].action;
    let error = EpisodeRecord::from_json(&record.to_json(), Path::new("e.json")).expect_err("refuses").to_string();
    assert_eq!(error, "e.json: steps[0].action: is not the action of its decision");
}

#[test]
fn an_episode_with_a_skill_that_this_program_lacks_is_refused_in_one_line() {
    let text = synthetic::record(2).to_json().replace(r#""kind": "push""#, r#""kind": "fly""#);
    let error = EpisodeRecord::from_json(&text, Path::new("e.json")).expect_err("refuses").to_string();
    assert!(error.starts_with("e.json: line "), "{error}");
    assert!(
        error.ends_with("this program has no skill `fly`; it has push, drag, pick") && !error.contains('\n'),
        "{error}"
    );
}

#[test]
fn candidates_of_before_there_were_other_skills_are_pushes() {
    let mut document: Value = serde_json::from_str(&synthetic::record(2).to_json()).expect("JSON");
    let written = synthetic::record(2);
    for step in document["steps"].as_array_mut().expect("steps") {
        for candidate in step["decision"]["candidates"].as_array_mut().expect("candidates") {
            assert_eq!(candidate.as_object_mut().expect("an object").remove("kind"), Some("push".into()));
        }
    }
    document["planner"].as_object_mut().expect("settings").remove("skills");
    assert_eq!(EpisodeRecord::from_json(&document.to_string(), Path::new("e.json")).expect("reads"), written);
}

/// What is said of the document with one value in another's place.
fn refusal(place: &str, value: Value) -> String {
    let mut document: Value = serde_json::from_str(&synthetic::record(2).to_json()).expect("JSON");
    *document.pointer_mut(place).unwrap_or_else(|| panic!("{place} is not there")) = value;
    EpisodeRecord::from_json(&document.to_string(), Path::new("e.json")).expect_err("refuses").to_string()
}

#[test]
fn a_shelf_of_kilometres_in_an_episode_asked_for_all_memory() {
    for size in [1e6, 1e30] {
        let line = refusal("/scene/shelf/size", serde_json::json!([size, 0.4, 0.4]));
        assert!(line.starts_with("e.json: shelf size "), "{line}");
    }
    let line = refusal("/scene/shelf/voxel_m", 1e-9.into());
    assert!(line.contains("voxel_m = "), "{line}");
    let line = refusal("/scene/robot/base", serde_json::json!([0.0, 1e30, 0.0]));
    assert!(line.contains("robot base"), "{line}");
}

#[test]
fn settings_out_of_range_in_an_episode_were_taken() {
    let line = refusal("/planner/candidates", u64::MAX.into());
    assert!(line.starts_with("e.json: planner: --candidates "), "{line}");
    let line = refusal("/planner/quiet_steps", 100_000.into());
    assert!(line.contains("--quiet-steps 100000: must be a whole number of steps from 0 to 1000"), "{line}");
}

proptest! {
    #[test]
    fn every_number_is_read_back_to_the_bit(
        gains in proptest::collection::vec(any::<f32>().prop_filter("finite", |x| x.is_finite()), 1..50),
        start in proptest::array::uniform3(-1.0_f32..1.0),
        length_m in 0.0_f32..0.2,
        gamma in 0.0_f32..1.0,
        entropy in any::<f64>().prop_filter("finite", |x| x.is_finite()),
    ) {
        let mut record = synthetic::record(2);
        record.config.planner.gamma = gamma;
        record.steps[0].decision.gains = gains.clone();
        record.steps[1].judgement.as_mut().expect("a truth").scores.entropy_nats = entropy;
        let push = crate::skill::Push { start, direction_deg: gains[0], length_m };
        record.steps[1].action = crate::plan::Action::Manipulate(push.into());
        record.steps[1].decision.action = record.steps[1].action;
        record.steps[1].decision.candidates[0].manipulation = push.into();
        let read = EpisodeRecord::from_json(&record.to_json(), Path::new("episode.json")).expect("reads");
        prop_assert_eq!(read.to_json(), record.to_json());
        let bits = |x: &[f32]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&read.steps[0].decision.gains), bits(&gains));
        prop_assert_eq!(read, record);
    }
}
