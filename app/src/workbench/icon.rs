//! The window's icon, the same drawing that desktops show.

use re_viewer::external::egui::IconData;
use resvg::{tiny_skia, usvg};

const DRAWING: &str = include_str!("../../../assets/icons/nudge.svg");
const SIZE_PX: u32 = 128;

/// The icon. Without one where the drawing cannot be drawn, which a test rules out.
pub(super) fn icon() -> IconData {
    draw().unwrap_or_default()
}

fn draw() -> Option<IconData> {
    let tree = usvg::Tree::from_str(DRAWING, &usvg::Options::default()).ok()?;
    let mut pixels = tiny_skia::Pixmap::new(SIZE_PX, SIZE_PX)?;
    let scale = SIZE_PX as f32 / tree.size().width();
    resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixels.as_mut());
    let rgba = pixels.pixels().iter().map(|pixel| pixel.demultiply());
    let rgba = rgba.flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue(), pixel.alpha()]).collect();
    Some(IconData { rgba, width: SIZE_PX, height: SIZE_PX })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_icon_is_drawn_with_clear_corners() {
        let icon = draw().expect("a drawing");
        let at = |x: u32, y: u32| &icon.rgba[4 * (y * icon.width + x) as usize..][..4];
        assert_eq!(icon.rgba.len(), 4 * (SIZE_PX * SIZE_PX) as usize);
        assert_eq!(at(0, 0)[3], 0);
        assert_eq!(at(64, 80), [0xf2, 0xa3, 0x3c, 0xff]);
    }
}
