//! Scene files: what is read, what is written, and what every bad input is told.

use super::*;
use std::path::{Path, PathBuf};

const HEAD: &str = "format = 1\nname = \"t\"\n[shelf]\nsize = [0.8, 0.4, 0.4]\n";

fn parse(text: &str) -> Result<(Scene, Vec<Warning>)> {
    Scene::parse(text, Path::new("s.toml"), &Catalog::standard())
}

/// The error of a file that begins with [`HEAD`] (four lines).
fn error_of(rest: &str) -> String {
    parse(&format!("{HEAD}{rest}")).expect_err("must be refused").to_string()
}

fn object(class: &str, rest: &str) -> String {
    format!("[[object]]\nclass = \"{class}\"\n{rest}\n")
}

#[test]
fn a_minimal_scene_has_the_defaults() {
    let (scene, warnings) = parse(&format!("{HEAD}{}", object("tomato_can", "position = [0, 0.2]"))).expect("scene");
    assert!(warnings.is_empty());
    assert_eq!(scene.objects, [Object::new("tomato_can", [0.0, 0.2], 0.0)]);
    assert_eq!((scene.shelf.voxel_m, scene.shelf.column_closure), (0.005, true));
    assert_eq!(scene.grid().dims, [160, 80, 80]);
}

#[test]
fn a_scene_without_objects_runs_with_a_warning() {
    let (scene, warnings) = parse(HEAD).expect("scene");
    assert!(scene.bodies(&Catalog::standard()).expect("bodies").is_empty());
    assert_eq!(warnings, ["the scene has no objects"]);
}

#[test]
fn broken_toml_names_line_and_object() {
    let broken = format!("{}{}", object("gum_tin", "position = [0.1, 0.1]"), object("tomato_can", "position = [0.1, "));
    assert!(error_of(&broken).starts_with("s.toml: line 10, object 2 (tomato_can): "), "{}", error_of(&broken));
    let early = parse("format = 1\nname = ").expect_err("broken").to_string();
    assert!(early.starts_with("s.toml: line 2: "), "{early}");
    assert!(!early.contains('\n'));
}

#[test]
fn unknown_keys_are_named_where_they_stand() {
    let message = error_of(&object("tomato_can", "position = [0.1, 0.1]\nyaw = 3"));
    assert!(message.starts_with("s.toml: line 8, object 1 (tomato_can): unknown field `yaw`, expected"), "{message}");
    let message = error_of("depth = 3");
    assert!(message.starts_with("s.toml: line 5: unknown field `depth`"), "{message}");
    let message = parse(&format!("colour = 1\n{HEAD}")).expect_err("unknown").to_string();
    assert!(message.starts_with("s.toml: line 1: unknown field `colour`"), "{message}");
}

#[test]
fn a_missing_key_names_its_object() {
    let message = error_of(&object("tomato_can", ""));
    assert_eq!(message, "s.toml: line 5, object 1 (tomato_can): missing field `position`");
    let message = parse("format = 1\nname = \"t\"\n").expect_err("no shelf").to_string();
    assert!(message.ends_with("missing field `shelf`"), "{message}");
}

#[test]
fn unknown_classes_get_a_hint() {
    let message = error_of(&object("tomato_tin", "position = [0.1, 0.1]"));
    assert_eq!(
        message,
        "s.toml: line 6, object 1 (tomato_tin): unknown class `tomato_tin`; did you mean `tomato_can`?"
    );
    let message = error_of(&object("zebra", "position = [0.1, 0.1]"));
    assert!(message.contains("known are chips_can, tomato_can"), "{message}");
    assert!(error_of(&object("background", "position = [0.1, 0.1]")).contains("nothing can be placed"));
    let message = error_of("[meshes]\nzebra = \"a.obj\"");
    assert!(message.starts_with("s.toml: line 6, mesh of zebra: unknown class `zebra`"), "{message}");
}

#[test]
fn other_formats_are_told_first() {
    let message = parse("format = 2\nnovelty = true\n").expect_err("format").to_string();
    assert_eq!(message, "s.toml: line 1: format 2 is not known; this version reads format 1");
    let message = parse("name = \"t\"\nformat = \"1\"").expect_err("format").to_string();
    assert_eq!(message, "s.toml: line 2: format \"1\" is not known; this version reads format 1");
    assert!(parse("name = \"t\"").expect_err("format").to_string().contains("`format = 1` is missing"));
}

#[test]
fn numbers_that_are_none_are_refused() {
    for number in ["nan", "inf", "-inf", "1e300", "1e9"] {
        let message = error_of(&object("gum_tin", &format!("position = [{number}, 0.1]")));
        assert!(message.starts_with("s.toml: line 7, object 1 (gum_tin): position ["), "{message}");
        let message = error_of(&object("gum_tin", &format!("position = [0.1, 0.1]\nyaw_deg = {number}")));
        assert!(message.starts_with("s.toml: line 8, object 1 (gum_tin): yaw_deg ="), "{message}");
    }
    for scale in ["0.0", "-1.0", "nan", "1e20"] {
        let message = error_of(&object("gum_tin", &format!("position = [0.1, 0.1]\nscale = [1.0, {scale}, 1.0]")));
        assert!(message.starts_with("s.toml: line 8, object 1 (gum_tin): scale ["), "{message}");
        assert!(message.contains("each factor must be 0.05 to 20"), "{message}");
    }
}

#[test]
fn absurd_shelves_name_the_limit() {
    let shelf =
        |shelf: &str| parse(&format!("format = 1\nname = \"t\"\n[shelf]\n{shelf}")).expect_err("shelf").to_string();
    let message = shelf("size = [80.0, 0.4, 0.4]");
    assert_eq!(message, "s.toml: line 4: shelf size 80 m: each of width, depth and height must be 0.05 to 5 m");
    assert!(shelf("size = [nan, 0.4, 0.4]").contains("shelf size NaN m"));
    let message = shelf("size = [5.0, 4.0, 4.0]");
    assert!(message.contains("1000 x 800 x 800 = 640000000 voxels; the limit is 10000000"), "{message}");
    let message = shelf("size = [0.8, 0.4, 0.4]\nvoxel_m = 1e-9");
    assert!(message.starts_with("s.toml: line 5: voxel_m = "), "{message}");
}

#[test]
fn objects_outside_are_told_the_side_and_how_far() {
    let at = |x: f32, y: f32| error_of(&object("tomato_can", &format!("position = [{x}, {y}]")));
    let place = "s.toml: line 7, object 1 (tomato_can): stands outside the shelf";
    assert_eq!(at(-0.38, 0.2), format!("{place} on the left by 13.0 mm"));
    assert_eq!(at(0.37, 0.2), format!("{place} on the right by 3.0 mm"));
    assert_eq!(at(0.0, 0.03), format!("{place} at the front by 3.0 mm"));
    assert_eq!(at(0.0, 0.4), format!("{place} at the back by 33.0 mm"));
    let low = "format = 1\nname = \"t\"\n[shelf]\nsize = [0.8, 0.4, 0.2]\n";
    let tall = parse(&format!("{low}{}", object("chips_can", "position = [0.0, 0.2]"))).expect_err("tall").to_string();
    assert_eq!(tall, "s.toml: line 7, object 1 (chips_can): too tall by 42.0 mm: 0.242 m in a shelf 0.200 m high");
}

#[test]
fn overlaps_name_both_objects() {
    let text = object("tomato_can", "position = [0.0, 0.2]") + &object("gum_tin", "position = [0.063, 0.2]");
    let expected = "s.toml: line 10, object 2 (gum_tin): overlaps object 1 (tomato_can, line 5) by 3.0 mm";
    assert_eq!(error_of(&text), expected);
    let text = object("tomato_can", "position = [0.0, 0.2]") + &object("gum_tin", "position = [0.066, 0.2]");
    parse(&format!("{HEAD}{text}")).expect("contact is no overlap");
}

#[test]
fn missing_files_and_folders_are_errors_of_the_system() {
    let catalog = Catalog::standard();
    let missing = Scene::load(Path::new("no/such/scene.toml"), &catalog).expect_err("missing");
    assert!(matches!(missing, crate::Error::Io { .. }) && missing.exit_code() == 2);
    let message = error_of("[meshes]\ntomato_can = \"no_such.obj\"");
    assert!(message.starts_with("s.toml: line 6, mesh of tomato_can: no_such.obj: No such file"), "{message}");
    let (scene, _) = parse(HEAD).expect("scene");
    assert!(matches!(scene.save_toml(Path::new("no/such/scene.toml")), Err(crate::Error::Io { .. })));
    let folder = tempfile::tempdir().expect("folder");
    let binary = folder.path().join("binary.toml");
    std::fs::write(&binary, [0xff, 0xfe, 0x00]).expect("write");
    let message = Scene::load(&binary, &catalog).expect_err("binary").to_string();
    assert!(message.ends_with("not a scene file (not UTF-8 text)"), "{message}");
}

#[test]
fn names_must_be_fit_for_files() {
    for name in ["", "a/b", ".hidden", "a\\\\b"] {
        let text = HEAD.replace("\"t\"", &format!("\"{name}\""));
        let message = parse(&text).expect_err("name").to_string();
        assert!(message.starts_with("s.toml: line 2: name must be"), "{message}");
    }
}

#[test]
fn a_saved_scene_reads_back_the_same() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("scene.toml");
    let catalog = Catalog::standard();
    let mut scene = generate(&catalog, &GenerateConfig::default(), 5).expect("scene");
    scene.description = "quotes \" and \\ and ü".into();
    scene.shelf.column_closure = false;
    scene.objects[0].scale = [0.9, 0.95, 1.05];
    scene.save_toml(&path).expect("saved");
    let (read, _) = Scene::load(&path, &catalog).expect("read back");
    assert_eq!(read, scene);
    assert_eq!(read.to_toml(), scene.to_toml());
    assert_eq!(std::fs::read_dir(folder.path()).expect("list").count(), 1, "nothing half-written stays");
    let json = serde_json::to_string(&scene).expect("json");
    let embedded: Scene = serde_json::from_str(&json).expect("embedded");
    assert_eq!(embedded, scene);
    embedded.check(&catalog).expect("sound");
}

#[test]
fn an_embedded_scene_is_checked_too() {
    let (mut scene, _) = parse(&format!("{HEAD}{}", object("gum_tin", "position = [0.0, 0.2]"))).expect("scene");
    let catalog = Catalog::standard();
    scene.objects.push(scene.objects[0].clone());
    let message = scene.check(&catalog).expect_err("twice the same").to_string();
    assert!(message.starts_with("scene t: object 2 (gum_tin): overlaps object 1 (gum_tin) by"), "{message}");
    scene.objects[1].mesh = Some("lost.obj".into());
    let message = scene.check(&catalog).expect_err("lost mesh").to_string();
    assert!(message.contains("mesh `lost.obj` is not in the scene"), "{message}");
}

#[test]
fn bodies_stand_where_the_scene_says() {
    let text = object("cracker_box", "position = [0.1, 0.2]\nyaw_deg = 90.0\nscale = [1.0, 1.0, 0.5]");
    let (scene, _) = parse(&format!("{HEAD}{text}")).expect("scene");
    let bodies = scene.bodies(&Catalog::standard()).expect("bodies");
    let bounds = bodies[0].solid.bounds_at(&bodies[0].world_from_body);
    let close = |a: f32, b: f32| (a - b).abs() < 1e-5;
    assert!(close(bounds.min.x, 0.1 - 0.079) && close(bounds.max.x, 0.1 + 0.079));
    assert!(close(bounds.min.y, 0.2 - 0.031) && close(bounds.max.z, 0.1035) && close(bounds.min.z, 0.0));
    assert!(close(bodies[0].mass_kg, 0.2055));
    let fill = scene.fill(&Catalog::standard()).expect("fill");
    assert!(close(fill, 0.062 * 0.158 / 0.32));
}

#[test]
fn meshes_replace_shapes_by_class_and_by_object() {
    let folder = tempfile::tempdir().expect("folder");
    let cube = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.06 0\nv 0 0.06 0\nv 0 0 0.2\nv 0.1 0 0.2\nv 0.1 0.06 0.2\nv 0 0.06 0.2\n\
                f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    std::fs::write(folder.path().join("cube.obj"), cube).expect("write");
    let millimetres = cube.replace("0.1", "100").replace("0.06", "60").replace("0.2", "200");
    std::fs::write(folder.path().join("mm.obj"), millimetres).expect("write");
    let text = format!(
        "{HEAD}[meshes]\nmilk_carton = \"cube.obj\"\n{}{}{}",
        object("milk_carton", "position = [0.0, 0.2]"),
        object("cereal_box", "position = [0.2, 0.2]\nmesh = \"mm.obj\""),
        object("cereal_box", "position = [-0.2, 0.2]"),
    );
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("write");
    let catalog = Catalog::standard();
    let (scene, warnings) = Scene::load(&path, &catalog).expect("scene");
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].starts_with("mesh of object 2 (cereal_box): not in metres: the largest edge of 200"));
    let sizes: Vec<_> = scene.bodies(&catalog).expect("bodies").iter().map(|body| body.solid.bounds().size()).collect();
    for (size, expected) in sizes.iter().zip([[0.1, 0.06, 0.2], [0.1, 0.06, 0.2], [0.06, 0.14, 0.22]]) {
        assert!((size - Vector::from(expected)).norm() < 1e-5, "{size:?}");
    }
    let again = folder.path().join("again.toml");
    scene.save_toml(&again).expect("saved");
    assert_eq!(Scene::load(&again, &catalog).expect("again").0, scene);
    let elsewhere = tempfile::tempdir().expect("folder");
    let message = scene.save_toml(&elsewhere.path().join("scene.toml")).expect_err("no meshes there").to_string();
    assert!(message.contains("save beside the meshes"), "{message}");
}

#[test]
fn a_scene_names_the_unit_of_a_mesh() {
    let folder = tempfile::tempdir().expect("folder");
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    std::fs::write(folder.path().join("cube.obj"), cube).expect("write");
    let path = folder.path().join("scene.toml");
    let named = |unit: &str| format!("{{ file = \"cube.obj\", unit = \"{unit}\" }}");
    let text = |of_class: &str, of_object: &str| {
        let own = object("cereal_box", &format!("position = [0.2, 0.2]\nmesh = {of_object}"));
        format!("{HEAD}[meshes]\nmilk_carton = {of_class}\n{}{own}", object("milk_carton", "position = [0.0, 0.2]"))
    };
    let catalog = Catalog::standard();
    let load = |text: String| {
        std::fs::write(&path, text).expect("write");
        Scene::load(&path, &catalog)
    };
    let (scene, warnings) = load(text(&named("dm"), &named("in"))).expect("scene");
    assert_eq!(warnings, Vec::<String>::new());
    for (body, edge) in scene.bodies(&catalog).expect("bodies").iter().zip([0.1, 0.0254]) {
        assert!((body.solid.bounds().size() - Vector::repeat(edge)).norm() < 1e-6);
    }
    assert_eq!(load(scene.to_toml()).expect("again").0, scene, "{}", scene.to_toml());
    let message = load(text(&named("parsec"), &named("in"))).expect_err("no unit").to_string();
    assert!(message.contains("line 6") && message.contains("parsec") && message.contains("`mm`"), "{message}");
    let twice = text(&named("dm"), &named("in")) + &object("gum_tin", "position = [-0.2, 0.2]\nmesh = \"cube.obj\"");
    let message = load(twice).expect_err("two units").to_string();
    assert!(message.contains("object 3 (gum_tin)") && message.contains("two units"), "{message}");
}

#[test]
fn numbers_beyond_an_arrays_end_are_no_longer_dropped() {
    let refused = |text: &str| parse(text).map(|_| ()).expect_err(text).to_string();
    let can = |lines: &str| format!("{HEAD}{}", object("tomato_can", lines));
    let message = refused(&can("position = [0.1, 0.2, 0.15]"));
    assert!(message.contains("object 1 (tomato_can)") && message.contains("3 numbers where 2 are needed"), "{message}");
    let message = refused(&can("position = [0,1, 0,2]"));
    assert!(message.contains("4 numbers where 2 are needed") && message.contains("decimal mark"), "{message}");
    assert!(refused(&can("position = [0.1, 0.2]\nscale = [1, 1, 1, 2]")).contains("4 numbers where 3 are needed"));
    let message = refused(&HEAD.replace("0.4]", "0.4, 0.4]"));
    assert!(message.contains("line 4") && message.contains("4 numbers where 3 are needed"), "{message}");
    let message = refused(&format!("{HEAD}[robot]\nbase = [0, -0.7, 0, 0]\n"));
    assert!(message.contains("4 numbers where 3 are needed"), "{message}");
}

#[test]
fn the_scene_of_scanned_objects_loads() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/ycb/shelf.toml");
    if !path.exists() {
        return;
    }
    let catalog = Catalog::standard();
    let (scene, warnings) = Scene::load(&path, &catalog).expect("scene");
    assert_eq!((scene.objects.len(), scene.meshes.len(), warnings.as_slice()), (15, 10, [].as_slice()));
    for body in scene.bodies(&catalog).expect("bodies") {
        let bounds = body.solid.bounds_at(&body.world_from_body);
        assert!(bounds.min.z.abs() < 1e-5);
        let size = bounds.size();
        assert!(size.max() < 0.27 && size.min() > 0.02, "{size:?}");
    }
}

#[test]
fn shipped_scenes_are_sound() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let catalog = Catalog::standard();
    let mut files: Vec<PathBuf> = Vec::new();
    for set in ["demo", "high"] {
        let entries = std::fs::read_dir(root.join(set)).expect("a shipped set");
        files.extend(entries.map(|entry| entry.expect("entry").path()));
    }
    assert!(files.len() >= 7);
    for file in files {
        let (scene, warnings) = Scene::load(&file, &catalog).expect("sound");
        assert!(warnings.is_empty() && !scene.description.is_empty(), "{}", file.display());
        assert_eq!(file.file_stem().and_then(|stem| stem.to_str()), Some(scene.name.as_str()));
    }
}

#[test]
fn problems_of_a_scene_in_the_making_are_all_told() {
    let (mut scene, _) = parse(&format!("{HEAD}{}", object("tomato_can", "position = [0, 0.2]"))).expect("scene");
    let catalog = Catalog::standard();
    assert_eq!(scene.problems(&catalog).expect("bodies"), []);
    scene.objects.push(Object::new("gum_tin", [0.06, 0.2], 0.0));
    scene.objects.push(Object::new("milk_carton", [0.39, 0.01], 0.0));
    let problems = scene.problems(&catalog).expect("bodies");
    let [Problem::Outside { object: 2, message }, Problem::Overlap { object: 1, other: 0, depth_m }] = &problems[..]
    else {
        panic!("{problems:?}");
    };
    assert!(message.contains("at the front") || message.contains("on the right"), "{message}");
    assert!((depth_m - 0.006).abs() < 0.000_1, "{depth_m}");
    scene.objects.push(Object::new("spoon", [0.0, 0.0], 0.0));
    assert!(scene.problems(&catalog).is_err());
}
