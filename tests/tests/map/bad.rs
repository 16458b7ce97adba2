//! What is wrong with a recording is told in one line, and nothing is written.

use nudge_tests::{Folder, nudge, nudge_fails, nudge_ok, text};
use std::path::Path;

/// Width and height of the images.
const SIZE: [usize; 2] = [64, 48];
/// A camera 0.5 m before the board, 0.2 m above it, that looks into the shelf.
const POSE: &str = "0 -0.4 0.2 -0.7071068 0 0 0.7071068\n";
const INTRINSICS: &str =
    r#"{ "width": 64, "height": 48, "fx": 45, "fy": 45, "cx": 31.5, "cy": 23.5, "depth_scale": 1000 }"#;

/// A depth image in metres as a NumPy array.
fn npy(values: &[f32], [width, height]: [usize; 2]) -> Vec<u8> {
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}), }}");
    let padded = (header.len() + 11).next_multiple_of(64) - 11;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((padded as u16 + 1).to_le_bytes());
    bytes.extend(format!("{header:<padded$}\n").into_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// A recording of `count` frames in the folder `r`; every pixel is half a metre away.
fn recording(count: usize) -> Folder {
    let folder = Folder::new();
    for part in ["r", "r/depth", "r/pose"] {
        std::fs::create_dir(folder.path(part)).expect("created");
    }
    folder.write("r/intrinsics.json", INTRINSICS);
    for at in 0..count {
        folder.write(&format!("r/depth/{at:03}.npy"), npy(&[0.5; 64 * 48], SIZE));
        folder.write(&format!("r/pose/{at:03}.txt"), POSE);
    }
    folder
}

fn map<'a>(recording: &'a str, out: &'a str) -> [&'a str; 6] {
    ["map", recording, "--belief", "classical", "--out", out]
}

/// Maps what must be refused before anything is written, and returns the line.
fn refused(folder: &Folder, more: &[&str]) -> String {
    let (recording, out) = (folder.name("r"), folder.name("out"));
    let line = nudge_fails(2, &[&map(&recording, &out)[..], more].concat());
    assert!(!Path::new(&out).exists(), "half-written");
    line
}

/// Maps what is sound all the same, and returns what was printed and the warnings.
fn mapped(folder: &Folder, more: &[&str]) -> (String, String) {
    let (recording, out) = (folder.name("r"), folder.name("out"));
    let output = nudge(&[&map(&recording, &out)[..], &["--force"], more].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    (text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_sound_one_is_mapped_without_a_warning() {
    let folder = recording(2);
    let (said, warned) = mapped(&folder, &[]);
    assert!(said.contains("2 of 2 frames are mapped") && !warned.contains("warning"), "{said}{warned}");
    // What is there is not replaced unless that is asked for.
    let (recording, out) = (folder.name("r"), folder.name("out"));
    assert!(nudge_fails(2, &map(&recording, &out)).contains("holds an episode"));
}

#[test]
fn an_empty_folder_and_what_is_no_recording() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("r")).expect("created");
    assert!(refused(&folder, &[]).ends_with("r: is an empty folder"));
    folder.write("r/thesis.tex", "years of work");
    assert!(refused(&folder, &[]).contains("r: is no recording: there is no depth/"));
    std::fs::create_dir(folder.path("r/depth")).expect("created");
    assert!(refused(&folder, &[]).contains("intrinsics.json"), "it is named first");
    folder.write("r/intrinsics.json", INTRINSICS);
    assert!(refused(&folder, &[]).contains("without a frame"));
    assert!(nudge_fails(2, &["map", "/nowhere/at/all"]).contains("/nowhere/at/all: no such file or directory"));
}

#[test]
fn images_of_two_sizes() {
    let folder = recording(3);
    folder.write("r/depth/001.npy", npy(&[0.5; 32 * 24], [32, 24]));
    assert!(refused(&folder, &[]).contains("depth/001.npy: 32 x 24 pixels, but its camera has 64 x 48"));
}

#[test]
fn an_image_that_is_cut_short() {
    let folder = recording(2);
    let whole = npy(&[0.5; 64 * 48], SIZE);
    folder.write("r/depth/001.npy", &whole[..whole.len() / 2]);
    assert!(refused(&folder, &[]).contains("depth/001.npy: is no whole NumPy array"));
    std::fs::remove_file(folder.path("r/depth/001.npy")).expect("removed");
    folder.write("r/depth/001.png", b"\x89PNG\r\n\x1a\n\0\0");
    assert!(refused(&folder, &[]).contains("depth/001.png: is no whole PNG"));
}

#[test]
fn depth_that_is_no_number_says_nothing_and_a_frame_without_any_is_skipped() {
    let folder = recording(2);
    let holes: Vec<f32> = (0..64 * 48).map(|at| if at % 2 == 0 { f32::NAN } else { 0.5 }).collect();
    folder.write("r/depth/000.npy", npy(&holes, SIZE));
    folder.write("r/depth/001.npy", npy(&[f32::NAN; 64 * 48], SIZE));
    let (said, _) = mapped(&folder, &["--edge-angle", "0"]);
    assert!(said.contains("50.0 %") && said.contains("skipped: no depth: no pixel has any"), "{said}");
    assert!(said.contains("1 of 2 frames are mapped; 1 skipped: no depth"), "{said}");
}

#[test]
fn frames_without_a_pose_or_an_image_are_skipped_and_the_table_says_why() {
    let folder = recording(4);
    std::fs::remove_file(folder.path("r/pose/000.txt")).expect("removed");
    folder.write("r/pose/001.txt", "-inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf\n");
    std::fs::remove_file(folder.path("r/depth/002.npy")).expect("removed");
    let (said, _) = mapped(&folder, &[]);
    for why in ["skipped: no pose\n", "skipped: no pose: the camera was lost", "skipped: no depth\n", "1 of 4 frames"] {
        assert!(said.contains(why), "{why}: {said}");
    }
    for at in 0..4 {
        folder.write(&format!("r/pose/{at:03}.txt"), "1 2 3\n");
    }
    let _ = std::fs::remove_dir_all(folder.path("out"));
    let line = refused(&folder, &[]);
    assert!(
        line.contains("none of its 4 frames can be mapped (no pose: 3 numbers where 16, 12 or 7 are needed)"),
        "{line}"
    );
}

#[test]
fn millimetres_that_are_said_to_be_metres_and_no_overlap_with_the_board() {
    let folder = recording(1);
    folder.write("r/depth/000.npy", npy(&[500.0; 64 * 48], SIZE));
    let line = refused(&folder, &[]);
    assert!(line.contains("shows anything of the shelf of 0.8 x 0.4 x 0.4 m"), "{line}");
    assert!(line.contains("farther away than 500.000 m; are these millimetres? --depth-unit 0.001 says so"), "{line}");
    mapped(&folder, &["--depth-unit", "0.001"]);
    std::fs::remove_dir_all(folder.path("out")).expect("removed");
    let folder = recording(1);
    let board = folder
        .write("far.toml", "format = 1\nsize = [0.8, 0.4, 0.4]\nposition = [5, 5, 0]\nquaternion = [0, 0, 0, 1]\n");
    let line = refused(&folder, &["--board", &board]);
    assert!(line.contains("shows anything of the shelf") && line.contains("--find-board finds it"), "{line}");
    assert!(!line.contains("millimetres"), "{line}");
    let board =
        folder.write("huge.toml", "format = 1\nsize = [80, 40, 40]\nposition = [0, 0, 0]\nquaternion = [0, 0, 0, 1]\n");
    assert!(refused(&folder, &["--board", &board]).contains("huge.toml: shelf size 80 m: "));
}

#[test]
fn a_camera_that_jumps_is_a_warning() {
    let folder = recording(12);
    for at in 0..12 {
        let x = if at < 6 { 0.01 * at as f32 } else { 0.5 + 0.01 * at as f32 };
        folder.write(&format!("r/pose/{at:03}.txt"), POSE.replacen("0 ", &format!("{} ", x - 0.3), 1));
    }
    let (_, warned) = mapped(&folder, &[]);
    assert!(warned.contains("the camera jumps by 0.51 m between frames 005 and 006: are the poses right?"), "{warned}");
}

#[test]
fn labels_that_are_no_classes() {
    let folder = recording(1);
    std::fs::create_dir(folder.path("r/label")).expect("created");
    let header = npy(&[], SIZE);
    let header = text(&header[10..]).replace("<f4", "|u1");
    let mut bytes = npy(&[], SIZE)[..10].to_vec();
    bytes.extend(header.bytes());
    let mut labels = vec![14_u8; 64 * 48];
    labels[64 * 7 + 5] = 40;
    bytes.extend(labels);
    folder.write("r/label/000.npy", bytes);
    let line = refused(&folder, &[]);
    assert!(line.contains("label/000.npy: row 7, column 5: 40 is no class of the catalogue"), "{line}");
    let map = folder.write("labels.toml", "format = 1\n[classes]\n14 = \"background\"\n");
    mapped(&folder, &["--labels", &map]);
}

#[test]
fn what_cannot_be_asked_of_a_recording() {
    let folder = recording(2);
    assert!(refused(&folder, &["--policy", "mem"]).contains("policy mem moves things or asks for the truth"));
    assert!(refused(&folder, &["--budget", "9"]).contains("--budget 9: the recording has 2 frames to map"));
    assert!(refused(&folder, &["--every", "0"]).contains("--every 0"));
    assert!(refused(&folder, &["--edge-angle", "90"]).contains("--edge-angle 90: must be from 0 to 45"));
    assert!(refused(&folder, &["--depth-unit", "0"]).contains("must be a number above 0"));
    let board = folder.write("board.toml", "format = 1\nsize = [0.8, 0.4]\n");
    assert!(refused(&folder, &["--board", &board]).contains("board.toml: line 2: 2 numbers where 3 are needed"));
    assert!(nudge_ok(&["map", "--help"]).contains("--find-board"));
}
