//! Pictures on the graphics card, by what they show: painted once, kept while they may be asked for again.

use crate::picture::RgbImage;
use re_viewer::external::egui::{ColorImage, Context, TextureHandle, TextureOptions};

/// How many pictures of a panel are kept: enough to step back and forth without painting again.
const KEPT: usize = 32;

/// The pictures of a panel, the one asked for last at the end.
pub struct Textures<K> {
    kept: Vec<(K, TextureHandle)>,
}

impl<K> Default for Textures<K> {
    fn default() -> Self {
        Self { kept: Vec::new() }
    }
}

impl<K: PartialEq> Textures<K> {
    /// The picture of a key; `paint` makes it if it is not kept. Pixels stay squares.
    pub fn get(&mut self, ctx: &Context, key: K, paint: impl FnOnce() -> ColorImage) -> TextureHandle {
        self.get_with(ctx, key, TextureOptions::NEAREST, paint)
    }

    /// As [`Textures::get`], with another filter.
    pub fn get_with(
        &mut self,
        ctx: &Context,
        key: K,
        options: TextureOptions,
        paint: impl FnOnce() -> ColorImage,
    ) -> TextureHandle {
        if let Some(at) = self.kept.iter().position(|(known, _)| *known == key) {
            let found = self.kept.remove(at);
            self.kept.push(found);
        } else {
            if self.kept.len() == KEPT {
                drop(self.kept.remove(0));
            }
            self.kept.push((key, ctx.load_texture("panel", paint(), options)));
        }
        self.kept[self.kept.len() - 1].1.clone()
    }
}

/// A painted picture as egui takes it.
pub fn of_rgb(picture: &RgbImage) -> ColorImage {
    ColorImage::from_rgb([picture.width() as usize, picture.height() as usize], picture.as_raw())
}

#[cfg(test)]
mod tests {
    use super::*;
    use re_viewer::external::egui::Color32;

    #[test]
    fn a_picture_is_painted_once_and_the_oldest_go() {
        let (ctx, mut textures, mut painted) = (Context::default(), Textures::<usize>::default(), 0);
        let mut ask = |key: usize| {
            let _picture = textures.get(&ctx, key, || {
                painted += 1;
                ColorImage::filled([2, 2], Color32::WHITE)
            });
            painted
        };
        assert_eq!((ask(0), ask(1), ask(0)), (1, 2, 2));
        for key in 2..=KEPT {
            ask(key);
        }
        // 1 was asked for longest ago, so it had to go; 0 is still there.
        assert_eq!(ask(0), KEPT + 1);
        assert_eq!(ask(1), KEPT + 2);
    }
}
