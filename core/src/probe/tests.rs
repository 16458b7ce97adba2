use super::*;
use crate::belief::Classical;
use crate::episode::{Agreement, EpisodeConfig, Overwrite, replay, resume};
use crate::plan::{PlannerSettings, PolicyKind};
use crate::scene::{Object, Scene, Shelf};
use crate::skill::Push;
use std::fs;
use std::path::PathBuf;
use std::time::SystemTime;

/// A shelf with 1 cm voxels and a can that a row of boxes hides.
fn scene() -> Scene {
    let mut shelf = Shelf::new([0.80, 0.40, 0.40]);
    shelf.voxel_m = 0.01;
    let objects = [
        ("cracker_box", [-0.10, 0.20], 0.0),
        ("cracker_box", [0.08, 0.20], 0.0),
        ("tomato_can", [-0.01, 0.30], 0.0),
        ("mustard_bottle", [0.28, 0.12], 30.0),
    ];
    let objects = objects.into_iter().map(|(class, position, yaw_deg)| Object::new(class, position, yaw_deg)).collect();
    let name = "behind boxes".to_owned();
    Scene { name, description: String::new(), shelf, objects, meshes: Default::default(), robot: Default::default() }
}

/// Runs an episode to its end and files it.
fn run(path: &Path, policy: PolicyKind, budget: usize) -> Episode {
    run_steps(path, policy, budget, budget)
}

/// Runs the first steps of an episode and files them.
fn run_steps(path: &Path, policy: PolicyKind, budget: usize, steps: usize) -> Episode {
    let config = EpisodeConfig {
        policy,
        belief: "classical".to_owned(),
        seed: 5,
        budget,
        views: "standard300".to_owned(),
        planner: PlannerSettings { candidates: 6, ..PlannerSettings::default() },
        noise: None,
    };
    let mut episode = Episode::new(scene(), catalog(), config, Arc::new(Classical)).expect("an episode");
    let mut directory = EpisodeDir::create(path, Overwrite::Refuse).expect("created");
    directory.write(&mut episode).expect("written");
    for _ in 0..steps {
        episode.act(episode.decide()).expect("an action");
        directory.write(&mut episode).expect("written");
    }
    episode
}

fn catalog() -> Arc<Catalog> {
    Arc::new(Catalog::standard())
}

fn probed(path: &Path, steps: &[usize]) -> Result<(Vec<StepProbe>, Option<Difference>)> {
    let steps = steps.iter().copied().collect();
    probe(&EpisodeDir::open(path)?, catalog(), Arc::new(Classical), &steps, 0, &|| (), &mut |_| ())
}

/// Every file below a directory with its bytes and when it was written.
fn files(path: &Path) -> Vec<(PathBuf, Vec<u8>, SystemTime)> {
    let mut found = Vec::new();
    let mut folders = vec![path.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("listed") {
            let entry = entry.expect("an entry").path();
            if entry.is_dir() {
                folders.push(entry);
            } else {
                let written = fs::metadata(&entry).and_then(|data| data.modified()).expect("a time");
                found.push((entry.clone(), fs::read(&entry).expect("read"), written));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn the_push_that_was_made_does_the_same_again_and_the_episode_stays_as_it_is() {
    let dir = tempfile::tempdir().expect("tempdir");
    let path = dir.path().join("e");
    let record = run(&path, PolicyKind::RandomPush5, 6).record().clone();
    assert!(matches!(record.steps[4].action, Action::Manipulate(_)), "{:?}", record.steps[4].decision.reason);
    assert_eq!(probable_steps(&record), [(5, 1)]);
    let before = files(&path);
    let (probes, difference) = probed(&path, &[5]).expect("probed");
    assert!(files(&path) == before, "probing writes nothing");
    assert_eq!((probes.len(), difference), (1, None));
    let probe = &probes[0];
    assert_eq!((probe.step, probe.chosen, probe.made, probe.agrees), (5, Some(0), Some(0), Some(true)));
    let logged = &record.steps[4];
    let moved_m = logged.displacement_m().expect("a truth");
    assert!(moved_m > 0.01);
    assert_eq!(probe.pushes[0].displacement_m.to_bits(), moved_m.to_bits());
    let report = logged.push.as_ref().expect("a push");
    assert_eq!((probe.pushes[0].pushed_m, probe.pushes[0].jammed), (report.pushed_m, report.stalled));
}

#[test]
fn every_candidate_is_carried_out_whatever_the_number_of_threads() {
    let dir = tempfile::tempdir().expect("tempdir");
    let path = dir.path().join("e");
    let record = run(&path, PolicyKind::Mem, 5).record().clone();
    let steps: Vec<usize> = probable_steps(&record).into_iter().map(|(step, _)| step).collect();
    assert_eq!(steps[0], 4, "the first step that weighs pushes");
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| probed(&path, &steps[..1]).expect("probed").0)
    };
    let probes = on(1);
    assert_eq!(probes, on(3));
    let probe = &probes[0];
    assert_eq!((probe.pushes.len(), probe.left_out), (check_step(&path, &record, 4).expect("candidates"), 0));
    assert!(probe.pushes.len() == 6 && probe.pushes.iter().all(|push| push.promised_gain.is_some()));
    assert!(probe.pushes.iter().any(|push| push.displacement_m > 0.01 && push.opened_voxels > 0), "{probe:?}");
    let chosen = &probe.pushes[probe.chosen.expect("a best push")];
    assert_eq!(Some(chosen.candidate), record.steps[3].decision.best_push);
    assert_eq!(chosen.promised_gain, Some(record.steps[3].decision.igm));
}

#[test]
fn what_cannot_be_probed_is_told_by_step() {
    let dir = tempfile::tempdir().expect("tempdir");
    let path = dir.path().join("e");
    run_steps(&path, PolicyKind::Mem, 5, 4);
    let said = |step: usize| {
        let error = probed(&path, &[step]).expect_err("refused");
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    };
    let begins = path.display().to_string();
    assert_eq!(said(2), format!("{begins}: step 2: has no push candidates: none was weighed there"));
    assert_eq!(said(5), format!("{begins}: step 5: is not in the episode, which has steps 1 to 4"));
    assert_eq!(said(0), format!("{begins}: step 0: is not in the episode, which has steps 1 to 4"));

    let document = path.join("episode.json");
    let text = fs::read_to_string(&document).expect("read");
    fs::write(&document, text.replacen("\"tomato_can\"", "\"teapot\"", 1)).expect("written");
    let words = said(4);
    assert!(
        words.starts_with(&format!("{begins}: its scene cannot be simulated")) && words.contains("teapot"),
        "{words}"
    );
}

#[test]
fn a_world_that_stands_otherwise_is_not_probed() {
    let dir = tempfile::tempdir().expect("tempdir");
    let path = dir.path().join("e");
    run_steps(&path, PolicyKind::RandomPush5, 6, 5);
    let document = path.join("episode.json");
    let text = fs::read_to_string(&document).expect("read");
    // As if the can had stood elsewhere, with the truth that was filed.
    let moved = text.replacen("-0.01, 0.3]", "-0.01, 0.33]", 1);
    assert_ne!(moved, text, "the can's place is there");
    fs::write(&document, moved).expect("written");
    let error = probed(&path, &[5]).expect_err("refused");
    assert!(error.exit_code() == 1 && error.to_string().contains("before step 5 the objects do not stand"), "{error}");
}

#[test]
fn a_clairvoyant_episode_replays_and_resumes_bit_for_bit() {
    let dir = tempfile::tempdir().expect("tempdir");
    let (path, cut) = (dir.path().join("e"), dir.path().join("cut"));
    let record = run(&path, PolicyKind::ClairvoyantPush, 5).record().clone();
    let decision = &record.steps[3].decision;
    assert!(decision.candidates.iter().any(|candidate| candidate.gain.is_some()), "{:?}", decision.reason);
    let report = replay(&EpisodeDir::open(&path).expect("opens"), catalog(), Arc::new(Classical), &mut |_, _| ());
    assert_eq!(report.expect("replayed").agreement, Agreement::BitEqual);

    // What it held to be best is best: no candidate wins more, and of those that win as much none opens more.
    let (probes, _) = probed(&path, &[4]).expect("probed");
    let worth = |push: &ProbedPush| (push.won.len() as i64 - push.lost.len() as i64, push.opened_voxels);
    let best = &probes[0].pushes[probes[0].chosen.expect("a best push")];
    assert!(probes[0].pushes.iter().all(|push| worth(push) <= worth(best)), "{:?}", probes[0]);
    assert_ne!(probes[0].agrees, Some(false));

    // A run that ends before that step and goes on does the same.
    run_steps(&cut, PolicyKind::ClairvoyantPush, 5, 3);
    let (mut directory, mut episode) =
        resume(&cut, catalog(), Arc::new(Classical), &mut |_, _| Ok(())).expect("resumed");
    while !episode.is_finished() {
        episode.act(episode.decide()).expect("an action");
        directory.write(&mut episode).expect("written");
    }
    let timeless = |record: &EpisodeRecord| {
        let mut record = record.clone();
        record.steps.iter_mut().for_each(|step| step.seconds = Default::default());
        record.steps
    };
    assert_eq!(timeless(episode.record()), timeless(&record));
}

/// What pushes of made-up worths tell: promise, objects won and lost, litres opened.
fn made_up(rows: &[(Option<f32>, usize, usize, f64)], chosen: Option<usize>) -> StepProbe {
    let names = |count: usize| vec!["tomato_can#0".to_owned(); count];
    let push = |(at, &(gain, won, lost, litres)): (usize, &(Option<f32>, usize, usize, f64))| ProbedPush {
        candidate: at,
        manipulation: Push { start: [0.0, 0.1, 0.06], direction_deg: 90.0, length_m: 0.1 }.into(),
        promised_gain: gain,
        promised_reg: gain.map(|_| 0.0),
        opened_voxels: (litres * 8000.0) as usize,
        opened_l: litres,
        won: names(won),
        lost: names(lost),
        pushed_m: 0.1,
        jammed: at == 0,
        dropped: Vec::new(),
        toppled: Vec::new(),
        displacement_m: 0.1 * at as f64,
        grip: None,
        predicted_nats: 0.0,
        unchanged_nats: 0.0,
        completed: None,
    };
    StepProbe {
        step: 7,
        reason: Reason::LookTellsMore,
        igv: 100.0,
        hidden: names(3),
        pushes: rows.iter().enumerate().map(push).collect(),
        chosen,
        made: None,
        agrees: None,
        left_out: 0,
    }
}

#[test]
fn correlation_and_regret_of_made_up_pushes() {
    let near = |a: Option<f64>, b: f64| assert!(a.is_some_and(|a| (a - b).abs() < 1e-9), "{a:?} is not {b}");
    // The promise orders the volume as it is, and the objects the other way round.
    let rows = [(Some(10.0), 2, 0, 1.0), (Some(20.0), 1, 0, 2.0), (Some(30.0), 1, 1, 3.0), (Some(40.0), 0, 1, 4.0)];
    let summary = made_up(&rows, Some(3)).summary();
    near(summary.volume.rank_correlation, 1.0);
    near(summary.objects.rank_correlation, -1.0);
    assert_eq!((summary.objects.chosen, summary.objects.best, summary.objects.regret), (Some(-1.0), 2.0, Some(3.0)));
    assert_eq!((summary.objects.random, summary.volume.random), (0.5, 2.5));
    assert_eq!((summary.volume.chosen, summary.volume.regret), (Some(4.0), Some(0.0)));
    assert_eq!((summary.pushes, summary.hidden, summary.winning_share, summary.jammed_share), (4.0, 3.0, 0.75, 0.25));
    assert!((summary.displacement_m - 0.15).abs() < 1e-12);

    // Nothing promised, nothing chosen: no correlation and no regret; the means leave them out.
    let silent = made_up(&[(None, 1, 0, 1.0), (None, 0, 0, 3.0)], None).summary();
    assert_eq!((silent.objects.rank_correlation, silent.objects.regret, silent.volume.best), (None, None, 3.0));
    let mean = StepSummary::mean_of(&[summary, silent]);
    near(mean.volume.rank_correlation, 1.0);
    near(mean.objects.regret, 3.0);
    assert_eq!((mean.pushes, mean.objects.best, mean.volume.random), (3.0, 1.5, 2.25));
    // All worth the same: nothing is ordered.
    let same = made_up(&[(Some(1.0), 0, 0, 0.0), (Some(2.0), 0, 0, 0.0)], Some(1)).summary();
    assert_eq!((same.objects.rank_correlation, same.objects.regret), (None, Some(0.0)));
    assert_eq!(StepSummary::mean_of(&[]), StepSummary::default());
}

#[test]
fn a_completion_keeps_what_is_shown_and_stands_others_where_nobody_has_looked() {
    let dir = tempfile::tempdir().expect("tempdir");
    let episode = run(&dir.path().join("e"), PolicyKind::MemNoPush, 1);
    let bodies = episode.bodies();
    // The can behind the boxes is what nobody is to know of.
    let shown: Vec<_> = bodies.iter().filter(|body| body.id.0 != 2).cloned().collect();
    let (grid, seen) = (episode.grid(), episode.seen());
    let mut added = 0;
    for index in 0..6 {
        let world = completion::completed(&episode, &shown, &mut stream(9, "completion", index));
        let completed = world.bodies();
        for (before, after) in shown.iter().zip(&completed) {
            let moved = (before.world_from_body.translation.vector - after.world_from_body.translation.vector).norm();
            assert!(before.class == after.class && moved < 1e-3, "{index}: {moved} m");
        }
        let others = &completed[shown.len()..];
        added += others.len();
        let truth = TruthMap::of(&grid, others);
        let filled: Vec<usize> = (0..grid.voxel_count()).filter(|at| truth.occupancy[*at] == 1).collect();
        let unseen = filled.iter().filter(|at| !seen.contains(**at)).count();
        assert!(unseen as f32 >= 0.9 * filled.len() as f32, "{index}: {unseen} of {}", filled.len());
        assert!(world.deepest_overlap_m() < 2e-3);
    }
    assert!(added > 0, "there is room behind the boxes");
}

#[test]
fn completions_judge_pushes_without_knowing_what_is_hidden() {
    let dir = tempfile::tempdir().expect("tempdir");
    let path = dir.path().join("e");
    let record = run(&path, PolicyKind::Mem, 5).record().clone();
    let step = probable_steps(&record)[0].0;
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let (directory, steps) = (EpisodeDir::open(&path).expect("opens"), BTreeSet::from([step]));
        let probe = || probe(&directory, catalog(), Arc::new(Classical), &steps, 4, &|| (), &mut |_| ());
        pool.install(probe).expect("probed").0.remove(0)
    };
    let probe = on(2);
    assert_eq!(probe, on(1));
    let worths: Vec<f64> = probe.pushes.iter().filter_map(|push| push.completed).collect();
    assert_eq!(worths.len(), probe.pushes.len());
    assert!(worths.iter().all(|worth| (worth * 4.0).fract() == 0.0), "means of four whole numbers: {worths:?}");
    let summary = probe.summary();
    assert!(summary.objects_by_completions.chosen.is_some() && summary.objects_by_space.chosen.is_some());

    // Another judge, other choices: by space the last push, by completions the second.
    let mut made_up = made_up(&[(Some(9.0), 2, 0, 1.0), (Some(2.0), 1, 0, 2.0), (Some(3.0), 0, 1, 3.0)], Some(0));
    let worths = [0.25, 0.5, 0.5];
    made_up.pushes.iter_mut().zip(worths).for_each(|(push, worth)| push.completed = Some(worth));
    let summary = made_up.summary();
    assert_eq!(summary.objects.chosen, Some(2.0));
    assert_eq!(summary.objects_by_space.chosen, Some(-1.0));
    assert_eq!(summary.objects_by_completions.chosen, Some(1.0), "the first of equals");
}
