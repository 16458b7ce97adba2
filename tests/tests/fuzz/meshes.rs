//! Meshes: OBJ, STL in both forms, GLB as bytes and by its JSON.

use super::engine::Target;
use nudge_core::scene::load_mesh;
use nudge_tests::Folder;
use std::fmt::Write as _;

/// Corners and triangles of what most meshes here are: a box, 7 x 6 x 12 cm.
fn cuboid() -> (Vec<[f32; 3]>, Vec<[usize; 3]>) {
    prism(&[[0.0, 0.0], [0.07, 0.0], [0.07, 0.06], [0.0, 0.06]])
}

/// An L from above: not convex, so that it is decomposed.
fn angle() -> (Vec<[f32; 3]>, Vec<[usize; 3]>) {
    prism(&[[0.0, 0.0], [0.1, 0.0], [0.1, 0.03], [0.03, 0.03], [0.03, 0.1], [0.0, 0.1]])
}

/// An outline, 12 cm high; its floor and lid are fans about the first corner.
fn prism(outline: &[[f32; 2]]) -> (Vec<[f32; 3]>, Vec<[usize; 3]>) {
    let n = outline.len();
    let corners = [0.0, 0.12].iter().flat_map(|z| outline.iter().map(|[x, y]| [*x, *y, *z])).collect();
    let mut triangles: Vec<[usize; 3]> = (1..n - 1).flat_map(|i| [[0, i + 1, i], [n, n + i, n + i + 1]]).collect();
    triangles.extend((0..n).flat_map(|i| {
        let next = (i + 1) % n;
        [[i, next, n + next], [i, n + next, n + i]]
    }));
    (corners, triangles)
}

fn obj((corners, triangles): &(Vec<[f32; 3]>, Vec<[usize; 3]>)) -> Vec<u8> {
    let mut text = "# made here\nmtllib a.mtl\no thing\n".to_owned();
    for [x, y, z] in corners {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in triangles {
        let _ = writeln!(text, "f {} {}//1 {}/2/3", a + 1, b + 1, c + 1);
    }
    text.into_bytes()
}

fn stl_text((corners, triangles): &(Vec<[f32; 3]>, Vec<[usize; 3]>)) -> Vec<u8> {
    let mut text = "solid thing\n".to_owned();
    for triangle in triangles {
        text += "facet normal 0 0 0\n outer loop\n";
        triangle.iter().for_each(|at| {
            let [x, y, z] = corners[*at];
            let _ = writeln!(text, "  vertex {x} {y} {z}");
        });
        text += " endloop\nendfacet\n";
    }
    (text + "endsolid thing\n").into_bytes()
}

fn stl_binary((corners, triangles): &(Vec<[f32; 3]>, Vec<[usize; 3]>)) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0_u8; 12]);
        bytes.extend(triangle.iter().flat_map(|at| corners[*at]).flat_map(f32::to_le_bytes));
        bytes.extend([0_u8; 2]);
    }
    bytes
}

/// The binary chunk of a GLB: corners, then indices.
fn numbers((corners, triangles): &(Vec<[f32; 3]>, Vec<[usize; 3]>)) -> Vec<u8> {
    let mut bytes: Vec<u8> = corners.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend(triangles.iter().flatten().flat_map(|at| (*at as u16).to_le_bytes()));
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

/// The JSON chunk that goes with it.
fn document((corners, triangles): &(Vec<[f32; 3]>, Vec<[usize; 3]>)) -> Vec<u8> {
    let (positions, indices) = (12 * corners.len(), 6 * triangles.len());
    let length = (positions + indices).next_multiple_of(4);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"nodes":[{{"mesh":0,"children":[1],"translation":[0.1,0,0]}},{{"rotation":[0,0,0,1],"scale":[1,1,1]}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"mode":4}}]}}],
"buffers":[{{"byteLength":{length}}}],
"bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":{positions}}},
{{"buffer":0,"byteOffset":{positions},"byteLength":{indices}}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
{{"bufferView":1,"componentType":5123,"count":{},"type":"SCALAR"}}]}}"#,
        corners.len(),
        3 * triangles.len()
    )
    .into_bytes()
}

/// A GLB of a JSON chunk and a binary one, its lengths right.
fn glb(json: &[u8], numbers: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF".to_vec();
    for word in [2, (28 + json.len() + numbers.len()) as u32, json.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((numbers.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(numbers);
    bytes
}

/// Gives `nudge mesh` what `made` makes of each input.
fn run(target: Target<'_>, kind: &str, made: impl Fn(&[u8]) -> Vec<u8>) {
    let folder = Folder::new();
    let path = folder.path(&format!("mesh.{kind}"));
    target.run(|input| {
        std::fs::write(&path, made(input)).expect("written");
        let Ok((shape, report)) = load_mesh(&path, "mesh", None, None) else { return false };
        assert!(!shape.parts.is_empty() && shape.parts.iter().flatten().flatten().all(|v| v.is_finite()));
        assert!(report.size_m.iter().all(|size| *size > 0.0) && report.mass_kg.is_finite());
        true
    });
}

#[test]
fn obj_files() {
    let words =
        ["nan", "inf", "f 1 2 3\n", "f -1 -2 -3\n", "v 0 0 0\n", "\\\n", "#", "o a\n", "g b\n", "usemtl\n", "/"];
    let sound = vec![obj(&cuboid()), obj(&angle())];
    run(Target { name: "OBJ", sound, words: &words, inputs: 60 }, "obj", <[u8]>::to_vec);
}

#[test]
fn stl_files() {
    let words = ["nan", "inf", "solid a\n", "endsolid\n", "facet ", "endfacet\n", "vertex 0 0 0\n", "\u{feff}"];
    let sound = vec![stl_text(&cuboid()), stl_text(&angle())];
    run(Target { name: "STL text", sound, words: &words, inputs: 50 }, "stl", <[u8]>::to_vec);
    let sound = vec![stl_binary(&cuboid()), stl_binary(&angle())];
    run(Target { name: "STL binary", sound, words: &[], inputs: 50 }, "stl", <[u8]>::to_vec);
}

#[test]
fn glb_files() {
    let sound = [cuboid(), angle()].map(|shape| glb(&document(&shape), &numbers(&shape))).to_vec();
    run(Target { name: "GLB", sound, words: &["JSON", "BIN\0", "glTF"], inputs: 50 }, "glb", <[u8]>::to_vec);
    let words = [
        "\"byteStride\":12,",
        "\"normalized\":true,",
        "\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"componentType\":5123},\"values\":{\"bufferView\":0}},",
        "\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],",
        "\"children\":[0],",
        "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],",
        "5121",
        "5120",
        "5122",
        "5125",
        "\"VEC2\"",
        "\"uri\":\"data:application/octet-stream;base64,AAAA\",",
        "\"uri\":\"/etc/passwd\",",
        "null",
        "\"mode\":5,",
        "\"mode\":6,",
        "[]",
        "{}",
    ];
    let shape = cuboid();
    let target = Target { name: "GLB by its JSON", sound: vec![document(&shape)], words: &words, inputs: 100 };
    run(target, "glb", |json| glb(json, &numbers(&shape)));
}
