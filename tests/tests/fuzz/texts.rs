//! What people write: scenes, view arrays, the catalogue, arms.

use super::engine::Target;
use super::{as_text, shipped_scenes};
use nudge_core::arm::Arm;
use nudge_core::camera::ViewArray;
use nudge_core::scene::{Catalog, RobotPlacement, Scene};
use nudge_core::world::{TruthMap, World};
use nudge_tests::{Folder, root};
use std::path::Path;

const SCENE_WORDS: [&str; 14] = [
    "nan",
    "inf",
    "-inf",
    "[",
    "]",
    "\n[[object]]\n",
    "\n[robot]\nbase = [0, -0.7, 0]\n",
    "\n[meshes]\n",
    "mesh = \"a.obj\"\n",
    "scale = [1, 0.05, 20]\n",
    "yaw_deg = 45\n",
    "class = \"tomato_can\"\n",
    "voxel_m = 0.001\n",
    "\"\"\"",
];

#[test]
fn scenes() {
    let catalog = Catalog::standard();
    let target = Target { name: "scene", sound: shipped_scenes(), words: &SCENE_WORDS, inputs: 400 };
    target.run(|file| {
        let Ok((scene, _)) = Scene::parse(&as_text(file), Path::new("scene.toml"), &catalog) else { return false };
        assert!(scene.bodies(&catalog).is_ok() && scene.problems(&catalog).is_ok_and(|problems| problems.is_empty()));
        assert!(scene.fill(&catalog).is_ok_and(f32::is_finite));
        let again = Scene::parse(&scene.to_toml(), Path::new("again.toml"), &catalog);
        assert!(
            again.is_ok_and(|(again, _)| again.objects.len() == scene.objects.len()),
            "what is saved is read again"
        );
        true
    });
}

#[test]
fn scenes_in_the_world() {
    let catalog = Catalog::standard();
    let target = Target { name: "scene in the world", sound: shipped_scenes(), words: &SCENE_WORDS, inputs: 8 };
    target.run(|file| {
        let Ok((scene, _)) = Scene::parse(&as_text(file), Path::new("scene.toml"), &catalog) else { return false };
        let bodies = scene.bodies(&catalog).expect("a checked scene");
        let mut world = World::new(scene.shelf, bodies);
        world.settle();
        let bodies = world.bodies();
        assert!(bodies.iter().all(|body| body.world_from_body.translation.vector.iter().all(|v| v.is_finite())));
        TruthMap::of(&scene.grid(), &bodies).occupancy.len() == scene.grid().voxel_count()
    });
}

#[test]
fn view_arrays() {
    let sound = ["real75", "standard300"].map(|name| std::fs::read(root().join(format!("assets/views/{name}.toml"))));
    let sound = sound.map(|file| file.expect("a shipped array")).to_vec();
    let words = ["nan", "inf", "]", "[", "slot = [0, 0, 0]", "{", "}", "position = [0, 0, 1]", "layout = [1, 1, 1]\n"];
    Target { name: "view array", sound, words: &words, inputs: 200 }.run(|file| {
        let Ok(array) = ViewArray::parse("views.toml", &as_text(file)) else { return false };
        let is_finite = |pose: &nudge_core::Pose| pose.to_homogeneous().iter().all(|v| v.is_finite());
        assert!(array.views.iter().all(|view| is_finite(&view.world_from_camera)));
        true
    });
}

#[test]
fn catalogues() {
    let sound = vec![std::fs::read(root().join("assets/catalog.toml")).expect("the catalogue")];
    let words = ["nan", "inf", "[", "]", "\n[[class]]\n", "shape", "cylinder", "mesh", "mass_kg = 0\n"];
    Target { name: "catalogue", sound, words: &words, inputs: 200 }
        .run(|file| Catalog::parse(&as_text(file), Path::new("catalog.toml")).is_ok());
}

#[test]
fn arms() {
    let folder = Folder::new();
    let path = folder.path("arm.urdf");
    let shipped = std::fs::read(root().join("assets/robots/ur5_2f85.urdf")).expect("the shipped arm");
    let drawn = as_text(&shipped).replace("collision>", "visual>").into_bytes();
    let words = [
        "<link name=\"a\"/>",
        "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>",
        "prismatic",
        "continuous",
        "fixed",
        "nan",
        "inf",
        "<!--",
        "-->",
        "<mesh filename=\"a.stl\"/>",
        "<mimic joint=\"j\"/>",
        "&amp;",
        "<sphere radius=\"0.1\"/>",
        "<box size=\"0.1 0.1 0.1\"/>",
    ];
    let target = Target { name: "URDF", sound: vec![shipped, drawn], words: &words, inputs: 60 };
    target.run(|file| {
        std::fs::write(&path, file).expect("written");
        let Ok(arm) = Arm::load(&path, &RobotPlacement::default()) else { return false };
        assert!(!arm.joints.is_empty() && arm.joints.iter().all(|joint| joint.lower < joint.upper));
        true
    });
}
