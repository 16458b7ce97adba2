//! Which topics of an MCAP file are what: a small TOML file, proposed from what is in the recording.
//!
//! ```toml
//! format = 1
//! depth = "/camera/aligned_depth_to_color/image_raw"   # Image or CompressedImage
//! info = "/camera/color/camera_info"                   # CameraInfo of the depth images
//! labels = "/labels"                                   # optional: Image or CompressedImage of numbers
//! fixed_frame = "world"                                # poses from /tf and /tf_static: where this frame is ...
//! camera_frame = "camera_color_optical_frame"          # ... from this one; else the depth images' own
//! # pose = "/camera_pose"                              # or poses from a topic of PoseStamped
//! # joints = "/joint_states"                           # or from a topic of JointState, through the arm's URDF:
//! # robot = "my_arm.urdf"                              # a file beside this one, or gripper or suction
//! # camera_link = "camera_optical"                     # the camera's link there; else the usual names
//! axes = "optical"                                     # optical (z forward) or body (x forward) axes of that frame
//! tolerance_s = 0.02                                   # how far times may be apart
//! depth_unit_m = 0.001                                 # metres per unit of depth images of whole numbers
//! ```

use super::bag::Bag;
use super::labels::toml_error;
use crate::{Error, Result};
use serde::Deserialize;
use std::fmt::Write as _;
use std::path::Path;

/// Axes of the frame that poses are of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Axes {
    /// x right, y down, z forward.
    #[default]
    Optical,
    /// x forward, y left, z up.
    Body,
}

/// Which topics are what.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Topics {
    format: u32,
    pub(super) depth: String,
    pub(super) info: String,
    pub(super) labels: Option<String>,
    pub(super) fixed_frame: Option<String>,
    pub(super) camera_frame: Option<String>,
    pub(super) pose: Option<String>,
    pub(super) joints: Option<String>,
    pub(super) robot: Option<String>,
    pub(super) camera_link: Option<String>,
    #[serde(default)]
    pub(super) axes: Axes,
    pub(super) tolerance_s: Option<f64>,
    pub(super) depth_unit_m: Option<f64>,
}

impl Topics {
    /// Reads a file.
    ///
    /// # Errors
    /// Broken TOML, unknown keys, another format, numbers that are none.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
        let topics: Self = toml::from_str(&text).map_err(|error| toml_error(path, &text, &error))?;
        let fail = |place: &str, words: String| Err(Error::input(path, place, words));
        if topics.format != 1 {
            return fail("format", format!("is {}, this version reads format 1", topics.format));
        }
        if let Some(seconds) = topics.tolerance_s.filter(|s| !(s.is_finite() && *s >= 0.0)) {
            return fail("tolerance_s", format!("is {seconds}, not a number of seconds from 0"));
        }
        if let Some(metres) = topics.depth_unit_m.filter(|m| !(m.is_finite() && *m > 0.0)) {
            return fail("depth_unit_m", format!("is {metres}, not a number of metres above 0"));
        }
        let sources = [&topics.fixed_frame, &topics.pose, &topics.joints];
        if sources.into_iter().filter(|source| source.is_some()).count() != 1 {
            let words = "either fixed_frame (poses from /tf), pose (a topic of PoseStamped) or joints (a topic of JointState) \
                         must be given, and one of them only";
            return fail("", words.to_owned());
        }
        if topics.joints.is_some() != topics.robot.is_some() {
            return fail("robot", "the arm's URDF file belongs to joints, and joints to it".to_owned());
        }
        Ok(topics)
    }

    /// What a recording's content suggests.
    ///
    /// # Errors
    /// In words, what it lacks.
    pub(super) fn proposed(bag: &Bag) -> std::result::Result<Self, String> {
        let depth = bag
            .depth_topics()
            .into_iter()
            .next()
            .ok_or("has no topic of depth images (16UC1, 32FC1 or compressedDepth)")?;
        let info = bag.info_topics(&depth).into_iter().next().ok_or(format!("has no CameraInfo for {depth}"))?;
        let frame = bag.frame_of(&depth).unwrap_or_default();
        let fixed_frame = bag.tree.root_of(&frame).map(str::to_owned);
        let pose = if fixed_frame.is_some() { None } else { bag.pose_topics().into_iter().next() };
        if fixed_frame.is_none() && pose.is_none() {
            return Err(format!("has no poses: nothing in /tf holds frame `{frame}`, and there is no PoseStamped"));
        }
        let labels = bag.label_topics(&depth).into_iter().next();
        let camera_frame = fixed_frame.as_ref().map(|_| frame);
        Ok(Self {
            format: 1,
            depth,
            info,
            labels,
            fixed_frame,
            camera_frame,
            pose,
            joints: None,
            robot: None,
            camera_link: None,
            axes: Axes::Optical,
            tolerance_s: None,
            depth_unit_m: None,
        })
    }

    /// The file's text.
    pub(super) fn to_toml(&self) -> String {
        let mut text = "format = 1\n".to_owned();
        let mut line = |key: &str, value: Option<&String>, why: &str| {
            if let Some(value) = value {
                let _ = writeln!(text, "{:<50} # {why}", format!("{key} = {value:?}"));
            }
        };
        line("depth", Some(&self.depth), "depth images");
        line("info", Some(&self.info), "their camera");
        line("labels", self.labels.as_ref(), "images of class numbers");
        line("fixed_frame", self.fixed_frame.as_ref(), "poses are in this frame of /tf");
        line("camera_frame", self.camera_frame.as_ref(), "the camera's frame");
        line("pose", self.pose.as_ref(), "poses of the camera");
        line("joints", self.joints.as_ref(), "joints of the arm that holds the camera");
        line("robot", self.robot.as_ref(), "that arm's URDF file");
        line("camera_link", self.camera_link.as_ref(), "the camera's link there");
        let axes = if self.axes == Axes::Optical { "optical" } else { "body" };
        line("axes", Some(&axes.to_owned()), "optical: z forward; body: x forward");
        text += &format!("tolerance_s = {}\n", self.tolerance_s.unwrap_or(0.02));
        text += &format!("depth_unit_m = {}\n", self.depth_unit_m.unwrap_or(0.001));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Topics> {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("topics.toml");
        std::fs::write(&file, text).expect("written");
        Topics::read(&file)
    }

    #[test]
    fn topics_come_back_from_their_text_and_wrong_ones_are_told() {
        let good = "format = 1\ndepth = \"/d\"\ninfo = \"/i\"\nfixed_frame = \"world\"\naxes = \"body\"\n";
        let topics = read(good).expect("reads");
        assert_eq!(topics.axes, Axes::Body);
        let again = read(&topics.to_toml()).expect("reads");
        assert_eq!(Topics { tolerance_s: None, depth_unit_m: None, ..again }, topics);
        let cases = [
            ("format = 1", "format = 2", "topics.toml: format: is 2"),
            ("depth", "deph", "topics.toml: line 2: unknown field"),
            ("fixed_frame = \"world\"", "", "topics.toml: either fixed_frame"),
            ("axes", "pose = \"/p\"\naxes", "topics.toml: either fixed_frame"),
            ("fixed_frame = \"world\"", "joints = \"/j\"", "topics.toml: robot: the arm's URDF"),
            ("\"body\"", "\"body\"\ntolerance_s = -1.0", "topics.toml: tolerance_s: is -1"),
            ("\"body\"", "\"body\"\ndepth_unit_m = 0.0", "topics.toml: depth_unit_m: is 0"),
            ("\"body\"", "\"odd\"", "topics.toml: line 5: unknown variant"),
        ];
        for (from, to, said) in cases {
            let line = read(&good.replacen(from, to, 1)).expect_err(to).to_string();
            assert!(line.contains(said) && !line.contains('\n'), "{line}");
        }
    }
}
