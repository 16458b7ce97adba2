use super::*;
use crate::arm::tests::{parse, ur5};

#[test]
fn bad_files_are_told_by_file_and_place() {
    let good = include_str!("../../../../assets/robots/ur5_2f85.urdf");
    assert!(parse(good).is_ok());
    let cases = [
        (
            r#"<box size="0.111 0.035 0.03"/>"#,
            r#"<mesh filename="no/such.stl"/>"#,
            "arm.urdf: line 44, link gripper_link: mesh `no/such.stl` is not there",
        ),
        (
            r#"<box size="0.111 0.035 0.03"/>"#,
            r#"<mesh filename="package://ur/no.stl"/>"#,
            "arm.urdf: line 44, link gripper_link: mesh",
        ),
        (
            r#"type="revolute">
    <parent link="forearm_link"/>"#,
            r#"type="floating">
    <parent link="forearm_link"/>"#,
            "arm.urdf: line 68, joint wrist_1_joint: is floating",
        ),
        (
            r#"<child link="wrist_1_link"/>"#,
            r#"<child link="wrist_7_link"/>"#,
            "arm.urdf: line 68, joint wrist_1_joint: its child link `wrist_7_link` is not in the file",
        ),
        (
            r#"<child link="wrist_1_link"/>"#,
            r#"<child link="base_link"/>"#,
            "arm.urdf: line 53, joint shoulder_pan_joint: is part of a loop",
        ),
        (
            r#"<child link="flange"/>"#,
            r#"<child link="camera"/>"#,
            "closes a loop: link `camera` already hangs from joint `flange_joint`",
        ),
        (r#"<link name="tool"/>"#, r#"<link name="tol"/>"#, "its child link `tool` is not in the file"),
        (
            r#"<cylinder radius="0.050" length="0.425"/>"#,
            r#"<cylinder radius="0.050" length="0"/>"#,
            "link upper_arm_link: length 0 of a collision shape",
        ),
        (
            r#"<origin xyz="0 -0.1197 0.425"/>"#,
            r#"<origin xyz="0 -0.1197 0"/>"#,
            "joint elbow_joint: turns about the same line as joint `shoulder_lift_joint`",
        ),
        (
            r#"lower="-3.141592653589793" upper="3.141592653589793""#,
            r#"lower="3" upper="-3""#,
            "joint elbow_joint: limits are the wrong way round: lower 3 is above upper -3",
        ),
        (r#"lower="-3.141592653589793" upper="3.141592653589793" "#, "", "joint elbow_joint: has no room to move"),
        (r#"velocity="3.141592653589793""#, r#"velocity="0""#, "joint shoulder_pan_joint: velocity limit is 0"),
        (r#"velocity="3.141592653589793""#, "", "joint shoulder_pan_joint: has no velocity limit"),
        (r#"<axis xyz="0 0 1"/>"#, r#"<axis xyz="0 0 0"/>"#, "joint shoulder_pan_joint: its axis has no direction"),
        (r#"xyz="0 0 0.089159""#, r#"xyz="0 0 nan""#, "joint shoulder_pan_joint: origin"),
        ("</robot>", "", "not a URDF file that can be read"),
    ];
    for (from, to, expected) in cases {
        let changed = good.replacen(from, to, 1);
        assert_ne!(changed, good, "{from}");
        let message = parse(&changed).map(|_| ()).expect_err(to).to_string();
        assert!(
            message.starts_with("arm.urdf: ") && message.contains(expected) && !message.contains('\n'),
            "{message}"
        );
    }
    let no_tool = good.replace("\"tool\"", "\"finger\"");
    let message = parse(&no_tool).map(|_| ()).expect_err("no tool").to_string();
    assert!(message.contains("has no tool link") && message.contains("`camera`, `finger`"), "{message}");
    assert!(matches!(Arm::load(Path::new("/nowhere/x.urdf"), &RobotPlacement::default()), Err(Error::Io { .. })));
}

#[test]
fn the_tool_of_a_real_arm_is_found_by_its_usual_name_or_the_one_that_is_told() {
    let good = include_str!("../../../../assets/robots/ur5_2f85.urdf");
    let called = |name: &str| parse(&good.replace("\"tool\"", &format!("\"{name}\""))).map(|arm| arm.tool_link);
    for name in ["tool0", "tcp", "ee_link", "panda_hand_tcp", "left_tool0"] {
        assert_eq!(called(name).expect(name), name);
    }
    let with = |tool: Option<&str>, camera: Option<&str>| {
        let urdf = RobotFile {
            source: "arm.urdf".to_owned(),
            text: good.replace("\"tool\"", "\"finger\""),
            meshes: Default::default(),
            tool: tool.map(str::to_owned),
            camera: camera.map(str::to_owned),
        };
        Arm::placed(&RobotPlacement { urdf: Some(urdf), ..RobotPlacement::default() })
    };
    let arm = with(Some("finger"), Some("flange")).expect("told");
    assert_eq!((arm.tool_link.as_str(), arm.camera_link.as_deref()), ("finger", Some("flange")));
    let message = with(Some("thumb"), None).map(|_| ()).expect_err("no such link").to_string();
    assert!(message.contains("no link `thumb`") && message.contains("`wrist_3_link`"), "{message}");
    let message = with(Some("finger"), Some("base_link")).map(|_| ()).expect_err("not in hand").to_string();
    assert!(message.contains("link base_link: the camera must be fixed to the hand"), "{message}");
}

#[test]
fn an_arm_without_collision_shapes_is_drawn_into_the_way_or_refused() {
    let good = include_str!("../../../../assets/robots/ur5_2f85.urdf");
    assert_eq!(parse(good).expect("an arm").warnings, Vec::<String>::new());
    let visual = parse(&good.replace("collision>", "visual>")).expect("visuals stand in");
    assert_eq!(visual.parts().count(), ur5().parts().count());
    assert!(visual.warnings[0].contains("upper_arm_link") && visual.warnings[0].contains("visuals stand in"));
    let bare = |from: &str| -> String {
        let lines = good.lines().skip_while(|line| !line.contains("<robot"));
        let mut inside = false;
        lines
            .filter(|line| {
                inside = if line.contains("<link name=") { line.contains(from) } else { inside };
                !(inside && line.contains("<collision>"))
            })
            .map(|line| format!("{line}\n"))
            .collect()
    };
    let elbow = parse(&bare("forearm_link")).expect("an arm");
    assert!(elbow.warnings[0].contains("no shapes at all on what moves with forearm_link"), "{:?}", elbow.warnings);
    // Without a gripper the last link pushes; without either nothing does.
    let gripper = bare("gripper_link");
    assert_eq!(parse(&gripper).expect("an arm").gripper_name(), "wrist_3_link");
    let hand = gripper.lines().filter(|line| !(line.contains("xyz=\"0 0.0612 0\""))).collect::<Vec<_>>().join("\n");
    let message = parse(&hand).map(|_| ()).expect_err("no hand").to_string();
    assert!(message.contains("link wrist_3_link: nothing from here to the tool has a collision shape"), "{message}");
}
