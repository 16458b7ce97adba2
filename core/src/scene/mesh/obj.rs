//! Wavefront OBJ: corners (`v`), faces (`f`) and the objects and groups (`o`, `g`) that keep them together.
//!
//! A reader of our own, since nothing else of the format matters to a shape, and most files that other readers stumble
//! over do so because of the rest: colours behind the corners, materials without a name, comments. Every fault is told
//! with its line.

use super::group::{Corner, Group, MAX_TRIANGLES, too_many};
use super::text::{lines, number};
use std::collections::HashMap;

/// A face as it was typed: its line, its group, and its corners by position in the whole file.
struct Face {
    line: usize,
    group: usize,
    corners: Vec<(i64, String)>,
}

/// Reads the groups; a face of more than three corners becomes a fan.
pub fn read(bytes: &[u8]) -> Result<Vec<Group>, String> {
    let mut corners: Vec<Corner> = Vec::new();
    let mut faces: Vec<Face> = Vec::new();
    let (mut group, mut triangles) = (0, 0_usize);
    for (line, text) in statements(bytes)? {
        let mut words = text.split_whitespace();
        match words.next() {
            Some("v") => corners.push(corner(words, line)?),
            Some("f") => {
                let face = face(words, line, corners.len(), group)?;
                triangles += face.corners.len().saturating_sub(2);
                // Past the limit they are only counted. Points and lines have no shape.
                if triangles <= MAX_TRIANGLES && face.corners.len() > 2 {
                    faces.push(face);
                }
            }
            Some("o" | "g") => group += 1,
            _ => {}
        }
    }
    if triangles > MAX_TRIANGLES {
        return Err(too_many(triangles));
    }
    if corners.is_empty() && faces.is_empty() && !bytes.is_empty() {
        return Err("not an OBJ mesh (no corners and no faces)".into());
    }
    grouped(&corners, &faces)
}

/// The statements with the line that each begins in: comments left out, lines that end in `\` joined with the next.
fn statements(bytes: &[u8]) -> Result<Vec<(usize, String)>, String> {
    let mut statements: Vec<(usize, String)> = Vec::new();
    let mut goes_on = false;
    for (line, text) in lines(bytes)? {
        let text = text.split('#').next().unwrap_or_default().trim_end();
        let (text, continued) = text.strip_suffix('\\').map_or((text, false), |text| (text, true));
        match statements.last_mut().filter(|_| goes_on) {
            Some((_, before)) => {
                before.push(' ');
                before.push_str(text);
            }
            None => statements.push((line, text.to_owned())),
        }
        goes_on = continued;
    }
    Ok(statements)
}

/// `x y z`, or `x y z w` to be divided by `w`; colours behind them are not read.
fn corner<'w>(words: impl Iterator<Item = &'w str>, line: usize) -> Result<Corner, String> {
    let words: Vec<&str> = words.collect();
    let [x, y, z, rest @ ..] = &words[..] else {
        return Err(format!("line {line}: a corner (v) of {} numbers; 3 are needed", words.len()));
    };
    let point = Corner::new(number(x, line)?, number(y, line)?, number(z, line)?);
    match rest {
        [weight] => match number(weight, line)? {
            0.0 => Err(format!("line {line}: a corner of weight 0 is nowhere")),
            weight => Ok(point / weight),
        },
        _ => Ok(point),
    }
}

/// The corners of a face, counted from the first of the file or, where negative, back from the last so far.
fn face<'w>(
    words: impl Iterator<Item = &'w str>,
    line: usize,
    corners_so_far: usize,
    group: usize,
) -> Result<Face, String> {
    let index = |word: &str| {
        let typed = word.split('/').next().unwrap_or_default();
        match typed.parse::<i64>() {
            Ok(back) if back < 0 => Ok((corners_so_far as i64 + back, word.to_owned())),
            Ok(from_one) => Ok((from_one - 1, word.to_owned())),
            Err(_) => Err(format!("line {line}: `{word}` is no corner of a face")),
        }
    };
    Ok(Face { line, group, corners: words.map(index).collect::<Result<_, _>>()? })
}

fn grouped(corners: &[Corner], faces: &[Face]) -> Result<Vec<Group>, String> {
    let mut groups: Vec<Group> = Vec::new();
    for faces in faces.chunk_by(|a, b| a.group == b.group) {
        let mut group = Group::default();
        let mut own: HashMap<i64, u32> = HashMap::new();
        for face in faces {
            let mut indices = Vec::with_capacity(face.corners.len());
            for (index, word) in &face.corners {
                let Some(corner) = usize::try_from(*index).ok().and_then(|index| corners.get(index)) else {
                    let count = corners.len();
                    return Err(format!("line {}: corner {word} is out of bounds; there are {count}", face.line));
                };
                indices.push(*own.entry(*index).or_insert_with(|| {
                    group.points.push(*corner);
                    group.points.len() as u32 - 1
                }));
            }
            group.triangles.extend(indices.windows(2).skip(1).map(|pair| [indices[0], pair[0], pair[1]]));
        }
        groups.push(group);
    }
    Ok(groups)
}
