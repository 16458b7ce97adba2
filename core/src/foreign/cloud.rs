//! Point clouds in PLY files, of text or of numbers in either order of bytes.
//!
//! Of an element `vertex` the properties `x`, `y` and `z` are read; normals, colours, faces and whatever else there is are
//! skipped.

use super::bytes::Bytes;
use crate::belief::{Belief, beta_mean};
use crate::{Error, Result};
use header::{Element, Encoding, Header, Kind, Property};
use std::path::Path;

mod header;

/// The most points that are read.
const MOST_POINTS: usize = 40_000_000;

/// The points of a file, in its own frame; those that are no numbers too.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Vec<[f32; 3]>> {
    let mut bytes = Bytes::new(bytes);
    let header = Header::read(&mut bytes).map_err(|words| Error::input(path, "header", words))?;
    let mut body = match header.encoding {
        Encoding::Text => Body::Text(Words::new(&mut bytes)),
        Encoding::Little => Body::Numbers(bytes, f64_of_little),
        Encoding::Big => Body::Numbers(bytes, f64_of_big),
    };
    for element in &header.elements {
        let read = if element.name == "vertex" {
            return vertices(&mut body, element).map_err(|(at, words)| fail(path, "vertex", at, &words));
        } else {
            skip(&mut body, element)
        };
        read.map_err(|(at, words)| fail(path, &element.name, at, &words))?;
    }
    Err(Error::input(path, "header", "has no element vertex"))
}

fn fail(path: &Path, element: &str, at: usize, words: &str) -> Error {
    Error::input(path, format!("{element} {at}"), words)
}

/// What is wrong with which of the elements.
type Wrong = (usize, String);

fn vertices(body: &mut Body<'_>, element: &Element) -> std::result::Result<Vec<[f32; 3]>, Wrong> {
    if element.count > MOST_POINTS {
        return Err((0, format!("{} points; at most {MOST_POINTS} are read", element.count)));
    }
    let axis = |property: &Property| ["x", "y", "z"].iter().position(|axis| *axis == property.name);
    // No more than the file can hold: a point takes at least two bytes, a digit and a blank.
    let mut points = Vec::with_capacity(element.count.min(body.left() / 2));
    for at in 0..element.count {
        let mut point = [f32::NAN; 3];
        for property in &element.properties {
            let number = body.property(property).map_err(|words| (at, words))?;
            if let Some(axis) = axis(property) {
                point[axis] = number as f32;
            }
        }
        points.push(point);
    }
    Ok(points)
}

fn skip(body: &mut Body<'_>, element: &Element) -> std::result::Result<(), Wrong> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for at in 0..element.count {
        for property in &element.properties {
            body.property(property).map_err(|words| (at, words))?;
        }
    }
    Ok(())
}

/// What follows the header.
enum Body<'a> {
    Text(Words<'a>),
    Numbers(Bytes<'a>, fn(Kind, &[u8]) -> f64),
}

impl Body<'_> {
    fn left(&self) -> usize {
        match self {
            Self::Text(words) => words.rest.len(),
            Self::Numbers(bytes, _) => bytes.left(),
        }
    }

    /// Reads a property; of a list its length.
    fn property(&mut self, property: &Property) -> std::result::Result<f64, String> {
        let Some(of) = property.list_of else { return self.number(property.kind) };
        let count = self.number(property.kind)?;
        if !(0.0..=1e6).contains(&count) {
            return Err(format!("a list of {count} entries"));
        }
        for _ in 0..count as usize {
            self.number(of)?;
        }
        Ok(count)
    }

    fn number(&mut self, kind: Kind) -> std::result::Result<f64, String> {
        match self {
            Self::Numbers(bytes, read) => Ok(read(kind, bytes.take(kind.size())?)),
            Self::Text(words) => {
                let word = words.next()?;
                word.parse().map_err(|_| format!("\"{}\" is no number", word.chars().take(40).collect::<String>()))
            }
        }
    }
}

/// Words of a text, one after the other.
struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Words<'a> {
    fn new(bytes: &mut Bytes<'a>) -> Self {
        let left = bytes.left();
        Self { rest: bytes.take(left).unwrap_or_default() }
    }

    fn next(&mut self) -> std::result::Result<&'a str, String> {
        let ended = || "the file ends in the middle".to_owned();
        let begin = self.rest.iter().position(|byte| !byte.is_ascii_whitespace()).ok_or_else(ended)?;
        let rest = &self.rest[begin..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.rest = &rest[end..];
        std::str::from_utf8(&rest[..end]).map_err(|_| "what should be a number is no text".to_owned())
    }
}

fn f64_of_little(kind: Kind, bytes: &[u8]) -> f64 {
    kind.number(bytes)
}

fn f64_of_big(kind: Kind, bytes: &[u8]) -> f64 {
    let mut turned = [0; 8];
    let turned = &mut turned[..bytes.len()];
    turned.copy_from_slice(bytes);
    turned.reverse();
    kind.number(turned)
}

/// The centres of the voxels that are occupied rather than free, each with its probability and the class of its floor cell.
pub(super) fn write(belief: &Belief) -> Vec<u8> {
    let (grid, height) = (&belief.grid, belief.grid.dims[2]);
    let mut points = Vec::new();
    for (index, voxel) in belief.occupancy.iter().enumerate().filter(|(_, voxel)| voxel[0] > voxel[1]) {
        let at = grid.center(grid.voxel(index));
        points.extend([at.x, at.y, at.z, beta_mean(*voxel)].iter().flat_map(|number| number.to_le_bytes()));
        points.push(belief.likeliest(index / height).0.0);
    }
    let mut file = format!(
        "ply\nformat binary_little_endian 1.0\ncomment centres of occupied voxels of {} m, in the shelf's frame\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty float probability\n\
         property uchar class\nend_header\n",
        grid.voxel_m,
        points.len() / POINT_BYTES
    )
    .into_bytes();
    file.extend(points);
    file
}

/// Bytes of a point that is written.
const POINT_BYTES: usize = 4 * 4 + 1;
