use super::*;
use std::sync::mpsc::channel;

fn with(classes: &[(&str, [f32; 2])]) -> Author {
    let mut author = Author { snap: Snap::Off, ..Author::default() };
    for (class, position) in classes {
        author.add_at(class, *position);
    }
    author
}

fn positions(author: &Author) -> Vec<[f32; 2]> {
    author.scene().objects.iter().map(|object| object.position).collect()
}

#[test]
fn a_drag_is_one_step_and_comes_back_with_undo() {
    let mut author = with(&[("tomato_can", [0.0, 0.2]), ("gum_tin", [0.2, 0.2])]);
    author.snap = Snap::TenMillimetres;
    author.take_hold([0.01, 0.21], Choose::Only);
    for i in 1..20 {
        author.drag_to([0.01 + 0.004 * i as f32, 0.21], author.snap);
    }
    author.end_gesture();
    assert_eq!(positions(&author), [[0.08, 0.2], [0.2, 0.2]], "the grabbed object snaps to 10 mm");
    author.undo();
    assert_eq!(positions(&author)[0], [0.0, 0.2]);
    author.redo();
    assert_eq!(positions(&author)[0], [0.08, 0.2]);
    author.undo();
    author.undo();
    assert_eq!(author.scene().objects.len(), 1);
}

#[test]
fn what_is_chosen_moves_together_and_a_cancelled_drag_leaves_no_step() {
    let mut author = with(&[("tomato_can", [0.0, 0.2]), ("gum_tin", [0.2, 0.2]), ("milk_carton", [-0.3, 0.3])]);
    author.choose_all([0, 1]);
    author.take_hold([0.2, 0.2], Choose::Only);
    author.drag_to([0.25, 0.1], Snap::Off);
    assert_eq!(positions(&author), [[0.05, 0.1], [0.25, 0.1], [-0.3, 0.3]]);
    author.cancel_gesture();
    assert_eq!(positions(&author), [[0.0, 0.2], [0.2, 0.2], [-0.3, 0.3]]);
    author.undo();
    assert_eq!(author.scene().objects.len(), 2, "the step before the drag, which was the third object");
}

#[test]
fn a_band_chooses_what_lies_within() {
    let mut author = with(&[("tomato_can", [0.0, 0.2]), ("gum_tin", [0.2, 0.2]), ("milk_carton", [-0.3, 0.3])]);
    author.choose_none();
    author.take_hold([-0.05, 0.1], Choose::Only);
    author.drag_to([0.25, 0.3], Snap::Off);
    author.end_gesture();
    assert_eq!(author.selection().iter().copied().collect::<Vec<_>>(), [0, 1]);
    author.take_hold([0.3, 0.05], Choose::Toggle);
    author.drag_to([-0.39, 0.39], Snap::Off);
    author.end_gesture();
    assert_eq!(author.selection().len(), 3);
}

#[test]
fn turning_by_the_handle_snaps_to_fifteen_degrees() {
    let mut author = with(&[("cereal_box", [0.0, 0.2])]);
    author.take_handle(0, [0.0, 0.4]);
    author.drag_to([-0.2, 0.38], Snap::FiveMillimetres);
    assert_eq!(author.scene().objects[0].yaw_deg, 45.0);
    author.drag_to([-0.2, 0.2], Snap::Off);
    author.end_gesture();
    assert_eq!(author.scene().objects[0].yaw_deg, 90.0);
    author.undo();
    assert_eq!(author.scene().objects[0].yaw_deg, 0.0);
    author.turn(-1.0);
    assert_eq!(author.scene().objects[0].yaw_deg, -15.0);
}

#[test]
fn overlaps_and_what_stands_outside_are_told_in_words_and_not_saved() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("mine.toml");
    let mut author = with(&[("tomato_can", [0.0, 0.2]), ("gum_tin", [0.06, 0.2]), ("milk_carton", [0.39, 0.2])]);
    let words = |author: &Author, at: usize| author.plan().problems.get(&at).cloned().unwrap_or_default();
    assert_eq!(words(&author, 0), ["overlaps gum_tin#1 by 6.0 mm"]);
    assert_eq!(words(&author, 1), ["overlaps tomato_can#0 by 6.0 mm"]);
    assert_eq!(words(&author, 2), ["stands outside the shelf on the right by 25.0 mm"]);
    let refused = author.save_as(&path).expect_err("problems").to_string();
    assert_eq!(refused, "new-scene was not saved: tomato_can#0 overlaps gum_tin#1 by 6.0 mm, and 2 more");
    assert!(!path.exists() && author.is_unsaved() && author.path().is_none());

    author.choose_all([1, 2]);
    author.delete();
    assert!(author.is_sound());
    author.save_as(&path).expect("saved");
    assert!(!author.is_unsaved());
    let (read, _) = Scene::load(&path, author.catalog()).expect("loads");
    assert_eq!(&read, author.scene());
    assert_eq!(read.name, "mine", "named after its file");
    author.undo();
    assert!(author.is_unsaved());
}

#[test]
fn added_and_duplicated_objects_find_room_and_positions_stay_short_in_files() {
    let mut author = Author::default();
    for class in ["milk_carton", "pasta_box", "chips_can", "milk_carton"] {
        author.add(class);
    }
    author.duplicate();
    author.choose_all(0..2);
    author.duplicate();
    assert_eq!(author.scene().objects.len(), 7);
    assert_eq!(author.selection().iter().copied().collect::<Vec<_>>(), [5, 6]);
    assert!(author.is_sound(), "{:?}", author.plan().problems);
    author.undo();
    assert_eq!(author.scene().objects.len(), 5, "two copies are one step");
    author.choose_all(0..5);
    for _ in 0..7 {
        author.nudge([1.0, 0.0]);
    }
    let toml = author.scene().to_toml();
    let long =
        toml.lines().find(|line| line.starts_with("position") && line.len() > "position = [-0.1234, 0.1234]".len());
    assert_eq!(long, None);
}

#[test]
fn fields_that_change_many_times_are_one_step() {
    let mut author = with(&[("tomato_can", [0.0, 0.2])]);
    for scale in [1.1, 1.2, 1.3] {
        author.change_selected(Edit::Field("Scale x"), |object| object.scale[0] = scale);
    }
    author.settle();
    author.change_class("gum_tin");
    author.undo();
    assert_eq!((author.scene().objects[0].class.as_str(), author.scene().objects[0].scale[0]), ("tomato_can", 1.3));
    author.undo();
    assert_eq!(author.scene().objects[0].scale[0], 1.0);
}

#[test]
fn hidden_objects_are_counted_for_the_latest_scene() {
    let (woken, wakes) = channel();
    let mut author = with(&[("pasta_box", [0.0, 0.1])]);
    author.wake_with(Arc::new(move || woken.send(()).unwrap_or_default()));
    author.add_at("gelatin_box", [0.0, 0.18]);
    while author.hidden().is_stale || author.hidden().objects.is_none() {
        wakes.recv_timeout(std::time::Duration::from_secs(120)).expect("counted");
        author.poll();
    }
    assert_eq!(author.hidden().objects, Some([1].into()), "a gelatin box behind a pasta box");
}

#[test]
fn generating_keeps_what_stands_and_is_one_step() {
    let (woken, wakes) = channel();
    let mut author = with(&[("pasta_box", [0.0, 0.1])]);
    author.wake_with(Arc::new(move || woken.send(()).unwrap_or_default()));
    author.fill = FillForm { fill: 0.25, rho: 0.0, seed: 4 };
    author.generate();
    let added = loop {
        wakes.recv_timeout(std::time::Duration::from_secs(120)).expect("generated");
        if let Some(added) = author.poll_generated() {
            break added.expect("room");
        }
    };
    assert!(added > 3 && author.scene().objects.len() == added + 1);
    assert_eq!(author.scene().objects[0].class, "pasta_box");
    assert!(author.is_sound());
    assert_eq!(author.fill.seed, 5);
    author.undo();
    assert_eq!(author.scene().objects.len(), 1);
}

#[test]
fn a_broken_file_is_told_and_the_open_scene_stays() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("broken.toml");
    std::fs::write(&path, "format = 1\nname = \"x\"\nshelf = 3\n").expect("written");
    let mut author = with(&[("tomato_can", [0.0, 0.2])]);
    assert!(author.open(&path).expect_err("broken").to_string().contains("broken.toml: line 3"));
    assert_eq!(author.scene().objects.len(), 1);
}
