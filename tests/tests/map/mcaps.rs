//! MCAP files of ROS 2, written by two libraries that others wrote.

use super::formats::{bits, same};
use super::written::{FRAMES, Written, beliefs};
use nudge_tests::{nudge_fails, nudge_ok};

#[test]
fn what_two_libraries_wrote_reads_back_to_the_same_beliefs() {
    let Some(written) = Written::mcaps() else { return };
    let original = beliefs(&written.episode);
    written.map("npy-1000", &[]);
    let millimetres = written.mapped("npy-1000");
    for (name, expected) in [
        ("tf-zstd.mcap", &original),
        ("rosbags.mcap", &original),
        ("png-lz4.mcap", &millimetres),
        ("rvl-none.mcap", &millimetres),
    ] {
        let said = written.map(name, &[]);
        assert!(said.contains(&format!("MCAP ({FRAMES} frames)")) && !said.contains("no labels"), "{said}");
        same(&written, name, expected);
    }
    assert!(bits(&millimetres[FRAMES]) != bits(&original[FRAMES]), "millimetres lose digits");
}

#[test]
fn a_camera_in_a_hand_is_where_the_chain_of_frames_says() {
    let Some(written) = Written::mcaps() else { return };
    let original = beliefs(&written.episode);
    let line = nudge_fails(2, &["map", &written.folder.name("chain.mcap"), "--frames-only"]);
    assert!(line.contains("chain.mcap: has no poses: nothing in /tf holds frame `camera_optical`"), "{line}");
    let topics = "format = 1\ndepth = \"/camera/depth\"\ninfo = \"/camera/camera_info\"\nlabels = \"/labels\"\n\
                  fixed_frame = \"board\"\ncamera_frame = \"camera_body\"\naxes = \"body\"\n";
    let topics = written.folder.write("topics.toml", topics);
    written.map("chain.mcap", &["--topics", &topics]);
    let found = written.mapped("chain.mcap");
    let differ = bits(&found[FRAMES]).iter().zip(bits(&original[FRAMES])).filter(|(a, b)| **a != *b).count();
    let share = differ as f64 / bits(&original[FRAMES]).len() as f64;
    assert!(share < 0.002, "{share} of the numbers differ: more than rounding explains");
}

#[test]
fn a_camera_in_a_hand_is_where_the_joints_of_the_arm_say() {
    let Some(written) = Written::mcaps() else { return };
    let topics = |robot: &str| {
        format!(
            "format = 1\ndepth = \"/camera/depth\"\ninfo = \"/camera/camera_info\"\nlabels = \"/labels\"\n\
             joints = \"/joint_states\"\nrobot = \"{robot}\"\n"
        )
    };
    // How much of each frame shows the shelf tells where it was taken from. The first one looks past the shelf.
    let shown = |said: &str| -> Vec<String> {
        let frames = said.lines().filter(|line| ["001", "002", "003", "004"].iter().any(|at| line.starts_with(at)));
        frames.map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
    };
    let by_pose = shown(&written.map("rosbags.mcap", &[]));
    assert!(by_pose.len() == 4 && by_pose.iter().all(|line| line.ends_with(" %")), "{by_pose:?}");
    // The recording's frame is the arm's base, 70 cm before the shelf and 15 mm under its board.
    written.folder.write("board.toml", super::written::BOARD.replace("[0, 0, 0]\n", "[0, 0.70, 0.015]\n"));
    std::fs::remove_dir_all(written.folder.path("rosbags.mcap-map")).expect("removed");
    let file = written.folder.write("topics.toml", topics("gripper"));
    assert_eq!(shown(&written.map("rosbags.mcap", &["--topics", &file])), by_pose);
    let file = written.folder.write("topics.toml", topics("none.urdf"));
    let line = nudge_fails(2, &["map", &written.folder.name("rosbags.mcap"), "--topics", &file, "--frames-only"]);
    assert!(line.contains("none.urdf"), "{line}");
}

#[test]
fn what_is_in_a_file_is_told_with_a_topic_map_that_can_be_used() {
    let Some(written) = Written::mcaps() else { return };
    let file = written.folder.name("png-lz4.mcap");
    let said = nudge_ok(&["map", &file, "--inspect"]);
    for line in [
        "depth = \"/camera/depth/compressedDepth\"",
        "info = \"/camera/camera_info\"",
        "labels = \"/labels/compressed\"",
        "pose = \"/camera_pose\"",
        "16UC1; compressedDepth png",
    ] {
        assert!(said.contains(line), "{line}: {said}");
    }
    let topics = written.folder.write("proposed.toml", said);
    written.map("png-lz4.mcap", &["--topics", &topics]);
    let said = nudge_ok(&["map", &written.folder.name("tf-zstd.mcap"), "--inspect"]);
    assert!(said.contains("fixed_frame = \"board\"") && said.contains("camera_frame = \"camera_optical\""), "{said}");
}

#[test]
fn files_that_are_cut_short_or_lack_something_are_told_in_one_line() {
    let Some(written) = Written::mcaps() else { return };
    let refused = |name: &str, more: &[&str]| {
        let (file, out) = (written.folder.name(name), written.folder.name("out"));
        let line = nudge_fails(2, &[&["map", &file, "--belief", "classical", "--out", &out][..], more].concat());
        assert!(!written.folder.path("out").exists(), "half-written");
        line
    };
    let whole = std::fs::read(written.folder.path("tf-zstd.mcap")).expect("read");
    for part in [whole.len() / 2, whole.len() / 3, 9] {
        written.folder.write("cut.mcap", &whole[..part]);
        let line = refused("cut.mcap", &[]);
        assert!(line.contains("cut.mcap: is cut short") || line.contains("cut.mcap: has no topic"), "{part}: {line}");
    }
    let mut broken = whole.clone();
    let middle = broken.len() / 2;
    broken[middle..middle + 64].fill(0xaa);
    written.folder.write("broken.mcap", &broken);
    let line = refused("broken.mcap", &[]);
    assert!(line.contains("broken.mcap: "), "{line}");
    written.folder.write("prose.mcap", "this is no recording");
    assert!(refused("prose.mcap", &[]).ends_with("prose.mcap: is no MCAP file"));
    let line = refused("no-info.mcap", &[]);
    assert!(line.contains("no-info.mcap: has no CameraInfo for /camera/depth/compressedDepth"), "{line}");
    let topics = "format = 1\ndepth = \"/camera/depth\"\ninfo = \"/nowhere\"\nfixed_frame = \"board\"\n";
    let topics = written.folder.write("topics.toml", topics);
    let line = refused("tf-zstd.mcap", &["--topics", &topics]);
    assert!(line.contains("no CameraInfo: there is none on /nowhere; --inspect shows"), "{line}");
}
