//! Clicks on the three-dimensional view of Why, each checked on the picture: the mark must be drawn where the pointer was.

use egui_kittest::Harness;
use image::RgbaImage;
use nudge::workbench::app::{App, Options};
use nudge::workbench::command::Command;
use nudge::workbench::model::{LayoutKind, Picked, StartForm};
use nudge::workbench::part::Part;
use nudge_core::belief::CLASSICAL;
use nudge_tests::root;
use re_viewer::external::egui::{Event, Modifiers, PointerButton, Pos2, Rect, lerp, vec2};
use std::time::{Duration, Instant};

/// How many clicks are made, and how many of them must open the voxel under the pointer.
const CLICKS: usize = 50;
const ENOUGH: usize = 49;
/// How far from the pointer the mark of a voxel may be, points: a voxel is about as large.
const NEAR: f32 = 14.0;

/// A window whose episode has looked twice, with the viewer, in a folder of its own.
fn window(folder: &std::path::Path) -> Harness<'static, App> {
    let options = Options { out: folder.join("out"), scenes: root().join("scenes/demo"), ..Options::default() };
    let setup = re_viewer::native::eframe_options(None).wgpu_options.wgpu_setup;
    let mut harness = Harness::<App>::builder()
        .with_size(vec2(1280.0, 800.0))
        .wgpu_setup(setup)
        .build_eframe(move |cc| App::new(cc, options.clone()));
    let form = &mut harness.state_mut().model.kept.form;
    *form = StartForm { budget: 2, ..form.clone().with_belief(CLASSICAL) };
    harness.state_mut().ask(Command::Open(root().join("scenes/demo/behind-the-boxes.toml")));
    rest(&mut harness);
    harness.state_mut().ask(Command::Run);
    rest(&mut harness);
    harness
}

/// Runs frames until nothing is under way, and what was logged is drawn.
fn rest(harness: &mut Harness<'_, App>) {
    let started = Instant::now();
    let mut calm = 0;
    while calm < 8 {
        assert!(started.elapsed() < Duration::from_secs(300), "the window never came to rest");
        harness.step();
        calm = if harness.state().is_busy() { 0 } else { calm + 1 };
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A click as a hasty person makes it: the pointer is there and pressed within one frame.
fn click(harness: &mut Harness<'_, App>, at: Pos2) {
    let button =
        |pressed| Event::PointerButton { pos: at, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE };
    harness.event(Event::PointerMoved(at));
    harness.step();
    harness.event(button(true));
    harness.event(button(false));
    rest(harness);
}

/// Whether the mark, which is pink, is drawn near a place.
fn is_marked(picture: &RgbaImage, at: Pos2) -> bool {
    picture.enumerate_pixels().any(|(x, y, pixel)| {
        let [r, g, b, _] = pixel.0;
        let is_pink = r > 190 && g < 130 && (90..220).contains(&b);
        is_pink && vec2(x as f32 - at.x, y as f32 - at.y).length() < NEAR
    })
}

#[test]
fn every_click_in_why_opens_the_voxel_under_the_pointer() {
    let folder = tempfile::tempdir().expect("folder");
    let mut harness = window(folder.path());
    harness.state_mut().ask(Command::Layout(LayoutKind::Why));
    rest(&mut harness);
    let space = harness.state().place_of(Part::Space).expect("views");
    // Over the shelf, which is in the middle; truth is outlined in front of many voxels.
    let shelf = Rect::from_center_size(space.center(), space.size() * vec2(0.55, 0.35));
    let (mut voxels, mut cells, mut beside, mut missed) = (0, 0, 0, Vec::new());
    let mut at = 0_u32;
    while voxels < CLICKS && at < 6 * CLICKS as u32 {
        at += 1;
        // Evenly spread, in no order.
        let share = |step: f32| (at as f32 * step).fract();
        let place = Pos2::new(lerp(shelf.x_range(), share(0.618_034)), lerp(shelf.y_range(), share(0.754_877)));
        harness.state_mut().model.picked = None;
        click(&mut harness, place);
        match harness.state().model.picked {
            Some(Picked::Voxel(_)) => {
                voxels += 1;
                let picture = harness.render().expect("a picture");
                if !is_marked(&picture, place) {
                    missed.push(place);
                }
            }
            Some(Picked::Cell(_)) => cells += 1,
            // The back of the shelf, or beside it: nothing is believed there.
            None => beside += 1,
        }
    }
    let told = format!("{voxels} voxels, {cells} cells, {beside} beside, missed {missed:?}");
    assert!(voxels == CLICKS && cells > 0 && missed.len() <= CLICKS - ENOUGH, "{told}");
    // The mark belongs to Why.
    let marked = |harness: &mut Harness<'_, App>| {
        let picture = harness.render().expect("a picture");
        picture.enumerate_pixels().any(|(x, y, pixel)| {
            let [r, g, b, _] = pixel.0;
            space.contains(Pos2::new(x as f32, y as f32)) && r > 240 && g < 80 && (130..190).contains(&b)
        })
    };
    assert!(marked(&mut harness), "the mark in Why");
    harness.state_mut().ask(Command::Layout(LayoutKind::Gains));
    rest(&mut harness);
    assert!(!marked(&mut harness), "no mark in Gains");
}
