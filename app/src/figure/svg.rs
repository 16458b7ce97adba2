//! A small SVG writer and its way to PNG (resvg), with the fonts inside the program.
//!
//! Lengths are in the figure's own units; [`Svg::render`] takes the number of pixels per unit.

use crate::colors::{self, Rgb};
use crate::picture::{self, RgbImage};
use nudge_core::{Error, Result};
use resvg::{tiny_skia, usvg};
use std::fmt::Write as _;
use std::sync::{Arc, LazyLock};

/// The type family of figures.
const FAMILY: &str = "Ubuntu";

/// Which end of a text its position is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The text starts there.
    Start,
    /// The text is centred there.
    Middle,
    /// The text ends there.
    End,
}

/// A line of text on its baseline.
#[derive(Clone, Debug)]
pub struct Text {
    /// What it says.
    pub content: String,
    /// Where its baseline is anchored.
    pub at: [f32; 2],
    /// Size of the type.
    pub size: f32,
    /// Its colour.
    pub rgb: Rgb,
    /// Which end is anchored.
    pub anchor: Anchor,
    /// Turned counter-clockwise about its anchor, degrees.
    pub turned_deg: f32,
}

impl Text {
    /// Dark text that starts at `at`.
    pub fn new(content: impl Into<String>, at: [f32; 2], size: f32) -> Self {
        Self { content: content.into(), at, size, rgb: INK, anchor: Anchor::Start, turned_deg: 0.0 }
    }

    /// Anchored elsewhere.
    pub fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// In another colour.
    pub fn colored(self, rgb: Rgb) -> Self {
        Self { rgb, ..self }
    }

    /// Turned counter-clockwise.
    pub fn turned(self, degrees: f32) -> Self {
        Self { turned_deg: degrees, ..self }
    }
}

/// The colour of text.
pub const INK: Rgb = [34, 36, 42];
/// The colour of secondary text, axes and frames.
pub const SOFT_INK: Rgb = [104, 108, 118];
/// The colour of grid lines.
pub const HAIRLINE: Rgb = [222, 224, 228];

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub rgb: Rgb,
    /// Its width.
    pub width: f32,
    /// Lengths of dash and gap; zeros for a full line.
    pub dash: [f32; 2],
    /// 1 for opaque.
    pub opacity: f32,
}

impl Stroke {
    /// A full, opaque line.
    pub fn new(rgb: Rgb, width: f32) -> Self {
        Self { rgb, width, dash: [0.0; 2], opacity: 1.0 }
    }

    /// Dashed.
    pub fn dashed(self, dash: f32, gap: f32) -> Self {
        Self { dash: [dash, gap], ..self }
    }

    /// See-through.
    pub fn faint(self, opacity: f32) -> Self {
        Self { opacity, ..self }
    }
}

/// A drawing.
#[derive(Clone, Debug)]
pub struct Svg {
    size: [f32; 2],
    body: String,
}

impl Svg {
    /// An empty drawing on white, `size` units wide and high.
    pub fn new(size: [f32; 2]) -> Self {
        let mut svg = Self { size, body: String::new() };
        svg.rect([0.0, 0.0], size, [255; 3]);
        svg
    }

    fn push(&mut self, element: std::fmt::Arguments<'_>) {
        self.body.write_fmt(element).expect("writing to a string cannot fail");
        self.body.push('\n');
    }

    /// A filled rectangle from its top left corner.
    pub fn rect(&mut self, [x, y]: [f32; 2], [w, h]: [f32; 2], fill: Rgb) {
        let fill = colors::hex(fill);
        self.push(format_args!(r#"<rect x="{x}" y="{y}" width="{w}" height="{h}" fill="{fill}"/>"#));
    }

    /// The outline of a rectangle.
    pub fn frame(&mut self, [x, y]: [f32; 2], [w, h]: [f32; 2], stroke: Stroke) {
        let stroke = attributes(stroke);
        self.push(format_args!(r#"<rect x="{x}" y="{y}" width="{w}" height="{h}" fill="none" {stroke}/>"#));
    }

    /// A straight line.
    pub fn line(&mut self, from: [f32; 2], to: [f32; 2], stroke: Stroke) {
        self.polyline(&[from, to], stroke);
    }

    /// A line through points.
    pub fn polyline(&mut self, points: &[[f32; 2]], stroke: Stroke) {
        self.paths(&[points.to_vec()], stroke);
    }

    /// Lines through points, as one shape.
    pub fn paths(&mut self, lines: &[Vec<[f32; 2]>], stroke: Stroke) {
        let mut data = String::new();
        for line in lines.iter().filter(|line| !line.is_empty()) {
            for (at, [x, y]) in line.iter().enumerate() {
                let _ = write!(data, "{}{x:.2} {y:.2}", if at == 0 { "M" } else { "L" });
            }
        }
        let stroke = attributes(stroke);
        self.push(format_args!(
            r#"<path d="{data}" fill="none" stroke-linejoin="round" stroke-linecap="round" {stroke}/>"#
        ));
    }

    /// A filled polygon.
    pub fn polygon(&mut self, corners: &[[f32; 2]], fill: Rgb) {
        let points: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
        self.push(format_args!(r#"<polygon points="{}" fill="{}"/>"#, points.join(" "), colors::hex(fill)));
    }

    /// A filled polygon that lets through what is below it.
    pub fn area(&mut self, corners: &[[f32; 2]], fill: Rgb, opacity: f32) {
        let points: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
        let fill = colors::hex(fill);
        self.push(format_args!(r#"<polygon points="{}" fill="{fill}" fill-opacity="{opacity}"/>"#, points.join(" ")));
    }

    /// A filled disc with a white rim.
    pub fn dot(&mut self, [x, y]: [f32; 2], radius: f32, fill: Rgb) {
        let fill = colors::hex(fill);
        self.push(format_args!(
            r##"<circle cx="{x:.2}" cy="{y:.2}" r="{radius}" fill="{fill}" stroke="#ffffff" stroke-width="1"/>"##
        ));
    }

    /// A line of text.
    pub fn text(&mut self, text: &Text) {
        let element = text_element(text);
        self.push(format_args!("{element}"));
    }

    /// A raster, stretched over a rectangle; `cells` keeps the edges of its pixels sharp.
    pub fn raster(&mut self, [x, y]: [f32; 2], [w, h]: [f32; 2], raster: &RgbImage, style: RasterStyle) {
        use base64_of_bytes as base64;
        let sharp;
        let raster = match style {
            RasterStyle::Smooth => raster,
            RasterStyle::Cells => {
                // Large pixels survive any smoothing on the way to the page.
                let times = (1000 / raster.width().max(1)).clamp(1, 8);
                sharp = RgbImage::from_fn(raster.width() * times, raster.height() * times, |x, y| {
                    *raster.get_pixel(x / times, y / times)
                });
                &sharp
            }
        };
        let data = base64(&picture::png(raster));
        self.push(format_args!(
            r#"<image x="{x}" y="{y}" width="{w}" height="{h}" preserveAspectRatio="none" href="data:image/png;base64,{data}"/>"#
        ));
    }

    /// The document.
    pub fn document(&self) -> String {
        let [width, height] = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n{}</svg>\n",
            self.body
        )
    }

    /// The drawing as an image with `pixels_per_unit`.
    pub fn render(&self, pixels_per_unit: f32) -> Result<RgbImage> {
        let failed = |what: &str| Error::Usage(format!("the figure cannot be drawn: {what}"));
        let tree = usvg::Tree::from_str(&self.document(), &OPTIONS).map_err(|e| failed(&e.to_string()))?;
        let [width, height] = self.size.map(|n| (n * pixels_per_unit).round() as u32);
        let mut pixels = tiny_skia::Pixmap::new(width, height).ok_or_else(|| failed("its size is zero"))?;
        let scale = tiny_skia::Transform::from_scale(pixels_per_unit, pixels_per_unit);
        resvg::render(&tree, scale, &mut pixels.as_mut());
        // The page is opaque white, so premultiplied is plain.
        let rgb = pixels.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        RgbImage::from_raw(width, height, rgb).ok_or_else(|| failed("its size does not fit"))
    }
}

/// Whether a raster's pixels are samples of something smooth or cells of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RasterStyle {
    /// A picture.
    Smooth,
    /// A map whose cells keep sharp edges.
    Cells,
}

/// Width of a line of text, units.
pub fn text_width(content: &str, size: f32) -> f32 {
    text_box(&Text::new(content, [0.0, 0.0], size)).map_or(0.0, |[x, _, width, _]| x.max(0.0) + width)
}

/// Left, top, width and height of a text's ink; `None` without ink.
fn text_box(text: &Text) -> Option<[f32; 4]> {
    let document =
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"10\" height=\"10\">{}</svg>", text_element(text));
    let tree = usvg::Tree::from_str(&document, &OPTIONS).ok()?;
    let ink = tree.root().abs_bounding_box();
    (ink.width() > 0.0).then(|| [ink.x(), ink.y(), ink.width(), ink.height()])
}

fn text_element(text: &Text) -> String {
    let [x, y] = text.at;
    let anchor = match text.anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let turned = match text.turned_deg {
        0.0 => String::new(),
        degrees => format!(r#" transform="rotate({} {x} {y})""#, -degrees),
    };
    format!(
        r#"<text x="{x:.2}" y="{y:.2}" font-family="{FAMILY}" font-weight="300" font-size="{}" fill="{}" text-anchor="{anchor}"{turned}>{}</text>"#,
        text.size,
        colors::hex(text.rgb),
        escape(&text.content)
    )
}

fn attributes(stroke: Stroke) -> String {
    let mut text = format!(r#"stroke="{}" stroke-width="{}""#, colors::hex(stroke.rgb), stroke.width);
    if stroke.dash[0] > 0.0 {
        let _ = write!(text, r#" stroke-dasharray="{} {}""#, stroke.dash[0], stroke.dash[1]);
    }
    if stroke.opacity < 1.0 {
        let _ = write!(text, r#" stroke-opacity="{}""#, stroke.opacity);
    }
    text
}

/// Text as XML content; characters that XML 1.0 cannot hold are left out.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&apos;"),
            c if c.is_control() => {}
            c => escaped.push(c),
        }
    }
    escaped
}

/// RFC 4648 base64.
fn base64_of_bytes(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let group = chunk.iter().fold(0_u32, |group, byte| group << 8 | u32::from(*byte)) << (8 * (3 - chunk.len()));
        for at in 0..4 {
            let digit = ALPHABET[(group >> (18 - 6 * at) & 63) as usize];
            text.push(if at <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

static OPTIONS: LazyLock<usvg::Options<'static>> = LazyLock::new(|| {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    usvg::Options { fontdb: Arc::new(fonts), font_family: FAMILY.to_owned(), ..usvg::Options::default() }
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped() {
        assert_eq!(escape("a<b & \"c\" 'd'\u{0}>"), "a&lt;b &amp; &quot;c&quot; &apos;d&apos;&gt;");
        let mut svg = Svg::new([40.0, 20.0]);
        svg.text(&Text::new("</text><evil a='\">&", [2.0, 12.0], 8.0));
        svg.render(1.0).expect("names with markup in them are drawn as they are");
    }

    #[test]
    fn base64_pads_as_the_standard_says() {
        let cases = [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")];
        for (bytes, text) in cases {
            assert_eq!(base64_of_bytes(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn what_is_drawn_is_where_it_was_put() {
        let mut svg = Svg::new([20.0, 10.0]);
        svg.rect([2.0, 2.0], [4.0, 4.0], [255, 0, 0]);
        let raster = RgbImage::from_fn(2, 1, |x, _| image::Rgb(if x == 0 { [0, 255, 0] } else { [0, 0, 255] }));
        svg.raster([10.0, 2.0], [8.0, 4.0], &raster, RasterStyle::Cells);
        let image = svg.render(2.0).expect("drawn");
        assert_eq!(image.dimensions(), (40, 20));
        let at = |x, y| image.get_pixel(x, y).0;
        assert_eq!([at(8, 8), at(1, 1), at(22, 8), at(34, 8)], [[255, 0, 0], [255; 3], [0, 255, 0], [0, 0, 255]]);
        assert_eq!(at(26, 8), [0, 255, 0], "cells stay sharp up to their edge");
    }

    #[test]
    fn longer_text_is_wider_and_the_font_is_there() {
        assert!(text_width("mmmm", 10.0) > text_width("iiii", 10.0));
        assert!(text_width("entropy", 10.0) > 20.0);
        assert!((text_width("entropy", 20.0) / text_width("entropy", 10.0) - 2.0).abs() < 0.05);
    }
}
