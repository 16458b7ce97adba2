//! Reading triangles from OBJ, STL and GLB files.

use super::bounds_of;
use crate::solid::Bounds;
use crate::{Error, Point, Result};
use std::io::{BufRead as _, Cursor};
use std::path::Path;

/// Meshes with more triangles are refused.
pub const MAX_TRIANGLES: usize = 200_000;
/// Files larger than this, bytes, are refused unread.
const MAX_BYTES: u64 = 256 << 20;
/// Nodes of a GLB scene that are visited at most, so that a node that is its own child ends.
const MAX_NODES: usize = 10_000;
/// Levels of nodes in a GLB scene.
const MAX_DEPTH: usize = 64;

/// Triangles that a file keeps together: an object or group of an OBJ, a primitive of a GLB.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Corners, in the file's units, z up.
    pub points: Vec<Point>,
    /// Corners of each triangle, by position in `points`.
    pub triangles: Vec<[u32; 3]>,
}

/// Bounding box of all corners that a triangle uses.
pub fn bounds(groups: &[Group]) -> Option<Bounds> {
    let corners =
        |group: &Group| group.triangles.iter().flatten().map(|i| group.points[*i as usize]).collect::<Vec<_>>();
    bounds_of(groups.iter().flat_map(corners))
}

/// Reads the groups of a mesh file; the file's name tells the format.
pub fn read(path: &Path) -> Result<Vec<Group>> {
    let kind = path.extension().and_then(|kind| kind.to_str()).map(str::to_ascii_lowercase).unwrap_or_default();
    let length = std::fs::metadata(path).map_err(|error| Error::io(path, error))?.len();
    let wrong = |message: String| Error::input(path, "", message);
    let reader = match kind.as_str() {
        "obj" => read_obj,
        "stl" => read_stl,
        "glb" => read_glb,
        _ => return Err(wrong(format!("`{kind}` is not a mesh format that is read here; use .obj, .stl or .glb"))),
    };
    if length > MAX_BYTES {
        return Err(wrong(format!("{} MB is too large for a mesh; the limit is {} MB", length >> 20, MAX_BYTES >> 20)));
    }
    let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
    let groups = reader(&bytes).map_err(wrong)?;
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

fn too_many(count: usize) -> String {
    format!("{count} triangles; the limit is {MAX_TRIANGLES} (simplify the mesh)")
}

fn read_obj(bytes: &[u8]) -> std::result::Result<Vec<Group>, String> {
    let faces = bytes.split(|byte| *byte == b'\n').filter(|line| line.trim_ascii_start().starts_with(b"f ")).count();
    if faces > MAX_TRIANGLES {
        return Err(too_many(faces));
    }
    let options =
        tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    // Materials do not matter here, so their files are not looked for.
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, |_| Ok(Default::default()))
        .map_err(|error| format!("not an OBJ mesh ({error})"))?;
    let group = |model: tobj::Model| Group {
        points: model.mesh.positions.chunks_exact(3).map(|p| Point::new(p[0], p[1], p[2])).collect(),
        triangles: model.mesh.indices.chunks_exact(3).map(|i| [i[0], i[1], i[2]]).collect(),
    };
    let groups: Vec<Group> = models.into_iter().map(group).filter(|group| !group.triangles.is_empty()).collect();
    let is_obj = |line: &[u8]| line.starts_with(b"v ") || line.starts_with(b"f ");
    if groups.is_empty() && !bytes.split(|byte| *byte == b'\n').any(is_obj) && !bytes.is_empty() {
        return Err("not an OBJ mesh (no corners and no faces)".into());
    }
    Ok(groups)
}

fn read_stl(bytes: &[u8]) -> std::result::Result<Vec<Group>, String> {
    if bytes.is_empty() {
        return Ok(Vec::new());
    }
    // A binary file may begin with "solid" too; its length gives it away.
    let count = bytes.get(80..84).map(|count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize);
    let is_binary =
        count.is_some_and(|count| count.checked_mul(50).and_then(|n| n.checked_add(84)) == Some(bytes.len()));
    if is_binary && count.is_some_and(|count| count > MAX_TRIANGLES) {
        return Err(too_many(count.unwrap_or(0)));
    }
    let starts_as_text = bytes.starts_with(b"solid");
    if !is_binary && !starts_as_text {
        return Err("not an STL mesh (neither text that begins with `solid` nor binary of the length it claims)".into());
    }
    let mut group = Group::default();
    let mut add = |corners: [[f32; 3]; 3]| {
        let first = group.points.len() as u32;
        group.points.extend(corners.map(Point::from));
        group.triangles.push([first, first + 1, first + 2]);
    };
    if is_binary {
        for record in bytes[84..].chunks_exact(50) {
            let at = |i: usize| f32::from_le_bytes([record[i], record[i + 1], record[i + 2], record[i + 3]]);
            add([12, 24, 36].map(|i| [at(i), at(i + 4), at(i + 8)]));
        }
    } else {
        // The reader wants a space after `solid` even where there is no name.
        let line = Cursor::new(bytes).lines().next().and_then(std::result::Result::ok).unwrap_or_default();
        let named = [b"solid ".as_slice(), &bytes[line.len().min(bytes.len())..]].concat();
        let mut text = Cursor::new(named);
        let reader = stl_io::create_stl_reader(&mut text).map_err(|error| format!("not an STL mesh ({error})"))?;
        for (at, triangle) in reader.enumerate() {
            let triangle = triangle.map_err(|error| format!("triangle {}: broken STL ({error})", at + 1))?;
            if at >= MAX_TRIANGLES {
                return Err(format!("more than {MAX_TRIANGLES} triangles (simplify the mesh)"));
            }
            add(triangle.vertices.map(|v| [v[0], v[1], v[2]]));
        }
    }
    Ok(if group.triangles.is_empty() { Vec::new() } else { vec![group] })
}

fn read_glb(bytes: &[u8]) -> std::result::Result<Vec<Group>, String> {
    let not_glb = |error: gltf::Error| format!("not a GLB mesh ({error})");
    if bytes.is_empty() {
        return Ok(Vec::new());
    }
    if !bytes.starts_with(b"glTF") {
        return Err("not a GLB mesh (it does not begin with `glTF`)".into());
    }
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(bytes).map_err(not_glb)?;
    let buffers = gltf::import_buffers(&document, None, blob).map_err(not_glb)?;
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let mut groups = Vec::new();
    let mut open: Vec<(gltf::Node, nalgebra::Matrix4<f32>, usize)> =
        scene.iter().flat_map(|scene| scene.nodes()).map(|node| (node, nalgebra::Matrix4::identity(), 0)).collect();
    let (mut visited, mut triangles) = (0, 0);
    while let Some((node, world_from_parent, depth)) = open.pop() {
        visited += 1;
        if visited > MAX_NODES || depth > MAX_DEPTH {
            return Err(format!("more than {MAX_NODES} nodes, or nodes nested in themselves"));
        }
        let world_from_node = world_from_parent * nalgebra::Matrix4::from(node.transform().matrix());
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            let group = read_primitive(&primitive, &buffers, &world_from_node)?;
            triangles += group.triangles.len();
            if triangles > MAX_TRIANGLES {
                return Err(format!("more than {MAX_TRIANGLES} triangles (simplify the mesh)"));
            }
            if !group.triangles.is_empty() {
                groups.push(group);
            }
        }
        open.extend(node.children().map(|child| (child, world_from_node, depth + 1)));
    }
    Ok(groups)
}

fn read_primitive(
    primitive: &gltf::Primitive,
    buffers: &[gltf::buffer::Data],
    world_from_node: &nalgebra::Matrix4<f32>,
) -> std::result::Result<Group, String> {
    use gltf::mesh::Mode;
    let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(|data| data.0.as_slice()));
    let Some(positions) = reader.read_positions() else { return Ok(Group::default()) };
    let points: Vec<Point> = positions
        .map(|p| {
            let p = world_from_node.transform_point(&Point::from(p));
            // glTF is y-up, the shelf z-up.
            Point::new(p.x, -p.z, p.y)
        })
        .collect();
    let indices: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None => (0..points.len() as u32).collect(),
    };
    let mut triangles: Vec<[u32; 3]> = match primitive.mode() {
        Mode::Triangles => indices.chunks_exact(3).map(|i| [i[0], i[1], i[2]]).collect(),
        Mode::TriangleFan => indices.windows(2).skip(1).map(|i| [indices[0], i[0], i[1]]).collect(),
        Mode::TriangleStrip => {
            let turn = |(at, i): (usize, &[u32])| if at % 2 == 0 { [i[0], i[1], i[2]] } else { [i[1], i[0], i[2]] };
            indices.windows(3).enumerate().map(turn).collect()
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return Ok(Group::default()),
    };
    if world_from_node.determinant() < 0.0 {
        triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    Ok(Group { points, triangles })
}
