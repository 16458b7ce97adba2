use super::super::npz;
use super::super::synthetic;
use super::super::{Overwrite, Precision};
use super::super::{resume, review};
use super::*;
use crate::belief::{Belief, Classical, Intervention, NetworksUsed, Prediction, Weights};
use crate::camera::MapObservation;
use crate::made_by::Build;
use crate::plan::{Action, PolicyKind};
use std::fs;
use std::path::Path;
use tempfile::tempdir;

const BUDGET: usize = 7;

/// Runs an episode with a push in it (at step 5) for `steps` steps, writing it to `path`.
fn run(path: &Path, steps: usize) -> Episode {
    let mut episode = synthetic::episode(PolicyKind::RandomPush5, BUDGET);
    let mut directory = EpisodeDir::create(path, Overwrite::Refuse).expect("created");
    directory.write(&mut episode).expect("written");
    go_on(&mut episode, &mut directory, steps);
    episode
}

fn go_on(episode: &mut Episode, directory: &mut EpisodeDir, steps: usize) {
    for _ in 0..steps {
        episode.act(episode.decide()).expect("an action");
        directory.write(episode).expect("written");
    }
}

fn replayed(path: &Path) -> Result<ReplayReport> {
    replay(&EpisodeDir::open(path)?, Arc::new(Catalog::standard()), Arc::new(Classical), &mut |_, _| {})
}

/// `episode.json` without what may differ between two runs.
fn timeless(path: &Path) -> String {
    let mut record = EpisodeDir::open(path).expect("opens").record().expect("a record");
    record.steps.iter_mut().for_each(|step| step.seconds = Default::default());
    record.to_json()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("made");
    for entry in fs::read_dir(from).expect("listed") {
        let entry = entry.expect("an entry").path();
        let target = to.join(entry.file_name().expect("a name"));
        if entry.is_dir() {
            copy(&entry, &target);
        } else {
            fs::copy(&entry, &target).expect("copied");
        }
    }
}

#[test]
fn an_episode_resumes_and_replays_to_the_bit() {
    let root = tempdir().expect("a temporary directory");
    let (whole, stopped) = (root.path().join("whole"), root.path().join("stopped"));
    let first = run(&whole, BUDGET);
    assert!(matches!(first.record().steps[4].action, Action::Manipulate(_)), "{:?}", first.record().steps[4]);

    for steps in [0, 3, 5] {
        drop(run(&stopped, steps));
        let mut calls = Vec::new();
        let (mut directory, mut episode) =
            resume(&stopped, Arc::new(Catalog::standard()), Arc::new(Classical), &mut |episode, outcome| {
                calls.push((episode.record().steps.len(), outcome.is_some()));
                Ok(())
            })
            .expect("resumes");
        assert_eq!(calls.first(), Some(&(0, false)));
        assert_eq!(calls.last(), Some(&(steps, steps > 0)));
        assert_eq!(calls.len(), steps + 1);
        assert_eq!(episode.history().actions.len(), steps);
        go_on(&mut episode, &mut directory, BUDGET - steps);
        assert!(episode.is_finished() && episode.belief() == first.belief() && episode.truth() == first.truth());
        drop(directory);
        assert_eq!(timeless(&stopped), timeless(&whole));
        for index in 0..=BUDGET {
            let file = format!("beliefs/{index:03}.npz");
            assert!(
                fs::read(stopped.join(&file)).expect("read") == fs::read(whole.join(&file)).expect("read"),
                "{file}"
            );
        }
        let truths = |path: &Path| {
            ["000", "005"].map(|index| fs::read(path.join("truth").join(format!("{index}.npz"))).expect("read"))
        };
        assert!(truths(&stopped) == truths(&whole));
        assert_eq!(fs::read_dir(stopped.join("truth")).expect("listed").count(), 2);
        fs::remove_dir_all(&stopped).expect("removed");
    }

    let report = replayed(&whole).expect("replays");
    assert_eq!((report.agreement, report.steps, report.budget), (Agreement::BitEqual, BUDGET, BUDGET));
    report.verdict().expect("the same");

    // Whatever is changed in the log or in a file is found, and where.
    let path = root.path().join("changed");
    copy(&whole, &path);
    let edit = |change: &dyn Fn(&mut EpisodeRecord)| {
        let mut record = EpisodeDir::open(&path).expect("opens").record().expect("a record");
        change(&mut record);
        fs::write(path.join("episode.json"), record.to_json()).expect("written");
    };
    edit(&|record| {
        record.prior.scores.as_mut().expect("a truth").entropy_nats += 1.0;
        record.steps[1].decision.gains[7] += 0.25;
        record.steps[3].judgement.as_mut().expect("a truth").scores.semantic_miou += 1e-12;
        record.steps[5].judgement.as_mut().expect("a truth").objects[0].class = "gum_tin".to_owned();
    });
    change_arrays(&path, &first);
    let report = replayed(&path).expect("replays");
    assert_eq!(report.agreement, Agreement::Differs);
    let places: Vec<(usize, &str)> = report.differences.iter().map(|d| (d.step, d.place.as_str())).collect();
    let expected = [
        (0, "prior.entropy_nats"),
        (2, "decision.gains[7]"),
        (3, "beliefs/003.npz: semantics[257]"),
        (4, "scores.semantic_miou"),
        (5, "truth/005.npz: occupancy[1234]"),
        (6, "objects[0].class"),
    ];
    assert_eq!(places, expected);
    let error = report.verdict().expect_err("differs");
    assert_eq!(error.exit_code(), 1);
    assert!(error.to_string().starts_with("the replay differs: step 0: prior.entropy_nats: "), "{error}");
    fs::remove_dir_all(&path).expect("removed");

    // A resume notices as well.
    copy(&whole, &path);
    edit(&|record| record.steps[2].judgement.as_mut().expect("a truth").displacement_m = 0.5);
    let error =
        resume(&path, Arc::new(Catalog::standard()), Arc::new(Classical), &mut |_, _| Ok(())).err().expect("differs");
    assert_eq!(error.exit_code(), 1);
    assert!(
        error.to_string().contains("cannot be resumed: step 3: displacement_m: 0.5 in the log, 0.0 now"),
        "{error}"
    );
    // Seconds are nobody's business; a byte that flipped in a file is bad input.
    edit(&|record| {
        record.steps[2].judgement.as_mut().expect("a truth").displacement_m = 0.0;
        record.steps[2].seconds.decide = 99.0;
    });
    drop(resume(&path, Arc::new(Catalog::standard()), Arc::new(Classical), &mut |_, _| Ok(())).expect("resumes"));
    let file = path.join("beliefs").join("004.npz");
    let mut bytes = fs::read(&file).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&file, bytes).expect("written");
    let error = replayed(&path).expect_err("damaged");
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().starts_with(&file.display().to_string()), "{error}");
}

#[test]
fn who_only_looks_is_shown_what_is_filed_and_told_where_it_parts_from_what_is() {
    let root = tempdir().expect("a temporary directory");
    let path = root.path().join("episode");
    let first = run(&path, BUDGET);
    let reviewed = |watch: &mut dyn FnMut(&Episode, Option<&StepRecord>)| {
        review(&path, Arc::new(Catalog::standard()), Some(Arc::new(Classical)), &mut |episode, outcome| {
            watch(episode, outcome.map(|outcome| &outcome.record));
            Ok(())
        })
        .expect("reviewed")
    };
    let (whole, difference) = reviewed(&mut |_, _| {});
    assert!(difference.is_none() && whole.belief() == first.belief(), "what agrees is as exact as it was made");

    // As if another version had written steps 3 and 5.
    let directory = EpisodeDir::open(&path).expect("opens");
    let mut record = directory.record().expect("a record");
    record.steps[2].judgement.as_mut().expect("a truth").scores.semantic_miou = 0.125;
    fs::write(path.join("episode.json"), record.to_json()).expect("written");
    let belief = change_arrays(&path, &first);
    let mut shown = Vec::new();
    let (whole, difference) = reviewed(&mut |episode, step| {
        let scores = step.map_or(episode.record().prior.scores.as_ref(), |step| step.scores());
        let score = scores.expect("a truth").semantic_miou;
        shown.push((episode.belief().semantics[17][2], score, episode.truth().expect("a truth").occupancy[1234]));
    });
    let words = difference.expect("told").to_string();
    assert!(words.starts_with("step 3: scores.semantic_miou: 0.125 in the log, "), "{words}");
    assert_eq!((shown[3].0, shown[3].1), (belief.semantics[17][2], 0.125));
    let occupied = first.truth().expect("a truth").occupancy[1234];
    assert_eq!([shown[0].2, shown[4].2, shown[5].2], [occupied, occupied, occupied ^ 1]);
    assert_eq!((shown.len(), whole.record()), (BUDGET + 1, &record));
    assert_eq!(names_of(&path), ["beliefs", "checkpoints", "episode.json", "frames", "truth"]);

    // Without the update that it was made with.
    record.config.belief = "another".to_owned();
    fs::write(path.join("episode.json"), record.to_json()).expect("written");
    let mut at = 0;
    let (whole, difference) = review(&path, Arc::new(Catalog::standard()), None, &mut |episode, outcome| {
        assert!(*episode.belief() == directory.read_belief(at)?, "step {at}");
        assert!(outcome.is_none_or(|outcome| outcome.prediction.is_none() && outcome.record == record.steps[at - 1]));
        at += 1;
        Ok(())
    })
    .expect("reviewed");
    assert_eq!((difference, at, whole.record()), (None, BUDGET + 1, &record));
}

/// Changes a number of the belief after three actions and one of the truth after five; returns that belief.
fn change_arrays(path: &Path, first: &Episode) -> Belief {
    let directory = EpisodeDir::open(path).expect("opens");
    let mut belief = directory.read_belief(3).expect("a belief");
    belief.semantics[17][2] += 0.5;
    fs::write(directory.belief_path(3), npz::belief_archive(&belief, Precision::Half)).expect("written");
    let mut truth = first.truth().expect("a truth").clone();
    truth.occupancy[1234] ^= 1;
    fs::write(directory.truth_path(5), npz::truth_archive(&truth)).expect("written");
    belief
}

/// What is in a folder, by name.
fn names_of(path: &Path) -> Vec<String> {
    let mut names = crate::files::names_in(path).expect("listed");
    names.sort();
    names
}

/// The classical update, as if it ran on weights of which the hash is one digit over and over.
struct Weighted(&'static str);

impl BeliefUpdate for Weighted {
    fn name(&self) -> &str {
        CLASSICAL
    }

    fn networks_used(&self) -> Option<NetworksUsed> {
        let weights = Weights { sigma_o: Some(self.0.repeat(64)), ..Weights::default() };
        Some(NetworksUsed { weights, modules: Default::default(), libtorch: "1".to_owned(), device: "cpu".to_owned() })
    }

    fn observe(&self, belief: &Belief, observation: &MapObservation) -> Belief {
        Classical.observe(belief, observation)
    }

    fn predict(&self, belief: &Belief, interventions: &[Intervention]) -> Vec<Prediction> {
        Classical.predict(belief, interventions)
    }
}

#[test]
fn an_episode_of_other_weights_is_not_resumed_and_says_which() {
    let root = tempdir().expect("a temporary directory");
    let path = root.path().join("episode");
    let (scene, config) = (synthetic::cluttered_scene(), synthetic::config(PolicyKind::RandomPush5, BUDGET));
    let catalog = Arc::new(Catalog::standard());
    let mut episode = Episode::new(scene, catalog.clone(), config, Arc::new(Weighted("a"))).expect("an episode");
    let mut directory = EpisodeDir::create(&path, Overwrite::Refuse).expect("created");
    directory.write(&mut episode).expect("written");
    go_on(&mut episode, &mut directory, 2);
    drop(directory);
    let resumed = |digit: &'static str| resume(&path, catalog.clone(), Arc::new(Weighted(digit)), &mut |_, _| Ok(()));
    let error = resumed("e").err().expect("refused");
    let words = "cannot be resumed: the weights sigma_o were aaaaaaaaaaaa, now they are eeeeeeeeeeee";
    assert!(error.to_string().contains(words) && error.exit_code() == 2, "{error}");
    drop(resumed("a").expect("the same weights"));
    // It is still to be looked at, and one that does not tell its weights is verified by its beliefs alone.
    let record = EpisodeDir::open(&path).expect("opens").record().expect("a record");
    assert!(record.other_weights(&Weighted("e")).is_some() && record.other_weights(&Weighted("a")).is_none());
    let (_, difference) = review(&path, catalog.clone(), None, &mut |_, _| Ok(())).expect("reviewed");
    assert_eq!(difference, None);
    let old = EpisodeRecord { made_by: None, ..record };
    assert!(old.other_weights(&Weighted("e")).is_none());
    fs::write(path.join("episode.json"), old.to_json()).expect("written");
    drop(resumed("e").expect("nothing says that they are others"));
}

#[test]
fn a_step_says_which_program_made_it() {
    let root = tempdir().expect("a temporary directory");
    let path = root.path().join("episode");
    let build = |letter: &str| Build { commit: letter.repeat(40), dirty: Some(false) };
    let mut episode = synthetic::episode(PolicyKind::Random, 4);
    episode.built_from(build("a"));
    let mut directory = EpisodeDir::create(&path, Overwrite::Refuse).expect("created");
    directory.write(&mut episode).expect("written");
    go_on(&mut episode, &mut directory, 1);
    drop(directory);
    for (letter, steps) in [("a", 1), ("b", 1), ("b", 1), ("c", 0)] {
        let (mut directory, mut episode) =
            resume(&path, Arc::new(Catalog::standard()), Arc::new(Classical), &mut |_, _| Ok(())).expect("resumes");
        episode.built_from(build(letter));
        go_on(&mut episode, &mut directory, steps);
    }
    let record = EpisodeDir::open(&path).expect("opens").record().expect("a record");
    let commit = |made_by: &crate::made_by::MadeBy| made_by.commit[..1].to_owned();
    assert_eq!(record.made_by.as_ref().map(commit).as_deref(), Some("a"));
    let later: Vec<(usize, String)> =
        record.also_made_by.iter().map(|later| (later.from_step, commit(&later.made_by))).collect();
    assert_eq!(later, [(3, "b".to_owned())], "each other program once, and none that did nothing");
}

#[test]
fn a_tolerant_comparison_tells_equal_from_close_from_different() {
    let compare = |tolerance: f64, logged: f32, now: f32| {
        let mut comparison = Comparison::new(tolerance);
        comparison.evidence("occupancy", &[1.0, logged], &[1.0, now]);
        comparison.agreement()
    };
    assert_eq!(compare(TOLERANCE, 100.0, 100.0), Agreement::BitEqual);
    assert!(matches!(compare(TOLERANCE, 100.0, 100.0625), Agreement::Within { largest } if largest < TOLERANCE));
    assert_eq!(compare(TOLERANCE, 100.0, 100.2), Agreement::Differs);
    assert_eq!(compare(TOLERANCE, 0.5, 0.5005), Agreement::Within { largest: f64::from(0.5005_f32) - 0.5 });
    assert_eq!(compare(0.0, 100.0, 100.00001), Agreement::Differs);
    assert_eq!(compare(0.0, 0.0, -0.0), Agreement::Differs);

    let documents = |logged: Value, now: Value| {
        let mut comparison = Comparison::new(TOLERANCE);
        comparison.documents("decision", &logged, &now);
        comparison.differences.first().map(Difference::to_string)
    };
    use serde_json::json;
    assert_eq!(documents(json!({"gains": [1.0, 2.0]}), json!({"gains": [1.0, 2.001]})), None);
    // Whole numbers are names of things: there is no close.
    let view = documents(json!({"action": {"view": 1700}}), json!({"action": {"view": 1701}}));
    assert_eq!(view.as_deref(), Some("step 0: decision.action.view: 1700 in the log, 1701 now"));
    let more = documents(json!({"pair": [1]}), json!({"pair": [1, 2]}));
    assert_eq!(more.as_deref(), Some("step 0: decision.pair: 1 entries in the log, 2 now"));
    let missing = documents(json!({"a": 1, "b": null}), json!({"b": null, "c": "x"}));
    assert_eq!(missing.as_deref(), Some("step 0: decision.a: 1 in the log, null now"));
}
