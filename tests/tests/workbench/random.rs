//! Random input.

use super::window::{SCENE, Window};
use nudge::workbench::command::Command;
use nudge_tests::root;
use re_viewer::external::egui::{self, Event, Key, Modifiers, PointerButton, pos2, vec2};

#[test]
fn two_thousand_random_events_never_panic() {
    let mut window = Window::with_scenes(&tempfile::tempdir().expect("folder").keep());
    window.app().model.kept.form.budget = 3;
    window.open(&root().join(SCENE));
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut random = move |below: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state % below
    };
    // Keys that open the system's dialogs or end the program are left out.
    let keys = [
        Key::A,
        Key::D,
        Key::R,
        Key::Enter,
        Key::Escape,
        Key::Tab,
        Key::Space,
        Key::Comma,
        Key::Period,
        Key::Home,
        Key::End,
        Key::Delete,
        Key::ArrowLeft,
        Key::ArrowUp,
        Key::F1,
        Key::Num1,
        Key::Num2,
        Key::Num3,
        Key::Num4,
        Key::Num5,
        Key::Num6,
        Key::Z,
        Key::B,
        Key::L,
    ];
    for _ in 0..2_000 {
        let at = pos2(random(1440) as f32, random(900) as f32);
        let modifiers = [Modifiers::NONE, Modifiers::NONE, Modifiers::COMMAND, Modifiers::SHIFT][random(4) as usize];
        let event = match random(6) {
            0 => Event::Key {
                key: keys[random(keys.len() as u64) as usize],
                physical_key: None,
                pressed: random(2) == 0,
                repeat: false,
                modifiers,
            },
            1 => Event::Text(["7", "x", "0.3", "ü"][random(4) as usize].to_owned()),
            2 => Event::MouseWheel {
                unit: egui::MouseWheelUnit::Point,
                delta: vec2(0.0, random(200) as f32 - 100.0),
                phase: egui::TouchPhase::Move,
                modifiers,
            },
            _ => Event::PointerButton { pos: at, button: PointerButton::Primary, pressed: random(2) == 0, modifiers },
        };
        // Menus whose entries would wait for a person are at the top; the pointer keeps away from them.
        if at.y < 26.0 {
            continue;
        }
        window.harness.event(Event::PointerMoved(at));
        window.harness.event(event);
        window.harness.step();
    }
    window.app().ask(Command::Cancel);
    window.wait();
}
