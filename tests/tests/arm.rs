//! The arm, as a user meets it: what it reaches, how it pushes, and what is said of arms that cannot be.

use nudge_core::arm::{ArmTool, DistanceField, Joints, PlanSettings, Space, level_tool, plan, retreat, turned};
use nudge_core::grid::VoxelSet;
use nudge_core::rng::{ChaCha8Rng, stream};
use nudge_core::scene::{Catalog, Scene};
use nudge_core::world::TruthMap;
use nudge_tests::{nudge, nudge_fails, nudge_ok, root, text};
use serde_json::Value;
use std::path::{Path, PathBuf};

const SHIPPED: &str = "assets/robots/ur5_2f85.urdf";

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("tempdir")
}

fn write(folder: &Path, name: &str, content: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, content).expect("written");
    path.to_str().expect("utf-8").to_owned()
}

fn shipped() -> String {
    std::fs::read_to_string(root().join(SHIPPED)).expect("the shipped arm")
}

fn scene(robot: &str) -> String {
    format!(
        "format = 1\nname = \"t\"\n[shelf]\nsize = [0.8, 0.4, 0.4]\n{robot}\n\
         [[object]]\nclass = \"cracker_box\"\nposition = [0.0, 0.15]\nyaw_deg = 90.0\n\
         [[object]]\nclass = \"tomato_can\"\nposition = [0.0, 0.30]\n"
    )
}

#[test]
fn robot_check_tells_reach_and_views_and_draws_them() {
    let folder = folder();
    let picture = folder.path().join("robot.png");
    let said = nudge_ok(&["robot", "check", SHIPPED, "--out", picture.to_str().expect("utf-8")]);
    for words in ["ur5_2f85: 6 joints, closed-form inverse", "shoulder_pan_joint", "reach", "75 of 75 in real75"] {
        assert!(said.contains(words), "{words:?} is not in: {said}");
    }
    assert!(std::fs::metadata(&picture).expect("a picture").len() > 50_000);
    let document: Value = serde_json::from_str(&nudge_ok(&["robot", "check", SHIPPED, "--json"])).expect("JSON");
    assert_eq!(document["joints"].as_array().map(Vec::len), Some(6));
    assert!(document["reach"]["share"].as_f64().expect("share") > 0.5, "{}", document["reach"]);
    let standard = &document["views"][0];
    let reachable = standard["reachable"].as_array().expect("views").len();
    assert!((100..=300).contains(&reachable), "{reachable} of the 300 views");
    // From the second joint's offset to the tip, every length of the URDF added up: more than the straight arm reaches.
    let lengths = 0.13585 + 0.1197_f64.hypot(0.425) + 0.39225 + 0.093 + 0.09465 + 0.0823 + 0.16;
    let stretched = document["stretched_m"].as_f64().expect("metres");
    assert!((stretched - lengths).abs() < 1e-3, "{stretched} {lengths}");
}

#[test]
fn arms_that_are_no_arms() {
    let folder = folder();
    let good = shipped();
    let cases: &[(&str, &str, &str, &[&str])] = &[
        (
            "mesh",
            r#"<box size="0.111 0.035 0.03"/>"#,
            r#"<mesh filename="no/such.stl"/>"#,
            &["line 44", "gripper_link", "no/such.stl"],
        ),
        (
            "kind",
            r#"name="elbow_joint" type="revolute""#,
            r#"name="elbow_joint" type="hinge""#,
            &["elbow_joint", "is hinge"],
        ),
        (
            "link",
            r#"<child link="wrist_1_link"/>"#,
            r#"<child link="wrist_7_link"/>"#,
            &["wrist_1_joint", "wrist_7_link"],
        ),
        ("loop", r#"<child link="wrist_1_link"/>"#, r#"<child link="base_link"/>"#, &["shoulder_pan_joint", "loop"]),
        (
            "length",
            r#"<origin xyz="0 -0.1197 0.425"/>"#,
            r#"<origin xyz="0 -0.1197 0"/>"#,
            &["elbow_joint", "no length"],
        ),
        (
            "limits",
            r#"lower="-3.141592653589793" upper="3.141592653589793""#,
            r#"lower="3" upper="-3""#,
            &["elbow_joint", "wrong way round"],
        ),
        ("number", r#"<origin xyz="0 0 0.09465"/>"#, r#"<origin xyz="0 0"/>"#, &["wrist_3_joint", "3 numbers"]),
        ("xml", "</robot>", "", &["not a URDF file"]),
    ];
    for (name, from, to, words) in cases {
        let file = write(folder.path(), &format!("{name}.urdf"), &good.replacen(from, to, 1));
        let line = nudge_fails(2, &["robot", "check", &file]);
        assert!(line.contains(&format!("{name}.urdf: ")), "{line}");
        for word in *words {
            assert!(line.contains(word), "{word:?} is not in: {line}");
        }
    }
    let no_tool = write(folder.path(), "tool.urdf", &good.replace("\"tool\"", "\"finger\""));
    assert!(nudge_fails(2, &["robot", "check", &no_tool]).contains("has no tool link"));
    assert!(nudge_fails(2, &["robot", "check", "/nowhere/arm.urdf"]).contains("/nowhere/arm.urdf"));
    let picture = folder.path().join("never.png");
    nudge_fails(2, &["robot", "check", &no_tool, "--out", picture.to_str().expect("utf-8")]);
    assert!(!picture.exists());
}

#[test]
fn robots_of_scenes_are_checked() {
    let folder = folder();
    let cases: &[(&str, &str, &[&str])] = &[
        ("inside", "[robot]\nbase = [0.0, 0.2, 0.0]", &["inside.toml", "line 6", "inside", "shelf"]),
        ("far", "[robot]\nbase = [0.0, -70.0, 0.0]", &["far.toml", "line 6", "within 10 m"]),
        ("nan", "[robot]\nbase = [nan, -0.7, 0.0]", &["nan.toml", "line 6", "finite"]),
        ("key", "[robot]\nbsae = [0.0, -0.7, 0.0]", &["key.toml", "line 6", "bsae"]),
        ("urdf", "[robot]\nurdf = \"none.urdf\"", &["none.urdf"]),
    ];
    for (name, robot, words) in cases {
        let file = write(folder.path(), &format!("{name}.toml"), &scene(robot));
        let out = folder.path().join("out");
        let line = nudge_fails(2, &["run", &file, "--belief", "classical", "--out", out.to_str().expect("utf-8")]);
        for word in *words {
            assert!(line.contains(word), "{word:?} is not in: {line}");
        }
        assert!(!out.exists(), "half-written");
    }
    write(folder.path(), "bad.urdf", "<robot name=\"x\"><link name=\"a\"/></robot>");
    let file = write(folder.path(), "bad.toml", &scene("[robot]\nurdf = \"bad.urdf\""));
    let line = nudge_fails(2, &["run", &file, "--belief", "classical", "--out", "/tmp/nowhere-to-be"]);
    assert!(line.contains("bad.urdf") && line.contains("tool"), "{line}");
}

#[test]
fn an_episode_whose_arm_reaches_nothing_looks_and_says_why_it_never_pushes() {
    let folder = folder();
    let file = write(folder.path(), "far.toml", &scene("[robot]\nbase = [0.0, -3.0, -0.015]"));
    let out = folder.path().join("e");
    let args = ["run", &file, "--belief", "classical", "--policy", "random-push-5", "--budget", "6", "--json", "--out"];
    let output = nudge(&[&args[..], &[out.to_str().expect("utf-8")]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("reaches no place before the shelf"), "{}", text(&output.stderr));
    let record: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let steps = record["steps"].as_array().expect("steps");
    assert_eq!(steps.len(), 6);
    assert!(steps.iter().all(|step| step["action"]["kind"] == "look" && step["motion_s"] == 0.0));
    let decision = &steps[4]["decision"];
    assert_eq!(decision["reason"], "no_candidate");
    let candidates = decision["candidates"].as_array().expect("candidates");
    let reached = |c: &Value| c["rejection"]["kind"] != "unreachable" && c["rejection"]["kind"] != "no_target";
    assert!(!candidates.is_empty() && !candidates.iter().any(reached), "{candidates:?}");
    nudge_ok(&["replay", out.to_str().expect("utf-8")]);
    let line = nudge_fails(1, &["robot", "check", SHIPPED, "--scene", &file, "--json"]);
    assert!(line.contains("reaches no place"), "{line}");
}

#[test]
fn all_policies_push_through_the_arm_and_replay() {
    let folder = folder();
    for (policy, budget) in [("random-push-5", "6"), ("random-push-5-blind", "6"), ("mem", "8"), ("saturation", "8")] {
        let out = folder.path().join(policy);
        let out = out.to_str().expect("utf-8");
        let scene = "scenes/high/key-blocker.toml";
        let args =
            ["run", scene, "--belief", "classical", "--policy", policy, "--budget", budget, "--json", "--out", out];
        let record: Value = serde_json::from_str(&nudge_ok(&args)).expect("JSON");
        let mut pushed = 0;
        for step in record["steps"].as_array().expect("steps") {
            let moved = step["motion_s"].as_f64().expect("seconds");
            assert!(moved > 0.0 && moved < 120.0, "{policy} step {}: {moved} s", step["index"]);
            if step["action"]["kind"] == "push" {
                pushed += 1;
                let motion = &step["decision"]["motion"];
                assert!(motion["way_in"]["stops"].as_array().expect("stops").len() > 1);
                assert_eq!(motion["push"]["stops"][0]["joints"].as_array().map(Vec::len), Some(6));
                let depth = step["push"]["arm_in_shelf_m"].as_f64().expect("metres");
                assert!(depth <= 0.002, "{policy} step {}: {depth} m in the shelf", step["index"]);
                assert!(step["push"]["stalled"].is_boolean() && step["push"]["contacts"].is_array());
            }
        }
        assert!(pushed > 0 || policy == "mem" || policy == "saturation", "{policy} did not push");
        assert!(nudge_ok(&["replay", out]).contains("bit for bit"), "{policy}");
    }
}

/// What is really in the crowded scenes that come with the program.
fn crowded() -> Vec<(String, Scene, VoxelSet)> {
    let folder = root().join("scenes/high");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("scenes").map(|e| e.expect("entry").path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "toml"));
    files.sort();
    let catalog = Catalog::standard();
    let load = |file: PathBuf| {
        let (scene, _) = Scene::load(&file, &catalog).expect("scene");
        let truth = TruthMap::of(&scene.grid(), &scene.bodies(&catalog).expect("bodies"));
        let mut occupied = VoxelSet::empty(&scene.grid());
        truth.occupancy.iter().enumerate().filter(|(_, o)| **o > 0).for_each(|(index, _)| occupied.insert(index));
        (scene.name.clone(), scene, occupied)
    };
    files.into_iter().map(load).collect()
}

/// A free configuration with the tool somewhere in the shelf; the densest shelves have hardly any.
fn goal(tool: &ArmTool, space: &Space<'_>, rng: &mut ChaCha8Rng) -> Option<Joints> {
    use rand::Rng;
    let ready = tool.ready.expect("a place to wait");
    (0..500).find_map(|_| {
        let tip = nalgebra::Point3::new(
            rng.random_range(-0.35..0.35),
            rng.random_range(0.0..0.35),
            rng.random_range(0.05..0.20),
        );
        let branches = tool.arm.inverse(&level_tool(&tip, rng.random_range(-0.6..0.6)), &ready);
        let joints = (!branches.is_empty()).then(|| branches[rng.random_range(0..branches.len())])?;
        space.is_free(&joints).then_some(joints)
    })
}

#[test]
fn two_hundred_random_ways_in_crowded_shelves_are_found() {
    let scenes = crowded();
    let (mut solvable, mut solved, mut asked) = (0, 0, 0);
    for number in 0..600 {
        if asked == 200 {
            break;
        }
        let (_, scene, occupied) = &scenes[number % scenes.len()];
        let tool = ArmTool::standard(scene.shelf);
        let field = DistanceField::new(&scene.grid(), occupied);
        let space = tool.space().with_map(occupied, &field);
        let Some(goal) = goal(&tool, &space, &mut stream(1, "queries", number as u64)) else { continue };
        let goals = turned(&tool.arm, &retreat(&space, &goal, 0.5));
        let ready = tool.ready.expect("a place to wait");
        let ask = |rounds| {
            let settings = PlanSettings { rounds, ..PlanSettings::default() };
            plan(&space, &ready, &goals, settings, &mut stream(1, "query", asked))
        };
        let found = ask(PlanSettings::default().rounds);
        if let Some(planned) = &found {
            assert_eq!(planned.path.first(), Some(&ready));
            let there = tool.arm.world_from_tool(planned.path.last().expect("an end"));
            let wanted = tool.arm.world_from_tool(&goal);
            assert!((there.translation.vector - wanted.translation.vector).norm() < 1e-6);
            for pair in planned.path.windows(2) {
                let free = |step: u32| space.room_m(&pair[0].toward(&pair[1], f64::from(step) / 50.0)) > -0.004;
                assert!((0..=50).all(free) && tool.arm.within_limits(&pair[1]));
            }
        }
        // A patient planner says which queries have an answer.
        solvable += usize::from(found.is_some() || ask(20_000).is_some());
        solved += usize::from(found.is_some());
        asked += 1;
    }
    assert!(asked == 200 && solvable > 150, "{solvable} of {asked} have an answer");
    assert!(solved as f64 >= 0.99 * solvable as f64, "{solved} of {solvable}");
}
