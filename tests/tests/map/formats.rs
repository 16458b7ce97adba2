//! Every format gives the beliefs of the episode whose frames it holds.

use super::written::{FRAMES, Written, beliefs};
use nudge_core::belief::Belief;
use nudge_core::episode::EpisodeDir;
use nudge_core::plan::Action;
use nudge_tests::nudge_ok;

pub fn bits(belief: &Belief) -> Vec<u32> {
    let both = belief.occupancy.as_flattened().iter().chain(belief.semantics.as_flattened());
    both.map(|number| number.to_bits()).collect()
}

/// What was mapped from a recording is what is expected, bit for bit.
pub fn same(written: &Written, name: &str, expected: &[Belief]) {
    let found = written.mapped(name);
    assert_eq!(found.len(), FRAMES + 1);
    for (step, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!(bits(found) == bits(expected), "{name}: belief {step} differs");
    }
}

/// Share of voxels that both believe to be occupied, or both not to be.
fn agreement(a: &Belief, b: &Belief) -> f64 {
    let occupied = |belief: &Belief, at: usize| belief.occupancy[at][0] > belief.occupancy[at][1];
    let same = (0..a.occupancy.len()).filter(|at| occupied(a, *at) == occupied(b, *at)).count();
    same as f64 / a.occupancy.len() as f64
}

#[test]
fn what_a_simulator_wrote_reads_back_to_the_same_beliefs() {
    let Some(written) = Written::new() else { return };
    let original = beliefs(&written.episode);
    // Labels of BOP are numbers of objects; here those of the classes, counted from 1.
    let classes = ["chips_can", "tomato_can", "coffee_can", "gum_tin", "cleaner_bottle", "cracker_box", "gelatin_box"];
    let classes = classes.iter().chain(&["mustard_bottle"]).enumerate();
    let map: String = classes.map(|(at, class)| format!("{} = \"{class}\"\n", at + 1)).collect();
    written.folder.write("labels.toml", format!("format = 1\n[classes]\n15 = \"background\"\n{map}"));
    let labels = written.folder.name("labels.toml");
    for name in ["npy", "npy-10000", "npy-5000", "npy-1000-matrix", "png", "tum", "nerf"] {
        let said = written.map(name, &[]);
        assert!(said.contains(&format!("{FRAMES} of {FRAMES} frames are mapped")), "{said}");
    }
    written.map("bop", &["--labels", &labels]);
    // What loses nothing gives the episode's own beliefs, and what loses digits those of the same digits.
    let pairs = [("png", "npy-10000"), ("tum", "npy-5000"), ("nerf", "npy-1000-matrix")];
    same(&written, "npy", &original);
    pairs.into_iter().for_each(|(name, like)| same(&written, name, &written.mapped(like)));
    for name in ["png", "tum", "nerf", "bop"] {
        let found = written.mapped(name);
        assert!(bits(&found[FRAMES]) != bits(&original[0]), "{name}: nothing was mapped");
        let share = agreement(&found[FRAMES], &original[FRAMES]);
        assert!(share > 0.995, "{name}: {share} of the voxels agree");
    }
    let (bop, like) = (written.mapped("bop"), written.mapped("npy-1000-matrix"));
    assert!(agreement(&bop[FRAMES], &like[FRAMES]) > 0.999);
    let of_class = |belief: &Belief| belief.semantics.iter().map(|alpha| alpha[1]).sum::<f32>();
    assert!((of_class(&bop[FRAMES]) / of_class(&like[FRAMES]) - 1.0).abs() < 0.02, "labels of masks");

    // It opens as an episode without truth, and is inferred again.
    let out = written.folder.name("npy-map");
    assert!(nudge_ok(&["replay", "--infer", &out]).contains("bit for bit"));
    let record = EpisodeDir::open(&out).expect("opens").record().expect("a record");
    assert!(!record.has_truth() && record.recorded_views.as_ref().is_some_and(|views| views.views.len() == FRAMES));
    assert!(
        written.folder.path("npy-map/board.toml").is_file() && written.folder.path("npy-map/summary.png").is_file()
    );
}

#[test]
fn a_policy_chooses_among_the_recorded_poses_and_takes_each_once() {
    let Some(written) = Written::new() else { return };
    let looks = |more: &[&str]| -> Vec<u16> {
        written.map("npy", &[&["--force"][..], more].concat());
        let record = EpisodeDir::open(written.folder.path("npy-map")).expect("opens").record().expect("a record");
        let look = |action: Action| if let Action::Look { view } = action { view.0 } else { panic!("{action:?}") };
        record.steps.iter().map(|step| look(step.action)).collect()
    };
    assert_eq!(looks(&[]), [0, 1, 2, 3, 4], "the recording's order");
    let mut chosen = looks(&["--policy", "mem-no-push"]);
    let best = EpisodeDir::open(written.folder.path("npy-map")).expect("opens").record().expect("a record");
    let gains = &best.steps[0].decision.gains;
    assert_eq!(gains.len(), FRAMES);
    assert!(gains.iter().all(|gain| *gain > 0.0));
    chosen.sort_unstable();
    assert_eq!(chosen, [0, 1, 2, 3, 4]);
    assert_eq!(looks(&["--policy", "mem-no-push", "--budget", "2"]).len(), 2);
    assert_eq!(looks(&["--every", "2"]), [0, 1, 2], "three frames are left");
}

#[test]
fn the_board_is_found_where_it_is() {
    let Some(written) = Written::new() else { return };
    let recording = written.folder.name("npy");
    let out = written.folder.name("found");
    let said = nudge_ok(&["map", &recording, "--find-board", "--belief", "classical", "--out", &out]);
    let file = std::fs::read_to_string(written.folder.path("found/board.toml")).expect("a board");
    let numbers = |key: &str| -> Vec<f32> {
        let line = file.lines().find_map(|line| line.strip_prefix(&format!("{key} = ["))).expect(key);
        line.trim_end_matches(']').split(", ").map(|number| number.parse().expect("a number")).collect()
    };
    let (size, position, quaternion) = (numbers("size"), numbers("position"), numbers("quaternion"));
    let near = |found: f32, expected: f32, within: f32| assert!((found - expected).abs() < within, "{said}\n{file}");
    near(size[0], 0.4, 0.025);
    near(size[1], 0.3, 0.025);
    near(position[0], 0.0, 0.015);
    near(position[1], 0.0, 0.015);
    near(position[2], 0.0, 0.002);
    // Half the angle's sine: within two degrees about z, and half of one about the others.
    near(quaternion[2], 0.0, 0.0175);
    near(quaternion[0], 0.0, 0.005);
    near(quaternion[1], 0.0, 0.005);
}

#[test]
fn without_labels_only_occupancy_is_mapped_and_that_is_said() {
    let Some(written) = Written::new() else { return };
    std::fs::remove_dir_all(written.folder.path("npy/label")).expect("removed");
    let said = written.map("npy", &[]);
    assert!(said.contains("no labels: only occupancy is mapped"), "{said}");
    let directory = EpisodeDir::open(written.folder.path("npy-map")).expect("opens");
    let record = directory.record().expect("a record");
    assert!(record.scene.description.contains("no labels: only occupancy is mapped"), "{}", record.scene.description);
    let (prior, last) = (directory.read_belief(0).expect("there"), directory.read_belief(FRAMES).expect("there"));
    assert!(prior.semantics == last.semantics && prior.occupancy != last.occupancy);
    let original = beliefs(&written.episode);
    assert!(agreement(&last, &original[FRAMES]) > 0.97, "{}", agreement(&last, &original[FRAMES]));
}
