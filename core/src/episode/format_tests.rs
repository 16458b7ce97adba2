//! An episode that was written in format 1, before truths were optional and frames were filed: six steps with noise on a coarse
//! copy of `scenes/demo/behind-the-boxes.toml`, the fifth of them a push.

use super::super::{Agreement, EpisodeDir, infer, replay, resume, resume_from_checkpoint};
use super::*;
use crate::belief::Classical;
use crate::scene::Catalog;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use tempfile::tempdir;

fn kept() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/episode-format-1")
}

fn catalog() -> Arc<Catalog> {
    Arc::new(Catalog::standard())
}

/// A copy of the episode as a run leaves it that was killed after some steps.
fn cut(steps: usize, to: &Path) {
    for folder in ["beliefs", "truth"] {
        fs::create_dir_all(to.join(folder)).expect("made");
        for entry in fs::read_dir(kept().join(folder)).expect("listed") {
            let file = entry.expect("an entry").file_name();
            fs::copy(kept().join(folder).join(&file), to.join(folder).join(&file)).expect("copied");
        }
    }
    let text = fs::read_to_string(kept().join("episode.json")).expect("text");
    let mut document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    document["steps"].as_array_mut().expect("steps").truncate(steps);
    fs::write(to.join("episode.json"), document.to_string()).expect("written");
}

#[test]
fn an_episode_of_format_1_opens_and_is_simulated_again_to_the_bit() {
    let directory = EpisodeDir::open(kept()).expect("opens");
    let record = directory.record().expect("reads");
    assert!(record.has_truth() && record.steps.len() == 6 && record.has_new_truth(5));
    for step in &record.steps {
        assert_eq!(step.scores().map(|scores| scores.entropy_nats), Some(step.entropy_nats));
    }
    assert_eq!(directory.read_truth(6).expect("a truth").objects, None, "it did not tell which object stands where");
    let report = replay(&directory, catalog(), Arc::new(Classical), &mut |_, _| {}).expect("replays");
    assert_eq!(report.agreement, Agreement::BitEqual, "{:?}", report.differences);
    let said = infer(&directory, Arc::new(Classical), &mut |_, _| {}).expect_err("no frames").to_string();
    assert!(said.contains("holds no frames to infer from"), "{said}");
    // Written again it is a document of this format and says the same.
    let again = EpisodeRecord::from_json(&record.to_json(), Path::new("again")).expect("reads");
    assert!(again == record && record.to_json().contains("\"format\": 2"));
}

#[test]
fn an_episode_of_format_1_is_resumed_to_the_same_end() {
    let root = tempdir().expect("a folder");
    let whole = EpisodeDir::open(kept()).expect("opens");
    for steps in [4, 5] {
        let path = root.path().join(steps.to_string());
        cut(steps, &path);
        let at_once = resume_from_checkpoint(&path, catalog(), Arc::new(Classical)).expect("opens");
        assert!(at_once.is_none(), "it has no checkpoint");
        let (mut directory, mut episode) =
            resume(&path, catalog(), Arc::new(Classical), &mut |_, _| Ok(())).expect("resumes");
        while !episode.is_finished() {
            episode.act(episode.decide()).expect("an action");
            directory.write(&mut episode).expect("written");
        }
        let expected = whole.record().expect("a record");
        assert_eq!(episode.record().scores_after(6), expected.scores_after(6));
        let filed = |directory: &EpisodeDir| directory.read_belief(6).expect("a belief");
        assert!(filed(&directory) == filed(&whole));
        assert!(!path.join("frames").exists(), "half of its frames would be of no use");
    }
}

#[test]
fn a_judgement_is_there_whole_or_not_at_all() {
    let text = fs::read_to_string(kept().join("episode.json")).expect("text");
    let without = |name: &str| {
        let mut document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        document["steps"][2].as_object_mut().expect("a step").remove(name);
        EpisodeRecord::from_json(&document.to_string(), Path::new("e")).expect_err(name).to_string()
    };
    for name in ["scores", "objects", "dropped", "displacement_m"] {
        assert!(without(name).contains(&format!("missing field `{name}`")), "{}", without(name));
    }
    let mut document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    document["prior"].as_object_mut().expect("a prior").remove("semantic_miou");
    let said = EpisodeRecord::from_json(&document.to_string(), Path::new("e")).expect_err("half").to_string();
    assert!(said.contains("missing field `semantic_miou`"), "{said}");
    document["prior"] = serde_json::json!({ "entropy_nats": 5.0 });
    let said = EpisodeRecord::from_json(&document.to_string(), Path::new("e")).expect_err("mixed").to_string();
    assert!(said.starts_with("e: steps[0]: is judged and the prior is not"), "{said}");
}
