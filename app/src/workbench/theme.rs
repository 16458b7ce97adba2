//! Text that everybody can read: sizes and colours of both themes, on top of the viewer's own style.
//!
//! Contrast is the ratio of two relative luminances as WCAG 2.2 defines it (1 for equal colours, 21 for black on white); its
//! level AA asks for [`LEAST_CONTRAST`] between text and what lies behind it.

use re_viewer::external::egui::{Color32, Context, Style, Visuals};

/// Contrast that all text has, but for that of controls that are switched off.
pub const LEAST_CONTRAST: f32 = 4.5;
/// Height of the smallest text, points.
pub const LEAST_SIZE: f32 = 12.0;

/// Makes both themes of a window legible; to be called once the viewer has set its style.
pub fn apply(ctx: &Context) {
    ctx.all_styles_mut(legible);
}

/// Raises sizes to [`LEAST_SIZE`] and moves text colours away from their grounds, no farther than [`LEAST_CONTRAST`] asks for.
fn legible(style: &mut Style) {
    for font in style.text_styles.values_mut() {
        font.size = font.size.max(LEAST_SIZE);
    }
    let visuals = &mut style.visuals;
    let grounds = grounds(visuals);
    let readable = |colour: Color32| readable(colour, &grounds, visuals.dark_mode);
    let weak = readable(visuals.weak_text_color());
    let (error, warning) = (readable(visuals.error_fg_color), readable(visuals.warn_fg_color));
    let link = readable(visuals.hyperlink_color);
    let [plain, button] =
        [visuals.widgets.noninteractive, visuals.widgets.inactive].map(|w| readable(w.fg_stroke.color));
    visuals.weak_text_color = Some(weak);
    (visuals.error_fg_color, visuals.warn_fg_color, visuals.hyperlink_color) = (error, warning, link);
    (visuals.widgets.noninteractive.fg_stroke.color, visuals.widgets.inactive.fg_stroke.color) = (plain, button);
}

/// What text lies on: panels, windows, stripes of tables, fields.
fn grounds(visuals: &Visuals) -> [Color32; 5] {
    let panel = visuals.panel_fill;
    let over = |colour: Color32| panel.blend(colour);
    [
        panel,
        over(visuals.window_fill),
        over(visuals.faint_bg_color),
        over(visuals.extreme_bg_color),
        over(visuals.text_edit_bg_color()),
    ]
}

/// A colour, opaque, moved towards white on dark grounds or black on light ones until it can be read on all of them.
fn readable(colour: Color32, grounds: &[Color32], on_dark: bool) -> Color32 {
    const STEPS: u8 = 64;
    let colour = grounds.first().map_or(colour, |panel| panel.blend(colour));
    let far = if on_dark { Color32::WHITE } else { Color32::BLACK };
    (0..=STEPS)
        .map(|step| colour.lerp_to_gamma(far, f32::from(step) / f32::from(STEPS)))
        .find(|colour| grounds.iter().all(|ground| contrast(*colour, *ground) >= LEAST_CONTRAST))
        .unwrap_or(far)
}

/// Contrast of two opaque colours, 1 to 21.
pub fn contrast(a: Color32, b: Color32) -> f32 {
    let [a, b] = [luminance(a), luminance(b)];
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

/// Relative luminance of an opaque sRGB colour, 0 to 1.
fn luminance(colour: Color32) -> f32 {
    let linear = |channel: u8| {
        let value = f32::from(channel) / 255.0;
        if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    0.2126 * linear(colour.r()) + 0.7152 * linear(colour.g()) + 0.0722 * linear(colour.b())
}

#[cfg(test)]
mod tests {
    use super::*;
    use re_viewer::external::{egui, re_ui};

    /// The styles of both themes as a window has them, without and with what this module does.
    fn styles(legible: bool) -> [std::sync::Arc<Style>; 2] {
        let ctx = Context::default();
        re_ui::apply_style_and_install_loaders(&ctx);
        if legible {
            apply(&ctx);
        }
        [egui::Theme::Dark, egui::Theme::Light].map(|theme| ctx.style_of(theme))
    }

    /// The least contrast of any text colour on any ground.
    fn least(style: &Style) -> f32 {
        let v = &style.visuals;
        let texts = [
            v.text_color(),
            v.weak_text_color(),
            v.strong_text_color(),
            v.error_fg_color,
            v.warn_fg_color,
            v.hyperlink_color,
            v.widgets.inactive.fg_stroke.color,
        ];
        let on = |text: Color32| grounds(v).map(|ground| contrast(ground.blend(text), ground));
        texts.into_iter().flat_map(on).fold(f32::INFINITY, f32::min)
    }

    #[test]
    fn contrast_is_that_of_wcag() {
        assert!((contrast(Color32::WHITE, Color32::BLACK) - 21.0).abs() < 1e-3);
        assert!((contrast(Color32::from_gray(119), Color32::WHITE) - 4.48).abs() < 0.01);
        assert_eq!(contrast(Color32::RED, Color32::RED), 1.0);
    }

    #[test]
    fn all_text_of_both_themes_can_be_read() {
        for (style, name) in styles(true).iter().zip(["dark", "light"]) {
            assert!(least(style) >= LEAST_CONTRAST, "{name}: {}", least(style));
            assert!(style.text_styles.values().all(|font| font.size >= LEAST_SIZE), "{name}");
        }
        assert!(styles(false).iter().all(|style| least(style) < LEAST_CONTRAST), "the viewer's own style needs it");
    }
}
