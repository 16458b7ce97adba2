use super::super::synthetic;
use super::super::{Agreement, Episode, Overwrite, Precision};
use super::*;
use crate::belief::Classical;
use crate::camera::NoiseModel;
use crate::episode::EpisodeConfig;
use crate::plan::{Action, PolicyKind};
use std::fs;
use std::path::Path;
use tempfile::tempdir;

/// An episode with noise and with a push in it (at step 5), whose beliefs are filed exactly.
fn run(path: &Path, policy: PolicyKind) -> Episode {
    let config = EpisodeConfig { noise: Some(NoiseModel::L515), ..synthetic::config(policy, 7) };
    let mut episode = synthetic::episode_with(config);
    let directory = EpisodeDir::create(path, Overwrite::Refuse).expect("created");
    let mut directory = directory.with_precision(Precision::Single);
    directory.write(&mut episode).expect("written");
    while !episode.is_finished() {
        episode.act(episode.decide()).expect("an action");
        directory.write(&mut episode).expect("written");
    }
    assert!(matches!(episode.record().steps[4].action, Action::Manipulate(_)));
    episode
}

fn inferred(path: &Path) -> Result<ReplayReport> {
    infer(&EpisodeDir::open(path)?, Arc::new(Classical), &mut |_, _| {})
}

#[test]
fn every_belief_is_inferred_again_from_the_filed_frames_to_the_bit() {
    let root = tempdir().expect("a folder");
    for policy in [PolicyKind::RandomPush5, PolicyKind::RandomPush5Blind] {
        let path = root.path().join(policy.name());
        run(&path, policy);
        let report = inferred(&path).expect("inferred");
        assert_eq!((report.agreement, report.steps), (Agreement::BitEqual, 7), "{:?}", report.differences);
    }
}

#[test]
fn another_frame_gives_another_belief_and_a_missing_one_is_named() {
    let root = tempdir().expect("a folder");
    let path = root.path().join("episode");
    run(&path, PolicyKind::RandomPush5);
    let frame = |index: usize| path.join("frames").join(format!("{index:03}.frame"));
    fs::copy(frame(2), frame(3)).expect("copied");
    let report = inferred(&path).expect("inferred");
    assert_eq!((report.agreement, report.differences[0].step), (Agreement::Differs, 3));
    let push = path.join("frames/005.push");
    let bytes = fs::read(&push).expect("read");
    fs::write(&push, &bytes[..bytes.len() - 9]).expect("cut");
    let said = inferred(&path).expect_err("damaged").to_string();
    assert!(said.starts_with(&format!("{}: is cut short", push.display())), "{said}");
    fs::remove_file(frame(6)).expect("removed");
    let error = inferred(&path).expect_err("missing");
    assert!(error.exit_code() == 2 && error.to_string().contains("006.frame: is missing"), "{error}");
    fs::remove_dir_all(path.join("frames")).expect("removed");
    let said = inferred(&path).expect_err("none").to_string();
    assert!(said.contains("holds no frames to infer from"), "{said}");
}
