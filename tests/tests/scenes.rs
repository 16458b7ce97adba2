//! Scenes, views and meshes from the command line.

use nudge_tests::{nudge_fails, nudge_ok, root};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn toml_files(folder: &Path) -> Vec<String> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("folder").map(|entry| entry.expect("entry").path()).collect();
    files.retain(|file| file.extension().is_some_and(|ext| ext == "toml"));
    files.sort();
    files.iter().map(|file| file.to_str().expect("utf-8").to_owned()).collect()
}

#[test]
fn shipped_scenes_pass_their_check_and_the_hard_ones_hide_objects() {
    for (folder, at_least) in [("scenes/demo", 0), ("scenes/high", 4)] {
        let files = toml_files(&root().join(folder));
        assert!(files.len() >= 2, "{folder} is empty");
        let mut args = vec!["scene", "check", "--json"];
        args.extend(files.iter().map(String::as_str));
        let report: Value = serde_json::from_str(&nudge_ok(&args)).expect("JSON");
        for scene in report["scenes"].as_array().expect("one entry per file") {
            let hidden = scene["hidden"].as_array().expect("hidden").len();
            assert!(hidden >= at_least, "{}: {hidden} objects are hidden", scene["file"]);
            let without = scene["without_hidden"]["semantic_miou"].as_f64().expect("a score");
            assert_eq!(without < 1.0, hidden > 0, "{}: mIoU {without} without what is hidden", scene["file"]);
        }
    }
}

#[test]
fn generated_scenes_are_the_same_for_a_seed_and_pass_their_check() {
    let dir = tempfile::tempdir().expect("tempdir");
    let of = |name: &str, seed: &str| {
        let out = dir.path().join(name);
        let out = out.to_str().expect("utf-8");
        nudge_ok(&["scene", "generate", "--count", "4", "--fill", "0.4", "--seed", seed, "--out", out]);
        toml_files(Path::new(out))
    };
    let (a, b, c) = (of("a", "3"), of("b", "3"), of("c", "4"));
    assert_eq!(a.len(), 4);
    let content =
        |files: &[String]| files.iter().map(|f| std::fs::read_to_string(f).expect("read")).collect::<Vec<_>>();
    assert_eq!(content(&a), content(&b));
    assert_ne!(content(&a), content(&c));
    let mut args = vec!["scene", "check"];
    args.extend(a.iter().map(String::as_str));
    nudge_ok(&args);
    let first = Path::new(&a[0]).parent().expect("folder").to_str().expect("utf-8");
    let line = nudge_fails(2, &["scene", "generate", "--count", "4", "--seed", "9", "--out", first]);
    assert!(line.contains("--force"), "{line}");
}

#[test]
fn new_scene_opens_and_has_a_thumbnail() {
    let dir = tempfile::tempdir().expect("tempdir");
    let file = dir.path().join("mine.toml");
    let file = file.to_str().expect("utf-8");
    nudge_ok(&["scene", "new", "mine", "--out", file]);
    nudge_ok(&["scene", "check", file]);
    nudge_fails(2, &["scene", "new", "mine", "--out", file]);
    let png = dir.path().join("mine.png");
    nudge_ok(&["scene", "thumbnail", file, "--out", png.to_str().expect("utf-8")]);
    assert!(png.metadata().expect("png").len() > 2_000);
}

#[test]
fn the_standard_array_has_the_poses_of_the_design() {
    let array: Value = serde_json::from_str(&nudge_ok(&["views", "--json"])).expect("JSON");
    let views = array["views"].as_array().expect("views");
    assert_eq!(views.len(), 300);
    let at = |view: &Value, row: usize| view["world_from_camera"][row][3].as_f64().expect("number");
    let (mut deepest, mut nearest) = (0.0_f64, -1.0_f64);
    for view in views {
        assert!(at(view, 0).abs() <= 0.3376 && (0.0549..=0.2551).contains(&at(view, 2)), "{view}");
        deepest = deepest.min(at(view, 1));
        nearest = nearest.max(at(view, 1));
        // The third column is the viewing direction: towards the target.
        let target = view["target"].as_array().expect("target");
        let towards: Vec<f64> = (0..3).map(|axis| target[axis].as_f64().expect("number") - at(view, axis)).collect();
        let length = towards.iter().map(|d| d * d).sum::<f64>().sqrt();
        for axis in 0..3 {
            let axis_z = view["world_from_camera"][axis][2].as_f64().expect("number");
            assert!((axis_z - towards[axis] / length).abs() < 1e-4);
        }
    }
    assert!((nearest + 0.20).abs() < 1e-4 && (-0.30..-0.29).contains(&deepest));
    let real: Value = serde_json::from_str(&nudge_ok(&["views", "--array", "real75", "--json"])).expect("JSON");
    assert_eq!(real["views"].as_array().map(Vec::len), Some(75));
}

#[test]
fn scanned_meshes_come_in_with_their_size() {
    let ycb = root().join("../shared/ycb");
    if !ycb.exists() {
        eprintln!("skipped: no scanned meshes beside the checkout");
        return;
    }
    let mesh = ycb.join("tomato_can.obj");
    let report: Value =
        serde_json::from_str(&nudge_ok(&["mesh", mesh.to_str().expect("utf-8"), "--json"])).expect("JSON");
    let size: Vec<f64> =
        report["size_m"].as_array().expect("size").iter().map(|v| v.as_f64().expect("number")).collect();
    assert!((0.06..0.075).contains(&size[0]) && (0.09..0.11).contains(&size[2]), "{size:?}");
    let scene = ycb.join("shelf.toml");
    nudge_ok(&["scene", "check", scene.to_str().expect("utf-8")]);
}
