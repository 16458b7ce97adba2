//! Shaded pictures of a scene, and floor plans painted cell by cell.
//!
//! A picture is cast ray by ray against the same convex parts that the camera, the physics and the truth map see, so
//! it shows exactly what they work with. Soft light from the robot's side, darkened contacts and thin edges; twice
//! supersampled. The same input gives the same picture, on any number of threads.

mod floor;
mod light;
mod robot;
mod stage;

pub use floor::{
    CellError, FloorPlan, believed_class, cell_entropy, cell_error, cell_errors, column_entropy, entropy_range,
    outlines, paint, paint_certainty, paint_entropy, paint_errors, paint_labels, paint_semantics, paint_surprise,
    semantics_rgb,
};
pub use image::RgbImage;
pub use light::{Eye, Item, Projection, render};
pub use robot::{Placed, of_robot};
pub use stage::{View, of_bodies, of_solid, thumbnail};

use nudge_core::Result;
use nudge_core::files::write_atomically;
use std::path::Path;

/// Writes a picture as a PNG file; a file of that name is replaced at once or not at all.
///
/// # Errors
/// What the operating system refuses.
pub fn save(picture: &RgbImage, path: &Path) -> Result<()> {
    write_atomically(path, &png(picture))
}

/// A picture as PNG bytes.
pub fn png(picture: &RgbImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).expect("a PNG in memory cannot fail");
    bytes.into_inner()
}
