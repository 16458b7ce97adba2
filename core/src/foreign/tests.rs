use super::*;
use crate::camera::project;
use crate::environment::Environment;
use crate::recording::Board;
use crate::scene::CLASS_COUNT;
use nalgebra::{Translation3, UnitQuaternion};

/// 4 x 6 x 3 voxels of 5 cm.
fn board() -> Board {
    let mut board = Board::default();
    board.shelf.size = [0.2, 0.3, 0.15];
    board.shelf.voxel_m = 0.05;
    board
}

/// Some voxels are occupied, some free, some unknown.
fn belief() -> Belief {
    let grid = board().shelf.grid();
    let mut belief = Belief::uniform(grid);
    for (at, voxel) in belief.occupancy.iter_mut().enumerate() {
        *voxel = [[1.0, 1.0], [5.0, 1.0], [1.0, 2.0]][at * 7 / 3 % 3];
    }
    for (at, classes) in belief.semantics.iter_mut().enumerate() {
        classes[at % CLASS_COUNT] += 3.0;
    }
    belief
}

/// 1 for occupied, -1 for free, 0 for neither.
fn signs(belief: &Belief) -> Vec<i8> {
    belief.occupancy.iter().map(|a| i8::from(a[0] > a[1]) - i8::from(a[0] < a[1])).collect()
}

struct Files(tempfile::TempDir);

impl Files {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn read(&self, name: &str, bytes: &[u8]) -> Result<ForeignMap> {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        read_map(&path)
    }

    fn said(&self, name: &str, bytes: &[u8]) -> String {
        let folder = format!("{}/", self.0.path().display());
        self.read(name, bytes).expect_err("refused").to_string().replace(&folder, "")
    }
}

#[test]
fn what_is_written_reads_back() {
    let files = Files::new();
    let written = |name: &str| {
        let path = files.0.path().join(name);
        write_map(&path, &belief()).expect("written");
        read_map(&path).expect("reads").belief(&board()).expect("lies there")
    };
    assert_eq!(written("a.npz").belief, belief());
    let tree = written("a.bt");
    assert_eq!(signs(&tree.belief), signs(&belief()));
    assert_eq!(tree.belief.semantics, Belief::uniform(belief().grid).semantics);
    let cloud = written("a.ply");
    let occupied: Vec<i8> = signs(&belief()).into_iter().map(|sign| sign.max(0)).collect();
    assert_eq!(signs(&cloud.belief), occupied);
    assert!(write_map(&files.0.path().join("a.ot"), &belief()).is_err());
}

/// A header of a tree of voxels of this size.
fn head(first: &str, id: &str, resolution: &str) -> Vec<u8> {
    format!("{first}\n# comment\nid {id}\nsize 3\nres {resolution}\ndata\n").into_bytes()
}

const BINARY: &str = "# Octomap OcTree binary file";
const FULL: &str = "# Octomap OcTree file";

/// A tree whose part at x >= 0, y >= 0, z >= 0 is occupied but for its own part next to the origin, which is free.
fn tree(first: &str, id: &str, resolution: &str) -> Vec<u8> {
    let mut bytes = head(first, id, resolution);
    if first == BINARY {
        bytes.extend([0b0000_0000, 0b1100_0000]);
        bytes.extend([0b1010_1001, 0b1010_1010]);
        return bytes;
    }
    let after: &[u8] = if id == "ColorOcTree" { &[1, 2, 3] } else { &[] };
    let mut node = |log_odds: f32, parts: u8| {
        bytes.extend(log_odds.to_le_bytes());
        bytes.extend(after);
        bytes.push(parts);
    };
    node(1.0, 0x80);
    node(1.0, 0xff);
    (0..8).for_each(|part| node(if part == 0 { -1.5 } else { 2.5 }, 0));
    bytes
}

#[test]
fn trees_of_all_kinds_are_read() {
    let files = Files::new();
    for (name, first, id, [free, occupied]) in [
        ("a.bt", BINARY, "OcTree", [-2.0, 3.5]),
        ("a.ot", FULL, "OcTree", [-1.5, 2.5]),
        ("a.ot", FULL, "ColorOcTree", [-1.5, 2.5]),
    ] {
        // 16 levels: the part's own parts are 0.05 * 2^14 = 819.2 m large.
        let map = files.read(name, &tree(first, id, "0.05")).expect(name);
        let mut board = board();
        let at = |board: &Board| map.belief(board).expect("lies there").belief;
        let belief = at(&board);
        let unknown = belief.occupancy.iter().filter(|a| **a == [1.0; 2]).count();
        assert_eq!(unknown, belief.occupancy.len() / 2, "the left half of the shelf");
        let log_odds = |belief: &Belief, voxel: usize| crate::belief::log_odds(belief.occupancy[voxel]);
        let last = belief.occupancy.len() - 1;
        assert!((log_odds(&belief, last) - free).abs() < 1e-4, "{name} {id}");
        board.recording_from_board = Translation3::new(1000.0, 1000.0, 1000.0).into();
        assert!((log_odds(&at(&board), last) - occupied).abs() < 1e-4, "{name} {id}");
        board.recording_from_board = Translation3::new(-1000.0, 0.0, 0.0).into();
        let said = map.belief(&board).expect_err("unknown there").to_string();
        assert!(said.contains("nothing of it lies in the board's box of 0.2 x 0.3 x 0.15 m"), "{said}");
    }
}

#[test]
fn a_turned_board_sees_the_tree_from_its_side() {
    let files = Files::new();
    let map = files.read("a.bt", &tree(BINARY, "OcTree", "0.05")).expect("reads");
    let mut board = board();
    // The board's x is the map's y, and its y the map's -x: unknown but for a shelf that stands at +x.
    let turn = UnitQuaternion::from_axis_angle(&crate::Vector::z_axis(), std::f32::consts::FRAC_PI_2);
    board.recording_from_board = crate::Pose::from_parts(Translation3::new(0.151, 0.5, 0.0), turn);
    let belief = map.belief(&board).expect("lies there").belief;
    let known = |cell: usize| belief.occupancy[belief.grid.column(cell).start] != [1.0; 2];
    let rows: Vec<bool> = (0..6).map(known).collect();
    assert_eq!(rows, [true, true, true, false, false, false]);
}

#[test]
fn another_resolution_is_resampled_and_said() {
    let files = Files::new();
    let fine = files.read("a.bt", &tree(BINARY, "OcTree", "0.02")).expect("reads");
    let placed = fine.belief(&board()).expect("lies there");
    assert_eq!(placed.remarks[0], "its voxels of 0.02 m are resampled to 0.05 m");
    assert_eq!(placed.remarks[1], "it knows 50.0 % of the shelf");
}

#[test]
fn damaged_trees_are_told_by_their_place() {
    let files = Files::new();
    let whole = tree(BINARY, "OcTree", "0.05");
    let said = |bytes: &[u8]| files.said("a.bt", bytes);
    let end = whole.len();
    assert_eq!(
        said(&whole[..end - 1]),
        format!("a.bt: byte {}: the file ends in the middle, after {} bytes", end - 2, end - 1)
    );
    assert!(said(&[&whole[..], b"x"].concat()).ends_with("1 bytes follow behind the tree"));
    assert!(said(b"ply\n").contains("header: does not begin with"));
    assert!(said(&[0xff; 9000]).contains("header: does not begin with"));
    assert!(said(&tree(BINARY, "OcTreeStamped", "0.05")).contains("id is OcTreeStamped"));
    for resolution in ["0", "nan", "-1", "x"] {
        assert!(said(&tree(BINARY, "OcTree", resolution)).contains(&format!("res {resolution}: ")));
    }
    let deep = [head(BINARY, "OcTree", "0.05"), [0xff; 2 * 40].to_vec()].concat();
    assert!(said(&deep).ends_with("goes down more than 16 levels"));
    let mut nan = tree(FULL, "OcTree", "0.05");
    let at = nan.len() - 5;
    nan[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(files.said("a.ot", &nan).ends_with("a voxel has log-odds NaN"));
}

/// Two points in a shelf, one outside and one that is none, with a normal, a colour and faces before them.
fn cloud(encoding: &str) -> Vec<u8> {
    let points = [[0.01, 0.02, 0.03], [0.01, 0.02, 0.03], [9.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0]];
    let mut bytes = format!(
        "ply\nformat {encoding} 1.0\ncomment made here\nelement face 2\nproperty list uchar int vertex_indices\n\
         element vertex 4\nproperty double nx\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nend_header\n"
    )
    .into_bytes();
    if encoding == "ascii" {
        bytes.extend(b"3 0 1 2\n2 0 1\n");
        points.iter().for_each(|[x, y, z]| bytes.extend(format!("1 {x} {y} {z} 255\n").into_bytes()));
        return bytes;
    }
    let big = encoding.contains("big");
    let turned = |bytes: &[u8]| -> Vec<u8> { if big { bytes.iter().rev().copied().collect() } else { bytes.to_vec() } };
    for count in [3_u8, 2] {
        bytes.push(count);
        (0..i32::from(count)).for_each(|index| bytes.extend(turned(&index.to_le_bytes())));
    }
    for point in points {
        bytes.extend(turned(&1.0_f64.to_le_bytes()));
        point.iter().for_each(|x| bytes.extend(turned(&x.to_le_bytes())));
        bytes.push(255);
    }
    bytes
}

#[test]
fn clouds_of_all_encodings_are_read_and_what_is_no_point_is_said() {
    let files = Files::new();
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let placed = files.read("a.ply", &cloud(encoding)).expect(encoding).belief(&board()).expect("lies there");
        assert_eq!(placed.remarks, ["2 of 3 points lie in the shelf", "1 points are not finite and left out"]);
        let index = placed.belief.grid.index(placed.belief.grid.voxel_at(Point::new(0.01, 0.02, 0.03)).expect("in"));
        let log_odds = crate::belief::log_odds(placed.belief.occupancy[index]);
        assert!((log_odds - 1.7).abs() < 1e-4, "two hits: {log_odds}");
        assert_eq!(signs(&placed.belief).iter().filter(|sign| **sign != 0).count(), 1);
        let whole = cloud(encoding);
        let said = files.said("a.ply", &whole[..whole.len() - 5]);
        assert!(said.starts_with("a.ply: vertex 3: "), "{said}");
    }
    let changed = |from: &str, to: &str| {
        let text = String::from_utf8(cloud("ascii")).expect("text").replacen(from, to, 1);
        files.said("a.ply", text.as_bytes())
    };
    assert!(changed("ply", "plie").ends_with("header: does not begin with \"ply\""));
    assert!(changed("float z", "float w").ends_with("header: its vertices have no z"));
    assert!(changed("ascii", "utf8").contains("\"format utf8 1.0\" is not understood"));
    assert!(changed("vertex 4", "vertex 99999999999").contains("vertex 0: 99999999999 points"));
    assert!(changed("0.01", "one").ends_with("vertex 0: \"one\" is no number"));
    assert!(changed("end_header", "end").contains("\"end\" is not understood"));
}

#[test]
fn archives_with_missing_or_misshapen_arrays_are_told_by_name() {
    use crate::episode::Archive;
    let files = Files::new();
    let archive = |arrays: &[(&str, &[usize], f32)]| {
        let mut archive = Archive::new();
        for (name, shape, value) in arrays {
            archive.add(name, shape, &vec![*value; shape.iter().product()]);
        }
        archive.finish()
    };
    let sound = archive(&[("probability", &[4, 6, 3], 0.25), ("voxel_m", &[1], 0.05)]);
    let placed = files.read("a.npz", &sound).expect("reads").belief(&board()).expect("fits");
    assert!((placed.belief.probability(7) - 0.25).abs() < 1e-5);
    let untold = files.read("a.npz", &archive(&[("probability", &[4, 6, 3], 0.5)])).expect("reads");
    assert!(untold.belief(&board()).is_ok_and(|placed| placed.belief.grid == board().shelf.grid()));
    let other = archive(&[("probability", &[4, 6, 3], 0.5), ("voxel_m", &[1], 0.005)]);
    let other = files.read("a.npz", &other).expect("reads");
    let said = other.belief(&board()).expect_err("another grid").to_string();
    assert!(said.ends_with("has 4 x 6 x 3 voxels of 0.005 m, and the shelf has 4 x 6 x 3 voxels of 0.05 m"), "{said}");
    for (arrays, words) in [
        (&[("grid", &[4_usize, 6, 3][..], 0.5)][..], "a.npz: has neither an array occupancy nor"),
        (&[("occupancy", &[4, 6, 3], 1.0)], "array occupancy: has shape [4, 6, 3] where [W, D, H, 2] is needed"),
        (&[("probability", &[4, 6, 3], 1.5)], "array probability: entry 0 is 1.5, not a probability"),
        (&[("probability", &[4, 6, 3], f32::NAN)], "array probability: entry 0 is NaN"),
        (&[("occupancy", &[4, 6, 3, 2], 0.0)], "array occupancy: entry 0 is 0, not evidence"),
        (&[("probability", &[4, 6, 3], 0.5), ("semantics", &[4, 6, 3], 1.0)], "array semantics: has shape [4, 6, 3]"),
        (&[("probability", &[4, 6, 3], 0.5), ("voxel_m", &[1], 7.0)], "array voxel_m: one number from 0.001"),
        (&[("probability", &[0, 6, 3], 0.5)], "array probability: has shape [0, 6, 3]; 1 to"),
    ] {
        let said = files.said("a.npz", &archive(arrays));
        assert!(said.contains(words), "{said}");
    }
    assert!(files.said("a.npz", &sound[..sound.len() / 2]).contains("not a whole NumPy archive"));
    assert!(files.said("a.pcd", &sound).ends_with("is no map that can be read: .bt, .ot, .ply or .npz"));
}

#[test]
fn blank_surroundings_say_nothing_of_the_shelf() {
    let mut blank = Blank::new(2);
    let views = blank.views().expect("its own").clone();
    let frame = blank.frame(&views.views[1], &views.intrinsics).expect("a frame").frame;
    let observation = project(&frame, &Board::default().shelf);
    assert!(observation.free.iter().next().is_none() && observation.occupied.iter().next().is_none());
    assert!(observation.labels.iter().all(|label| *label == crate::camera::UNOBSERVED));
}
