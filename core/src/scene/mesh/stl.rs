//! STL, as text or binary. Normals are not read: a triangle's corners tell which way it faces.
//!
//! A reader of our own: the format is a list of triples, and `stl_io` takes the first of several solids for the whole
//! file, wants finite normals and UTF-8 names, and tells no line.

use super::group::{Corner, Group, MAX_TRIANGLES, too_many};
use super::text::{lines, number, without_mark};

/// Length of a binary file's head: 80 bytes that say nothing, and the number of triangles.
const HEAD: usize = 84;
/// Length of a triangle in a binary file.
const RECORD: usize = 50;

/// Reads the solids, one group each.
pub fn read(bytes: &[u8]) -> Result<Vec<Group>, String> {
    if bytes.is_empty() {
        return Ok(Vec::new());
    }
    // A binary file may begin with "solid" too; its length gives it away.
    let count = bytes.get(80..HEAD).map(|count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize);
    let count = count.filter(|count| count.checked_mul(RECORD).and_then(|n| n.checked_add(HEAD)) == Some(bytes.len()));
    let groups = match count {
        Some(count) if count > MAX_TRIANGLES => return Err(too_many(count)),
        Some(_) => vec![binary(bytes)],
        None if is_text(bytes) => text(bytes)?,
        None => {
            let message = "neither text that begins with `solid` nor binary of the length it claims";
            return Err(format!("not an STL mesh ({message})"));
        }
    };
    Ok(groups.into_iter().filter(|group| !group.triangles.is_empty()).collect())
}

fn binary(bytes: &[u8]) -> Group {
    let mut group = Group::default();
    for record in bytes[HEAD..].chunks_exact(RECORD) {
        let at = |i: usize| f64::from(f32::from_le_bytes([record[i], record[i + 1], record[i + 2], record[i + 3]]));
        add(&mut group, [12, 24, 36].map(|i| Corner::new(at(i), at(i + 4), at(i + 8))));
    }
    group
}

fn is_text(bytes: &[u8]) -> bool {
    let start = without_mark(bytes).trim_ascii_start();
    // Text in UTF-16 is told so by the reader.
    start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) || bytes.starts_with(b"\xff\xfes\0")
}

/// The triangles of all solids: `facet`, anything up to `vertex x y z` three times, and `endfacet`.
fn text(bytes: &[u8]) -> Result<Vec<Group>, String> {
    let mut groups: Vec<Group> = Vec::new();
    // Of a facet that has begun: its line and its corners.
    let mut open: Option<(usize, Vec<Corner>)> = None;
    let mut triangles = 0;
    for (line, text) in lines(bytes)? {
        let mut words = text.split_whitespace();
        while let Some(word) = words.next() {
            match (word.to_ascii_lowercase().as_str(), &mut open) {
                // What follows is a name.
                ("solid", None) => {
                    groups.push(Group::default());
                    break;
                }
                ("endsolid", None) => break,
                ("facet", None) => open = Some((line, Vec::new())),
                ("vertex", Some((_, corners))) => {
                    let mut value = || match words.next() {
                        Some(word) => number(word, line),
                        None => Err(format!("line {line}: a vertex needs 3 numbers")),
                    };
                    corners.push(Corner::new(value()?, value()?, value()?));
                }
                ("endfacet", Some((_, corners))) => {
                    let Ok(corners) = <[Corner; 3]>::try_from(corners.as_slice()) else {
                        return Err(format!("line {line}: a facet of {} corners; 3 are needed", corners.len()));
                    };
                    triangles += 1;
                    // Past the limit they are only counted.
                    if let Some(group) = groups.last_mut().filter(|_| triangles <= MAX_TRIANGLES) {
                        add(group, corners);
                    }
                    open = None;
                }
                // `normal` with its numbers, `outer loop`, `endloop`.
                (_, Some(_)) => {}
                (_, None) => return Err(format!("line {line}: `{word}` where a facet should begin")),
            }
        }
    }
    match open {
        Some((line, _)) => Err(format!("line {line}: the file ends inside this facet")),
        None if triangles > MAX_TRIANGLES => Err(too_many(triangles)),
        None => Ok(groups),
    }
}

fn add(group: &mut Group, corners: [Corner; 3]) {
    let first = group.points.len() as u32;
    group.points.extend(corners);
    group.triangles.push([first, first + 1, first + 2]);
}
