//! Recordings of a simulated shelf, written by a Python program that shares no code with Nudge.

use nudge_core::arm::ArmTool;
use nudge_core::belief::Belief;
use nudge_core::camera::PixelClasses;
use nudge_core::episode::{EpisodeDir, Told};
use nudge_core::plan::Action;
use nudge_tests::{Folder, argument, nudge_ok, root, venv_tool};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A small shelf with three things in it.
pub const SCENE: &str = "format = 1\nname = \"small\"\n[shelf]\nsize = [0.4, 0.3, 0.3]\nvoxel_m = 0.01\n\
    [[object]]\nclass = \"tomato_can\"\nposition = [-0.1, 0.1]\n\
    [[object]]\nclass = \"gelatin_box\"\nposition = [0.08, 0.12]\n\
    [[object]]\nclass = \"mustard_bottle\"\nposition = [0.0, 0.22]\n";
/// Where that shelf is in a recording whose frame is the board's.
pub const BOARD: &str =
    "format = 1\nsize = [0.4, 0.3, 0.3]\nposition = [0, 0, 0]\nquaternion = [0, 0, 0, 1]\nvoxel_m = 0.01\n";
/// Number of frames.
pub const FRAMES: usize = 5;

/// An episode, and recordings of its frames.
pub struct Written {
    pub folder: Folder,
    pub episode: PathBuf,
}

impl Written {
    /// Runs the episode, and has its frames written in the formats of folders; `None` where there shall be no Python.
    pub fn new() -> Option<Self> {
        Self::by("write_recordings.py")
    }

    /// The same as MCAP files.
    pub fn mcaps() -> Option<Self> {
        Self::by("write_mcaps.py")
    }

    fn by(script: &str) -> Option<Self> {
        let python = venv_tool("python")?;
        let folder = Folder::new();
        let (scene, episode) = (folder.write("small.toml", SCENE), folder.path("episode"));
        let budget = FRAMES.to_string();
        let run = ["run", &scene, "--policy", "random", "--budget", &budget, "--out", &argument(&episode)];
        nudge_ok(&run);
        folder.write("board.toml", BOARD);
        let frames = folder.path("frames");
        std::fs::create_dir(&frames).expect("created");
        write_frames(&episode, &frames);
        let script = root().join("tests/python").join(script);
        let written = Command::new(python).arg(script).arg(&frames).arg(folder.path("")).output().expect("python");
        assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
        Some(Self { folder, episode })
    }

    /// Maps a recording as it is, without dropping flying pixels, and returns what was printed.
    pub fn map(&self, name: &str, more: &[&str]) -> String {
        let (recording, out) = (self.folder.name(name), self.folder.name(&format!("{name}-map")));
        let board = self.folder.name("board.toml");
        let command =
            ["map", &recording, "--belief", "classical", "--edge-angle", "0", "--board", &board, "--out", &out];
        nudge_ok(&[&command[..], more].concat())
    }

    /// The beliefs of the episode that was mapped from a recording.
    pub fn mapped(&self, name: &str) -> Vec<Belief> {
        beliefs(&self.folder.path(&format!("{name}-map")))
    }
}

/// All beliefs of an episode as they are filed.
pub fn beliefs(path: &Path) -> Vec<Belief> {
    let directory = EpisodeDir::open(path).expect("opens");
    let steps = directory.record().expect("a record").steps.len();
    (0..=steps).map(|step| directory.read_belief(step).expect("a belief")).collect()
}

/// What the episode's camera gave, as plain numbers.
fn write_frames(episode: &Path, out: &Path) {
    let directory = EpisodeDir::open(episode).expect("opens");
    let record = directory.record().expect("a record");
    let arm = ArmTool::standard(record.scene.shelf);
    let hands = record.view_array().expect("views").hand_poses(&arm);
    let (mut frames, mut camera) = (Vec::new(), json!({}));
    for (at, step) in record.steps.iter().enumerate() {
        let Told::Frame(sensed) = directory.read_told(step).expect("a frame") else { panic!("only looks") };
        let (frame, pose) = (&sensed.frame, sensed.frame.world_from_camera());
        let PixelClasses::Labels(labels) = frame.classes() else { panic!("labels") };
        let depth: Vec<u8> = frame.depth_m().iter().flat_map(|depth| depth.to_le_bytes()).collect();
        std::fs::write(out.join(format!("{at:03}.depth")), depth).expect("written");
        std::fs::write(out.join(format!("{at:03}.label")), labels).expect("written");
        let (q, t) = (pose.rotation, pose.translation);
        let Action::Look { view } = step.action else { panic!("only looks") };
        let joints = hands[usize::from(view.0)].as_ref().map(|hand| hand.joints().to_vec());
        let placed = json!({ "position": [t.x, t.y, t.z], "quaternion": [q.i, q.j, q.k, q.w], "joints": joints });
        frames.push(placed);
        let c = frame.intrinsics();
        let ([fx, fy], [cx, cy]) = (c.focal_px, c.principal_px);
        camera = json!({ "width": c.width, "height": c.height, "fx": fx, "fy": fy, "cx": cx, "cy": cy });
    }
    camera["frames"] = frames.into();
    camera["joints"] = arm.arm.joints.iter().map(|joint| joint.name.clone()).collect();
    std::fs::write(out.join("frames.json"), camera.to_string()).expect("written");
}

/// The numbers that a long recording is to be mapped with. To be run alone, on the machine that they are about.
#[test]
#[ignore = "takes minutes; prints frames a second and memory"]
fn a_hundred_frames_map_at_eight_a_second_in_a_gigabyte() {
    let Some(python) = venv_tool("python") else { return };
    let folder = Folder::new();
    let (episode, frames) = (folder.path("episode"), folder.path("frames"));
    let scene = argument(&root().join("scenes/high/box-wall.toml"));
    let run = ["run", &scene, "--policy", "random", "--noise", "standard", "--budget", "100", "--out"];
    nudge_ok(&[&run[..], &[&argument(&episode)]].concat());
    std::fs::create_dir(&frames).expect("created");
    write_frames(&episode, &frames);
    let script = root().join("tests/python/write_recordings.py");
    let written = Command::new(python).arg(script).arg(&frames).arg(folder.path("")).output().expect("python");
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    let (recording, out) = (folder.name("png"), folder.name("mapped"));
    let mut child = Command::new(nudge_tests::program_bin())
        .args(["map", &recording, "--out", &out])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .expect("nudge starts");
    let mut peak_kb = 0_u64;
    while child.try_wait().expect("waits").is_none() {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kb = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok());
        peak_kb = peak_kb.max(kb.unwrap_or(0));
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    let said = String::from_utf8(child.wait_with_output().expect("ends").stdout).expect("text");
    let rate = said.lines().find_map(|line| line.trim().strip_suffix(" frames a second")).expect("a rate");
    let rate: f64 = rate.rsplit(' ').next().and_then(|number| number.parse().ok()).expect("a number");
    eprintln!("{rate} frames a second, {} MB\n{said}", peak_kb / 1024);
    assert!(rate >= 8.0 && peak_kb <= 1 << 20, "{rate} frames a second, {peak_kb} kB");
}
