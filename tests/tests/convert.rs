//! Maps of other programs as episodes, and beliefs as maps of other programs. `tests/python/octomap_maps.py` wrote the trees in
//! `tests/maps` with OctoMap itself.

use nudge_core::belief::{Belief, log_odds};
use nudge_core::episode::{EpisodeDir, review};
use nudge_core::foreign::{read_map, write_map};
use nudge_core::recording::Board;
use nudge_core::scene::Catalog;
use nudge_tests::{Folder, TIN, argument, nudge, nudge_fails, nudge_ok, root, small_scene, text, venv_tool};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

const BOARD: &str =
    "format = 1\nsize = [0.2, 0.1, 0.1]\nposition = [0.0, 0.0, 0.0]\nquaternion = [0.0, 0.0, 0.0, 1.0]\n";

fn map(name: &str) -> String {
    argument(&root().join("tests/maps").join(name))
}

fn last(out: &Path) -> (usize, Belief) {
    let directory = EpisodeDir::open(out).expect("opens");
    let steps = directory.record().expect("a record").steps.len();
    (steps, directory.read_belief(steps).expect("a belief"))
}

/// 1 for occupied, -1 for free, 0 for neither.
fn signs(belief: &Belief) -> Vec<i64> {
    belief.occupancy.iter().map(|a| i64::from(a[0] > a[1]) - i64::from(a[0] < a[1])).collect()
}

/// What OctoMap was told of a voxel of the shelf, as `octomap_maps.py` tells it.
fn told(belief: &Belief, index: usize) -> i64 {
    let at = belief.grid.center(belief.grid.voxel(index));
    let inside = at.x.abs() < 0.02 && (0.02..0.06).contains(&at.y) && at.z < 0.05;
    let unknown = at.z > 0.08 || (at.x.abs() < 0.02 && at.y > 0.06);
    if unknown { 0 } else { 2 * i64::from(inside) - 1 }
}

fn all_told(belief: &Belief) -> Vec<i64> {
    (0..belief.grid.voxel_count()).map(|index| told(belief, index)).collect()
}

#[test]
fn trees_that_octomap_wrote_are_what_octomap_was_told() {
    let folder = Folder::new();
    let board = folder.write("board.toml", BOARD);
    for (name, [free, occupied]) in [("box.bt", [-2.0, 3.5]), ("box.ot", [2.0 * -0.405_465, 3.0 * 0.847_298])] {
        let out = folder.path(name).with_extension("out");
        let said = nudge(&["convert", &map(name), &argument(&out), "--board", &board, "--force"]);
        assert!(said.status.success(), "{}", text(&said.stderr));
        assert!(text(&said.stderr).contains("it knows 73.6 % of the shelf"), "{}", text(&said.stderr));
        let (steps, belief) = last(&out);
        assert_eq!((steps, signs(&belief)), (1, all_told(&belief)));
        let at = |sign: i64| signs(&belief).iter().position(|other| *other == sign).expect("there is one");
        let near = |sign: i64, expected: f32| (log_odds(belief.occupancy[at(sign)]) - expected).abs() < 5e-3;
        assert!(near(-1, free) && near(1, occupied), "{name}");
    }
    let out = folder.name("coarse");
    let said = nudge(&["convert", &map("coarse.bt"), &out, "--board", &board]);
    assert!(text(&said.stderr).contains("its voxels of 0.01 m are resampled to 0.005 m"), "{}", text(&said.stderr));
    let (_, belief) = last(Path::new(&out));
    assert_eq!(signs(&belief), all_told(&belief));
}

#[test]
fn octomap_reads_what_is_written() {
    let Some(python) = venv_tool("python") else { return };
    if !Command::new(&python).args(["-c", "import pyoctomap"]).output().expect("python starts").status.success() {
        eprintln!("not checked: this Python has no pyoctomap, so nobody but Nudge read its trees");
        return;
    }
    let folder = Folder::new();
    let board = folder.write("board.toml", BOARD);
    for name in ["box.ot", "box.bt"] {
        let to = folder.name("written.bt");
        nudge_ok(&["convert", &map(name), &to, "--board", &board]);
        let script = root().join("tests/python/octomap_maps.py");
        let read = Command::new(&python).arg(script).args(["read", &to]).output().expect("python starts");
        assert!(read.status.success(), "{}", text(&read.stderr));
        let found: Value = serde_json::from_slice(&read.stdout).expect("JSON");
        let board = Board::read(&folder.path("board.toml")).expect("a board");
        let belief = Belief::uniform(board.shelf.grid());
        let voxels: Vec<i64> = serde_json::from_value(found["voxels"].clone()).expect("numbers");
        assert_eq!(voxels, all_told(&belief));
        let written = std::fs::read(&to).expect("a tree");
        let head = text(&written[..200.min(written.len())]);
        assert!(head.contains(&format!("size {}\n", found["nodes"])), "{head} {}", found["nodes"]);
        assert!((found["resolution"].as_f64().expect("metres") - 0.005).abs() < 1e-9);
    }
}

/// An episode of a small shelf of four looks, and its scene.
fn episode(folder: &Folder) -> (String, PathBuf) {
    let scene = folder.write("small.toml", small_scene(TIN));
    let out = folder.path("run");
    nudge_ok(&["run", &scene, "--policy", "random", "--budget", "4", "--out", &argument(&out)]);
    (scene, out)
}

#[test]
fn a_belief_goes_out_and_comes_back_and_is_scored_against_its_scene() {
    let folder = Folder::new();
    let (scene, out) = episode(&folder);
    let run = argument(&out);
    let (_, belief) = last(&out);
    let scores = |out: &str| -> Value {
        let text = std::fs::read_to_string(Path::new(out).join("episode.json")).expect("a document");
        let record: Value = serde_json::from_str(&text).expect("JSON");
        record["steps"].as_array().expect("steps").last().expect("a step")["scores"].clone()
    };
    let iou = |out: &str, which: &str| scores(out)[which].as_f64().expect("a score");
    for (name, score) in [("last.npz", "semantic_miou"), ("last.bt", "occupancy_iou"), ("last.ply", "occupied_iou")] {
        let file = folder.name(name);
        assert!(nudge_ok(&["convert", &run, &file]).contains("the belief after 4 of 4 steps"));
        let back = folder.name(&format!("{name}-back"));
        let said = nudge_ok(&["convert", &file, &back, "--scene", &scene]);
        assert!(said.contains("occupancy IoU") && said.contains("an episode of 1 step\n"), "{said}");
        let (one, other) = (iou(&back, score), iou(&run, score));
        assert!((one - other).abs() < 2e-3, "{name}: {score} {one}, and {other} before");
    }
    let (_, back) = last(&folder.path("last.npz-back"));
    assert!(back == belief, "nothing is lost");

    // An earlier step is another belief; the prior is told.
    nudge_ok(&["convert", &run, &folder.name("prior.npz"), "--step", "0"]);
    let prior = read_map(&folder.path("prior.npz")).expect("reads");
    let board = Board { shelf: prior.shelf().expect("told"), ..Board::default() };
    assert_eq!(prior.belief(&board).expect("fits").belief, Belief::uniform(belief.grid));
    assert!(nudge_fails(2, &["convert", &run, &folder.name("a.npz"), "--step", "5"]).contains("has 4 steps"));
    assert!(nudge_fails(2, &["convert", &run, &folder.name("a.ot")]).contains("written as .bt, .ply or .npz"));
}

/// The states of an episode as the window opens it, which has no update for it.
fn states(out: &Path) -> Vec<Belief> {
    let mut states = Vec::new();
    let mut watch = |episode: &nudge_core::episode::Episode, _: Option<&nudge_core::episode::StepOutcome>| {
        states.push(episode.belief().clone());
        Ok(())
    };
    review(out, Arc::new(Catalog::standard()), None, &mut watch).expect("opens");
    states
}

#[test]
fn a_folder_of_beliefs_becomes_an_episode_that_opens_like_any_other() {
    let folder = Folder::new();
    let (scene, out) = episode(&folder);
    let beliefs = argument(&out.join("beliefs"));
    // The beliefs of an episode do not tell their voxels; its scene does.
    let told = folder.name("told");
    let said = nudge_ok(&["convert", &beliefs, &told, "--scene", &scene]);
    assert!(said.contains("an episode of 5 steps"), "{said}");
    let of_run: Vec<Belief> = states(&out);
    let converted = states(Path::new(&told));
    assert_eq!(converted.len(), 6, "a prior, and five beliefs of which the first is one too");
    assert!(converted[1..] == of_run[..], "as they are filed");

    // Without a scene there is no truth, and nothing but the beliefs.
    std::fs::create_dir(folder.path("maps")).expect("created");
    for (at, belief) in of_run.iter().enumerate() {
        write_map(&folder.path(&format!("maps/{at}.npz")), belief).expect("written");
    }
    let blind = folder.name("blind");
    let said = nudge_ok(&["convert", &folder.name("maps"), &blind]);
    assert!(!said.contains("IoU") && said.contains("an episode of 5 steps"), "{said}");
    assert!(states(Path::new(&blind))[1..] == of_run[..]);
    assert!(folder.path("blind/summary.png").is_file() && folder.path("blind/episode.rrd").is_file());
    let line = nudge_fails(2, &["replay", &blind]);
    assert!(line.contains("the belief converted is not there: its beliefs were converted from files"), "{line}");
    // A folder is no single map, and what is there is kept unless told.
    assert!(nudge_fails(2, &["convert", &beliefs, &folder.name("a.bt"), "--scene", &scene]).contains("not one file"));
    assert!(nudge_fails(2, &["convert", &folder.name("maps"), &blind]).contains("holds an episode"));
    nudge_ok(&["convert", &folder.name("maps"), &blind, "--force"]);
}

#[test]
fn what_cannot_be_converted_is_told_in_one_line_and_nothing_is_written() {
    let folder = Folder::new();
    let scene = folder.write("small.toml", small_scene(TIN));
    let bt = std::fs::read(root().join("tests/maps/box.bt")).expect("a tree");
    let cut = folder.write("cut.bt", &bt[..bt.len() - 3]);
    let magic = folder.write("magic.bt", [b"# Octomap OcTree binary life", &bt[28..]].concat());
    let far = folder.write("far.toml", BOARD.replace("position = [0.0", "position = [50.0"));
    let cloud = folder.write(
        "nan.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\nnan 0 0\n",
    );
    std::fs::create_dir(folder.path("empty")).expect("created");
    let out = folder.name("out");
    for (args, words) in [
        (vec![&cut], "cut.bt: byte "),
        (vec![&magic], "magic.bt: header: does not begin with \"# Octomap OcTree binary file\""),
        (vec![&cloud], "nan.ply: nothing of it lies in the board's box of 0.8 x 0.4 x 0.4 m"),
        (vec![&folder.name("empty")], "empty: holds neither an episode nor .npz beliefs"),
        (vec![&folder.name("gone.bt")], "gone.bt: No such file or directory"),
        (vec![&scene], "small.toml: is no map that can be read"),
        (vec![&map("box.bt"), &"--board".to_owned(), &far], "box.bt: nothing of it lies in the board's box of 0.2"),
        (vec![&map("box.bt"), &"--step".to_owned(), &"1".to_owned()], "--step: only an episode has steps"),
    ] {
        let args: Vec<&str> = args.into_iter().map(String::as_str).collect();
        let line = nudge_fails(2, &[&["convert", args[0], &out], &args[1..]].concat());
        assert!(line.contains(words), "{line}");
        assert!(!folder.path("out").exists(), "half-written");
    }
}
