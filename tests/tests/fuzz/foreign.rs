//! Recordings that others made: what stands beside the images, and MCAP files.

use super::engine::Target;
use nudge_core::recording::{Board, LabelMap, Recording, Settings, inspect};
use nudge_core::scene::Catalog;
use nudge_tests::Folder;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;
use std::io::Cursor;

const WORDS: [&str; 12] =
    ["nan", "-inf", "1e400", "0", "4097", "[", "]", "{}", "null", "\n", "\"distortion\":[1,2,3,4,5],", "quaternion = "];

/// A frame of 4 x 3 pixels, half a metre before everything.
const DEPTH: [u16; 12] = [500; 12];

fn settings() -> Settings {
    Settings { tolerance_s: 1.0, ..Settings::default() }
}

/// The depth image as a NumPy array.
fn image() -> Vec<u8> {
    let header = "{'descr': '<u2', 'fortran_order': False, 'shape': (3, 4), }";
    let mut image = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    image.extend(format!("{header:<117}\n").into_bytes());
    image.extend(DEPTH.iter().flat_map(|value| value.to_le_bytes()));
    image
}

/// A folder with a depth image, and `name` in it to be changed.
fn target(name: &str, sound: &[u8], more: &[(&str, &str)], inputs: u32) {
    let folder = Folder::new();
    for part in ["depth", "pose"] {
        std::fs::create_dir(folder.path(part)).expect("created");
    }
    for (name, text) in more {
        folder.write(name, text);
    }
    folder.write("depth/000.npy", image());
    folder.write("depth/000000.npy", image());
    Target { name, sound: vec![sound.to_vec()], words: &WORDS, inputs }.run(|file| {
        folder.write(name, file);
        let Ok(recording) = Recording::open(&folder.path(""), settings()) else { return false };
        recording
            .survey(&Board::default())
            .is_ok_and(|survey| survey.used().into_iter().all(|at| recording.frame(at, &Board::default()).is_ok()))
    });
}

const POSE: &str = "0 -0.4 0.2 -0.7071068 0 0 0.7071068\n";
const CAMERA: &str =
    "{ \"width\": 4, \"height\": 3, \"fx\": 3, \"fy\": 3, \"cx\": 1.5, \"cy\": 1, \"depth_scale\": 1000 }";

#[test]
fn files_beside_images() {
    target("intrinsics.json", CAMERA.as_bytes(), &[("pose/000.txt", POSE)], 200);
    target("pose/000.txt", POSE.as_bytes(), &[("intrinsics.json", CAMERA)], 200);
    target("depth/000.npy", &image(), &[("intrinsics.json", CAMERA), ("pose/000.txt", POSE)], 300);
    let transforms = "{\"w\":4,\"h\":3,\"fl_x\":3,\"cx\":2,\"cy\":1.5,\"frames\":[{\"file_path\":\"a.png\",\"depth_file_path\":\
                      \"depth/000.npy\",\"transform_matrix\":[[1,0,0,0],[0,0,-1,-0.4],[0,1,0,0.2],[0,0,0,1]]}]}";
    target("transforms.json", transforms.as_bytes(), &[], 200);
    let bop = "{\"0\":{\"cam_K\":[3,0,1.5,0,3,1,0,0,1],\"depth_scale\":1.0,\"cam_R_w2c\":[1,0,0,0,0,-1,0,1,0],\
               \"cam_t_w2c\":[0,200,400]}}";
    target("scene_camera.json", bop.as_bytes(), &[], 200);
    let depths = ("depth.txt", "# depth\n1.0 depth/000.npy\n");
    let poses = format!("# poses\n1.001 {POSE}");
    target("groundtruth.txt", poses.as_bytes(), &[("intrinsics.json", CAMERA), depths], 200);
}

#[test]
fn boards_and_label_maps() {
    let folder = Folder::new();
    let catalog = Catalog::standard();
    let board = Board::default().to_toml().into_bytes();
    Target { name: "board.toml", sound: vec![board], words: &WORDS, inputs: 300 }.run(|file| {
        folder.write("board.toml", file);
        Board::read(&folder.path("board.toml")).is_ok()
    });
    let map = b"format = 1\n[classes]\n0 = \"background\"\n2 = \"cracker_box\"\n".to_vec();
    Target { name: "labels.toml", sound: vec![map], words: &WORDS, inputs: 300 }.run(|file| {
        folder.write("labels.toml", file);
        LabelMap::read(&folder.path("labels.toml"), &catalog).is_ok()
    });
}

/// Bytes of a message, every number at a multiple of its size.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn put(mut self, bytes: &[u8]) -> Self {
        let start = self.0.len().next_multiple_of(bytes.len().max(1));
        self.0.resize(start, 0);
        self.0.extend(bytes);
        self
    }

    fn u32(self, value: u32) -> Self {
        self.put(&value.to_le_bytes())
    }

    fn f64s(self, values: &[f64]) -> Self {
        values.iter().fold(self, |message, value| message.put(&value.to_le_bytes()))
    }

    fn text(mut self, text: &str) -> Self {
        self = self.u32(text.len() as u32 + 1);
        self.0.extend(text.bytes().chain([0]));
        self
    }

    fn header(self, frame: &str) -> Self {
        self.u32(1).u32(0).text(frame)
    }

    fn whole(self) -> Vec<u8> {
        [&[0, 1, 0, 0][..], &self.0].concat()
    }
}

/// A file with one frame.
fn mcap(in_chunks: bool) -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(None).use_chunks(in_chunks);
    let mut writer = options.create(Cursor::new(Vec::new())).expect("in memory");
    let mut write = |kind: &str, topic: &str, data: Vec<u8>| {
        let schema = writer.add_schema(kind, "ros2msg", b"").expect("a schema");
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("a channel");
        let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, &data).expect("written");
    };
    let placed = |message: Message| message.f64s(&[0.0, -0.4, 0.2, -FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2]);
    let moved = placed(Message::default().u32(1).header("board").text("camera"));
    write("tf2_msgs/msg/TFMessage", "/tf", moved.whole());
    let info = Message::default().header("camera").u32(3).u32(4).text("plumb_bob").u32(0);
    let info = info.f64s(&[3.0, 0.0, 1.5, 0.0, 3.0, 1.0, 0.0, 0.0, 1.0]).f64s(&[0.0; 21]);
    write("sensor_msgs/msg/CameraInfo", "/info", info.whole());
    let image = Message::default().header("camera").u32(3).u32(4).text("16UC1").put(&[0]).u32(8).u32(24);
    let bytes: Vec<u8> = DEPTH.iter().flat_map(|value| value.to_le_bytes()).collect();
    let image = bytes.iter().fold(image, |message, byte| message.put(&[*byte]));
    write("sensor_msgs/msg/Image", "/depth", image.whole());
    writer.finish().expect("finished");
    writer.into_inner().into_inner()
}

#[test]
fn mcap_files() {
    let folder = Folder::new();
    let path = folder.path("a.mcap");
    let sound = vec![mcap(false), mcap(true)];
    Target { name: "mcap", sound, words: &["16UC1", "32FC1", "camera", "board"], inputs: 400 }.run(|file| {
        folder.write("a.mcap", file);
        let _ = inspect(&path);
        let Ok(recording) = Recording::open(&path, settings()) else { return false };
        recording.survey(&Board::default()).is_ok()
    });
}
