use super::*;
use crate::scene::Catalog;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Corners and outward quads of a box.
fn box_mesh(min: [f32; 3], max: [f32; 3]) -> (Vec<[f32; 3]>, Vec<[u32; 4]>) {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { max[axis] } else { min[axis] });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    ((0..8).map(corner).collect(), quads.to_vec())
}

/// Points and faces of four corners.
type Quads = (Vec<[f32; 3]>, Vec<[u32; 4]>);

fn obj(meshes: &[Quads]) -> String {
    let mut text = String::new();
    let mut first = 1;
    for (at, (points, quads)) in meshes.iter().enumerate() {
        let _ = writeln!(text, "o part{at}");
        for [x, y, z] in points {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for [a, b, c, d] in quads {
            let _ = writeln!(text, "f {} {} {} {}", a + first, b + first, c + first, d + first);
        }
        first += points.len() as u32;
    }
    text
}

struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("folder") }
    }

    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::write(&path, bytes).expect("write");
        path
    }

    fn load(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<(MeshShape, MeshReport)> {
        load_mesh(&self.file(name, bytes), name, None, None)
    }

    fn refusal(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        let message = self.load(name, bytes).expect_err("must be refused").to_string();
        assert!(message.contains(name) && !message.contains('\n'), "{message}");
        message
    }
}

#[test]
fn a_box_far_from_its_origin_stands_centred() {
    let mesh = obj(&[box_mesh([1.0, 2.0, -0.3], [1.1, 2.05, -0.1])]);
    let (shape, report) = Bench::new().load("box.obj", mesh).expect("mesh");
    assert_eq!((report.triangles, report.vertices, report.components), (12, 8, 1));
    assert_eq!((report.parts_from, report.part_vertices.as_slice()), (PartsFrom::Given, [8].as_slice()));
    assert!((report.volume_m3 - 0.001).abs() < 1e-6 && (report.mass_kg - 0.4).abs() < 1e-3 && report.mass_is_estimate);
    let bounds = shape.solid().bounds();
    for (value, expected) in bounds.min.iter().chain(bounds.max.iter()).zip([-0.05, -0.025, 0.0, 0.05, 0.025, 0.2]) {
        assert!((value - expected).abs() < 1e-6, "{bounds:?}");
    }
    assert!(report.warnings.is_empty());
    let class = Catalog::standard();
    let bench = Bench::new();
    let path = bench.file("b.obj", obj(&[box_mesh([0.0; 3], [0.1; 3])]));
    let (_, of_class) = load_mesh(&path, "b.obj", class.by_name("meat_can"), None).expect("mesh");
    assert_eq!((of_class.mass_kg, of_class.mass_is_estimate), (0.370, false));
}

#[test]
fn touching_parts_of_an_obj_stay_apart() {
    let mesh = obj(&[box_mesh([0.0; 3], [0.1, 0.1, 0.1]), box_mesh([0.03, 0.03, 0.1], [0.07, 0.07, 0.2])]);
    let (shape, report) = Bench::new().load("tower.obj", mesh).expect("mesh");
    assert_eq!((shape.parts.len(), report.parts_from), (2, PartsFrom::Given));
    assert!(!shape.solid().contains(Point::new(0.04, 0.0, 0.15)));
}

#[test]
fn a_surface_split_into_groups_is_put_together() {
    let (points, quads) = box_mesh([0.0; 3], [0.1, 0.1, 0.1]);
    let lid = (points.clone(), quads[..1].to_vec());
    let walls = (points, quads[1..].to_vec());
    let (shape, report) = Bench::new().load("groups.obj", obj(&[lid, walls])).expect("mesh");
    assert_eq!((shape.parts.len(), report.components, report.vertices), (1, 1, 8));
}

#[test]
fn a_concave_mesh_is_decomposed() {
    // An L seen from above, 20 cm long and high.
    let plan = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.05], [0.05, 0.05], [0.05, 0.2], [0.0, 0.2]];
    let mut text = String::new();
    for z in [0.0, 0.2] {
        for [x, y] in plan {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
    }
    for i in 0..6 {
        let j = (i + 1) % 6;
        let _ = writeln!(text, "f {} {} {} {}", i + 1, j + 1, j + 7, i + 7);
    }
    // Caps as two boxes each, split at the inner corner.
    for [a, b, c, d] in [[1, 2, 3, 4], [1, 4, 5, 6]] {
        let _ = writeln!(text, "f {d} {c} {b} {a}\nf {} {} {} {}", a + 6, b + 6, c + 6, d + 6);
    }
    let (shape, report) = Bench::new().load("l.obj", text).expect("mesh");
    assert_eq!(report.parts_from, PartsFrom::Decomposed);
    assert!((2..=24).contains(&shape.parts.len()), "{}", shape.parts.len());
    assert!((report.volume_m3 - 0.0035).abs() < 1e-5, "{}", report.volume_m3);
    assert!((report.parts_volume_m3 / 0.0035 - 1.0).abs() < 0.1, "{}", report.parts_volume_m3);
    // The mesh's own frame is moved to the centre of the smallest rectangle; the notch stays free.
    let solid = shape.solid();
    let inside = (0..1000).filter(|i| {
        let at = |k: usize| ((i / 10_usize.pow(k as u32) % 10) as f32 + 0.5) / 10.0;
        let bounds = solid.bounds();
        let size = bounds.size();
        solid.contains(bounds.min + crate::Vector::new(at(0) * size.x, at(1) * size.y, at(2) * size.z))
    });
    let rectangle = report.footprint.size_m;
    let share = inside.count() as f32 / 1000.0;
    assert!(rectangle[0] <= 0.2 * 2.0_f32.sqrt() + 1e-3 && share > 0.2 && share < 0.6, "{rectangle:?} {share}");
}

#[test]
fn stl_text_and_binary_and_glb_give_the_same_box() {
    let (points, quads) = box_mesh([0.0; 3], [0.1, 0.06, 0.2]);
    let triangles: Vec<[[f32; 3]; 3]> = quads
        .iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
        .map(|triangle| triangle.map(|i| points[*i as usize]))
        .collect();
    let mut text = String::from("solid\n");
    let mut binary = vec![0_u8; 80];
    binary.extend((triangles.len() as u32).to_le_bytes());
    for triangle in &triangles {
        text.push_str("facet normal 0 0 0\nouter loop\n");
        binary.extend([0_u8; 12]);
        for [x, y, z] in triangle {
            let _ = writeln!(text, "vertex {x} {y} {z}");
            binary.extend([x, y, z].into_iter().flat_map(|v| v.to_le_bytes()));
        }
        text.push_str("endloop\nendfacet\n");
        binary.extend([0_u8; 2]);
    }
    text.push_str("endsolid\n");
    let bench = Bench::new();
    let files = [("text.stl", text.into_bytes()), ("binary.STL", binary.clone()), ("box.glb", glb(&triangles))];
    for (name, bytes) in files {
        let (shape, report) = bench.load(name, bytes).expect(name);
        assert_eq!((report.triangles, report.vertices, shape.parts.len()), (12, 8, 1), "{name}");
        for (value, expected) in report.size_m.iter().zip([0.1, 0.06, 0.2]) {
            assert!((value - expected).abs() < 1e-6, "{name} {:?}", report.size_m);
        }
    }
    binary.truncate(300);
    assert!(bench.refusal("cut.stl", binary).contains("not an STL mesh"));
}

/// A GLB of loose triangles, whose node turns and doubles them: y is up in the file.
fn glb(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    // Shelf (x, y, z) is glTF (x, z, -y); the node doubles, so the file halves.
    let data: Vec<u8> = triangles
        .iter()
        .flatten()
        .flat_map(|[x, y, z]| [x / 2.0, z / 2.0, -y / 2.0])
        .flat_map(f32::to_le_bytes)
        .collect();
    let count = triangles.len() * 3;
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"children":[1]}},{{"mesh":0,"scale":[2,2,2]}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
"buffers":[{{"byteLength":{0}}}],"bufferViews":[{{"buffer":0,"byteLength":{0}}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3","min":[0,0,-0.03],"max":[0.05,0.1,0]}}]}}"#,
        data.len()
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let total = 12 + 8 + json.len() + 8 + data.len();
    let mut bytes = b"glTF".to_vec();
    for word in [2, total as u32, json.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(json.as_bytes());
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(data);
    bytes
}

#[test]
fn units_that_are_not_metres_are_recognised() {
    let bench = Bench::new();
    let cube = |edge: f32| obj(&[box_mesh([0.0; 3], [edge, edge, edge])]);
    for (edge, factor, unit) in
        [(242.0, 0.001, "millimetres"), (10.2, 0.01, "centimetres"), (0.000_2, 1000.0, "kilometres")]
    {
        let (_, report) = bench.load("cube.obj", cube(edge)).expect("mesh");
        assert_eq!(report.metres_per_unit, factor, "{edge}");
        assert!(
            report.warnings[0].contains("not in metres") && report.warnings[0].contains(unit),
            "{:?}",
            report.warnings
        );
        assert!((report.size_m[0] - edge * factor).abs() < 1e-4);
    }
    let catalog = Catalog::standard();
    let path = bench.file("inches.obj", cube(4.0));
    let (_, report) = load_mesh(&path, "inches.obj", catalog.by_name("tomato_can"), None).expect("mesh");
    assert_eq!(report.metres_per_unit, 0.0254);
    assert!(bench.refusal("huge.obj", cube(1e8)).contains("no object in any of m, cm, mm, inches"));
    assert_eq!(bench.load("large.obj", cube(0.9)).expect("mesh").1.warnings, Vec::<String>::new());
    let told = load_mesh(&bench.file("told.obj", cube(2.5)), "told.obj", None, Some(Unit::Metre)).expect("mesh");
    assert_eq!((told.1.size_m, told.0.unit, told.1.warnings.len()), ([2.5; 3], Some(Unit::Metre), 0));
}

#[test]
fn bad_meshes_are_told_what_is_wrong() {
    let bench = Bench::new();
    let (points, quads) = box_mesh([0.0; 3], [0.1; 3]);
    let open = obj(&[(points.clone(), quads[1..].to_vec())]);
    let message = bench.refusal("open.obj", open);
    assert!(
        message.contains("the mesh is open: 4 edges have a triangle on one side only, the first at ("),
        "{message}"
    );
    for name in ["empty.obj", "empty.stl", "empty.glb"] {
        assert!(bench.refusal(name, "").ends_with("the mesh is empty (no triangles)"));
    }
    assert!(bench.refusal("corners.obj", "v 0 0 0\nv 1 0 0\n").ends_with("the mesh is empty (no triangles)"));
    assert!(bench.refusal("text.obj", "dear diary\n").contains("not an OBJ mesh"));
    assert!(bench.refusal("binary.obj", [0x89, b'P', b'N', b'G', 0xff, 0xfe]).contains("not an OBJ mesh"));
    assert!(bench.refusal("text.stl", "dear diary\n").contains("not an STL mesh"));
    assert!(bench.refusal("text.glb", "dear diary\n").contains("not a GLB mesh"));
    assert!(bench.refusal("cut.glb", &glb(&[[[0.0; 3]; 3]])[..60]).contains("not a GLB mesh"));
    assert!(bench.refusal("mesh.ply", "ply\n").contains("use .obj, .stl or .glb"));
    let nan = obj(&[(points.clone(), quads.clone())]).replacen("0.1", "nan", 1);
    assert!(bench.refusal("nan.obj", nan).contains("not a finite number"));
    let far = obj(&[(points, quads)]).replacen("f 1", "f 99", 1);
    assert!(bench.refusal("far.obj", far).contains("out of bounds"));
    let flat = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\nf 3 2 1\n";
    assert!(bench.refusal("flat.obj", flat).contains("the mesh is flat"));
    let missing = load_mesh(std::path::Path::new("no/such.obj"), "such.obj", None, None).expect_err("missing");
    assert!(matches!(missing, Error::Io { .. }));
}

#[test]
fn a_million_triangles_are_refused_at_once() {
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    for _ in 0..1_000_000 {
        text.push_str("f 1 2 3\n");
    }
    let bench = Bench::new();
    assert!(bench.refusal("huge.obj", text).contains("1000000 triangles; the limit is 200000"));
    let mut binary = vec![0_u8; 84];
    binary[80..84].copy_from_slice(&1_000_000_u32.to_le_bytes());
    binary.resize(84 + 50 * 1_000_000, 0);
    assert!(bench.refusal("huge.stl", binary).contains("1000000 triangles"));
}

#[test]
fn faces_that_are_there_twice_count_once() {
    let bench = Bench::new();
    let (points, quads) = box_mesh([0.0; 3], [0.1; 3]);
    let turned = |quads: &[[u32; 4]]| quads.iter().map(|[a, b, c, d]| [*a, *d, *c, *b]).collect::<Vec<_>>();
    let twice = [quads.clone(), quads.clone()].concat();
    let both_sides = [quads.clone(), turned(&quads)].concat();
    let one_face = [quads.clone(), quads[..1].to_vec()].concat();
    for (name, quads, repeated) in [("twice", twice, 12), ("sides", both_sides, 12), ("one", one_face, 2)] {
        let (shape, report) = bench.load(&format!("{name}.obj"), obj(&[(points.clone(), quads)])).expect(name);
        assert_eq!((shape.parts.len(), report.components), (1, 1), "{name}");
        assert!((report.volume_m3 - 0.001).abs() < 1e-6, "{name} {}", report.volume_m3);
        assert_eq!(report.warnings[0], format!("{repeated} triangles are there twice and count once"), "{name}");
    }
    // The whole object exported twice is a copy; boxes side by side are not, and keep the wall between them.
    let copies = obj(&[(points.clone(), quads.clone()), (points.clone(), quads.clone())]);
    let (_, report) = bench.load("copies.obj", copies).expect("mesh");
    assert_eq!((report.components, report.warnings.len()), (1, 1), "{:?}", report.warnings);
    let beside = obj(&[box_mesh([0.0; 3], [0.1; 3]), box_mesh([0.1, 0.0, 0.0], [0.2, 0.1, 0.1])]);
    for (name, text) in [("apart", beside.clone()), ("together", beside.replace("o part1\n", ""))] {
        let (_, report) = bench.load(&format!("{name}.obj"), text).expect(name);
        assert!((report.volume_m3 - 0.002).abs() < 1e-6 && report.warnings.is_empty(), "{name} {report:?}");
    }
    // A hole stays one, however often the rest is there.
    let open = [quads[1..].to_vec(), quads[1..].to_vec()].concat();
    assert!(bench.refusal("open.obj", obj(&[(points, open)])).contains("the mesh is open: 4 edges"));
}

#[test]
fn a_mesh_far_from_its_origin_is_measured_as_exactly_as_one_that_is_not() {
    let bench = Bench::new();
    for far in [0.0, 1e3, 5e5, 5e7] {
        // Written with all digits, as a surveyor's tools do.
        let (points, quads) = box_mesh([0.0; 3], [0.08, 0.06, 0.12]);
        let mut text = String::new();
        for [x, y, z] in points {
            let _ = writeln!(text, "v {:.4} {:.4} {:.4}", far + f64::from(x), 2.0 * far + f64::from(y), f64::from(z));
        }
        for quad in quads {
            let _ = writeln!(text, "f {}", quad.map(|i| (i + 1).to_string()).join(" "));
        }
        let (shape, report) = bench.load("far.obj", text).expect("mesh");
        assert!((report.volume_m3 / 0.000_576 - 1.0).abs() < 1e-3, "{far}: {}", report.volume_m3);
        assert!((report.size_m[0] - 0.08).abs() < 1e-5 && report.components == 1, "{far}: {:?}", report.size_m);
        assert!(shape.solid().bounds().min.z.abs() < 1e-6);
    }
    let (points, quads) = box_mesh([3000.0, 0.0, 0.0], [3000.25, 0.125, 0.125]);
    let message = bench.refusal("open.obj", obj(&[(points, quads[1..].to_vec())]));
    assert!(message.contains("the first at (3000.1250, 0.0000, 0.0000)"), "where it is in the file: {message}");
}

#[test]
fn winding_is_repaired_and_cavities_are_filled() {
    let (points, mut quads) = box_mesh([0.0; 3], [0.1; 3]);
    quads[2].swap(1, 3);
    let (_, report) = Bench::new().load("turned.obj", obj(&[(points, quads)])).expect("mesh");
    assert!((report.volume_m3 - 0.001).abs() < 1e-6);
    assert_eq!(report.warnings, ["2 triangles were wound the wrong way and were turned"]);

    let (inner, mut quads) = box_mesh([0.01; 3], [0.09; 3]);
    quads.iter_mut().for_each(|quad| quad.swap(1, 3));
    let hollow = obj(&[box_mesh([0.0; 3], [0.1; 3]), (inner, quads)]);
    let (shape, report) = Bench::new().load("hollow.obj", hollow).expect("mesh");
    assert_eq!(
        (shape.parts.len(), report.warnings.as_slice()),
        (1, ["1 closed cavities inside were filled".to_owned()].as_slice())
    );
    assert!((report.volume_m3 - 0.001).abs() < 1e-6);
}

#[test]
fn fine_hulls_are_simplified_and_keep_their_size() {
    // A ball of 40 x 80 patches, 8 cm in diameter.
    let (rings, sides) = (40, 80);
    let mut text = String::from("v 0 0 0.04\nv 0 0 -0.04\n");
    for ring in 1..rings {
        let (sin, cos) = (std::f32::consts::PI * ring as f32 / rings as f32).sin_cos();
        for side in 0..sides {
            let (s, c) = (std::f32::consts::TAU * side as f32 / sides as f32).sin_cos();
            let _ = writeln!(text, "v {} {} {}", 0.04 * sin * c, 0.04 * sin * s, 0.04 * cos);
        }
    }
    let at = |ring: usize, side: usize| 3 + (ring - 1) * sides + side % sides;
    for side in 0..sides {
        let _ = writeln!(
            text,
            "f 1 {} {}\nf 2 {} {}",
            at(1, side),
            at(1, side + 1),
            at(rings - 1, side + 1),
            at(rings - 1, side)
        );
        for ring in 1..rings - 1 {
            let _ = writeln!(
                text,
                "f {} {} {} {}",
                at(ring, side),
                at(ring + 1, side),
                at(ring + 1, side + 1),
                at(ring, side + 1)
            );
        }
    }
    let (_, report) = Bench::new().load("ball.obj", text).expect("mesh");
    assert!(report.part_vertices[0] <= MAX_PART_VERTICES && report.part_vertices.len() == 1);
    assert!(report.size_m.iter().all(|size| (size - 0.08).abs() < 1e-3), "{:?}", report.size_m);
    assert!(report.parts_volume_m3 / report.volume_m3 > 0.95);
    assert_eq!(report.warnings, ["1 parts were simplified to at most 256 corners"]);
}

#[test]
fn scanned_objects_have_the_sizes_of_their_files() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/ycb");
    if !folder.exists() {
        return;
    }
    let load = |name: &str| load_mesh(&folder.join(format!("{name}.obj")), name, None, None).expect(name).1;
    let gelatin = load("gelatin_box");
    assert!((gelatin.footprint.angle_deg - 42.0).abs() < 3.0 || (gelatin.footprint.angle_deg - 132.0).abs() < 3.0);
    assert!((gelatin.footprint.size_m[0] - 0.072).abs() < 0.003 && (gelatin.footprint.size_m[1] - 0.028).abs() < 0.003);
    for (name, parts) in [("cleaner_bottle", 3), ("gum_tin", 3), ("mustard_bottle", 4), ("chips_can", 1)] {
        let report = load(name);
        assert_eq!((report.parts_from, report.part_vertices.len()), (PartsFrom::Given, parts), "{name}");
        assert!(report.warnings.is_empty(), "{name} {:?}", report.warnings);
    }
    let meat_can = load("meat_can");
    assert_eq!((meat_can.parts_from, meat_can.part_vertices.len()), (PartsFrom::Decomposed, 3), "it has a rim");
    assert!((meat_can.parts_volume_m3 / meat_can.volume_m3 - 1.0).abs() < 0.05);
    for name in ["coffee_can", "cookie_box", "cracker_box", "tomato_can"] {
        let report = load(name);
        assert!(
            report.part_vertices.len() == 1 && report.parts_volume_m3 / report.volume_m3 < 1.03,
            "{name} {report:?}"
        );
    }
}
