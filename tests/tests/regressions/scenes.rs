//! Scenes and view arrays.

use super::{Folder, TIN, small_scene};
use nudge_tests::{nudge, nudge_fails, nudge_ok, text};
use serde_json::Value;

#[test]
fn a_third_number_of_a_position_was_dropped_in_silence() {
    let folder = Folder::new();
    let refused = |text: &str| nudge_fails(2, &["scene", "check", &folder.write("s.toml", text)]);
    let scene = small_scene(TIN);
    let line = refused(&scene.replace("[0.0, 0.1]", "[0.0, 0.1, 0.15]"));
    assert!(line.contains("line 8, object 1 (tomato_can): 3 numbers where 2 are needed"), "{line}");
    let line = refused(&scene.replace("[0.0, 0.1]", "[0,0, 0,1]"));
    assert!(line.contains("4 numbers where 2 are needed") && line.contains("decimal mark is a point"), "{line}");
    let line = refused(&scene.replace("0.2, 0.2]", "0.2, 0.2, 0.2]"));
    assert!(line.contains("line 4: 4 numbers where 3 are needed"), "{line}");
    assert!(refused(&format!("{scene}scale = [1, 1, 1, 1]\n")).contains("4 numbers where 3"));
    assert!(refused(&format!("{scene}[robot]\nbase = [0, -0.7, 0, 0]\n")).contains("4 numbers where 3"));
}

/// A view array of two views and images of this size.
fn views([width, height]: [usize; 2]) -> String {
    format!(
        "format = 1\nname = \"tiny\"\n\
         camera = {{ width = {width}, height = {height}, focal_px = 100.0, depth_range_m = [0.07, 1.5] }}\n\
         layout = [2, 1, 1]\nviews = [\n\
         \x20 {{ position = [0.0, -0.4, 0.3], target = [0.0, 0.1, 0.05], slot = [0, 0, 0] }},\n\
         \x20 {{ position = [0.1, -0.4, 0.3], target = [0.0, 0.1, 0.05], slot = [1, 0, 0] }},\n]\n"
    )
}

#[test]
fn numbers_too_many_in_a_view_array_were_dropped_in_silence() {
    let folder = Folder::new();
    let array = views([64, 48]);
    for (from, to) in [
        ("[0.07, 1.5]", "[0.07, 1.5, 2.0]"),
        ("[2, 1, 1]", "[2, 1, 1, 1]"),
        ("[0.0, -0.4, 0.3]", "[0.0, -0.4, 0.3, 1.0]"),
        ("[0.0, 0.1, 0.05]", "[0.0, 0.1, 0.05, 1.0]"),
        ("slot = [0, 0, 0]", "slot = [0, 0, 0, 0]"),
    ] {
        let line = nudge_fails(2, &["views", "--array", &folder.write("views.toml", array.replacen(from, to, 1))]);
        assert!(line.contains("views.toml: line ") && line.contains(" are needed"), "{to}: {line}");
    }
}

#[test]
fn an_image_of_one_pixel_made_the_recording_panic() {
    let folder = Folder::new();
    let scene = folder.write("s.toml", small_scene(TIN));
    for size in [[1, 1], [3, 1]] {
        let array = folder.write("views.toml", views(size));
        let out = folder.name(&format!("{}x{}", size[0], size[1]));
        let args = ["run", &scene, "--belief", "classical", "--budget", "2", "--views", &array, "--out", &out];
        let output = nudge(&args);
        assert!(output.status.success(), "{size:?}: {}", text(&output.stderr));
        nudge_ok(&["replay", &out]);
    }
}

#[test]
fn objects_thinner_than_a_voxel_had_no_verdict_and_one_was_hallucinated() {
    let folder = Folder::new();
    // Voxels of 10 mm; the first two stand between two rows of their centres.
    let thin = small_scene(
        "[[object]]\nclass = \"gelatin_box\"\nposition = [0.0, 0.06]\nyaw_deg = 90\nscale = [1, 0.2, 1]\n\
         [[object]]\nclass = \"gelatin_box\"\nposition = [0.08, 0.1]\nscale = [1, 0.2, 1]\n\
         [[object]]\nclass = \"tomato_can\"\nposition = [-0.08, 0.12]\nscale = [1, 1, 0.05]\n",
    );
    let scene = folder.write("thin.toml", thin);
    let warned = text(&nudge(&["scene", "check", &scene]).stderr);
    let told = "object 1 (gelatin_box, line 6) is 5.6 mm thick, less than a voxel (10.0 mm)";
    assert!(warned.contains(told), "{told:?} is not in: {warned}");
    assert!(warned.contains("object 2") && warned.contains("object 3 (tomato_can"), "{warned}");
    let args = ["run", &scene, "--belief", "classical", "--policy", "mem-no-push", "--budget", "4", "--json"];
    let record: Value =
        serde_json::from_str(&nudge_ok(&[&args[..], &["--out", &folder.name("e")]].concat())).expect("JSON");
    let last = record["steps"].as_array().and_then(|steps| steps.last()).expect("a step");
    let verdicts = last["objects"].as_array().expect("verdicts");
    let judged: Vec<u64> = verdicts.iter().filter_map(|verdict| verdict["object"].as_u64()).collect();
    assert_eq!(judged, [0, 1, 2], "{verdicts:?}");
    assert!(verdicts.iter().all(|verdict| verdict["verdict"] != "hallucinated"), "{verdicts:?}");
}
