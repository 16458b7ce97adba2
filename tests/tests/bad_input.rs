//! Bad input: one line that names the file and the place, exit code 2, nothing half-written.

use nudge_tests::{Folder, nudge, nudge_fails, nudge_ok, text};
use std::path::Path;

fn scene(objects: &str) -> String {
    format!("format = 1\nname = \"t\"\n[shelf]\nsize = [0.8, 0.4, 0.4]\n{objects}")
}

/// Runs an episode that must fail before it writes anything, and expects all of `words` in the line.
fn refuses(folder: &Folder, file: &str, words: &[&str]) {
    let out = folder.path("out");
    let line = nudge_fails(2, &["run", file, "--belief", "classical", "--out", out.to_str().expect("utf-8")]);
    for word in words {
        assert!(line.contains(word), "{word:?} is not in: {line}");
    }
    assert!(!out.exists(), "{} was half-written", out.display());
}

#[test]
fn scenes_that_are_no_scenes() {
    let folder = Folder::new();
    let can = "[[object]]\nclass = \"tomato_can\"\nposition = [0.0, 0.2]\n";
    let cases: &[(&str, String, &[&str])] = &[
        ("broken", "format = 1\nname = \"t\n".into(), &["broken.toml", "line 2"]),
        ("class", scene("[[object]]\nclass = \"teapot\"\nposition = [0.0, 0.2]\n"), &["line 6", "teapot"]),
        ("key", scene(&format!("{can}colour = 3\n")), &["line 8", "colour"]),
        ("format", scene("").replace("format = 1", "format = 7"), &["line 1", "format", "7"]),
        (
            "nan",
            scene("[[object]]\nclass = \"tomato_can\"\nposition = [nan, 0.2]\n"),
            &["line 7", "object 1", "tomato_can"],
        ),
        ("huge", scene("[[object]]\nclass = \"tomato_can\"\nposition = [1e30, 0.2]\n"), &["line 7", "object 1"]),
        ("scale", scene(&format!("{can}scale = [0.0, 1.0, 1.0]\n")), &["line 8", "scale"]),
        ("overlap", scene(&format!("{can}{can}")), &["object 2", "object 1", "overlap"]),
        ("outside", scene("[[object]]\nclass = \"tomato_can\"\nposition = [0.39, 0.2]\n"), &["object 1", "outside"]),
        ("shelf", scene("").replace("[0.8, 0.4, 0.4]", "[800.0, 400.0, 400.0]"), &["size"]),
    ];
    for (name, content, words) in cases {
        let file = folder.write(&format!("{name}.toml"), content);
        refuses(&folder, &file, words);
    }
    refuses(&folder, "/nowhere/at/all.toml", &["/nowhere/at/all.toml"]);
}

#[test]
fn a_scene_without_objects_runs_with_a_warning() {
    let folder = Folder::new();
    let file = folder.write("empty.toml", scene(""));
    let out = folder.path("out");
    let output =
        nudge(&["run", &file, "--belief", "classical", "--budget", "2", "--out", out.to_str().expect("utf-8")]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("warning: ") && text(&output.stderr).contains("no objects"));
}

#[test]
fn meshes_that_are_no_meshes() {
    let folder = Folder::new();
    let file = folder.write("nothing.obj", "# nothing\n");
    assert!(nudge_fails(2, &["mesh", &file]).contains("nothing.obj"));
    let file = folder.write("open.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n");
    assert!(nudge_fails(2, &["mesh", &file]).contains("open"));
    let file = folder.write("prose.stl", "this is not a mesh\n");
    assert!(nudge_fails(2, &["mesh", &file]).contains("prose.stl"));
    let file = folder.write("picture.bmp", "BM");
    assert!(nudge_fails(2, &["mesh", &file]).contains("picture.bmp"));
    let box_mm = "v 0 0 0\nv 100 0 0\nv 100 60 0\nv 0 60 0\nv 0 0 200\nv 100 0 200\nv 100 60 200\nv 0 60 200\n\
        f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n";
    let file = folder.write("box.obj", box_mm);
    let output = nudge(&["mesh", &file]);
    assert!(output.status.success() && text(&output.stderr).contains("millimetres"), "{}", text(&output.stderr));
}

#[test]
fn a_gigantic_mesh_is_refused() {
    let folder = Folder::new();
    let mut content = String::from("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\n");
    content.push_str(&"f 1 2 3\n".repeat(1_000_000));
    let file = folder.write("gigantic.obj", &content);
    assert!(nudge_fails(2, &["mesh", &file]).contains("triangles"));
}

#[test]
fn output_folders_that_cannot_be_written() {
    let folder = Folder::new();
    let file = folder.write("a.toml", scene("[[object]]\nclass = \"tomato_can\"\nposition = [0.0, 0.2]\n"));
    let blocked = folder.write("file", "not a folder");
    let line =
        nudge_fails(2, &["run", &file, "--belief", "classical", "--budget", "1", "--out", &format!("{blocked}/out")]);
    assert!(line.contains(&blocked), "{line}");
    // Nothing can be created below /proc; the system's reason is told once.
    if Path::new("/proc").exists() {
        let line = nudge_fails(2, &["run", &file, "--belief", "classical", "--budget", "1", "--out", "/proc/nudge"]);
        assert!(line.contains("/proc/nudge") && line.matches("os error").count() == 1, "{line}");
    }
    let foreign = folder.path("foreign");
    std::fs::create_dir(&foreign).expect("create");
    std::fs::write(foreign.join("thesis.tex"), "years of work").expect("write");
    let line =
        nudge_fails(2, &["run", &file, "--belief", "classical", "--force", "--out", foreign.to_str().expect("utf-8")]);
    assert!(line.contains("foreign"), "{line}");
    assert!(foreign.join("thesis.tex").exists());
}

#[test]
fn truncated_episodes() {
    let folder = Folder::new();
    let file = folder.write("a.toml", scene("[[object]]\nclass = \"tomato_can\"\nposition = [0.0, 0.2]\n"));
    let out = folder.path("e");
    let dir = out.to_str().expect("utf-8");
    nudge_ok(&["run", &file, "--belief", "classical", "--budget", "1", "--out", dir]);
    let json = std::fs::read_to_string(out.join("episode.json")).expect("read");
    std::fs::write(out.join("episode.json"), &json[..json.len() / 2]).expect("truncate");
    assert!(nudge_fails(2, &["replay", dir]).contains("episode.json"));
    std::fs::write(out.join("episode.json"), &json).expect("restore");
    let npz = std::fs::read(out.join("beliefs/001.npz")).expect("read");
    std::fs::write(out.join("beliefs/001.npz"), &npz[..npz.len() / 2]).expect("truncate");
    assert!(nudge_fails(2, &["replay", dir]).contains("001.npz"));
    assert!(nudge_fails(2, &["replay", "/nowhere"]).contains("/nowhere"));
}

#[test]
fn wrong_use() {
    let line = nudge(&["run", "scenes/high/box-wall.toml", "--policy", "clever"]);
    assert_eq!(line.status.code(), Some(2));
    assert!(text(&line.stderr).contains("mem-no-push"), "the known policies are shown: {}", text(&line.stderr));
    assert_eq!(nudge(&["dance"]).status.code(), Some(2));
    assert!(nudge_fails(2, &["views", "--array", "nowhere"]).contains("nowhere"));
}

#[test]
fn a_device_that_is_not_there_is_refused_before_anything_is_written() {
    let folder = Folder::new();
    let out = folder.path("e");
    let out = out.to_str().expect("utf-8");
    let line = nudge_fails(2, &["run", "scenes/high/key-blocker.toml", "--device", "gpu", "--out", out]);
    assert!(line.contains("unknown device \"gpu\"; there are auto, cpu, cuda"), "{line}");
    let line = nudge_fails(2, &["bench", "scenes/high", "--device", "tpu", "--out", out]);
    assert!(line.contains("unknown device \"tpu\""), "{line}");
    assert!(!std::path::Path::new(out).exists(), "half-written");
}
