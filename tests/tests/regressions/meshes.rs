//! Meshes as other programs write them.

use super::Folder;
use nudge_tests::{nudge, nudge_fails, text};
use serde_json::Value;
use std::fmt::Write as _;

/// Corners and outward quads of a box.
fn cuboid(min: [f64; 3], max: [f64; 3]) -> (Vec<[f64; 3]>, [[usize; 4]; 6]) {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { max[axis] } else { min[axis] });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    ((0..8).map(corner).collect(), quads)
}

/// The box of these tests, 7 x 7 x 12 cm.
const SIZE: [f64; 3] = [0.07, 0.07, 0.12];

/// The lines of an OBJ box: what `corner` and `face` make of each.
fn obj(corner: impl Fn(usize, [f64; 3]) -> String, face: impl Fn([usize; 4]) -> String) -> String {
    let (points, quads) = cuboid([0.0; 3], SIZE);
    let corners = points.iter().enumerate().map(|(at, point)| corner(at, *point) + "\n");
    corners.chain(quads.iter().map(|quad| face(quad.map(|i| i + 1)) + "\n")).collect()
}

fn v(_: usize, [x, y, z]: [f64; 3]) -> String {
    format!("v {x} {y} {z}")
}

fn f([a, b, c, d]: [usize; 4]) -> String {
    format!("f {a} {b} {c} {d}")
}

/// The facets of a box as STL text.
fn facets(min: [f64; 3], max: [f64; 3], normal: &str) -> String {
    let (points, quads) = cuboid(min, max);
    let mut text = String::new();
    for [a, b, c, d] in quads {
        for triangle in [[a, b, c], [a, c, d]] {
            let _ = writeln!(text, "  facet normal {normal}\n    outer loop");
            for [x, y, z] in triangle.map(|i| points[i]) {
                let _ = writeln!(text, "      vertex {x} {y} {z}");
            }
            text += "    endloop\n  endfacet\n";
        }
    }
    text
}

/// What `nudge mesh` reports, which must succeed.
fn report(folder: &Folder, name: &str, content: impl AsRef<[u8]>, more: &[&str]) -> Value {
    let file = folder.write(name, content);
    let output = nudge(&[&["mesh", &file, "--json"], more].concat());
    assert!(output.status.success(), "{name}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Whether a report is one of the test's box, whatever its warnings.
fn assert_box(report: &Value, name: &str) {
    let volume_m3 = report["volume_m3"].as_f64().expect("volume");
    assert!((volume_m3 / SIZE.iter().product::<f64>() - 1.0).abs() < 1e-3, "{name}: {report}");
    let sizes = report["size_m"].as_array().expect("size").iter().map(|size| size.as_f64().expect("a number"));
    assert!(sizes.zip(SIZE).all(|(size, expected)| (size - expected).abs() < 1e-5), "{name}: {report}");
}

fn refusal(folder: &Folder, name: &str, content: impl AsRef<[u8]>) -> String {
    let line = nudge_fails(2, &["mesh", &folder.write(name, content)]);
    assert!(line.contains(name), "{line}");
    line
}

#[test]
fn the_second_solid_of_an_stl_was_lost_in_silence() {
    let folder = Folder::new();
    let bottom = facets([0.0; 3], [0.08, 0.08, 0.05], "0 0 0");
    let lid = facets([-0.01, -0.01, 0.051], [0.09, 0.09, 0.071], "0 0 0");
    let file = format!("solid bottom\n{bottom}endsolid bottom\nsolid lid\n{lid}endsolid lid\n");
    let report = report(&folder, "two.stl", file, &[]);
    assert_eq!((&report["components"], &report["triangles"]), (&2.into(), &24.into()));
    let volume_m3 = report["volume_m3"].as_f64().expect("volume");
    assert!((volume_m3 - 0.000_52).abs() < 1e-6, "{report}");
}

#[test]
fn an_stl_as_text_was_refused_for_its_normals_its_name_or_what_comes_first() {
    let folder = Folder::new();
    let solid = |name: &str, normal: &str| format!("solid {name}\n{}endsolid {name}\n", facets([0.0; 3], SIZE, normal));
    let mut latin1 = solid("bo\u{1}te", "0 0 0").into_bytes();
    latin1.iter_mut().filter(|byte| **byte == 1).for_each(|byte| *byte = 0xee);
    let cases: [(&str, Vec<u8>); 6] = [
        ("nan.stl", solid("x", "nan nan nan").into_bytes()),
        ("words.stl", solid("x", "-1.#IND 0 inf").into_bytes()),
        ("blank.stl", [b"\n \r\n", solid("x", "0 0 0").as_bytes()].concat()),
        ("mark.stl", [b"\xef\xbb\xbf", solid("x", "0 0 0").as_bytes()].concat()),
        ("latin1.stl", latin1),
        ("capitals.stl", solid("x", "0 0 0").to_uppercase().into_bytes()),
    ];
    for (name, content) in cases {
        assert_box(&report(&folder, name, content, &[]), name);
    }
    let whole = solid("x", "0 0 0");
    let line = refusal(&folder, "cut.stl", whole.rsplit_once("endloop").map_or("", |(begin, _)| begin));
    assert!(line.contains("line 79: the file ends inside this facet"), "{line}");
    let line = refusal(&folder, "comma.stl", solid("x", "0 0 0").replacen("0.07", "0,07", 1));
    assert!(line.contains("line ") && line.contains("`0,07` is no number"), "{line}");
}

#[test]
fn an_obj_was_refused_for_what_is_not_its_shape() {
    let folder = Folder::new();
    let paint = |at: usize, point: [f64; 3], rest: &str| format!("{} {rest}", v(at, point));
    let latin1 = [b"# export\xe9\no bo\xeete\n".as_slice(), obj(v, f).as_bytes()].concat();
    let cases: [(&str, Vec<u8>); 9] = [
        ("rgba.obj", obj(|at, p| paint(at, p, "0.8 0.1 0.1 1.0"), f).into_bytes()),
        ("some.obj", obj(|at, p| if at < 4 { paint(at, p, "0.8 0.1 0.1") } else { v(at, p) }, f).into_bytes()),
        ("comment.obj", obj(|at, p| paint(at, p, "  # corner"), f).into_bytes()),
        ("continued.obj", obj(v, |[a, b, c, d]| format!("f {a} {b} \\\n {c} {d}")).into_bytes()),
        ("continued-cr.obj", obj(v, |[a, b, c, d]| format!("f {a} {b} \\\r\n {c} {d}")).into_bytes()),
        ("usemtl.obj", format!("mtllib \n{}", obj(v, f).replacen("f ", "usemtl \nf ", 1)).into_bytes()),
        ("normals.obj", obj(v, |quad| format!("f {}", quad.map(|i| format!("{i}//9")).join(" "))).into_bytes()),
        ("latin1.obj", latin1),
        ("mark.obj", [b"\xef\xbb\xbf".as_slice(), obj(v, f).as_bytes()].concat()),
    ];
    for (name, content) in cases {
        assert_box(&report(&folder, name, content, &[]), name);
    }
    // Painted and plain objects in one file.
    let (points, quads) = cuboid([0.0, 0.0, 0.12], [0.07, 0.07, 0.2]);
    let mut both = format!("o painted\n{}o plain\n", obj(|at, p| paint(at, p, "0.4 0.5 0.1"), f));
    points.iter().enumerate().for_each(|(at, point)| both += &(v(at, *point) + "\n"));
    quads.iter().for_each(|quad| both += &(f(quad.map(|i| i + 9)) + "\n"));
    assert_eq!(report(&folder, "both.obj", both, &[])["components"], 2);
    // What is really wrong is told with its line.
    let line = refusal(&folder, "comma.obj", obj(v, f).replacen("0.12", "0,12", 1));
    assert!(line.contains("line 5") && line.contains("`0,12` is no number"), "{line}");
    let line = refusal(&folder, "short.obj", obj(|_, [x, y, _]| format!("v {x} {y}"), f));
    assert!(line.contains("line 1: a corner (v) of 2 numbers"), "{line}");
    let line = refusal(&folder, "index.obj", obj(v, f).replacen("f 1 ", "f 11 ", 1));
    assert!(line.contains("line 9: corner 11 is out of bounds"), "{line}");
    let wide: Vec<u8> = obj(v, f).encode_utf16().flat_map(u16::to_le_bytes).collect();
    let line = refusal(&folder, "wide.obj", [b"\xff\xfe".as_slice(), &wide].concat());
    assert!(line.contains("UTF-16"), "{line}");
}

/// A GLB: its JSON and its binary part.
fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_string();
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let mut bytes = b"glTF".to_vec();
    for word in [2, (12 + 8 + json.len() + 8 + binary.len()) as u32, json.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(json.as_bytes());
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

/// The test's box as a document with 72 bytes of indices before its positions; `change` makes of it what is wrong with it.
fn gltf(positions: &[u8], component: u32, change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let (_, quads) = cuboid([0.0; 3], SIZE);
    let indices = quads.iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d]).flat_map(|i| (*i as u16).to_le_bytes());
    let mut json = serde_json::json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 1 }, "indices": 0 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5123, "count": 36, "type": "SCALAR" },
            { "bufferView": 1, "componentType": component, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1] },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 72 },
            { "buffer": 0, "byteOffset": 72, "byteLength": positions.len() },
        ],
        "buffers": [{ "byteLength": 72 + positions.len() }],
    });
    change(&mut json);
    glb(&json, &indices.chain(positions.iter().copied()).collect::<Vec<u8>>())
}

/// The corners of the test's box as glTF has them, y up: in shares of its size.
fn corners() -> Vec<[f64; 3]> {
    // Upright (x, y, z) is glTF (x, z, -y): the box lies behind its origin.
    cuboid([0.0; 3], [1.0; 3]).0.into_iter().map(|[x, y, z]| [x, z, 1.0 - y]).collect()
}

fn floats() -> Vec<u8> {
    corners()
        .into_iter()
        .flat_map(|[x, y, z]| [0.07 * x, 0.12 * y, 0.07 * z])
        .flat_map(|v| (v as f32).to_le_bytes())
        .collect()
}

#[test]
fn a_glb_whose_numbers_are_not_what_is_usual_made_the_reader_panic() {
    let folder = Folder::new();
    // Quantised without saying so, positions eight bytes apart, other data in the same buffer view behind them.
    let mut shorts: Vec<u8> = corners()
        .into_iter()
        .flat_map(|[x, y, z]| [x, y, z, 0.0])
        .flat_map(|v| ((v * 16383.0) as u16).to_le_bytes())
        .collect();
    shorts.extend([0x55; 128]);
    let scale = [0.07 / 16383.0, 0.12 / 16383.0, 0.07 / 16383.0];
    let quantised = |json: &mut Value| {
        json["nodes"][0]["scale"] = serde_json::json!(scale);
        json["bufferViews"][1]["byteStride"] = 8.into();
        json["extensionsUsed"] = serde_json::json!(["KHR_mesh_quantization"]);
    };
    assert_box(&report(&folder, "silent.glb", gltf(&shorts, 5123, quantised), &[]), "silent.glb");
    let declared = gltf(&shorts, 5123, |json| {
        quantised(json);
        json["extensionsRequired"] = serde_json::json!(["KHR_mesh_quantization", "KHR_texture_transform"]);
    });
    assert_box(&report(&folder, "declared.glb", declared, &[]), "declared.glb");
    // Shares of the largest number.
    let bytes: Vec<u8> =
        corners().into_iter().flat_map(|[x, y, z]| [x, y, z, 0.0]).map(|v| (v * 255.0) as u8).collect();
    let shares = gltf(&bytes, 5121, |json| {
        json["nodes"][0]["scale"] = serde_json::json!([0.07, 0.12, 0.07]);
        json["bufferViews"][1]["byteStride"] = 4.into();
        json["accessors"][1]["normalized"] = true.into();
    });
    assert_box(&report(&folder, "shares.glb", shares, &[]), "shares.glb");
    assert_box(&report(&folder, "plain.glb", gltf(&floats(), 5126, |_| {}), &[]), "plain.glb");

    let refuse = |name: &str, change: &dyn Fn(&mut Value)| refusal(&folder, name, gltf(&floats(), 5126, change));
    let line = refuse("floats.glb", &|json| json["accessors"][0]["componentType"] = 5126.into());
    assert!(line.contains("indices are of type F32"), "{line}");
    let line = refuse("beyond.glb", &|json| json["accessors"][1]["count"] = 80.into());
    assert!(line.contains("beyond its buffer"), "{line}");
    let line = refuse("endless.glb", &|json| json["accessors"][0]["count"] = 4_000_000_000_u64.into());
    assert!(line.contains("4000000000 elements"), "{line}");
    // An accessor that is not there breaks the library that reads the document.
    let line = refuse("nowhere.glb", &|json| json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 7.into());
    assert!(!line.contains("panicked"), "{line}");
}

#[test]
fn a_compressed_glb_was_no_glb_or_read_as_garbage() {
    let folder = Folder::new();
    let refuse = |name: &str, change: &dyn Fn(&mut Value)| refusal(&folder, name, gltf(&floats(), 5126, change));
    let draco =
        serde_json::json!({ "KHR_draco_mesh_compression": { "bufferView": 1, "attributes": { "POSITION": 0 } } });
    let compressed = |json: &mut Value| {
        json["meshes"][0]["primitives"][0]["extensions"] = draco.clone();
        json["extensionsUsed"] = serde_json::json!(["KHR_draco_mesh_compression"]);
        for accessor in json["accessors"].as_array_mut().expect("accessors") {
            accessor.as_object_mut().expect("an accessor").remove("bufferView");
        }
    };
    let line = refuse("draco.glb", &|json| {
        compressed(json);
        json["extensionsRequired"] = serde_json::json!(["KHR_draco_mesh_compression"]);
    });
    assert!(line.contains("compressed with Draco"), "{line}");
    assert!(refuse("quiet.glb", &compressed).contains("compressed with Draco"));
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let line = refuse("meshopt.glb", &|json| {
            json["bufferViews"][1]["extensions"] = serde_json::json!({ name: { "buffer": 0, "byteOffset": 72, "byteLength": 90, "byteStride": 12, "count": 8 } });
            json["extensionsUsed"] = serde_json::json!([name]);
        });
        assert!(line.contains("compressed with meshopt") && line.contains(name), "{line}");
    }
    let line =
        refuse("instances.glb", &|json| json["extensionsRequired"] = serde_json::json!(["EXT_mesh_gpu_instancing"]));
    assert!(line.contains("needs the extension EXT_mesh_gpu_instancing"), "{line}");
    // What is uncompressed beside is read.
    let both = gltf(&floats(), 5126, |json| json["meshes"][0]["primitives"][0]["extensions"] = draco.clone());
    assert_box(&report(&folder, "both.glb", both, &[]), "both.glb");
}

#[test]
fn a_mesh_with_every_face_twice_was_twice_as_heavy() {
    let folder = Folder::new();
    let faces = obj(|_, _| String::new(), f);
    let report = report(&folder, "twice.obj", obj(v, f) + &faces, &[]);
    assert_box(&report, "twice.obj");
    assert!(
        report["warnings"][0].as_str().is_some_and(|words| words.contains("12 triangles are there twice")),
        "{report}"
    );
}

#[test]
fn a_mesh_far_from_its_origin_was_called_flat() {
    let folder = Folder::new();
    // Easting and northing, metres.
    let far = obj(|_, [x, y, z]| format!("v {:.3} {:.3} {z}", 448_262.5 + x, 5_411_932.25 + y), f);
    assert_box(&report(&folder, "far.obj", far, &[]), "far.obj");
}

#[test]
fn a_tin_in_inches_or_decimetres_was_taken_as_metres() {
    let folder = Folder::new();
    let tin = |metres: f64| obj(|at, point| v(at, point.map(|value| value / metres)), f);
    let warned = |report: &Value, unit: &str| {
        let words = report["warnings"][0].as_str().unwrap_or_default();
        assert!(words.contains("not in metres") && words.contains(unit), "{report}");
    };
    let of_class = ["--class", "tomato_can"];
    for (metres, unit, words) in [(0.0254, "in", "inches"), (0.1, "dm", "decimetres")] {
        let guessed = report(&folder, "tin.obj", tin(metres), &of_class);
        assert_box(&guessed, unit);
        warned(&guessed, words);
        let told = report(&folder, "tin.obj", tin(metres), &["--unit", unit]);
        assert_box(&told, unit);
        assert_eq!(
            (&told["unit"], &told["warnings"]),
            (&unit.into(), &serde_json::json!([])),
            "what is told is believed"
        );
    }
    // Without a class nothing tells that 1.3 is not metres but its size.
    let flat = obj(|at, [x, y, z]| v(at, [x / 0.0254, y / 0.0254, z / 0.0254 / 2.0]), f);
    warned(&report(&folder, "flat.obj", flat, &[]), "inches");
    let line = nudge(&["mesh", &folder.write("tin.obj", tin(1.0)), "--unit", "parsec"]);
    assert_eq!(line.status.code(), Some(2));
    assert!(text(&line.stderr).contains("m, dm, cm, mm, in, km"), "{}", text(&line.stderr));
}
