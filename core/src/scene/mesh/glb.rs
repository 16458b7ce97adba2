//! Binary glTF 2.0: the triangles of the default scene, wherever its nodes put them.
//!
//! The document is read by `gltf`, the numbers here: its reader takes every position for a float and every index for a
//! whole number, whatever the file says, and quantised meshes (`KHR_mesh_quantization`) are common.

use super::group::{Corner, Group, MAX_TRIANGLES};
use gltf::accessor::{Accessor, DataType, Dimensions};
use gltf::buffer::{Data, View};
use gltf::json::Value;
use gltf::mesh::{Mode, Primitive, Semantic};

/// Nodes of a scene that are visited at most, so that a node that is its own child ends.
const MAX_NODES: usize = 10_000;
/// Levels of nodes in a scene.
const MAX_DEPTH: usize = 64;
/// Elements of an accessor that are read at most.
const MAX_ELEMENTS: usize = 4 * MAX_TRIANGLES;
/// Extensions that no shape depends on, or that are read here: how their names begin.
const UNDERSTOOD: [&str; 8] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "EXT_texture_",
    "EXT_lights_",
    "MSFT_texture_",
];
/// Compressions that keep the triangles out of the buffers: how their names end, and what they are called.
const COMPRESSIONS: [(&str, &str); 2] = [("_draco_mesh_compression", "Draco"), ("_meshopt_compression", "meshopt")];

/// Reads the primitives of the default scene, one group each.
pub fn read(bytes: &[u8]) -> Result<Vec<Group>, String> {
    if bytes.is_empty() {
        return Ok(Vec::new());
    }
    if !bytes.starts_with(b"glTF") {
        return Err("not a GLB mesh (it does not begin with `glTF`)".into());
    }
    let not_glb = |error: gltf::Error| format!("not a GLB mesh ({error})");
    let binary = gltf::Glb::from_slice(bytes).map_err(not_glb)?;
    let not_json = |error: gltf::json::Error| format!("not a GLB mesh (its JSON: {error})");
    let mut json: Value = gltf::json::deserialize::from_slice(&binary.json).map_err(not_json)?;
    take_extensions(&mut json)?;
    let root = gltf::json::deserialize::from_value(json).map_err(not_json)?;
    let document = gltf::Document::from_json(root).map_err(not_glb)?;
    let blob = binary.bin.map(std::borrow::Cow::into_owned);
    let buffers = gltf::import_buffers(&document, None, blob).map_err(not_glb)?;

    let scene = document.default_scene().or_else(|| document.scenes().next());
    let mut groups = Vec::new();
    let mut open: Vec<(gltf::Node, nalgebra::Matrix4<f64>, usize)> =
        scene.iter().flat_map(|scene| scene.nodes()).map(|node| (node, nalgebra::Matrix4::identity(), 0)).collect();
    let (mut visited, mut triangles) = (0, 0);
    while let Some((node, world_from_parent, depth)) = open.pop() {
        visited += 1;
        if visited > MAX_NODES || depth > MAX_DEPTH {
            return Err(format!("more than {MAX_NODES} nodes, or nodes nested in themselves"));
        }
        let parent_from_node = nalgebra::Matrix4::from(node.transform().matrix()).cast::<f64>();
        let world_from_node = world_from_parent * parent_from_node;
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

/// Refuses what the shape needs and is not read here, by name; takes from the list of what the file requires what is.
fn take_extensions(json: &mut Value) -> Result<(), String> {
    let required: Vec<String> = json["extensionsRequired"]
        .as_array()
        .map(|names| names.iter().filter_map(Value::as_str).map(str::to_owned).collect())
        .unwrap_or_default();
    let compression = |name: &str| COMPRESSIONS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, words)| *words);
    let compressed = |name: &str, words: &str| {
        Err(format!("compressed with {words} ({name}), which is not read here; save it without compression"))
    };
    for name in &required {
        if let Some(words) = compression(name) {
            return compressed(name, words);
        }
        if !UNDERSTOOD.iter().any(|begin| name.starts_with(begin)) {
            return Err(format!("needs the extension {name}, which is not read here"));
        }
    }
    // Compressed all the same, where the file does not say that it must be understood.
    let of_views = list(&json["bufferViews"]).iter();
    let primitives = list(&json["meshes"]).iter().flat_map(|mesh| list(&mesh["primitives"]));
    for part in of_views.chain(primitives) {
        let Some(extensions) = part["extensions"].as_object() else { continue };
        for name in extensions.keys() {
            if let Some(words) = compression(name).filter(|_| !has_plain_positions(json, part)) {
                return compressed(name, words);
            }
        }
    }
    if let Some(document) = json.as_object_mut() {
        document.remove("extensionsRequired");
    }
    Ok(())
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// Whether a compressed primitive has its positions uncompressed beside, as a file may.
fn has_plain_positions(json: &Value, primitive: &Value) -> bool {
    let accessor = primitive["attributes"]["POSITION"].as_u64().and_then(|at| usize::try_from(at).ok());
    accessor.is_some_and(|at| list(&json["accessors"]).get(at).is_some_and(|accessor| accessor["bufferView"].is_u64()))
}

fn read_primitive(
    primitive: &Primitive,
    buffers: &[Data],
    world_from_node: &nalgebra::Matrix4<f64>,
) -> Result<Group, String> {
    if matches!(primitive.mode(), Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
        return Ok(Group::default());
    }
    let Some(positions) = primitive.get(&Semantic::Positions) else { return Ok(Group::default()) };
    if positions.dimensions() != Dimensions::Vec3 {
        return Err(format!("positions are of type {:?}; three numbers each are needed", positions.dimensions()));
    }
    let place = |p: [f64; 3]| {
        let p = world_from_node.transform_point(&Corner::from(p));
        // glTF is y-up, the shelf z-up.
        Corner::new(p.x, -p.z, p.y)
    };
    let points: Vec<Corner> = numbers::<3>(&positions, buffers)?.into_iter().map(place).collect();
    let indices: Vec<u32> = match primitive.indices() {
        None => (0..points.len() as u32).collect(),
        Some(indices) => {
            let whole = matches!(indices.data_type(), DataType::U8 | DataType::U16 | DataType::U32);
            if !whole || indices.dimensions() != Dimensions::Scalar {
                let (kind, size) = (indices.data_type(), indices.dimensions());
                return Err(format!("indices are of type {kind:?} ({size:?}); unsigned whole numbers are needed"));
            }
            numbers::<1>(&indices, buffers)?.into_iter().map(|[i]| i as u32).collect()
        }
    };
    let mut triangles: Vec<[u32; 3]> = match primitive.mode() {
        Mode::TriangleFan => indices.windows(2).skip(1).map(|i| [indices[0], i[0], i[1]]).collect(),
        Mode::TriangleStrip => {
            let turn = |(at, i): (usize, &[u32])| if at % 2 == 0 { [i[0], i[1], i[2]] } else { [i[1], i[0], i[2]] };
            indices.windows(3).enumerate().map(turn).collect()
        }
        _ => indices.chunks_exact(3).map(|i| [i[0], i[1], i[2]]).collect(),
    };
    if world_from_node.determinant() < 0.0 {
        triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    Ok(Group { points, triangles })
}

/// The elements of an accessor, of any component type, each of `N` numbers.
fn numbers<const N: usize>(accessor: &Accessor, buffers: &[Data]) -> Result<Vec<[f64; N]>, String> {
    let (count, kind) = (accessor.count(), accessor.data_type());
    if count > MAX_ELEMENTS {
        return Err(format!("an accessor of {count} elements; the limit is {MAX_ELEMENTS}"));
    }
    let element = |bytes: &[u8]| -> [f64; N] {
        std::array::from_fn(|at| number(&bytes[at * kind.size()..], kind, accessor.normalized()))
    };
    let size = N * kind.size();
    let mut values = match accessor.view() {
        Some(view) => elements(&view, accessor.offset(), size, count, buffers)?.map(element).collect(),
        None => vec![[0.0; N]; count],
    };
    if let Some(sparse) = accessor.sparse() {
        let (indices, replaced) = (sparse.indices(), sparse.values());
        let index_kind = match indices.index_type() {
            gltf::accessor::sparse::IndexType::U8 => DataType::U8,
            gltf::accessor::sparse::IndexType::U16 => DataType::U16,
            gltf::accessor::sparse::IndexType::U32 => DataType::U32,
        };
        let places = elements(&indices.view(), indices.offset(), index_kind.size(), sparse.count(), buffers)?;
        let replaced = elements(&replaced.view(), replaced.offset(), size, sparse.count(), buffers)?;
        for (place, value) in places.zip(replaced) {
            let place = number(place, index_kind, false) as usize;
            *values.get_mut(place).ok_or("a sparse accessor replaces an element that is not there")? = element(value);
        }
    }
    Ok(values)
}

/// The bytes of `count` elements of `size` bytes in a buffer view.
fn elements<'b>(
    view: &View,
    offset: usize,
    size: usize,
    count: usize,
    buffers: &'b [Data],
) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, String> {
    let beyond = || "an accessor reaches beyond its buffer".to_owned();
    let range = view.offset().checked_add(view.length()).map(|end| view.offset()..end);
    let data = buffers.get(view.buffer().index()).map_or(&[][..], |data| data.0.as_slice());
    let bytes = range.and_then(|range| data.get(range)).ok_or_else(beyond)?;
    let stride = view.stride().unwrap_or(size);
    if stride < size {
        return Err(format!("elements of {size} bytes lie {stride} bytes apart in their buffer view"));
    }
    let end = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
    if end.and_then(|end| end.checked_add(offset)).is_none_or(|end| end > bytes.len()) {
        return Err(beyond());
    }
    Ok((0..count).map(move |at| &bytes[offset + at * stride..][..size]))
}

/// The first number of `bytes`; a normalised one is a share of its type's largest.
fn number(bytes: &[u8], kind: DataType, normalized: bool) -> f64 {
    let (value, largest) = match kind {
        DataType::I8 => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        DataType::U8 => (f64::from(bytes[0]), f64::from(u8::MAX)),
        DataType::I16 => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), f64::from(i16::MAX)),
        DataType::U16 => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), f64::from(u16::MAX)),
        DataType::U32 => (f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])), f64::from(u32::MAX)),
        DataType::F32 => (f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])), 1.0),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
