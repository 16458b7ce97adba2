//! Arms as their makers describe them.

use super::{Folder, TIN, small_scene};
use nudge_tests::{nudge, nudge_fails, nudge_ok, root, text};
use serde_json::Value;

fn shipped() -> String {
    std::fs::read_to_string(root().join("assets/robots/ur5_2f85.urdf")).expect("the shipped arm")
}

/// The shipped arm without any of its collision shapes.
fn bare() -> String {
    shipped().lines().filter(|line| !line.contains("<collision>")).map(|line| format!("{line}\n")).collect()
}

#[test]
fn an_arm_without_collision_shapes_was_praised_and_its_pushes_moved_nothing() {
    let folder = Folder::new();
    let file = folder.write("bare.urdf", bare());
    let line = nudge_fails(2, &["robot", "check", &file, "--views", "real75"]);
    assert!(line.contains("link wrist_3_link") && line.contains("a push would move nothing"), "{line}");
    let scene = folder.write("s.toml", small_scene(&format!("[robot]\nurdf = \"bare.urdf\"\n{TIN}")));
    let line = nudge_fails(2, &["run", &scene, "--belief", "classical", "--out", &folder.name("e")]);
    assert!(line.contains("bare.urdf") && !folder.path("e").exists(), "{line}");
}

#[test]
fn an_arm_that_is_only_drawn_takes_its_visuals_for_collision_shapes() {
    let folder = Folder::new();
    let drawn = folder.write("drawn.urdf", shipped().replace("collision>", "visual>"));
    let output = nudge(&["robot", "check", &drawn, "--views", "real75", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let warned = text(&output.stderr);
    assert!(warned.contains("no collision shapes on base_link") && warned.contains("the visuals stand in"), "{warned}");
    let facts = |json: &str| {
        let report: Value = serde_json::from_str(json).expect("JSON");
        (report["reach"].clone(), report["views"].clone())
    };
    let with_collisions = nudge_ok(&["robot", "check", "assets/robots/ur5_2f85.urdf", "--views", "real75", "--json"]);
    assert_eq!(facts(&text(&output.stdout)), facts(&with_collisions), "the same shapes are the same arm");
    // A picture's format that is not read here leaves a link without a shape, and says so.
    let dae = shipped().replace("collision>", "visual>").replacen(
        r#"<cylinder radius="0.075" length="0.09"/>"#,
        r#"<mesh filename="package://ur/base.dae"/>"#,
        1,
    );
    let warned = text(&nudge(&["robot", "check", &folder.write("dae.urdf", dae), "--views", "real75"]).stderr);
    assert!(warned.contains("cannot be read") && warned.contains("on base_link: nothing meets"), "{warned}");
}

#[test]
fn a_real_arm_needed_a_link_named_tool() {
    let folder = Folder::new();
    let check = |file: &str, more: &[&str]| -> Value {
        let args = [&["robot", "check", file, "--views", "real75", "--json"], more].concat();
        serde_json::from_str(&nudge_ok(&args)).expect("JSON")
    };
    let named = |tool: &str, camera: &str| {
        let text = shipped().replace("\"tool\"", &format!("{tool:?}")).replace("\"camera\"", &format!("{camera:?}"));
        folder.write("named.urdf", text)
    };
    for (tool, camera) in [("tool0", "camera_color_optical_frame"), ("panda_hand_tcp", "wrist_optical_frame")] {
        let report = check(&named(tool, camera), &[]);
        assert_eq!((&report["tool"], &report["camera"]), (&tool.into(), &camera.into()));
    }
    let odd = named("pinch_point", "eye");
    let line = nudge_fails(2, &["robot", "check", &odd]);
    for words in ["has no tool link", "--tool", "`eye`", "`pinch_point`"] {
        assert!(line.contains(words), "{words:?} is not in: {line}");
    }
    let report = check(&odd, &["--tool", "pinch_point", "--camera", "eye"]);
    assert_eq!((&report["tool"], &report["camera"]), (&"pinch_point".into(), &"eye".into()));
    assert_eq!(report["views"][0]["reachable"].as_array().map(Vec::len), Some(75), "it is the shipped arm");
    let line = nudge_fails(2, &["robot", "check", &odd, "--tool", "thumb"]);
    assert!(line.contains("has no link `thumb`") && line.contains("`pinch_point`"), "{line}");
    // And in a scene.
    let robot = "[robot]\nurdf = \"named.urdf\"\ntool = \"pinch_point\"\ncamera = \"eye\"\n";
    let scene = folder.write("s.toml", small_scene(&format!("{robot}{TIN}")));
    nudge_ok(&["scene", "check", &scene]);
    let line = nudge_fails(
        2,
        &["scene", "check", &folder.write("t.toml", small_scene(&format!("[robot]\ntool = \"x\"\n{TIN}")))],
    );
    assert!(line.contains("line 7") && line.contains("no urdf is named"), "{line}");
}

#[test]
fn a_missing_velocity_was_called_a_velocity_of_0() {
    let folder = Folder::new();
    let file = folder.write("arm.urdf", shipped().replacen(" velocity=\"3.141592653589793\"", "", 1));
    let line = nudge_fails(2, &["robot", "check", &file]);
    assert!(line.contains("joint shoulder_pan_joint: has no velocity limit") && !line.contains("is 0"), "{line}");
}

#[test]
fn a_xacro_file_was_an_arm_without_links() {
    let folder = Folder::new();
    let text = "<?xml version=\"1.0\"?>\n<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name=\"two\">\n\
        \x20 <xacro:property name=\"len\" value=\"0.35\"/>\n\
        \x20 <xacro:macro name=\"arm\" params=\"prefix\">\n    <link name=\"${prefix}base\"/>\n  </xacro:macro>\n\
        \x20 <xacro:arm prefix=\"\"/>\n</robot>\n";
    let line = nudge_fails(2, &["robot", "check", &folder.write("arm.urdf.xacro", text)]);
    assert!(line.contains("line 3: is a xacro file") && line.contains("xacro arm.urdf.xacro > arm.urdf"), "{line}");
}
