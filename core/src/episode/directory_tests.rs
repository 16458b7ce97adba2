use super::super::synthetic;
use super::*;
use crate::files::cut;
use std::collections::BTreeMap;
use tempfile::tempdir;

/// Writes the synthetic episode's prior and `steps` steps, as [`EpisodeDir::write`] would.
fn write_steps(directory: &EpisodeDir, steps: usize) -> Result<()> {
    for index in 0..=steps {
        let truth = [0, 2].contains(&index).then(|| synthetic::truth(index));
        directory.write_arrays(index, &synthetic::belief(index), truth.as_ref())?;
        directory.write_document(&synthetic::record(index))?;
    }
    Ok(())
}

fn written(path: &Path, steps: usize) -> EpisodeDir {
    let directory = EpisodeDir::create(path, Overwrite::Refuse).expect("created");
    write_steps(&directory, steps).expect("written");
    EpisodeDir { lock: None, ..directory }
}

/// Every file below `path` with its content.
fn snapshot(path: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(path).expect("listed") {
        let entry = entry.expect("an entry").path();
        if entry.is_dir() {
            files.append(&mut snapshot(&entry));
        } else {
            let content = fs::read(&entry).expect("read");
            files.insert(entry, content);
        }
    }
    files
}

#[test]
fn what_was_written_is_read_back() {
    let root = tempdir().expect("a temporary directory");
    let path = root.path().join("a").join("b");
    written(&path, 3);
    let directory = EpisodeDir::open(&path).expect("opens");
    assert_eq!(directory.record().expect("a record"), synthetic::record(3));
    for index in 0..=3 {
        let (kept, exact) = (directory.read_belief(index).expect("a belief"), synthetic::belief(index));
        assert_eq!(kept.occupancy.as_flattened(), Precision::Half.round_trip(exact.occupancy.as_flattened()));
        assert_eq!(kept.semantics.as_flattened(), Precision::Half.round_trip(exact.semantics.as_flattened()));
    }
    for (actions, filed) in [(0, 0), (1, 0), (2, 2), (3, 2)] {
        let truth = directory.read_truth(actions).expect("a truth");
        assert_eq!(truth, StoredTruth::from(&synthetic::truth(filed)), "after {actions} actions");
    }
    assert_eq!(directory.record().expect("a record").truth_indices().collect::<Vec<_>>(), [0, 2]);
}

#[test]
fn an_episode_stored_at_once_is_the_one_written_step_by_step() {
    let root = tempdir().expect("a temporary directory");
    let (stepwise, at_once) = (root.path().join("a"), root.path().join("b"));
    written(&stepwise, 3);
    let truths: Vec<TruthMap> = [0, 0, 2, 2].map(synthetic::truth).into();
    let states = || (0..=3).map(|index| (synthetic::belief(index), Some(&truths[index])));
    EpisodeDir::store(&at_once, &synthetic::record(3), states()).expect("stored");
    let content = |path: &Path| -> Vec<Vec<u8>> { snapshot(path).into_values().collect() };
    assert!(content(&stepwise) == content(&at_once));
    let error =
        EpisodeDir::store(root.path().join("c"), &synthetic::record(2), states()).expect_err("a state too many");
    assert_eq!(error.to_string(), "4 states for 2 steps");
    assert!(EpisodeDir::open(root.path().join("c")).is_err(), "not an episode");
}

#[test]
fn single_precision_is_exact_and_half_is_not() {
    let root = tempdir().expect("a temporary directory");
    let directory =
        EpisodeDir::create(root.path(), Overwrite::Refuse).expect("created").with_precision(Precision::Single);
    write_steps(&directory, 1).expect("written");
    assert_eq!(directory.read_belief(1).expect("a belief"), synthetic::belief(1));
    let half = tempdir().expect("a temporary directory");
    assert_ne!(written(half.path(), 1).read_belief(1).expect("a belief"), synthetic::belief(1));
}

#[test]
fn a_run_cut_at_any_point_leaves_a_directory_that_opens_or_is_free() {
    let mut opened = 0;
    for points in 0.. {
        let root = tempdir().expect("a temporary directory");
        cut::after(points);
        let directory = EpisodeDir::create(root.path(), Overwrite::Refuse).expect("created");
        let result = write_steps(&directory, 3);
        drop(directory);
        cut::never();
        if result.is_ok() {
            assert_eq!(points, 5 * (4 + 2 + 4), "five points a file");
            break;
        }
        match EpisodeDir::state(root.path()).expect("a state") {
            DirectoryState::Begun => {
                assert_eq!(opened, 0, "an episode never becomes less");
                assert!(EpisodeDir::open(root.path()).is_err());
                written(root.path(), 3);
            }
            DirectoryState::Episode => {
                let directory = EpisodeDir::open(root.path()).expect("opens");
                let record = directory.record().expect("a record");
                assert_eq!(record, synthetic::record(record.steps.len()));
                for index in 0..=record.steps.len() {
                    directory.read_belief(index).expect("every belief told of is there");
                    directory.read_truth(index).expect("every truth told of is there");
                }
                assert!(snapshot(root.path()).keys().all(|file| !file.to_string_lossy().contains(TEMPORARY)));
                opened += 1;
            }
            other => panic!("{other:?} after {points} points"),
        }
    }
    // Cut after the rename of the prior's `episode.json`, and at all later points.
    assert_eq!(opened, 36);
}

#[test]
fn writing_on_removes_what_the_log_does_not_tell_of() {
    let root = tempdir().expect("a temporary directory");
    let directory = written(root.path(), 2);
    directory.write_arrays(3, &synthetic::belief(3), Some(&synthetic::truth(3))).expect("written");
    fs::write(root.path().join("beliefs").join(format!("{TEMPORARY}003.npz")), b"half").expect("written");
    let reader = EpisodeDir::open_to_write(root.path()).expect("opens");
    assert_eq!(snapshot(root.path()).len(), 1 + 3 + 2);
    let refused = EpisodeDir::open_to_write(root.path()).expect_err("one writer at a time").to_string();
    assert!(refused.ends_with("another run is writing this episode"), "{refused}");
    // A reader does not take a writer's half-written file away, but removes a dead one's.
    let half = root.path().join(format!("{TEMPORARY}episode.json"));
    fs::write(&half, b"half").expect("written");
    EpisodeDir::open(root.path()).expect("opens");
    assert!(half.exists());
    drop(reader);
    EpisodeDir::open(root.path()).expect("opens");
    assert!(!half.exists());
}

#[test]
fn an_episode_is_replaced_only_when_told_and_nothing_else_is_removed() {
    let root = tempdir().expect("a temporary directory");
    written(root.path(), 3);
    let thesis = root.path().join("thesis.tex");
    fs::write(&thesis, b"mine").expect("written");
    fs::write(root.path().join("notes.json"), b"{}").expect("written");
    fs::write(root.path().join("beliefs").join("mine.npz"), b"mine").expect("written");
    let before = snapshot(root.path());
    let refused = EpisodeDir::create(root.path(), Overwrite::Refuse).expect_err("refuses");
    assert_eq!(refused.exit_code(), 2);
    let line = refused.to_string();
    assert!(line.contains("--force") && line.contains("--resume") && !line.contains('\n'), "{line}");
    assert_eq!(snapshot(root.path()), before);
    EpisodeDir::create(root.path(), Overwrite::Replace).expect("replaces");
    let left: Vec<PathBuf> = snapshot(root.path()).into_keys().collect();
    assert_eq!(left, [root.path().join("beliefs").join("mine.npz"), thesis]);
}

#[test]
fn what_is_no_episode_is_never_touched() {
    let cases: [&[&str]; 6] = [
        &["thesis.tex"],
        &["notes.json"],
        &["beliefs/000.npz", "beliefs/mine.npz"],
        &["beliefs"],
        &["episode.json"],
        &["truth/000.npz", "photo.png"],
    ];
    for case in cases {
        let root = tempdir().expect("a temporary directory");
        for name in case {
            let file = root.path().join(name);
            fs::create_dir_all(file.parent().expect("a parent")).expect("made");
            fs::write(file, b"[\"mine\"]").expect("written");
        }
        let before = snapshot(root.path());
        for overwrite in [Overwrite::Refuse, Overwrite::Replace] {
            let refused = EpisodeDir::create(root.path(), overwrite).expect_err("refuses");
            assert!(refused.to_string().contains("holds no episode"), "{refused}");
            assert_eq!(snapshot(root.path()), before, "{case:?}");
        }
    }
    let root = tempdir().expect("a temporary directory");
    let file = root.path().join("file");
    fs::write(&file, b"mine").expect("written");
    let refused = EpisodeDir::create(&file, Overwrite::Replace).expect_err("refuses").to_string();
    assert!(refused.ends_with("is a file, not a directory"), "{refused}");
}

#[test]
fn beliefs_without_their_log_need_force() {
    let root = tempdir().expect("a temporary directory");
    written(root.path(), 1);
    fs::remove_file(root.path().join(DOCUMENT)).expect("removed");
    assert_eq!(EpisodeDir::state(root.path()).expect("a state"), DirectoryState::Unindexed);
    assert!(EpisodeDir::create(root.path(), Overwrite::Refuse).is_err());
    EpisodeDir::create(root.path(), Overwrite::Replace).expect("replaces");
    assert!(snapshot(root.path()).is_empty());
    assert_eq!(EpisodeDir::state(root.path().join("nowhere")).expect("a state"), DirectoryState::Free);
}

#[test]
fn a_damaged_log_is_named_with_its_place() {
    let root = tempdir().expect("a temporary directory");
    let directory = written(root.path(), 3);
    let document = root.path().join(DOCUMENT);
    let whole = fs::read(&document).expect("read");
    let complain = |content: &[u8]| {
        fs::write(&document, content).expect("written");
        let error = EpisodeDir::open(root.path()).expect_err("refuses");
        assert_eq!(error.exit_code(), 2);
        let line = error.to_string();
        assert!(line.starts_with(&document.display().to_string()) && !line.contains('\n'), "{line}");
        line
    };
    for length in (0..whole.len() - 2).step_by(997) {
        let line = complain(&whole[..length]);
        assert!(line.contains("line "), "{line}");
    }
    let text = String::from_utf8(whole.clone()).expect("UTF-8");
    assert!(complain(text.replacen("\"format\": 2", "\"format\": 3", 1).as_bytes()).contains("format: is 3"));
    assert!(complain(b"{}").contains("format: is missing"));
    assert!(complain(text.replacen("\"index\": 2", "\"index\": 7", 1).as_bytes()).contains("steps[1].index: is 7"));
    assert!(complain(text.replacen("\"budget\": 4", "\"budget\": 2", 1).as_bytes()).contains("3 steps in a budget"));
    assert!(complain(text.replacen("\"igv\": ", "\"igv\": -\"", 1).as_bytes()).contains("line "));
    let mut bytes = whole.clone();
    bytes[text.find("\"steps\"").expect("steps")] = 0xff;
    assert!(complain(&bytes).contains("is not UTF-8"));
    fs::write(&document, &whole).expect("written");
    directory.record().expect("whole again");
    let nowhere = EpisodeDir::open(root.path().join("nowhere")).expect_err("refuses").to_string();
    assert!(nowhere.contains("nowhere"), "{nowhere}");
    fs::remove_file(&document).expect("removed");
    let empty = EpisodeDir::open(root.path()).expect_err("refuses").to_string();
    assert!(empty.ends_with("holds no episode (no episode.json)"), "{empty}");
}

#[test]
fn a_damaged_archive_is_named_with_its_array() {
    let root = tempdir().expect("a temporary directory");
    let directory = written(root.path(), 2);
    let belief = root.path().join("beliefs").join("001.npz");
    let whole = fs::read(&belief).expect("read");
    for length in [0, 10, whole.len() / 2, whole.len() - 1] {
        fs::write(&belief, &whole[..length]).expect("written");
        let line = EpisodeDir::open(root.path()).expect_err("refuses").to_string();
        assert!(line.starts_with(&belief.display().to_string()), "{line}");
    }
    // A byte that flips inside the archive is found when the array is read.
    for at in [200, whole.len() / 2] {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        fs::write(&belief, &bytes).expect("written");
        let line = directory.read_belief(1).expect_err("refuses").to_string();
        assert!(line.starts_with(&belief.display().to_string()) && line.contains("array "), "{line}");
    }
    // Arrays of another grid.
    let other = Belief::uniform(Grid { voxel_m: 0.01, dims: [2, 3, 4], origin: [0.0; 3] });
    fs::write(&belief, npz::belief_archive(&other, Precision::Half)).expect("written");
    let line = directory.read_belief(1).expect_err("refuses").to_string();
    assert!(line.contains("array occupancy: has shape [2, 3, 4, 2] where"), "{line}");
    fs::remove_file(root.path().join("truth").join("002.npz")).expect("removed");
    fs::write(&belief, &whole).expect("written");
    let line = EpisodeDir::open(root.path()).expect_err("refuses").to_string();
    assert!(line.contains("002.npz"), "{line}");
}

#[test]
fn a_directory_that_cannot_be_written_gives_one_line() {
    // A file where the directory's parent should be: nothing can be made below it, whoever runs the test.
    let root = tempdir().expect("a temporary directory");
    fs::write(root.path().join("file"), b"").expect("written");
    let error = EpisodeDir::create(root.path().join("file").join("out"), Overwrite::Refuse).expect_err("refuses");
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("file") && !error.to_string().contains('\n'), "{error}");
}
