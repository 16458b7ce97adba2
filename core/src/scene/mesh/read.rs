//! Reading triangles from OBJ, STL and GLB files.

use super::group::{Group, MAX_TRIANGLES, too_many};
use super::{glb, obj, stl};
use crate::wall::guarded;
use crate::{Error, Result};
use std::path::Path;

/// Files larger than this, bytes, are refused unread.
const MAX_BYTES: u64 = 256 << 20;

/// Reads the groups of a mesh file; the file's name tells the format.
pub fn read(path: &Path) -> Result<Vec<Group>> {
    let kind = path.extension().and_then(|kind| kind.to_str()).map(str::to_ascii_lowercase).unwrap_or_default();
    let length = std::fs::metadata(path).map_err(|error| Error::io(path, error))?.len();
    let wrong = |message: String| {
        // Readers put the place before the words.
        let (place, message) = match message.split_once(": ") {
            Some((place, words)) if place.starts_with("line ") => (place.to_owned(), words.to_owned()),
            _ => (String::new(), message),
        };
        Error::input(path, place, message)
    };
    let reader = match kind.as_str() {
        "obj" => obj::read,
        "stl" => stl::read,
        "glb" => glb::read,
        _ => return Err(wrong(format!("`{kind}` is not a mesh format that is read here; use .obj, .stl or .glb"))),
    };
    if length > MAX_BYTES {
        return Err(wrong(format!("{} MB is too large for a mesh; the limit is {} MB", length >> 20, MAX_BYTES >> 20)));
    }
    let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
    let groups = guarded(|| reader(&bytes)).map_err(wrong)?;
    let count = groups.iter().map(|group| group.triangles.len()).sum();
    if count > MAX_TRIANGLES {
        return Err(wrong(too_many(count)));
    }
    for group in &groups {
        if group.triangles.iter().flatten().any(|i| *i as usize >= group.points.len()) {
            return Err(wrong("a triangle names a corner that is not there".into()));
        }
        let used = group.triangles.iter().flatten().map(|i| group.points[*i as usize]);
        if used.into_iter().any(|p| !p.coords.iter().all(|v| v.abs() < 1e9)) {
            return Err(wrong("a corner has a coordinate that is not a finite number (NaN, infinite or huge)".into()));
        }
    }
    Ok(groups)
}
