//! Pictures of the window beside those of before: the same where every small piece of them is.
//!
//! A share of the whole picture would let a button go unnoticed: its words are a hundredth of a percent of it.

use image::RgbImage;
use std::path::Path;

/// How much a colour may differ, of 255, before its pixel looks other.
const FAINT: u8 = 24;
/// Edge of a piece, pixels; pieces overlap by half.
const PIECE: u32 = 16;
/// Share of a piece's pixels that may look other. The words of a button are 0.29 or more of a piece, and what two machines draw
/// is 0.2 at most.
pub const TOLERANCE: f64 = 0.25;
/// The end of the status bar has the path of a folder that is another every time: its height, pixels, and where it begins, share
/// of the width.
const STATUS: (u32, f64) = (22, 0.8);

/// Where two pictures differ most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Share of the piece's pixels that look other; all of them where the pictures have not one size.
    pub share: f64,
    /// Upper left corner of the piece, pixels.
    pub at: [u32; 2],
}

/// The piece in which two pictures differ most.
pub fn difference(a: &Path, b: &Path) -> Difference {
    let read = |path: &Path| image::open(path).expect("a picture").into_rgb8();
    between(&read(a), &read(b))
}

fn between(a: &RgbImage, b: &RgbImage) -> Difference {
    if a.dimensions() != b.dimensions() {
        return Difference { share: 1.0, at: [0, 0] };
    }
    let (width, height) = a.dimensions();
    let is_other = |x: u32, y: u32| {
        let in_status = y + STATUS.0 >= height && f64::from(x) >= STATUS.1 * f64::from(width);
        !in_status && (is_missing(a, b, x, y) || is_missing(b, a, x, y))
    };
    let other: Vec<bool> = (0..width * height).map(|at| is_other(at % width, at / width)).collect();
    let mut worst = Difference { share: 0.0, at: [0, 0] };
    for top in (0..height).step_by(PIECE as usize / 2) {
        for left in (0..width).step_by(PIECE as usize / 2) {
            let (right, bottom) = ((left + PIECE).min(width), (top + PIECE).min(height));
            let count = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
            let count = count.filter(|(x, y)| other[(y * width + x) as usize]).count();
            let share = count as f64 / f64::from(PIECE * PIECE);
            if share > worst.share {
                worst = Difference { share, at: [left, top] };
            }
        }
    }
    worst
}

/// Whether a pixel of one picture is neither at its place in the other nor beside it: edges may be drawn a pixel off.
fn is_missing(of: &RgbImage, from: &RgbImage, x: u32, y: u32) -> bool {
    let (width, height) = of.dimensions();
    let colour = of.get_pixel(x, y).0;
    let is_like = |x, y| from.get_pixel(x, y).0.iter().zip(colour).all(|(a, b)| a.abs_diff(b) <= FAINT);
    !(y.saturating_sub(1)..(y + 2).min(height))
        .any(|y| (x.saturating_sub(1)..(x + 2).min(width)).any(|x| is_like(x, y)))
}

/// The commonest colour of a piece.
fn ground(picture: &RgbImage, left: u32, top: u32) -> image::Rgb<u8> {
    let mut counts = std::collections::BTreeMap::new();
    for (x, y) in (top..top + PIECE).flat_map(|y| (left..left + PIECE).map(move |x| (x, y))) {
        *counts.entry(picture.get_pixel(x, y).0).or_insert(0) += 1;
    }
    image::Rgb(counts.into_iter().max_by_key(|(_, count)| *count).expect("pixels").0)
}

#[test]
fn words_that_are_lost_are_seen_and_a_line_that_is_a_pixel_off_is_not() {
    let golden = nudge_tests::root().join("screenshots/workbench-episode.png");
    let golden = image::open(golden).expect("a golden picture").into_rgb8();
    assert_eq!(between(&golden, &golden).share, 0.0);
    // Buttons and texts of the panel on the left: where letters cover most of a piece, the word is painted over.
    let mut words = 0;
    for (left, top) in (40..400).step_by(8).flat_map(|top| (32..160).step_by(8).map(move |left| (left, top))) {
        let ground = ground(&golden, left, top);
        let is_letter = |x, y| golden.get_pixel(x, y).0.iter().zip(ground.0).any(|(a, b)| a.abs_diff(b) > FAINT);
        let piece = (top..top + PIECE).flat_map(|y| (left..left + PIECE).map(move |x| (x, y)));
        let share = piece.filter(|(x, y)| is_letter(*x, *y)).count() as f64 / f64::from(PIECE * PIECE);
        if share < 0.3 || words == 8 {
            continue;
        }
        words += 1;
        let mut lost = golden.clone();
        for (x, y) in (top - 2..top + PIECE + 2).flat_map(|y| (left - 24..left + 40).map(move |x| (x, y))) {
            lost.put_pixel(x, y, ground);
        }
        let found = between(&golden, &lost);
        assert!(found.share > TOLERANCE, "a word at ({left}, {top}): {found:?}");
    }
    assert!(words > 3, "{words} words");
    let shifted = RgbImage::from_fn(golden.width(), golden.height(), |x, y| *golden.get_pixel(x.saturating_sub(1), y));
    assert!(between(&golden, &shifted).share <= TOLERANCE);
}
