//! Maps of other programs: OctoMap's trees, point clouds, NumPy archives.

use super::engine::Target;
use nudge_core::belief::Belief;
use nudge_core::foreign::{read_map, write_map};
use nudge_core::recording::Board;
use nudge_tests::{Folder, root};

/// 20 x 10 x 10 voxels of 1 cm, so that placing a map takes no time.
fn board() -> Board {
    let mut board = Board::default();
    board.shelf.size = [0.2, 0.1, 0.1];
    board.shelf.voxel_m = 0.01;
    board
}

fn run(target: Target<'_>, name: &str) {
    let folder = Folder::new();
    let path = folder.path(name);
    target.run(|bytes| {
        std::fs::write(&path, bytes).expect("written");
        let Ok(map) = read_map(&path) else { return false };
        let _ = map.shelf();
        if let Ok(placed) = map.belief(&board()) {
            assert!(placed.belief.occupancy.as_flattened().iter().all(|a| a.is_finite() && *a > 0.0));
            assert!(placed.belief.semantics.as_flattened().iter().all(|a| a.is_finite() && *a > 0.0));
        }
        true
    });
}

fn tree(name: &str) -> Vec<u8> {
    std::fs::read(root().join("tests/maps").join(name)).expect("a tree")
}

/// A belief of the board as a map.
fn written(name: &str) -> Vec<u8> {
    let folder = Folder::new();
    let mut belief = Belief::uniform(board().shelf.grid());
    for (at, voxel) in belief.occupancy.iter_mut().enumerate() {
        *voxel = [1.0 + (at % 3) as f32, 2.0];
    }
    write_map(&folder.path(name), &belief).expect("written");
    std::fs::read(folder.path(name)).expect("a map")
}

#[test]
fn trees() {
    let words =
        ["# Octomap OcTree binary file\n", "id OcTree\n", "id ColorOcTree\n", "res 1e-4\n", "res inf\n", "data\n"];
    let sound = vec![tree("box.bt"), tree("coarse.bt"), written("a.bt")];
    run(Target { name: "OctoMap .bt", sound, words: &words, inputs: 300 }, "a.bt");
    run(Target { name: "OctoMap .ot", sound: vec![tree("box.ot")], words: &words, inputs: 300 }, "a.ot");
}

#[test]
fn clouds() {
    let text = "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int indices\nelement vertex 3\nproperty float x\n\
                property double y\nproperty float z\nproperty uchar red\nend_header\n3 0 1 2\n1 0\n0 0.05 0.05 255\n\
                0.01 0.05 0.05 0\n1 2 3 9\n";
    let words = [
        "nan",
        "1e999",
        "4294967295",
        "list ",
        "property list uint double x\n",
        "element vertex 0\n",
        "end_header\n",
        "binary_little_endian",
        "binary_big_endian",
        "ascii",
        "-1",
    ];
    run(Target { name: "PLY text", sound: vec![text.into()], words: &words, inputs: 300 }, "a.ply");
    run(Target { name: "PLY binary", sound: vec![written("a.ply")], words: &words, inputs: 200 }, "a.ply");
}

#[test]
fn archives_of_beliefs() {
    let words = ["PK\x01\x02", "PK\x03\x04", "PK\x05\x06", "NUMPY", "occupancy.npy", "probability.npy", "voxel_m.npy"];
    run(Target { name: "npz of a map", sound: vec![written("a.npz")], words: &words, inputs: 300 }, "a.npz");
}
