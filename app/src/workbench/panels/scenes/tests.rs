use super::*;
use crate::workbench::browser::{About, Folders};
use crate::workbench::panels::photo;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};

fn scenes(folder: &Path) -> Folders {
    Folders { scenes: folder.to_owned(), ..Folders::default() }
}

struct Stage {
    model: Model,
    asked: Vec<Command>,
}

/// A folder with two sound scenes and a broken one.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("folder");
    let scene = |name: &str, class: &str| {
        format!(
            "format = 1\nname = \"{name}\"\ndescription = \"about {name}\"\n\n[shelf]\nsize = [0.8, 0.4, 0.4]\n\n\
             [[object]]\nclass = \"{class}\"\nposition = [0.0, 0.2]\n"
        )
    };
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("folder")).expect("made");
        std::fs::write(path, text).expect("written");
    };
    write("easy/alpha.toml", &scene("alpha", "tomato_can"));
    write("hard/beta.toml", &scene("beta", "gum_tin"));
    write("hard/broken.toml", "format = 1\nname = 3\n");
    write("hard/notes.txt", "not a scene");
    folder
}

fn harness(folder: &Path) -> Harness<'static, Stage> {
    let draw = |ui: &mut egui::Ui, stage: &mut Stage| show(ui, &mut stage.model, &mut stage.asked);
    let model = Model { browser: Browser::of(scenes(folder)), ..Model::default() };
    let mut harness = Harness::builder().with_size([900.0, 700.0]).build_ui_state(draw, Stage { model, asked: vec![] });
    wait_for(&mut harness, "alpha, 1 object, 0 hidden");
    wait_for(&mut harness, "beta, 1 object, 0 hidden");
    wait_for(&mut harness, "cannot be read");
    harness
}

fn wait_for(harness: &mut Harness<'_, Stage>, text: &str) {
    for _ in 0..2_400 {
        harness.run_steps(1);
        if harness.query_all_by_label_contains(text).next().is_some() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    panic!("`{text}` did not come");
}

#[test]
fn scenes_are_found_looked_at_and_chosen_and_a_broken_one_says_why() {
    let folder = folder();
    let mut harness = harness(folder.path());
    let card = harness.query_all_by_label_contains("cannot be read").next().expect("card");
    assert!(card.accesskit_node().label().is_some_and(|label| label.contains("broken.toml: line 2")));
    card.click();
    harness.run_steps(2);
    assert!(matches!(&harness.state().asked[..], [Command::Tell(Level::Error, text)] if text.contains("broken.toml")));
    assert_eq!(harness.state().model.kept.form.scene, None);

    harness.get_by_label("beta, 1 object, 0 hidden").click();
    harness.run_steps(2);
    assert_eq!(harness.state().model.kept.form.scene, Some(folder.path().join("hard/beta.toml")));
    harness.get_by_label("Start").click();
    harness.run_steps(2);
    assert!(matches!(harness.state().asked[..], [.., Command::Start]));
    harness.get_by_label("Edit").click();
    harness.run_steps(2);
    assert!(matches!(harness.state().asked[..], [.., Command::Layout(LayoutKind::Author)]));
    assert_eq!(harness.state().model.author.scene().name, "beta");
}

#[test]
fn searching_leaves_what_matches_and_a_typed_path_opens() {
    let folder = folder();
    let mut harness = harness(folder.path());
    harness.state_mut().model.browser.search = "about ALPHA".to_owned();
    harness.run_steps(2);
    assert!(harness.query_by_label("alpha, 1 object, 0 hidden").is_some());
    assert!(harness.query_by_label("beta, 1 object, 0 hidden").is_none());
    harness.state_mut().model.browser.search = "nothing like it".to_owned();
    harness.run_steps(2);
    assert!(harness.query_all_by_label_contains("Nothing matches").next().is_some());
    harness.state_mut().model.browser.typed = "some/where.toml".to_owned();
    harness.run_steps(2);
    harness.get_by_label("Open path").click();
    harness.run_steps(2);
    assert!(matches!(&harness.state().asked[..], [Command::Open(path)] if path == Path::new("some/where.toml")));
}

#[test]
fn what_a_search_hits_by_name_comes_before_what_it_hits_by_path() {
    let folder = folder();
    let path = folder.path().join("beta");
    std::fs::create_dir_all(&path).expect("made");
    std::fs::copy(folder.path().join("easy/alpha.toml"), path.join("alpha.toml")).expect("copied");
    let mut harness = harness(folder.path());
    harness.state_mut().model.browser.search = "beta".to_owned();
    harness.run_steps(2);
    assert!(harness.query_by_label("2 hits, the best first").is_some());
    let top = |label: &str| harness.query_all_by_label(label).next().expect("a card").rect().left_top();
    let (by_name, by_path) = (top("beta, 1 object, 0 hidden"), top("alpha, 1 object, 0 hidden"));
    assert!((by_name.y, by_name.x) < (by_path.y, by_path.x), "{by_name:?} {by_path:?}");
}

#[test]
fn a_recording_comes_before_the_scenes_and_a_click_opens_it() {
    let folder = folder();
    let out = folder.path().join("out");
    std::fs::create_dir_all(&out).expect("made");
    std::fs::write(out.join("loose.rrd"), "a recording").expect("written");
    let draw = |ui: &mut egui::Ui, stage: &mut Stage| show(ui, &mut stage.model, &mut stage.asked);
    let folders = Folders { episodes: Some(out.clone()), ..scenes(folder.path()) };
    let model = Model { browser: Browser::of(folders), ..Model::default() };
    let mut harness = Harness::builder().with_size([900.0, 700.0]).build_ui_state(draw, Stage { model, asked: vec![] });
    wait_for(&mut harness, "loose, recording");
    wait_for(&mut harness, "alpha, 1 object, 0 hidden");
    let top = |text: &str| harness.query_all_by_label_contains(text).next().expect("a card").rect().top();
    assert!(top("loose, recording") < top("alpha, 1 object"));
    harness.query_all_by_label_contains("loose, recording").next().expect("a card").click();
    harness.run_steps(2);
    assert!(matches!(&harness.state().asked[..], [Command::Open(path)] if *path == out.join("loose.rrd")));
}

#[test]
fn a_folder_without_scenes_says_so() {
    let folder = tempfile::tempdir().expect("folder");
    let draw = |ui: &mut egui::Ui, stage: &mut Stage| show(ui, &mut stage.model, &mut stage.asked);
    let model = Model { browser: Browser::of(scenes(&folder.path().join("none"))), ..Model::default() };
    let mut harness = Harness::builder().with_size([700.0, 500.0]).build_ui_state(draw, Stage { model, asked: vec![] });
    wait_for(&mut harness, "No scenes here");
}

#[test]
#[ignore = "writes pictures; needs a wgpu adapter"]
fn pictures() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("workspace");
    let broken = folder();
    let mut model = Model { browser: Browser::of(scenes(&root.join("scenes"))), ..Model::default() };
    model.kept.form.scene = Some(root.join("scenes/high/tunnel.toml"));
    model.kept.recent = vec![broken.path().join("hard/broken.toml")];
    let draw = |ui: &mut egui::Ui, stage: &mut Stage| show(ui, &mut stage.model, &mut stage.asked);
    let is_known = |stage: &Stage| {
        let entries = stage.model.browser.entries();
        let is_known = |entry: &Entry| match &entry.look {
            Look::Unknown => false,
            Look::Sound(facts) => !matches!(facts.text.about, About::Scene { hidden: None, .. }),
            Look::Broken(_) => true,
        };
        !entries.is_empty() && entries.iter().all(is_known)
    };
    photo::take("scenes", [960.0, 900.0], Stage { model, asked: Vec::new() }, draw, is_known);
}
