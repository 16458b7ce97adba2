use super::super::synthetic;
use super::super::{EpisodeDir, Overwrite, resume_from_checkpoint};
use super::*;
use crate::belief::Classical;
use crate::plan::PolicyKind;
use crate::scene::Catalog;
use std::fs;
use std::path::Path;
use tempfile::tempdir;

const BUDGET: usize = 11;

/// Runs an episode with pushes at steps 5 and 10 without a stop.
fn whole(path: &Path) -> Episode {
    let mut episode = synthetic::episode(PolicyKind::RandomPush5, BUDGET);
    let mut directory = EpisodeDir::create(path, Overwrite::Refuse).expect("created");
    directory.write(&mut episode).expect("written");
    while !episode.is_finished() {
        episode.act(episode.decide()).expect("an action");
        directory.write(&mut episode).expect("written");
    }
    episode
}

fn go_on(path: &Path) -> Option<(EpisodeDir, Episode)> {
    resume_from_checkpoint(path, Arc::new(Catalog::standard()), Arc::new(Classical)).expect("opens")
}

fn timeless(record: &EpisodeRecord) -> String {
    let mut record = record.clone();
    record.steps.iter_mut().for_each(|step| step.seconds = Default::default());
    record.also_made_by.clear();
    record.to_json()
}

#[test]
fn a_run_that_is_killed_after_every_action_comes_to_the_same_end_to_the_bit() {
    let root = tempdir().expect("a folder");
    let (straight, killed) = (root.path().join("straight"), root.path().join("killed"));
    let expected = whole(&straight);
    let mut episode = synthetic::episode(PolicyKind::RandomPush5, BUDGET);
    EpisodeDir::create(&killed, Overwrite::Refuse).expect("created").write(&mut episode).expect("written");
    episode.act(episode.decide()).expect("an action");
    drop(episode);
    // The first action was not written: it is done again. From then on every life does one action.
    for done in 0..BUDGET {
        let (mut directory, mut episode) = if done == 0 {
            let catalog = Arc::new(Catalog::standard());
            super::super::resume(&killed, catalog, Arc::new(Classical), &mut |_, _| Ok(())).expect("resumes")
        } else {
            go_on(&killed).expect("a checkpoint")
        };
        assert_eq!(episode.record().steps.len(), done);
        episode.act(episode.decide()).expect("an action");
        directory.write(&mut episode).expect("written");
        let kept = fs::read_dir(killed.join("checkpoints")).expect("listed").count();
        assert_eq!(kept, 1, "only the newest checkpoint is kept");
    }
    let (directory, episode) = go_on(&killed).expect("a checkpoint");
    assert_eq!(timeless(episode.record()), timeless(expected.record()));
    assert!(episode.belief() == expected.belief() && episode.truth() == expected.truth());
    assert_eq!(episode.history(), expected.history());
    for file in ["beliefs/011.npz", "truth/010.npz", "frames/009.frame", "frames/010.push"] {
        assert!(fs::read(killed.join(file)).expect(file) == fs::read(straight.join(file)).expect(file), "{file}");
    }
    // The world behind it is made again, contacts and all: the same push does the same.
    let (ours, theirs) = (episode.simulated().expect("simulated"), expected.simulated().expect("simulated"));
    assert_eq!(ours.world().standing(), theirs.world().standing());
    directory.finish().expect("cleaned up");
    drop(directory);
    assert!(!killed.join("checkpoints").exists() && go_on(&killed).is_none());
}

#[test]
fn a_checkpoint_that_is_not_of_the_episode_is_not_gone_on_from() {
    let root = tempdir().expect("a folder");
    let path = root.path().join("episode");
    let expected = whole(&path);
    let file = path.join("checkpoints").join(format!("{BUDGET:03}.state"));
    let good = fs::read(&file).expect("read");
    fs::write(&file, &good[..good.len() / 2]).expect("cut");
    assert!(go_on(&path).is_none(), "half a checkpoint: the log is repeated instead");
    // Another belief than the one that is filed.
    let mut other = expected.estimate().clone();
    Arc::make_mut(&mut other.belief).occupancy[77] = [9.0, 2.0];
    let standing = expected.simulated().expect("simulated").standing();
    fs::write(&file, Checkpoint { estimate: other, standing: standing.clone() }.to_bytes()).expect("written");
    let said = resume_from_checkpoint(&path, Arc::new(Catalog::standard()), Arc::new(Classical)).map(drop);
    let error = said.expect_err("refused");
    assert!(error.exit_code() == 1 && error.to_string().contains("beliefs/011.npz: occupancy[15"), "{error}");
    // Bodies elsewhere: seen by the truth where it shows, and where it does not when something is to be pushed.
    let mut nudged = standing;
    nudged[0].world_from_body.translation.vector.x += 1e-5;
    let estimate = expected.estimate().clone();
    fs::write(&file, Checkpoint { estimate, standing: nudged }.to_bytes()).expect("written");
    let (_, episode) = go_on(&path).expect("the maps are the same");
    let shelf = episode.simulated().expect("simulated");
    let motion = expected.record().steps[4].decision.motion.clone().expect("a push");
    let error = shelf.clone().carry_out(&episode.arm().arm, &motion).expect_err("refused").to_string();
    assert!(error.contains("does not lead to where the objects stood"), "{error}");
}
